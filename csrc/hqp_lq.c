/*
 * One orthogonal factorisation shared by all levels: rows are reduced from the right by Householder
 * reflectors, [rows] Q = [L 0], so that the columns of Q after the first `top` span what these rows leave
 * free. Row-oriented, hence backward stable row by row whatever the rows' scales (Golub, Van Loan, Matrix
 * Computations, section 5.2).
 */
#include "hqp_internal.h"

#include <string.h>

/* of a row's norm: with less left of it, it waits, */
static const real LITTLE = 0.03;
/* and with less of that until those are in of which more is left */
static const real WAITING[] = {LITTLE, 3e-3, 3e-4, 3e-5, 1e-6, 0.0};
enum { PASSES = sizeof WAITING / sizeof *WAITING };
static const real FAINT = 1e-4; /* the same: a direction that is hardly seen */
static const real NOISE = 20.0; /* roundings of a number that a row may be wrong by, times its norm */

/* row -= (row . v) v */
static void reflect_row(const hqp_solver *s, int k, real *row) {
    const real *v = hqp_row(s, s->reflector, k);
    const int from = s->reflector.first[k], to = s->reflector.last[k];
    hqp_axpy(row, -hqp_dot(row, v, from, to), v, from, to);
}

/* Let the window of row r cover this one; returns 0, and changes nothing, where they do not meet. */
static int widen(hqp_rows rows, int r, int from, int to) {
    if (rows.last[r] <= from || rows.first[r] >= to) return 0;
    if (rows.first[r] > from) rows.first[r] = from;
    if (rows.last[r] < to) rows.last[r] = to;
    return 1;
}

/* rows[idx] H_k; rows that do not meet the reflector's window are left alone */
static void reflect(const hqp_solver *s, int k, hqp_rows rows, const int *idx, int count) {
    const int from = s->reflector.first[k], to = s->reflector.last[k];
    real *batch[4];
    int filled = 0;
    for (int i = 0; i < count; i++) {
        if (!widen(rows, idx[i], from, to)) continue;
        batch[filled++] = hqp_row(s, rows, idx[i]);
        if (filled < 4) continue;
        hqp_reflect_four(batch, hqp_row(s, s->reflector, k), from, to);
        filled = 0;
    }
    for (int i = 0; i < filled; i++) reflect_row(s, k, batch[i]);
}

/*
 * Reflectors k .. k + 3, of one window, as one (Schreiber, Van Loan 1989): their products with `count` rows,
 * which then lose a combination of all four. With `back` they come in the order H_{k+3} .. H_k.
 */
static inline void reflect_by_four(const hqp_solver *s, int k, int back, real *const *rows, const int count) {
    const int from = s->reflector.first[k], to = s->reflector.last[k];
    const real *const v = hqp_row(s, s->reflector, k), *const w = v + s->ld, *const y = w + s->ld,
                      *const z = y + s->ld;
    const real *const of_w = s->cross + 4 * (k + 1), *const of_y = of_w + 4, *const of_z = of_y + 4;
    hqp_lanes sum[HQP_ROWS_AT_ONCE][4];
    real t[HQP_ROWS_AT_ONCE][4];
    for (int r = 0; r < count; r++) {
        for (int j = 0; j < 4; j++) sum[r][j] = hqp_no_lanes();
    }
    for (int i = from; i < to; i += HQP_LANES) {
        const hqp_lanes vi = hqp_load(v + i), wi = hqp_load(w + i);
        const hqp_lanes yi = hqp_load(y + i), zi = hqp_load(z + i);
        for (int r = 0; r < count; r++) {
            const hqp_lanes a = hqp_load(rows[r] + i);
            sum[r][0] = hqp_with_product(sum[r][0], a, vi);
            sum[r][1] = hqp_with_product(sum[r][1], a, wi);
            sum[r][2] = hqp_with_product(sum[r][2], a, yi);
            sum[r][3] = hqp_with_product(sum[r][3], a, zi);
        }
    }
    for (int r = 0; r < count; r++) {
        real *const in = t[r];
        for (int j = 0; j < 4; j++) in[j] = hqp_total(sum[r][j]);
        if (back) {
            in[2] -= in[3] * of_z[2];
            in[1] -= in[3] * of_z[1] + in[2] * of_y[1];
            in[0] -= in[3] * of_z[0] + in[2] * of_y[0] + in[1] * of_w[0];
        } else {
            in[1] -= in[0] * of_w[0];
            in[2] -= in[0] * of_y[0] + in[1] * of_y[1];
            in[3] -= in[0] * of_z[0] + in[1] * of_z[1] + in[2] * of_z[2];
        }
    }
    for (int i = from; i < to; i += HQP_LANES) {
        const hqp_lanes vi = hqp_load(v + i), wi = hqp_load(w + i);
        const hqp_lanes yi = hqp_load(y + i), zi = hqp_load(z + i);
        for (int r = 0; r < count; r++) {
            const real *const in = t[r];
            const hqp_lanes left = hqp_plus(hqp_scaled(in[0], vi), hqp_scaled(in[1], wi));
            const hqp_lanes right = hqp_plus(hqp_scaled(in[2], yi), hqp_scaled(in[3], zi));
            hqp_store(rows[r] + i, hqp_minus(hqp_load(rows[r] + i), hqp_plus(left, right)));
        }
    }
}

