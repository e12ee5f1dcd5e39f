/*
 * The first method: all levels in one go with guessed working sets, proven at the end.
 *
 * A level is minimal at the final x if its multipliers have the right signs there and x breaks no hard row;
 * whether the x between two levels breaks one does not matter. So each level is fitted once, holding only the
 * rows it is known to hold, and the last step (hqp_dual.c) looks after the rows that are broken then. Where
 * that is impossible it names the level that must give way, and the sweep goes on from there: a dual active
 * set over all levels at once.
 */
#include "hqp_internal.h"

#include <string.h>

/* A sweep that goes back to levels that must give way this often, over n^2 or, where these are more than FEW
 * variables, n^3 / FEW, or changes the set of one level this often, wanders: for the walk a change costs
 * less, the more so the more variables there are. */
enum { RETURNS = 8192, FEW = 32, REPAIRS = 32 };

static const real FAR = 1.0; /* times 1 + |x|: a step that puts no rounding right */

static int member(const hqp_solver *s, int i) {
    return i < s->work_rank ? s->work[s->work_order[i]] : s->fit[i - s->work_rank];
}

/* How clearly member i belongs to the working set: its multiplier, or its violation. */
static real strength(const hqp_solver *s, int i) {
    if (i < s->work_rank) return s->multiplier[i];
    const int id = member(s, i), side = s->side[id];
    return s->kind[id] == HQP_EQUALITY ? 0.0 : side * (s->trial_value[id] - hqp_bound(s, id, side));
}

static int belongs(const hqp_solver *s, int i) {
    const int id = member(s, i);
    if (i < s->work_rank) return s->multiplier[i] >= -s->rounding[i];
    return s->kind[id] == HQP_EQUALITY || hqp_at_bound(s, id, s->side[id], s->trial_value[id], s->trial_norm);
}

/*
 * Release members that do not belong: held rows with a wrong multiplier, fitted rows that crossed to the
 * inside. With `one_by_one` the set before the last addition was right, and only the member that is first to
 * lose its strength on the straight way from there goes (the ratio test of the dual method). Returns how many
 * do not belong.
 */
static int correct_set(hqp_solver *s, int one_by_one) {
    const int count = s->work_rank + s->fit_count;
    real way = 1.0;
    int first = -1, wrong = 0;
    hqp_find_multipliers(s, s->trial_value, s->trial_norm);
    for (int i = 0; i < count; i++) {
        if (belongs(s, i)) continue;
        const int id = member(s, i);
        const real now = strength(s, i), before = s->strength[id];
        wrong++;
        if (!one_by_one) s->side[id] = 0;
        if (before > way * (before - now)) continue;
        way = before > 0.0 ? before / (before - now) : 0.0;
        first = id;
    }
    for (int i = 0; i < count; i++) {
        real *of = &s->strength[member(s, i)];
        *of += way * (strength(s, i) - *of);
    }
    if (one_by_one && first >= 0) s->side[first] = 0;
    return wrong;
}

/* values at x of the rows of the level and of the hard rows it holds */
static void set_values(hqp_solver *s, int level) {
    const int holds = hqp_any_side(s, s->row0[level]);
    for (int i = 0; i < s->row0[level] && holds; i++) {
        if (s->side[i]) s->value[i] = hqp_value(s, i, s->x);
    }
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) s->value[i] = hqp_value(s, i, s->x);
}

/* Fit the level, holding what the guess holds. Returns 0 if the guess does not settle. */
static int fit_level(hqp_solver *s, int level, int repair, int one_by_one) {
    set_values(s, level);
    for (int repairs = 0;; repairs++) {
        hqp_factorise(s, level);
        if (level <= s->fixed_through && s->fit_rank < s->fit_count) return 0;
        hqp_find_step(s, 0);
        for (int i = 0; i < s->ld; i++) s->trial[i] = s->x[i] + s->step[i];
        s->trial_norm = hqp_length(s, s->trial);
        for (int i = s->row0[level]; i < s->row0[level + 1]; i++)
            s->trial_value[i] = hqp_value(s, i, s->trial);
        if (!correct_set(s, one_by_one)) break;
        if (!repair || repairs >= REPAIRS || hqp_out_of_iterations(s)) return 0;
    }
    hqp_move_to_trial(s);
    hqp_freeze(s, level);
    memset(s->forced, 0, (size_t)s->total);
    return 1;
}

