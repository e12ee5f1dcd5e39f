/*
 * What motors may give that may give more for a time: the budget of i2t.
 *
 * Losses go with the square of the torque. What is above those of the rated torque fills a budget, what is
 * below empties it; the peak torque, held for its time, fills it once.
 *
 * All arrays belong to the caller; nothing here allocates.
 */
#ifndef HAPTICD_HEAT_H
#define HAPTICD_HEAT_H

#include "shape.h"

typedef struct {
    int n;
    double dt;                      /* of a tick [s] */
    double share;                   /* of a budget that is planned with */
    const double *told SHAPE(n);    /* torques that the motors give */
    const double *lasting SHAPE(n); /* that they may give for ever, at most the rated ones */
    const double *rated SHAPE(n);   /* at which a budget stays as it is */
    const double *peak SHAPE(n);    /* not above the lasting one: there is no more for a time */
    const double *seconds SHAPE(n); /* for which the peak may be held */
    double *used SHAPE(n);          /* share of the whole budget; updated */
    double *able SHAPE(n);          /* what they may give now */
} heat_budget;

/* Takes what was told for so many ticks. */
void heat_take(const heat_budget *h, int elapsed);

#endif
