#include "inertial_unit.h"
#include "spd.h"

#include <math.h>
#include <string.h>

enum { LINEAR, ANGULAR = 3, M = INERTIAL_MEASURED, S = KALMAN_STATES };

/* R^T v */
static void into_unit(const inertial_unit *u, const double *v, double *out) {
    const double *const R = u->rotation;
    for (int i = 0; i < 3; i++) out[i] = R[i] * v[0] + R[3 + i] * v[1] + R[6 + i] * v[2];
}

void inertial_expect(const inertial_unit *u, const joint_kalman *f) {
    double specific[3], turning[3] = {0.0};
    for (int k = 0; k < 3; k++) specific[k] = u->drift[k] + (k < 2 ? u->base[k] : 0.0) - u->gravity[k];
    for (int i = 0; i < u->n; i++)
        for (int k = 0; k < 3; k++) {
            specific[k] += u->J[u->n * k + i] * f->link_acceleration_now[i];
            turning[k] += u->J[u->n * (3 + k) + i] * f->link_rate_now[i];
        }
    into_unit(u, specific, u->expected + LINEAR);
    into_unit(u, turning, u->expected + ANGULAR);
}

/* What is measured beyond what is expected, in the order of the unit; whether all of it is finite. */
static int beyond(const inertial_unit *u, double *off) {
    int finite = 1;
    for (int k = 0; k < M; k++) {
        off[k] = (k < ANGULAR ? u->specific[k] : u->turning[k - ANGULAR]) - u->expected[k];
        finite &= isfinite(off[k]) != 0;
    }
    return finite;
}

void inertial_reset(const inertial_unit *u, const joint_kalman *f) {
    double off[M];
    inertial_expect(u, f);
    if (beyond(u, off)) memcpy(u->bias, off, sizeof off);
}

/* H_i (6 x 7): effect of a joint's state on what is measured; its transpose is `column`. */
static void seen(const inertial_unit *u, const joint_kalman *f, int i, double column[S][M]) {
    double along[S], linear[3], turning[3], J[6];
    joint_kalman_acceleration(f, i, along);
    for (int k = 0; k < 6; k++) J[k] = u->J[u->n * k + i];
    into_unit(u, J, linear);
    into_unit(u, J + 3, turning);
    for (int s = 0; s < S; s++)
        for (int k = 0; k < 3; k++) {
            column[s][LINEAR + k] = linear[k] * along[s];
            column[s][ANGULAR + k] = s == KALMAN_LINK_RATE ? turning[k] : 0.0;
        }
}

void inertial_correct(const inertial_unit *u, const joint_kalman *f) {
    double off[M], seen_of[INERTIAL_MAX_JOINTS][S][M], PH[INERTIAL_MAX_JOINTS][S][M];
    double total[M * M] = {0.0};
    inertial_expect(u, f);
    if (!beyond(u, off)) return;
    for (int k = 0; k < M; k++) {
        off[k] -= u->bias[k];
        total[M * k + k] = u->noise[k] + u->doubt[k];
    }
    for (int i = 0; i < u->n; i++) {
        const double *const P = u->P + S * S * i;
        seen(u, f, i, seen_of[i]);
        for (int r = 0; r < S; r++)
            for (int k = 0; k < M; k++) {
                PH[i][r][k] = 0.0;
                for (int c = 0; c < S; c++) PH[i][r][k] += P[S * r + c] * seen_of[i][c][k];
            }
        for (int s = 0; s < S; s++)
            for (int k = 0; k < M; k++)
                for (int l = 0; l < M; l++) total[M * k + l] += seen_of[i][s][k] * PH[i][s][l];
    }
    if (spd_factor(M, total)) return;
    spd_solve(M, total, off);
    for (int k = 0; k < M; k++) u->bias[k] += u->doubt[k] * off[k];
    for (int i = 0; i < u->n; i++)
        for (int s = 0; s < S; s++)
            for (int k = 0; k < M; k++) f->x[S * i + s] += PH[i][s][k] * off[k];
    joint_kalman_show(f);
}
