#include "ppu.h"

#include <math.h>

void ppu_observe(ppu_observer *o, const double *position, const double *force) {
    for (int i = 0; i < 2; i++) {
        const double a = force[i] - o->bias[i];
        const double error = position[i] - (o->q[i] + o->dt * o->v[i]);
        o->q[i] += o->dt * o->v[i] + o->gain[0] * error;
        o->v[i] += o->dt * a + o->gain[1] * error;
        o->bias[i] -= o->gain[2] * error;
        o->q_now[i] = o->q[i] + o->dt * o->v[i];
        o->v_now[i] = o->v[i] + o->dt * a;
        o->a_now[i] = a;
    }
}

void ppu_reference(const ppu_positioning *p, const double *q, const double *q_ppu, double *target) {
    const double first = q[0], second = q[0] + q[1];
    const double best_second = second + q[2] - p->best_angle[1];
    const double best_first = best_second - p->best_angle[0];
    target[0] = q_ppu[0] + p->link[0] * (cos(first) - cos(best_first)) +
                p->link[1] * (cos(second) - cos(best_second));
    target[1] = q_ppu[1] + p->link[0] * (sin(first) - sin(best_first)) +
                p->link[1] * (sin(second) - sin(best_second));
}

static double largest_speed(const ppu_positioning *p, double gap) {
    const double room = gap > 0.0 ? gap : 0.0; /* none where the gap is not a number */
    return fmin(fmin(room / p->dt, sqrt(2.0 * p->braking * room)), p->velocity);
}

/* A value that is not a number stays so, for the gate to see. */
static double within(double value, double lower, double upper) {
    return value < lower ? lower : value > upper ? upper : value;
}

double ppu_wanted(const ppu_positioning *p, int axis, double error, double ahead, double *least,
                  double *most) {
    *least = -largest_speed(p, ahead - p->lower[axis]);
    *most = largest_speed(p, p->upper[axis] - ahead);
    return within(p->gain * error, *least, *most);
}

static double dot(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1];
}

/* How fast joints 2 and 3 turn per speed of the PPU, with the handle held: its place and yaw stay, so
 * v + l0 e'(q1) q1' + l1 e'(q1 + q2) (q1' + q2') = 0 and q3' = -(q1' + q2'). */
static void turning(const ppu_positioning *p, const double *q, double rate[2][2]) {
    const double first = q[0], second = q[0] + q[1];
    const double bend = sin(q[1]);
    const double upper[2] = {cos(second), sin(second)}, fore[2] = {cos(first), sin(first)};
    for (int axis = 0; axis < 2; axis++) {
        const double q1 = -upper[axis] / (p->link[0] * bend);
        const double both = fore[axis] / (p->link[1] * bend);
        rate[0][axis] = both - q1;
        rate[1][axis] = -both;
    }
}

/* A half-plane of velocities: along . v <= most, along has length 1. */
typedef struct {
    double along[2], most;
} half_plane;

static double beyond(const half_plane *h, const double *v) {
    return dot(h->along, v) - h->most;
}

void ppu_yield(const ppu_positioning *p, const double *q, const double *qd_ppu, const double *least,
               const double *most, double *wanted) {
    double rate[2][2];
    half_plane planes[4];
    turning(p, q, rate);
    for (int k = 0; k < 4; k++) {
        const int joint = k / 2, sign = k % 2 ? 1 : -1;
        const double *const g = rate[joint], length = sqrt(dot(g, g));
        const double gap =
            sign > 0 ? p->most_angle[joint] - q[joint + 1] : q[joint + 1] - p->least_angle[joint];
        const double room = (gap - sign * dot(g, qd_ppu) * p->time_constant) / length;
        planes[k] = (half_plane){{sign * g[0] / length, sign * g[1] / length}, largest_speed(p, room)};
    }
    /* joint 2, then joint 3 along what joint 2 leaves */
    const half_plane *held = 0;
    for (int k = 0; k < 4; k++) {
        const half_plane *const h = &planes[k];
        const double over = beyond(h, wanted);
        if (!(over > 0.0)) continue;
        double way[2] = {h->along[0], h->along[1]};
        if (held && k >= 2) {
            const double along = dot(way, held->along);
            way[0] -= along * held->along[0], way[1] -= along * held->along[1];
        }
        const double gain = dot(way, h->along);
        if (gain < 1e-3) continue; /* parallel: the share below decides */
        wanted[0] -= over / gain * way[0], wanted[1] -= over / gain * way[1];
        held = h;
    }
    double share = 1.0; /* standstill is always allowed */
    for (int axis = 0; axis < 2; axis++) wanted[axis] = within(wanted[axis], least[axis], most[axis]);
    for (int k = 0; k < 4; k++)
        if (beyond(&planes[k], wanted) > 0.0)
            share = fmin(share, planes[k].most / dot(planes[k].along, wanted));
    wanted[0] *= share, wanted[1] *= share;
}

static const double PPU_CREEP = 0.3;

void ppu_approach(const ppu_positioning *p, const double *q, const double *q_ppu, const double *qd_ppu,
                  double *least, double *most) {
    const double first = q[0], second = q[0] + q[1];
    const double arm[2] = {p->link[0] * cos(first) + p->link[1] * cos(second),
                           p->link[0] * sin(first) + p->link[1] * sin(second)};
    for (int axis = 0; axis < 2; axis++) {
        const double ahead = q_ppu[axis] + arm[axis] + p->time_constant * qd_ppu[axis];
        const double down = fmax(largest_speed(p, ahead - p->elbow_lower[axis]), PPU_CREEP);
        const double up = fmax(largest_speed(p, p->elbow_upper[axis] - ahead), PPU_CREEP);
        least[axis] = fmax(least[axis], -down), most[axis] = fmin(most[axis], up);
    }
}

void ppu_update(const ppu_positioning *p, const double *q, const double *q_ppu, const double *qd_ppu) {
    double target[2], wanted[2], least[2], most[2];
    ppu_reference(p, q, q_ppu, target);
    for (int axis = 0; axis < 2; axis++) {
        const double ahead = q_ppu[axis] + p->time_constant * qd_ppu[axis];
        wanted[axis] = ppu_wanted(p, axis, target[axis] - q_ppu[axis], ahead, &least[axis], &most[axis]);
    }
    ppu_approach(p, q, q_ppu, qd_ppu, least, most);
    ppu_yield(p, q, qd_ppu, least, most, wanted);
    for (int axis = 0; axis < 2; axis++) {
        const double step = p->acceleration * p->dt, last = p->command[axis];
        p->command[axis] = within(wanted[axis], last - step, last + step);
    }
}

void ppu_stop(const ppu_positioning *p) {
    const double step = p->acceleration * p->dt;
    for (int axis = 0; axis < 2; axis++) {
        const double v = p->command[axis];
        p->command[axis] = v > step ? v - step : v < -step ? v + step : 0.0;
    }
}
