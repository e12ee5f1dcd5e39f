/* The constraints of a QP: bounds, lengths, and the nonzeros of rows that have few. */
#include <string.h>

#include "hqp_qp_internal.h"

static const double MOST = 1e100;
enum { AT_ONCE = 8 };
static const int SMALL = 24;         /* of fewer variables, a row of more than one nonzero is dense */
static const double NOTHING = 1e-10; /* how far a row of zeros may miss its bound */
static const int FEW = 4;            /* a row is sparse where at most one in so many entries is not zero */

/* Nonzeros of a row in [first, last), if there are at most so many of them; else -1. */
static int list(hqp_qp_solver *s, const double *row, int first, int last, int most, int place) {
    int count = 0;
    for (int j = first; j < last; j++) {
        if (row[j] == 0.0) continue;
        if (count == most) return -1;
        s->column[place + count] = j;
        s->coefficient[place + count] = row[j];
        count++;
    }
    return count;
}

typedef unsigned long long loose_bits __attribute__((vector_size(16), aligned(8), may_alias));

/* AT_ONCE entries are +0 or -0 */
static int is_zero(const double *row) {
    loose_bits any = {0, 0};
    for (int k = 0; k < AT_ONCE; k += 2) any |= *(const loose_bits *)(row + k);
    return (any[0] | any[1]) << 1 == 0;
}

/* Extent, norm and nonzeros of a row. Returns the next free place for nonzeros, or -1 for bad numbers. */
static int measure(hqp_qp_solver *s, int id, const double *row, int place) {
    int first = 0, last = s->n;
    while (first + AT_ONCE <= last && is_zero(row + first)) first += AT_ONCE;
    while (first < last && row[first] == 0.0) first++;
    while (first + AT_ONCE <= last && is_zero(row + last - AT_ONCE)) last -= AT_ONCE;
    while (last > first && row[last - 1] == 0.0) last--;
    const double square = hqp_qp_inner(row + first, row + first, last - first);
    if (!(square <= MOST * MOST)) return -1;
    if (square == 0.0 && first < last) return -1; /* too small to be squared */
    s->norm[id] = sqrt(square);
    s->first[id] = first;
    s->last[id] = last;
    s->begin[id] = place;
    const int small = s->n < SMALL, most = small ? 1 : s->n / FEW;
    s->length[id] = small && last - first > 1 ? -1 : list(s, row, first, last, most, place);
    return s->length[id] < 0 ? place : place + s->length[id];
}

/* A row that alone cannot be met is the proof that nothing can. */
static hqp_qp_status accuse(hqp_qp_solver *s, int id, int side) {
    s->id[0] = id;
    s->side[id] = (signed char)side;
    s->multiplier[0] = 1.0;
    s->count = 1;
    return HQP_QP_INFEASIBLE;
}

/* Whether the bounds of a row are numbers and can be met. Bounds that cross by rounding are one; a row of
 * zeros never acts. */
static hqp_qp_status look(hqp_qp_solver *s, int id) {
    const double lo = s->lo[id], hi = s->hi[id];
    if (lo != lo || hi != hi || lo == INFINITY || hi == -INFINITY) return HQP_QP_BAD_DATA;
    if ((hi < INFINITY && fabs(hi) > MOST) || (lo > -INFINITY && fabs(lo) > MOST)) return HQP_QP_BAD_DATA;
    if (s->norm[id] == 0.0) {
        s->lo[id] = -INFINITY;
        s->hi[id] = INFINITY;
        if (hi < -NOTHING) return accuse(s, id, 1);
        return lo > NOTHING ? accuse(s, id, -1) : HQP_QP_SOLVED;
    }
    if (lo <= hi) return HQP_QP_SOLVED;
    if (lo - hi > NOTHING * (1.0 + fabs(hi))) return accuse(s, id, 1);
    s->lo[id] = hi;
    return HQP_QP_SOLVED;
}

static void take_box(hqp_qp_solver *s, int id, int column, int place) {
    s->lo[id] = s->qp.lb ? s->qp.lb[column] : -INFINITY;
    s->hi[id] = s->qp.ub ? s->qp.ub[column] : INFINITY;
    s->begin[id] = place;
    s->length[id] = 1;
    s->first[id] = column;
    s->last[id] = column + 1;
    s->norm[id] = s->coefficient[place] = 1.0;
    s->column[place] = column;
}

