/* A smooth path of a hand through places at given times: cubic segments, whose ends are held. */
#ifndef HAPTICD_PATH_H
#define HAPTICD_PATH_H

#include "shape.h"

typedef struct {
    int segments;
    int knots;                       /* segments + 1 */
    int columns;                     /* coordinates */
    const double *time SHAPE(knots); /* ascending [s] */
    /* of a segment and coordinate, for s from 0 to 1: ((a s + b) s + c) s + d */
    const double *cubic SHAPE(segments, columns, 4);
    double *value SHAPE(columns), *rate SHAPE(columns);
} path;

/* Coordinates and their rates at a time. */
void path_at(const path *p, double t);

#endif
