/*
 * Whether x is optimal, judged by x and the data, whatever the way there.
 *
 * With g the gradient of half of a level's squared slack, the level is minimal among the minimisers of those
 * before it where -g = sum lambda_i (+-row_i), with lambda_i >= 0 for hard rows at their bound, and of any
 * sign for rows whose value is settled: equalities, rows left violated, and rows that an earlier level holds
 * with a lambda > 0. There are two ways to see it. The multipliers and reflectors at hand are put into this
 * equation, at the cost of a few products. Where they do not fulfil it, -g is projected onto the directions
 * in which the earlier levels stay minimal (hqp_descent): nothing is left of it if and only if the level is
 * minimal.
 */
#include "hqp_internal.h"

#include <stdlib.h>
#include <string.h>

/* times norm of row (1 + slack): a gradient that counts as none; and times rounding of row . x: the same */
static const real PROVEN = 1e-9, ROUNDINGS = 1.0;
/* times that without the roundings: they are so large that long rows are looked through, which are those
 * whose own rounding is more than LONG of it */
static const real HIDING = 10.0, LONG = 0.1;
/* times these, in the first try: so exactly there is mostly but one answer proven */
static const real EXACT = 3e-3, EXACT_ROUNDINGS = 0.1;
/* times PROVEN, of the last level: no other leans on what is left of its gradient */
static const real LAST = 3.0;
/* times PROVEN, where levels are joined or were: the gradient of one with a small weight counts, too */
static const real FINER = 1e-4;
/* the same for such a level by itself, times norm of row (1 + slack), both scaled by the root of its weight
 */
static const real PART = 2e-6;
/* times what counts as none, but for EXACT: next to no multiplier, times the norm of its row */
static const real LITTLE = 2e3;
/* times that, or times what counts as none: a smaller multiplier settles no row, or lower levels could lean
 * on it a million times over */
static const real SETTLED = 0.5, SETTLED_IF_JOINED = 2.0;
/* times what a level's multipliers leave of its gradient: the same */
static const real CERTAIN = 1e8;
/* times that, by projection: what may be left of the gradient of a level, in the first try and then, and of
 * the last one, with more digits and without */
static const real PROJECTED_EXACT = 3.0, PROJECTED = 10.0,
                  PROJECTED_LAST = HQP_FINENESS < 1.0 ? 100.0 : 300.0;
/* times (1 + |value|): rounding of a row that hides its value */
static const real BLURRED = 1e-3;
/* Of a slack, times (1 + slack): by that much smaller it is no other one. */
static const real PROMISED = 5e-7;
/* times the square of what is left of a gradient: so long at most is that of a way down that is all of it */
static const real ALL = 2.0;
/* To confirm a proof: times what may be left of a gradient otherwise; rows at a smaller angle are one row. */
static const real LENIENT = 200.0, ONE_ROW = 1e-7;
/* times (1 + |bound|), plus that many times rounding of row . x: a row this close is at its bound */
static const real TOUCHING = 1e-9, NEAR = 20.0;

/* s->lacking of rows whose values are known */
void hqp_find_slacks(hqp_solver *s, int from, int to) {
    for (int i = from; i < to; i++) s->lacking[i] = hqp_slack(s, i);
}

/* s->value = row . x, and s->lacking */
void hqp_find_values(hqp_solver *s) {
    s->x_norm = hqp_length(s, s->x);
    for (int i = 0; i < s->total; i++) s->value[i] = hqp_value(s, i, s->x);
    hqp_find_slacks(s, 0, s->total);
}

/* Length of a gradient that counts as none for the level that is joined to this one. */
static real of_the_next(const hqp_solver *s, int level) {
    real squares = 0.0, largest = 0.0;
    for (int i = s->first_row[level + 1]; i < s->row0[level + 1]; i++) {
        if (s->kind[i] == HQP_IDLE) continue;
        squares += s->lacking[i] * s->lacking[i];
        largest = fmax(largest, s->norm[i]);
    }
    return PART * largest * (ldexp(1.0, -s->joined[level]) + sqrt(squares));
}

/* More is asked of a level that is or was joined to the next one. */
static int is_strict(const hqp_solver *s, int level) {
    return (s->joined[level] || s->strict[level]) && !s->is_lax;
}

