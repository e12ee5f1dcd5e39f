#include "direct.h"
#include "elastic.h"

#include <math.h>

/* Torques at the present state. */
static void torques(const direct *d) {
    for (int i = 0; i < d->n; i++) {
        d->load[i] = d->torque[i] - d->viscous[i] * d->qd[i] + d->push[i];
        d->dry[i] = d->gear[i] + d->share[i] * fabs(d->spring[i]) + d->bearing[i];
        if (d->braked[i]) d->dry[i] += d->brake[i];
    }
}

static void advance(const direct *d, const held *c, double h) {
    double v[DRY_MAX];
    for (int i = 0; i < d->n; i++) v[i] = d->qd[i] + h * d->qdd[i];
    held_step(c, h, v);
    for (int i = 0; i < d->n; i++) {
        const double way = 0.5 * h * (d->qd[i] + v[i]);
        double held_by = 0.0;
        for (int k = 0; k < c->rows; k++) held_by += c->J[d->n * k + i] * c->wrench[k];
        d->work[WORK_MOTORS] += way * d->torque[i];
        d->work[WORK_HAND] += way * (held_by + d->push[i]);
        d->work[WORK_DRY] += way * c->friction[i];
        d->work[WORK_DAMPING] -= way * d->viscous[i] * d->qd[i];
        d->qdd[i] = (v[i] - d->qd[i]) / h;
        d->qd[i] = v[i];
        d->q[i] += h * v[i];
    }
}

void direct_feel(const direct *d, const held *c) {
    for (int i = 0; i < d->n; i++) {
        const double outside = d->dry[i] > 0.0 ? d->bearing[i] / d->dry[i] : 0.0;
        const double felt = d->spring[i] + d->viscous[i] * d->qd[i] - d->rotor[i] * d->qdd[i];
        d->spring[i] = felt - outside * c->friction[i];
    }
}

int direct_move(const direct *d, const links *l, const held *c, double h, int steps) {
    for (int k = 0; k < steps; k++) {
        torques(d);
        if (links_accelerate(l) < 0) return -1;
        advance(d, c, h);
    }
    return 0;
}
