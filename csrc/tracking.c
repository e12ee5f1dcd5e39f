#include "tracking.h"
#include "serial.h"

#include <math.h>

/* Of what the drives are admitted, as much is planned with: rounding must not pass it. */
static const double PLANNED = 0.99, NOTHING = 1e-6, SPARED = 0.25;
/* Three such time constants in a row stand against the noise of the force-torque sensor [s]. */
static const double SMOOTH = 7e-3 / 3;
/* What the age of the measured wrench and the filter's delay leave to be foretold of a spring's torque [s].
 */
static const double AHEAD = 2e-3;

/* Stiffness and load of the springs are not known better than that, the latter as a share of a drive's
 * torque. */
static const double MISJUDGED = 1.4, UNSEEN = 0.02;

/* What goes through a joint's spring, or through what is in its place. */
static double carried(const tracking *t, int i) {
    return isinf(t->stiffness[i]) ? t->sensed[i] : t->stiffness[i] * (t->motor[i] - t->link[i]);
}

/* Direction of the commanded motion, smooth through rest. The measured speed would set it, and with it the
 * motor, swinging about 0. */
static double direction(const tracking *t, int i) {
    return t->qd[i] / sqrt(t->qd[i] * t->qd[i] + t->slow[i] * t->slow[i]);
}

static double without_wrench(const tracking *t, int i) {
    return t->rigid[i] + t->friction[i] * t->qd[i] + t->bearing[i] * direction(t, i);
}

/* What the gear takes before the spring. Its load is that of the last tick behind the filter: known before
 * qdd is chosen, and without the noise of the wrench. */
static double in_gear(const tracking *t, int i) {
    const double load = t->smoothed[TRACKING_STAGES * i + TRACKING_STAGES - 1];
    /* once a wrench was no number, the filter is none until the next start; a stop must not be */
    const double dry = t->gear[i] + (isfinite(load) ? t->load_share[i] * fabs(load) : 0.0);
    return dry * direction(t, i) + t->gear_damping[i] * t->qd[i];
}

/* Of J^T w what the spring shows. */
static double confirmed(const tracking *t, int i, double pull) {
    const double shown = pull < 0.0 ? -t->shown[i] : t->shown[i];
    const double most = fmax(0.0, MISJUDGED * shown + UNSEEN * t->most_torque[i]);
    return fmin(fmax(pull, -most), most);
}

/* J^T w. */
static double pulled(const tracking *t, int i) {
    double pull = 0.0;
    for (int k = 0; k < 6; k++) pull += t->J[t->n * k + i] * t->wrench[k];
    return pull;
}

/* A joint that swings shows now more, now less than the hand pulls: what is cut must be worth the name. */
int tracking_contradicted(const tracking *t) {
    for (int i = 0; i < t->n; i++) {
        const double pull = pulled(t, i), cut = fabs(pull - confirmed(t, i, pull));
        if (!(cut <= UNSEEN * t->most_torque[i])) return 1;
    }
    return 0;
}

/* Spring torque that the link side needs: rigid body + friction - J^T w. */
static double through_spring(const tracking *t, int i) {
    const double pull = pulled(t, i);
    return without_wrench(t, i) - (t->doubted ? confirmed(t, i, pull) : pull);
}

/* What the deviation of the measured motor from the reference of the last tick adds. */
static double fed_back(const tracking *t, int i) {
    return t->p[i] * (t->reference[i] - t->motor[i]) + t->d[i] * (t->rate[i] - t->motor_rate[i]);
}

/* What the motor's damping takes while the spring yields: a motor that follows is faster than its link then,
 * and is braked for it. */
static double braked(const tracking *t, int i) {
    return isfinite(t->slope[i]) ? t->d[i] * t->slope[i] / t->stiffness[i] : 0.0;
}

/* How the spring's torque changes, and how that changes: of the torque after three low-passes. */
static void differentiate(const tracking *t, int i, double spring, int fresh) {
    double *const stage = t->smoothed + TRACKING_STAGES * i, *const last = stage + TRACKING_STAGES - 1;
    const double share = fresh ? 1.0 : t->dt / (t->dt + SMOOTH), before = fresh ? spring : *last;
    double x = spring;
    for (int k = 0; k < TRACKING_STAGES; k++) x = stage[k] += share * (x - stage[k]);
    const double slope = (x - before) / t->dt;
    t->curve[i] = fresh ? 0.0 : (slope - t->slope[i]) / t->dt;
    t->slope[i] = slope;
}

