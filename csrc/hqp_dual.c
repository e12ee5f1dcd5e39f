/*
 * The last step: the level that uses up the freedom of x, or, where none does, the wish to stay close to the
 * start.
 *
 * On what earlier levels left free, x = x* + T^T t, with |t|^2 / 2 how much worse than at its free minimiser
 * x* the level gets. So the hard rows ask for the shortest t with N t >= gap: a projection, solved by the
 * dual method of Goldfarb and Idnani (Mathematical Programming 27, 1983). It starts at t = 0 and brings
 * broken rows to their bounds one by one; it needs no feasible start.
 */
#include "hqp_internal.h"

#include <string.h>

enum { FEW = 16, REFRESH = 16 };                      /* REFRESH: steps */
static const real LEAST = 1e-7, LEAST_JOINED = 1e-14; /* times the longest row: a column that is one */
static const real DOUBTFUL = 1e-6; /* times the norm of a row: so little of it may be rounding */
static const real MOSTLY = 0.5; /* of a row's square: with that much left of it, rounding has taken little */

static int freedom(const hqp_solver *s) {
    return s->width - s->rank;
}
static real *line(const hqp_solver *s, real *rows, int i) {
    return rows + i * s->ld;
}

/* direction = an orthonormal basis of what the frozen rows leave free: e_{rank+j}^T H_{rank-1} .. H_0 */
void hqp_free_directions(hqp_solver *s) {
    const int m = freedom(s);
    memset(s->direction.cell, 0, (size_t)(m * s->ld) * sizeof(real));
    for (int j = 0; j < m; j++) {
        hqp_row(s, s->direction, j)[s->rank + j] = 1.0;
        s->direction.first[j] = hqp_floor4(s->rank + j);
        s->direction.last[j] = hqp_floor4(s->rank + j) + 4;
        s->work_order[j] = j;
    }
    hqp_reflect_back(s, s->rank, s->direction, s->work_order, m);
    for (int j = 0; j < m; j++) hqp_scatter(s, hqp_row(s, s->direction, j));
}

/* One column of triangularise: a reflector from the left, u = (head, rows[c + 1 .., c]), leaves -+norm at [c,
 * c]. Columns before c hold numbers that nobody reads. Returns the square of the next column, from [c + 1, c
 * + 1] on. */
static real reduce_column(hqp_solver *s, int c, real norm) {
    const int from = hqp_floor4(c), to = hqp_ceil4(freedom(s)), next = c + 1 < freedom(s) ? c + 1 : c;
    real square = 0.0;
    real *pivot = hqp_row(s, s->fit_rows, c), *sum = s->step;
    const real sign = pivot[c] < 0.0 ? -1.0 : 1.0, head = pivot[c] + sign * norm;
    const real factor = 1.0 / (norm * fabs(head));
    real sum_rhs = head * s->rhs[c];
    for (int k = from; k < to; k++) sum[k] = head * pivot[k];
    for (int i = c + 1; i < s->fit_count; i++) {
        const real *row = hqp_row(s, s->fit_rows, i);
        if (row[c] == 0.0) continue;
        hqp_axpy(sum, row[c], row, from, to);
        sum_rhs += row[c] * s->rhs[i];
    }
    hqp_axpy(pivot, -factor * head, sum, from, to);
    pivot[c] = -sign * norm;
    s->rhs[c] -= factor * head * sum_rhs;
    for (int i = c + 1; i < s->fit_count; i++) {
        real *row = hqp_row(s, s->fit_rows, i);
        const real u = factor * row[c];
        if (u != 0.0) {
            hqp_axpy(row, -u, sum, from, to);
            s->rhs[i] -= u * sum_rhs;
        }
        square += row[next] * row[next];
    }
    return square;
}

/* squares of columns c .. freedom, from [c, ..] on */
static void square_columns(const hqp_solver *s, int c, real *squares) {
    const int from = hqp_floor4(c), to = hqp_ceil4(freedom(s));
    for (int k = from; k < to; k++) squares[k] = 0.0;
    for (int i = c; i < s->fit_count; i++) {
        const real *row = hqp_row(s, s->fit_rows, i);
        for (int k = from; k < to; k += HQP_LANES) {
            const hqp_lanes a = hqp_load(row + k);
            hqp_store(squares + k, hqp_with_product(hqp_load(squares + k), a, a));
        }
    }
}

/* Bring the longest column of what is left to place c: with it, rows of any weight keep their own accuracy
 * (Cox, Higham 1998). Returns its square. */
