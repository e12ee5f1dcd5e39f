/* A tool that a hand holds at a frame of an arm, H, on a force-torque sensor: what its sensors feel. */
#ifndef HAPTICD_TOOL_H
#define HAPTICD_TOOL_H

#include "shape.h"

typedef struct {
    double axes[9]; /* of the sensors in H */
    /* in those axes: mass, centre of mass from the sensor, principal moments about it, the places of the
       sensor and of an inertial unit from H */
    double mass, centre[3], inertia[3], place[3], unit[3];
    /* in the axes of the base: H, what moves the base, less gravity, and the operator's wrench on H */
    const double *rotation SHAPE(3, 3), *twist SHAPE(6), *acceleration SHAPE(6), *base SHAPE(3);
    const double *wrench SHAPE(6);

    double *felt SHAPE(6);     /* by the force-torque sensor: operator, weight and inertia of the tool */
    double *specific SHAPE(3); /* force by the inertial unit, a - g */
    double *omega SHAPE(3);    /* angular velocity */
} tool;

/* What they feel now. */
void tool_feel(const tool *t);

#endif