/* The motor's reference is ahead of the link's by what the spring yields. */
static void refer(const tracking *t, int i, double spring, int fresh) {
    differentiate(t, i, spring, fresh);
    t->reference[i] = t->q[i] + spring / t->stiffness[i];
    t->rate[i] = t->qd[i];
}

/* What the yielding of the spring asks of the rotor and of the damped motor, and what it will carry, as far
 * as there is torque to spare on both sides: where the plan is all that a motor has, the hierarchy changes it
 * with the feedback, the spring's torque changes with the plan, and what that asks, in either direction,
 * would drive the feedback. */
static double for_yielding(const tracking *t, int i, double planned) {
    const double spare = SPARED * t->most_torque[i];
    const double room = fmin(t->most[i] - planned, planned - t->least[i]);
    const double allowed = fmax(0.0, fmin(spare, 0.5 * room));
    if (isinf(t->stiffness[i])) return 0.0;
    const double rotor = t->rotor[i] * t->curve[i], damper = t->d[i] * t->slope[i];
    const double asked = (rotor + damper) / t->stiffness[i] + AHEAD * t->slope[i];
    return fmin(fmax(asked, -allowed), allowed);
}

/* A base that only translates acts like gravity. */
static void carry(const tracking *t, const double *base, double *gravity) {
    gravity[0] = t->still[0] - base[0], gravity[1] = t->still[1] - base[1], gravity[2] = t->still[2];
}

void tracking_forecast(const tracking *t, const double *base, int fresh) {
    const int n = t->n;
    double gravity[3];
    carry(t, base, gravity);
    serial_dynamics(t->chain, t->q, t->qd, gravity, t->rigid, t->inertia);
    for (int i = 0; i < n; i++) {
        const double load = through_spring(t, i);
        if (fresh) refer(t, i, load, fresh);
        t->load[i] = load + in_gear(t, i);
        t->feedback[i] = fed_back(t, i);
        t->strain[i] = t->feedback[i] + braked(t, i);
        t->inertia[(n + 1) * i] += t->rotor[i];
        /* power is what drives: a motor may brake with all it has; rounding must not lead further out either
         */
        const double power = t->most_power[i], rate = t->motor_rate[i], all = PLANNED * t->most_torque[i];
        const double up = rate > 0.0 ? fmin(all, PLANNED * power / rate) : all;
        const double down = rate < 0.0 ? fmin(all, PLANNED * power / -rate) : all;
        t->most[i] = t->link[i] <= t->upper[i] ? up : -NOTHING * all;
        t->least[i] = t->link[i] >= t->lower[i] ? -down : NOTHING * all;
    }
}

void tracking_update(const tracking *t, const double *base, int fresh, int planned) {
    double gravity[3];
    carry(t, base, gravity);
    serial_torques(t->chain, t->q, t->qd, t->qdd, gravity, t->rigid);
    for (int i = 0; i < t->n; i++) {
        const double spring = through_spring(t, i);
        if (fresh) refer(t, i, spring, fresh);
        const double torque = t->rotor[i] * t->qdd[i] + spring + in_gear(t, i) + fed_back(t, i);
        t->torque[i] = torque + (planned ? for_yielding(t, i, torque) : 0.0);
        refer(t, i, spring, 0);
        t->shown[i] = without_wrench(t, i) - carried(t, i);
    }
}

static void rotate(const double *R, const double *v, double *out) {
    for (int i = 0; i < 3; i++) out[i] = R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2];
}

static void add_cross(const double *a, const double *b, double *out) {
    out[0] += a[1] * b[2] - a[2] * b[1];
    out[1] += a[2] * b[0] - a[0] * b[2];
    out[2] += a[0] * b[1] - a[1] * b[0];
}

void tracking_wrench(const tracking_tool *t) {
    const double *const R = t->R_sensor, *const a = t->specific_force;
    double felt[6], *const force = felt, *const torque = felt + 3, weight[3], at_handle[3];
    /* m (a - g) in the sensor's frame is what the tool's weight and inertia take from the reading */
    for (int i = 0; i < 3; i++) weight[i] = t->mass * (R[i] * a[0] + R[3 + i] * a[1] + R[6 + i] * a[2]);
    for (int i = 0; i < 3; i++) {
        force[i] = t->measured[i] - t->bias[i] + weight[i];
        torque[i] = t->measured[3 + i] - t->bias[3 + i];
    }
    add_cross(t->centre, weight, torque);
    drift_remove(t->drift, felt);
    rotate(R, force, at_handle);
    rotate(t->R_handle, at_handle, t->wrench);
    rotate(R, torque, weight);
    add_cross(t->arm, at_handle, weight);
    rotate(t->R_handle, weight, t->wrench + 3);
}
