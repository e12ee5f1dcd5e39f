/* Torques of an operator arm (Bimanual, (1) and (2)), gravity apart. */
#ifndef HAPTICD_OPERATOR_LAW_H
#define HAPTICD_OPERATOR_LAW_H

#include "shape.h"

typedef struct {
    int n;
    double assist; /* gain of (2) */
    const double *J SHAPE(6, n), *rotation SHAPE(3, 3);
    /* wrenches at the palm in its axes: of the operator, of the avatar's world, of the avatar's limits */
    const double *hand SHAPE(6), *felt SHAPE(6), *limits SHAPE(6);
    const double *alpha SHAPE(n), *own SHAPE(n), *null SHAPE(n), *coriolis SHAPE(n);
    double *command SHAPE(n);  /* alpha tau_cmd */
    double *feedback SHAPE(n); /* tau_h */
    double *avatar SHAPE(n);   /* tau_la */
    double *torque SHAPE(n);
} operator_law;

void operator_law_update(const operator_law *l);

#endif
