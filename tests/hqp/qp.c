/* Plain C test of the QP solver: rough data, no allocation while solving, the same bits whatever was solved
 * before and however much memory there is. Run by test_core.py. */
#include "hqp_qp.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static long allocations;

#ifdef COUNT_ALLOCATIONS
void *__real_malloc(size_t size);
void *__wrap_malloc(size_t size) {
    return allocations++, __real_malloc(size);
}
void *__real_calloc(size_t count, size_t size);
void *__wrap_calloc(size_t count, size_t size) {
    return allocations++, __real_calloc(count, size);
}
void *__real_realloc(void *old, size_t size);
void *__wrap_realloc(void *old, size_t size) {
    return allocations++, __real_realloc(old, size);
}
void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size) {
    return allocations++, __real_aligned_alloc(alignment, size);
}
#endif

enum { N = 11, ROWS = 9 };

static uint64_t state = 88172645463325252u;

static int below(int limit) { /* xorshift64 */
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (int)(state % (uint64_t)limit);
}

/* in -1..1, or, `roughness` times of 1000, a number that hurts */
static double rough(int roughness) {
    static const double hurting[] = {
        0.0,   -0.0, 1e-320,       -1e-160,          1e-100, 1e-9, 1e9, 1e99, -1e99, 1e101,
        1e300, 1.0,  -(double)NAN, (double)INFINITY, 2.0,    1e-6, 1e6, -1.0, 0.5,   -(double)INFINITY};
    if (below(1000) < roughness) return hurting[below(20)];
    return below(3) ? below(2000001) * 1e-6 - 1.0 : 0.0;
}

struct problem {
    double P[N * N], q[N], A[ROWS * N], b[ROWS], G[ROWS * N], h[ROWS], lb[N], ub[N], start[N];
};

static hqp_qp fill(struct problem *p, int roughness) {
    hqp_qp qp = {.n = 1 + below(N), .equalities = below(ROWS) / 3, .inequalities = below(ROWS + 1)};
    const int n = qp.n, rank = below(n + 1);
    double root[N * N];
    for (int i = 0; i < rank * n; i++) root[i] = rough(0);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = rough(roughness / 10) * (below(50) == 0);
            for (int k = 0; k < rank; k++) sum += root[k * n + i] * root[k * n + j];
            p->P[i * n + j] = p->P[j * n + i] = sum;
        }
    }
    for (int i = 0; i < ROWS * N; i++) p->A[i] = rough(roughness), p->G[i] = rough(roughness);
    for (int i = 0; i < ROWS; i++) p->b[i] = rough(roughness), p->h[i] = rough(roughness);
    for (int i = 0; i < N; i++) {
        p->q[i] = rough(roughness);
        p->start[i] = rough(roughness);
        p->lb[i] = below(3) ? -fabs(rough(0)) : -(double)INFINITY;
        p->ub[i] = below(3) ? fabs(rough(0)) : (double)INFINITY;
    }
    qp.P = p->P, qp.q = p->q, qp.A = p->A, qp.b = p->b, qp.G = p->G, qp.h = p->h;
    if (below(4)) qp.lb = p->lb, qp.ub = p->ub;
    if (below(4) == 0) qp.start = p->start;
    return qp;
}

static int fail(const char *what, int round) {
    printf("round %d: %s\n", round, what);
    return 1;
}

int main(int argc, char **argv) {
    const int rounds = argc > 1 ? atoi(argv[1]) : 1000;
    hqp_qp_solver *small = hqp_qp_create(N, 2 * ROWS), *large = hqp_qp_create(3 * N, 5 * ROWS);
    if (!small || !large) return fail("no solver", 0);
    if (hqp_qp_create(0, 1) || hqp_qp_create(1025, 1) || hqp_qp_create(1, 8193)) return fail("sizes", 0);
    const long before = allocations;
    static struct problem p;
    int solved = 0, still = 0; /* still: proven elsewhere, too, where x_0 does not matter */
    for (int round = 0; round < rounds; round++) {
        const hqp_qp qp = fill(&p, round % 3 ? 0 : 20);
        double x[N] = {0.0}, y[N] = {0.0}, multipliers[2 * ROWS + N] = {0.0};
        hqp_qp_answer first = {.x = x, .multipliers = multipliers}, second = {.x = y};
        const hqp_qp_status status = hqp_qp_solve(small, &qp, &first);
        if (status != hqp_qp_solve(large, &qp, &second)) return fail("another status", round);
        if (memcmp(x, y, sizeof x) != 0 || memcmp(&first.objective, &second.objective, sizeof(double)) != 0)
            return fail("other bits", round);
        for (int i = 0; i < qp.n && status == HQP_QP_SOLVED; i++) {
            if (!isfinite(x[i])) return fail("not finite", round);
        }
        solved += status == HQP_QP_SOLVED;
        if (status == HQP_QP_SOLVED && !hqp_qp_is_proven(large, &qp, x, multipliers))
            return fail("no proof", round);
        x[0] += 1e-3 * (1.0 + fabs(x[0]));
        const int moved = hqp_qp_is_proven(small, &qp, x, multipliers);
        still += status == HQP_QP_SOLVED && moved;
    }
    if (allocations != before) return fail("it allocates", rounds);
    if (still > solved / 2) return fail("anything is proven", still);
    if (solved < rounds / 4) return fail("too few are solved", solved);
    hqp_qp_destroy(small);
    hqp_qp_destroy(large);
    puts("passed");
    return 0;
}