/* A level that leaves no freedom, and in which no range need be fitted, is the business of the last step. */
static int may_be_last(const hqp_solver *s, int level, int fitted) {
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (s->kind[i] == HQP_RANGE && s->side[i]) return 0;
    }
    if (s->polishing && s->joined[level]) return 0; /* in its metric small weights cost digits */
    return level > s->fixed_through && fitted >= s->width - s->rank;
}

/* Solve one level with the guessed sets. Returns as hqp_finish. */
static int sweep_level(hqp_solver *s, int level, int repair, int one_by_one) {
    if (s->rank == s->width) {
        const int missed = hqp_seat_violated(s, level);
        hqp_close_level(s, level);
        return missed && level <= s->fixed_through ? HQP_LOST : HQP_DONE;
    }
    const int fitted = hqp_seat_guess(s, level);
    if (may_be_last(s, level, fitted)) {
        const int result = hqp_finish(s, level);
        if (result == HQP_DONE) {
            s->rank = s->width;
            hqp_close_level(s, level);
        }
        if (result != HQP_NOT_LAST) return result;
        hqp_seat_guess(s, level);
    }
    if (fitted && !fit_level(s, level, repair, one_by_one)) return HQP_LOST;
    hqp_close_level(s, level);
    s->rank_at[level + 1] = s->rank;
    return s->rank < s->width ? HQP_DONE : hqp_finish(s, level + 1);
}

/* So often, the sweep has gone back too often. */
static int wanders(const hqp_solver *s, int returns) {
    return returns * s->n * s->n > RETURNS * FEW / (s->n > FEW ? s->n : FEW);
}

/*
 * Sweep from `first` on; without `repair` the guess must be right at once. Returns 1 where the final x is
 * proven optimal; otherwise x is of no use.
 */
int hqp_sweep(hqp_solver *s, int first, int repair) {
    int back = -1, returns = 0;
    memset(s->forced, 0, (size_t)s->total);
    for (int level = first; level <= s->levels; level++) {
        s->rank_at[level] = s->rank;
        memcpy(s->path + level * s->ld, s->x, (size_t)s->ld * sizeof(real));
        if (level == s->levels && s->rank == s->width) break;
        const int result =
            level < s->levels ? sweep_level(s, level, repair, level == back) : hqp_finish(s, level);
        if (result == HQP_DONE) continue;
        if (result < first || !repair || wanders(s, ++returns) || hqp_out_of_iterations(s)) return 0;
        memcpy(s->x, s->path + result * s->ld, (size_t)s->ld * sizeof(real));
        hqp_rewind(s, result);
        back = result;
        level = result - 1;
    }
    memset(s->side, 0, (size_t)s->total);
    return 1;
}

/*
 * Move x to where, level by level, the minimum is with all rows held that x touches, whatever their
 * multipliers. What a small weight or a multiplier of any size has left of x's accuracy does not matter
 * there. Returns 0, and x is of no use, where rows that are nearly dependent would take it far away.
 */
int hqp_fit_face(hqp_solver *s) {
    hqp_rewind(s, 0);
    const real farthest = FAR * (1.0 + s->x_norm);
    for (int level = 0; level < s->levels && s->rank < s->width; level++) {
        s->rank_at[level] = s->rank;
        hqp_find_values(s);
        for (int i = 0; i < s->row0[level]; i++) {
            const int at_lb = hqp_touches(s, i, -1), at_ub = hqp_touches(s, i, 1);
            s->side[i] = hqp_is_hard(s, i) && (at_lb || at_ub) ? (at_lb ? -1 : 1) : 0;
        }
        hqp_seat_violated(s, level);
        hqp_factorise(s, level);
        hqp_find_step(s, 0);
        if (!(hqp_length(s, s->step) <= farthest)) return 0;
        for (int i = 0; i < s->ld; i++) s->x[i] += s->step[i];
        for (int i = 0; i < s->row0[level]; i++) {
            if (s->side[i]) s->frozen_at[i] = (short)level;
        }
        hqp_hold_fitted(s);
        hqp_close_level(s, level);
    }
    s->x_norm = hqp_length(s, s->x);
    return 1;
}
