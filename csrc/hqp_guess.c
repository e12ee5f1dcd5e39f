/*
 * A working set for one level, by a dual method that moves one row at a time.
 *
 * In coordinates t of what the frozen rows leave free, with hard rows scaled to 1 and the level's own to at
 * most 1, it solves
 *
 *     min 1/2 |t|^2 + 1/2 |v|^2 / YIELD,    hard rows hold, own rows hold up to v
 *
 * which is strictly convex whatever the rows are: they are brought to their bound one by one, and released
 * where their multiplier falls to zero (Goldfarb, Idnani 1983). The triangle L of L L^T = rows rows^T + YIELD
 * (of own rows) is updated, so that a change costs a few products and no factorisation. YIELD is small: the
 * rows held in the end are mostly those of the level's minimum. Whether they are is for others to say.
 */
#include "hqp_internal.h"

#include <string.h>

static const real YIELD = 1e-7;
static const real BROKEN = 1e-9;     /* times (1 + |bound|): a row that is brought to its bound */
static const real DEPENDENT = 1e-11; /* of a row's square: less than this left of it is rounding */

static int is_own(const hqp_solver *s, int level, int id) {
    return id >= s->row0[level];
}

static real *row_of(const hqp_solver *s, int k) {
    return hqp_row(s, s->work_rows, s->bundle.slot[k]);
}

static real *triangle_of(const hqp_solver *s, int k) {
    return s->bundle.triangle + (ptrdiff_t)k * s->bundle.most;
}

/* Held rows k .. k + 3. */
static hqp_four four(const hqp_solver *s, int k) {
    return (hqp_four){{row_of(s, k), row_of(s, k + 1), row_of(s, k + 2), row_of(s, k + 3)}};
}

/* Scaled, and turned so that its multiplier is not negative, the row is number `count`, behind the held ones.
 */
static void place(hqp_solver *s, int level, int id, int side, real largest) {
    const int k = s->bundle.count, free = s->width - s->rank;
    const real scale = -side / (is_own(s, level, id) ? largest : s->norm[id]);
    real *row = row_of(s, k);
    hqp_bring(s, &id, 1);
    const real *base = hqp_row(s, s->base, id) + s->rank;
    for (int j = 0; j < free; j++) row[j] = scale * base[j];
    for (int j = free; j < hqp_ceil4(free); j++) row[j] = 0.0;
    s->bundle.id[k] = id;
    s->bundle.multiplier[k] = 0.0;
    s->bundle.gap[k] = scale * (hqp_bound(s, id, side) - s->value[id]);
    s->side[id] = (signed char)side;
}

/* Line of the triangle of row number `count`, but for its end. Returns the square of that. */
static real reduce(const hqp_solver *s, int level, real *size) {
    const int k = s->bundle.count, whole = hqp_floor4(k), to = hqp_ceil4(s->width - s->rank);
    const real *row = row_of(s, k);
    real *line = triangle_of(s, k);
    *size = hqp_dot(row, row, 0, to) + (is_own(s, level, s->bundle.id[k]) ? YIELD : 0.0);
    real left = *size;
    for (int i = 0; i < whole; i += 4) hqp_dot_four(line + i, four(s, i), row, to);
    for (int i = whole; i < k; i++) line[i] = hqp_dot(row, row_of(s, i), 0, to);
    for (int i = 0; i < k; i++) {
        const real *other = triangle_of(s, i);
        line[i] = (line[i] - hqp_inner(other, line, i)) / other[i];
        left -= line[i] * line[i];
    }
    return left;
}

static void hold(hqp_solver *s, real left) {
    triangle_of(s, s->bundle.count)[s->bundle.count] = sqrt(left);
    s->bundle.count++;
}

/* Release held row number `drop`; the row behind the held ones, too, moves up. Rotations of columns make a
 * triangle of what is left. Returns what the square of the end of that row's line gains. */
static real release(hqp_solver *s, int drop) {
    const int count = s->bundle.count, slot = s->bundle.slot[drop];
    s->side[s->bundle.id[drop]] = 0;
    for (int i = drop; i < count; i++) {
        s->bundle.id[i] = s->bundle.id[i + 1];
        s->bundle.multiplier[i] = s->bundle.multiplier[i + 1];
        s->bundle.gap[i] = s->bundle.gap[i + 1];
        s->bundle.slot[i] = s->bundle.slot[i + 1];
        memcpy(triangle_of(s, i), triangle_of(s, i + 1), (size_t)(i + 2) * sizeof(real));
    }
    s->bundle.slot[count] = slot;
    s->bundle.count = count - 1;
    for (int c = drop; c < count - 1; c++) {
        const real a = triangle_of(s, c)[c], b = triangle_of(s, c)[c + 1], r = sqrt(a * a + b * b);
        const real cosine = a / r, sine = b / r;
        for (int i = c; i < count; i++) {
            real *line = triangle_of(s, i);
            const real left = line[c], right = line[c + 1];
            line[c] = cosine * left + sine * right;
            line[c + 1] = cosine * right - sine * left;
        }
    }
    const real end = triangle_of(s, count - 1)[count - 1];
    return end * end;
}

