/* The operator's wrench a little ahead of the measured one (see control/handle_lead.py). */
#ifndef HAPTICD_HANDLE_LEAD_H
#define HAPTICD_HANDLE_LEAD_H

#include "shape.h"

typedef struct {
    double share;                             /* of what is above the filter's frequency, that is added */
    double keep;                              /* of the low-pass in a tick */
    double *below SHAPE(6), *wrench SHAPE(6); /* behind the low-pass; foretold; both updated */
} handle_lead;

/* Takes the wrench (6) of a tick. */
void handle_lead_update(const handle_lead *h, const double *wrench);

#endif
