/*
 * The second method, for what the sweep does not settle: one level after the other with certainty.
 *
 * phi(x) = 1/2 dist(rows of the level, their bounds)^2 is convex and piecewise quadratic, and x is a
 * minimiser of the levels before. First, working sets are tried and corrected as a whole, and kept only if
 * they prove optimal. Where this does not settle, a primal active-set descent follows: phi falls at each step
 * and hard rows never break.
 */
#include "hqp_internal.h"

#include <string.h>

/* FEW: changes of a set that are no sign of going astray; MANY: of a guessed set, that are one */
enum { TRIALS = 6, FEW = 4, MANY = 10, PATIENCE = 8 };
static const real DOUBT = 0.05; /* times rounding: a multiplier that is wrong by less is left alone */

/* row . x for the hard rows of earlier levels and the rows of this one */
static void level_values(const hqp_solver *s, int level, const real *x, real *value) {
    for (int i = 0; i < s->row0[level + 1]; i++) {
        if (i >= s->row0[level] || hqp_is_hard(s, i)) value[i] = hqp_value(s, i, x);
    }
}

/* trial = x + length step, and the values there */
static void make_trial(hqp_solver *s, int level, real length) {
    for (int i = 0; i < s->ld; i++) s->trial[i] = s->x[i] + length * s->step[i];
    s->trial_norm = hqp_length(s, s->trial);
    level_values(s, level, s->trial, s->trial_value);
}

/* Fit rows of the level whose violation began, drop those where it clearly ended. Returns how many changed.
 */
static int revise_fit(hqp_solver *s, int level, const real *value, real x_norm) {
    int changes = 0;
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (s->kind[i] != HQP_RANGE) continue;
        const int now = hqp_outside(s, i, value[i], x_norm);
        if (now == s->side[i] || (now == 0 && hqp_at_bound(s, i, s->side[i], value[i], x_norm))) continue;
        s->side[i] = (signed char)now;
        changes++;
    }
    return changes;
}

static int is_wrong(const hqp_solver *s, int i) {
    return s->multiplier[i] < -DOUBT * s->rounding[i];
}

/* Hold hard rows that broke, release work rows with a wrong multiplier. Returns how many changed. */
static int revise_work(hqp_solver *s, int level) {
    int changes = 0;
    hqp_find_multipliers(s, s->trial_value, s->trial_norm);
    for (int i = 0; i < s->row0[level]; i++) {
        if (!hqp_is_hard(s, i) || s->side[i]) continue;
        s->side[i] = (signed char)hqp_outside(s, i, s->trial_value[i], s->trial_norm);
        changes += s->side[i] != 0;
    }
    for (int i = 0; i < s->work_rank; i++) {
        if (!is_wrong(s, i)) continue;
        s->side[s->work[s->work_order[i]]] = 0;
        changes++;
    }
    return changes;
}

/* Take whole steps from the same x, correct the working set where it proved wrong, and move once it is right.
 * Sets that go on to prove as wrong as before are given up, and so is the first one where more than `most`
 * changes are due. */
static int settle_by_trial(hqp_solver *s, int level, int most) {
    for (int trial = 0, before = FEW; trial < TRIALS; trial++) {
        if (trial > 0 && hqp_out_of_iterations(s)) return 0;
        hqp_factorise(s, level);
        hqp_find_step(s, 0);
        make_trial(s, level, 1.0);
        int changes = revise_work(s, level);
        changes += revise_fit(s, level, s->trial_value, s->trial_norm);
        if (!changes) {
            hqp_move_to_trial(s);
            return 1;
        }
        if (trial > 0 ? changes >= before : changes > most) return 0;
        before = changes > FEW ? changes : FEW;
    }
    return 0;
}

/* Longest step along which no hard row breaks; *block is the row that ends it, or -1 */
static real longest_step(const hqp_solver *s, int level, const real *slope, int *block) {
    const real least = 2.0 * s->settings.rank * hqp_length(s, s->step);
    real longest = INFINITY;
    *block = -1;
    for (int i = 0; i < s->row0[level]; i++) {
        if (!hqp_is_hard(s, i) || s->side[i] || !(fabs(slope[i]) > least * s->norm[i])) continue;
        const real bound = slope[i] > 0.0 ? s->ub[i] : s->lb[i];
        const real reach = fmax((bound - s->value[i]) / slope[i], 0.0);
        if (reach >= longest) continue;
        longest = reach;
        *block = i;
    }
    return longest;
}

/* Minimise phi(x + alpha step) over [0, limit]: its derivative is piecewise linear, walk from kink to kink.
 */