/* L^T y = y in place */
static void solve_transposed(const hqp_solver *s, real *y) {
    for (int i = s->bundle.count - 1; i >= 0; i--) {
        const real *line = triangle_of(s, i);
        y[i] /= line[i];
        hqp_add(y, -y[i], line, i);
    }
}

/* The multipliers that close all gaps. */
static void settle_multipliers(hqp_solver *s) {
    real *y = s->bundle.multiplier;
    for (int i = 0; i < s->bundle.count; i++) {
        const real *line = triangle_of(s, i);
        y[i] = (s->bundle.gap[i] - hqp_inner(line, y, i)) / line[i];
    }
    solve_transposed(s, y);
}

/* trial = x + Q (0, t), t = sum multiplier row */
static void make_trial(hqp_solver *s) {
    const int count = s->bundle.count, whole = hqp_floor4(count), free = s->width - s->rank;
    real *t = s->step, *minus = s->reduced;
    const real *const multiplier = s->bundle.multiplier;
    memset(minus, 0, (size_t)s->ld * sizeof(real));
    for (int k = 0; k < whole; k += 4) hqp_take_four(minus, multiplier + k, four(s, k), hqp_ceil4(free));
    for (int k = whole; k < count; k++) hqp_axpy(minus, -multiplier[k], row_of(s, k), 0, hqp_ceil4(free));
    memset(t, 0, (size_t)s->ld * sizeof(real));
    for (int j = 0; j < free; j++) t[s->rank + j] = -minus[j];
    hqp_reflect_row_back(s, s->rank, t);
    hqp_scatter(s, t);
    for (int i = 0; i < s->ld; i++) s->trial[i] = s->x[i] + t[i];
}

/* The row that trial breaks most, in units of its scaled value, of those that were broken when last looked
 * at; -1: none. */
static int most_broken_of_known(hqp_solver *s, int level, real largest, int *side, real *missing) {
    int worst = -1, left = 0;
    *missing = 0.0;
    for (int k = 0; k < s->bundle.broken_count; k++) {
        const int i = s->bundle.broken[k], own = is_own(s, level, i);
        if (s->side[i]) continue;
        const real value = hqp_value(s, i, s->trial);
        const int at = value > s->ub[i] ? 1 : value < s->lb[i] ? -1 : 0;
        if (!at) continue;
        const real bound = hqp_bound(s, i, at), beyond = at * (value - bound);
        const real scaled = beyond / (own ? largest : s->norm[i]);
        if (beyond <= BROKEN * (1.0 + fabs(bound))) continue;
        s->bundle.broken[left++] = i;
        if (scaled <= *missing) continue;
        *missing = scaled;
        *side = at;
        worst = i;
    }
    s->bundle.broken_count = left;
    return worst;
}

/* The same, of all where none of these is broken any more: to look at all each time costs more than the rows
 * that this way are held in vain. */
static int most_broken(hqp_solver *s, int level, real largest, int *side, real *missing) {
    const int worst = most_broken_of_known(s, level, largest, side, missing);
    if (worst >= 0) return worst;
    for (int i = 0; i < s->row0[level + 1]; i++) {
        if (is_own(s, level, i) ? s->kind[i] == HQP_RANGE : hqp_is_hard(s, i))
            s->bundle.broken[s->bundle.broken_count++] = i;
    }
    return most_broken_of_known(s, level, largest, side, missing);
}

/* How far the multiplier of the row behind the held ones can grow, with the held rows giving `pull` each for
 * it; *first: who is released then, or -1. */
static real ratio(const hqp_solver *s, const real *pull, real length, int *first) {
    *first = -1;
    for (int k = 0; k < s->bundle.count; k++) {
        if (s->kind[s->bundle.id[k]] != HQP_RANGE || !(pull[k] > 1e-13)) continue;
        if (!(s->bundle.multiplier[k] < length * pull[k])) continue;
        length = fmax(s->bundle.multiplier[k], 0.0) / pull[k];
        *first = k;
    }
    return length;
}

