/* What sensors make of the truth: all of them at once, before and after gain and coupling (see
 * sim/sensor_errors.py). */
#ifndef HAPTICD_SENSOR_ERRORS_H
#define HAPTICD_SENSOR_ERRORS_H

#include "shape.h"

typedef struct {
    int n;
    double *value SHAPE(n); /* of a device */
} sensor_field;

typedef struct {
    int n, count;
    const sensor_field *field SHAPE(count); /* n components together */
    double *truth SHAPE(n);                 /* what is in them */
    double *seen SHAPE(n);                  /* the same with gain and coupling */
    const double *range SHAPE(n);           /* where readings saturate */
    const double *step SHAPE(n);            /* their resolution, 0 = none */
    int ahead;                              /* rows that are drawn at once */
    const double *offset SHAPE(ahead, n);   /* bias, drift and noise of a time, a row each */
    int next;                               /* row */
} sensor_errors;

/* Takes the truth out of the devices. */
void sensor_errors_take(const sensor_errors *e);

/* Gives them what is seen with the next row, saturated and in steps. */
void sensor_errors_give(sensor_errors *e);

#endif
