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

/* Solve from where the solver is, with the iterations that are left. What is not proven changes nothing but,
 * if it was cut short and nothing was proven before, the status, which is that of the search so far. */
hqp_status hqp_try_extended(hqp_solver *s, hqp_status status) {
    const int left = s->settings.max_iterations - s->iterations;
    const double seconds = time_left(s);
    if (!s->extended || s->is_late || left <= 0 || seconds < 0.0) return status;
    hqp_info info = {.w = NULL, .v = NULL, .active = NULL};
    double x[HQP_MOST_VARIABLES];
    hqp_extended_begin(s->extended, s->x, s->guess_side, s->guess_held_side, s->guess_held_at);
    hqp_extended_limit(s->extended, left, seconds, s->rank_asked);
    const hqp_status found = hqp_extended_solve(s->extended, s->levels_given, x, &info);
    s->iterations += info.iterations;
    s->is_late = found == HQP_TIME_LIMIT;
    if (found == HQP_SOLVED) go_to(s, x, info.rank);
    if (found == HQP_SOLVED || status == HQP_SOLVED) return HQP_SOLVED;
    return found == HQP_ITERATION_CAP || s->is_late ? HQP_ITERATION_CAP : status;
}