/* A value of the row is, to within what a proof minds, its bound at this side; and so is its value at x. */
int hqp_touches_with(const hqp_solver *s, int id, int side, real value, real x_norm) {
    const real bound = hqp_bound(s, id, side);
    const real near = NEAR * s->settings.rounding * s->norm[id] * x_norm;
    return isfinite(bound) && fabs(bound - value) <= TOUCHING * (1.0 + fabs(bound)) + near;
}

int hqp_touches(const hqp_solver *s, int id, int side) {
    return hqp_touches_with(s, id, side, s->value[id], s->x_norm);
}

/* The rounding of the row's value, times the row, is no less than what counts as none. */
int hqp_is_long(const hqp_solver *s, int level, int id) {
    const real rounding = s->settings.rounding * s->norm[id] * s->x_norm;
    return s->kind[id] != HQP_IDLE && rounding * s->norm[id] > LONG * s->none[level];
}

/* Rows of the level that are missed by no more than the rounding of their value count as met. */
static void meet_rounded(hqp_solver *s, int level) {
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (fabs(s->lacking[i]) <= s->settings.rounding * s->norm[i] * s->x_norm) s->lacking[i] = 0.0;
    }
}

/* What the rows amount to that a level misses: their slack and, each counted by the square of it, their
 * length; what they pull at most; and what of that may be rounding, but for long rows where these are looked
 * through. */
typedef struct missed {
    real slack, length, most, rounding;
} missed;

static missed find_missed(const hqp_solver *s, int level) {
    real squares = 0.0, pulls = 0.0, most = 0.0, longest = 0.0;
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        const real slack = s->lacking[i], pull = fabs(slack) * s->norm[i];
        if (slack == 0.0 || s->kind[i] == HQP_IDLE) continue;
        squares += slack * slack;
        pulls += pull * pull;
        most += pull;
        if (!s->hidden[level] || !hqp_is_long(s, level, i)) longest = fmax(longest, s->norm[i]);
    }
    const real slack = sqrt(squares), length = squares > 0.0 ? sqrt(pulls / squares) : longest;
    const real rounding = s->settings.rounding * (length * slack + longest * longest * s->x_norm);
    return (missed){slack, length, most, rounding};
}

/* Whether a level, whose slacks are known, has one worth a proof; s->none[level]: the length of a gradient
 * that counts as none, s->little[level]: the same of a multiplier, times the norm of its row, on which a
 * level leans; s->hidden[level]: the rounding of long rows would hide what short ones lack. */
int hqp_has_slack(hqp_solver *s, int level) {
    const int is_finer = is_strict(s, level), is_last = hqp_is_last(s, level);
    const int is_exact = s->is_exact && !is_finer && !is_last;
    const real factor = PROVEN * (is_finer ? FINER : is_last ? LAST : is_exact ? EXACT : 1.0);
    const real roundings = is_exact ? EXACT_ROUNDINGS : ROUNDINGS;
    s->hidden[level] = 0;
    missed of = find_missed(s, level);
    s->none[level] = factor * of.length * (1.0 + of.slack);
    const int is_short = s->settings.rounding * s->x_norm <= BLURRED;
    if (is_short && !s->joined[level] && roundings * of.rounding > HIDING * s->none[level]) {
        s->hidden[level] = 1;
        meet_rounded(s, level);
        of = find_missed(s, level);
        s->none[level] = factor * of.length * (1.0 + of.slack);
    }
    s->none[level] += roundings * of.rounding;
    if (s->joined[level] && !s->is_lax) s->none[level] = fmin(s->none[level], of_the_next(s, level));
    if (!isfinite(s->none[level])) s->none[level] = 0.0;
    s->little[level] = LITTLE * s->none[level] / (is_exact ? EXACT : 1.0);
    return !(of.most <= s->none[level]);
}

/* g = -sum slack row over the rows of the level */
void hqp_gradient(const hqp_solver *s, int level, real *g) {
    memset(g, 0, (size_t)s->ld * sizeof(real));
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        const real slack = s->kind[i] == HQP_IDLE ? 0.0 : s->lacking[i];
        if (slack == 0.0) continue;
        hqp_axpy(g, -slack, hqp_row(s, s->given, i), s->given.first[i], s->given.last[i]);
    }
}

/* g += lambda (+-row) over the rows that the level holds. Returns 0 where one has a wrong sign or is off its
 * bound. */