/* The same for one row. */
static void reflect_one(const hqp_solver *s, int k, int back, real *row) {
    reflect_by_four(s, k, back, &row, 1);
}

/* The same for rows[idx]; those that do not meet the reflectors' window are left alone. */
static void reflect_rows_by_four(const hqp_solver *s, int k, int back, hqp_rows rows, const int *idx,
                                 int count) {
    const int from = s->reflector.first[k], to = s->reflector.last[k];
    real *batch[HQP_ROWS_AT_ONCE];
    int filled = 0;
    for (int i = 0; i < count; i++) {
        if (!widen(rows, idx[i], from, to)) continue;
        batch[filled++] = hqp_row(s, rows, idx[i]);
        if (filled < HQP_ROWS_AT_ONCE) continue;
        reflect_by_four(s, k, back, batch, HQP_ROWS_AT_ONCE);
        filled = 0;
    }
    if (filled) reflect_one(s, k, back, batch[0]);
}

/* Whether the reflectors k .. k + 3 are all in this range and have one window. */
static int are_four(const hqp_solver *s, int k, int from, int to) {
    const int *last = s->reflector.last + k;
    return k % 4 == 0 && k >= from && k + 4 <= to && last[1] == last[0] && last[2] == last[0] &&
           last[3] == last[0];
}

/* rows[idx] H_from .. H_{to-1} */
void hqp_reflect_all(const hqp_solver *s, int from, int to, hqp_rows rows, const int *idx, int count) {
    for (int k = from; k < to; k++) {
        if (!are_four(s, k, from, to)) {
            reflect(s, k, rows, idx, count);
            continue;
        }
        reflect_rows_by_four(s, k, 0, rows, idx, count);
        k += 3;
    }
}

/* rows[idx] H_{from-1} .. H_0 */
void hqp_reflect_back(const hqp_solver *s, int from, hqp_rows rows, const int *idx, int count) {
    for (int k = from - 1; k >= 0; k--) {
        if (k < 3 || !are_four(s, k - 3, 0, from)) {
            reflect(s, k, rows, idx, count);
            continue;
        }
        reflect_rows_by_four(s, k - 3, 1, rows, idx, count);
        k -= 3;
    }
}

/* row H_0 .. H_{to-1} */
void hqp_reflect_row(const hqp_solver *s, int to, real *row) {
    for (int k = 0; k < to; k++) {
        if (are_four(s, k, 0, to)) {
            reflect_one(s, k, 0, row);
            k += 3;
        } else {
            reflect_row(s, k, row);
        }
    }
}

/* row H_{from-1} .. H_0 */
void hqp_reflect_row_back(const hqp_solver *s, int from, real *row) {
    for (int k = from - 1; k >= 0; k--) {
        if (k >= 3 && are_four(s, k - 3, 0, from)) {
            k -= 3;
            reflect_one(s, k, 1, row);
        } else {
            reflect_row(s, k, row);
        }
    }
}

/* Reflectors from this one on, and what went through them, are of no use any more. */
static void forget_reflectors(hqp_solver *s, int from) {
    if (from >= s->built) return;
    s->built = from;
    for (int i = 0; i < s->total; i++) s->done[i] = s->done[i] > from ? 0 : s->done[i];
}

/* The row is another one. */
void hqp_forget_row(hqp_solver *s, int id) {
    s->done[id] = 0;
    for (int k = 0; k < s->built; k++) {
        if (s->column_row[k] == id) forget_reflectors(s, k);
    }
}

/* All rows are others. */
void hqp_forget_reflectors(hqp_solver *s) {
    forget_reflectors(s, 0);
}

/* base[ids] = given[ids] H_0 .. H_{rank-1} */
void hqp_bring(hqp_solver *s, const int *ids, int count) {
    int *alike = s->fit_order;
    for (int i = 0; i < count; i++) {
        const int id = ids[i];
        if (s->done[id] > 0 && s->done[id] <= s->rank) continue;
        s->done[id] = 0;
        hqp_gather(s, hqp_row(s, s->base, id), hqp_row(s, s->given, id));
        s->base.first[id] = hqp_floor4(s->place[s->given.first[id]]);
        s->base.last[id] = hqp_ceil4(s->place[s->given.last[id]]);
    }
    for (int i = 0; i < count; i++) {
        const int done = s->done[ids[i]];
        int alike_count = 0;
        if (done == s->rank) continue;
        for (int j = i; j < count; j++) {
            if (s->done[ids[j]] != done) continue;
            s->done[ids[j]] = s->rank;
            alike[alike_count++] = ids[j];
        }
        hqp_reflect_all(s, done, s->rank, s->base, alike, alike_count);
    }
}