static real line_search(const hqp_solver *s, int level, const real *slope, real limit) {
    real alpha = 0.0;
    for (int kinks = 2 * (s->row0[level + 1] - s->row0[level]); kinks >= 0; kinks--) {
        real first = 0.0, second = 0.0, next = limit;
        for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
            if (s->kind[i] == HQP_IDLE || slope[i] == 0.0) continue;
            const real upper = (s->ub[i] - s->value[i]) / slope[i],
                       lower = (s->lb[i] - s->value[i]) / slope[i];
            if (upper > alpha && upper < next) next = upper;
            if (lower > alpha && lower < next) next = lower;
            const int above = s->kind[i] == HQP_EQUALITY || (slope[i] > 0.0 ? upper <= alpha : upper > alpha);
            const int below = slope[i] > 0.0 ? lower > alpha : lower <= alpha;
            if (!above && !below) continue;
            first += (s->value[i] + alpha * slope[i] - (above ? s->ub[i] : s->lb[i])) * slope[i];
            second += slope[i] * slope[i];
        }
        if (!(first < 0.0)) return alpha;
        if (alpha - first / second < next) return alpha - first / second;
        if (!(next < INFINITY)) return alpha;
        alpha = next;
        if (alpha >= limit) return limit;
    }
    return alpha;
}

/* Release the work row with the worst multiplier, if one is wrong. */
static int release_one(hqp_solver *s) {
    real worst = 0.0;
    int release = -1;
    hqp_find_multipliers(s, s->value, s->x_norm);
    for (int i = 0; i < s->work_rank; i++) {
        if (!is_wrong(s, i) || s->multiplier[i] >= worst) continue;
        worst = s->multiplier[i];
        release = s->work[s->work_order[i]];
    }
    if (release >= 0) s->side[release] = 0;
    return release >= 0;
}

/* Start from what the trials hold and x really touches. */
static void begin_descent(hqp_solver *s, int level) {
    for (int i = 0; i < s->row0[level]; i++) {
        if (hqp_is_hard(s, i) && s->side[i] && !hqp_at_bound(s, i, s->side[i], s->value[i], s->x_norm))
            s->side[i] = 0;
    }
    hqp_seat_violated(s, level);
}

/* no fitted row would change by more than its tolerance: x already minimises the piece */
static int negligible(const hqp_solver *s, const real *slope) {
    for (int i = 0; i < s->fit_count; i++) {
        const int id = s->fit[i];
        if (fabs(slope[id]) > hqp_tolerance(s, id, hqp_bound(s, id, s->side[id]), s->x_norm)) return 0;
    }
    return 1;
}

/*
 * Rows of the level at their bound, to within rounding, that the step carries outside at once join the fitted
 * rows: phi is the same with and without them, and the next step minds them. Returns how many.
 */
static int fit_outgoing(hqp_solver *s, int level, const real *slope) {
    int added = 0;
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (s->kind[i] != HQP_RANGE || s->side[i] || slope[i] == 0.0) continue;
        const int side = slope[i] < 0.0 ? -1 : 1;
        if (!isfinite(hqp_bound(s, i, side)) || !hqp_at_bound(s, i, side, s->value[i], s->x_norm)) continue;
        s->side[i] = (signed char)side;
        added++;
    }
    return added;
}

enum progress { MOVED, STUCK, MINIMAL }; /* MINIMAL: on the face of the working set */

static enum progress descent_step(hqp_solver *s, int level) {
    int block;
    hqp_factorise(s, level);
    hqp_find_step(s, 1);
    real *slope = s->trial_value;
    level_values(s, level, s->step, slope);
    if (negligible(s, slope)) return MINIMAL;
    const real limit = longest_step(s, level, slope, &block);
    const real length = line_search(s, level, slope, limit);
    const int blocked = block >= 0 && length >= limit;
    if (!blocked && length < 1e-6 && fit_outgoing(s, level, slope)) return STUCK;
    if (!blocked && !(length > 0.0)) return MINIMAL;
    if (blocked) s->side[block] = slope[block] < 0.0 ? -1 : 1;
    make_trial(s, level, length);
    hqp_move_to_trial(s);
    const int revised = revise_fit(s, level, s->value, s->x_norm);
    if (!(length > 0.0)) return STUCK;
    return !blocked && !revised && fabs(length - 1.0) < 1e-9 ? MINIMAL : MOVED;
}

/* phi at x */
static real half_square(const hqp_solver *s, int level) {
    real sum = 0.0;
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) sum += 0.5 * hqp_slack(s, i) * hqp_slack(s, i);
    return sum;
}

/* Whether the multipliers of the working set, which was factorised for this x, prove the level minimal. */
static int is_held(hqp_solver *s, int level) {
    real *g = s->trial, *rest = s->reduced, sum = 0.0;
    hqp_find_slacks(s, s->row0[level], s->row0[level + 1]);
    if (!hqp_has_slack(s, level)) return 1;
    hqp_find_multipliers(s, s->value, s->x_norm);
    for (int i = 0; i < s->work_rank; i++) {
        const int id = s->work[s->work_order[i]];
        if (!(s->multiplier[i] >= -s->none[level] && hqp_touches(s, id, s->side[id]))) return 0;
    }
    hqp_gradient(s, level, g);
    hqp_gather(s, rest, g);
    hqp_reflect_row(s, s->top, rest);
    for (int j = s->rank + s->work_rank; j < s->width; j++) sum += rest[j] * rest[j];
    return sqrt(sum) <= s->none[level];
}

