#include "following.h"

#include <math.h>

/* What the feedback may give besides for a plan that is wrong: a part of what accelerations took lately. */
static double doubted(const following *f, int i) {
    double torque = 0.0;
    for (int j = 0; j < f->n; j++) torque += f->inertia[f->n * i + j] * f->qdd[j];
    f->planned[i] = fmax(fabs(torque), f->keep * f->planned[i]);
    return f->doubt * f->planned[i];
}

int following_judge(const following *f, const double *leash, int strains) {
    int astray = 0;
    for (int i = 0; i < f->n; i++) {
        const double more = doubted(f, i), far = leash[i] + more / f->gain[i];
        if (strains) f->strained[i] = fabs(f->strain[i]) > f->most[i] + more ? f->strained[i] + 1 : 0;
        const int follows = fabs(f->link[i] - f->led[i]) <= far && f->strained[i] <= f->longest;
        f->astray[i] = !follows;
        astray += !follows;
    }
    return astray;
}

int following_overloaded(const following *f) {
    for (int i = 0; i < f->n; i++)
        if (fabs(f->load[i]) > f->able[i]) return i;
    return -1;
}
