/* The life of a solver and the caller's data. hqp.h has the problem, docs/hqp.md the rest. */
#include "hqp_internal.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_ROWS = 16384 };
static const ptrdiff_t MAX_CELLS =
    1 << 26; /* rows times n; four arrays of this size are the bulk of a solver: 2 GiB */
static const ptrdiff_t MAX_EXTENDED = 1 << 18; /* the same of the solver with more digits, and 16 MiB */

static const real LARGEST = 1e100, SMALLEST = 1e-100; /* of a coefficient; of the norm of a row that acts */
static const real CLOSED = 1e-9;                      /* lb > ub by less than this part of them: a point */
/* times the iterations that are usual, and at least: the cap, if none is given */
enum { SHARES = 3, FEWEST = 8000 };

hqp_settings hqp_default_settings(void) {
    return (hqp_settings){.feasibility = 1e-13, .rank = 1e-9, .rounding = 5e-15, .max_iterations = 0};
}

const char *hqp_version(void) {
    return HQP_VERSION;
}

const char *hqp_status_name(hqp_status status) {
    switch (status) {
    case HQP_SOLVED:
        return "solved";
    case HQP_ITERATION_CAP:
        return "iteration cap reached";
    case HQP_REPEATED_SET:
        return "working set repeated";
    case HQP_NOT_PROVEN:
        return "not proven optimal";
    case HQP_TIME_LIMIT:
        return "time limit reached";
    case HQP_BAD_MATRIX:
        return "entry not finite or absurdly large, or a bad weight";
    case HQP_BAD_BOUNDS:
        return "bounds contradict";
    case HQP_OVERFLOW:
        return "solution not finite";
    }
    return "unknown status";
}

/* a 64-byte aligned slice of the arena, or NULL while only sizes are counted */
static void *slice(char *arena, size_t *used, size_t bytes) {
    void *at = arena ? arena + *used : NULL;
    *used += (bytes + 63) & ~(size_t)63;
    return at;
}

static hqp_rows slice_rows(char *arena, size_t *used, size_t rows, size_t ld) {
    hqp_rows r;
    r.cell = slice(arena, used, rows * ld * sizeof(real));
    r.first = slice(arena, used, rows * sizeof(int));
    r.last = slice(arena, used, rows * sizeof(int));
    return r;
}

static void lay_out_reals(hqp_solver *s, char *arena, size_t *used) {
    const size_t rows = (size_t)s->total, n = (size_t)s->n, ld = (size_t)s->ld, levels = (size_t)s->levels;
    const size_t widest = (size_t)s->widest, most = rows + n + 1;
    const struct {
        real **at;
        size_t count;
    } reals[] = {
        {&s->norm, rows},
        {&s->scale, rows},
        {&s->lb, rows},
        {&s->ub, rows},
        {&s->value, rows},
        {&s->trial_value, rows},
        {&s->lacking, rows},
        {&s->strength, rows},
        {&s->multiplier, most},
        {&s->rounding, most},
        {&s->rhs, widest},
        {&s->line, ld * n},
        {&s->cross, 4 * n},
        {&s->held.rows, ld * (n + 1)},
        {&s->held.basis, ld * (n + 1)},
        {&s->held.triangle, ld * (n + 1)},
        {&s->held.gap, n + 1},
        {&s->held.along, n + 4},
        {&s->held.step, ld},
        {&s->held.multiplier, n + 1},
        {&s->broken_row, ld},
        {&s->broken_pull, ld},
        {&s->clash.weight, most},
        {&s->clash.pull, n},
        {&s->x, ld},
        {&s->trial, ld},
        {&s->step, ld},
        {&s->reduced, ld},
        {&s->coefficient, ld},
        {&s->start.x, ld},
        {&s->distant.x, ld},
        {&s->good, ld},
        {&s->descent, ld},
        {&s->cone.lb, rows},
        {&s->cone.ub, rows},
        {&s->cone.x, ld},
        {&s->cone.target, ld},
        {&s->bundle.triangle, (size_t)s->bundle.most * (size_t)s->bundle.most},
        {&s->bundle.multiplier, (size_t)s->bundle.most},
        {&s->bundle.gap, (size_t)s->bundle.most},
        {&s->bundle.pull, (size_t)s->bundle.most},
        {&s->bundle.x, ld},
        {&s->proof.multiplier, 2 * levels * (size_t)s->n},
        {&s->none, levels},
        {&s->little, levels},
        {&s->then, levels},
        {&s->kept, ld},
        {&s->face, ld},
        {&s->refuted.x, ld},
        {&s->path, ld * (levels + 1)},
        {&s->apart.at.x, ld},
        {&s->before.at.x, ld},
        {&s->close.at.x, ld},
    };
    for (size_t i = 0; i < sizeof reals / sizeof *reals; i++) {
        *reals[i].at = slice(arena, used, reals[i].count * sizeof(real));
    }
}

