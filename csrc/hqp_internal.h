/* What the files of the solver share. docs/hqp.md describes the method; its words are used here. */
#ifndef HQP_INTERNAL_H
#define HQP_INTERNAL_H

#include <stddef.h>
#include <tgmath.h>

#include "hqp.h"
#include "hqp_extended.h"
#include "hqp_lanes.h"

/* Rows of `ld` numbers, 32-byte aligned, zero outside the window [first, last), whose ends are multiples
 * of 4. */
typedef struct hqp_rows {
    real *cell;
    int *first;
    int *last;
} hqp_rows;

enum { HQP_MOST_LEVELS = 256, HQP_MOST_VARIABLES = 1024 };
#define HQP_FINENESS (HQP_EPSILON / DBL_EPSILON)     /* 1 of doubles, 2^-11 of 64 bits */
static const real HQP_UNIT = 1.1e-16 * HQP_FINENESS; /* the rounding of a number */
/* Levels are not joined (again) in this solve: it would cost one too much, or no proof is found for both. */
enum { PARTED = 1, UNPROVEN = 2 };

/* A row that cannot act (all zero, or no bound), an equality (lb == ub), or a range. */
enum { HQP_IDLE = 0, HQP_EQUALITY = 1, HQP_RANGE = 2 };

/* Levels in a row: the first and how many, or none. */
typedef struct hqp_run {
    int first, count;
} hqp_run;

/* An x and the guesses of the working sets there. */
typedef struct hqp_place {
    real *x;
    signed char *side, *held_side;
    short *held_at;
} hqp_place;

/*
 * Rows are numbered through all levels: those of level p are row0[p] .. row0[p + 1] - 1, A_p before C_p.
 * Q = H_0 H_1 .. H_{top-1} with H_k = I - v_k v_k^T; the first `rank` reflectors belong to the frozen rows.
 */
struct hqp_solver {
    int n, levels, total, widest; /* widest: rows of the largest level */
    ptrdiff_t ld;                 /* n rounded up to a multiple of 4 */
    struct {
        real feasibility, rank, rounding; /* rank: the one in use */
        int max_iterations;
        double time_limit;
    } settings; /* as hqp_settings */
    real rank_asked;
    int *row0; /* [levels + 1] of the levels in use, of which those that are joined to another are empty */
    int *first_row;  /* [levels + 1] the same of the caller's levels */
    int *equalities; /* [levels] */

    /* per row */
    hqp_rows given;            /* the caller's coefficients */
    hqp_rows base;             /* those times H_0 .. H_{done-1} */
    int *done;                 /* 0: base not filled */
    int *only;                 /* column of its single nonzero, -1 where there are more or none */
    real *norm, *lb, *ub;      /* lb == ub for an equality */
    real *scale;               /* square root of the weight, a factor of all these */
    real *value, *trial_value; /* row . x, row . trial */
    real *lacking;           /* what the value lacks to lie in its bounds, where hqp_find_values was called */
    real *strength;          /* of a held row its multiplier times its norm, of a fitted one its violation */
    signed char *kind;       /* HQP_IDLE, HQP_EQUALITY, HQP_RANGE */
    signed char *side;       /* membership in the working set: -1 at lb, 1 at ub, 0 no member */
    signed char *forced;     /* of a clash found in this solve: certainly at its bound */
    signed char *clear;      /* of a frozen row that a level held: its multiplier is certainly not zero */
    signed char *guess_side; /* side the row is fitted at in its own level */
    signed char *guess_held_side;     /* side it is held at in a later level .. */
    short *guess_held_at, *frozen_at; /* .. namely in this one, or -1; level that froze the row, or -1 */

    /* the columns in play */
    int width, *column, *place; /* column[0 .. width); place[c]: how many of them are before column c */
    signed char *fixed_column, *fixing; /* [n] taken out; per row: it did that */
    signed char *unseen;                /* [n] no row sees it: taken out, too; */
    int unseen_count;                   /* so many */
    int fixed_through;                  /* last level with such a row, or -1 */

