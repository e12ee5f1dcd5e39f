/* A free rigid body as the digital twin, in all directions or some of them (see control/twin.py). */
#ifndef HAPTICD_CARTESIAN_TWIN_H
#define HAPTICD_CARTESIAN_TWIN_H

#include "shape.h"

typedef struct {
    int n;            /* directions in which it moves, 1 .. 6 */
    int direction[6]; /* those, 0 .. 5, along the axes of B */
    const double *damping SHAPE(n);
    double *qd SHAPE(n), *force SHAPE(n);
    double *position SHAPE(3), *rotation SHAPE(3, 3), *twist SHAPE(6); /* of E; its qd where n is 6 */
} cartesian_twin;

/* force = w - D qd, with the wrench w (6) at E. */
void cartesian_twin_feel(const cartesian_twin *t, const double *wrench);

/* Over dt under constant acceleration (n). */
void cartesian_twin_advance(const cartesian_twin *t, const double *qdd, double dt);

#endif
