/* A force-torque sensor's slow drift, taken off where nobody pulls: a released handle must not wander off. */
#ifndef HAPTICD_DRIFT_H
#define HAPTICD_DRIFT_H

typedef struct {
    double dt;
    double share[2]; /* what is small and steady for it, beside a sensor of a strong arm: force, torque */
    double bias[6];  /* what is taken off [N, N m] */
    double slow[6];  /* the wrench, smoothed */
    double steady;   /* for so long it has been small and steady [s] */
} drift;

/* Takes the drift off a wrench (6) in the sensor's frame, freed of the tool's weight, and follows it: a
 * wrench that is small and steadier than a hand holds on is taken for drift, up to a bound. What is not
 * finite stays as it is. */
void drift_remove(drift *d, double *wrench);

#endif
