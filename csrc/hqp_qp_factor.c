/* The Cholesky factor of P + shift I within the envelope of P, row by row. */
#include <string.h>

#include "hqp_qp_internal.h"

static const double SYMMETRIC = 1e-9; /* of the largest entry of P */
static const double MOST = 1e100;
enum { TILE = 16, BLOCK = 4 };

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

/* The inner products of four rows with two others over [from, to). */
static inline void products(double *const *a, const double *const *b, int from, int to, double *sum) {
    hqp_loose part[BLOCK][2] = {{{0.0, 0.0}}};
    int i = from;
    for (; i + 2 <= to; i += 2) {
        const hqp_loose left = *(const hqp_loose *)(b[0] + i), right = *(const hqp_loose *)(b[1] + i);
        for (int k = 0; k < BLOCK; k++) {
            const hqp_loose pair = *(const hqp_loose *)(a[k] + i);
            part[k][0] += pair * left;
            part[k][1] += pair * right;
        }
    }
    for (int k = 0; k < 2 * BLOCK; k++) {
        sum[k] = part[k / 2][k % 2][0] + part[k / 2][k % 2][1];
        if (i < to) sum[k] += a[k / 2][i] * b[k % 2][i];
    }
}

/* The diagonal entry of row i, whose square is `pivot`. Returns 0 where that is too small a part of P's. */
static int close_row(hqp_qp_solver *s, int i, double pivot, double least) {
    const double all = s->qp.P[(ptrdiff_t)i * s->n + i] + s->shift;
    if (!(pivot > least * all) || !(pivot > 0.0)) return 0;
    const double root = sqrt(pivot);
    s->L[(ptrdiff_t)i * s->ld + i] = root;
    s->inverse[i] = 1.0 / root;
    return 1;
}

/* Row i of L alone. */
static int fill_row(hqp_qp_solver *s, int i, double least) {
    const int start = s->from[i];
    double *row = s->L + (ptrdiff_t)i * s->ld;
    const double *given = s->qp.P + (ptrdiff_t)i * s->n;
    memset(row, 0, (size_t)i * sizeof(double));
    for (int j = start; j < i; j++) {
        const int both = start > s->from[j] ? start : s->from[j];
        const double *other = s->L + (ptrdiff_t)j * s->ld;
        row[j] = (given[j] - (both < j ? hqp_qp_inner(row + both, other + both, j - both) : 0.0)) * s->inverse[j];
    }
    return close_row(s, i, given[i] + s->shift - hqp_qp_inner(row + start, row + start, i - start), least);
}

/* The square block of columns [i, i + BLOCK) of these rows, all before it known from `start` on. */
static int close_block(hqp_qp_solver *s, int i, double *const *row, int start, double least) {
    double sum[BLOCK / 2][2 * BLOCK];
    for (int k = 0; k < BLOCK / 2; k++)
        products(row, (const double *const[]){row[2 * k], row[2 * k + 1]}, start, i, sum[k]);
    for (int k = 0; k < BLOCK; k++) {
        const double *given = s->qp.P + (ptrdiff_t)(i + k) * s->n + i;
        for (int l = 0; l <= k; l++) {
            double left = given[l] - sum[l / 2][2 * k + l % 2];
            for (int c = 0; c < l; c++) left -= row[k][i + c] * row[l][i + c];
            if (l < k) row[k][i + l] = left * s->inverse[i + l];
            if (l == k && !close_row(s, i + k, left + s->shift, least)) return 0;
        }
    }
    return 1;
}

/* BLOCK rows of L from row i on, two columns at a time. */
static int fill_rows(hqp_qp_solver *s, int i, double least) {
    const ptrdiff_t ld = s->ld, n = s->n;
    double *row[BLOCK], sum[2 * BLOCK];
    int start = i;
    for (int k = 0; k < BLOCK; k++) {
        row[k] = s->L + (i + k) * ld;
        start = s->from[i + k] < start ? s->from[i + k] : start;
        memset(row[k], 0, (size_t)(i + k) * sizeof(double));
    }
    for (int j = start & ~1; j < i; j += 2) {
        const double *other[2] = {s->L + j * ld, s->L + (j + 1) * ld};
        const int first = s->from[j] < s->from[j + 1] ? s->from[j] : s->from[j + 1];
        const double below = other[1][j];
        products(row, other, first > start ? first : start, j, sum);
        for (int k = 0; k < BLOCK; k++) {
            const double *given = s->qp.P + (i + k) * n + j;
            row[k][j] = (given[0] - sum[2 * k]) * s->inverse[j];
            row[k][j + 1] = (given[1] - sum[2 * k + 1] - row[k][j] * below) * s->inverse[j + 1];
        }
    }
    return close_block(s, i, row, start & ~1, least);
}

/* Returns 0 where a pivot falls to `least` of its diagonal entry or below. */
int hqp_qp_factorise(hqp_qp_solver *s, double shift, double least) {
    int i = 0;
    s->shift = shift;
    for (; i + BLOCK <= s->n; i += BLOCK) {
        if (!fill_rows(s, i, least)) return 0;
    }
    for (; i < s->n; i++) {
        if (!fill_row(s, i, least)) return 0;
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
