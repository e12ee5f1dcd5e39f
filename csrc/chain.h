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
#include "shape.h"

enum { CHAIN_MAX_JOINTS = 16, CHAIN_MAX_DOF = 24, CHAIN_LOWER_ACTIVE = 1, CHAIN_UPPER_ACTIVE = 2 };
enum { CHAIN_FREE = 0, CHAIN_CAUGHT = 1, CHAIN_LOCKED = 2 }; /* what a lock does to a joint of the twin */

/* A point of the manipulator, and the box along the axes of B that it stays in: (15), (16). */
typedef struct {
    /* without the base's motion; drift: acceleration at qdd_m = 0 */
    const double *x SHAPE(3), *J SHAPE(6, m), *drift SHAPE(6);
    double lower[3], upper[3];
    double *C SHAPE(3, dim), *lb SHAPE(3), *ub SHAPE(3); /* rows of its level */
} chain_point;

typedef struct {
    int m;                    /* joints of the manipulator, 1 .. CHAIN_MAX_JOINTS */
    int n;                    /* degrees of freedom of the twin, 1 .. CHAIN_MAX_DOF */
    int torques;              /* constraint torques in x: n + m + sums + 3 points, or 0 */
    int rows;                 /* directions in which H and E are coupled, 1 .. 6 */
    int direction[6];         /* those, 0 .. 5 */
    double dt;                /* of set A, and of the control loop */
    double viability_horizon; /* of set B; one dt would let the joint bounce at its limit, period 2 */
    double point_horizon;     /* of the bounds (8) on sums and points */
    double homing;            /* speed at which what is outside its limits returns [rad/s or m/s] */
    const bounds_limits *manipulator SHAPE(m);
    const bounds_limits *twin SHAPE(n);

    int sums; /* (14) and the like: lower <= weight^T q <= upper */
    const double *weight SHAPE(sums, m);
    const double *sum_lower SHAPE(sums), *sum_upper SHAPE(sums);
    int points;
    const chain_point *point SHAPE(points);

    double k_p[6], k_d[6]; /* synchronisation gains of (11) */

    /* manipulator, at its commanded state and without the base's motion */
    const double *q SHAPE(m), *qd SHAPE(m);
    const double *J SHAPE(6, m);  /* of handle H */
    const double *drift SHAPE(6); /* acceleration of H at qdd_m = 0 */
    const double *x_H SHAPE(3), *R_H SHAPE(3, 3);
    /* base along x and y: position, velocity, acceleration */
    const double *q_p SHAPE(2), *qd_p SHAPE(2), *qdd_p SHAPE(2);

    /* twin */
    const double *q_a SHAPE(n), *qd_a SHAPE(n);
    const unsigned char *held OPTIONAL(n); /* CHAIN_FREE, CHAIN_CAUGHT or CHAIN_LOCKED */
    const double *J_a SHAPE(6, n);
    const double *drift_a SHAPE(6); /* acceleration of E at qdd_a = 0 */
    const double *M_a SHAPE(n, n);
    const double *force_a SHAPE(n); /* J_a^T (w - w_ref) - tau_dis + tau_dri - c_a */
    const double *x_E SHAPE(3), *R_E SHAPE(3, 3), *v_E SHAPE(6);

    /* what the motors can give, all or none of them: inertia with rotors, torque at qdd_m = 0 without the
     * feedback of the tracking, that feedback, and the torques between which a motor may be commanded */
    const double *inertia OPTIONAL(m, m), *load OPTIONAL(m), *feedback OPTIONAL(m);
    const double *least OPTIONAL(m), *most OPTIONAL(m);

    double *error SHAPE(6); /* from H to E: translation, and rotation vector in B; a result */

    /* rows of the levels, dim = columns; those not named here are constant and set by the caller */
    double *A1 SHAPE(rows, dim), *b1 SHAPE(rows);
    double *C_torque OPTIONAL(m, dim), *lb_torque OPTIONAL(m), *ub_torque OPTIONAL(m);
    double *lb2 SHAPE(m), *ub2 SHAPE(m), *lb3 SHAPE(sums), *ub3 SHAPE(sums);
    double *lb6 SHAPE(n), *ub6 SHAPE(n), *lb7 SHAPE(m), *ub7 SHAPE(m);
    double *lb8 SHAPE(n), *ub8 SHAPE(n);
    double *A9 SHAPE(n, dim), *b9 SHAPE(n);
    double *lb10 SHAPE(torques), *ub10 SHAPE(torques);
} chain;

/* Writes levels 1 to 8, by their numbers in Table II, and that of the motors' torques. Returns 0, or -1 where
 * the inertia is not positive definite; the levels are then unusable. */
int chain_limits(const chain *c);

/* Writes level 9 with constraint torques, (20); needs six joints and six directions. Returns 0, or -1 where
 * the manipulator is singular or M_a not positive definite; the levels are then unusable. */
int chain_dynamics(const chain *c);

/* Writes level 9 by Gauss's principle: L^T qdd_a = L^-1 force_a with M_a = L L^T. What deviates least from it
 * in that metric within the levels above is the motion of the constrained multibody system. Returns 0, or
 * -1 where M_a is not positive definite. */
int chain_gauss(const chain *c);

/* All levels of a tick but the range of the constraint torques, with what is outside its limits returning at
 * `homing`. Returns 0, or -1 where they are unusable. */
int chain_assemble(chain *c, double homing);

/* Writes the acceleration (m) that draws the manipulator home (m): stiffness (home - q) - damping qd. */
void chain_draw(const chain *c, const double *home, double stiffness, double damping, double *pull);

/* Writes the bounds of level 10 from the flags of the constraint torques, (26) and (31). */
void chain_range(const chain *c, const unsigned char *active);

/* Adds to the flags, one for each of the n + m + sums + 3 points limits, every limit of levels 2 to 8 that x
 * reaches, to within `tolerance` (1 + |bound|). Returns how many flags are new. */
int chain_detect(const chain *c, const double *x, double tolerance, unsigned char *active);

/* The flags of an optimum x alone: those of limits, see chain_detect, and of motors, see chain_spend. */
void chain_settle(const chain *c, const double *x, double tolerance, unsigned char *active,
                  unsigned char *spent);

/* Sets the flag of each motor, (m), whose torque x takes to its bound, to within `tolerance` (1 + |bound|).
 */
void chain_spend(const chain *c, const double *x, double tolerance, unsigned char *spent);

#endif
