#include "cartesian_twin.h"
#include "rotation.h"

void cartesian_twin_feel(const cartesian_twin *t, const double *wrench) {
    for (int i = 0; i < t->n; i++) t->force[i] = wrench[t->direction[i]] - t->damping[i] * t->qd[i];
}

void cartesian_twin_advance(const cartesian_twin *t, const double *qdd, double dt) {
    double acceleration[6] = {0.0};
    for (int i = 0; i < t->n; i++) acceleration[t->direction[i]] = qdd[i];
    rotation_advance_body(t->position, t->rotation, t->twist, acceleration, dt);
    for (int i = 0; i < t->n; i++) t->qd[i] = t->twist[t->direction[i]];
}
