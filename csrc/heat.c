#include "heat.h"

#include <math.h>

/* Last part of a budget in which the torque comes down: its square then falls in proportion to what is left,
 * so that the budget is approached and never passed. */
static const double EASE = 0.3;

void heat_take(const heat_budget *h, int elapsed) {
    for (int i = 0; i < h->n; i++) {
        const double lasting = h->lasting[i], rated = h->rated[i], peak = h->peak[i];
        if (!(peak > lasting)) continue;
        const double excess = h->told[i] * h->told[i] - rated * rated;
        const double whole = (peak * peak - rated * rated) * h->seconds[i];
        h->used[i] = fmax(0.0, h->used[i] + elapsed * h->dt * excess / whole);
        const double left = fmin(1.0, fmax(0.0, (h->share - h->used[i]) / (EASE * h->share)));
        h->able[i] = sqrt(lasting * lasting + left * (peak * peak - lasting * lasting));
    }
}
