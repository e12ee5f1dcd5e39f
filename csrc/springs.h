/*
 * How far springs yield: bounds of their compliances that only ever narrow.
 *
 * A spring is a line through the origin. Whatever deflects it as it is measured, give or take what encoders
 * and torque sensor may err by, bounds its slope; what all of a block of slow ticks say narrows the bounds,
 * where the motor confirms the torque sensor. What the bounds exclude is not learnt, and nothing widens them
 * until the next start.
 *
 * All arrays belong to the caller; nothing here allocates. Times count in ticks.
 */
#ifndef HAPTICD_SPRINGS_H
#define HAPTICD_SPRINGS_H

#include <stdint.h>
#include "shape.h"

typedef struct {
    int n;
    int block;       /* ticks that must agree before anything is learnt */
    double relaxing; /* ticks that a deflection may lag behind its torque: springs damp */
    const double *motor SHAPE(n), *link SHAPE(n), *load SHAPE(n); /* positions, torque in the spring */
    const uint8_t *agree SHAPE(n); /* 1 where the motor gives what the torque sensor shows */
    const double *error SHAPE(n);  /* of a measured deflection, that of its torque included */
    const double *slow SHAPE(n);   /* change of the torque within a block that is slow */
    const double *stiffest SHAPE(n), *softest SHAPE(n); /* compliances between which any spring's is */
    const double *believed SHAPE(n);                    /* stiffness that the controller was given */
    const double *step SHAPE(n);                        /* by which its estimate may change in a tick */
    double *deflection SHAPE(n);                        /* motor less link in the last tick */
    int32_t *count SHAPE(n);                            /* ticks of the block so far */
    double *low SHAPE(n), *high SHAPE(n);               /* of the torque within the block */
    double *lower SHAPE(n), *upper SHAPE(n);            /* compliances that the block allows */
    double *least SHAPE(n), *most SHAPE(n);             /* of the spring's compliance */
    double *stiffness SHAPE(n); /* the nearest to the believed one within these bounds */
} spring_bounds;

/* Takes a tick; where commands may not move the axes, everything begins anew. */
void springs_learn(const spring_bounds *s, int free_to_move);

#endif
