/* A chain of joints whose end a hand holds and whose joints have dry friction: the speeds after a step.
 *
 *     M (v' - v) = h J^T w + p
 *     w = K (e + h (r - J v')) + D (r - J v'),    force and torque no larger than the hand's strength
 *     p: dry friction by maximum dissipation, |p_i| <= h dry_i
 *
 * v is what all other forces make of the speeds. Spring and damper act at the end of the step (implicit
 * Euler), so that no stiffness and no damping is too much for h, and at rest w = K e whatever the inertia. */
#ifndef HAPTICD_HELD_H
#define HAPTICD_HELD_H

#include "dry.h"
#include "shape.h"

typedef struct {
    int n;                             /* joints, at most DRY_MAX */
    int rows;                          /* 3: the hand holds a point, 6: a frame */
    const double *inverse SHAPE(n, n); /* of the inertia; the upper triangle is read */
    const double *J SHAPE(rows, n);    /* of what the hand holds */
    /* of the grip, translation and rotation: stiffness K, damping D, largest force and torque */
    const double *stiffness SHAPE(2), *damping SHAPE(2), *strength SHAPE(2);
    double *error SHAPE(rows);      /* e, from where it is to where the hand wants it; moves on with it */
    const double *rate SHAPE(rows); /* r, at which that place moves */
    const double *dry SHAPE(n);     /* largest friction */
    double *wrench SHAPE(rows);     /* w */
    double *friction SHAPE(n);      /* p / h, of the last step, too */
} held;

/* Speeds v (n) after a step of h, in place. */
void held_step(const held *c, double h, double *v);

#endif
