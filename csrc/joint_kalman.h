/* Positions, speeds and accelerations of rotors and links by a Kalman filter per joint, with the gains of its
 * steady state (see control/joint_kalman.py for the model). */
#ifndef HAPTICD_JOINT_KALMAN_H
#define HAPTICD_JOINT_KALMAN_H

#include "shape.h"

/* Of a joint: angles and speeds of rotor and link, accelerations of the rotor by friction and of the link by
 * what it carries, bias of the torque sensor; angle and speed of the rotor, angle of the link, torque. */
enum { KALMAN_STATES = 7, KALMAN_MEASURED = 4, KALMAN_LINK_RATE = 3 };

typedef struct {
    int n; /* joints */
    /* of each joint: transition, effect of the motor's torque, gain of the correction, spring's stiffness,
     * inertia of the link */
    const double *A SHAPE(n, 7, 7), *B SHAPE(n, 7), *K SHAPE(n, 7, 4), *stiffness SHAPE(n), *inertia SHAPE(n);
    const double *motor SHAPE(n), *motor_rate SHAPE(n), *link SHAPE(n), *load SHAPE(n); /* measured */
    double *x SHAPE(n, 7);                                                              /* state */
    /* estimates at the time of the measurements */
    double *motor_now SHAPE(n), *motor_rate_now SHAPE(n);
    double *link_now SHAPE(n), *link_rate_now SHAPE(n), *link_acceleration_now SHAPE(n);
} joint_kalman;

/* At rest as measured. */
void joint_kalman_reset(const joint_kalman *f);

/* One tick; told (n): torques of the motors from the last measurements to these. */
void joint_kalman_update(const joint_kalman *f, const double *told);

/* The estimates from the state. */
void joint_kalman_show(const joint_kalman *f);

/* The acceleration of link i is what this row (7) gives with its state. */
void joint_kalman_acceleration(const joint_kalman *f, int i, double *row);

#endif
