#include "links.h"
#include "rotation.h"

#include <math.h>
#include <string.h>

/* Everything spatial is (linear, angular) at the origin of the base, in its axes: there, inertias simply add
 * (Featherstone, chapters 2 and 6). */
typedef struct {
    double mass, moment[3], inertia[6]; /* mass, mass times centre, and xx yy zz xy xz yz about the origin */
} spatial;

typedef struct {
    double R[9], p[3];
    double S[6], v[6], a[6]; /* motion of its joint, twist, acceleration */
} body;

static void multiply(const double *A, const double *B, double *C) {
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

static void rotate(const double *R, const double *v, double *out) {
    for (int i = 0; i < 3; i++) out[i] = R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2];
}

static void add_cross(const double *a, const double *b, double *out) {
    out[0] += a[1] * b[2] - a[2] * b[1];
    out[1] += a[2] * b[0] - a[0] * b[2];
    out[2] += a[0] * b[1] - a[1] * b[0];
}

static double dot(int n, const double *a, const double *b) {
    double sum = 0.0;
    for (int k = 0; k < n; k++) sum += a[k] * b[k];
    return sum;
}

/* Pose of the next body, and the motion of its joint. */
static void place(const body *before, const serial_joint *joint, double q, body *out) {
    double R[9], z[3], r[3], turn[3], motion[9];
    multiply(before->R, joint->R, R);
    rotate(R, joint->axis, z);
    rotate(before->R, joint->t, r);
    for (int k = 0; k < 3; k++) out->p[k] = before->p[k] + r[k] + (joint->prismatic ? q * z[k] : 0.0);
    memset(out->S, 0, sizeof out->S);
    if (joint->prismatic) {
        memcpy(out->R, R, sizeof R);
        memcpy(out->S, z, sizeof z);
    } else {
        for (int k = 0; k < 3; k++) turn[k] = q * joint->axis[k];
        rotation_exp(turn, motion);
        multiply(R, motion, out->R);
        add_cross(out->p, z, out->S);
        memcpy(out->S + 3, z, sizeof z);
    }
}

/* Its twist, and its acceleration for a qdd: S is fixed in the body, so that it changes by v x S. */
static void move(const body *before, double qd, double qdd, body *out) {
    double change[6] = {0.0};
    for (int k = 0; k < 6; k++) out->v[k] = before->v[k] + out->S[k] * qd;
    add_cross(out->v + 3, out->S, change);
    add_cross(out->v, out->S + 3, change);
    add_cross(out->v + 3, out->S + 3, change + 3);
    for (int k = 0; k < 6; k++) out->a[k] = before->a[k] + out->S[k] * qdd + change[k] * qd;
}

/* Links at the present state; qdd may be NULL for none. */
static void follow(const links *l, const double *qdd, const body *base, body *out) {
    for (int i = 0; i < l->n; i++) {
        const body *const before = i ? &out[i - 1] : base;
        place(before, &l->chain.joint[i], l->q[i], &out[i]);
        move(before, l->qd[i], qdd ? qdd[i] : 0.0, &out[i]);
    }
}

/* Inertia of a body about the origin of the base: R I R^T, and Steiner's part. */
static spatial inertia(const body *b, const serial_joint *joint) {
    spatial s = {.mass = joint->mass};
    double c[3], RI[9], turned[9];
    const double *const R = b->R;
    rotate(R, joint->centre, c);
    for (int k = 0; k < 3; k++) c[k] += b->p[k], s.moment[k] = s.mass * c[k];
    multiply(R, joint->inertia, RI);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j <= i; j++) turned[3 * i + j] = dot(3, RI + 3 * i, R + 3 * j);
    const double square = dot(3, s.moment, c);
    for (int k = 0; k < 3; k++) s.inertia[k] = turned[4 * k] + square - s.moment[k] * c[k];
    s.inertia[3] = turned[3] - s.moment[0] * c[1];
    s.inertia[4] = turned[6] - s.moment[0] * c[2];
    s.inertia[5] = turned[7] - s.moment[1] * c[2];
    return s;
}

static void add(const spatial *more, spatial *sum) {
    sum->mass += more->mass;
    for (int k = 0; k < 3; k++) sum->moment[k] += more->moment[k];
    for (int k = 0; k < 6; k++) sum->inertia[k] += more->inertia[k];
}

