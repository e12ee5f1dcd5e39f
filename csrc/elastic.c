#include "elastic.h"

#include <math.h>

void elastic_torques(const elastic *e) {
    for (int i = 0; i < e->n; i++) {
        e->spring[i] =
            e->stiffness[i] * (e->motor[i] - e->q[i]) + e->damping[i] * (e->motor_rate[i] - e->qd[i]);
        e->load[i] = e->spring[i] - e->friction[i] * e->qd[i];
    }
}

void elastic_advance(const elastic *e, double h) {
    for (int i = 0; i < e->n; i++) {
        double rate = e->motor_rate[i] + h / e->rotor[i] * (e->torque[i] - e->spring[i]);
        if (e->braked[i]) rate -= copysign(fmin(h / e->rotor[i] * e->brake[i], fabs(rate)), rate);
        e->motor_rate[i] = rate;
        e->qd[i] += h * e->qdd[i];
        e->motor[i] += h * rate;
        e->q[i] += h * e->qd[i];
    }
}
