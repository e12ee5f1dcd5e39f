/* Kinematics and inverse dynamics of a serial chain on a base that may accelerate, for the tick.
 *
 * All results are in the axes of the base frame; twists are (linear, angular). The chain's constants come
 * from pinocchio's model, whose algorithms are the reference that the tests compare with. */
#ifndef HAPTICD_SERIAL_H
#define HAPTICD_SERIAL_H

#include "shape.h"

enum { SERIAL_MAX_JOINTS = 16 };

typedef struct {
    double R[9], t[3]; /* pose of the joint at rest in the frame of the joint before it */
    double axis[3];    /* unit vector in its own frame */
    int prismatic;
    double mass, centre[3], inertia[9]; /* of what it carries, in its own frame; inertia about the centre */
} serial_joint;

typedef struct {
    int n; /* joints, at most SERIAL_MAX_JOINTS */
    serial_joint joint[16];
} serial_chain;

/* A frame fixed to the chain, and what is computed of it. */
typedef struct {
    int joint;         /* the one that carries it */
    double R[9], t[3]; /* its pose in that joint's frame */
    double *position SHAPE(3);
    double *rotation SHAPE(3, 3);
    double *J SHAPE(6, n);
    double *drift SHAPE(6); /* acceleration at qdd = 0 */
} serial_frame;

/* Poses, Jacobians and drift accelerations of some frames at a state (n). */
void serial_frames(const serial_chain *chain, const double *q, const double *qd, const serial_frame *frames,
                   int count);

/* tau (n) that gives the accelerations qdd under gravity (3), less the base's acceleration. */
void serial_torques(const serial_chain *chain, const double *q, const double *qd, const double *qdd,
                    const double *gravity, double *tau);

/* M (n x n): inertia matrix, the torques of unit accelerations at rest without gravity. */
void serial_inertia(const serial_chain *chain, const double *q, double *M);

/* Joints over dt under constant acceleration: q += qd dt + qdd dt^2 / 2, qd += qdd dt. */
void serial_advance(int n, double *q, double *qd, const double *qdd, double dt);

#endif
