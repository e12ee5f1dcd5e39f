#include "elastic.h"

#include <math.h>

/* Torques at the present state. */
static void torques(const elastic *e) {
    for (int i = 0; i < e->n; i++) {
        e->spring[i] =
            e->stiffness[i] * (e->motor[i] - e->q[i]) + e->damping[i] * (e->motor_rate[i] - e->qd[i]);
        e->load[i] = e->spring[i] - e->friction[i] * e->qd[i];
    }
}

static void advance(const elastic *e, double h) {
    for (int i = 0; i < e->n; i++) {
        double rate = e->motor_rate[i] + h / e->rotor[i] * (e->torque[i] - e->spring[i]);
        if (e->braked[i]) rate -= copysign(fmin(h / e->rotor[i] * e->brake[i], fabs(rate)), rate);
        e->motor_rate[i] = rate;
        e->qd[i] += h * e->qdd[i];
        e->motor[i] += h * rate;
        e->q[i] += h * e->qd[i];
    }
}

int elastic_move(const elastic *e, const links *l, double h, int steps) {
    for (int k = 0; k < steps; k++) {
        torques(e);
        if (links_accelerate(l) < 0) return -1;
        advance(e, h);
    }
    return 0;
}
