#include "hand.h"

#include <math.h>
#include <string.h>

static const double EPSILON = 0x1p-52;
/* Its cube root: where a series is as good as the formula. */
static const double NEAR = 6.055454452393343e-06;

void hand_hanging(const double *angles, const double *rates, double *R, double *omega) {
    const double cy = cos(angles[0]), sy = sin(angles[0]);
    const double ct = -cos(angles[1]), st = -sin(angles[1]);
    const double cr = cos(angles[2]), sr = sin(angles[2]);
    R[0] = cy * ct * cr - sy * sr, R[1] = -cy * ct * sr - sy * cr, R[2] = cy * st;
    R[3] = sy * ct * cr + cy * sr, R[4] = -sy * ct * sr + cy * cr, R[5] = sy * st;
    R[6] = -st * cr, R[7] = st * sr, R[8] = ct;
    omega[0] = rates[2] * R[2] - sy * rates[1];
    omega[1] = rates[2] * R[5] + cy * rates[1];
    omega[2] = rates[2] * R[8] + rates[0];
}

void hand_follow(const hand *h, const path *p, double t) {
    path_at(p, t);
    memcpy(h->place, p->value, 3 * sizeof *h->place);
    memcpy(h->rate, p->rate, 3 * sizeof *h->rate);
    hand_hanging(p->value + 3, p->rate + 3, h->target, h->rate + 3);
}

static double norm(const double *v) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void cross(const double *a, const double *b, double *out) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Columns of A B^T, made of unit length and at right angles; its sums are fused: they round less. */
static void turn(const double *A, const double *B, double C[3][3]) {
    for (int j = 0; j < 2; j++) {
        for (int i = 0; i < 3; i++)
            C[j][i] = fma(A[3 * i + 2], B[3 * j + 2], fma(A[3 * i + 1], B[3 * j + 1], A[3 * i] * B[3 * j]));
        const double length = norm(C[j]);
        for (int i = 0; i < 3; i++) C[j][i] /= length;
    }
    cross(C[0], C[1], C[2]);
    cross(C[1], C[2], C[0]);
}

/* Rotation vector close to a half turn, by the quaternion whose i-th part is the largest. */
static void log_half(double C[3][3], double trace, double *vector) {
    double square[3], axis[3];
    for (int i = 0; i < 3; i++) square[i] = 2.0 * C[i][i] - trace + 1.0;
    const int either = square[0] >= square[1] ? 0 : 1, i = square[either] >= square[2] ? either : 2;
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double s = copysign(sqrt(square[i] + EPSILON + EPSILON * EPSILON), C[j][k] >= C[k][j] ? 1.0 : -1.0);
    axis[i] = s / 2.0;
    axis[j] = 1.0 / (2.0 * s) * (C[i][j] + C[j][i]);
    axis[k] = 1.0 / (2.0 * s) * (C[i][k] + C[k][i]);
    const double w = 1.0 / (2.0 * s) * (C[j][k] - C[k][j]), length = norm(axis);
    const double angle = 2.0 * atan2(length, w);
    for (int m = 0; m < 3; m++) vector[m] = angle * (axis[m] / length);
}

/* Rotation vector of a rotation with these columns; to the last bit what pinocchio's log3 gives. */
static void log3(double C[3][3], double *vector) {
    const double trace = C[0][0] + (C[1][1] + C[2][2]), cosine = (trace - 1.0) / 2.0;
    if (cosine < NEAR - 1.0) {
        log_half(C, trace, vector);
        return;
    }
    const double chord = sqrt(2.0 * (1.0 - cosine) + EPSILON * EPSILON);
    const double angle = trace > 3.0 - NEAR ? chord : acos(cosine);
    const double x = 0.5 * (C[1][2] - C[2][1]), y = 0.5 * (C[2][0] - C[0][2]), z = 0.5 * (C[0][1] - C[1][0]);
    const double square = x * x + y * y + z * z;
    const double scale =
        angle >= NEAR ? angle / sin(angle) : 1.0 + square / 6.0 + square * square * 3.0 / 40.0;
    vector[0] = scale * x, vector[1] = scale * y, vector[2] = scale * z;
}

void hand_aim(const hand *h, const hold *to, int grips) {
    double C[3][3];
    for (int i = 0; i < 2; i++) {
        to->stiffness[i] = h->stiffness[i];
        to->damping[i] = h->damping[i];
        to->strength[i] = grips ? h->strength[i] : 0.0;
    }
    turn(h->target, h->rotation, C);
    log3(C, to->error + 3);
    for (int i = 0; i < 3; i++) {
        to->error[i] = h->place[i] - h->position[i];
        to->rate[i] = h->rate[i] - h->base[i];
        to->rate[3 + i] = h->rate[3 + i];
    }
}