/* Give every array its place behind the solver; returns the size of the whole. */
static size_t lay_out(hqp_solver *s, char *arena) {
    const size_t rows = (size_t)s->total, n = (size_t)s->n, ld = (size_t)s->ld, levels = (size_t)s->levels;
    const size_t widest = (size_t)s->widest, most = rows + n + 1;
    size_t used = (sizeof *s + 63) & ~(size_t)63;
    s->given = slice_rows(arena, &used, rows, ld);
    s->base = slice_rows(arena, &used, rows, ld);
    s->work_rows = slice_rows(arena, &used, rows, ld);
    s->fit_rows = slice_rows(arena, &used, widest > n ? widest : n, ld);
    s->reflector = slice_rows(arena, &used, n, ld);
    s->direction = slice_rows(arena, &used, n, ld);
    lay_out_reals(s, arena, &used);
    int **const ints[] = {&s->column,     &s->done,        &s->only,         &s->work,    &s->fit,
                          &s->work_order, &s->fit_order,   &s->column_row,   &s->held.id, &s->clash.id,
                          &s->bundle.id,  &s->bundle.slot, &s->bundle.broken};
    for (size_t i = 0; i < sizeof ints / sizeof *ints; i++)
        *ints[i] = slice(arena, &used, most * sizeof(int));
    signed char **const flags[] = {&s->kind,
                                   &s->side,
                                   &s->forced,
                                   &s->guess_side,
                                   &s->guess_held_side,
                                   &s->clash.side,
                                   &s->cone.kind,
                                   &s->cone.own,
                                   &s->clear,
                                   &s->apart.at.side,
                                   &s->apart.at.held_side,
                                   &s->bundle.side,
                                   &s->start.side,
                                   &s->start.held_side,
                                   &s->distant.side,
                                   &s->distant.held_side,
                                   &s->before.at.side,
                                   &s->before.at.held_side,
                                   &s->close.at.side,
                                   &s->close.at.held_side};
    for (size_t i = 0; i < sizeof flags / sizeof *flags; i++) *flags[i] = slice(arena, &used, most);
    s->guess_held_at = slice(arena, &used, rows * sizeof(short));
    s->frozen_at = slice(arena, &used, rows * sizeof(short));
    s->apart.at.held_at = slice(arena, &used, rows * sizeof(short));
    s->distant.held_at = slice(arena, &used, rows * sizeof(short));
    s->start.held_at = slice(arena, &used, rows * sizeof(short));
    s->before.at.held_at = slice(arena, &used, rows * sizeof(short));
    s->close.at.held_at = slice(arena, &used, rows * sizeof(short));
    s->place = slice(arena, &used, (ld + 1) * sizeof(int));
    s->fixed_column = slice(arena, &used, n);
    s->unseen = slice(arena, &used, n);
    s->fixing = slice(arena, &used, rows);
    s->row0 = slice(arena, &used, (levels + 1) * sizeof(int));
    s->first_row = slice(arena, &used, (levels + 1) * sizeof(int));
    s->rank_at = slice(arena, &used, (levels + 2) * sizeof(int));
    s->equalities = slice(arena, &used, levels * sizeof(int));
    s->proof.held = slice(arena, &used, 2 * levels * n * sizeof(int));
    s->proof.count = slice(arena, &used, 2 * levels * sizeof(int));
    s->slack = slice(arena, &used, levels);
    s->hidden = slice(arena, &used, levels);
    s->weighted = slice(arena, &used, levels);
    s->joined = slice(arena, &used, levels);
    s->strict = slice(arena, &used, levels);
    s->before.joined = slice(arena, &used, levels);
    return used;
}

static int dims_fit(const hqp_dims *d) {
    if (d->n < 1 || d->n > HQP_MOST_VARIABLES || d->levels < 1 || d->levels > HQP_MOST_LEVELS) return 0;
    for (int p = 0; p < d->levels; p++) {
        if (d->equalities[p] < 0 || d->equalities[p] > MAX_ROWS) return 0;
        if (d->inequalities[p] < 0 || d->inequalities[p] > MAX_ROWS) return 0;
    }
    return 1;
}

