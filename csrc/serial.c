#include "serial.h"
#include "rotation.h"

#include <string.h>

/* A joint's frame in the axes of the base, and what no acceleration of the joints changes of its motion. */
typedef struct {
    double R[9], p[3], z[3], r[3]; /* pose, axis of the joint, way from the frame before */
    double omega[3];               /* angular velocity */
    double towards[3];             /* omega x (omega x r) of the frame before */
    double turning[3]; /* of the joint's axis: part of alpha, or Coriolis acceleration of a slide */
} body;

/* Accelerations of a frame in several motions at once, side by side: angular, and of its origin. */
enum { TOGETHER = 2 };
typedef struct {
    double alpha[3][TOGETHER], a[3][TOGETHER];
} accelerations;

static const body BASE = {.R = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
static const accelerations STILL;

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

static void cross(const double *a, const double *b, double *out) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* omega x (omega x r). */
static void towards_axis(const double *omega, const double *r, double *out) {
    double v[3] = {0.0, 0.0, 0.0};
    add_cross(1.0, omega, r, v);
    cross(omega, v, out);
}

/* The pose of the next frame, its joint at q. */
static void put(const body *before, const serial_joint *joint, double q, body *b) {
    double R[9], turn[3], motion[9];
    multiply(before->R, joint->R, R);
    rotate(R, joint->axis, b->z);
    rotate(before->R, joint->t, b->r);
    if (joint->prismatic) {
        memcpy(b->R, R, sizeof R);
        for (int k = 0; k < 3; k++) b->r[k] += q * b->z[k];
    } else {
        for (int k = 0; k < 3; k++) turn[k] = q * joint->axis[k];
        rotation_exp(turn, motion);
        multiply(R, motion, b->R);
    }
    for (int k = 0; k < 3; k++) b->p[k] = before->p[k] + b->r[k];
}

/* The motion of the next frame, its joint moving with qd. */
static void set_rate(const body *before, const serial_joint *joint, double qd, body *b) {
    const double rate = joint->prismatic ? 2.0 * qd : qd;
    towards_axis(before->omega, b->r, b->towards);
    cross(before->omega, b->z, b->turning);
    for (int k = 0; k < 3; k++) b->turning[k] *= rate, b->omega[k] = before->omega[k];
    if (!joint->prismatic)
        for (int k = 0; k < 3; k++) b->omega[k] += qd * b->z[k];
}

static void put_all(const serial_chain *chain, const double *q, body *bodies) {
    for (int i = 0; i < chain->n; i++) put(i ? &bodies[i - 1] : &BASE, &chain->joint[i], q[i], &bodies[i]);
}

static void turn_all(const serial_chain *chain, const double *qd, body *bodies) {
    for (int i = 0; i < chain->n; i++)
        set_rate(i ? &bodies[i - 1] : &BASE, &chain->joint[i], qd[i], &bodies[i]);
}

/* a += alpha x r + towards. */
static void move_point(const accelerations *of, const double *r, const double *towards,
                       double a[3][TOGETHER]) {
    for (int k = 0; k < 3; k++) {
        const int next = (k + 1) % 3, last = (k + 2) % 3;
        for (int l = 0; l < TOGETHER; l++)
            a[k][l] =
                of->a[k][l] + (of->alpha[next][l] * r[last] - of->alpha[last][l] * r[next]) + towards[k];
    }
}

/* Accelerations of the next frame, its joint accelerating with qdd. */
static void accelerate(const accelerations *before, const serial_joint *joint, const body *b,
                       const double *qdd, accelerations *now) {
    move_point(before, b->r, b->towards, now->a);
    memcpy(now->alpha, before->alpha, sizeof now->alpha);
    double (*const along)[TOGETHER] = joint->prismatic ? now->a : now->alpha;
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < TOGETHER; l++) along[k][l] = along[k][l] + b->turning[k] + qdd[l] * b->z[k];
}

