#include "tool.h"

#include <string.h>

/* Motion of a rigid body, whose origin is H. */
typedef struct {
    double specific[3], alpha[3], omega[3];
} motion;

static void add_cross(double scale, const double *a, const double *b, double *out) {
    out[0] += scale * (a[1] * b[2] - a[2] * b[1]);
    out[1] += scale * (a[2] * b[0] - a[0] * b[2]);
    out[2] += scale * (a[0] * b[1] - a[1] * b[0]);
}

static void rotate_back(const double *R, const double *v, double *out) {
    for (int i = 0; i < 3; i++) out[i] = R[i] * v[0] + R[3 + i] * v[1] + R[6 + i] * v[2];
}

/* a - g at a point r: that of H + alpha x r + omega x (omega x r). */
static void at_point(const motion *m, const double *r, double *out) {
    double speed[3] = {0.0};
    memcpy(out, m->specific, sizeof m->specific);
    add_cross(1.0, m->alpha, r, out);
    add_cross(1.0, m->omega, r, speed);
    add_cross(1.0, m->omega, speed, out);
}

void tool_feel(const tool *t) {
    double R[9], specific[3], centre[3], pull[3], spin[3];
    motion m;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            R[3 * i + j] = t->rotation[3 * i] * t->axes[j] + t->rotation[3 * i + 1] * t->axes[3 + j] +
                           t->rotation[3 * i + 2] * t->axes[6 + j];
    for (int k = 0; k < 3; k++) specific[k] = t->base[k] + t->acceleration[k];
    rotate_back(R, specific, m.specific);
    rotate_back(R, t->acceleration + 3, m.alpha);
    rotate_back(R, t->twist + 3, m.omega);
    memcpy(t->omega, m.omega, sizeof m.omega);
    at_point(&m, t->unit, t->specific);

    double *const force = t->felt, *const torque = t->felt + 3;
    rotate_back(R, t->wrench, force);
    rotate_back(R, t->wrench + 3, torque);
    for (int k = 0; k < 3; k++) centre[k] = t->place[k] + t->centre[k];
    at_point(&m, centre, pull);
    for (int k = 0; k < 3; k++) pull[k] *= -t->mass, spin[k] = t->inertia[k] * m.omega[k];
    add_cross(1.0, force, t->place, torque);
    add_cross(1.0, t->centre, pull, torque);
    add_cross(-1.0, m.omega, spin, torque);
    for (int k = 0; k < 3; k++) force[k] += pull[k], torque[k] -= t->inertia[k] * m.alpha[k];
}
