#include "avatar_model.h"
#include "spd.h"

#include <string.h>

static void foresee(avatar_model *m) {
    double q[PANDA_JOINTS], rate[PANDA_JOINTS] = {0.0};
    m->reached = panda_best(m->arm, m->wish, m->position, m->rotation, q);
    if (m->reached) {
        for (int i = 0; i < m->n && m->begun; i++) rate[i] = (q[i] - m->q[i]) / m->dt;
        memcpy(m->q, q, sizeof q);
    } else if (!m->begun) {
        memcpy(m->q, m->wish->start, sizeof q);
    }
    for (int i = 0; i < m->n; i++) m->qd[i] = m->begun ? m->qd[i] + m->share * (rate[i] - m->qd[i]) : 0.0;
    m->begun = 1;
}

/* (J^T)^+ tau, damped, in the axes of the palm. */
static void to_palm(const avatar_model *m) {
    const double *J = m->palm->J, *R = m->palm->rotation;
    const int n = m->n;
    double A[36], w[6];
    for (int a = 0; a < 6; a++) {
        w[a] = 0.0;
        for (int i = 0; i < n; i++) w[a] += J[n * a + i] * m->limits->torque[i];
        for (int b = 0; b < 6; b++) {
            A[6 * a + b] = a == b ? m->damping * m->damping : 0.0;
            for (int i = 0; i < n; i++) A[6 * a + b] += J[n * a + i] * J[n * b + i];
        }
    }
    memset(m->wrench, 0, sizeof w);
    if (spd_factor(6, A)) return;
    spd_solve(6, A, w);
    for (int k = 0; k < 6; k++) {
        const double *part = w + (k < 3 ? 0 : 3);
        m->wrench[k] = R[k % 3] * part[0] + R[3 + k % 3] * part[1] + R[6 + k % 3] * part[2];
    }
}

void avatar_model_update(avatar_model *m) {
    foresee(m);
    limit_avoidance_update(m->limits);
    serial_frames(m->chain, m->q, m->qd, m->palm, 1);
    to_palm(m);
}
