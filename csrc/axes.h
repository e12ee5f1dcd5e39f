/* Prescribed axes with a first-order velocity loop and limited acceleration (see sim/dynamics.py). */
#ifndef HAPTICD_AXES_H
#define HAPTICD_AXES_H

#include "shape.h"

typedef struct {
    int n;
    double time_constant, rated;                   /* of the loop; acceleration */
    const double *lower SHAPE(n), *upper SHAPE(n); /* hard stops */
    const double *command SHAPE(n);                /* velocities */
    const unsigned char *braked SHAPE(n);          /* these stop at the rated acceleration */
    double *position SHAPE(n), *velocity SHAPE(n); /* updated */
    double *acceleration SHAPE(n);                 /* of the step */
} axes;

/* Advances them by dt. */
void axes_step(const axes *a, double dt);

#endif