static int settings_fit(const hqp_settings *t) {
    return t->feasibility > 0.0 && t->feasibility < 1.0 && t->rank > 0.0 && t->rank < 1.0 &&
           t->rounding > 0.0 && t->rounding < 1.0 && t->max_iterations >= 0 && t->time_limit >= 0.0;
}

/* The solver, with one of more digits for what these leave unproven; NULL where memory is short. */
static hqp_solver *extend(hqp_solver *s, const hqp_dims *dims, const hqp_settings *settings) {
    if (!HQP_HAS_EXTENDED || s->total * s->ld > MAX_EXTENDED) return s;
    s->extended = hqp_extended_create(dims, settings);
    if (s->extended) return s;
    free(s);
    return NULL;
}

hqp_solver *hqp_create(const hqp_dims *dims, const hqp_settings *settings) {
    const hqp_settings defaults = hqp_default_settings();
    if (!settings) settings = &defaults;
    if (!dims_fit(dims) || !settings_fit(settings)) return NULL;
    hqp_solver shape = {.n = dims->n, .levels = dims->levels, .ld = hqp_ceil4(dims->n)};
    shape.settings.feasibility = HQP_FINENESS * settings->feasibility;
    shape.settings.rank = settings->rank;
    shape.settings.rounding = HQP_FINENESS * settings->rounding;
    shape.settings.max_iterations = settings->max_iterations;
    shape.settings.time_limit = settings->time_limit;
    const int shares = SHARES * hqp_usual(shape.n);
    if (shape.settings.max_iterations == 0) shape.settings.max_iterations = shares > FEWEST ? shares : FEWEST;
    for (int p = 0, before[2] = {0, 0}; p < dims->levels; p++) {
        const int rows = dims->equalities[p] + dims->inequalities[p];
        const int joined = before[0] + before[1] + rows; /* of three levels, should they be joined */
        if (joined > shape.widest) shape.widest = joined;
        before[0] = before[1];
        before[1] = rows;
        shape.total += rows;
    }
    shape.bundle.most = shape.total < 2 * shape.n ? shape.total : 2 * shape.n;
    if (shape.total * shape.ld > MAX_CELLS) return NULL;
    const size_t bytes = lay_out(&shape, NULL);
    char *arena = aligned_alloc(64, bytes);
    if (!arena) return NULL;
    memset(arena, 0, bytes);
    hqp_solver *s = (hqp_solver *)(void *)arena;
    *s = shape;
    lay_out(s, arena);
    for (int i = 0; i < s->total; i++) {
        s->only[i] = -1;
        s->scale[i] = 1.0;
    }
    s->rank_asked = s->settings.rank;
    hqp_unfix(s);
    for (int p = 0; p < s->levels; p++) {
        s->equalities[p] = dims->equalities[p];
        s->first_row[p + 1] = s->first_row[p] + dims->equalities[p] + dims->inequalities[p];
    }
    memcpy(s->row0, s->first_row, (size_t)(s->levels + 1) * sizeof(int));
    hqp_reset(s);
    return extend(s, dims, settings);
}

void hqp_destroy(hqp_solver *s) {
    if (s && s->extended) hqp_extended_destroy(s->extended);
    free(s);
}

/* Forget the working sets; x = 0. */
void hqp_forget(hqp_solver *s) {
    memset(s->x, 0, (size_t)s->ld * sizeof(real));
    for (int i = 0; i < s->total; i++) {
        s->guess_side[i] = s->guess_held_side[i] = 0;
        s->guess_held_at[i] = -1;
        s->strength[i] = 0.0;
    }
    memset(s->proof.count, 0, 2 * (size_t)s->levels * sizeof(int));
    s->warm = s->resumable = s->started = s->softest = s->foreseen.count = 0;
    s->apart.level = -1;
    hqp_forget_reflectors(s);
}

void hqp_reset(hqp_solver *s) {
    s->settings.rank = s->rank_asked;
    memset(s->joined, 0, (size_t)s->levels);
    hqp_forget(s);
}

static int is_zero(const real *four) {
    return four[0] == 0.0 && four[1] == 0.0 && four[2] == 0.0 && four[3] == 0.0;
}

int hqp_start(hqp_solver *s, const double *x) {
    for (int i = 0; i < s->n; i++) {
        if (!isfinite(x[i])) return 0;
    }
    hqp_forget(s);
    memset(s->joined, 0, (size_t)s->levels);
    for (int i = 0; i < s->n; i++) s->x[i] = x[i];
    s->started = 1;
    return 1;
}

