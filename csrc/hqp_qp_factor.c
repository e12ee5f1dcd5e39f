/* The Cholesky factor of P + diag(shift) within the envelope of P, row by row. */
#include <string.h>

#include "hqp_qp_internal.h"

static const double SYMMETRIC = 1e-9; /* of |P|, Frobenius: less is left of P - P^T below the diagonal */
static const double MOST = 1e100;
static const double LEAST = 1e-300; /* a P of zeros is symmetric */
enum { TILE = 16, BLOCK = 4 };

/* The sum of (unit (P_ij - P_ji))^2 over i > j, which no tiny P makes 0 by rounding, with P read in tiles
 * that fit the cache. */
static double find_skew(const double *P, ptrdiff_t n, double unit) {
    double skew = 0.0;
    for (ptrdiff_t top = 0; top < n; top += TILE) {
        for (ptrdiff_t left = 0; left <= top; left += TILE) {
            for (ptrdiff_t i = top; i < top + TILE && i < n; i++) {
                const ptrdiff_t end = left + TILE < i ? left + TILE : i;
                const double *row = P + i * n, *column = P + i;
                hqp_loose part = {0.0, 0.0};
                double odd = 0.0;
                ptrdiff_t j = left;
                for (; j + 2 <= end; j += 2) {
                    const hqp_loose mirrored = {column[j * n], column[(j + 1) * n]};
                    const hqp_loose gap = (*(const hqp_loose *)(row + j) - mirrored) * unit;
                    part += gap * gap;
                }
                if (j < end) odd = (row[j] - column[j * n]) * unit;
                skew += part[0] + part[1] + odd * odd;
            }
        }
    }
    return skew;
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
    if (!(find_skew(P, n, 1.0 / (SYMMETRIC * sqrt(squares) + LEAST)) <= 1.0)) return HQP_QP_NOT_SYMMETRIC;
    return largest == 0.0 && squares > 0.0 ? HQP_QP_NOT_CONVEX : HQP_QP_SOLVED;
}

/* to = P x */
HQP_QP_INNER void hqp_qp_bend(const hqp_qp_solver *s, const double *x, double *to) {
    const ptrdiff_t n = s->n;
    int i = 0;
    for (; i + 4 <= n; i += 4) {
        const double *row = s->qp.P + i * n, *rows[4] = {row, row + n, row + 2 * n, row + 3 * n};
        hqp_qp_inner4(rows, x, s->n, to + i);
    }
    for (; i < n; i++) to[i] = hqp_qp_inner(s->qp.P + i * n, x, s->n);
}

/* to_i = sum over j of |P_ij x_j| */
void hqp_qp_bend_sizes(const hqp_qp_solver *s, const double *x, double *to) {
    for (int i = 0; i < s->n; i++) {
        const double *row = s->qp.P + (ptrdiff_t)i * s->n;
        double sum = 0.0;
        for (int j = 0; j < s->n; j++) sum += fabs(row[j] * x[j]);
        to[i] = sum;
    }
}

/* The inner products of BLOCK rows with two others over [from, to), both even. */
static inline void products(double *const *a, const double *left, const double *right, int from, int to,
                            hqp_loose *sum) {
    hqp_loose part[BLOCK][2] = {{{0.0, 0.0}}};
    for (ptrdiff_t i = from; i < to; i += 2) {
        const hqp_loose l = *(const hqp_loose *)(left + i), r = *(const hqp_loose *)(right + i);
        for (int k = 0; k < BLOCK; k++) {
            const hqp_loose pair = *(const hqp_loose *)(a[k] + i);
            part[k][0] += pair * l;
            part[k][1] += pair * r;
        }
    }
    for (int k = 0; k < BLOCK; k++) {
        const hqp_loose low = {part[k][0][0], part[k][1][0]}, high = {part[k][0][1], part[k][1][1]};
        sum[k] = low + high;
    }
}

/* The diagonal entry of row i, whose square is `pivot`. Returns 0 where that is too small a part of P's. */
static int close_row(hqp_qp_solver *s, int i, double pivot, double least) {
    const double all = s->qp.P[(ptrdiff_t)i * s->n + i] + s->shift[i];
    if (!(pivot > least * all) || !(pivot > 0.0)) return 0;
    const double root = sqrt(pivot);
    s->L[(ptrdiff_t)i * s->ld + i] = root;
    s->inverse[i] = 1.0 / root;
    return 1;
}