static int is_minimal(hqp_solver *s, int level) {
    s->is_factorised = is_held(s, level);
    return s->is_factorised || hqp_is_minimal(s, level);
}

/* Go down by the projected gradient, which leads away from a vertex at which working sets repeat. The working
 * set is what holds the gradient, and what ends the step. Returns whether phi fell. */
static int leave_vertex(hqp_solver *s, int level) {
    int block;
    memcpy(s->step, s->descent, (size_t)s->ld * sizeof(real));
    real *slope = s->trial_value;
    level_values(s, level, s->step, slope);
    const real limit = longest_step(s, level, slope, &block), before = half_square(s, level);
    const real length = line_search(s, level, slope, limit);
    if (block >= 0 && length >= limit) s->side[block] = slope[block] < 0.0 ? -1 : 1;
    if (!(length > 0.0)) return 0;
    make_trial(s, level, length);
    hqp_move_to_trial(s);
    hqp_seat_violated(s, level);
    return half_square(s, level) < before;
}

/*
 * Primal descent. After PATIENCE steps without progress, and where the working set finds no way down, the
 * projected gradient decides: it is none at a minimum, and else phi falls, so that no working set comes back
 * after it. Where rounding keeps phi from falling the level is given up.
 */
static hqp_status descend(hqp_solver *s, int level) {
    int stalled = 0;
    begin_descent(s, level);
    while (!hqp_out_of_iterations(s)) {
        const enum progress progress = descent_step(s, level);
        const int at_end = progress == MINIMAL && !release_one(s);
        stalled = progress == MOVED ? 0 : stalled + 1;
        if (!at_end && stalled < PATIENCE) continue;
        if (at_end ? is_minimal(s, level) : hqp_is_minimal(s, level)) return HQP_SOLVED;
        if (!leave_vertex(s, level)) return HQP_REPEATED_SET;
        stalled = 0;
    }
    return HQP_ITERATION_CAP;
}

static int breaks_none(const hqp_solver *s, int level) {
    int broken = 0;
    for (int i = 0; i < s->row0[level] && !broken; i++)
        broken = hqp_is_hard(s, i) && hqp_outside(s, i, s->trial_value[i], s->trial_norm);
    return !broken;
}

/* Go from x to where the guess ended, with the hard rows that it holds brought exactly to their bounds,
 * unless another one breaks there. */
static void move_to_guess(hqp_solver *s, int level) {
    real *const back = s->kept;
    memcpy(back, s->x, (size_t)s->ld * sizeof(real));
    memcpy(s->x, s->bundle.x, (size_t)s->ld * sizeof(real));
    s->x_norm = hqp_length(s, s->x);
    level_values(s, level, s->x, s->value);
    memset(s->side, 0, (size_t)s->row0[level + 1]);
    for (int k = 0; k < s->bundle.count; k++) {
        if (s->bundle.id[k] < s->row0[level]) s->side[s->bundle.id[k]] = s->bundle.side[k];
    }
    hqp_factorise(s, level);
    hqp_find_step(s, 0);
    make_trial(s, level, 1.0);
    if (breaks_none(s, level)) {
        hqp_move_to_trial(s);
        return;
    }
    memcpy(s->x, back, (size_t)s->ld * sizeof(real));
    s->x_norm = hqp_length(s, s->x);
    level_values(s, level, s->x, s->value);
}

/* Whether x moves to the level's minimum by a working set that is known, or guessed. If not, x may be where
 * the guess ended: it is close to the minimum, and lies on the hard rows that hold it. */
static int settle(hqp_solver *s, int level) {
    if (s->warm) {
        hqp_seat_guess(s, level);
        if (settle_by_trial(s, level, s->total) && is_minimal(s, level)) return 1;
    }
    level_values(s, level, s->x, s->value);
    const int is_guessed = hqp_guess(s, level);
    if (!is_guessed) hqp_seat_violated(s, level);
    if (settle_by_trial(s, level, is_guessed ? MANY : s->total)) return is_minimal(s, level);
    if (is_guessed) move_to_guess(s, level);
    return 0;
}

/* Solve one level from a minimiser x of the levels before. */
hqp_status hqp_walk(hqp_solver *s, int level) {
    hqp_status status = HQP_SOLVED;
    const int violated = hqp_seat_violated(s, level);
    s->is_factorised = 0;
    if (s->rank < s->width) {
        if (violated && !settle(s, level)) status = descend(s, level);
        if (status != HQP_ITERATION_CAP) {
            if (!s->is_factorised) hqp_factorise(s, level);
            hqp_freeze(s, level);
        }
    }
    hqp_close_level(s, level);
    return status;
}
