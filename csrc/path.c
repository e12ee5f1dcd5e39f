#include "path.h"

#include <math.h>

/* The segment that t is in, by bisection. */
static int segment(const path *p, double t) {
    int first = 0, last = p->segments - 1;
    while (first < last) {
        const int middle = (first + last + 1) / 2;
        if (p->time[middle] <= t) {
            first = middle;
        } else {
            last = middle - 1;
        }
    }
    return first;
}

void path_at(const path *p, double t) {
    t = fmin(fmax(t, p->time[0]), p->time[p->segments]);
    const int i = segment(p, t);
    const double h = p->time[i + 1] - p->time[i], s = (t - p->time[i]) / h;
    for (int k = 0; k < p->columns; k++) {
        const double *const c = p->cubic + 4 * (p->columns * i + k);
        p->value[k] = ((c[0] * s + c[1]) * s + c[2]) * s + c[3];
        p->rate[k] = ((3.0 * c[0] * s + 2.0 * c[1]) * s + c[2]) / h;
    }
}
