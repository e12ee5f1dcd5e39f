/* What devices measure of the mechanics: the truth, some of it with white noise (see sim/probes.py). */
#ifndef HAPTICD_PROBES_H
#define HAPTICD_PROBES_H

#include "shape.h"

typedef struct {
    int n;
    const double *truth SHAPE(n);
    const double *noise OPTIONAL(n); /* its standard deviation */
    double *said SHAPE(n);
} probe;

typedef struct {
    int count;
    const probe *probe SHAPE(count);
    int rows, width; /* of the noise: one row a reading, as many as are drawn at once */
    const double *white SHAPE(rows, width); /* of standard deviation 1, in the order of those that have it */
    int next;                               /* row */
} probes;

/* Reads all of them with the next row. Returns how many are left. */
int probes_read(probes *p);

#endif
