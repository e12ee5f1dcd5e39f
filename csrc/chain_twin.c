#include "chain_twin.h"
#include "serial.h"

void chain_twin_update(const chain_twin *t) {
    const int n = t->n;
    double bias[SERIAL_MAX_JOINTS], gravity[3];
    for (int k = 0; k < 3; k++) gravity[k] = t->share * t->gravity[k];
    serial_dynamics(t->chain, t->q, t->qd, gravity, bias, t->M);
    for (int i = 0; i < n; i++) {
        const double damper = t->damping[i] * t->qd[i], spring = (t->rest[i] - t->q[i]) * t->stiffness[i];
        t->M[(n + 1) * i] += t->inertia[i];
        t->force[i] = t->force[i] - bias[i] - damper + t->share * spring + t->share * t->drive[i];
    }
}