/* to[position] = base[id] in the columns that the frozen rows leave */
void hqp_copy_base(const hqp_solver *s, hqp_rows to, int position, int id) {
    real *copy = hqp_row(s, to, position);
    const real *base = hqp_row(s, s->base, id);
    const int start = hqp_floor4(s->rank);
    memcpy(copy + start, base + start, (size_t)(s->ld - start) * sizeof(real));
    to.first[position] = s->base.first[id];
    to.last[position] = s->base.last[id];
}

/* H_top with (row H_top)[top + 1 ..] = 0, for a row of which the length `left` lies from column top on */
static void make_reflector(hqp_solver *s, real *row, int last, real left) {
    const int top = s->top, from = hqp_floor4(top);
    real *v = hqp_row(s, s->reflector, top);
    forget_reflectors(s, top);
    const real head = row[top], sign = head < 0.0 ? -1.0 : 1.0;
    const real scale = 1.0 / sqrt(left * (left + fabs(head)));
    for (int i = from; i < top; i++) v[i] = 0.0;
    for (int i = top; i < last; i++) v[i] = row[i] * scale;
    v[top] = (head + sign * left) * scale;
    row[top] = -sign * left;
    s->reflector.first[top] = from;
    s->reflector.last[top] = last;
    for (int k = from; k < top; k++)
        s->cross[4 * top + k % 4] = hqp_dot(v, hqp_row(s, s->reflector, k), from, last);
    s->top = top + 1;
    if (s->built == top) s->built = s->top;
}

/* length of the row from column `top` on */
static real length_left(const real *row, int top, int last) {
    const int whole = hqp_ceil4(top);
    real sum = 0.0;
    for (int i = top; i < whole; i++) sum += row[i] * row[i];
    if (whole < last) sum += hqp_dot(row, row, whole, last);
    return sqrt(sum);
}

/* Whether a row of which this is left did not have to wait. */
int hqp_is_clear(const hqp_solver *s, int id, real left) {
    return fabs(left) > fmax(LITTLE, s->settings.rank) * s->norm[id];
}

/* The line of the last reflector is that of this row. */
static void keep_line(hqp_solver *s, hqp_rows rows, int position, int id) {
    const int k = s->top - 1;
    real *line = s->line + k * s->ld;
    memcpy(line, hqp_row(s, s->base, id), (size_t)s->rank * sizeof(real));
    memcpy(line + s->rank, hqp_row(s, rows, position) + s->rank, (size_t)(s->top - s->rank) * sizeof(real));
    s->column_row[k] = id;
}

/* What rounding may make of what the rows behind the first `top` reflectors leave of this one: it is a
 * combination of them but for that, and each is wrong by some roundings. s->coefficient: its columns up to
 * there, which are of no use any more. */
static real noise_of(const hqp_solver *s, int id, int top) {
    real *coefficient = s->coefficient, sum = s->norm[id];
    for (int k = top - 1; k >= 0; k--) {
        const real *line = s->line + k * s->ld, share = coefficient[k] / line[k];
        hqp_add(coefficient, -share, line, k);
        sum += fabs(share) * s->norm[s->column_row[k]];
    }
    return NOISE * HQP_UNIT * sum;
}

/* What rounding may make of what the frozen rows leave of this one; 0 where their lines are not known. */
real hqp_noise(const hqp_solver *s, int id) {
    if (s->rank > s->lines) return 0.0;
    hqp_gather(s, s->coefficient, hqp_row(s, s->given, id));
    hqp_reflect_row(s, s->rank, s->coefficient);
    return noise_of(s, id, s->rank);
}

/* So little is left of the row that rounding may have made it. */
static int is_noise(const hqp_solver *s, const real *row, int id, real left) {
    if (left < FAINT * s->norm[id] && s->rank <= s->lines) {
        memcpy(s->coefficient, hqp_row(s, s->base, id), (size_t)s->rank * sizeof(real));
        memcpy(s->coefficient + s->rank, row + s->rank, (size_t)(s->top - s->rank) * sizeof(real));
        return left <= noise_of(s, id, s->top);
    }
    return 0;
}

/*
 * Reduce rows[0 .. count) one by one, each either giving the next reflector or found dependent on those
 * before, or so nearly that rounding may have made the difference. The less is left of a row, the longer it
 * waits for those of which more is left: of a row that sees a direction by 1e-9 rounding fixes it to 1e-7,
 * and then one that sees it better would pass for another direction. order: all positions; then the accepted
 * ones, and the dependent ones behind them. Returns the rank.
 */
