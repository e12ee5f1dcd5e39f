/* What of a measured wrench moves a twin, and what of it is held against. */
#ifndef HAPTICD_SHARED_WRENCH_H
#define HAPTICD_SHARED_WRENCH_H

#include "shape.h"

typedef struct {
    double *felt SHAPE(6), *held SHAPE(6);
} shared_wrench;

/* Both shares of a wrench (6). */
void shared_wrench_take(const shared_wrench *s, const double *wrench, double felt, double held);

#endif
