#include "springs.h"

#include <math.h>

static void forget(const spring_bounds *s, int i) {
    s->least[i] = s->stiffest[i];
    s->most[i] = s->softest[i];
    s->stiffness[i] = s->believed[i];
    s->count[i] = 0;
}

/* What a tick adds to its block; 0 where it does not fit. */
static int take(const spring_bounds *s, int i, double deflection, double lag) {
    const double load = s->load[i], size = fabs(load);
    if (!s->agree[i] || !(size > 0.0)) return 0;
    const double middle = copysign(deflection, deflection * load), error = s->error[i] + lag;
    const double lower = (middle - error) / size, upper = (middle + error) / size;
    const int first = s->count[i] == 0;
    s->low[i] = first ? load : fmin(s->low[i], load);
    s->high[i] = first ? load : fmax(s->high[i], load);
    s->lower[i] = first ? lower : fmin(s->lower[i], lower);
    s->upper[i] = first ? upper : fmax(s->upper[i], upper);
    s->count[i]++;
    return s->high[i] - s->low[i] <= s->slow[i];
}

static void narrow(const spring_bounds *s, int i) {
    const double least = fmax(s->least[i], s->lower[i]), most = fmin(s->most[i], s->upper[i]);
    if (!(least <= most)) return; /* no such spring: plausible_agree judges that */
    s->least[i] = least;
    s->most[i] = most;
}

void springs_learn(const spring_bounds *s, int free_to_move) {
    for (int i = 0; i < s->n; i++) {
        const double deflection = s->motor[i] - s->link[i];
        const double lag = s->relaxing * fabs(deflection - s->deflection[i]);
        s->deflection[i] = deflection;
        if (!free_to_move) {
            forget(s, i);
            continue;
        }
        if (!take(s, i, deflection, lag)) {
            s->count[i] = 0;
        } else if (s->count[i] == s->block) {
            narrow(s, i);
            s->count[i] = 0;
        }
        const double nearest = fmin(fmax(s->believed[i], 1.0 / s->most[i]), 1.0 / s->least[i]);
        const double change = nearest - s->stiffness[i];
        s->stiffness[i] += fmin(fmax(change, -s->step[i]), s->step[i]);
    }
}
