/* The Cholesky factor of P + shift I within the envelope of P, row by row. */
#include <string.h>

#include "hqp_qp_internal.h"

static const double SYMMETRIC = 1e-9; /* of the largest entry of P */
static const double MOST = 1e100;
enum { TILE = 16 };

/* Largest |P_ij - P_ji|, with P read in tiles that fit the cache. */
static double skewness(const double *P, int n) {
    double most = 0.0;
    for (int top = 0; top < n; top += TILE) {
        for (int left = 0; left <= top; left += TILE) {
            for (int i = top; i < top + TILE && i < n; i++) {
                for (int j = left; j < left + TILE && j < i; j++)
                    most = fmax(most, fabs(P[(ptrdiff_t)i * n + j] - P[(ptrdiff_t)j * n + i]));
            }
        }
    }
    return most;
}

/* Look at P: finite, symmetric; its envelope. */
hqp_qp_status hqp_qp_read(hqp_qp_solver *s) {
    const int n = s->n;
    const double *P = s->qp.P;
    double largest = 0.0, sum = 0.0;
    s->largest = 0.0;
    s->is_diagonal = 1;
    for (int i = 0; i < n; i++) {
        const double *row = P + (ptrdiff_t)i * n;
        int j = 0;
        while (j < i && row[j] == 0.0) j++;
        s->from[i] = j;
        s->is_diagonal &= j == i;
        for (j = 0; j < n; j++) {
            const double size = fabs(row[j]);
            sum += size;
            largest = size > largest ? size : largest;
        }
        sum += fabs(s->qp.q[i]);
        s->largest = row[i] > s->largest ? row[i] : s->largest;
    }
    if (!(sum <= MOST)) return HQP_QP_BAD_DATA;
    if (skewness(P, n) > SYMMETRIC * largest) return HQP_QP_NOT_SYMMETRIC;
    return s->largest == 0.0 && largest > 0.0 ? HQP_QP_NOT_CONVEX : HQP_QP_SOLVED;
}

/* Returns 0 where a pivot falls to `least` of its diagonal entry or below. */
int hqp_qp_factorise(hqp_qp_solver *s, double shift, double least) {
    const int n = s->n;
    s->shift = shift;
    for (int i = 0; i < n; i++) {
        double *row = s->L + (ptrdiff_t)i * s->ld;
        const double *given = s->qp.P + (ptrdiff_t)i * n;
        const int start = s->from[i];
        double pivot = given[i] + shift;
        const double all = pivot;
        for (int j = start; j < i; j++) {
            const int both = start > s->from[j] ? start : s->from[j];
            const double *other = s->L + (ptrdiff_t)j * s->ld;
            row[j] = (given[j] - hqp_qp_inner(row + both, other + both, j - both)) * s->inverse[j];
        }
        pivot -= hqp_qp_inner(row + start, row + start, i - start);
        if (!(pivot > least * all) || !(pivot > 0.0)) return 0;
        row[i] = sqrt(pivot);
        s->inverse[i] = 1.0 / row[i];
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
