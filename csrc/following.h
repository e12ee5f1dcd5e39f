/* Whether joints follow where they are led, and whether their motors can hold what is asked of them. */
#ifndef HAPTICD_FOLLOWING_H
#define HAPTICD_FOLLOWING_H

#include "shape.h"

typedef struct {
    int n;
    int longest;        /* ticks for which the feedback may strain a motor */
    double doubt, keep; /* part of a planned torque that may be wrong; what a tick leaves of that doubt */
    const double *link SHAPE(n), *led SHAPE(n);    /* measured, and where they were led */
    const double *strain SHAPE(n), *most SHAPE(n); /* what the feedback gives alone, and may give */
    const double *load SHAPE(n), *able SHAPE(n);   /* torques that are asked of motors, and that they have */
    const double *inertia SHAPE(n, n), *qdd SHAPE(n), *gain SHAPE(n); /* of the plan; of the feedback */
    double *planned SHAPE(n);       /* torque that accelerations took lately; updated */
    int *strained SHAPE(n);         /* ticks for which each motor has been strained; updated */
    unsigned char *astray SHAPE(n); /* result: which joints do not follow; what is no number does not */
} following;

/* How many joints are further away than a leash (n), or have been strained for too long, and than what may be
 * wrong with the plan explains. `strains`: whether the strain is to be looked at in this tick. */
int following_judge(const following *f, const double *leash, int strains);

/* The first motor of which more is asked than it has, or -1. */
int following_overloaded(const following *f);

#endif