static real pivot_column(hqp_solver *s, int c) {
    real *squares = s->reduced;
    int best = c;
    square_columns(s, c, squares);
    for (int k = c + 1; k < freedom(s); k++) {
        if (squares[k] > squares[best]) best = k;
    }
    const real most = squares[best];
    if (best == c) return most;
    for (int i = 0; i < s->fit_count; i++) {
        real *row = hqp_row(s, s->fit_rows, i);
        const real kept = row[c];
        row[c] = row[best];
        row[best] = kept;
    }
    hqp_swap_rows(hqp_row(s, s->direction, c), hqp_row(s, s->direction, best), (int)s->ld);
    return most;
}

/* Householder QR of fit_rows, rhs to Q^T rhs. Returns 0 where its columns are not clearly independent. */
static int triangularise(hqp_solver *s, int is_joined) {
    const real least = is_joined ? LEAST_JOINED : fmax(LEAST, s->settings.rank);
    real largest = 0.0, square = 0.0;
    for (int i = 0; i < s->fit_count; i++) {
        const real first = hqp_row(s, s->fit_rows, i)[0];
        largest = fmax(largest, s->norm[s->fit[i]]);
        square += first * first;
    }
    for (int c = 0; c < freedom(s); c++) {
        if (is_joined) square = pivot_column(s, c);
        if (!(sqrt(square) > least * largest)) return 0;
        square = reduce_column(s, c, sqrt(square));
    }
    return 1;
}

static hqp_four four_directions(const hqp_solver *s, int j) {
    const real *const first = hqp_row(s, s->direction, j);
    return (hqp_four){{first, first + s->ld, first + 2 * s->ld, first + 3 * s->ld}};
}

/* R y = rhs, trial = x + D^T y, direction = T = R^{-T} D */
static void measure_by_level(hqp_solver *s) {
    const int width = (int)s->ld;
    for (int j = freedom(s) - 1; j >= 0; j--) {
        const real *row = hqp_row(s, s->fit_rows, j);
        real sum = s->rhs[j];
        for (int k = j + 1; k < freedom(s); k++) sum -= row[k] * s->reduced[k];
        s->reduced[j] = sum / row[j];
        hqp_axpy(s->trial, s->reduced[j], hqp_row(s, s->direction, j), 0, width);
    }
    for (int j = 0; j < freedom(s); j++) {
        real *direction = hqp_row(s, s->direction, j), share[4];
        const int whole = hqp_floor4(j);
        for (int i = 0; i < whole; i += 4) {
            for (int k = 0; k < 4; k++) share[k] = hqp_row(s, s->fit_rows, i + k)[j];
            hqp_take_four(direction, share, four_directions(s, i), width);
        }
        for (int i = whole; i < j; i++)
            hqp_axpy(direction, -hqp_row(s, s->fit_rows, i)[j], hqp_row(s, s->direction, i), 0, width);
        const real scale = 1.0 / hqp_row(s, s->fit_rows, j)[j];
        for (int i = 0; i < s->ld; i++) direction[i] *= scale;
    }
}

/* row . direction^T */
static void in_directions(const hqp_solver *s, int id, real *row) {
    if (freedom(s) == s->n) {
        memcpy(row, hqp_row(s, s->given, id), (size_t)s->n * sizeof(real));
        return;
    }
    for (int j = 0; j < freedom(s); j++) row[j] = hqp_value(s, id, hqp_row(s, s->direction, j));
}

/* trial = x*, the minimiser of the fitted rows that minds no hard row. Returns 0 where it is not unique. */
static int free_minimiser(hqp_solver *s, int level) {
    hqp_free_directions(s);
    memcpy(s->trial, s->x, (size_t)s->ld * sizeof(real));
    s->metric = level < s->levels && freedom(s) > 0;
    if (!s->metric) return 1;
    s->fit_count = 0;
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (!s->side[i]) continue;
        real *row = hqp_row(s, s->fit_rows, s->fit_count);
        memset(row, 0, (size_t)hqp_ceil4(freedom(s)) * sizeof(real));
        in_directions(s, i, row);
        s->rhs[s->fit_count] = hqp_bound(s, i, s->side[i]) - hqp_value(s, i, s->x);
        s->fit[s->fit_count++] = i;
    }
    if (!triangularise(s, s->joined[level])) return 0;
    measure_by_level(s);
    return 1;
}

