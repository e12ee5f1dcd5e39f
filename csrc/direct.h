/* Joints in which nothing yields: rotor and link move as one (see sim/dynamics.py). */
#ifndef HAPTICD_DIRECT_H
#define HAPTICD_DIRECT_H

#include "held.h"
#include "links.h"
#include "shape.h"

typedef struct {
    int n;
    /* constants: viscous friction and brake of each joint; dry friction of its gear, what that has besides as
     * a share of the torque that it carries, and dry friction of its bearing */
    const double *viscous SHAPE(n), *brake SHAPE(n), *gear SHAPE(n), *share SHAPE(n), *bearing SHAPE(n);
    const double *torque SHAPE(n); /* of the motors */
    const double *push SHAPE(n);   /* on the links, by what else touches them */
    const unsigned char *braked SHAPE(n);
    double *spring SHAPE(n); /* torque that each gear carries */
    const double *rotor SHAPE(n);
    double *qdd SHAPE(n);             /* of the joints */
    double *q SHAPE(n), *qd SHAPE(n); /* of the joints */
    double *load SHAPE(n);            /* what moves them but for hand and dry friction */
    double *dry SHAPE(n);             /* largest dry friction; of the chain that is given with it */
    double *work SHAPE(4);            /* done on the joints so far, as in elastic.h */
} direct;

/* So many steps of h, by symplectic Euler; see elastic_move. */
int direct_move(const direct *d, const links *l, const held *c, double h, int steps);

/* Adds to what moves the links, which stands in spring, what a sensor between gear and link feels beside it:
 * the motor less its rotor. Brake, gear and bearing rub together; the bearing's part does not pass through.
 */
void direct_feel(const direct *d, const held *c);

#endif