/* Bring the row behind the held ones to its bound. Returns 0 where that cannot be done. */
static int bring_to_bound(hqp_solver *s, int level, real missing) {
    real *pull = s->bundle.pull, own = 0.0, size;
    real left = reduce(s, level, &size);
    for (int first = 0; first >= 0;) {
        const int count = s->bundle.count, is_free = left > DEPENDENT * size;
        memcpy(pull, triangle_of(s, count), (size_t)count * sizeof(real));
        solve_transposed(s, pull);
        const real length = ratio(s, pull, is_free ? missing / left : INFINITY, &first);
        if (!(length < INFINITY)) return 0;
        for (int k = 0; k < count; k++) s->bundle.multiplier[k] -= length * pull[k];
        own += length;
        if (first < 0) break;
        if (is_free) missing -= length * left;
        left += release(s, first);
        if (hqp_out_of_iterations(s)) return 0;
    }
    s->bundle.multiplier[s->bundle.count] = own;
    hold(s, left);
    return 1;
}

/* The level's equalities are held from the start. Returns 0 where there are too many. */
static int hold_equalities(hqp_solver *s, int level, real largest) {
    real size;
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (s->kind[i] != HQP_EQUALITY) continue;
        if (s->bundle.count + 1 >= s->bundle.most) return 0;
        place(s, level, i, 1, largest);
        hold(s, reduce(s, level, &size));
    }
    settle_multipliers(s);
    return 1;
}

/* The side that the row is known to be held or fitted at in this level, or 0. */
static int known_side(const hqp_solver *s, int level, int id) {
    const int own = is_own(s, level, id), is_known = own || s->guess_held_at[id] == level;
    const int side = own ? s->guess_side[id] : s->guess_held_side[id];
    const int may = own ? s->kind[id] == HQP_RANGE : hqp_is_hard(s, id);
    return is_known && may && side && isfinite(hqp_bound(s, id, side)) ? side : 0;
}

/* The held row with the most negative multiplier, which has to go, or -1. */
static int most_negative(const hqp_solver *s) {
    int worst = -1;
    for (int k = 0; k < s->bundle.count; k++) {
        if (s->kind[s->bundle.id[k]] != HQP_RANGE || !(s->bundle.multiplier[k] < 0.0)) continue;
        if (worst < 0 || s->bundle.multiplier[k] < s->bundle.multiplier[worst]) worst = k;
    }
    return worst;
}

/* The known rows are held from the start, but for those whose multiplier would be negative. Returns 0 where
 * that takes too long. */
static int hold_known(hqp_solver *s, int level, real largest) {
    real size;
    for (int i = 0; i < s->row0[level + 1]; i++) {
        const int side = s->bundle.count + 1 < s->bundle.most ? known_side(s, level, i) : 0;
        if (!side) continue;
        place(s, level, i, side, largest);
        const real left = reduce(s, level, &size);
        if (left > DEPENDENT * size)
            hold(s, left);
        else
            s->side[i] = 0;
    }
    settle_multipliers(s);
    for (int worst = most_negative(s); worst >= 0; worst = most_negative(s)) {
        release(s, worst);
        settle_multipliers(s);
        if (hqp_out_of_iterations(s)) return 0;
    }
    return 1;
}

/*
 * Seat the working set of this level that the dual method ends with. s->value: of the hard rows and of the
 * level's at x. Returns 0 where it did not end.
 */
int hqp_guess(hqp_solver *s, int level) {
    real largest = 0.0, missing;
    int side = 0;
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (s->kind[i] != HQP_IDLE) largest = fmax(largest, s->norm[i]);
    }
    memset(s->side, 0, (size_t)s->row0[level + 1]);
    s->bundle.count = s->bundle.broken_count = 0;
    for (int k = 0; k < s->bundle.most; k++) s->bundle.slot[k] = k;
    if (!hold_equalities(s, level, largest) || (s->warm && !hold_known(s, level, largest))) return 0;
    for (;;) {
        make_trial(s);
        const int broken = most_broken(s, level, largest, &side, &missing);
        if (broken < 0) {
            memcpy(s->bundle.x, s->trial, (size_t)s->ld * sizeof(real));
            for (int k = 0; k < s->bundle.count; k++) s->bundle.side[k] = s->side[s->bundle.id[k]];
            return 1;
        }
        if (s->bundle.count + 1 >= s->bundle.most || hqp_out_of_iterations(s)) return 0;
        place(s, level, broken, side, largest);
        if (!bring_to_bound(s, level, missing)) {
            s->side[broken] = 0;
            return 0;
        }
    }
}