/* The hard row that x breaks most, by distance; -1: none. */
int hqp_most_broken(hqp_solver *s, int level) {
    real distance = 0.0;
    int worst = -1;
    s->x_norm = hqp_length(s, s->x);
    for (int i = 0; i < s->row0[level]; i++) {
        if (!hqp_is_hard(s, i) || s->side[i]) continue;
        const real value = hqp_value(s, i, s->x);
        const int side = hqp_outside(s, i, value, s->x_norm);
        if (!side || side * (value - hqp_bound(s, i, side)) <= distance * s->norm[i]) continue;
        distance = side * (value - hqp_bound(s, i, side)) / s->norm[i];
        worst = i;
    }
    return worst;
}

/* row[..m] = -side (row . T^T), how t changes the room the row has; returns the gap, what is missing at x* */
static real to_t_space(const hqp_solver *s, int id, int side, real *row) {
    const int m = freedom(s);
    for (int j = 0; j < m; j++) row[j] = -side * hqp_value(s, id, hqp_row(s, s->direction, j));
    for (int j = m; j < hqp_ceil4(m); j++) row[j] = 0.0;
    return side * (hqp_value(s, id, s->trial) - hqp_bound(s, id, side));
}

/* Vectors i .. i + 3 of the basis of the held rows. */
static hqp_four four(const hqp_solver *s, int i) {
    const real *const first = line(s, s->held.basis, i);
    return (hqp_four){{first, first + s->ld, first + 2 * s->ld, first + 3 * s->ld}};
}

/* rest loses its part in the span of the held rows, which coefficient, in their basis, gains. */
static void take_away_held(const hqp_solver *s, real *rest, real *coefficient) {
    const int count = s->held.count, whole = hqp_floor4(count), to = hqp_ceil4(freedom(s));
    real *const along = s->held.along;
    for (int i = 0; i < whole; i += 4) hqp_dot_four(along + i, four(s, i), rest, to);
    for (int i = whole; i < count; i++) along[i] = hqp_dot(line(s, s->held.basis, i), rest, 0, to);
    for (int i = 0; i < whole; i += 4) hqp_take_four(rest, along + i, four(s, i), to);
    for (int i = whole; i < count; i++) hqp_axpy(rest, -along[i], line(s, s->held.basis, i), 0, to);
    for (int i = 0; i < count; i++) coefficient[i] += along[i];
}

/*
 * rest = the part of a row outside the span of the held rows, by Gram-Schmidt, done twice where the first
 * time took most of the row away (Daniel, Gragg, Kaufman, Stewart 1976); coefficient = the part inside, in
 * their basis. Returns |rest|^2.
 */
static real orthogonalise(const hqp_solver *s, const real *row, real *rest, real *coefficient) {
    const int to = hqp_ceil4(freedom(s));
    const real size = hqp_dot(row, row, 0, to);
    real left = size;
    memcpy(rest, row, (size_t)to * sizeof(real));
    for (int i = 0; i < s->held.count; i++) coefficient[i] = 0.0;
    for (int pass = 0; pass < 2 && (pass == 0 || left < MOSTLY * size); pass++) {
        take_away_held(s, rest, coefficient);
        left = hqp_dot(rest, rest, 0, to);
    }
    return left;
}

/* L^T y = y in place, L the triangle of the held rows */
static void solve_transposed(const hqp_solver *s, real *y) {
    for (int i = s->held.count - 1; i >= 0; i--) {
        const real *triangle = line(s, s->held.triangle, i);
        y[i] /= triangle[i];
        hqp_add(y, -y[i], triangle, i);
    }
}

/* Whether so much of row `id` is more than rounding: seen from x it is R^T part. */
static int is_seen(const hqp_solver *s, int id, const real *part) {
    const real least = s->settings.rank * s->norm[id];
    const int m = freedom(s);
    real *seen = s->reduced;
    if (!s->metric) return hqp_inner(part, part, m) > least * least;
    memset(seen, 0, (size_t)m * sizeof(real));
    for (int i = 0; i < m; i++) hqp_add(seen + i, part[i], hqp_row(s, s->fit_rows, i) + i, m - i);
    return hqp_inner(seen, seen, m) > least * least;
}

/* So little is left of row `id` outside the span of the held rows, of which `share` is its place in the
 * triangle, that rounding may have made it: it is wrong by what the frozen rows leave of rounding, and so is
 * each held row. */
