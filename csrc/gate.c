#include "gate.h"

#include <math.h>

static double limited(double value, double most) {
    return value > most ? most : value < -most ? -most : value;
}

/* A command that respects an axis; `wrong` stays as it is where that is the given one. */
static double respecting(const gate_axes *g, int i, uint8_t *wrong) {
    const double last = g->admitted[i], velocity = g->velocity[i];
    double safe = g->command[i];
    if (fabs(safe) > g->most[i]) {
        safe = limited(safe, g->most[i]);
        *wrong = GATE_EXCEEDS;
    }
    if (fabs(safe - last) > g->step[i]) {
        safe = last + limited(safe - last, g->step[i]);
        *wrong = GATE_JUMPS;
    }
    /* comparisons that a NaN fails: an axis without a valid position gets no command in either direction */
    if (safe > 0.0 && !(g->position[i] <= g->upper[i])) {
        safe = 0.0;
        *wrong = GATE_BEYOND_UPPER;
    }
    if (safe < 0.0 && !(g->position[i] >= g->lower[i])) {
        safe = 0.0;
        *wrong = GATE_BEYOND_LOWER;
    }
    /* what brakes takes power out, and may take all it can */
    if (!(safe * velocity <= g->power[i])) {
        safe = limited(safe, isfinite(velocity) ? g->power[i] / fabs(velocity) : 0.0);
        *wrong = GATE_POWER;
    }
    return safe;
}

int gate_admit(const gate_axes *g) {
    int replaced = 0;
    for (int i = 0; i < g->n; i++) {
        uint8_t wrong = GATE_FINE;
        if (g->dropped[i])
            g->admitted[i] = 0.0;
        else if (!isfinite(g->command[i]))
            wrong = GATE_NO_NUMBER;
        else
            g->admitted[i] = respecting(g, i, &wrong);
        g->wrong[i] = wrong;
        replaced += wrong != GATE_FINE;
    }
    return replaced;
}

void gate_write(const gate_axes *g, const gate_output *outputs, int count) {
    const double *admitted = g->admitted;
    for (int k = 0; k < count; k++)
        for (int i = 0; i < outputs[k].n; i++) outputs[k].commands[i] = *admitted++;
}
