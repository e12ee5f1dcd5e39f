/* Rotors and springs of series-elastic joints: the plant's inner steps (see sim/dynamics.py). */
#ifndef HAPTICD_ELASTIC_H
#define HAPTICD_ELASTIC_H

#include "held.h"
#include "links.h"
#include "shape.h"

enum { WORK_MOTORS, WORK_HAND, WORK_DRY, WORK_DAMPING };

typedef struct {
    int n;
    /* constants: spring stiffness and damping, rotor inertia, viscous friction of the links and brake of each
     * joint; dry friction of its gear, and what that has besides as a share of the torque in the spring */
    const double *stiffness SHAPE(n), *damping SHAPE(n), *rotor SHAPE(n), *viscous SHAPE(n), *brake SHAPE(n);
    const double *gear SHAPE(n), *share SHAPE(n);
    const double *torque SHAPE(n); /* of the motors */
    const double *push SHAPE(n);   /* on the links, by what else touches them */
    const unsigned char *braked SHAPE(n);
    double *qdd SHAPE(n);                         /* of the links */
    double *q SHAPE(n), *qd SHAPE(n);             /* links */
    double *motor SHAPE(n), *motor_rate SHAPE(n); /* rotors, in joint units */
    double *spring SHAPE(n);                      /* torque in the springs */
    double *load SHAPE(n);                        /* spring and push less friction: what moves the links */
    double *work SHAPE(4);                        /* done on the joints so far, see above */
} elastic;

/* So many steps of h, by symplectic Euler: rates first, then positions. Brakes and gears are dry friction on
 * the rotors, c has that of the links. `qdd`, `load` and what c moves are those of the links l; qdd is left
 * with hand and dry friction. Returns 0, or -1 as links_accelerate. */
int elastic_move(const elastic *e, const links *l, const held *c, double h, int steps);

#endif
