/* Kinematics and inertia of a redundant serial interface in the coordinates of its motors.
 *
 * Motors need not sit at the joints: a constant matrix T (parallelograms, belts) takes the motor angles q to
 * those of the serial chain, r = T q, so that J = J_r T and M = T^T M_r T + diag(rotor). The task is a choice
 * of m of the three directions in which a point of the chain moves, or these and the turns about them. A turn
 * counts as the way of a point a lever's length from its axis: all of the task is in metres and newtons. */
#ifndef HAPTICD_REDUNDANT_H
#define HAPTICD_REDUNDANT_H

#include "serial.h"
#include "shape.h"

enum { REDUNDANT_MAX_TASK = 6 };

typedef struct {
    const serial_chain *chain;
    serial_frame frame;                     /* the hand's, its buffers 3, 9, 6 x n, 6 */
    int m;                                  /* directions of the task, at most REDUNDANT_MAX_TASK */
    int row[6];                             /* which of x, y, z they are; from 3 on turns about them */
    double lever;                           /* of turns [m] */
    const double *reference SHAPE(9);       /* orientation of the hand that counts as not turned, row-major */
    const double *transmission SHAPE(n, n); /* T */
    const double *rotor SHAPE(n);           /* inertia of the motors */
    const double *gravity SHAPE(3);         /* in the axes of the base */
    const double *q SHAPE(n), *qd SHAPE(n); /* of the motors */
    double *position SHAPE(m); /* turns: the rotation vector from the reference, in the axes of the base */
    double *velocity SHAPE(m); /* turns: the angular velocity */
    double *J SHAPE(m, n); /* velocity = J qd: of turns the position's derivative at the reference alone */
    double *dJ SHAPE(n, m, n); /* derivative of J by each q_k */
    double *M SHAPE(n, n);
    double *drift SHAPE(m);  /* acceleration of the hand at qdd = 0 */
    double *bias SHAPE(n);   /* torques of the present velocities: Coriolis, centrifugal */
    double *weight SHAPE(n); /* torques that hold the chain against gravity */
} redundant;

/* Everything at the state q, qd. */
void redundant_update(const redundant *r);

/* Positions x (count x m), Jacobians J (count x m x n) and their derivatives dJ (count x n x m x n) of many
 * configurations q (count x n); dJ may be NULL. */
void redundant_sweep(const redundant *r, int count, const double *q, double *x, double *J, double *dJ);

/* Gauss-Newton steps, at most `steps`, that take the hand to x (count x m) in many configurations q (count x
 * n), in place, each the shortest, and no motor's longer than `longest`. The last one is that from a distance
 * of `arrived`. */
void redundant_approach(const redundant *r, int count, double *q, const double *x, int steps, double longest,
                        double arrived);

#endif
