/* Torques that push joints away from their limits of position and velocity (Bimanual, (3) to (5)).
 *
 * The paper gives magnitudes only; here the torque points away from the limit of position, and against the
 * velocity. Distances are bounded from below, or a joint at its limit would get an infinite torque. */
#ifndef HAPTICD_LIMIT_AVOIDANCE_H
#define HAPTICD_LIMIT_AVOIDANCE_H

#include "shape.h"
#include <stdint.h>

enum { AVOIDS_LOWER = 1, AVOIDS_UPPER = 2, AVOIDS_SPEED = 4 };

/* beta, t and the least distance, of position [N m rad, rad, rad] or velocity [N m rad/s, rad/s, rad/s] */
typedef struct {
    double gain, zone, least;
} avoidance_gains;

typedef struct {
    int n;
    avoidance_gains position, velocity;
    const double *lower SHAPE(n), *upper SHAPE(n), *fastest SHAPE(n);
    const double *q SHAPE(n), *qd SHAPE(n);
    double *torque SHAPE(n); /* (4) */
    double *alpha SHAPE(n);  /* (5) */
    uint8_t *near SHAPE(n);  /* which limits push */
} limit_avoidance;

void limit_avoidance_update(const limit_avoidance *a);

#endif
