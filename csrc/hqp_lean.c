/*
 * Whether a join would leave a row, as far as the first step tells.
 *
 * A level holds rows with multipliers lambda >= 0. They hold the next one, too, by mu of either sign, and
 * with them the rows A that the level fits: -g = sum mu_i (+-row_i) + A^T nu. Both as one, the next with a
 * small weight w, have their minimum where the slack of the level differs by w nu, with multipliers lambda +
 * w mu. As long as these are positive no row is left.
 */
#include "hqp_internal.h"

#include <stdlib.h>
#include <string.h>

/* of a multiplier, what the next level may take; and of the slack, what it may change it by */
static const real SHARE = 0.9, CHANGE = 0.1;

/* Freeze what the level holds, by the proof of it, and fits. Returns whether what it holds is independent. */
static int freeze(hqp_solver *s, int level) {
    const int *held = s->proof.held + level * s->n;
    for (int k = 0; k < s->proof.count[level]; k++) s->side[abs(held[k]) - 1] = held[k] < 0 ? -1 : 1;
    hqp_seat_missed(s, level);
    hqp_factorise(s, level);
    for (int i = 0; i < s->row0[level + 1]; i++) {
        if (s->kind[i] == HQP_RANGE && s->side[i]) s->frozen_at[i] = (short)level;
    }
    hqp_hold_fitted(s);
    memset(s->side, 0, (size_t)s->row0[level + 1]);
    return s->work_rank == s->work_count;
}

/* g += lambda (+-row) over the rows that hold the last projection. */
static void add_projected(const hqp_solver *s, real *g) {
    for (int k = 0; k < s->held.count; k++) {
        const int id = s->held.id[k];
        const real lambda = s->side[id] * s->cone.length * s->held.multiplier[k];
        if (s->side[id]) hqp_axpy(g, lambda, hqp_row(s, s->given, id), s->given.first[id], s->given.last[id]);
    }
}

/* s->reduced[k], for columns k from `from` on: the multiplier by which the row behind it holds the level, of
 * which the projection is at hand. */
static void find_multipliers(hqp_solver *s, int level, int from) {
    real *g = s->trial, *multiplier = s->reduced;
    hqp_gradient(s, level, g);
    if (s->rank < s->width) add_projected(s, g);
    hqp_gather(s, multiplier, g);
    hqp_reflect_row(s, s->rank, multiplier);
    for (int k = s->rank - 1; k >= from; k--) {
        const real *row = s->line + k * s->ld;
        multiplier[k] /= -row[k];
        hqp_add(multiplier, multiplier[k], row, k);
    }
}

/* Whether the multipliers of the held rows, which are behind columns from `from` on, stay positive. */
static int stay_positive(const hqp_solver *s, int level, int from, int k) {
    const int *held = s->proof.held + level * s->n;
    const real *lambda = s->proof.multiplier + level * s->n;
    for (int i = 0; i < s->proof.count[level]; i++) {
        const int id = abs(held[i]) - 1;
        int column = from;
        while (column < s->rank && s->column_row[column] != id) column++;
        if (column == s->rank) return 0;
        const real mu = (held[i] < 0 ? -1 : 1) * s->reduced[column] * s->norm[id];
        if (!(ldexp(mu, -2 * k) >= -SHARE * lambda[i])) return 0;
    }
    return 1;
}

/* Whether the slack of the level, of which fitted rows are behind columns from `from` on, stays what it is.
 */
static int stays(const hqp_solver *s, int level, int from, int k) {
    const real *slack = s->lacking + s->row0[level], *nu = s->reduced + from;
    const int rows = s->row0[level + 1] - s->row0[level], count = s->rank - from;
    return ldexp(sqrt(hqp_inner(nu, nu, count)), -2 * k) <= CHANGE * sqrt(hqp_inner(slack, slack, rows));
}

/*
 * x, whose slacks are known, is proven by projection: whether this level holds all rows that it holds with
 * the next one joined to it by the weight 2^-2k, too. Leaves the factorisation of the levels before.
 */
int hqp_holds_joined(hqp_solver *s, int level, int k) {
    const int leans = s->leans, next = level + 1, from = s->rank_at[level];
    if (!s->is_projected || hqp_any_joined(s) || !hqp_has_slack(s, next)) return 0;
    hqp_rewind(s, level);
    s->leans = leans;
    int holds = freeze(s, level);
    if (holds) {
        hqp_seat_held(s, next);
        if (s->rank < s->width) hqp_descent(s, next);
        find_multipliers(s, next, from);
        holds = stay_positive(s, level, from, k) && stays(s, level, from + s->work_rank, k);
    }
    memset(s->side, 0, (size_t)s->total);
    return holds;
}