int hqp_lq(hqp_solver *s, hqp_rows rows, const int *ids, int *order, int count) {
    real most = INFINITY; /* left of any that waits, of its norm */
    int rank = 0;
    for (int pass = 0; pass < PASSES && most > s->settings.rank; pass++) {
        const real least = fmax(WAITING[pass], s->settings.rank);
        if (most <= least) continue;
        most = 0.0;
        for (int i = rank; i < count && s->top < s->width; i++) {
            const int r = order[i], id = ids[r];
            real *row = hqp_row(s, rows, r);
            if (rows.last[r] <= s->top) continue;
            const real left = length_left(row, s->top, rows.last[r]);
            if (!(left > least * s->norm[id])) {
                most = fmax(most, left / s->norm[id]);
                continue;
            }
            if (is_noise(s, row, id, left)) continue;
            if (left < FAINT * s->norm[id]) s->sees_faintly = 1;
            make_reflector(s, row, rows.last[r], left);
            keep_line(s, rows, r, id);
            order[i] = order[rank];
            order[rank++] = r;
            reflect(s, s->top - 1, rows, order + rank, count - rank);
        }
    }
    return rank;
}

/*
 * One column of fold_dependent: a reflector from the left, u = (head, M[:, c]), takes M[:, c] into L[c, c].
 * [rows, rhs] -= factor u (u^T [rows, rhs])
 */
static void fold_column(hqp_solver *s, int column, int c, real length) {
    const int rank = s->fit_rank, count = s->fit_count;
    real *pivot = hqp_row(s, s->fit_rows, s->fit_order[c]) + column, *sum = s->step;
    const real sign = pivot[c] < 0.0 ? -1.0 : 1.0, head = pivot[c] + sign * length;
    const real factor = 1.0 / (length * fabs(head));
    real sum_rhs = head * s->rhs[c];
    for (int k = 0; k < c; k++) sum[k] = head * pivot[k];
    for (int i = rank; i < count; i++) {
        const real *row = hqp_row(s, s->fit_rows, s->fit_order[i]) + column;
        for (int k = 0; k < c; k++) sum[k] += row[c] * row[k];
        sum_rhs += row[c] * s->rhs[i];
    }
    for (int k = 0; k < c; k++) pivot[k] -= factor * head * sum[k];
    s->rhs[c] -= factor * head * sum_rhs;
    pivot[c] = -sign * length;
    for (int i = rank; i < count; i++) {
        real *row = hqp_row(s, s->fit_rows, s->fit_order[i]) + column;
        const real u = factor * row[c];
        for (int k = 0; k < c; k++) row[k] -= u * sum[k];
        s->rhs[i] -= u * sum_rhs;
        row[c] = 0.0;
    }
}

/*
 * The fitted rows are [L; M] z ~ rhs in columns column .. column + fit_rank, rows by fit_order, L lower
 * triangular and M the dependent rows. Reflectors from the left fold M into L, last column first, so that L
 * stays triangular: [L; M] -> [L'; 0], rhs -> [rhs'; residual]. A row of M that is but the rounding of the
 * whole row sees none of these columns: by a large residual it would pull at rows that are much shorter.
 */
static void fold_dependent(hqp_solver *s, int column) {
    const size_t size = (size_t)s->fit_rank * sizeof(real);
    for (int i = s->fit_rank; i < s->fit_count; i++) {
        const int r = s->fit_order[i];
        real *row = hqp_row(s, s->fit_rows, r) + column;
        const real rounding = s->settings.rounding * s->norm[s->fit[r]];
        if (hqp_inner(row, row, s->fit_rank) <= rounding * rounding) memset(row, 0, size);
    }
    for (int c = s->fit_rank - 1; c >= 0; c--) {
        const real diagonal = hqp_row(s, s->fit_rows, s->fit_order[c])[column + c];
        real below = 0.0;
        for (int i = s->fit_rank; i < s->fit_count; i++) {
            const real m = hqp_row(s, s->fit_rows, s->fit_order[i])[column + c];
            below += m * m;
        }
        if (below > 0.0) fold_column(s, column, c, sqrt(diagonal * diagonal + below));
    }
}

/* reduced[column ..] = argmin |[L; M] z - rhs| */
void hqp_least_squares(hqp_solver *s, int column) {
    real *z = s->reduced + column;
    if (s->fit_rank < s->fit_count) fold_dependent(s, column);
    for (int i = 0; i < s->fit_rank; i++) {
        const real *row = hqp_row(s, s->fit_rows, s->fit_order[i]) + column;
        real sum = s->rhs[i];
        for (int k = 0; k < i; k++) sum -= row[k] * z[k];
        z[i] = sum / row[i];
    }
}