static void write_frame(const serial_chain *chain, const body *bodies, const serial_frame *frame) {
    const int n = chain->n;
    const body *carrier = &bodies[frame->joint];
    double r[3];
    rotate(carrier->R, frame->t, r);
    multiply(carrier->R, frame->R, frame->rotation);
    for (int k = 0; k < 3; k++) frame->position[k] = carrier->p[k] + r[k];
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

static void write_drift(const body *carrier, const accelerations *moved, const serial_frame *frame) {
    double r[3], towards[3], a[3][TOGETHER];
    rotate(carrier->R, frame->t, r);
    towards_axis(carrier->omega, r, towards);
    move_point(moved, r, towards, a);
    for (int k = 0; k < 3; k++) {
        frame->drift[k] = a[k][0];
        frame->drift[3 + k] = moved->alpha[k][0];
    }
}

static void write_drifts(const serial_chain *chain, const double *qd, body *bodies,
                         const serial_frame *frames, int count) {
    static const double NONE[TOGETHER];
    accelerations moved[SERIAL_MAX_JOINTS];
    turn_all(chain, qd, bodies);
    for (int i = 0; i < chain->n; i++)
        accelerate(i ? &moved[i - 1] : &STILL, &chain->joint[i], &bodies[i], NONE, &moved[i]);
    for (int i = 0; i < count; i++)
        write_drift(&bodies[frames[i].joint], &moved[frames[i].joint], &frames[i]);
}

void serial_frames(const serial_chain *chain, const double *q, const double *qd, const serial_frame *frames,
                   int count) {
    body bodies[SERIAL_MAX_JOINTS];
    put_all(chain, q, bodies);
    for (int i = 0; i < count; i++) {
        write_frame(chain, bodies, &frames[i]);
        if (!qd) memset(frames[i].drift, 0, 6 * sizeof(double));
    }
    if (qd) write_drifts(chain, qd, bodies, frames, count);
}

void serial_places(const serial_chain *chain, const double *q, double *R, double *p) {
    body bodies[SERIAL_MAX_JOINTS];
    put_all(chain, q, bodies);
    for (int i = 0; i < chain->n; i++) {
        memcpy(R + 9 * i, bodies[i].R, sizeof bodies[i].R);
        memcpy(p + 3 * i, bodies[i].p, sizeof bodies[i].p);
    }
}

/* What a body's mass and inertia do at its motion. */
typedef struct {
    double centre[3], towards[3]; /* of mass, from the frame's origin, and omega x (omega x centre) */
    double gyroscopic[3];         /* omega x I omega */
} mass;

static void weigh(const body *b, const serial_joint *joint, mass *m) {
    double local[3], spin[3], momentum[3];
    rotate(b->R, joint->centre, m->centre);
    towards_axis(b->omega, m->centre, m->towards);
    rotate_back(b->R, b->omega, local);
    rotate(joint->inertia, local, spin);
    rotate(b->R, spin, momentum);
    cross(b->omega, momentum, m->gyroscopic);
}

static void rotate_together(const double *R, int row, int column, double v[3][TOGETHER],
                            double out[3][TOGETHER]) {
    for (int i = 0; i < 3; i++)
        for (int l = 0; l < TOGETHER; l++)
            out[i][l] =
                R[row * i] * v[0][l] + R[row * i + column] * v[1][l] + R[row * i + 2 * column] * v[2][l];
}

/* out += a x v. */
static void add_moments(const double *a, double v[3][TOGETHER], double out[3][TOGETHER]) {
    for (int k = 0; k < 3; k++) {
        const int next = (k + 1) % 3, last = (k + 2) % 3;
        for (int l = 0; l < TOGETHER; l++) out[k][l] += a[next] * v[last][l] - a[last] * v[next][l];
    }
}

/* Force and moment about its own origin that a body needs for its motion. */
static void inertial(const body *b, const serial_joint *joint, const mass *m, accelerations *moved,
                     double force[3][TOGETHER], double moment[3][TOGETHER]) {
    double a[3][TOGETHER], local[3][TOGETHER], spin[3][TOGETHER];
    move_point(moved, m->centre, m->towards, a);
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < TOGETHER; l++) force[k][l] = joint->mass * a[k][l], moment[k][l] = 0.0;
    add_moments(m->centre, force, moment);
    rotate_together(b->R, 1, 3, moved->alpha, local);
    rotate_together(joint->inertia, 3, 1, local, spin);
    rotate_together(b->R, 3, 1, spin, local);
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < TOGETHER; l++) moment[k][l] = moment[k][l] + local[k][l] + m->gyroscopic[k];
}

