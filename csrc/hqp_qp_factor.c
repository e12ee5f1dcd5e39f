/* The Cholesky factor of P + shift I within the envelope of P, row by row. */
#include <string.h>

#include "hqp_qp_internal.h"

static const double SYMMETRIC = 1e-9; /* of the largest entry of P */
static const double MOST = 1e100;
enum { TILE = 16 };

/* |P_ij - P_ji| is at most this, with P read in tiles that fit the cache. */
static int is_symmetric(const double *P, int n, double most) {
    int skew = 0;
    for (int top = 0; top < n; top += TILE) {
        for (int left = 0; left <= top; left += TILE) {
            for (int i = top; i < top + TILE && i < n; i++) {
                const int end = left + TILE < i ? left + TILE : i;
                for (int j = left; j < end; j++)
                    skew |= fabs(P[(ptrdiff_t)i * n + j] - P[(ptrdiff_t)j * n + i]) > most;
            }
        }
    }
    return !skew;
}

/* Look at P: finite, symmetric; its envelope. No entry of a convex P is larger than those of its diagonal. */
hqp_qp_status hqp_qp_read(hqp_qp_solver *s) {
    const int n = s->n;
    const double *P = s->qp.P;
    double squares = 0.0, largest = 0.0;
    s->is_diagonal = 1;
    for (int i = 0; i < n; i++) {
        const double *row = P + (ptrdiff_t)i * n;
        int j = 0;
        while (j < i && row[j] == 0.0) j++;
        s->from[i] = j;
        s->is_diagonal &= j == i;
        squares += hqp_qp_inner(row, row, n);
        largest = row[i] > largest ? row[i] : largest;
    }
    s->largest = largest;
    if (!(squares + hqp_qp_inner(s->qp.q, s->qp.q, n) <= MOST * MOST)) return HQP_QP_BAD_DATA;
    if (!is_symmetric(P, n, SYMMETRIC * sqrt(squares))) return HQP_QP_NOT_SYMMETRIC;
    return largest == 0.0 && squares > 0.0 ? HQP_QP_NOT_CONVEX : HQP_QP_SOLVED;
}

/* The inner products of two rows with two others over [from, to). */
static inline void products(const double *const *a, const double *const *b, int from, int to, double *sum) {
    hqp_loose part[4] = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};
    int i = from;
    for (; i + 2 <= to; i += 2) {
        const hqp_loose a0 = *(const hqp_loose *)(a[0] + i), a1 = *(const hqp_loose *)(a[1] + i);
        const hqp_loose b0 = *(const hqp_loose *)(b[0] + i), b1 = *(const hqp_loose *)(b[1] + i);
        part[0] += a0 * b0;
        part[1] += a0 * b1;
        part[2] += a1 * b0;
        part[3] += a1 * b1;
    }
    for (int k = 0; k < 4; k++) {
        sum[k] = part[k][0] + part[k][1];
        if (i < to) sum[k] += a[k / 2][i] * b[k % 2][i];
    }
}

static int close_row(hqp_qp_solver *s, int i, double least) {
    double *row = s->L + (ptrdiff_t)i * s->ld;
    const int from = s->from[i];
    const double all = s->qp.P[(ptrdiff_t)i * s->n + i] + s->shift;
    const double pivot = all - hqp_qp_inner(row + from, row + from, i - from);
    if (!(pivot > least * all) || !(pivot > 0.0)) return 0;
    row[i] = sqrt(pivot);
    s->inverse[i] = 1.0 / row[i];
    return 1;
}

/* Columns [from, to) of row i of L, all columns before them known. */
static void fill_row(hqp_qp_solver *s, int i, int from, int to) {
    double *row = s->L + (ptrdiff_t)i * s->ld;
    const double *given = s->qp.P + (ptrdiff_t)i * s->n;
    for (int j = from; j < to; j++) {
        const int both = s->from[i] > s->from[j] ? s->from[i] : s->from[j];
        const double *other = s->L + (ptrdiff_t)j * s->ld;
        row[j] = (given[j] - (both < j ? hqp_qp_inner(row + both, other + both, j - both) : 0.0)) * s->inverse[j];
    }
}

/* Rows i and i + 1 of L up to column i, in blocks of two columns. */
static void fill_rows(hqp_qp_solver *s, int i) {
    const ptrdiff_t ld = s->ld, n = s->n;
    double *row[2] = {s->L + i * ld, s->L + (i + 1) * ld}, sum[4];
    const double *given[2] = {s->qp.P + i * n, s->qp.P + (i + 1) * n};
    const int start = s->from[i] < s->from[i + 1] ? s->from[i] : s->from[i + 1];
    for (int k = 0; k < 2; k++) memset(row[k], 0, (size_t)(i + 2) * sizeof(double));
    for (int j = start & ~1; j < i; j += 2) {
        const double *other[2] = {s->L + j * ld, s->L + (j + 1) * ld};
        const int first = s->from[j] < s->from[j + 1] ? s->from[j] : s->from[j + 1];
        const double below = other[1][j];
        products((const double *const *)row, other, first > start ? first : start, j, sum);
        for (int k = 0; k < 2; k++) {
            row[k][j] = (given[k][j] - sum[2 * k]) * s->inverse[j];
            row[k][j + 1] = (given[k][j + 1] - sum[2 * k + 1] - row[k][j] * below) * s->inverse[j + 1];
        }
    }
}

/* Returns 0 where a pivot falls to `least` of its diagonal entry or below. */
int hqp_qp_factorise(hqp_qp_solver *s, double shift, double least) {
    s->shift = shift;
    for (int i = 0; i < s->n; i += 2) {
        if (i + 1 == s->n) {
            memset(s->L + (ptrdiff_t)i * s->ld, 0, (size_t)i * sizeof(double));
            fill_row(s, i, s->from[i], i);
            return close_row(s, i, least);
        }
        fill_rows(s, i);
        if (!close_row(s, i, least)) return 0;
        fill_row(s, i + 1, i, i + 1);
        if (!close_row(s, i + 1, least)) return 0;
    }
    return 1;
}

/* y = L^-1 y; y is zero before `first` */
void hqp_qp_forward(const hqp_qp_solver *s, double *y, int first) {
    for (int i = first; i < s->n; i++) {
        const int from = s->from[i] > first ? s->from[i] : first;
        const double *row = s->L + (ptrdiff_t)i * s->ld;
        y[i] = (y[i] - hqp_qp_inner(row + from, y + from, i - from)) * s->inverse[i];
    }
}

/* y = L^-T y */
void hqp_qp_backward(const hqp_qp_solver *s, double *y) {
    for (int i = s->n - 1; i >= 0; i--) {
        const int from = s->from[i];
        y[i] *= s->inverse[i];
        hqp_add(y + from, -y[i], s->L + (ptrdiff_t)i * s->ld + from, i - from);
    }
}
