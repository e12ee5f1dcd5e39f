/* Plain C test of the solver: rough data, no allocation while solving, the same bits twice and at any
 * alignment. Run by test_core.py. */
#include "hqp.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static long allocations;

#ifdef COUNT_ALLOCATIONS
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *old, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_malloc(size_t size) {
    return allocations++, __real_malloc(size);
}
void *__wrap_calloc(size_t count, size_t size) {
    return allocations++, __real_calloc(count, size);
}
void *__wrap_realloc(void *old, size_t size) {
    return allocations++, __real_realloc(old, size);
}
void *__wrap_aligned_alloc(size_t alignment, size_t size) {
    return allocations++, __real_aligned_alloc(alignment, size);
}
#endif

static uint64_t state;

static uint64_t draw(void) { /* xorshift64 */
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
}

static int below(int limit) {
    return (int)(draw() % (uint64_t)limit);
}
static double uniform(void) {
    return (double)(draw() >> 11) * 0x1p-52 - 1.0;
}

/* a number that hurts now and then: `roughness` of 1000 draws */
static double rough(int roughness) {
    static const double hurting[] = {0.0,    -0.0,  1e-320, -1e-310, 1e-160, 1e-100, 1e-9, 1e9,
                                     -1e100, 1e101, 1e300,  -1e308,  1.0,    1.0,    1e-6, 2.0};
    if (below(1000) >= roughness) return uniform();
    const int i = below(19);
    return i < 16 ? hurting[i] : i == 16 ? (double)NAN : i == 17 ? (double)INFINITY : -(double)INFINITY;
}

enum { LEVELS = 6, ROWS = 9, N = 13, CAP = 8000 }; /* CAP: what is documented for so few variables */

struct problem {
    int equalities[LEVELS], inequalities[LEVELS];
    double A[LEVELS][ROWS * N], b[LEVELS][ROWS], C[LEVELS][ROWS * N], lb[LEVELS][ROWS], ub[LEVELS][ROWS];
    hqp_level levels[LEVELS];
};

/* now and then only one entry of a row: what fixes a variable */
static void keep_one(double *row, int n) {
    const int kept = below(2) ? below(n) : -1;
    for (int i = 0; i < n && kept >= 0; i++) {
        if (i != kept) row[i] = 0.0;
    }
}

static void fill(struct problem *p, int n, int roughness) {
    for (int l = 0; l < LEVELS; l++) {
        for (int i = 0; i < ROWS * N; i++) {
            p->A[l][i] = below(3) ? rough(roughness) : 0.0;
            p->C[l][i] = below(3) ? rough(roughness) : 0.0;
        }
        for (int i = 0; i < ROWS; i++) keep_one((below(4) ? p->A[l] : p->C[l]) + i * n, n);
        for (int i = 0; i < ROWS; i++) {
            p->b[l][i] = rough(roughness);
            p->lb[l][i] = below(4) ? rough(roughness) : -(double)INFINITY;
            p->ub[l][i] = below(4) ? p->lb[l][i] + fabs(rough(roughness)) : (double)INFINITY;
        }
        p->levels[l] = (hqp_level){p->A[l], p->b[l], p->C[l], p->lb[l], p->ub[l], NULL};
    }
}

/* the same problem elsewhere in memory, off by `shift` bytes from the alignment of the first */
static struct problem *copy_shifted(const struct problem *p, size_t shift) {
    static _Alignas(64) char space[sizeof(struct problem) + 64];
    struct problem *q = (struct problem *)(void *)(space + shift);
    memcpy(q, p, sizeof *q);
    for (int l = 0; l < LEVELS; l++)
        q->levels[l] = (hqp_level){q->A[l], q->b[l], q->C[l], q->lb[l], q->ub[l], NULL};
    return q;
}

static void fail(const char *what) {
    printf("failed: %s\n", what);
    exit(1);
}

/* after a reset a solver is as good as new; slacks need not be asked for */
static void check_reset(const hqp_dims *dims, const struct problem *p, hqp_solver *used) {
    hqp_solver *fresh = hqp_create(dims, NULL);
    hqp_info info = {0};
    double x[N], again[N];
    if (!fresh) fail("create");
    hqp_reset(used);
    const hqp_status status = hqp_solve(fresh, p->levels, x, &info);
    if (hqp_solve(used, p->levels, again, &info) != status) fail("status after a reset");
    if (memcmp(x, again, (size_t)dims->n * sizeof(double)) != 0) fail("x after a reset");
    hqp_destroy(fresh);
}

static void one_shape(struct problem *p, int roughness) {
    const int n = 1 + below(N), count = 1 + below(LEVELS);
    for (int l = 0; l < count; l++) {
        p->equalities[l] = below(ROWS + 1);
        p->inequalities[l] = below(ROWS + 1);
    }
    const hqp_dims dims = {n, count, p->equalities, p->inequalities};
    hqp_solver *first = hqp_create(&dims, NULL), *second = hqp_create(&dims, NULL);
    if (!first || !second) fail("create");
    double x[2][N], w[2][LEVELS * ROWS], v[2][LEVELS * ROWS];
    signed char active[2][LEVELS * ROWS];
    memset(w, 0, sizeof w);
    memset(v, 0, sizeof v);
    memset(active, 0, sizeof active);
    hqp_info info[2] = {{.w = w[0], .v = v[0], .active = active[0]},
                        {.w = w[1], .v = v[1], .active = active[1]}};
    for (int tick = 0; tick < 6; tick++) {
        const int from = tick % 3 == 2 ? below(count + 2) - 1 : 0;
        fill(p, n, roughness);
        const long before = allocations;
        const hqp_status status = hqp_resolve(first, p->levels, from, x[0], &info[0]);
        if (allocations != before) fail("a solve allocates");
        const struct problem *shifted = copy_shifted(p, 8 * (size_t)below(8));
        if (hqp_resolve(second, shifted->levels, from, x[1], &info[1]) != status) fail("status repeats");
        if (status != info[0].status || !hqp_status_name(status)) fail("status");
        for (int i = 0; i < n; i++) {
            if (!isfinite(x[0][i])) fail("x is finite");
        }
        if (memcmp(x[0], x[1], (size_t)n * sizeof(double)) != 0) fail("x repeats");
        if (memcmp(active[0], active[1], sizeof active[0]) != 0) fail("active repeats");
        if (status >= 0 && memcmp(w[0], w[1], sizeof w[0]) != 0) fail("w repeats");
        if (status >= 0 && memcmp(v[0], v[1], sizeof v[0]) != 0) fail("v repeats");
        if (info[0].iterations > CAP) fail("iterations are bounded");
    }
    check_reset(&dims, p, first);
    hqp_destroy(first);
    hqp_destroy(second);
}

int main(int argc, char **argv) {
    static struct problem p;
    const int shapes = argc > 1 ? atoi(argv[1]) : 300;
    state = 88172645463325252u;
    for (int i = 0; i < shapes; i++) one_shape(&p, i % 3 == 0 ? 0 : i % 3 == 1 ? 2 : 40);
    const hqp_dims wrong = {0, 1, p.equalities, p.inequalities};
    if (hqp_create(&wrong, NULL)) fail("n = 0 is refused");
    hqp_destroy(NULL);
    puts("passed");
    return 0;
}