/* tau of several motions that differ in their accelerations qdd alone. */
static void torques(const serial_chain *chain, const body *bodies, const mass *masses,
                    const accelerations *base, double qdd[][TOGETHER], double tau[][TOGETHER]) {
    const int n = chain->n;
    accelerations moved[SERIAL_MAX_JOINTS];
    for (int i = 0; i < n; i++)
        accelerate(i ? &moved[i - 1] : base, &chain->joint[i], &bodies[i], qdd[i], &moved[i]);
    double force[3][TOGETHER] = {{0.0}}, moment[3][TOGETHER] = {{0.0}};
    for (int i = n - 1; i >= 0; i--) {
        double own_force[3][TOGETHER], own_moment[3][TOGETHER], arm[3];
        inertial(&bodies[i], &chain->joint[i], &masses[i], &moved[i], own_force, own_moment);
        if (i + 1 < n) { /* what the next body passes on acts at its origin */
            for (int k = 0; k < 3; k++) arm[k] = bodies[i + 1].p[k] - bodies[i].p[k];
            add_moments(arm, force, moment);
        }
        for (int k = 0; k < 3; k++)
            for (int l = 0; l < TOGETHER; l++)
                force[k][l] += own_force[k][l], moment[k][l] += own_moment[k][l];
        double (*const load)[TOGETHER] = chain->joint[i].prismatic ? force : moment;
        const double *const z = bodies[i].z;
        for (int l = 0; l < TOGETHER; l++)
            tau[i][l] = z[0] * load[0][l] + z[1] * load[1][l] + z[2] * load[2][l];
    }
}

static void weigh_all(const serial_chain *chain, const body *bodies, mass *masses) {
    for (int i = 0; i < chain->n; i++) weigh(&bodies[i], &chain->joint[i], &masses[i]);
}

/* At qd, with the poses of the bodies. */
static void torques_at(const serial_chain *chain, body *bodies, const double *qd, const double *qdd,
                       const double *gravity, double *tau) {
    mass masses[SERIAL_MAX_JOINTS];
    accelerations base = STILL;
    double both[SERIAL_MAX_JOINTS][TOGETHER], found[SERIAL_MAX_JOINTS][TOGETHER];
    turn_all(chain, qd, bodies);
    weigh_all(chain, bodies, masses);
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < TOGETHER; l++) base.a[k][l] = -gravity[k];
    for (int i = 0; i < chain->n; i++)
        for (int l = 0; l < TOGETHER; l++) both[i][l] = qdd[i];
    torques(chain, bodies, masses, &base, both, found);
    for (int i = 0; i < chain->n; i++) tau[i] = found[i][0];
}

/* The torques of unit accelerations at rest without gravity, as many as fit together at a time. */
static void inertia_at(const serial_chain *chain, body *bodies, double *M) {
    static const double NONE[SERIAL_MAX_JOINTS];
    const int n = chain->n;
    mass masses[SERIAL_MAX_JOINTS];
    accelerations base = STILL;
    turn_all(chain, NONE, bodies);
    weigh_all(chain, bodies, masses);
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < TOGETHER; l++) base.a[k][l] = -NONE[k];
    for (int i = 0; i < n; i += TOGETHER) { /* M is symmetric: column i is row i */
        double units[SERIAL_MAX_JOINTS][TOGETHER], found[SERIAL_MAX_JOINTS][TOGETHER];
        for (int j = 0; j < n; j++)
            for (int l = 0; l < TOGETHER; l++) units[j][l] = i + l == j;
        torques(chain, bodies, masses, &base, units, found);
        for (int l = 0; l < TOGETHER && i + l < n; l++)
            for (int j = 0; j < n; j++) M[n * (i + l) + j] = found[j][l];
    }
}

void serial_torques(const serial_chain *chain, const double *q, const double *qd, const double *qdd,
                    const double *gravity, double *tau) {
    body bodies[SERIAL_MAX_JOINTS];
    put_all(chain, q, bodies);
    torques_at(chain, bodies, qd, qdd, gravity, tau);
}

void serial_inertia(const serial_chain *chain, const double *q, double *M) {
    body bodies[SERIAL_MAX_JOINTS];
    put_all(chain, q, bodies);
    inertia_at(chain, bodies, M);
}

void serial_dynamics(const serial_chain *chain, const double *q, const double *qd, const double *gravity,
                     double *tau, double *M) {
    static const double NONE[SERIAL_MAX_JOINTS];
    body bodies[SERIAL_MAX_JOINTS];
    put_all(chain, q, bodies);
    torques_at(chain, bodies, qd, NONE, gravity, tau);
    inertia_at(chain, bodies, M);
}

void serial_advance(int n, double *q, double *qd, const double *qdd, double dt) {
    for (int i = 0; i < n; i++) {
        q[i] += dt * (qd[i] + 0.5 * dt * qdd[i]);
        qd[i] += dt * qdd[i];
    }
}
