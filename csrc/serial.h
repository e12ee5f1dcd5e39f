/* Kinematics and inverse dynamics of a serial chain on a base that may accelerate, for the tick.
 *
 * All results are in the axes of the base frame; twists are (linear, angular). Pinocchio's
 * algorithms are the reference that the tests compare with. */
#ifndef HAPTICD_SERIAL_H
#define HAPTICD_SERIAL_H

#include "serial_model.h"
#include "shape.h"

/* A frame fixed to the chain, and what is computed of it. */
typedef struct {
    int joint;         /* the one that carries it */
    double R[9], t[3]; /* its pose in that joint's frame */
    double *position SHAPE(3);
    double *rotation SHAPE(3, 3);
    double *J SHAPE(6, n);
    double *drift SHAPE(6); /* acceleration at qdd = 0 */
} serial_frame;

/* Poses, Jacobians and drift accelerations of some frames at a state (n); qd NULL is at rest: no drift. */
void serial_frames(const serial_chain *chain, const double *q, const double *qd, const serial_frame *frames,
                   int count);

/* Poses of the joints' frames at a posture (n): rotations R (n x 9) and origins p (n x 3). */
void serial_places(const serial_chain *chain, const double *q, double *R, double *p);

/* tau (n) that gives the accelerations qdd under gravity (3), less the base's acceleration. */
void serial_torques(const serial_chain *chain, const double *q, const double *qd, const double *qdd,
                    const double *gravity, double *tau);

/* M (n x n): inertia matrix, the torques of unit accelerations at rest without gravity. */
void serial_inertia(const serial_chain *chain, const double *q, double *M);

/* tau (n) at rest, qdd = 0, and M (n x n). */
void serial_dynamics(const serial_chain *chain, const double *q, const double *qd, const double *gravity,
                     double *tau, double *M);

/* Joints over dt under constant acceleration: q += qd dt + qdd dt^2 / 2, qd += qdd dt. */
void serial_advance(int n, double *q, double *qd, const double *qdd, double dt);

#endif
