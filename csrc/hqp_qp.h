/*
 * Quadratic programs, dense and convex:
 *
 *     min 1/2 x^T P x + q^T x,    A x = b,  G x <= h,  lb <= x <= ub
 *
 * by a dual active-set method, with P positive semidefinite. Matrices are row-major doubles. Nothing but
 * hqp_qp_create allocates. The same data give the same bits, but where a time limit ends a solve.
 */
#ifndef HQP_QP_H
#define HQP_QP_H

#include "hqp.h"

/* What is optimal, or without solution, has been proven in the caller's data, whatever the way there. */
typedef enum hqp_qp_status {
    HQP_QP_SOLVED = 0,
    HQP_QP_INFEASIBLE = 1, /* with the multipliers the rows add up to 0 x < 0; of a lb > ub ub's alone is 1 */
    HQP_QP_UNBOUNDED = 2,  /* x: a ray, of length 1, along which the objective falls for ever */
    HQP_QP_ITERATION_CAP = 3, /* x is optimal for some of the constraints */
    HQP_QP_TIME_LIMIT = 4,    /* the same */
    HQP_QP_NOT_PROVEN = 5,    /* no proof was found: of the answer, or that there is none */
    HQP_QP_NOT_CONVEX = -1,   /* P has an eigenvalue that is less than 0 by more than rounding */
    HQP_QP_NOT_SYMMETRIC = -2,
    HQP_QP_BAD_DATA = -3 /* NaN, an entry that is infinite or > 1e100, or h or ub of -inf, or lb of +inf */
} hqp_qp_status;

/* A QP in the caller's arrays, which are read during hqp_qp_solve only. */
typedef struct hqp_qp {
    int n;            /* variables, from 1 on */
    int equalities;   /* rows of A */
    int inequalities; /* rows of G */
    const double *P HQP_SHAPE(n, n);
    const double *q HQP_SHAPE(n);
    const double *A HQP_OPTIONAL(equalities, n);
    const double *b HQP_OPTIONAL(equalities);
    const double *G HQP_OPTIONAL(inequalities, n);
    const double *h HQP_OPTIONAL(inequalities); /* +inf: none */
    const double *lb HQP_OPTIONAL(n);           /* -inf: none */
    const double *ub HQP_OPTIONAL(n);           /* +inf: none */
    const double *start HQP_OPTIONAL(n);        /* guess of x; a wrong one costs time, not accuracy */
    int max_iterations;                         /* rows added and released; 0: automatic */
    double time_limit;                          /* seconds, looked at with each iteration; 0: none */
} hqp_qp;

/* Multipliers are y of A, z of G and z_box, one after the other: P x + q + A^T y + G^T z + z_box = 0, z >= 0,
 * z_box > 0 at ub and < 0 at lb. */
typedef struct hqp_qp_answer {
    double *x HQP_SHAPE(n);
    double *multipliers HQP_OPTIONAL(any); /* [equalities + inequalities + n]; NULL where not wanted */
    double objective;
    int iterations;
} hqp_qp_answer;

typedef struct hqp_qp_solver hqp_qp_solver; /* the memory that a solve needs; nothing passes to the next */

/* For QPs of up to n variables and this many rows of A and G together. NULL where sizes are out of range (n
 * 1..1024, 0..8192 rows) or there is no memory. */
hqp_qp_solver *hqp_qp_create(int n, int rows);

hqp_qp_status hqp_qp_solve(hqp_qp_solver *s, const hqp_qp *qp, hqp_qp_answer *answer);

/* Whether x and multipliers, wherever they come from, prove x optimal, as hqp_qp_solve asks of its own. */
int hqp_qp_is_proven(hqp_qp_solver *s, const hqp_qp *qp, const double *x, const double *multipliers);

void hqp_qp_destroy(hqp_qp_solver *s);

#endif
