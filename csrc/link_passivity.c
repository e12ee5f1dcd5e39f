#include "link_passivity.h"
#include "rotation.h"

#include <math.h>
#include <string.h>

static const double STILL = 1e-12; /* below this a square of a speed or a wrench has no direction */

static void to_palm(const double *R, const double *v, double *out) {
    for (int i = 0; i < 3; i++) {
        out[i] = R[i] * v[0] + R[3 + i] * v[1] + R[6 + i] * v[2];
        out[3 + i] = R[i] * v[3] + R[3 + i] * v[4] + R[6 + i] * v[5];
    }
}

static void to_station(const double *R, const double *v, double *out) {
    for (int i = 0; i < 3; i++) {
        out[i] = R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2];
        out[3 + i] = R[3 * i] * v[3] + R[3 * i + 1] * v[4] + R[3 * i + 2] * v[5];
    }
}

static double power(const double *wrench, const double *twist) {
    double sum = 0.0;
    for (int k = 0; k < 6; k++) sum += wrench[k] * twist[k];
    return sum;
}

static void restart(energy_tank *t) {
    t->level = t->begin;
    t->sent = t->received = t->taken = t->spilt = t->damping = 0.0;
    t->why = 0;
}

/* Take what was granted, hand over what is beyond what is kept, let the rest over the rim. */
static void trade(energy_tank *t, double granted) {
    t->why = 0;
    t->damping = 0.0;
    if (granted > t->received) {
        t->level += granted - t->received;
        t->received = granted;
    }
    const double spare = t->level - t->keep;
    if (spare > 0.0) {
        const double share = spare * fmin(1.0, t->grant * t->dt);
        t->level -= share;
        t->sent += share;
    }
    if (t->level > t->most) {
        t->spilt += t->level - t->most;
        t->level = t->most;
    }
}

void operator_port_reset(operator_port *p) {
    restart(&p->tank);
    memset(p->felt, 0, 6 * sizeof(double));
    memset(p->before, 0, sizeof p->before);
}

void operator_port_update(operator_port *p, double granted) {
    energy_tank *t = &p->tank;
    double v[6], along[6], square = 0.0;
    to_palm(p->rotation, p->twist, v);
    /* what the last tick did, now that its motion is known */
    t->level -= 0.5 * t->dt * (power(p->felt, v) + power(p->felt, p->before));
    memcpy(p->before, v, sizeof v);
    trade(t, granted);
    for (int k = 0; k < 6; k++) {
        along[k] = k < 3 ? v[k] : t->radius * t->radius * v[k];
        square += along[k] * v[k];
        p->felt[k] = p->wrench[k];
    }
    const double lack = (p->fill - t->level) / (p->fill - t->keep);
    if (lack > 0.0 && square > STILL) {
        t->why = PASSIVITY_FILLS;
        t->damping = p->harvest * fmin(1.0, lack);
        for (int k = 0; k < 6; k++) p->felt[k] -= t->damping * along[k];
    }
    const double out = power(p->felt, v), allowed = t->rate * t->level;
    if (out <= allowed || square < STILL) {
        t->taken += t->dt * t->damping * square;
        return;
    }
    const double most = fmax(out, 0.0) + p->most_damping * square;
    const double more = fmin(out - allowed, most) / square;
    t->damping += more;
    t->why |= PASSIVITY_EMPTY | (t->level < 0.0 ? PASSIVITY_DEBT : 0);
    for (int k = 0; k < 6; k++) p->felt[k] -= more * along[k];
    t->taken += t->dt * t->damping * square;
}

/* Rotation vector from A to B in the station's axes: log(B A^T). */
static void turned(const double *A, const double *B, double *vector) {
    double R[9];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            R[3 * i + j] = B[3 * i] * A[3 * j] + B[3 * i + 1] * A[3 * j + 1] + B[3 * i + 2] * A[3 * j + 2];
    rotation_log(R, vector);
}

/* From one pose to another, (translation, rotation). */
static void difference(const double *p, const double *R, const double *to, const double *R_to, double *step) {
    for (int k = 0; k < 3; k++) step[k] = to[k] - p[k];
    turned(R, R_to, step + 3);
}

static void advance(avatar_port *p, const double *step) {
    double turn[9], before[9];
    for (int k = 0; k < 3; k++) p->reference[k] += step[k];
    rotation_exp(step + 3, turn);
    memcpy(before, p->reference_rotation, sizeof before);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            p->reference_rotation[3 * i + j] =
                turn[3 * i] * before[j] + turn[3 * i + 1] * before[3 + j] + turn[3 * i + 2] * before[6 + j];
}

static void measure_drift(avatar_port *p) {
    difference(p->reference, p->reference_rotation, p->position, p->orientation, p->drift);
}

/* Add what brings the reference back, no faster than it may. */
static void come_back(const avatar_port *p, double *step) {
    const double part = fmin(1.0, p->tank.dt / p->return_time);
    for (int half = 0; half < 6; half += 3) {
        const double *d = p->drift + half;
        const double far = part * sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        const double most = p->tank.dt * (half ? p->turn : p->speed);
        const double share = part * (far > most ? most / far : 1.0);
        for (int k = 0; k < 3; k++) step[half + k] += share * d[k];
    }
}

void avatar_port_reset(avatar_port *p) {
    restart(&p->tank);
    memcpy(p->reference, p->position, 3 * sizeof(double));
    memcpy(p->reference_rotation, p->orientation, 9 * sizeof(double));
    memcpy(p->last, p->position, sizeof p->last);
    memcpy(p->last_rotation, p->orientation, sizeof p->last_rotation);
    memset(p->drift, 0, 6 * sizeof(double));
    p->stored = 0.0;
}

void avatar_port_update(avatar_port *p, double granted) {
    energy_tank *t = &p->tank;
    double F[6], step[6], stored = 0.0, square = 0.0;
    to_station(p->rotation, p->felt, F);
    for (int k = 0; k < 6; k++) {
        stored += 0.5 * F[k] * F[k] / p->stiffness[k];
        square += F[k] * F[k] / (k < 3 ? 1.0 : t->radius * t->radius);
    }
    t->level += t->dt * power(F, p->twist) + p->stored - stored;
    p->stored = stored;
    trade(t, granted);
    difference(p->last, p->last_rotation, p->position, p->orientation, step);
    come_back(p, step);
    const double out = -power(F, step) / t->dt;
    const double allowed = fmax(t->rate * t->level, -p->retreat * sqrt(square));
    if (out > allowed && square > STILL) {
        t->damping = (out - allowed) / square;
        t->taken += t->dt * (out - allowed);
        t->why = PASSIVITY_EMPTY | (t->level < 0.0 ? PASSIVITY_DEBT : 0);
        for (int k = 0; k < 6; k++)
            step[k] += t->dt * t->damping * F[k] / (k < 3 ? 1.0 : t->radius * t->radius);
    }
    advance(p, step);
    memcpy(p->last, p->position, sizeof p->last);
    memcpy(p->last_rotation, p->orientation, sizeof p->last_rotation);
    measure_drift(p);
    if (p->drift[0] * p->drift[0] + p->drift[1] * p->drift[1] + p->drift[2] * p->drift[2] > 1e-6)
        t->why |= PASSIVITY_DRIFT;
}
