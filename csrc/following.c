#include "following.h"

#include <math.h>

int following_judge(const following *f, const double *leash, int strains) {
    int astray = 0;
    for (int i = 0; i < f->n; i++) {
        if (strains) f->strained[i] = fabs(f->strain[i]) > f->most[i] ? f->strained[i] + 1 : 0;
        const int follows = fabs(f->link[i] - f->led[i]) <= leash[i] && f->strained[i] <= f->longest;
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
