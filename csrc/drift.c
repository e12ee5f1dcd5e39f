#include "drift.h"

#include <math.h>

/* Of force [N] and torque [N m], times the sensor's share. SMALL: no hand that means to move the machine
 * pulls less. STEADY: a hand that holds on trembles by more. MOST: what such sensors drift by in a session.
 */
static const double SMALL[2] = {1.8, 0.2}, STEADY[2] = {0.3, 0.03}, MOST[2] = {2.0, 0.2};
static const double WAIT = 1.0, SMOOTH = 0.2, FOLLOW = 1.0; /* [s] */

static double length(const double *v) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

void drift_remove(drift *d, double *wrench) {
    int steady = 1;
    for (int i = 0; i < 6; i++)
        if (!isfinite(wrench[i])) return;
    for (int part = 0; part < 2; part++) {
        double off[3], left[3];
        for (int k = 0; k < 3; k++) {
            const int i = 3 * part + k;
            d->slow[i] += d->dt / SMOOTH * (wrench[i] - d->slow[i]);
            off[k] = wrench[i] - d->slow[i];
            left[k] = d->slow[i] - d->bias[i];
        }
        steady = steady && length(off) <= d->share[part] * STEADY[part] &&
                 length(left) <= d->share[part] * SMALL[part];
    }
    d->steady = steady ? d->steady + d->dt : 0.0;
    for (int i = 0; i < 6; i++) {
        const double most = d->share[i / 3] * MOST[i / 3];
        if (d->steady > WAIT) d->bias[i] += d->dt / FOLLOW * (d->slow[i] - d->bias[i]);
        d->bias[i] = fmin(fmax(d->bias[i], -most), most);
        wrench[i] -= d->bias[i];
    }
}
