/* What the files of the QP solver share.
 *
 * With P + diag(shift) = L L^T and u = L^T x, a constraint c^T x <= d is the row m = L^-1 c of m^T u <= d,
 * and the objective is a distance. Constraints are numbered: A, then G, then the box.
 */
#ifndef HQP_QP_INTERNAL_H
#define HQP_QP_INTERNAL_H

#include <math.h>
#include <stddef.h>

#include "hqp_internal.h"
#include "hqp_qp.h"

/* Of an inner loop: built once more with AVX2's instructions, without its wide vectors or fused sums, so the
 * bits are the same; the loader takes what the machine has. */
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define HQP_QP_INNER __attribute__((target_clones("avx2", "default")))
#else
#define HQP_QP_INNER
#endif

struct hqp_qp_solver {
    int most_n, most_rows; /* what the memory is for */
    hqp_qp qp;
    int n, rows; /* rows: of A, G and, where there is one, the box */
    int ld;      /* n rounded up to a multiple of 4 */

    /* P + diag(shift) = L L^T. L keeps the envelope of P: row i is zero before from[i]. */
    double *L, *inverse; /* [n][ld], [n]: 1 / its diagonal */
    int *from;
    double *shift; /* [ld] */
    int is_diagonal, is_shifted;
    double largest; /* entry of the diagonal of P */

    /* constraints: lo <= c^T x <= hi */
    double *lo, *hi, *norm; /* [rows] */
    double *value;          /* [rows] c^T x, where it was asked for */
    int *length, *begin;    /* [rows] nonzeros of a sparse row, and where they lie; -1: a dense row */
    int *first, *last;      /* [rows] c is zero outside of columns [first, last) */
    int *column;            /* of the nonzeros of sparse rows */
    double *coefficient;    /* the same */
    signed char *side;      /* held at lo: -1, at hi: 1, else 0 */
    signed char *waived;    /* a combination of held rows that is missed by no more than is allowed */

    /* the working set: held rows, turned so that multipliers are not negative. Behind them, at position
     * `count`, the row that is on its way in. Position k has its data in slot[k]. */
    int count, *id, *slot;
    int *begins, *ends; /* [slot] m is zero outside of this window */
    double *M, *T;      /* [slot][ld] rows m, and lines of T T^T = M M^T */
    double *size, *end; /* [slot] |m|^2, 1 / diagonal of T */
    double *multiplier; /* [position] */
    double *pull;       /* [position] M^T pull is closest to the row behind, */
    double *rest;       /* [ld] this is left of it */
    double *cosine, *sine;

    double *x, *u, *step;     /* [ld] */
    double *center;           /* [ld] of sum shift_i / 2 (x_i - center_i)^2 */
    double *kept;             /* [ld] x before refinement */
    double *gradient, *scale; /* [ld] of the Lagrangian, and the size of its parts */
    double *scratch;          /* [ld] */
    double objective;
    int iterations, iteration_limit;
    double began;
};

typedef enum { HQP_QP_DONE, HQP_QP_CLASH, HQP_QP_CAPPED } hqp_qp_end;

static inline int hqp_qp_is_equality(const hqp_qp_solver *s, int id) {
    return s->lo[id] == s->hi[id];
}

static inline double hqp_qp_bound(const hqp_qp_solver *s, int id, int side) {
    return side < 0 ? s->lo[id] : s->hi[id];
}

/* coefficients of a dense row */
static inline const double *hqp_qp_dense(const hqp_qp_solver *s, int id) {
    const int k = s->qp.equalities;
    return id < k ? s->qp.A + (ptrdiff_t)id * s->n : s->qp.G + (ptrdiff_t)(id - k) * s->n;
}

static inline double *hqp_qp_row(const hqp_qp_solver *s, int k) {
    return s->M + (ptrdiff_t)s->slot[k] * s->ld;
}

static inline double *hqp_qp_line(const hqp_qp_solver *s, int k) {
    return s->T + (ptrdiff_t)s->slot[k] * s->ld;
}

/* Two numbers at once: who reads a pair waits for two that were written one by one. */
static inline void hqp_qp_write(double *to, double low, double high) {
    *(hqp_loose *)to = (hqp_loose){low, high};
}

/* sum a_i b_i over [0, count), anywhere in memory */
static inline double hqp_qp_inner(const double *a, const double *b, int count) {
    hqp_loose sum[4] = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};
    double rest = 0.0;
    int i = 0;
    for (; i + 8 <= count; i += 8) {
        for (int k = 0; k < 4; k++)
            sum[k] += *(const hqp_loose *)(a + i + 2 * k) * *(const hqp_loose *)(b + i + 2 * k);
    }
    for (; i + 2 <= count; i += 2) sum[0] += *(const hqp_loose *)(a + i) * *(const hqp_loose *)(b + i);
    if (i < count) rest = a[i] * b[i];
    const hqp_loose low = sum[0] + sum[2], high = sum[1] + sum[3];
    return (low[0] + low[1]) + (high[0] + high[1]) + rest;
}

