/*
 * The working set of a level: its factorisation, the step it asks for, the multipliers that judge it, and
 * what is frozen when the level is solved. It consists of hard rows of earlier levels held at a bound
 * (`work`) and rows of the level fitted by least squares (`fit`: equalities and violated rows): the rows
 * whose `side` is not 0.
 */
#include "hqp_internal.h"

#include <string.h>

static const real CLEAR = 10.0; /* times rounding: a multiplier that is certainly not zero */

/* Whether the reflectors that follow are still those of these rows, none of which had to wait. The rows are
 * put in their order. */
static int are_known(const hqp_solver *s, int *ids, int count) {
    const int *known = s->column_row + s->top;
    if (s->top + count > s->built) return 0;
    for (int k = 0; k < count; k++) {
        int i = 0;
        while (i < count && ids[i] != known[k]) i++;
        if (i == count || !hqp_is_clear(s, known[k], s->line[(s->top + k) * (s->ld + 1)])) return 0;
    }
    memcpy(ids, known, (size_t)count * sizeof(int));
    return 1;
}

/* The rows as they were left behind these reflectors. */
static int take_up(hqp_solver *s, hqp_rows rows, int *order, int count) {
    for (int i = 0; i < count; i++) {
        const size_t size = (size_t)(s->top + 1 - s->rank) * sizeof(real);
        memcpy(hqp_row(s, rows, i) + s->rank, s->line + s->top * s->ld + s->rank, size);
        order[i] = i;
        s->top++;
    }
    return count;
}

/* Reduce these rows behind those that are. Returns their rank. */
static int reduce(hqp_solver *s, hqp_rows rows, int *ids, int *order, int count) {
    const int from = s->top;
    if (are_known(s, ids, count)) return take_up(s, rows, order, count);
    hqp_bring(s, ids, count);
    for (int i = 0; i < count; i++) {
        hqp_copy_base(s, rows, i, ids[i]);
        order[i] = i;
    }
    hqp_reflect_all(s, s->rank, from, rows, order, count);
    return hqp_lq(s, rows, ids, order, count);
}

/* Q^T applied to the working set: work Q = [L 0], fit Q = [F L 0] in the columns that earlier levels left
 * free. */
void hqp_factorise(hqp_solver *s, int level) {
    s->work_count = s->fit_count = 0;
    const int holds = hqp_any_side(s, s->row0[level]);
    for (int i = 0; i < s->row0[level] && holds; i++) {
        if (hqp_is_hard(s, i) && s->side[i]) s->work[s->work_count++] = i;
    }
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (s->side[i]) s->fit[s->fit_count++] = i;
    }
    s->top = s->rank;
    s->work_rank = reduce(s, s->work_rows, s->work, s->work_order, s->work_count);
    for (int i = s->work_rank; i < s->work_count; i++) s->side[s->work[s->work_order[i]]] = 0;
    s->fit_rank = reduce(s, s->fit_rows, s->fit, s->fit_order, s->fit_count);
}

static real missing(const hqp_solver *s, int id) {
    return hqp_bound(s, id, s->side[id]) - s->value[id];
}

/*
 * The shortest step from x that minimises the fitted rows, with the work rows kept where they are (keep != 0)
 * or brought exactly onto their bounds: L y = missing for work, then [L; M] z ~ missing - F y for fit, step =
 * Q (y, z).
 */
void hqp_find_step(hqp_solver *s, int keep) {
    const int brought = keep ? 0 : s->work_rank;
    real *y = s->reduced + s->rank;
    memset(s->reduced, 0, (size_t)s->ld * sizeof(real));
    for (int i = 0; i < brought; i++) {
        const int r = s->work_order[i];
        const real *row = hqp_row(s, s->work_rows, r) + s->rank;
        real sum = missing(s, s->work[r]);
        for (int k = 0; k < i; k++) sum -= row[k] * y[k];
        y[i] = sum / row[i];
    }
    for (int i = 0; i < s->fit_count; i++) {
        const int r = s->fit_order[i];
        const real *row = hqp_row(s, s->fit_rows, r) + s->rank;
        real sum = missing(s, s->fit[r]);
        for (int k = 0; k < brought; k++) sum -= row[k] * y[k];
        s->rhs[i] = sum;
    }
    hqp_least_squares(s, s->rank + s->work_rank);
    memcpy(s->step, s->reduced, (size_t)s->ld * sizeof(real));
    hqp_reflect_row_back(s, s->top, s->step);
    hqp_scatter(s, s->step);
}

