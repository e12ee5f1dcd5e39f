/* Rotors and springs of series-elastic joints: the plant's inner steps (see sim/dynamics.py). */
#ifndef HAPTICD_ELASTIC_H
#define HAPTICD_ELASTIC_H

#include "shape.h"

typedef struct {
    int n;
    /* constants: spring stiffness and damping, rotor inertia, viscous friction and brake of each joint */
    const double *stiffness SHAPE(n), *damping SHAPE(n), *rotor SHAPE(n), *friction SHAPE(n), *brake SHAPE(n);
    const double *torque SHAPE(n); /* of the motors */
    const unsigned char *braked SHAPE(n);
    const double *qdd SHAPE(n);                   /* of the links */
    double *q SHAPE(n), *qd SHAPE(n);             /* links */
    double *motor SHAPE(n), *motor_rate SHAPE(n); /* rotors, in joint units */
    double *spring SHAPE(n);                      /* torque in the springs */
    double *load SHAPE(n);                        /* spring less friction: what moves the links */
} elastic;

/* Torques at the present state. */
void elastic_torques(const elastic *e);

/* Symplectic Euler over h: rates first, then positions. Brakes are dry friction on the rotors. */
void elastic_advance(const elastic *e, double h);

#endif
