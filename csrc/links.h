/* The links of a serial arm under given torques, M qdd = load - bias, and one frame of them.
 *
 * The base accelerates as `gravity` says: less its acceleration. All results are in the axes of the base,
 * twists are (linear, angular). It is the plant's: the daemon computes its own arm by other means (serial.h).
 */
#ifndef HAPTICD_LINKS_H
#define HAPTICD_LINKS_H

#include "serial_model.h"
#include "shape.h"

typedef struct {
    serial_chain chain;
    int n;             /* joints */
    int joint;         /* the one that carries the frame */
    double R[9], t[3]; /* the frame in that joint's */
    const double *gravity SHAPE(3);
    const double *armature SHAPE(n); /* what turns with the joints and is no link */
    const double *q SHAPE(n), *qd SHAPE(n), *load SHAPE(n);

    double *qdd SHAPE(n);
    double *inverse SHAPE(n, n); /* of the inertia */
    /* of the frame; the acceleration is that of its origin */
    double *position SHAPE(3), *rotation SHAPE(3, 3), *J SHAPE(6, n), *twist SHAPE(6), *acceleration SHAPE(6);
} links;

/* Accelerations at the present state, and the inverse inertia. Returns 0, or -1 where the inertia is not
 * positive definite. */
int links_accelerate(const links *l);

/* Inertia M (n x n, of which the upper triangle is written), and bias (n): the torques that weight and motion
 * take, M qdd = load - bias. */
void links_inertia(const links *l, double *M, double *bias);

/* The frame at the present state. */
void links_observe(const links *l);

#endif
