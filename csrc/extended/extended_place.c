/* Where the solver of more digits begins and ends. */
#include "names.h"

#include "../hqp_internal.h"

#include <string.h>

void hqp_extended_limit(hqp_extended *e, int max_iterations, double time_limit, double rank) {
    e->settings.rank = e->rank_asked = rank;
    e->settings.max_iterations = max_iterations;
    e->settings.time_limit = time_limit;
}

void hqp_extended_begin(hqp_extended *e, const double *x, const signed char *side,
                        const signed char *held_side, const short *held_at, int only_face) {
    hqp_reset(e);
    e->only_face = only_face;
    for (int i = 0; i < e->n; i++) e->x[i] = x[i];
    memcpy(e->guess_side, side, (size_t)e->total);
    memcpy(e->guess_held_side, held_side, (size_t)e->total);
    memcpy(e->guess_held_at, held_at, (size_t)e->total * sizeof(short));
    e->warm = 1;
}

void hqp_extended_end(const hqp_extended *e, signed char *side, signed char *held_side, short *held_at) {
    memcpy(side, e->guess_side, (size_t)e->total);
    memcpy(held_side, e->guess_held_side, (size_t)e->total);
    memcpy(held_at, e->guess_held_at, (size_t)e->total * sizeof(short));
}
