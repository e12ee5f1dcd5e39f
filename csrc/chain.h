/* The levels of the hierarchical force control that renders a serial chain, the digital twin "a", with
 * the manipulator "m" (HapticGiant, section VI-C, Table II), for any number of joints, sums of joints with
 * limits of their own and points that stay in boxes.
 *
 *     x = [ qdd_m (m) | qdd_a (n) | alpha_a (n) | alpha_m (m) | alpha_sum (sums) | alpha_point (3 points) ]
 *
 * The constraint torques alpha are there under the printed rule only; under Gauss's principle x ends after
 * qdd_a. All matrices are row-major, twists and wrenches (linear, angular) in the base frame B. The motion
 * of a base that carries the manipulator along x and y is a known disturbance. */
#ifndef HAPTICD_CHAIN_H
#define HAPTICD_CHAIN_H

#include "bounds.h"

enum { CHAIN_MAX_JOINTS = 16, CHAIN_MAX_DOF = 24, CHAIN_LOWER_ACTIVE = 1, CHAIN_UPPER_ACTIVE = 2 };

/* A point of the manipulator, and the box along the axes of B that it stays in: (15), (16). */
typedef struct {
    const double *x, *J, *drift; /* 3, 6 x m, 6: acceleration at qdd_m = 0; all without the base's motion */
    double lower[3], upper[3];
    double *C, *lb, *ub; /* 3 x dim, 3: rows of its level */
} chain_point;

typedef struct {
    int m;                            /* joints of the manipulator, 1 .. CHAIN_MAX_JOINTS */
    int n;                            /* degrees of freedom of the twin, 1 .. CHAIN_MAX_DOF */
    int torques;                      /* constraint torques in x: n + m + sums + 3 points, or 0 */
    int rows;                         /* directions in which H and E are coupled, 1 .. 6 */
    int direction[6];                 /* those, 0 .. 5 */
    double dt;                        /* of set A, and of the control loop */
    double viability_horizon;         /* of set B; one dt would let the joint bounce at its limit, period 2 */
    double point_horizon;             /* of the bounds (8) on sums and points */
    const bounds_limits *manipulator; /* m */
    const bounds_limits *twin;        /* n */

    int sums;                            /* (14) and the like: lower <= weight^T q <= upper */
    const double *weight;                /* sums x m */
    const double *sum_lower, *sum_upper; /* sums */
    int points;
    const chain_point *point;

    double k_p[6], k_d[6]; /* synchronisation gains of (11) */

    /* manipulator, at its commanded state and without the base's motion */
    const double *q, *qd;    /* m */
    const double *J;         /* 6 x m, of handle H */
    const double *drift;     /* 6, acceleration of H at qdd_m = 0 */
    const double *x_H, *R_H; /* 3, 3 x 3 */
    /* base along x and y: position, velocity, acceleration */
    const double *q_p, *qd_p, *qdd_p; /* 2 */

    /* twin */
    const double *q_a, *qd_a;      /* n */
    const double *J_a;             /* 6 x n */
    const double *drift_a;         /* 6, acceleration of E at qdd_a = 0 */
    const double *M_a;             /* n x n */
    const double *force_a;         /* n, J_a^T (w - w_ref) - tau_dis + tau_dri - c_a */
    const double *x_E, *R_E, *v_E; /* 3, 3 x 3, 6 */

    double *error; /* 6, from H to E: translation, and rotation vector in B; a result */

    /* rows of the levels; those not named here are constant and set by the caller */
    double *A1, *b1;                           /* rows x dim, rows */
    double *lb2, *ub2, *lb3, *ub3;             /* m, sums */
    double *lb6, *ub6, *lb7, *ub7, *lb8, *ub8; /* n, m, n */
    double *A9, *b9;                           /* n x dim, n */
    double *lb10, *ub10;                       /* torques */
} chain;

/* Writes levels 1 to 8. */
void chain_limits(const chain *c);

/* Writes level 9 with constraint torques, (20); needs six joints and six directions. Returns 0, or -1 where
 * the manipulator is singular or M_a not positive definite; the levels are then unusable. */
int chain_dynamics(const chain *c);

/* Writes level 9 by Gauss's principle: L^T qdd_a = L^-1 force_a with M_a = L L^T. What deviates least from it
 * in that metric within the levels above is the motion of the constrained multibody system. Returns 0, or
 * -1 where M_a is not positive definite. */
int chain_gauss(const chain *c);

/* Writes the bounds of level 10 from the flags of the constraint torques, (26) and (31). */
void chain_range(const chain *c, const unsigned char *active);

/* Adds to the flags, one for each of the n + m + sums + 3 points limits, every limit of levels 2 to 8 that x
 * reaches, to within `tolerance` (1 + |bound|). Returns how many flags are new. */
int chain_detect(const chain *c, const double *x, double tolerance, unsigned char *active);

#endif