static int is_noise(const hqp_solver *s, int id, const real *rest, const real *share) {
    const real doubtful = DOUBTFUL * s->norm[id], square = hqp_inner(rest, rest, freedom(s));
    real *pull = s->step, noise = 0.0;
    if (s->metric || square > doubtful * doubtful) return 0;
    memcpy(pull, share, (size_t)s->held.count * sizeof(real));
    solve_transposed(s, pull);
    for (int k = 0; k < s->held.count; k++) noise += fabs(pull[k]) * hqp_noise(s, s->held.id[k]);
    noise += hqp_noise(s, id);
    return square <= noise * noise;
}

/* Whether there is a rest of the row outside the span of the held rows. Where the metric is that of fitted
 * rows, what is left of a row that sees next to nothing may seem to be much. */
static int is_independent(const hqp_solver *s, int id, const real *row, const real *rest) {
    const real *share = line(s, s->held.triangle, s->held.count);
    if (s->held.count >= freedom(s) || !is_seen(s, id, rest) || is_noise(s, id, rest, share)) return 0;
    return !s->metric || is_seen(s, id, row);
}

/* Held row number held.count, orthogonalised, of which so much is left, is one of them. */
static void add(hqp_solver *s, real left) {
    const int k = s->held.count++;
    real *basis = line(s, s->held.basis, k), *triangle = line(s, s->held.triangle, k);
    triangle[k] = sqrt(left);
    for (int j = 0; j < freedom(s); j++) basis[j] /= triangle[k];
}

/* Append held row number held.count, whose place in t-space and gap are set. Returns 0 if it depends on the
 * others. */
static int append(hqp_solver *s) {
    const int k = s->held.count;
    real *basis = line(s, s->held.basis, k), *triangle = line(s, s->held.triangle, k);
    const real *const row = line(s, s->held.rows, k);
    const real left = orthogonalise(s, row, basis, triangle);
    if (!is_independent(s, s->held.id[k], row, basis)) return 0;
    add(s, left);
    return 1;
}

/* Rotate basis vectors k and k + 1 so that row k, which had a share in both, has one in the first alone. */
static void rotate(const hqp_solver *s, int k, int count) {
    real *first = line(s, s->held.basis, k), *second = line(s, s->held.basis, k + 1);
    const real *row = line(s, s->held.triangle, k);
    const real length = hypot(row[k], row[k + 1]), cosine = row[k] / length, sine = row[k + 1] / length;
    for (int j = 0; j < freedom(s); j++) {
        const real a = first[j], b = second[j];
        first[j] = cosine * a + sine * b;
        second[j] = cosine * b - sine * a;
    }
    for (int i = k; i < count; i++) {
        real *triangle = line(s, s->held.triangle, i);
        const real a = triangle[k], b = triangle[k + 1];
        triangle[k] = cosine * a + sine * b;
        triangle[k + 1] = cosine * b - sine * a;
    }
}

/* Release held row number `drop` by rotations, which costs less than release where many rows follow. */
static void rotate_out(hqp_solver *s, int drop) {
    const int count = --s->held.count;
    for (int i = drop; i < count; i++) {
        memcpy(line(s, s->held.rows, i), line(s, s->held.rows, i + 1), (size_t)s->ld * sizeof(real));
        memcpy(line(s, s->held.triangle, i), line(s, s->held.triangle, i + 1), (size_t)s->ld * sizeof(real));
        s->held.id[i] = s->held.id[i + 1];
        s->held.gap[i] = s->held.gap[i + 1];
        s->held.multiplier[i] = s->held.multiplier[i + 1];
    }
    for (int k = drop; k < count; k++) rotate(s, k, count);
}

/* Release held row number `drop`; the few after it are orthogonalised again, which also mends rounding.
 * Returns 0 where that releases another one. */
static int release(hqp_solver *s, int drop) {
    const int count = s->held.count;
    s->side[s->held.id[drop]] = 0;
    if (count - drop > FEW) {
        rotate_out(s, drop);
        return 1;
    }
    s->held.count = drop;
    for (int i = drop + 1; i < count; i++) {
        const int to = s->held.count;
        memcpy(line(s, s->held.rows, to), line(s, s->held.rows, i), (size_t)s->ld * sizeof(real));
        s->held.id[to] = s->held.id[i];
        s->held.gap[to] = s->held.gap[i];
        s->held.multiplier[to] = s->held.multiplier[i];
        if (!append(s)) s->side[s->held.id[to]] = 0;
    }
    return s->held.count == count - 1;
}

