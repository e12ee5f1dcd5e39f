/* Kinematics and inertia of a redundant serial interface in the coordinates of its motors.
 *
 * Motors need not sit at the joints: a constant matrix T (parallelograms, belts) takes the motor angles q to
 * those of the serial chain, r = T q, so that J = J_r T and M = T^T M_r T + diag(rotor). The task is a choice
 * of m of the three directions in which a point of the chain moves. */
#ifndef HAPTICD_REDUNDANT_H
#define HAPTICD_REDUNDANT_H

#include "serial.h"

enum { REDUNDANT_MAX_TASK = 3 };

typedef struct {
    const serial_chain *chain;
    serial_frame frame;         /* the hand's, its buffers 3, 9, 6 x n, 6 */
    int m;                      /* directions of the task, at most REDUNDANT_MAX_TASK */
    int row[3];                 /* which of x, y, z they are */
    const double *transmission; /* T (n x n) */
    const double *rotor;        /* inertia of the motors (n) */
    const double *q, *qd;       /* of the motors (n) */
    double *position;           /* m */
    double *velocity;           /* m */
    double *J;                  /* m x n */
    double *dJ;                 /* n x m x n, derivative of J by each q_k */
    double *M;                  /* n x n */
    double *drift;              /* m, acceleration of the hand at qdd = 0 */
    double *bias;               /* n, torques of the present velocities: Coriolis, centrifugal */
} redundant;

/* Everything at the state q, qd. */
void redundant_update(const redundant *r);

/* Positions x (count x m), Jacobians J (count x m x n) and their derivatives dJ (count x n x m x n) of many
 * configurations q (count x n); dJ may be NULL. */
void redundant_sweep(const redundant *r, int count, const double *q, double *x, double *J, double *dJ);

#endif
