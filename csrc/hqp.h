/*
 * Hierarchical least squares with inequalities.
 *
 * Levels p = 1..P over x in R^n, each with equality and inequality rows (either part may be empty):
 *
 *     A_p x + w_p = b_p,        lb_p <= C_p x + v_p <= ub_p
 *
 * Minimise |w_1|^2 + |v_1|^2; among the minimisers |w_2|^2 + |v_2|^2; and so on. Bounds may be infinite,
 * lb == ub makes a row an equality. w and v are unique; x is, where the levels leave no freedom.
 *
 * Matrices are row-major doubles. Nothing but hqp_create allocates; nothing does I/O or keeps state outside
 * the solver object; a clock is read only where a time limit is set. The same data and history give the same
 * bits, but for where a time limit ends a solve.
 */
#ifndef HQP_H
#define HQP_H

/* Of this interface: another major number breaks callers, another minor one adds to it. */
#define HQP_VERSION "1.1"

/* Shape of the array that a field points to, and whether it may be NULL: for those who bind arrays of other
   languages, nothing to the compiler. */
#define HQP_SHAPE(...)
#define HQP_OPTIONAL(...)

/* 0: solved. Positive: x is usable, with a remark. Negative: the data were refused, x is the last good one.
 */
typedef enum hqp_status {
    HQP_SOLVED = 0,
    HQP_ITERATION_CAP = 1, /* the cap was reached: levels before info.levels_done are optimal and kept */
    HQP_REPEATED_SET = 2,  /* a level could not be improved further and is not proven: best point kept */
    HQP_NOT_PROVEN =
        3, /* x may be optimal; levels before info.levels_done are, of the next no proof was found */
    HQP_TIME_LIMIT = 4,  /* as HQP_ITERATION_CAP: the time limit was reached */
    HQP_BAD_MATRIX = -1, /* NaN, infinite or absurdly large (> 1e100) entry in A, b or C, or a bad weight */
    HQP_BAD_BOUNDS = -2, /* a bound is NaN, lb = +inf, ub = -inf, or lb > ub by more than rounding */
    HQP_OVERFLOW = -3    /* the data are finite and their solution is not */
} hqp_status;

typedef struct hqp_dims {
    int n;                                     /* variables, 1..1024 */
    int levels;                                /* 1..256 */
    const int *equalities HQP_SHAPE(levels);   /* rows of A_p, 0..16384 */
    const int *inequalities HQP_SHAPE(levels); /* rows of C_p, 0..16384 */
} hqp_dims;

typedef struct hqp_settings {
    double feasibility; /* a row holds when it is met to this times (1 + |bound|), plus rounding */
    double rank;        /* a row is dependent when less than this part of its norm is left */
    double rounding;    /* relative error of row . x: a multiplier that it could have caused counts as zero */
    int max_iterations; /* working sets tried after the first of each level, over the whole solve; 0:
                           automatic */
    double time_limit;  /* seconds, looked at with each working set; 0: none */
} hqp_settings;

/* One level, in the caller's arrays. They are read during hqp_solve and hqp_resolve only. */
typedef struct hqp_level {
    const double *A HQP_SHAPE(equalities, n);
    const double *b HQP_SHAPE(equalities);
    const double *C HQP_SHAPE(inequalities, n);
    const double *lb HQP_SHAPE(inequalities);    /* -inf: none */
    const double *ub HQP_SHAPE(inequalities);    /* +inf: none */
    const double *weights HQP_OPTIONAL(weights); /* of the squared slack of each row of A, then of C, in
                                                    (0, 1e100]; NULL: all 1 */
} hqp_level;

/* What is known about the last solve. The three arrays are the caller's, all levels one after the other;
 * NULL where not wanted. After a negative status w and v are NaN and active is 0. */
typedef struct hqp_info {
    double *w HQP_OPTIONAL(equalities);             /* b - A x */
    double *v HQP_OPTIONAL(inequalities);           /* what C x lacks to lie in [lb, ub] */
    signed char *active HQP_OPTIONAL(inequalities); /* -1: at or below lb, 1: at or above ub, 0: between; lb
                                                       == ub counts as 1 if C x >= ub */
    hqp_status status;
    int iterations;  /* as counted by max_iterations */
    int levels_done; /* levels proven optimal, counted from the first */
    int rank;        /* directions of x that the levels determined; n: x is unique */
    int bad_level;   /* level (from 0) of the entry that was refused, else -1 */
} hqp_info;

typedef struct hqp_solver hqp_solver;

/* HQP_VERSION of the library. */
const char *hqp_version(void);

/* feasibility 1e-13, rank 1e-9, rounding 5e-15, max_iterations 0: 48 n, at least 8000; no time limit. */
hqp_settings hqp_default_settings(void);

/* The only function that allocates. settings may be NULL. NULL: dimension or setting out of range, more than
 * 2^26 coefficients (rows of all levels times n), no memory. */
hqp_solver *hqp_create(const hqp_dims *dims, const hqp_settings *settings);

/* Solve, starting from the last solution and its working sets. levels: [dims.levels]; x: [n], written only;
 * info: not NULL, though its arrays may be. */
hqp_status hqp_solve(hqp_solver *s, const hqp_level *levels, double *x, hqp_info *info);

/* The same when only levels >= first_changed_level (from 0) have changed since the last call. */
hqp_status hqp_resolve(hqp_solver *s, const hqp_level *levels, int first_changed_level, double *x,
                       hqp_info *info);

/* Forget the last solution and its working sets. */
void hqp_reset(hqp_solver *s);

/* The next solve starts from x [n], and from what is violated or at its bound there, unless x is 1e7 long or
 * longer. Returns 0, and changes nothing, where an entry is not finite. */
int hqp_start(hqp_solver *s, const double *x);

void hqp_destroy(hqp_solver *s);

const char *hqp_status_name(hqp_status status);

#endif
