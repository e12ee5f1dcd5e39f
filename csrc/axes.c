#include "axes.h"

/* What is no number stays that. */
static double between(double x, double lower, double upper) {
    return x < lower ? lower : x > upper ? upper : x;
}

void axes_step(const axes *a, double dt) {
    for (int i = 0; i < a->n; i++) {
        const double before = a->velocity[i], target = a->braked[i] ? 0.0 : a->command[i];
        const double constant = a->braked[i] ? dt : a->time_constant;
        const double velocity = before + dt * between((target - before) / constant, -a->rated, a->rated);
        const double position = a->position[i] + dt * velocity;
        const double stopped = between(position, a->lower[i], a->upper[i]);
        a->position[i] = stopped;
        a->velocity[i] = stopped == position ? velocity : 0.0;
        a->acceleration[i] = (a->velocity[i] - before) / dt;
    }
}
