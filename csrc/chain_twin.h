/* A serial chain with driven joints as the digital twin (see control/chain_twin.py). */
#ifndef HAPTICD_CHAIN_TWIN_H
#define HAPTICD_CHAIN_TWIN_H

#include "serial_model.h"
#include "shape.h"

typedef struct {
    int n; /* joints */
    const serial_chain *chain;
    double gravity[3]; /* that the chain's weight is felt with */
    double share;      /* of what drives the joints besides the wrench: drives, springs, weight */
    /* of the joints: inertia of their drives, viscous damping, constant torque, springs and where they are
     * slack */
    const double *inertia SHAPE(n), *damping SHAPE(n), *drive SHAPE(n), *stiffness SHAPE(n), *rest SHAPE(n);
    const double *q SHAPE(n), *qd SHAPE(n);
    double *M SHAPE(n, n);  /* result: inertia with that of the drives */
    double *force SHAPE(n); /* J^T w; what drives the joints besides is added, and c taken off */
} chain_twin;

/* Inertia and forces at the present state. */
void chain_twin_update(const chain_twin *t);

#endif