/* Take out of a vector in t-space what the held rows span of it, by a change of their multipliers. Returns 0,
 * and rest is of no use, where one of these would become negative. */
int hqp_take_into_held(hqp_solver *s, real *rest) {
    real *change = s->step;
    memset(change, 0, (size_t)s->held.count * sizeof(real));
    take_away_held(s, rest, change);
    solve_transposed(s, change);
    for (int k = 0; k < s->held.count; k++) {
        if (!(s->held.multiplier[k] - change[k] >= 0.0)) return 0;
    }
    return 1;
}

/* x += T^T t */
static void move(hqp_solver *s, const real *t) {
    const int count = freedom(s), whole = hqp_floor4(count);
    real minus[4];
    for (int j = 0; j < whole; j += 4) {
        for (int k = 0; k < 4; k++) minus[k] = -t[j + k];
        hqp_take_four(s->x, minus, four_directions(s, j), (int)s->ld);
    }
    for (int j = whole; j < count; j++) hqp_axpy(s->x, t[j], hqp_row(s, s->direction, j), 0, (int)s->ld);
}

/* x += T^T t for the shortest t that closes these gaps of the held rows: L q = gap, t = basis^T q; gap
 * becomes q */
static void step_to_bounds(hqp_solver *s, real *gap) {
    real *q = gap, *t = s->reduced;
    memset(t, 0, (size_t)s->ld * sizeof(real));
    for (int i = 0; i < s->held.count; i++) {
        const real *triangle = line(s, s->held.triangle, i), *basis = line(s, s->held.basis, i);
        q[i] = (q[i] - hqp_inner(triangle, q, i)) / triangle[i];
        hqp_add(t, q[i], basis, freedom(s));
    }
    move(s, t);
}

/*
 * x at the shortest t that brings the held rows to their bounds, and their multipliers, L^T multiplier = q. A
 * second step mends what rounding left of the first where x* is far away.
 */
void hqp_close_gaps(hqp_solver *s) {
    real *multiplier = s->held.multiplier, *left = s->step;
    memcpy(s->x, s->trial, (size_t)s->ld * sizeof(real));
    for (int k = 0; k < s->held.count; k++) multiplier[k] = s->held.gap[k];
    step_to_bounds(s, multiplier);
    solve_transposed(s, multiplier);
    if (s->cone.entered) return; /* nothing is far away there */
    for (int k = 0; k < s->held.count; k++) {
        const int id = s->held.id[k];
        left[k] = s->side[id] * (hqp_value(s, id, s->x) - hqp_bound(s, id, s->side[id]));
    }
    step_to_bounds(s, left);
}

/* Hold the hard rows that have a side, without those that depend on others or would be pulled the wrong way.
 */
void hqp_hold(hqp_solver *s, int level) {
    int worst = 0;
    s->held.count = s->held.steps = 0;
    for (int i = 0; i < s->row0[level]; i++) {
        const int side = s->side[i], k = s->held.count;
        if (!side) continue;
        s->held.gap[k] = to_t_space(s, i, side, line(s, s->held.rows, k));
        s->held.id[k] = i;
        if (!append(s)) s->side[i] = 0;
    }
    while (worst >= 0) {
        real least = 0.0;
        hqp_close_gaps(s);
        worst = -1;
        for (int k = 0; k < s->held.count; k++) {
            if (s->held.multiplier[k] >= least) continue;
            least = s->held.multiplier[k];
            worst = k;
        }
        if (worst >= 0) release(s, worst);
    }
}

/* Hold what the last solve held here. */
static void hold_guess(hqp_solver *s, int level) {
    memset(s->side, 0, (size_t)s->row0[level]);
    const int count = hqp_holds(s, level) ? s->row0[level] : 0;
    for (int i = 0; i < count; i++) {
        const int side = s->guess_held_side[i];
        if (hqp_is_hard(s, i) && s->guess_held_at[i] == level && isfinite(hqp_bound(s, i, side)))
            s->side[i] = (signed char)side;
    }
    hqp_hold(s, level);
}

/*
 * Bring broken row `id` to its bound, along the way releasing held rows whose multiplier falls to zero: with
 * row = pull . held + rest, a step of length l raises its own multiplier to l, lowers theirs by l pull, moves
 * t by l rest, and closes l |rest|^2 of the gap. Now and then all is found anew, and not by steps, which add
 * up roundings. Returns HQP_DONE, HQP_LOST, or the level that must give way.
 */