/* Guess the working sets from x: what is violated is fitted; what is at its bound is held, in the last level,
 * for which a wrong guess costs least. */
static void guess_from_x(hqp_solver *s) {
    hqp_find_values(s);
    for (int i = 0; i < s->total; i++) {
        if (s->kind[i] != HQP_RANGE) continue;
        const signed char side = hqp_touches(s, i, -1) ? -1 : hqp_touches(s, i, 1) ? 1 : 0;
        if (!side) {
            s->guess_side[i] = (signed char)hqp_outside(s, i, s->value[i], s->x_norm);
        } else if (i < s->row0[s->levels - 1]) {
            s->guess_held_at[i] = (short)(s->levels - 1);
            s->guess_held_side[i] = side;
        }
    }
    s->warm = 1;
    s->started = 0;
}

/* Norm of a row of `given` and where its nonzeros are; 0 where an entry is not usable. */
static int measure_row(hqp_solver *s, int id) {
    const real *row = hqp_row(s, s->given, id);
    const real sum = hqp_dot(row, row, 0, (int)s->ld);
    int first = 0, last = (int)s->ld, nonzeros = 0;
    while (first < last && is_zero(row + first)) first += 4;
    while (first < last && is_zero(row + last - 4)) last -= 4;
    s->norm[id] = sqrt(sum);
    s->only[id] = -1;
    for (int c = first; c < last && last - first == 4; c++) {
        if (row[c] == 0.0) continue;
        s->only[id] = nonzeros++ ? -1 : c;
    }
    s->given.first[id] = first;
    s->given.last[id] = last;
    return sum <= LARGEST * LARGEST;
}

/* Copy one row; 0 where an entry is not usable. Rows that are the same in each tick are measured once. */
static int load_row(hqp_solver *s, int id, const real *from) {
    real *to = hqp_row(s, s->given, id);

    const size_t size = (size_t)s->n * sizeof(real);
    s->frozen_at[id] = -1;
    if (memcmp(to, from, size) == 0) return 1;
    hqp_forget_row(s, id);
    memcpy(to, from, size);
    if (measure_row(s, id)) return 1;
    memset(to, 0, size); /* forgotten, so that it is looked at again */
    measure_row(s, id);
    return 0;
}

/* Bounds of one row; 0 where they contradict. lb > ub by rounding closes to the point between them. */
static int load_bounds(hqp_solver *s, int id, double lb, double ub) {
    if (!(lb < INFINITY) || !(ub > -INFINITY)) return 0;
    if (lb > ub) {
        /* halves, as the difference of the largest two doubles is none */
        const double lower = 0.5 * lb, upper = 0.5 * ub;
        if (lower - upper > CLOSED * (0.5 + fabs(lower) + fabs(upper))) return 0;
        lb = ub = lower + upper;
    }
    s->lb[id] = lb;
    s->ub[id] = ub;
    s->kind[id] = lb < ub ? HQP_RANGE : HQP_EQUALITY;
    if (s->norm[id] < SMALLEST || (isinf(lb) && isinf(ub))) s->kind[id] = HQP_IDLE;
    return 1;
}

/* Square roots of the weights; 0 where one is not usable. */
static int load_weights(hqp_solver *s, int level, const double *weights) {
    if (!weights && !s->weighted[level]) return 1;
    s->weighted[level] = weights != NULL;
    for (int i = s->first_row[level]; i < s->first_row[level + 1]; i++) {
        const real weight = weights ? weights[i - s->first_row[level]] : 1.0;
        if (!(weight > 0.0 && weight <= LARGEST)) return 0;
        s->scale[i] = sqrt(weight);
    }
    return 1;
}

/* The coefficients of a row times the root of its weight; those that are not usable without it stay so. */
static const real *weighted(hqp_solver *s, int id, const double *from) {
    for (int c = 0; c < s->n; c++) s->step[c] = fabs(from[c]) <= LARGEST ? s->scale[id] * from[c] : NAN;
    return s->step;
}

/* The coefficients of a row. */
static const real *converted(hqp_solver *s, const double *from) {
#ifndef HQP_EXTENDED
    (void)s;
    return from;
#else
    for (int c = 0; c < s->n; c++) s->step[c] = from[c];
    return s->step;
#endif
}