static int add_held(const hqp_solver *s, int level, real *g) {
    for (int i = 0; i < s->row0[level]; i++) {
        const int is_settled = s->frozen_at[i] >= 0 && s->frozen_at[i] < level;
        if (s->guess_held_at[i] != level || s->kind[i] == HQP_IDLE || is_settled) continue;
        const int side = s->guess_held_side[i];
        if (s->kind[i] == HQP_RANGE && !(s->strength[i] >= -s->none[level] && hqp_touches(s, i, side)))
            return 0;
        const real lambda = s->strength[i] / s->norm[i];
        hqp_axpy(g, side * lambda, hqp_row(s, s->given, i), s->given.first[i], s->given.last[i]);
    }
    return 1;
}

/* What the multipliers at hand leave of the gradient of this level; infinite where one has a wrong sign. */
static real left_by_held(hqp_solver *s, int level) {
    real *g = s->trial, *rest = s->reduced, sum = 0.0;
    hqp_gradient(s, level, g);
    if (!add_held(s, level, g)) return INFINITY;
    hqp_gather(s, rest, g);
    hqp_reflect_row(s, s->rank_at[level], rest);
    for (int j = s->rank_at[level]; j < s->width; j++) sum += rest[j] * rest[j];
    return sqrt(sum);
}

/* The row is left violated by more than counts as none, and beyond what counts as its bound: by less, it is a
 * row at its bound. */
static int is_missed(const hqp_solver *s, int level, int id) {
    return fabs(s->lacking[id]) * s->norm[id] > s->lenience * s->none[level] &&
           !hqp_touches(s, id, s->lacking[id] > 0.0 ? -1 : 1);
}

/* The level that froze this row settles its value beyond doubt, by a clear multiplier or violation. */
static int is_certain(const hqp_solver *s, int id) {
    const int at = s->frozen_at[id];
    if (id >= s->row0[at]) return is_missed(s, at, id);
    const real settled = is_strict(s, at) ? SETTLED_IF_JOINED * s->none[at] : SETTLED * s->little[at];
    return s->clear[id] && s->strength[id] > settled;
}

/* The first level that settles the value of a row without being clear about its multiplier or violation. */
static int first_doubtful(const hqp_solver *s) {
    int first = s->levels;
    for (int i = 0; i < s->total; i++) {
        const int at = s->frozen_at[i];
        if (at >= 0 && at < first && !is_certain(s, i)) first = at;
    }
    return first;
}

/* The level leaves so much of its gradient: it is clear about none of the rows that it holds by too little
 * for that. Returns whether there are any. */
static int any_unclear(hqp_solver *s, int level, real rest) {
    int any = 0;
    for (int i = 0; i < s->row0[level]; i++) {
        if (s->frozen_at[i] != level || !(rest > s->strength[i] / CERTAIN)) continue;
        s->clear[i] = 0;
        any = 1;
    }
    return any;
}

/*
 * Whether what earlier levels have frozen holds the gradient, which left_by_held has put into their columns,
 * with multipliers of the right sign where a row's value is in doubt: it then is a hard row at its bound.
 * Multipliers of which the rounding is more than what counts as none hold nothing: they are those of an
 * earlier level, times as much as it takes to make good what was wrong in the last digit.
 */
static int is_held_by_frozen(hqp_solver *s, int level) {
    real *rest = s->reduced, least = INFINITY, most = 0.0;
    if (s->rank_at[level] > s->lines) return 0;
    for (int k = s->rank_at[level] - 1; k >= 0; k--) {
        const int id = s->column_row[k];
        const real *row = s->line + k * s->ld;
        const real multiplier = -rest[k] / row[k];
        hqp_add(rest, multiplier, row, k);
        most = fmax(most, fabs(multiplier) * s->norm[id]);
        if (s->kind[id] != HQP_RANGE || is_certain(s, id)) continue;
        const int side = id >= s->row0[s->frozen_at[id]] ? s->guess_side[id] : s->guess_held_side[id];
        const real strength = side * multiplier * s->norm[id];
        if (!(strength >= -s->none[level] && hqp_touches(s, id, side))) return 0;
        if (strength > s->none[level] && strength < least) least = strength;
    }
    if (!(HQP_UNIT * most <= s->none[level])) return 0;
    if (s->leans < 0 && least < s->little[level] && !hqp_is_last(s, level)) {
        s->leans = level;
        s->least = least;
    }
    return 1;
}

