#include "task_arm.h"
#include "spd.h"

#include <string.h>

/* Share of its trace that is added to J M^-1 J^T, so that it has a factor in a singular posture, too. */
static const double DAMPED = 1e-12;

static const double NONE[SERIAL_MAX_JOINTS];

void task_arm_push(int n, const double *J, const double *wrench, double *tau) {
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 6; k++) tau[i] += J[n * k + i] * wrench[k];
}

void task_arm_push_palm(int n, const double *J, const double *rotation, const double *wrench, double *tau) {
    double w[6];
    for (int k = 0; k < 3; k++) {
        const double *R = rotation + 3 * k;
        w[k] = R[0] * wrench[0] + R[1] * wrench[1] + R[2] * wrench[2];
        w[3 + k] = R[0] * wrench[3] + R[1] * wrench[4] + R[2] * wrench[5];
    }
    task_arm_push(n, J, w, tau);
}

/* (I - J^T (J M^-1 J^T)^-1 J M^-1) tau: what of it does not accelerate the palm. */
static void project(int n, const double *J, const double *M, double *tau) {
    double L[SPD_MAX * SPD_MAX], X[6][SPD_MAX], A[36], accelerated[SPD_MAX], wrench[6], trace = 0.0;
    memcpy(L, M, sizeof(double) * (size_t)(n * n));
    if (spd_factor(n, L)) return;
    for (int k = 0; k < 6; k++) {
        memcpy(X[k], J + n * k, sizeof(double) * (size_t)n);
        spd_solve(n, L, X[k]);
    }
    for (int a = 0; a < 6; a++)
        for (int b = 0; b < 6; b++) {
            A[6 * a + b] = 0.0;
            for (int i = 0; i < n; i++) A[6 * a + b] += J[n * a + i] * X[b][i];
        }
    for (int k = 0; k < 6; k++) trace += A[7 * k];
    for (int k = 0; k < 6; k++) A[7 * k] += DAMPED * trace;
    memcpy(accelerated, tau, sizeof(double) * (size_t)n);
    spd_solve(n, L, accelerated);
    for (int k = 0; k < 6; k++) {
        wrench[k] = 0.0;
        for (int i = 0; i < n; i++) wrench[k] -= J[n * k + i] * accelerated[i];
    }
    if (spd_factor(6, A)) return;
    spd_solve(6, A, wrench);
    task_arm_push(n, J, wrench, tau);
}

void task_arm_update(const task_arm *a) {
    const int n = a->n;
    serial_frames(a->chain, a->q, a->qd, a->palm, 1);
    const double *J = a->palm->J;
    for (int k = 0; k < 6; k++) {
        a->twist[k] = 0.0;
        for (int i = 0; i < n; i++) a->twist[k] += J[n * k + i] * a->qd[i];
    }
    serial_inertia(a->chain, a->q, a->M);
    serial_torques(a->chain, a->q, a->qd, NONE, NONE, a->coriolis);
    serial_torques(a->chain, a->q, NONE, NONE, a->gravity, a->weight);
    for (int i = 0; i < n; i++) a->null[i] = a->stiffness * (a->posture[i] - a->q[i]) - a->damping * a->qd[i];
    project(n, J, a->M, a->null);
}
