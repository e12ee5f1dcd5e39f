/* Rotors and springs of series-elastic joints: the plant's inner steps (see sim/dynamics.py). */
#ifndef HAPTICD_ELASTIC_H
#define HAPTICD_ELASTIC_H

#include "links.h"
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

/* So many steps of h, by symplectic Euler: rates first, then positions. Brakes are dry friction on the
   rotors. The links are those that `qdd` and `load` are of. Returns 0, or -1 as links_accelerate. */
int elastic_move(const elastic *e, const links *l, double h, int steps);

#endif