/* Constraints of which none alone says that there is no x. */
hqp_qp_status hqp_qp_take(hqp_qp_solver *s) {
    const int k = s->qp.equalities, m = s->qp.inequalities, n = s->n;
    int place = 0;
    hqp_qp_status status = HQP_QP_SOLVED;
    s->rows = k + m + (s->qp.lb || s->qp.ub ? n : 0);
    memset(s->side, 0, (size_t)s->rows);
    memset(s->waived, 0, (size_t)s->rows);
    for (int i = 0; i < s->rows; i++) {
        if (i < k + m) {
            place = measure(s, i, hqp_qp_dense(s, i), place);
            if (place < 0) return HQP_QP_BAD_DATA;
            s->hi[i] = i < k ? s->qp.b[i] : s->qp.h[i - k];
            s->lo[i] = i < k ? s->qp.b[i] : -INFINITY;
        } else {
            take_box(s, i, i - k - m, place++);
        }
        const hqp_qp_status found = look(s, i);
        if (found == HQP_QP_BAD_DATA) return found;
        if (found == HQP_QP_INFEASIBLE) status = found;
    }
    return status;
}

/* c^T x */
double hqp_qp_value(const hqp_qp_solver *s, int id, const double *x) {
    const int length = s->length[id];
    if (length < 0) return hqp_qp_inner(hqp_qp_dense(s, id), x, s->n);
    const int *column = s->column + s->begin[id];
    const double *coefficient = s->coefficient + s->begin[id];
    double sum = 0.0;
    for (int k = 0; k < length; k++) sum += coefficient[k] * x[column[k]];
    return sum;
}

/* sum |c_j x_j| */
double hqp_qp_terms(const hqp_qp_solver *s, int id, const double *x) {
    const int length = s->length[id];
    double sum = 0.0;
    if (length < 0) {
        const double *row = hqp_qp_dense(s, id);
        for (int j = 0; j < s->n; j++) sum += fabs(row[j] * x[j]);
        return sum;
    }
    const int *column = s->column + s->begin[id];
    const double *coefficient = s->coefficient + s->begin[id];
    for (int k = 0; k < length; k++) sum += fabs(coefficient[k] * x[column[k]]);
    return sum;
}

/* s->value, dense rows four at a time */
HQP_QP_INNER void hqp_qp_find_values(hqp_qp_solver *s) {
    const int given = s->qp.equalities + s->qp.inequalities;
    const double *row[4];
    int at[4], count = 0;
    double sum[4];
    for (int i = 0; i < given; i++) {
        if (s->length[i] >= 0) {
            s->value[i] = hqp_qp_value(s, i, s->x);
            continue;
        }
        row[count] = hqp_qp_dense(s, i);
        at[count++] = i;
        if (count < 4) continue;
        hqp_qp_inner4(row, s->x, s->n, sum);
        for (int k = 0; k < 4; k++) s->value[at[k]] = sum[k];
        count = 0;
    }
    for (int k = 0; k < count; k++) s->value[at[k]] = hqp_qp_inner(row[k], s->x, s->n);
    if (s->rows > given) memcpy(s->value + given, s->x, (size_t)s->n * sizeof(double));
}

/* to += factor c */
void hqp_qp_add_row(const hqp_qp_solver *s, int id, double factor, double *to) {
    const int length = s->length[id];
    if (length < 0) {
        hqp_add(to, factor, hqp_qp_dense(s, id), s->n);
        return;
    }
    const int *column = s->column + s->begin[id];
    const double *coefficient = s->coefficient + s->begin[id];
    for (int k = 0; k < length; k++) to[column[k]] += factor * coefficient[k];
}

/* to_j += |factor c_j| */
void hqp_qp_add_sizes(const hqp_qp_solver *s, int id, double factor, double *to) {
    const int length = s->length[id];
    if (length < 0) {
        const double *row = hqp_qp_dense(s, id);
        for (int j = 0; j < s->n; j++) to[j] += fabs(factor * row[j]);
        return;
    }
    const int *column = s->column + s->begin[id];
    const double *coefficient = s->coefficient + s->begin[id];
    for (int k = 0; k < length; k++) to[column[k]] += fabs(factor * coefficient[k]);
}