static const real *work_triangle(const hqp_solver *s, int i) {
    return hqp_row(s, s->work_rows, s->work_order[i]) + s->rank;
}

/* What rounding can do to the multipliers: |L^{-T}| error, the rounding of the right-hand sides; L^{-1} is
 * found row by row. */
static void find_rounding(hqp_solver *s, const real *error) {
    memset(s->rounding, 0, (size_t)s->work_rank * sizeof(real));
    for (int j = 0; j < s->work_rank; j++) {
        const real *row = work_triangle(s, j);
        real *inverse = hqp_row(s, s->direction, j);
        memset(inverse, 0, (size_t)hqp_ceil4(s->work_rank) * sizeof(real));
        inverse[j] = 1.0;
        for (int k = 0; k < j; k++) {
            if (row[k] != 0.0) hqp_axpy(inverse, -row[k], hqp_row(s, s->direction, k), 0, hqp_ceil4(k + 1));
        }
        for (int i = 0; i <= j; i++) {
            inverse[i] /= row[j];
            s->rounding[i] += fabs(inverse[i]) * error[j];
        }
    }
}

/*
 * Multipliers of the work rows where the rows of the level have these values: L^T multiplier = F^T (value -
 * bound), times the norm of the row and signed so that they must not be negative. rounding: what is as good
 * as zero.
 */
void hqp_find_multipliers(hqp_solver *s, const real *value, real x_norm) {
    const real unit = s->settings.rounding;
    const int count = s->work_rank;
    real *lambda = s->multiplier, *error = s->step;
    for (int k = 0; k < count; k++) lambda[k] = error[k] = 0.0;
    for (int i = 0; i < s->fit_count && count > 0; i++) {
        const int id = s->fit[i];
        const real *row = hqp_row(s, s->fit_rows, i) + s->rank;
        const real bound = hqp_bound(s, id, s->side[id]), residual = value[id] - bound;
        const real of_value = unit * (fabs(bound) + s->norm[id] * x_norm);
        const real of_row = unit * s->norm[id] * fabs(residual);
        for (int k = 0; k < count; k++) {
            lambda[k] += row[k] * residual;
            error[k] += fabs(row[k]) * of_value + of_row;
        }
    }
    for (int i = count - 1; i >= 0; i--) {
        const real *row = work_triangle(s, i);
        lambda[i] /= row[i];
        error[i] += unit * fabs(row[i] * lambda[i]);
        for (int k = 0; k < i; k++) {
            lambda[k] -= row[k] * lambda[i];
            error[k] += unit * fabs(row[k] * lambda[i]);
        }
    }
    find_rounding(s, error);
    for (int i = 0; i < count; i++) {
        const int id = s->work[s->work_order[i]];
        s->rounding[i] *= s->norm[id];
        lambda[i] *= -s->side[id] * s->norm[id];
    }
}

void hqp_move_to_trial(hqp_solver *s) {
    real *swap = s->x;
    s->x = s->trial;
    s->trial = swap;
    swap = s->value;
    s->value = s->trial_value;
    s->trial_value = swap;
    s->x_norm = s->trial_norm;
}

/* Count one more working set, unless it is one too many or too late. */
int hqp_out_of_iterations(hqp_solver *s) {
    const real limit = s->settings.time_limit;
    if (limit > 0.0 && hqp_now() - s->began > limit) s->is_late = 1;
    if (s->is_late || s->iterations >= s->iteration_limit) return 1;
    s->iterations++;
    return 0;
}

/* What counts as next to no multiplier, times the norm of its row; 0: it does not matter. A row that is held
 * by none, but for rounding, is left to lower levels anyway. */
static real leaning(hqp_solver *s, int level) {
    if (s->strict[level] == PARTED || (s->leans >= 0 && s->leans != level) || s->row0[level + 1] == s->total)
        return 0.0;
    hqp_find_slacks(s, s->row0[level], s->row0[level + 1]);
    const int has_slack = hqp_has_slack(s, level);
    s->then[level] = s->none[level];
    return has_slack ? s->little[level] : 0.0;
}

