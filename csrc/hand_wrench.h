/* The wrench that a hand or the world puts on the palm, from the force-torque sensor at the wrist: freed of
 * the bias and of the weight of what hangs on the sensor, shifted to the palm (Bimanual, IV-A and IV-D). */
#ifndef HAPTICD_HAND_WRENCH_H
#define HAPTICD_HAND_WRENCH_H

#include "shape.h"

typedef struct {
    double bias[6];                     /* in the sensor's axes, as the rest */
    double mass, centre[3];             /* of what hangs on it */
    double R[9], t[3];                  /* pose of the sensor in the palm's frame */
    double gravity[3];                  /* in the axes of the base */
    const double *rotation SHAPE(3, 3); /* of the palm in the base */
    const double *measured SHAPE(6);
    double *wrench SHAPE(6); /* at the palm in its axes */
} hand_wrench;

void hand_wrench_update(const hand_wrench *h);

#endif