/* a -= t0 b0 + t1 b1 + t2 b2 + t3 b3 over [0, count) */
static inline void hqp_qp_take_off(double *a, const double *t, const double *const *b, int count) {
    int i = 0;
    for (; i + 2 <= count; i += 2) {
        hqp_loose left = t[0] * *(const hqp_loose *)(b[0] + i), right = t[1] * *(const hqp_loose *)(b[1] + i);
        left += t[2] * *(const hqp_loose *)(b[2] + i);
        right += t[3] * *(const hqp_loose *)(b[3] + i);
        *(hqp_loose *)(a + i) -= left + right;
    }
    if (i < count) a[i] -= (t[0] * b[0][i] + t[2] * b[2][i]) + (t[1] * b[1][i] + t[3] * b[3][i]);
}

/* sum b_i x_i over [0, count) for four rows b */
static inline void hqp_qp_inner4(const double *const *b, const double *x, int count, double *sum) {
    hqp_loose part[4] = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};
    int i = 0;
    for (; i + 2 <= count; i += 2) {
        const hqp_loose pair = *(const hqp_loose *)(x + i);
        for (int k = 0; k < 4; k++) part[k] += *(const hqp_loose *)(b[k] + i) * pair;
    }
    for (int k = 0; k < 4; k += 2) {
        const hqp_loose low = {part[k][0], part[k + 1][0]}, high = {part[k][1], part[k + 1][1]};
        hqp_loose both = low + high;
        if (i < count) both += (hqp_loose){b[k][i], b[k + 1][i]} * x[i];
        *(hqp_loose *)(sum + k) = both;
    }
}

/* Four steps of forward substitution: y[i .. i + 4) of the rows of a lower triangle, which are zero before
 * `from`. inverse: of their diagonal entries. */
static inline void hqp_qp_forward4(const double *const *row, const double *inverse, double *y, int from,
                                   int i) {
    const double *part[4] = {row[0] + from, row[1] + from, row[2] + from, row[3] + from};
    double sum[4], z[4];
    hqp_qp_inner4(part, y + from, i - from, sum);
    for (int k = 0; k < 4; k++) {
        double left = y[i + k] - sum[k];
        for (int c = 0; c < k; c++) left -= row[k][i + c] * z[c];
        z[k] = left * inverse[k];
    }
    hqp_qp_write(y + i, z[0], z[1]);
    hqp_qp_write(y + i + 2, z[2], z[3]);
}

/* Four steps of backward substitution with the transpose. */
static inline void hqp_qp_backward4(const double *const *row, const double *inverse, double *y, int from,
                                    int i) {
    const double *part[4] = {row[0] + from, row[1] + from, row[2] + from, row[3] + from};
    double z[4] = {y[i], y[i + 1], y[i + 2], y[i + 3]};
    for (int k = 3; k >= 0; k--) {
        z[k] *= inverse[k];
        for (int c = 0; c < k; c++) z[c] -= z[k] * row[k][i + c];
    }
    hqp_qp_write(y + i, z[0], z[1]);
    hqp_qp_write(y + i + 2, z[2], z[3]);
    hqp_qp_take_off(y + from, z, part, i - from);
}

/* hqp_qp_data.c: constraints as the caller gives them */
hqp_qp_status hqp_qp_take(hqp_qp_solver *s);
double hqp_qp_value(const hqp_qp_solver *s, int id, const double *x);
double hqp_qp_terms(const hqp_qp_solver *s, int id, const double *x);
void hqp_qp_find_values(hqp_qp_solver *s);
void hqp_qp_add_row(const hqp_qp_solver *s, int id, double factor, double *to);
void hqp_qp_add_sizes(const hqp_qp_solver *s, int id, double factor, double *to);

/* hqp_qp_factor.c: L */
hqp_qp_status hqp_qp_read(hqp_qp_solver *s);
void hqp_qp_bend(const hqp_qp_solver *s, const double *x, double *to);
void hqp_qp_bend_sizes(const hqp_qp_solver *s, const double *x, double *to);
int hqp_qp_factorise(hqp_qp_solver *s, double least);
void hqp_qp_forward(const hqp_qp_solver *s, double *y, int first);
void hqp_qp_backward(const hqp_qp_solver *s, double *y);

/* hqp_qp_dual.c: the dual active-set method */
void hqp_qp_clear(hqp_qp_solver *s);
void hqp_qp_seat(hqp_qp_solver *s, int id, int side);
void hqp_qp_settle(hqp_qp_solver *s);
void hqp_qp_newton(hqp_qp_solver *s, double *down, double *gap);
void hqp_qp_refresh(hqp_qp_solver *s);
hqp_qp_end hqp_qp_descend(hqp_qp_solver *s);
double hqp_qp_allowance(const hqp_qp_solver *s, int id, double bound);

#endif