/* Take out of the working set what need not be frozen. Returns how many rows. */
static int release_doubtful(hqp_solver *s, int level) {
    real little = s->work_rank ? leaning(s, level) : 0.0;
    int changes = 0;
    hqp_find_multipliers(s, s->value, s->x_norm);
    for (int i = 0; i < s->work_rank; i++) {
        const int id = s->work[s->work_order[i]], is_clear = s->multiplier[i] > CLEAR * s->rounding[i];
        if (is_clear && s->multiplier[i] < little) {
            s->leans = level;
            s->least = little = s->multiplier[i];
        }
        s->strength[id] = s->multiplier[i];
        s->clear[id] = (signed char)is_clear;
        if (s->forced[id] || is_clear) continue;
        s->side[id] = 0;
        changes++;
    }
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (s->kind[i] != HQP_RANGE || !s->side[i] || s->forced[i]) continue;
        if (hqp_outside(s, i, s->value[i], s->x_norm)) continue;
        s->side[i] = 0;
        changes++;
    }
    return changes;
}

/*
 * The level is minimal at x: hold its fitted rows for ever, and with them the work rows whose multiplier is
 * clearly not zero (at every minimiser they lie at their bound). What is doubtful stays a hard row, which is
 * always right.
 */
void hqp_freeze(hqp_solver *s, int level) {
    if (release_doubtful(s, level)) hqp_factorise(s, level);
    const int count = s->work_count || hqp_holds(s, level) ? s->row0[level] : 0;
    for (int i = 0; i < count; i++) {
        if (!hqp_is_hard(s, i)) continue;
        if (s->side[i]) {
            s->frozen_at[i] = s->guess_held_at[i] = (short)level;
            s->guess_held_side[i] = s->side[i];
        } else if (s->guess_held_at[i] == level) {
            s->guess_held_at[i] = -1;
        }
    }
    hqp_hold_fitted(s);
}

/* The rows that were factorised join the frozen ones. */
void hqp_hold_fitted(hqp_solver *s) {
    s->rank = s->lines = s->top;
}

/* Give the level's rows, and the hard rows it is to hold, the sides of the guess. Returns how many rows to
 * fit. */
int hqp_seat_guess(hqp_solver *s, int level) {
    int fitted = 0;
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        const int range = s->kind[i] == HQP_RANGE, equality = s->kind[i] == HQP_EQUALITY && !s->fixing[i];
        const int side = range ? s->guess_side[i] : equality;
        s->side[i] = side && isfinite(hqp_bound(s, i, side)) ? (signed char)side : 0;
        fitted += s->side[i] != 0;
    }
    if (!fitted || !hqp_holds(s, level)) return fitted;
    for (int i = 0; i < s->row0[level]; i++) {
        if (!hqp_is_hard(s, i) || s->guess_held_at[i] != level) continue;
        if (isfinite(hqp_bound(s, i, s->guess_held_side[i]))) s->side[i] = s->guess_held_side[i];
    }
    return fitted;
}

/* Equalities, and the rows of the level that x violates, get their side. Returns whether x misses any of
 * them. */
int hqp_seat_violated(hqp_solver *s, int level) {
    int violated = 0;
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        s->value[i] = hqp_value(s, i, s->x);
        const int now = s->kind[i] == HQP_IDLE ? 0 : hqp_outside(s, i, s->value[i], s->x_norm);
        s->side[i] = s->kind[i] == HQP_EQUALITY ? 1 : (signed char)now;
        violated |= now;
    }
    return violated;
}

/* The level is over: rows it leaves violated keep their value for good, the others become hard rows. */
void hqp_close_level(hqp_solver *s, int level) {
    for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
        if (s->kind[i] != HQP_RANGE) continue;
        s->guess_side[i] = s->side[i];
        s->frozen_at[i] = s->side[i] ? (short)level : -1;
    }
    memset(s->side, 0, (size_t)s->row0[level + 1]);
}

/* Take the factorisation and the rows of earlier levels back to the start of level `first`; x is where it
 * begins. */
void hqp_rewind(hqp_solver *s, int first) {
    s->rank = s->rank_at[first];
    s->is_projected = 0;
    if (s->lines > s->rank) s->lines = s->rank;
    if (s->leans >= first) s->leans = -1;
    s->x_norm = hqp_length(s, s->x);
    for (int i = 0; i < s->total; i++) s->frozen_at[i] = s->frozen_at[i] >= first ? -1 : s->frozen_at[i];
    memset(s->side, 0, (size_t)s->total);
    for (int i = 0; i < s->row0[first]; i++) s->value[i] = hqp_value(s, i, s->x);
}
