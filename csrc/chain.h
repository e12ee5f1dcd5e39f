/* The levels of the hierarchical force control that renders a serial chain, the digital twin "a", with
 * the manipulator "m" (HapticGiant, section VI-C, Table II).
 *
 *     x = [ qdd_m (6) | qdd_a (n) | alpha_a (n) | alpha_m (6) | alpha_sing | alpha_ee (3) | alpha_elbow (3) ]
 *
 * All matrices are row-major, twists and wrenches (linear, angular) in the base frame B. The PPU's motion
 * is a known disturbance. */
#ifndef HAPTICD_CHAIN_H
#define HAPTICD_CHAIN_H

#include "bounds.h"

enum { CHAIN_MAX_DOF = 24, CHAIN_LOWER_ACTIVE = 1, CHAIN_UPPER_ACTIVE = 2 };

typedef struct {
    int n;                            /* degrees of freedom of the twin, 1 .. CHAIN_MAX_DOF */
    double dt;                        /* of set A, and of the control loop */
    double viability_horizon;         /* of set B; one dt would let the joint bounce at its limit, period 2 */
    double point_horizon;             /* of the bounds (8) on tilt, handle and elbow */
    const bounds_limits *manipulator; /* 6 */
    const bounds_limits *twin;        /* n */
    double tilt_lower, tilt_upper;    /* s_min, s_max of the virtual sum joint (14) */
    double box_lower[3], box_upper[3];

    double k_p[6], k_d[6]; /* synchronisation gains of (11) */

    /* manipulator, at its commanded state and without the PPU's motion */
    const double *q, *qd;      /* 6 */
    const double *J, *J_elbow; /* 6 x 6, of handle H and elbow */
    const double *drift;       /* 6, acceleration of H at qdd_m = 0 */
    const double *drift_elbow; /* 6, the same of the elbow, the origin of joint 4 */
    const double *x_H, *R_H;   /* 3, 3 x 3 */
    const double *x_elbow;     /* 3 */
    /* PPU along x and y: position, velocity, acceleration */
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
    double *A1, *b1;                           /* 6 x dim, 6 */
    double *lb2, *ub2, *lb3, *ub3;             /* 6, 1 */
    double *C4, *lb4, *ub4, *C5, *lb5, *ub5;   /* 3 x dim, 3 */
    double *lb6, *ub6, *lb7, *ub7, *lb8, *ub8; /* n, 6, n */
    double *A9, *b9;                           /* n x dim, n */
    double *lb10, *ub10;                       /* n + 13 */
} chain;

/* Writes levels 1 to 9. Returns 0, or -1 where the manipulator is singular or M_a not positive definite;
 * the levels are then unusable. */
int chain_levels(const chain *c);

/* Writes the bounds of level 10 from the flags of the n + 13 constraint torques, (26) and (31). */
void chain_range(const chain *c, const unsigned char *active);

/* Adds to the flags every limit of levels 2 to 8 that x reaches, to within `tolerance` (1 + |bound|).
 * Returns how many flags are new. */
int chain_detect(const chain *c, const double *x, double tolerance, unsigned char *active);

#endif
