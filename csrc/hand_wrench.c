#include "hand_wrench.h"

static void rotate(const double *R, const double *v, double *out) {
    for (int i = 0; i < 3; i++) out[i] = R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2];
}

static void rotate_back(const double *R, const double *v, double *out) {
    for (int i = 0; i < 3; i++) out[i] = R[i] * v[0] + R[3 + i] * v[1] + R[6 + i] * v[2];
}

static void add_cross(double scale, const double *a, const double *b, double *out) {
    out[0] += scale * (a[1] * b[2] - a[2] * b[1]);
    out[1] += scale * (a[2] * b[0] - a[0] * b[2]);
    out[2] += scale * (a[0] * b[1] - a[1] * b[0]);
}

void hand_wrench_update(const hand_wrench *h) {
    double palm[3], g[3], clean[6];
    rotate_back(h->rotation, h->gravity, palm);
    rotate_back(h->R, palm, g);
    for (int k = 0; k < 3; k++) {
        clean[k] = h->measured[k] - h->bias[k] - h->mass * g[k];
        clean[3 + k] = h->measured[3 + k] - h->bias[3 + k];
    }
    add_cross(-h->mass, h->centre, g, clean + 3);
    rotate(h->R, clean, h->wrench);
    rotate(h->R, clean + 3, h->wrench + 3);
    add_cross(1.0, h->t, h->wrench, h->wrench + 3);
}