/* x is so long that the rounding of a row, whatever it sees of x, hides its value: it proves nothing, for
 * what is minded of a row grows with |x|. s->value: row . x. */
static int is_blurred(const hqp_solver *s) {
    if (!(s->settings.rounding * s->x_norm > BLURRED)) return 0;
    for (int i = 0; i < s->total; i++) {
        if (s->kind[i] == HQP_IDLE) continue;
        if (s->settings.rounding * s->norm[i] * s->x_norm > BLURRED * (1.0 + fabs(s->value[i]))) return 1;
    }
    return 0;
}

/*
 * How many of the first `count` levels the multipliers at hand prove to be minimal at x, up to the first that
 * they do not. s->value: row . x.
 */
int hqp_prove(hqp_solver *s, int count) {
    s->is_doubtful = 0;
    if (is_blurred(s)) return 0;
    for (int p = 0; p < s->levels; p++) s->slack[p] = (signed char)hqp_has_slack(s, p);
    int doubtful = first_doubtful(s);
    for (int p = 0; p < count; p++) {
        if (!s->slack[p]) continue;
        s->is_doubtful = p > doubtful;
        if (p <= s->fixed_through) return p;
        const int is_free = s->rank_at[p] < s->width;
        const real rest = is_free || s->is_doubtful ? left_by_held(s, p) : 0.0;
        if (!(rest <= s->none[p]) || (s->is_doubtful && !is_held_by_frozen(s, p))) return p;
        if (any_unclear(s, p, rest) && p < doubtful) doubtful = p;
    }
    s->is_doubtful = 0;
    return count;
}

/* How far x can go along a direction, no further than `step`, before a row of an earlier level minds. */
static real room_along(const hqp_solver *s, int level, const real *direction, real step) {
    for (int i = 0; i < s->row0[level]; i++) {
        if (s->kind[i] == HQP_IDLE) continue;
        const real along = hqp_value(s, i, direction);
        const real room = along > 0.0 ? s->ub[i] - s->value[i] : s->value[i] - s->lb[i];
        const real free = hqp_is_hard(s, i) ? fmax(room, 0.0) : 0.0;
        step = fmin(step, (free + s->settings.rounding * s->norm[i] * s->x_norm) / fabs(along));
    }
    return step;
}

/* The way down, which is as long as it is steep, promises to make the slack of the level smaller by more than
 * anybody minds. So much is left of the gradient; where that is less than the way down, other rows hold it.
 */
static int is_promising(const hqp_solver *s, int level, real left) {
    const real length = hqp_length(s, s->descent), slope = length * length;
    if (slope > ALL * left * left) return 0;
    real curvature = 0.0, squares = 0.0;
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (s->kind[i] == HQP_IDLE || (s->kind[i] == HQP_RANGE && s->lacking[i] == 0.0)) continue;
        const real along = hqp_value(s, i, s->descent);
        curvature += along * along;
        squares += s->lacking[i] * s->lacking[i];
    }
    const real step = room_along(s, level, s->descent, slope / curvature), slack = sqrt(squares);
    return step * (slope - 0.5 * step * curvature) > PROMISED * slack * (1.0 + slack);
}

/* Whether so little is left of the gradient of a level that its projection proves it minimal. */
static int is_little(hqp_solver *s, int level, real left) {
    const real upper = s->is_exact ? PROJECTED_EXACT : PROJECTED;
    const real most = is_strict(s, level) ? 1.0 : hqp_is_last(s, level) ? PROJECTED_LAST : upper;
    s->left = left / s->none[level];
    if (left <= s->lenience * s->none[level]) return 1;
    s->is_rough = 1;
    if (!(left <= fmax(most, s->lenience) * s->none[level])) return 0;
    return !hqp_is_last(s, level) || !is_promising(s, level, left);
}

/* What is left of the gradient of a level at x, whose values are known, 0 without a slack worth a proof;
 * s->descent is a way down where there is one. */
static real left_of(hqp_solver *s, int level) {
    if (!hqp_has_slack(s, level) || s->rank == s->width) return 0.0;
    return hqp_descent(s, level);
}

