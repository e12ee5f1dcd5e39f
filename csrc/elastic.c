#include "elastic.h"

#include <math.h>

/* Torques at the present state. */
static void torques(const elastic *e) {
    for (int i = 0; i < e->n; i++) {
        e->spring[i] =
            e->stiffness[i] * (e->motor[i] - e->q[i]) + e->damping[i] * (e->motor_rate[i] - e->qd[i]);
        e->load[i] = e->spring[i] - e->viscous[i] * e->qd[i] + e->push[i];
    }
}

/* The rotor's rate: its dry friction stops it, or opposes it with all it has. */
static double turned(const elastic *e, int i, double h) {
    const double rate = e->motor_rate[i] + h / e->rotor[i] * (e->torque[i] - e->spring[i]);
    const double dry = e->gear[i] + e->share[i] * fabs(e->spring[i]) + (e->braked[i] ? e->brake[i] : 0.0);
    return rate - copysign(fmin(h / e->rotor[i] * dry, fabs(rate)), rate);
}

/* A constant force over h works along the mean of the speeds before and after. */
static void count_work(const elastic *e, const held *c, double h, const double *rate, const double *v) {
    for (int i = 0; i < e->n; i++) {
        const double turn = 0.5 * h * (e->motor_rate[i] + rate[i]), way = 0.5 * h * (e->qd[i] + v[i]);
        const double push = e->rotor[i] * (rate[i] - e->motor_rate[i]) / h - e->torque[i] + e->spring[i];
        const double damped = e->damping[i] * (e->motor_rate[i] - e->qd[i]);
        double held_by = 0.0;
        for (int k = 0; k < c->rows; k++) held_by += c->J[e->n * k + i] * c->wrench[k];
        e->work[WORK_MOTORS] += turn * e->torque[i];
        e->work[WORK_HAND] += way * (held_by + e->push[i]);
        e->work[WORK_DRY] += turn * push + way * c->friction[i];
        e->work[WORK_DAMPING] -= way * e->viscous[i] * e->qd[i] + (turn - way) * damped;
    }
}

static void advance(const elastic *e, const held *c, double h) {
    double rate[DRY_MAX], v[DRY_MAX];
    for (int i = 0; i < e->n; i++) {
        rate[i] = turned(e, i, h);
        v[i] = e->qd[i] + h * e->qdd[i];
    }
    held_step(c, h, v);
    count_work(e, c, h, rate, v);
    for (int i = 0; i < e->n; i++) {
        e->qdd[i] = (v[i] - e->qd[i]) / h;
        e->motor_rate[i] = rate[i];
        e->qd[i] = v[i];
        e->motor[i] += h * rate[i];
        e->q[i] += h * v[i];
    }
}

int elastic_move(const elastic *e, const links *l, const held *c, double h, int steps) {
    for (int k = 0; k < steps; k++) {
        torques(e);
        if (links_accelerate(l) < 0) return -1;
        advance(e, c, h);
    }
    return 0;
}