int hqp_hold_broken(hqp_solver *s, int level, int id) {
    const real value = hqp_value(s, id, s->x);
    const int side = value > s->ub[id] ? 1 : -1;
    real *row = s->broken_row, *pull = s->broken_pull, *t = s->held.step, left = 0.0, own = 0.0;
    const real gap = to_t_space(s, id, side, row);
    real missing = side * (value - hqp_bound(s, id, side));
    int is_complete = 1;
    memset(t, 0, (size_t)s->ld * sizeof(real));
    for (int first = 0; first >= 0;) {
        const int count = s->held.count;
        real *rest = line(s, s->held.basis, count), *share = line(s, s->held.triangle, count);
        left = orthogonalise(s, row, rest, share);
        const int independent = is_independent(s, id, row, rest);
        real length = independent ? missing / left : INFINITY;
        memcpy(pull, share, (size_t)count * sizeof(real));
        solve_transposed(s, pull);
        first = -1;
        for (int k = 0; k < count; k++) {
            if (!(pull[k] > 1e-13) || !(s->held.multiplier[k] < length * pull[k])) continue;
            length = fmax(s->held.multiplier[k], 0.0) / pull[k];
            first = k;
        }
        if (!(length < INFINITY)) return s->cone.entered ? HQP_LOST : hqp_give_way(s, level, id, side, pull);
        for (int k = 0; k < count; k++) s->held.multiplier[k] -= length * pull[k];
        own += length;
        if (independent) hqp_add(t, length, rest, freedom(s));
        if (first < 0) break;
        if (independent) missing -= length * left;
        is_complete &= release(s, first);
        if (hqp_out_of_iterations(s)) return HQP_LOST;
    }
    const int k = s->held.count;
    memcpy(line(s, s->held.rows, k), row, (size_t)s->ld * sizeof(real));
    s->held.gap[k] = gap;
    s->held.id[k] = id;
    s->held.multiplier[k] = own;
    add(s, left);
    s->side[id] = (signed char)side;
    if (is_complete && ++s->held.steps % REFRESH)
        move(s, t);
    else
        hqp_close_gaps(s);
    return HQP_DONE;
}

/* Remember what is held, for the next solve. */
static void remember(hqp_solver *s, int level) {
    for (int i = 0; i < s->row0[level]; i++) {
        if (s->guess_held_at[i] == level) s->guess_held_at[i] = -1;
    }
    for (int k = 0; k < s->held.count; k++) {
        const int id = s->held.id[k];
        s->guess_held_at[id] = (short)level;
        s->guess_held_side[id] = s->side[id];
        s->strength[id] = s->held.multiplier[k] * s->norm[id];
        if (hqp_is_last(s, level)) s->hardest = fmax(s->hardest, s->strength[id]);
    }
}

/* If the level breaks ranges of its own the worst of them shall be fitted. Returns as hqp_finish. */
static int check_own_rows(hqp_solver *s, int level) {
    real worst = 0.0;
    int add = -1;
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (s->kind[i] != HQP_RANGE) continue;
        const real value = hqp_value(s, i, s->x);
        const int side = hqp_outside(s, i, value, s->x_norm);
        if (!side || side * (value - hqp_bound(s, i, side)) <= worst) continue;
        worst = side * (value - hqp_bound(s, i, side));
        add = i;
    }
    if (add < 0) return HQP_DONE;
    s->strength[add] = 0.0;
    s->guess_side[add] = hqp_value(s, add, s->x) > s->ub[add] ? 1 : -1;
    return level;
}

/*
 * Finish the sweep at `level`, of which only equalities may be fitted; level == levels: no level is left.
 * HQP_DONE: x is optimal; HQP_NOT_LAST: the level leaves freedom; HQP_LOST: out of iterations or ideas.
 */
int hqp_finish(hqp_solver *s, int level) {
    if (!free_minimiser(s, level)) return HQP_NOT_LAST;
    hold_guess(s, level);
    for (int is_exact = 1;;) {
        const int broken = hqp_most_broken(s, level);
        if (broken < 0 && is_exact) break;
        is_exact = broken < 0;
        if (is_exact) {
            hqp_close_gaps(s);
            continue;
        }
        if (hqp_out_of_iterations(s)) return HQP_LOST;
        const int result = hqp_hold_broken(s, level, broken);
        if (result != HQP_DONE) return result;
    }
    remember(s, level);
    return s->metric ? check_own_rows(s, level) : HQP_DONE;
}
