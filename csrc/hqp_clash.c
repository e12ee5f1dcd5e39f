/*
 * Rows that cannot be met together, and the level that gives way.
 *
 * A broken row and the held rows it opposes form a clash: rows, with weights > 0, whose sum is a combination
 * of frozen rows. The last level that froze one of these, or that a row of the clash belongs to, has the
 * lowest priority of all concerned. It must hold the clash itself: its own rows become fitted rows, the
 * others work rows. If the clash does not touch the level's fitted rows but only rows it holds, it takes over
 * from the first of these that loses its strength; if none does, those rows belong to the clash, and a level
 * further up is concerned.
 */
#include "hqp_internal.h"

#include <string.h>

static const real TOUCH = 1e-9; /* part of the clash's size below which a row or column is not concerned */

/* reduced = row Q, in the columns of the frozen rows */
static const real *in_frozen_columns(hqp_solver *s, int id) {
    hqp_gather(s, s->reduced, hqp_row(s, s->given, id));
    hqp_reflect_row(s, s->rank, s->reduced);
    return s->reduced;
}

static void join(hqp_solver *s, int id, int side, real weight) {
    const int k = s->clash.count++;
    s->clash.id[k] = id;
    s->clash.side[k] = (signed char)side;
    s->clash.weight[k] = weight;
    s->clash.size += weight * s->norm[id];
}

static int touches(const hqp_solver *s, const real *sum, int from, int to) {
    for (int k = from; k < to; k++) {
        if (fabs(sum[k]) > TOUCH * s->clash.size) return 1;
    }
    return 0;
}

/* The clash is held at `level`, with multipliers length * weight. Returns the level, or HQP_LOST if it
 * already is. */
static int seat(hqp_solver *s, int level, real length) {
    int changes = 0;
    for (int k = 0; k < s->clash.count; k++) {
        const int id = s->clash.id[k], own = id >= s->row0[level];
        const signed char side = s->clash.side[k];
        s->forced[id] = 1;
        if (own ? s->guess_side[id] == side : s->guess_held_at[id] == level && s->guess_held_side[id] == side)
            continue;
        s->strength[id] = length * s->clash.weight[k] * (own ? 1.0 : s->norm[id]);
        changes++;
        if (own) {
            s->guess_side[id] = side;
        } else {
            s->guess_held_at[id] = (short)level;
            s->guess_held_side[id] = side;
        }
    }
    return changes ? level : HQP_LOST;
}

/*
 * The clash touches the rows that a level holds (columns from .. to), sum = pull . rows, but not its fitted
 * rows. Where it takes strength from some of them (pull > 0) the first to lose all of it is released; returns
 * how far that is. Otherwise they join the clash; returns -1.
 */
static real take_over(hqp_solver *s, real *sum, int from, int to) {
    real *pull = s->clash.pull, length = INFINITY;
    int release = -1;
    for (int k = to - 1; k >= from; k--) {
        const int id = s->column_row[k], side = s->guess_held_side[id];
        const real *row = in_frozen_columns(s, id);
        pull[k] = sum[k] / (side * row[k]);
        hqp_axpy(sum, -pull[k] * side, row, 0, (int)s->ld);
        if (!(pull[k] * s->norm[id] > TOUCH * s->clash.size)) continue;
        if (s->strength[id] / (s->norm[id] * pull[k]) >= length) continue;
        length = s->strength[id] / (s->norm[id] * pull[k]);
        release = id;
    }
    for (int k = from; k < to; k++) {
        const int id = s->column_row[k];
        if (release >= 0)
            s->strength[id] -= length * pull[k] * s->norm[id];
        else if (pull[k] * s->norm[id] < -TOUCH * s->clash.size)
            join(s, id, s->guess_held_side[id], -pull[k]);
    }
    if (release < 0) return -1.0;
    s->guess_held_at[release] = -1;
    return length;
}

/*
 * The fixings that were taken ahead of their turn are what gives way, as far as one can tell in the columns
 * in play: the sweep with all columns shall hold this clash there, and nothing that was held there before.
 */
static void expect_at_fixings(hqp_solver *s) {
    const int level = s->fixed_through;
    for (int i = 0; i < s->row0[level]; i++) {
        if (s->guess_held_at[i] == level) s->guess_held_at[i] = -1;
    }
    seat(s, level, 0.0);
}

/*
 * Row `id` cannot be met at `side`: row = sum pull_k held_k, with no held row to release. Returns the level
 * to go back to, its guess changed, or HQP_LOST.
 */
int hqp_give_way(hqp_solver *s, int level, int id, int side, const real *pull) {
    real *sum = s->step;
    s->clash.count = 0;
    s->clash.size = 0.0;
    memset(sum, 0, (size_t)s->ld * sizeof(real));
    hqp_axpy(sum, side, in_frozen_columns(s, id), 0, (int)s->ld);
    join(s, id, side, 1.0);
    for (int k = 0; k < s->held.count; k++) {
        const int held = s->held.id[k];
        hqp_axpy(sum, -pull[k] * s->side[held], in_frozen_columns(s, held), 0, (int)s->ld);
        if (pull[k] * s->norm[held] < -TOUCH * s->norm[id]) join(s, held, s->side[held], -pull[k]);
    }
    for (int q = level - 1; q > s->fixed_through; q--) {
        const int from = s->rank_at[q], to = s->rank_at[q + 1];
        int fitted = from, own = 0;
        while (fitted < to && s->column_row[fitted] < s->row0[q]) fitted++;
        for (int k = 0; k < s->clash.count; k++) own |= s->clash.id[k] >= s->row0[q];
        if (own || touches(s, sum, fitted, to)) return seat(s, q, 0.0);
        if (!touches(s, sum, from, fitted)) continue;
        const real length = take_over(s, sum, from, fitted);
        if (length >= 0.0) return seat(s, q, length);
    }
    if (s->fixed_through >= 0) expect_at_fixings(s);
    return HQP_LOST;
}