/* Where what held the projections of this level is remembered: apart, and with levels joined. */
static int memory(const hqp_solver *s, int level) {
    const size_t size = (size_t)(s->levels + 1) * sizeof(int);
    return memcmp(s->row0, s->first_row, size) == 0 ? level : s->levels + level;
}

/* The hard rows that held the last projection that proved this level get their side, of one of the same kind
 * if there was any; where there was none, those that this level or one before holds by guess. */
void hqp_seat_held(hqp_solver *s, int level) {
    const int own = memory(s, level), other = own < s->levels ? s->levels + level : level;
    const int at = s->proof.count[own] ? own : other, count = s->proof.count[at];
    const int *known = s->proof.held + at * s->n;
    for (int i = 0; i < s->row0[level]; i++) {
        const int is_held = s->guess_held_at[i] >= 0 && s->guess_held_at[i] <= level && hqp_is_hard(s, i);
        s->side[i] = is_held && !count ? s->guess_held_side[i] : 0;
    }
    for (int k = 0; k < count; k++) {
        const int id = abs(known[k]) - 1;
        if (id < s->row0[level] && hqp_is_hard(s, id)) s->side[id] = known[k] < 0 ? -1 : 1;
    }
}

/* Remember the hard rows that hold the projection of this level, if it needed any. */
static void remember(hqp_solver *s, int level) {
    const int at = memory(s, level);
    int *known = s->proof.held + at * s->n, count = 0;
    for (int k = 0; k < s->held.count && s->cone.least < INFINITY; k++) {
        const int id = s->held.id[k];
        if (id >= s->row0[level]) continue;
        s->proof.multiplier[at * s->n + count] = s->cone.length * s->held.multiplier[k] * s->norm[id];
        known[count++] = s->side[id] * (id + 1);
    }
    s->proof.count[at] = count;
}

/* Equalities, and the rows of the level that are missed by more than counts as none, get their side. */
void hqp_seat_missed(hqp_solver *s, int level) {
    hqp_seat_violated(s, level);
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (s->kind[i] == HQP_RANGE && !is_missed(s, level, i)) s->side[i] = 0;
    }
}

/*
 * The same by projection, in the order of the levels and with a factorisation of its own, which holds for
 * good only what is settled beyond doubt. Where it stops, a walk can go on.
 */
int hqp_prove_by_descent(hqp_solver *s, int count) {
    hqp_unfix(s);
    hqp_rewind(s, 0);
    s->is_rough = 0;
    s->hardest = 0.0;
    hqp_find_values(s);
    if (is_blurred(s)) return 0;
    for (int p = 0; p < count; p++) {
        s->rank_at[p] = s->rank;
        hqp_seat_held(s, p);
        s->cone.least = INFINITY;
        if (!is_little(s, p, left_of(s, p))) return p;
        remember(s, p);
        if (s->leans < 0 && s->cone.least < s->little[p] && !hqp_is_last(s, p)) {
            s->leans = p;
            s->least = s->cone.least;
        }
        memset(s->side, 0, (size_t)s->row0[p]);
        hqp_seat_missed(s, p);
        if (s->rank < s->width) {
            hqp_factorise(s, p);
            hqp_hold_fitted(s);
        }
        hqp_close_level(s, p);
    }
    s->rank_at[count] = s->rank;
    s->is_projected = count == s->levels;
    return count;
}

/* Whether no way down is left for the level at x; s->descent is one where there is. */
int hqp_is_minimal(hqp_solver *s, int level) {
    hqp_find_values(s);
    return left_of(s, level) <= s->none[level];
}

/*
 * Whether a proof by the multipliers at hand stands without what they settle. With a coarse idea of rank a
 * level is minimal up to more than its rounding, and lower levels may lean on that through a multiplier, by
 * its inverse. Leaves a factorisation that neither hqp_resolve nor a walk can take up.
 */
int hqp_confirm(hqp_solver *s) {
    const real rank = s->settings.rank;
    const int rank_at_end = hqp_rank(s), leans = s->leans;
    s->settings.rank = ONE_ROW;
    s->lenience = LENIENT;
    s->resumable = 0;
    const int proven = hqp_prove_by_descent(s, s->levels);
    s->settings.rank = rank;
    s->lenience = 1.0;
    s->is_projected = 0;
    s->rank_at[s->levels] = rank_at_end;
    s->leans = leans;
    return proven == s->levels;
}