/* The square block of columns [i, i + count) of rows that are known in [start, i). */
static int close_block(hqp_qp_solver *s, int i, int count, double *const *row, int start, double least) {
    hqp_loose sum[BLOCK / 2][BLOCK];
    for (int c = 0; c < BLOCK / 2; c++) products(row, row[2 * c], row[2 * c + 1], start, i, sum[c]);
    for (int k = 0; k < count; k++) {
        const double *given = s->qp.P + (ptrdiff_t)(i + k) * s->n + i;
        for (int l = 0; l <= k; l++) {
            double left = given[l] - sum[l / 2][k][l % 2];
            for (int c = 0; c < l; c++) left -= row[k][i + c] * row[l][i + c];
            if (l < k) row[k][i + l] = left * s->inverse[i + l];
            if (l == k && !close_row(s, i + k, left + s->shift[i + k], least)) return 0;
        }
    }
    return 1;
}

/* `count` rows of L from row i on, two columns at a time. What a block has too many of is the last row again.
 */
HQP_QP_INNER static int fill_rows(hqp_qp_solver *s, int i, int count, double least) {
    const ptrdiff_t ld = s->ld, n = s->n;
    const double *given[BLOCK];
    double *row[BLOCK];
    hqp_loose sum[BLOCK];
    int start = i;
    for (int k = 0; k < BLOCK; k++) {
        const int id = i + (k < count ? k : count - 1);
        row[k] = s->L + id * ld;
        given[k] = s->qp.P + id * n;
        start = s->from[id] < start ? s->from[id] : start;
        memset(row[k], 0, (size_t)id * sizeof(double));
    }
    start &= ~1;
    for (int j = start; j < i; j += 2) {
        const double *left = s->L + j * ld, *right = left + ld;
        const int from = (s->from[j] < s->from[j + 1] ? s->from[j] : s->from[j + 1]) & ~1;
        products(row, left, right, from > start ? from : start, j, sum);
        for (int k = 0; k < BLOCK; k++) {
            const hqp_loose rest = *(const hqp_loose *)(given[k] + j) - sum[k];
            const double entry = rest[0] * s->inverse[j];
            hqp_qp_write(row[k] + j, entry, (rest[1] - entry * right[j]) * s->inverse[j + 1]);
        }
    }
    return close_block(s, i, count, row, start, least);
}

/* Returns 0 where a pivot falls to `least` of its diagonal entry or below. */
int hqp_qp_factorise(hqp_qp_solver *s, double least) {
    for (int i = 0; i < s->n; i += BLOCK) {
        if (!fill_rows(s, i, s->n - i < BLOCK ? s->n - i : BLOCK, least)) return 0;
    }
    return 1;
}

/* Pointers to four rows of L. Returns where the first of them begins. */
static int four_rows(const hqp_qp_solver *s, int i, const double **row) {
    int from = i;
    for (int k = 0; k < 4; k++) {
        row[k] = s->L + (ptrdiff_t)(i + k) * s->ld;
        from = s->from[i + k] < from ? s->from[i + k] : from;
    }
    return from;
}

/* y = L^-1 y; y is zero before `first` */
HQP_QP_INNER void hqp_qp_forward(const hqp_qp_solver *s, double *y, int first) {
    const double *row[4];
    int i = first & ~3;
    for (; i + 4 <= s->n; i += 4) {
        const int from = four_rows(s, i, row);
        hqp_qp_forward4(row, s->inverse + i, y, from, i);
    }
    for (; i < s->n; i++) {
        const int from = s->from[i];
        const double *last = s->L + (ptrdiff_t)i * s->ld;
        y[i] = (y[i] - hqp_qp_inner(last + from, y + from, i - from)) * s->inverse[i];
    }
}

/* y = L^-T y */
HQP_QP_INNER void hqp_qp_backward(const hqp_qp_solver *s, double *y) {
    const double *row[4];
    int i = s->n;
    for (; i % 4; i--) {
        const int from = s->from[i - 1];
        y[i - 1] *= s->inverse[i - 1];
        hqp_add(y + from, -y[i - 1], s->L + (ptrdiff_t)(i - 1) * s->ld + from, i - 1 - from);
    }
    for (i -= 4; i >= 0; i -= 4) {
        const int from = four_rows(s, i, row);
        hqp_qp_backward4(row, s->inverse + i, y, from, i);
    }
}
