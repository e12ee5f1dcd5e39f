/* Numbers of others, copied to where they are read side by side. */
#ifndef HAPTICD_COPIES_H
#define HAPTICD_COPIES_H

#include "shape.h"

typedef struct {
    int n;
    const double *from SHAPE(n);
    double *to SHAPE(n);
} copies_part;

/* Copies so many parts, in their order. */
void copies_take(const copies_part *parts, int count);

#endif
