/*
 * The way down from x: -g, the gradient of half of the squared slack of a level, projected onto the
 * directions in which the earlier levels stay minimal. These are what the frozen rows leave free, and in
 * which no hard row at its bound breaks: a cone. What the projection takes away is sum lambda_i (+-row_i)
 * over rows that it holds, with lambda_i >= 0 (Moreau), and nothing is left if and only if the level is
 * minimal.
 *
 * It is the last step (hqp_dual.c) of another problem: around x = 0, with the bounds that x touches at 0.
 */
#include "hqp_internal.h"

#include <string.h>

enum { STEPS = 4 };                  /* times n + 1: rows held or released by a projection at most */
static const real DIRECTION = 1e-10; /* times its length: what a direction may break a row by */
static const real ROUNDINGS = 2.0;   /* of row . x: what a long row may take */
static const real LARGE = 1e6;       /* a multiplier, times the norm of its row, that costs digits */

static void exchange(real **a, real **b) {
    real *const kept = *a;
    *a = *b;
    *b = kept;
}

/* Enter the cone as a problem of its own, or leave it again. */
static void cross(hqp_solver *s) {
    signed char *const kind = s->kind;
    exchange(&s->lb, &s->cone.lb);
    exchange(&s->ub, &s->cone.ub);
    exchange(&s->x, &s->cone.x);
    s->kind = s->cone.kind;
    s->cone.kind = kind;
    s->cone.entered = !s->cone.entered;
}

/*
 * The cone of hard rows that x touches; with `own`, also of the long rows of the level. What their rounding
 * makes of -g is along them: a row at its bound may take it to one side, one that is missed to both.
 */
static void form(hqp_solver *s, int level, int own) {
    for (int i = 0; i < s->row0[level + own]; i++) {
        const int is_own = i >= s->row0[level], is_missed = is_own && s->lacking[i] != 0.0;
        const int at_lb = is_missed || hqp_touches(s, i, -1), at_ub = is_missed || hqp_touches(s, i, 1);
        const int is_part = is_own ? hqp_is_long(s, level, i) : hqp_is_hard(s, i);
        s->cone.kind[i] = is_part && (at_lb || at_ub) ? HQP_RANGE : HQP_IDLE;
        s->cone.lb[i] = at_lb ? 0.0 : -INFINITY;
        s->cone.ub[i] = at_ub ? 0.0 : INFINITY;
        if (is_own || s->cone.kind[i] == HQP_IDLE || (s->side[i] < 0 ? !at_lb : !at_ub)) s->side[i] = 0;
    }
}

/* The largest multiplier, times the norm of its row, of those that hold the projection. */
static real most_held(const hqp_solver *s) {
    real most = 0.0;
    for (int k = 0; k < s->held.count; k++) most = fmax(most, s->held.multiplier[k] * s->norm[s->held.id[k]]);
    return most;
}

/* Length of this rest, with what the rounding of the held rows may have left of it. */
static real length_of(const hqp_solver *s, const real *rest) {
    return sqrt(hqp_inner(rest, rest, s->width - s->rank)) + HQP_UNIT * most_held(s);
}

/* Length of what the held rows, with multipliers >= 0, leave of the target: s->reduced. */
static real left_over(hqp_solver *s) {
    real *rest = s->reduced;
    memcpy(rest, s->cone.target, (size_t)s->ld * sizeof(real));
    for (int k = 0; k < s->held.count; k++) {
        if (!(s->held.multiplier[k] > 0.0)) continue;
        hqp_add(rest, s->held.multiplier[k], s->held.rows + k * s->ld, s->width - s->rank);
    }
    return length_of(s, rest);
}

/* The same with the multipliers put right by what they leave: rounding of large ones is most of it. */
static real left_over_refined(hqp_solver *s) {
    left_over(s);
    return hqp_take_into_held(s, s->reduced) ? length_of(s, s->reduced) : INFINITY;
}

/*
 * In the cone: project s->trial, of length 1, to s->x, as far as something worth mentioning is left. Returns
 * the least that any rows on the way leave of it: what is left in the end is not more, but for rounding.
 */