static hqp_status load_level(hqp_solver *s, int level, const hqp_level *data) {
    const int first = s->first_row[level], split = first + s->equalities[level];
    if (!load_weights(s, level, data->weights)) return HQP_BAD_MATRIX;
    for (int i = first; i < s->first_row[level + 1]; i++) {
        const ptrdiff_t r = i < split ? i - first : i - split;
        const double *row = (i < split ? data->A : data->C) + r * s->n;
        if (!load_row(s, i, s->weighted[level] ? weighted(s, i, row) : converted(s, row)))
            return HQP_BAD_MATRIX;
        if (i < split && !(fabs(data->b[r]) <= LARGEST)) return HQP_BAD_MATRIX;
        const double lb = i < split ? data->b[r] : data->lb[r], ub = i < split ? data->b[r] : data->ub[r];
        if (!load_bounds(s, i, lb, ub)) return HQP_BAD_BOUNDS;
        if (!s->weighted[level]) continue;
        s->lb[i] *= s->scale[i];
        s->ub[i] *= s->scale[i];
    }
    return HQP_SOLVED;
}

static signed char activity(const hqp_solver *s, int id, real value) {
    if (s->kind[id] == HQP_IDLE) return 0;
    if (isfinite(s->ub[id]) && hqp_at_bound(s, id, 1, value, s->x_norm)) return 1;
    return isfinite(s->lb[id]) && hqp_at_bound(s, id, -1, value, s->x_norm) ? -1 : 0;
}

/* slack and activity of all rows at x, whose values are known */
static void report(hqp_solver *s, hqp_info *info) {
    double *w = info->w, *v = info->v;
    signed char *active = info->active;
    for (int p = 0; p < s->levels; p++) {
        for (int i = s->first_row[p]; i < s->first_row[p + 1] && s->weighted[p]; i++)
            s->lacking[i] /= s->scale[i];
        for (int i = s->first_row[p]; i < s->first_row[p + 1]; i++) {
            const real value = s->value[i], slack = s->lacking[i];
            if (i < s->first_row[p] + s->equalities[p]) {
                if (w) *w++ = (double)slack;
                continue;
            }
            if (v) *v++ = (double)slack;
            if (active) *active++ = activity(s, i, value);
        }
    }
}

static void give(const real *x, double *to, int n) {
    for (int i = 0; i < n; i++) to[i] = (double)x[i];
}

static hqp_status refuse(hqp_solver *s, hqp_status status, int level, double *x, hqp_info *info) {
    int equalities = 0;
    for (int p = 0; p < s->levels; p++) equalities += s->equalities[p];
    for (int i = 0; i < equalities && info->w; i++) info->w[i] = NAN;
    for (int i = 0; i < s->total - equalities && info->v; i++) info->v[i] = NAN;
    if (info->active) memset(info->active, 0, (size_t)(s->total - equalities));
    memcpy(s->x, s->good, (size_t)s->ld * sizeof(real));
    give(s->good, x, s->n);
    s->resumable = s->warm = 0;
    info->status = status;
    info->iterations = s->iterations;
    info->levels_done = info->rank = 0;
    info->bad_level = level;
    return status;
}

hqp_status hqp_resolve(hqp_solver *s, const hqp_level *levels, int first, double *x, hqp_info *info) {
    s->levels_given = levels;
    if (first > s->resumable) first = s->resumable;
    if (first < 0) first = 0;
    memcpy(s->good, s->x, (size_t)s->ld * sizeof(real));
    s->iterations = s->is_late = 0;
    if (s->settings.time_limit > 0.0) s->began = hqp_now();
    for (int p = first; p < s->levels; p++) {
        const hqp_status status = load_level(s, p, &levels[p]);
        if (status < 0) return refuse(s, status, p, x, info);
    }
    memcpy(s->row0, s->first_row, (size_t)(s->levels + 1) * sizeof(int));
    if (s->started) guess_from_x(s);
    hqp_status status = hqp_solve_from(s, first);
    if (status == HQP_ITERATION_CAP && s->is_late) status = HQP_TIME_LIMIT;
    for (int i = 0; i < s->n; i++) {
        if (!isfinite(s->x[i])) return refuse(s, HQP_OVERFLOW, -1, x, info);
    }
    give(s->x, x, s->n);
    report(s, info);
    s->warm = 1;
    info->status = status;
    info->iterations = s->iterations;
    info->levels_done = s->levels_done;
    info->rank = hqp_rank(s);
    info->bad_level = -1;
    return status;
}

hqp_status hqp_solve(hqp_solver *s, const hqp_level *levels, double *x, hqp_info *info) {
    return hqp_resolve(s, levels, 0, x, info);
}
