/* What the rounding of doubles leaves unproven is solved with more digits, and x rounded. */
#include "hqp_internal.h"

/* Seconds that are left, negative where none are, or 0 where no limit is set. */
static double time_left(const hqp_solver *s) {
    if (!(s->settings.time_limit > 0.0)) return 0.0;
    const double left = s->settings.time_limit - (hqp_now() - s->began);
    return left > 0.0 ? left : -1.0;
}

/* Go to what was found with more digits. */
static void go_to(hqp_solver *s, const double *x, int rank) {
    hqp_unjoin(s);
    hqp_unfix(s);
    hqp_forget(s);
    for (int i = 0; i < s->n; i++) s->x[i] = x[i];
    hqp_extended_end(s->extended, s->guess_side, s->guess_held_side, s->guess_held_at);
    hqp_end_here(s, rank);
}

/* Whether there are more digits, iterations and time. */
static int is_there_more(const hqp_solver *s) {
    return s->extended && !s->is_late && s->iterations < s->settings.max_iterations && !(time_left(s) < 0.0);
}

/* Solve from where the solver is, with the iterations that are left, or prove x at the minimum of its face.
 * What is not proven changes nothing. */
static hqp_status solve(hqp_solver *s, int only_face) {
    const int left = s->settings.max_iterations - s->iterations;
    hqp_info info = {.w = NULL, .v = NULL, .active = NULL};
    double x[HQP_MOST_VARIABLES];
    hqp_extended_begin(s->extended, s->x, s->guess_side, s->guess_held_side, s->guess_held_at, only_face);
    hqp_extended_limit(s->extended, left, time_left(s), s->rank_asked);
    const hqp_status found = hqp_extended_solve(s->extended, s->levels_given, x, &info);
    s->iterations += info.iterations;
    s->is_late = found == HQP_TIME_LIMIT;
    if (found == HQP_SOLVED) go_to(s, x, info.rank);
    return found;
}

/* Solve it all. What is not proven changes but the status, if it was cut short and nothing was proven before:
 * it is that of the search so far. */
hqp_status hqp_try_extended(hqp_solver *s, hqp_status status) {
    if (!is_there_more(s)) return status;
    const hqp_status found = solve(s, 0);
    if (found == HQP_SOLVED || status == HQP_SOLVED) return HQP_SOLVED;
    return found == HQP_ITERATION_CAP || s->is_late ? HQP_ITERATION_CAP : status;
}

/* Whether x is proven at the minimum of its face. If so, it is there. */
int hqp_prove_extended(hqp_solver *s) {
    return is_there_more(s) && solve(s, 1) == HQP_SOLVED;
}