    /* the shared factorisation, in the columns in play */
    hqp_rows reflector; /* [n] v_k */
    real *cross;        /* [n][4] v_k . v_i for i from k rounded down to a multiple of 4 on */
    int rank, top;
    int built;       /* reflectors that are still there, of the rows of column_row */
    int *rank_at;    /* [levels + 1] rank at the start of each level */
    int *column_row; /* [n] row behind each reflector, */
    real *line;      /* [n][ld] which is, in the columns up to it, this */
    int lines;       /* so many of them are known */

    /* the working set of the level at hand; position i of the copies is row work[i], fit[i] */
    int *work, *fit, work_count, work_rank, fit_count, fit_rank;
    hqp_rows work_rows, fit_rows;
    int *work_order, *fit_order; /* positions in the order of their reflectors, dependent ones last */
    real *multiplier, *rounding; /* [n] by work_order: must not be negative; what is as good as zero */
    real *rhs;                   /* [widest] by fit_order */

    /* the last step: x = trial + direction^T t */
    hqp_rows direction; /* [n]; without a last step at hand scratch */
    int metric;         /* |t| is measured by R of the level, else like x */
    struct {
        int count, *id;                /* held rows, */
        real *rows, *basis, *triangle; /* [n + 1][ld] in t-space, rows = triangle basis */
        real *gap, *multiplier;        /* what is missing at t = 0 */
        real *step, *along;            /* [ld], [n + 4], scratch */
        int steps;                     /* since all was held anew */
    } held;
    real *broken_row, *broken_pull; /* [ld] */
    struct {
        int count, *id; /* rows that cannot be met together, */
        signed char *side;
        real *weight, *pull, size; /* with weights > 0; their sum has terms of this size */
    } clash;

    real *x, *trial, *step, *reduced; /* [ld]; step and reduced also serve as scratch */
    real *good;                       /* [ld] the last answer that may be relied on */
    real *kept;                       /* [ld] x before what may fail */
    real *coefficient;                /* [ld] of a row, by the rows behind reflectors */
    real *descent;                    /* [ld] a way down for the level at hand */
    struct {
        real *lb, *ub, *x, *target; /* of the rows at their bound, moved there, while -g is projected */
        signed char *kind, *own;    /* own: the sides of the level's rows, put aside */
        real length;                /* of -g: held multipliers are times this */
        real least;                 /* multiplier, times the norm of the row, that the projection needs */
        int entered;
    } cone;
    struct {
        int broken_count, *broken;                /* rows that were broken when last looked at */
        int count, most, *id, *slot;              /* held rows; row k is work_rows[slot[k]], in t-space */
        real *triangle, *multiplier, *gap, *pull; /* [most][most], [most] .. */
        real *x;                                  /* [ld] where it ended, */
        signed char *side;                        /* [most] with these rows on this side */
    } bundle;                                     /* of hqp_guess.c */
    struct {
        int *held, *count; /* [2 levels][n]: by level, 1 + row, negative at lb; [2 levels] */
        real *multiplier;  /* [2 levels][n] theirs, times the norm of the row */
    } proof; /* what held the projections that proved the levels last, apart and then with levels joined */
    signed char *hidden;   /* [levels] the rounding of its long rows would hide what short ones lack */
    real *none;            /* [levels] length of a gradient that counts as none, */
    real *little;          /* and next to no multiplier, times the norm of its row: the level leans on it */
    signed char *weighted; /* [levels] its rows have weights of their own */
    signed char *joined; /* [levels] the next level is a part of this one: -log2 of the root of its weight */
    signed char *strict; /* [levels] PARTED or UNPROVEN: the next level was or could not be joined */
    int polishing;       /* joined levels are fitted row by row */
    struct {
        hqp_place at; /* the answer without joins, or with those before */
        int level;
    } apart;
    struct {
        hqp_place at;
        signed char *joined;
        int warm, softest;
        hqp_run foreseen;
    } before;           /* x, the guesses and the joins at the start of the solve */
    hqp_place start;    /* x and the guesses at the start of what is tried */
    hqp_place distant;  /* an answer so long that a shorter one is looked for */
    int leans;          /* first level that holds a row by next to nothing, or -1; */
    real least;         /* its smallest multiplier, times the norm of the row */
    real *then;         /* [levels] s->none where the level's multipliers were found */
    signed char *slack; /* [levels] there is a slack to be proven minimal */
    int is_doubtful;    /* the last proof failed on rows that were settled by too small a multiplier */
    int is_factorised;  /* the working set with which a level was found minimal */
    int is_projected;   /* x is proven by projection, and the factorisation is that of the proof */
    real lenience;      /* times what a proof by projection minds otherwise */
    real left;          /* of the gradient by the last projection, times what counts as none */
    int is_rough;       /* the last proof minded no more than that only because it was one by projection */
    int is_lax;         /* no more is asked of joined levels than of others */
    int is_exact;       /* the first try: less counts as none */
    int only_face;      /* x is to be proven at the minimum of its face, and nothing else is tried */
    struct {
        hqp_place at;
        int any, off_face; /* at the minimum of its face there is no proof of it */
    } close;               /* the best x of the first try that it could not prove, and its guesses */
    struct {
        real *x;           /* [ld] */
        int any, for_good; /* not less exactly either */
    } refuted;        /* the x at the minimum of its face that the first try could not prove the last time */
    real *face;       /* [ld] x at the minimum of its face, from where the last level is walked */
    real hardest;     /* the largest multiplier of the last level, times the norm of its row */
    int softened;     /* x was found with two levels as one */
    int sees_faintly; /* a direction was fixed by a row that hardly sees it */
    int softest;      /* how many levels as one led to a proof the last time; 0: not so many */
    hqp_run foreseen; /* the levels as one that led to the answer of the last solve, where it is a hard one */
    real *path;       /* [levels + 1][ld] x at the start of each level of a sweep */
    real x_norm, trial_norm;
    int iterations, iteration_limit;
    int levels_done;
    int resumable;                 /* levels whose end state is kept for hqp_resolve */
    int warm;                      /* there are guesses from an earlier solve */
    int started;                   /* x is a guess of the caller */
    int is_late;                   /* the time limit has passed */
    double began;                  /* time at the start of the solve */
    const hqp_level *levels_given; /* the caller's, during a solve */
    hqp_extended *extended;        /* the solver in extended precision, or NULL */
};

