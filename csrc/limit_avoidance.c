#include "limit_avoidance.h"

#include <math.h>

/* (3): 0 outside the zone. */
static double push(const avoidance_gains *g, double distance) {
    return distance < g->zone ? g->gain * (1.0 / fmax(distance, g->least) - 1.0 / g->zone) : 0.0;
}

void limit_avoidance_update(const limit_avoidance *a) {
    for (int i = 0; i < a->n; i++) {
        const double q = a->q[i], qd = a->qd[i];
        const double down = q - a->lower[i], up = a->upper[i] - q, spare = a->fastest[i] - fabs(qd);
        const double away = push(&a->position, down) - push(&a->position, up);
        a->torque[i] = away - copysign(push(&a->velocity, spare), qd);
        const double share = fmin(fmin(down, up) / a->position.zone, spare / a->velocity.zone);
        a->alpha[i] = fmax(0.0, fmin(1.0, 2.0 * share - 1.0));
        a->near[i] = (uint8_t)((down < a->position.zone ? AVOIDS_LOWER : 0) |
                               (up < a->position.zone ? AVOIDS_UPPER : 0) |
                               (spare < a->velocity.zone ? AVOIDS_SPEED : 0));
    }
}