static real project(hqp_solver *s, int level, real none) {
    const real feasibility = s->settings.feasibility;
    const int limit = s->iteration_limit, iterations = s->iterations;
    real left = 1.0;
    int broken;
    s->iteration_limit = iterations + STEPS * (s->n + 1);
    hqp_hold(s, level);
    if (s->held.count) left = left_over(s);
    while (left > none) {
        s->settings.feasibility = DIRECTION * left;
        broken = hqp_most_broken(s, level);
        if (broken < 0) break;
        if (hqp_out_of_iterations(s) || hqp_hold_broken(s, level, broken) != HQP_DONE) break;
        left = fmin(left, left_over(s));
    }
    if (s->iterations > iterations) { /* steps add up roundings */
        hqp_close_gaps(s);
        left = fmin(left, left_over(s));
    }
    if (left > none) left = fmin(left, left_over_refined(s));
    s->settings.feasibility = feasibility;
    s->iteration_limit = limit;
    s->iterations = iterations;
    return left;
}

/* The same, from the rows that have a side; and from none, as others may do with less, where these have large
 * multipliers. */
static real project_well(hqp_solver *s, int level, real none) {
    const real left = project(s, level, none);
    if (!(left > none && most_held(s) > LARGE)) return left;
    memset(s->side, 0, (size_t)s->row0[level]);
    return fmin(left, project(s, level, none));
}

/* The smallest multiplier, times the norm of its row, of the hard rows that hold the projection. */
static real least_held(const hqp_solver *s, int level, real length) {
    real least = INFINITY;
    for (int k = 0; k < s->held.count; k++) {
        if (s->held.id[k] >= s->row0[level]) continue; /* a long row, which takes its rounding */
        const real multiplier = length * s->held.multiplier[k] * s->norm[s->held.id[k]];
        if (multiplier > 0.0 && multiplier < least) least = multiplier;
    }
    return least;
}

/* A row of the level takes more than its rounding. */
static int takes_more(const hqp_solver *s, int level, real length, real x_norm) {
    for (int k = 0; k < s->held.count; k++) {
        const int id = s->held.id[k];
        const real rounding = s->settings.rounding * s->norm[id] * x_norm;
        if (id >= s->row0[level] && length * s->held.multiplier[k] > ROUNDINGS * rounding) return 1;
    }
    return 0;
}

/* project_well, from x, whose values are known: what is left of -g, of this length. */
static real project_from(hqp_solver *s, int level, int own, real length, real x_norm) {
    s->x_norm = x_norm;
    form(s, level, own);
    cross(s);
    return project_well(s, level + own, s->none[level] / length);
}

/* The same through long rows whose rounding hides what short ones lack, if they take no more than that. */
static real project_through(hqp_solver *s, int level, real length, real x_norm) {
    const int first = s->row0[level], count = s->row0[level + 1] - first;
    memcpy(s->cone.own, s->side + first, (size_t)count);
    real left = project_from(s, level, 1, length, x_norm);
    if (takes_more(s, level, length, x_norm)) {
        cross(s);
        memset(s->side + first, 0, (size_t)count);
        left = project_from(s, level, 0, length, x_norm);
    }
    memcpy(s->side + first, s->cone.own, (size_t)count);
    return left;
}

/*
 * s->descent = the way down for this level from x, whose values are known; the rows that hold the projection
 * become the working set. Returns a length: -g is at most so far from the cone of rows at their bound.
 */
real hqp_descent(hqp_solver *s, int level) {
    const real x_norm = s->x_norm;
    const int free = s->width - s->rank, width = (int)s->ld;
    real *target = s->cone.target, squares = 0.0;
    hqp_free_directions(s);
    s->metric = 0;
    s->cone.least = INFINITY;
    hqp_gradient(s, level, s->descent);
    for (int j = 0; j < free; j++) {
        target[j] = -hqp_dot(s->descent, hqp_row(s, s->direction, j), 0, width);
        squares += target[j] * target[j];
    }
    const real length = sqrt(squares);
    s->cone.length = length;
    if (!(length > s->none[level])) {
        memset(s->side, 0, (size_t)s->row0[level]);
        return length;
    }
    memset(s->trial, 0, (size_t)width * sizeof(real));
    for (int j = 0; j < free; j++) {
        target[j] /= length;
        hqp_axpy(s->trial, target[j], hqp_row(s, s->direction, j), 0, width);
    }
    const real left = s->hidden[level] ? project_through(s, level, length, x_norm)
                                       : project_from(s, level, 0, length, x_norm);
    s->cone.least = least_held(s, level, length);
    if (hqp_is_last(s, level)) s->hardest = length * most_held(s);
    cross(s);
    s->x_norm = x_norm;
    for (int i = 0; i < width; i++) s->descent[i] = length * s->cone.x[i];
    return length * left;
}
