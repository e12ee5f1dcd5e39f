#include "joint_kalman.h"

#include <math.h>

enum { MOTOR, MOTOR_RATE, LINK, LINK_RATE = KALMAN_LINK_RATE, RUBBED, CARRIED, BIAS };

static double spring(const joint_kalman *f, int i, const double *x) {
    return f->stiffness[i] * (x[MOTOR] - x[LINK]);
}

static void show(const joint_kalman *f, int i) {
    const double *const x = f->x + KALMAN_STATES * i;
    f->motor_now[i] = x[MOTOR];
    f->motor_rate_now[i] = x[MOTOR_RATE];
    f->link_now[i] = x[LINK];
    f->link_rate_now[i] = x[LINK_RATE];
    f->link_acceleration_now[i] = spring(f, i, x) / f->inertia[i] + x[CARRIED];
}

void joint_kalman_show(const joint_kalman *f) {
    for (int i = 0; i < f->n; i++) show(f, i);
}

void joint_kalman_acceleration(const joint_kalman *f, int i, double *row) {
    for (int s = 0; s < KALMAN_STATES; s++) row[s] = 0.0;
    row[MOTOR] = f->stiffness[i] / f->inertia[i];
    row[LINK] = -row[MOTOR];
    row[CARRIED] = 1.0;
}

void joint_kalman_reset(const joint_kalman *f) {
    for (int i = 0; i < f->n; i++) {
        double *const x = f->x + KALMAN_STATES * i;
        x[MOTOR] = f->motor[i], x[LINK] = f->link[i];
        x[MOTOR_RATE] = x[LINK_RATE] = x[RUBBED] = 0.0;
        x[CARRIED] = -spring(f, i, x) / f->inertia[i];
        x[BIAS] = f->load[i] - spring(f, i, x);
        show(f, i);
    }
}

static void predict(const joint_kalman *f, int i, double told, double *ahead) {
    const double *const x = f->x + KALMAN_STATES * i;
    const double *const A = f->A + KALMAN_STATES * KALMAN_STATES * i, *const B = f->B + KALMAN_STATES * i;
    for (int r = 0; r < KALMAN_STATES; r++) {
        ahead[r] = isfinite(told) ? B[r] * told : 0.0; /* a gate lets nothing else through */
        for (int c = 0; c < KALMAN_STATES; c++) ahead[r] += A[KALMAN_STATES * r + c] * x[c];
    }
}

static void correct(const joint_kalman *f, int i, const double *ahead) {
    const double off[KALMAN_MEASURED] = {
        f->motor[i] - ahead[MOTOR],
        f->motor_rate[i] - ahead[MOTOR_RATE],
        f->link[i] - ahead[LINK],
        f->load[i] - spring(f, i, ahead) - ahead[BIAS],
    };
    const double *const K = f->K + KALMAN_STATES * KALMAN_MEASURED * i;
    double *const x = f->x + KALMAN_STATES * i;
    for (int r = 0; r < KALMAN_STATES; r++) {
        x[r] = ahead[r];
        for (int c = 0; c < KALMAN_MEASURED; c++) x[r] += K[KALMAN_MEASURED * r + c] * off[c];
    }
}

void joint_kalman_update(const joint_kalman *f, const double *told) {
    for (int i = 0; i < f->n; i++) {
        double ahead[KALMAN_STATES];
        predict(f, i, told[i], ahead);
        correct(f, i, ahead);
        show(f, i);
    }
}