static inline int hqp_floor4(int i) {
    return i & ~3;
}
static inline int hqp_ceil4(int i) {
    return (i + 3) & ~3;
}

static inline real *hqp_row(const hqp_solver *s, hqp_rows rows, int i) {
    return rows.cell + i * s->ld;
}

static inline void hqp_swap_rows(real *a, real *b, int count) {
    for (int i = 0; i < count; i++) {
        const real kept = a[i];
        a[i] = b[i];
        b[i] = kept;
    }
}

static inline real hqp_length(const hqp_solver *s, const real *a) {
    return sqrt(hqp_dot(a, a, 0, (int)s->ld));
}

/* row . x */
static inline real hqp_value(const hqp_solver *s, int id, const real *x) {
    const real *row = hqp_row(s, s->given, id);
    if (s->only[id] >= 0) return row[s->only[id]] * x[s->only[id]];
    return hqp_dot(row, x, s->given.first[id], s->given.last[id]);
}

/* what the value of the row lacks to lie in its bounds */
static inline real hqp_slack(const hqp_solver *s, int id) {
    const real value = s->value[id];
    const real below = s->lb[id] - value, above = s->ub[id] - value;
    return (below > 0.0 ? below : 0.0) + (above < 0.0 ? above : 0.0);
}

/* one of the first `count` rows is a member of the working set */
static inline int hqp_any_side(const hqp_solver *s, int count) {
    int any = 0;
    for (int i = 0; i < count; i++) any |= s->side[i];
    return any;
}

/* a row of an earlier level is, by guess, held in this one */
static inline int hqp_holds(const hqp_solver *s, int level) {
    int any = 0;
    for (int i = 0; i < s->row0[level]; i++) any |= s->guess_held_at[i] == level;
    return any;
}

