/* What a hand does to a handle: spring and damper to where it wants to be, each saturated. */
#ifndef HAPTICD_HAND_H
#define HAPTICD_HAND_H

#include "shape.h"

typedef struct {
    double stiffness[2], damping[2],
        strength[2];                   /* of translation and rotation; strength: largest force, torque */
    const double *between SHAPE(3, 3); /* from the handle's orientation to the wanted one, in B */
    double *wrench SHAPE(6);           /* in B */
} hand;

/* The wrench for a wanted place (3), its rate and angular velocity, and the handle's position and twist (6),
 * in B. */
void hand_pull(const hand *h, const double *place, const double *rate, const double *omega,
               const double *position, const double *twist);

#endif
