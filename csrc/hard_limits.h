/*
 * Hard limits of axes, which what is measured must keep.
 *
 * All arrays belong to the caller; nothing here allocates.
 */
#ifndef HAPTICD_HARD_LIMITS_H
#define HAPTICD_HARD_LIMITS_H

#include "shape.h"

typedef struct {
    int n;
    const double *lower SHAPE(n), *upper SHAPE(n); /* positions; may be infinite */
    const double *motor_speed SHAPE(n);            /* largest velocity */
    const double *speed SHAPE(n);                  /* largest speed by the way that an axis went */
    const double *position SHAPE(n), *velocity SHAPE(n), *way SHAPE(n); /* measured */
} hard_limits;

/* Whether every axis is within its limits; one of which a measurement is a NaN is not. */
int hard_limits_kept(const hard_limits *l);

#endif
