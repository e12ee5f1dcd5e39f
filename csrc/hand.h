/* An operator's hand: where it wants the handle, and what it tells its hold of that (see sim/hand.py). */
#ifndef HAPTICD_HAND_H
#define HAPTICD_HAND_H

#include "path.h"
#include "shape.h"

/* What held.h integrates. */
typedef struct {
    int rows;
    double *stiffness SHAPE(2), *damping SHAPE(2), *strength SHAPE(2);
    double *error SHAPE(rows), *rate SHAPE(rows);
} hold;

typedef struct {
    double stiffness[2], damping[2], strength[2]; /* of its grip: translation, rotation */
    /* where it wants the handle in B, and how fast that moves: (linear, angular) */
    double *place SHAPE(3), *target SHAPE(3, 3), *rate SHAPE(6);
    /* the handle in B, and the velocity of what carries the arm */
    const double *position SHAPE(3), *rotation SHAPE(3, 3), *base SHAPE(3);
} hand;

/* R = Rz(yaw) Ry(pi + tilt) Rz(roll) of three angles, and its angular velocity for their rates. */
void hand_hanging(const double *angles, const double *rates, double *R, double *omega);

/* It wants what a path of places and such angles says of a time. */
void hand_follow(const hand *h, const path *p, double t);

/* Tells a hold of six rows what it wants, without strength where it does not grip. */
void hand_aim(const hand *h, const hold *to, int grips);

#endif
