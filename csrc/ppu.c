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

double ppu_command(const ppu_positioning *p, int axis, double error, double ahead) {
    const double slowest = -largest_speed(p, ahead - p->lower[axis]);
    const double fastest = largest_speed(p, p->upper[axis] - ahead);
    const double step = p->acceleration * p->dt, last = p->command[axis];
    return within(within(p->gain * error, slowest, fastest), last - step, last + step);
}

void ppu_update(const ppu_positioning *p, const double *q, const double *q_ppu, const double *qd_ppu) {
    double target[2];
    ppu_reference(p, q, q_ppu, target);
    for (int axis = 0; axis < 2; axis++) {
        const double ahead = q_ppu[axis] + p->time_constant * qd_ppu[axis];
        p->command[axis] = ppu_command(p, axis, target[axis] - q_ppu[axis], ahead);
    }
}

void ppu_stop(const ppu_positioning *p) {
    const double step = p->acceleration * p->dt;
    for (int axis = 0; axis < 2; axis++) {
        const double v = p->command[axis];
        p->command[axis] = v > step ? v - step : v < -step ? v + step : 0.0;
    }
}