static inline real hqp_bound(const hqp_solver *s, int id, int side) {
    return side < 0 ? s->lb[id] : s->ub[id];
}

/* of all that was held or fitted, with the variables that were fixed ahead of their turn */
static inline int hqp_rank(const hqp_solver *s) {
    return s->rank_at[s->levels] + s->n - s->unseen_count - s->width;
}

/* no rows come after those of this level */
static inline int hqp_is_last(const hqp_solver *s, int level) {
    return level < s->levels && s->row0[level + 1] == s->total;
}

/* a range of an earlier level that must hold and may be inside its bounds */
static inline int hqp_is_hard(const hqp_solver *s, int id) {
    return s->kind[id] == HQP_RANGE && s->frozen_at[id] < 0;
}

static inline real hqp_tolerance(const hqp_solver *s, int id, real bound, real x_norm) {
    return s->settings.feasibility * (1.0 + fabs(bound)) + s->settings.rounding * s->norm[id] * x_norm;
}

/* -1: the value is below lb by more than the tolerance, 1: above ub, 0: neither */
static inline int hqp_outside(const hqp_solver *s, int id, real value, real x_norm) {
    if (value > s->ub[id]) return value - s->ub[id] > hqp_tolerance(s, id, s->ub[id], x_norm);
    if (value < s->lb[id]) return -(s->lb[id] - value > hqp_tolerance(s, id, s->lb[id], x_norm));
    return 0;
}

/* the value lies at this (finite) bound or beyond it */
static inline int hqp_at_bound(const hqp_solver *s, int id, int side, real value, real x_norm) {
    const real bound = hqp_bound(s, id, side);
    return side * (bound - value) <= hqp_tolerance(s, id, bound, x_norm);
}

/* hqp_fix.c: variables fixed ahead of their turn */
int hqp_fix(hqp_solver *s, int first);
void hqp_unfix(hqp_solver *s);
int hqp_leave_unseen(hqp_solver *s);
void hqp_gather(const hqp_solver *s, real *to, const real *row);
void hqp_scatter(const hqp_solver *s, real *row);

/* hqp_join.c: levels in whose order rounding would have the last word */
void hqp_join(hqp_solver *s);
void hqp_part(hqp_solver *s);
void hqp_unjoin(hqp_solver *s);
int hqp_any_strict(const hqp_solver *s);
int hqp_part_last(hqp_solver *s);
int hqp_may_gain(hqp_solver *s);
int hqp_try_join(hqp_solver *s);
hqp_status hqp_choose(hqp_solver *s, hqp_status status);
int hqp_join_next(hqp_solver *s, int level);
void hqp_take_up(hqp_solver *s, const signed char *joined, int smaller);
int hqp_weigh(hqp_solver *s, int kept);
int hqp_set_apart(hqp_solver *s, signed char *joined);
int hqp_is_worth_joins(const hqp_solver *s, const signed char *joined);
void hqp_take_back(hqp_solver *s, const signed char *joined);
hqp_run hqp_last_missed(hqp_solver *s, int count);
void hqp_soften(hqp_solver *s, hqp_run run);
void hqp_harden(hqp_solver *s);
void hqp_keep(const hqp_solver *s, hqp_place to);
void hqp_go_to(hqp_solver *s, hqp_place from);
int hqp_any_joined(const hqp_solver *s);
void hqp_bring_back(hqp_solver *s);
int hqp_first_apart(const hqp_solver *s, const real *kept_x, real most);
int hqp_is_kept_better(const hqp_solver *s, const real *kept_x);

/* hqp.c: all that is known of earlier solves is forgotten, and x = 0 */
void hqp_forget(hqp_solver *s);

/* hqp_extended.c: with more digits, of which there are no more than those */
#ifdef HQP_EXTENDED
#define hqp_try_extended(s, status) (status)
#define hqp_prove_extended(s) 0
#else
hqp_status hqp_try_extended(hqp_solver *s, hqp_status status);
int hqp_prove_extended(hqp_solver *s);
#endif

/* hqp_tries.c: all ways, one after the other */
int hqp_usual(int n);
void hqp_end_here(hqp_solver *s, int rank);
hqp_status hqp_solve_from(hqp_solver *s, int first);