/* Momentum of a twist, or force of an acceleration. */
static void apply(const spatial *s, const double *v, double *out) {
    const double *const I = s->inertia, *const w = v + 3;
    for (int k = 0; k < 3; k++) out[k] = s->mass * v[k];
    add_cross(w, s->moment, out);
    out[3] = I[0] * w[0] + I[3] * w[1] + I[4] * w[2];
    out[4] = I[3] * w[0] + I[1] * w[1] + I[5] * w[2];
    out[5] = I[4] * w[0] + I[5] * w[1] + I[2] * w[2];
    add_cross(s->moment, v, out + 3);
}

void links_inertia(const links *l, double *M, double *bias) {
    const int n = l->n;
    body bodies[SERIAL_MAX_JOINTS];
    body base = {.R = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    for (int k = 0; k < 3; k++) base.a[k] = -l->gravity[k];
    follow(l, NULL, &base, bodies);
    spatial carried = {0};
    double force[6] = {0.0};
    for (int i = n - 1; i >= 0; i--) {
        const body *const b = &bodies[i];
        const spatial own = inertia(b, &l->chain.joint[i]);
        double momentum[6], own_force[6], response[6];
        apply(&own, b->v, momentum);
        apply(&own, b->a, own_force);
        add_cross(b->v + 3, momentum, own_force);
        add_cross(b->v + 3, momentum + 3, own_force + 3);
        add_cross(b->v, momentum, own_force + 3);
        for (int k = 0; k < 6; k++) force[k] += own_force[k];
        bias[i] = dot(6, b->S, force);
        add(&own, &carried);
        apply(&carried, b->S, response);
        for (int j = 0; j <= i; j++) M[n * j + i] = dot(6, bodies[j].S, response);
        M[n * i + i] += l->armature[i];
    }
}

/* The frame's pose and Jacobian. */
static void attach(const links *l, const body *bodies, double *x) {
    const int n = l->n;
    const body *const carrier = &bodies[l->joint];
    rotate(carrier->R, l->t, x);
    for (int k = 0; k < 3; k++) l->position[k] = x[k] += carrier->p[k];
    multiply(carrier->R, l->R, l->rotation);
    for (int i = 0; i < n; i++) {
        double column[6] = {0.0};
        if (i <= l->joint) {
            memcpy(column, bodies[i].S, sizeof column);
            add_cross(column + 3, x, column);
        }
        for (int k = 0; k < 6; k++) l->J[n * k + i] = column[k];
    }
}

/* inverse = M^-1 from M = L L^T, of which the upper triangle is given; 0, or -1 if M is not positive
 * definite. */
static int invert(int n, double *M, double *inverse) {
    double L[SERIAL_MAX_JOINTS * SERIAL_MAX_JOINTS];
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++) {
            const double rest = M[n * j + i] - dot(j, L + n * i, L + n * j);
            if (i == j && !(rest > 0.0)) return -1;
            L[n * i + j] = i == j ? sqrt(rest) : rest / L[n * j + j];
        }
    }
    for (int j = 0; j < n; j++) {
        for (int i = j; i < n; i++) {
            double sum = i == j ? 1.0 : 0.0;
            for (int k = j; k < i; k++) sum -= L[n * i + k] * M[n * k + j];
            M[n * i + j] =
                sum / L[n * i + i]; /* L^-1, in the lower triangle, whose diagonal was used already */
        }
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = 0.0;
            for (int k = i; k < n; k++) sum += M[n * k + i] * M[n * k + j];
            inverse[n * i + j] = inverse[n * j + i] = sum;
        }
    }
    return 0;
}

int links_accelerate(const links *l) {
    const int n = l->n;
    double M[SERIAL_MAX_JOINTS * SERIAL_MAX_JOINTS], rest[SERIAL_MAX_JOINTS];
    links_inertia(l, M, rest);
    for (int i = 0; i < n; i++) rest[i] = l->load[i] - rest[i];
    if (invert(n, M, l->inverse) < 0) return -1;
    for (int i = 0; i < n; i++) l->qdd[i] = dot(n, l->inverse + n * i, rest);
    return 0;
}

void links_observe(const links *l) {
    static const body BASE = {.R = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    body bodies[SERIAL_MAX_JOINTS];
    double x[3];
    follow(l, l->qdd, &BASE, bodies);
    attach(l, bodies, x);
    const body *const b = &bodies[l->joint];
    memcpy(l->twist, b->v, sizeof b->v);
    memcpy(l->acceleration, b->a, sizeof b->a);
    add_cross(b->v + 3, x, l->twist);
    add_cross(b->a + 3, x, l->acceleration);
    add_cross(b->v + 3, l->twist, l->acceleration); /* of the point, not of what is at the origin */
}
