#include "rigid.h"
#include "spd.h"

#include <string.h>

/* out = T x */
static void to_joints(const rigid *r, const double *x, double *out) {
    for (int i = 0; i < r->n; i++) {
        out[i] = 0.0;
        for (int k = 0; k < r->n; k++) out[i] += r->transmission[r->n * i + k] * x[k];
    }
}

/* out = T^T x: torques, and rows of a Jacobian */
static void to_motors(const rigid *r, const double *x, double *out) {
    memset(out, 0, (size_t)r->n * sizeof *out);
    for (int k = 0; k < r->n; k++)
        for (int i = 0; i < r->n; i++) out[i] += r->transmission[r->n * k + i] * x[k];
}

/* The inverse of T^T M T + rotors, for M of which the upper triangle is given. */
static int invert(const rigid *r, double *M) {
    const int n = r->n;
    double half[SERIAL_MAX_JOINTS * SERIAL_MAX_JOINTS], turned[SERIAL_MAX_JOINTS * SERIAL_MAX_JOINTS];
    double column[SERIAL_MAX_JOINTS];
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < i; j++) M[n * i + j] = M[n * j + i];
    }
    for (int i = 0; i < n; i++) to_motors(r, M + n * i, half + n * i); /* M T */
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < n; i++) column[i] = half[n * i + j];
        to_motors(r, column, turned + n * j);
        turned[n * j + j] += r->rotor[j];
    }
    if (spd_factor(n, turned) < 0) return -1;
    spd_invert(n, turned, r->inverse);
    return 0;
}

int rigid_observe(const rigid *r, const links *l) {
    const int n = r->n;
    double M[SERIAL_MAX_JOINTS * SERIAL_MAX_JOINTS], bias[SERIAL_MAX_JOINTS];
    to_joints(r, r->q, r->joint);
    to_joints(r, r->qd, r->joint_rate);
    links_inertia(l, M, bias);
    links_observe(l);
    to_motors(r, bias, r->bias);
    for (int k = 0; k < r->rows; k++) {
        to_motors(r, l->J + n * k, r->J + n * k);
        r->twist[k] = l->twist[k];
    }
    return invert(r, M);
}

int rigid_move(const rigid *r, const links *l, const held *c, double h) {
    const int n = r->n;
    double driven[DRY_MAX], v[DRY_MAX];
    for (int i = 0; i < n; i++) {
        driven[i] = r->torque[i] - r->friction[i] * r->qd[i] - r->bias[i];
        for (int k = 0; k < 3; k++) driven[i] += r->J[n * k + i] * r->force[k];
    }
    for (int i = 0; i < n; i++) {
        r->qdd[i] = 0.0;
        for (int k = 0; k < n; k++) r->qdd[i] += r->inverse[n * i + k] * driven[k];
        v[i] = r->qd[i] + h * r->qdd[i];
    }
    held_step(c, h, v);
    for (int i = 0; i < n; i++) {
        r->qd[i] = v[i];
        r->q[i] += h * v[i];
    }
    return rigid_observe(r, l);
}