/* hqp_lq.c: the factorisation */
void hqp_bring(hqp_solver *s, const int *ids, int count);
void hqp_forget_row(hqp_solver *s, int id);
void hqp_forget_reflectors(hqp_solver *s);
void hqp_copy_base(const hqp_solver *s, hqp_rows to, int position, int id);
void hqp_reflect_all(const hqp_solver *s, int from, int to, hqp_rows rows, const int *idx, int count);
void hqp_reflect_back(const hqp_solver *s, int from, hqp_rows rows, const int *idx, int count);
void hqp_reflect_row(const hqp_solver *s, int to, real *row);
void hqp_reflect_row_back(const hqp_solver *s, int from, real *row);
real hqp_noise(const hqp_solver *s, int id);
int hqp_is_clear(const hqp_solver *s, int id, real left);
int hqp_lq(hqp_solver *s, hqp_rows rows, const int *ids, int *order, int count);
void hqp_least_squares(hqp_solver *s, int column);

/* hqp_set.c: the working set of a level, and the passage from one level to the next */
int hqp_seat_guess(hqp_solver *s, int level);
int hqp_seat_violated(hqp_solver *s, int level);
void hqp_factorise(hqp_solver *s, int level);
void hqp_find_step(hqp_solver *s, int keep);
void hqp_find_multipliers(hqp_solver *s, const real *value, real x_norm);
void hqp_move_to_trial(hqp_solver *s);
void hqp_freeze(hqp_solver *s, int level);
void hqp_hold_fitted(hqp_solver *s);
void hqp_close_level(hqp_solver *s, int level);
void hqp_rewind(hqp_solver *s, int first);
int hqp_out_of_iterations(hqp_solver *s);

/* hqp_clock.c: seconds since some point in time */
double hqp_now(void);

/* hqp_proof.c: is x optimal?; hqp_cone.c: the way down where it is not */
real hqp_descent(hqp_solver *s, int level);
void hqp_find_slacks(hqp_solver *s, int from, int to);
void hqp_find_values(hqp_solver *s);
int hqp_has_slack(hqp_solver *s, int level);
int hqp_is_long(const hqp_solver *s, int level, int id);
void hqp_gradient(const hqp_solver *s, int level, real *g);
int hqp_touches_with(const hqp_solver *s, int id, int side, real value, real x_norm);
int hqp_touches(const hqp_solver *s, int id, int side);
int hqp_prove(hqp_solver *s, int count);
int hqp_prove_by_descent(hqp_solver *s, int count);
int hqp_confirm(hqp_solver *s);
int hqp_is_minimal(hqp_solver *s, int level);
void hqp_seat_held(hqp_solver *s, int level);
void hqp_seat_missed(hqp_solver *s, int level);

/* hqp_lean.c: would a join leave a row? */
int hqp_holds_joined(hqp_solver *s, int level, int k);

/* hqp_guess.c: a working set for a level that the walk starts with */
int hqp_guess(hqp_solver *s, int level);

/* The two methods: all levels with guessed working sets (hqp_sweep.c), and one level with certainty
 * (hqp_walk.c) */
int hqp_sweep(hqp_solver *s, int first, int repair);
int hqp_fit_face(hqp_solver *s);
hqp_status hqp_walk(hqp_solver *s, int level);

/* Parts of the sweep: the last step (hqp_dual.c), and what to do where it is impossible (hqp_clash.c). They
 * return one of these, or the level to go back to. */
enum { HQP_DONE = -1, HQP_NOT_LAST = -2, HQP_LOST = -3 };
void hqp_close_gaps(hqp_solver *s);
int hqp_take_into_held(hqp_solver *s, real *rest);
int hqp_finish(hqp_solver *s, int level);
void hqp_free_directions(hqp_solver *s);
int hqp_most_broken(hqp_solver *s, int level);
void hqp_hold(hqp_solver *s, int level);
int hqp_hold_broken(hqp_solver *s, int level, int id);
int hqp_give_way(hqp_solver *s, int level, int id, int side, const real *pull);

#endif
