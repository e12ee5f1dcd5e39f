#include "serial.h"
#include "rotation.h"

#include <string.h>

/* Motion of a joint's frame: pose, axis, twist and acceleration of its origin, in the axes of the base. */
typedef struct {
    double R[9], p[3], z[3];
    double omega[3], alpha[3], a[3];
} body;

static const body BASE = {.R = {1, 0, 0, 0, 1, 0, 0, 0, 1}};

static void multiply(const double *A, const double *B, double *C) {
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

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

/* Acceleration of a point r away from the origin of a body: a + alpha x r + omega x (omega x r). */
static void at_point(const body *b, const double *r, double *a) {
    double v[3] = {0.0, 0.0, 0.0};
    memcpy(a, b->a, sizeof b->a);
    add_cross(1.0, b->alpha, r, a);
    add_cross(1.0, b->omega, r, v);
    add_cross(1.0, b->omega, v, a);
}

/* The next body: its joint at q, qd, qdd. */
static body follow(const body *before, const serial_joint *joint, double q, double qd, double qdd) {
    body b;
    double R[9], r[3], turn[3], motion[9];
    multiply(before->R, joint->R, R);
    rotate(R, joint->axis, b.z);
    rotate(before->R, joint->t, r);
    memcpy(b.omega, before->omega, sizeof b.omega);
    memcpy(b.alpha, before->alpha, sizeof b.alpha);
    if (joint->prismatic) {
        memcpy(b.R, R, sizeof R);
        for (int k = 0; k < 3; k++) r[k] += q * b.z[k];
        at_point(before, r, b.a);
        add_cross(2.0 * qd, b.omega, b.z, b.a); /* Coriolis */
        for (int k = 0; k < 3; k++) b.a[k] += qdd * b.z[k];
    } else {
        for (int k = 0; k < 3; k++) turn[k] = q * joint->axis[k];
        rotation_exp(turn, motion);
        multiply(R, motion, b.R);
        at_point(before, r, b.a);
        add_cross(qd, before->omega, b.z, b.alpha);
        for (int k = 0; k < 3; k++) b.omega[k] += qd * b.z[k], b.alpha[k] += qdd * b.z[k];
    }
    for (int k = 0; k < 3; k++) b.p[k] = before->p[k] + r[k];
    return b;
}

static void write_frame(const serial_chain *chain, const body *bodies, const serial_frame *frame) {
    const int n = chain->n;
    const body *carrier = &bodies[frame->joint];
    double r[3];
    rotate(carrier->R, frame->t, r);
    multiply(carrier->R, frame->R, frame->rotation);
    for (int k = 0; k < 3; k++) frame->position[k] = carrier->p[k] + r[k];
    at_point(carrier, r, frame->drift);
    memcpy(frame->drift + 3, carrier->alpha, sizeof carrier->alpha);
    for (int i = 0; i < n; i++) {
        double column[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
        if (i <= frame->joint && chain->joint[i].prismatic) {
            memcpy(column, bodies[i].z, sizeof bodies[i].z);
        } else if (i <= frame->joint) {
            double arm[3];
            for (int k = 0; k < 3; k++) arm[k] = frame->position[k] - bodies[i].p[k];
            add_cross(1.0, bodies[i].z, arm, column);
            memcpy(column + 3, bodies[i].z, sizeof bodies[i].z);
        }
        for (int k = 0; k < 6; k++) frame->J[n * k + i] = column[k];
    }
}

void serial_frames(const serial_chain *chain, const double *q, const double *qd, const serial_frame *frames,
                   int count) {
    body bodies[SERIAL_MAX_JOINTS];
    for (int i = 0; i < chain->n; i++)
        bodies[i] = follow(i ? &bodies[i - 1] : &BASE, &chain->joint[i], q[i], qd[i], 0.0);
    for (int i = 0; i < count; i++) write_frame(chain, bodies, &frames[i]);
}

void serial_places(const serial_chain *chain, const double *q, double *R, double *p) {
    body b = BASE;
    for (int i = 0; i < chain->n; i++) {
        b = follow(&b, &chain->joint[i], q[i], 0.0, 0.0);
        memcpy(R + 9 * i, b.R, sizeof b.R);
        memcpy(p + 3 * i, b.p, sizeof b.p);
    }
}

/* Force and moment about its own origin that a body needs for its motion. */
static void inertial(const body *b, const serial_joint *joint, double *force, double *moment) {
    double centre[3], a[3], local[3], spin[3], momentum[3];
    rotate(b->R, joint->centre, centre);
    at_point(b, centre, a);
    for (int k = 0; k < 3; k++) force[k] = joint->mass * a[k], moment[k] = 0.0;
    add_cross(1.0, centre, force, moment);
    rotate_back(b->R, b->alpha, local);
    rotate(joint->inertia, local, spin);
    rotate(b->R, spin, local);
    for (int k = 0; k < 3; k++) moment[k] += local[k];
    rotate_back(b->R, b->omega, local);
    rotate(joint->inertia, local, spin);
    rotate(b->R, spin, momentum);
    add_cross(1.0, b->omega, momentum, moment);
}

void serial_torques(const serial_chain *chain, const double *q, const double *qd, const double *qdd,
                    const double *gravity, double *tau) {
    const int n = chain->n;
    body bodies[SERIAL_MAX_JOINTS], base = BASE;
    for (int k = 0; k < 3; k++) base.a[k] = -gravity[k];
    for (int i = 0; i < n; i++)
        bodies[i] = follow(i ? &bodies[i - 1] : &base, &chain->joint[i], q[i], qd[i], qdd[i]);
    double force[3] = {0.0, 0.0, 0.0}, moment[3] = {0.0, 0.0, 0.0};
    for (int i = n - 1; i >= 0; i--) {
        double own_force[3], own_moment[3], arm[3];
        inertial(&bodies[i], &chain->joint[i], own_force, own_moment);
        if (i + 1 < n) { /* what the next body passes on acts at its origin */
            for (int k = 0; k < 3; k++) arm[k] = bodies[i + 1].p[k] - bodies[i].p[k];
            add_cross(1.0, arm, force, moment);
        }
        for (int k = 0; k < 3; k++) force[k] += own_force[k], moment[k] += own_moment[k];
        const double *load = chain->joint[i].prismatic ? force : moment;
        tau[i] = bodies[i].z[0] * load[0] + bodies[i].z[1] * load[1] + bodies[i].z[2] * load[2];
    }
}

void serial_inertia(const serial_chain *chain, const double *q, double *M) {
    static const double NONE[SERIAL_MAX_JOINTS];
    const int n = chain->n;
    for (int i = 0; i < n; i++) { /* M is symmetric: column i is row i */
        double unit[SERIAL_MAX_JOINTS] = {0.0};
        unit[i] = 1.0;
        serial_torques(chain, q, NONE, unit, NONE, M + n * i);
    }
}

void serial_advance(int n, double *q, double *qd, const double *qdd, double dt) {
    for (int i = 0; i < n; i++) {
        q[i] += dt * (qd[i] + 0.5 * dt * qdd[i]);
        qd[i] += dt * qdd[i];
    }
}
