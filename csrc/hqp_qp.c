/*
 * Quadratic programs: from the caller's data to a proven answer. docs/hqp.md describes the method.
 *
 * P must be positive definite for the dual method. Where it is not, shift_i / 2 (x_i - center_i)^2 is added
 * for each variable, with the last x as the next center (the proximal point method). The rows held in the end
 * are mostly those of the optimum long before x is there, so each time the equations of the held rows are
 * solved without the shift, and what comes out counts if it is proven.
 */
#include <stdlib.h>
#include <string.h>

#include "hqp_qp_internal.h"

static const double MOST = 1e100;
static const double DEFINITE = 1e-10; /* of a diagonal entry of P: a smaller pivot is no pivot */
/* Of it: added to a singular P, and to any where nothing was proven; who lacks more than the first is not
 * convex. */
static const double PROXIMITIES[] = {1e-9, 1e-7, 1e-5};
enum { SHIFTS = sizeof PROXIMITIES / sizeof *PROXIMITIES };
static const double NEGATIVE = 1e-12;  /* of the largest diagonal entry: no rounding is further below 0 */
static const double NO_ENTRY = 1e-20;  /* of the largest diagonal entry: a smaller one counts as none */
static const double REACH = 1e4;       /* with P = 0: how far x may go in the first proximal step */
static const double STATIONARY = 1e-9; /* of the parts of its entry: left of a gradient of 0 */
static const double ROUNDING = 4e-15;  /* of all that is summed up in an entry: the same */
static const double SPILT = 1e-13;     /* of the largest parts of any entry: the same */
static const double FAINT =
    1e-12;                       /* of the largest part of the gradient: a multiplier that may be rounding */
static const double MET = 100.0; /* times what counts as broken: a row that is missed */
static const double AT_BOUND = 1e-7; /* a row at its bound in the caller's guess */
static const double OPPOSED = 1e-12; /* of its terms: what clashing rows fall short of 0 by, at least */
static const double FAR = 1e4;       /* times 1 + |x|: clashing rows are met nowhere nearer */
static const double LEAP = 1e3;      /* times the last step: further it is not trusted */
static const double FLAT = 1e-12;    /* of the largest entry of P: |P ray| of a flat ray */
static const double RAY = 1e-11;     /* of the length of a row: what of a ray it may see */
static const double FALLS = 1e-10;   /* of the parts of q^T ray: by more it falls */
static const double GRAIN = 1e-15;   /* of the largest entry of a ray: a smaller one is rounding */
static const double GOOD = 1e-3;     /* times what a proof asks: refinement ends */
static const double SLOW = 0.7;      /* or where more is left of what was left before */
enum { REFINEMENTS = 12, STEPS = 100, RETURNS = 8 };
enum { ANOTHER_CENTER = 100 }; /* beside the statuses */

static void *take(size_t *used, char *memory, size_t count, size_t size) {
    void *at = memory ? memory + *used : NULL;
    *used += (count * size + 31) & ~(size_t)31;
    return at;
}

/* Set the pointers into the memory, close together for a QP of this size. Returns how much of it they need.
 */
static size_t lay_out(hqp_qp_solver *s, int variables, int most_rows, char *memory) {
    const size_t n = (size_t)variables, ld = (n + 3) & ~(size_t)3, rows = (size_t)most_rows + n;
    const size_t few = (size_t)most_rows * (n / 4 + 1) + n, d = sizeof(double), i = sizeof(int);
    double **lines[] = {&s->inverse, &s->multiplier, &s->pull, &s->rest,   &s->cosine, &s->sine,
                        &s->x,       &s->u,          &s->step, &s->center, &s->kept,   &s->gradient,
                        &s->scale,   &s->scratch,    &s->size, &s->end,    &s->shift};
    int **counts[] = {&s->from, &s->id, &s->slot, &s->begins, &s->ends};
    double **bounds[] = {&s->lo, &s->hi, &s->norm, &s->value};
    int **extents[] = {&s->length, &s->begin, &s->first, &s->last};
    size_t used = 0;
    for (size_t k = 0; k < sizeof lines / sizeof *lines; k++) *lines[k] = take(&used, memory, ld + 4, d);
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) *counts[k] = take(&used, memory, n + 1, i);
    for (size_t k = 0; k < sizeof bounds / sizeof *bounds; k++) *bounds[k] = take(&used, memory, rows, d);
    for (size_t k = 0; k < sizeof extents / sizeof *extents; k++) *extents[k] = take(&used, memory, rows, i);
    s->side = take(&used, memory, rows, 1);
    s->waived = take(&used, memory, rows, 1);
    s->column = take(&used, memory, few, i);
    s->coefficient = take(&used, memory, few, d);
    s->L = take(&used, memory, n * ld, d);
    s->M = take(&used, memory, (n + 1) * ld, d);
    s->T = take(&used, memory, (n + 1) * ld, d);
    return used;
}

hqp_qp_solver *hqp_qp_create(int n, int rows) {
    if (n < 1 || n > 1024 || rows < 0 || rows > 8192) return NULL;
    hqp_qp_solver sizes;
    hqp_qp_solver *s = malloc(sizeof *s + lay_out(&sizes, n, rows, NULL));
    if (!s) return NULL;
    s->most_n = n;
    s->most_rows = rows;
    return s;
}

void hqp_qp_destroy(hqp_qp_solver *s) {
    free(s);
}

/* The gradient of the Lagrangian, the size of its three parts (far x must not count for more than what they
 * come to), and what the objective is. */
static void find_gradient(hqp_qp_solver *s) {
    const int n = s->n;
    double bent = 0.0, tilted = 0.0, *pulled = s->rest;
    hqp_qp_bend(s, s->x, s->gradient);
    memset(pulled, 0, (size_t)n * sizeof(double));
    for (int k = 0; k < s->count; k++)
        hqp_qp_add_row(s, s->id[k], s->multiplier[k] * s->side[s->id[k]], pulled);
    for (int i = 0; i < n; i++) {
        const double value = s->gradient[i], tilt = s->qp.q[i];
        s->gradient[i] = value + tilt + pulled[i];
        s->scale[i] = fabs(value) + fabs(tilt) + fabs(pulled[i]);
        bent += value * s->x[i];
        tilted += tilt * s->x[i];
    }
    s->objective = 0.5 * bent + tilted;
}

/* The larger of two parts; once it is NaN it stays so, which is no proof of anything. */
static double worse(double most, double part) {
    return most == most && !(part <= most) ? part : most;
}

/* How much more of the gradient is left than s->scale allows. */
static double left_of_gradient(const hqp_qp_solver *s) {
    double most = 0.0;
    for (int i = 0; i < s->n; i++)
        most = worse(most, fabs(s->gradient[i]) / (STATIONARY * s->scale[i] + 1e-300));
    return most;
}

/* s->scale grows by what rounding makes of the sums in each entry, and by a little of the largest ones. What
 * is little does not depend on units: where P curves, g^2 / P_ii, by which the objective could fall, beside
 * the largest of these and the largest energy scale_i |x_i|; elsewhere g |x_i| beside that energy, and g
 * beside the largest. */
static void add_rounding(hqp_qp_solver *s) {
    double *sizes = s->rest, largest = 0.0, curved = 0.0, energy = 0.0;
    const ptrdiff_t next = s->n + 1;
    for (int i = 0; i < s->n; i++) {
        const double own = s->qp.P[i * next];
        if (own > 0.0) curved = fmax(curved, s->scale[i] / sqrt(own));
        largest = fmax(largest, s->scale[i]);
        energy = fmax(energy, s->scale[i] * fabs(s->x[i]));
    }
    curved = fmax(curved, sqrt(energy));
    hqp_qp_bend_sizes(s, s->x, sizes);
    for (int k = 0; k < s->count; k++) hqp_qp_add_sizes(s, s->id[k], s->multiplier[k], sizes);
    for (int i = 0; i < s->n; i++) {
        const double own = s->qp.P[i * next], far = fabs(s->x[i]);
        const double flat = fmin(largest, far > 0.0 ? energy / far : INFINITY);
        const double spilt = own > 0.0 ? sqrt(own) * curved : flat;
        s->scale[i] += (SPILT * spilt + ROUNDING * sizes[i]) / STATIONARY;
    }
}

/* Met is a row that is missed by no more than this: by rounding, which is no excuse for more than a length of
 * 1 makes of the row, or its bound. */
static double hidden(const hqp_qp_solver *s, int id, double bound) {
    return fmin(MET * hqp_qp_allowance(s, id, bound), s->norm[id] + fabs(bound));
}

/* How much more than allowed is left of the gradient, or of the distance of held rows to their bound, in
 * `gap` [count]. */
static double excess(hqp_qp_solver *s, double *gap) {
    find_gradient(s);
    double most = left_of_gradient(s);
    if (!(most <= GOOD)) {
        add_rounding(s);
        most = left_of_gradient(s);
    }
    for (int k = 0; k < s->count; k++) {
        const int id = s->id[k], side = s->side[id];
        const double bound = hqp_qp_bound(s, id, side);
        gap[k] = side * (bound - hqp_qp_value(s, id, s->x));
        most = worse(most, fabs(gap[k]) / hidden(s, id, bound));
    }
    return most;
}

/* No row is missed. Of s->kept, which the descent ended at, it has left the values. */
static int is_feasible(hqp_qp_solver *s) {
    if (memcmp(s->x, s->kept, (size_t)s->n * sizeof(double)) != 0) hqp_qp_find_values(s);
    for (int i = 0; i < s->rows; i++) {
        const double over = s->value[i] - s->hi[i], under = s->lo[i] - s->value[i];
        if (over <= 0.0 && under <= 0.0) continue;
        const double beyond = over > under ? over : under, bound = over > under ? s->hi[i] : s->lo[i];
        if (!(beyond <= hidden(s, i, bound))) return 0;
    }
    return hqp_qp_inner(s->x, s->x, s->n) < INFINITY;
}

/* Multipliers of inequalities are not negative. Returns whether one was. */
static int clamp(hqp_qp_solver *s) {
    int any = 0;
    for (int k = 0; k < s->count; k++) {
        if (s->multiplier[k] >= 0.0 || hqp_qp_is_equality(s, s->id[k])) continue;
        s->multiplier[k] = 0.0;
        any = 1;
    }
    return any;
}

/* Multipliers of 0 that rounding made something else: alone in an entry of the gradient they are all of it.
 */
static void hush(hqp_qp_solver *s) {
    double largest = 0.0;
    for (int i = 0; i < s->n; i++) largest = fmax(largest, fmax(s->scale[i], s->shift[i] * fabs(s->x[i])));
    for (int k = 0; k < s->count; k++) {
        if (fabs(s->multiplier[k]) * s->norm[s->id[k]] <= FAINT * largest) s->multiplier[k] = 0.0;
    }
}

/* Variables that are held at their own bound are there to the last bit. */
static void snap(hqp_qp_solver *s) {
    const int box = s->qp.equalities + s->qp.inequalities;
    for (int k = 0; k < s->count; k++) {
        const int id = s->id[k];
        if (id >= box) s->x[id - box] = hqp_qp_bound(s, id, s->side[id]);
    }
}

/* Solve the equations of the held rows, without shift, and prove the answer. */
static int prove(hqp_qp_solver *s) {
    double *gap = s->scratch, before = INFINITY, left;
    for (int k = 0;; k++) {
        snap(s);
        left = excess(s, gap);
        if (left <= GOOD || k == REFINEMENTS || !(left <= SLOW * before)) break;
        before = left;
        for (int i = 0; i < s->n; i++) s->gradient[i] = -s->gradient[i];
        hqp_qp_newton(s, s->gradient, gap);
        hqp_add(s->x, 1.0, s->gradient, s->n);
        hqp_add(s->multiplier, 1.0, gap, s->count);
    }
    if (clamp(s)) left = excess(s, gap);
    if (!(left <= 1.0)) {
        memcpy(s->pull, s->multiplier, (size_t)s->count * sizeof(double));
        hush(s);
        left = excess(s, gap);
        if (!(left <= 1.0)) memcpy(s->multiplier, s->pull, (size_t)s->count * sizeof(double));
    }
    return left <= 1.0 && is_feasible(s);
}

/* Rows that the guess puts at their bound, or beyond, are held from the start. */
static void seat_guess(hqp_qp_solver *s) {
    for (int i = s->qp.equalities; i < s->rows; i++) {
        const double value = hqp_qp_value(s, i, s->qp.start), norm = s->norm[i];
        for (int side = -1; side <= 1 && !s->side[i]; side += 2) {
            const double bound = hqp_qp_bound(s, i, side);
            if (side * (bound - value) <= AT_BOUND * (norm + fabs(bound)) && fabs(bound) < INFINITY &&
                norm > 0.0)
                hqp_qp_seat(s, i, side);
        }
    }
}

/* Factorise P with a shift: in proportion to its diagonal, so that units of variables do not matter. */
static hqp_qp_status factorise_shifted(hqp_qp_solver *s, double proximity) {
    s->is_shifted = 1;
    double most = 0.0;
    for (int j = 0; j < s->n; j++) most = fmax(most, fabs(s->qp.q[j]));
    for (ptrdiff_t j = 0; j < s->n; j++) {
        const double own = s->qp.P[j * s->n + j];
        if (own < -NEGATIVE * s->largest) return HQP_QP_NOT_CONVEX;
        s->shift[j] = proximity * (own > NO_ENTRY * s->largest ? own : s->largest);
        if (s->largest == 0.0) s->shift[j] = most > 0.0 ? most / REACH : 1.0;
    }
    return hqp_qp_factorise(s, 0.0) ? HQP_QP_SOLVED : HQP_QP_NOT_CONVEX;
}

/* Factorise P, or with a shift where it is singular. */
static hqp_qp_status factorise(hqp_qp_solver *s) {
    memset(s->shift, 0, (size_t)s->ld * sizeof(double));
    s->is_shifted = 0;
    return s->largest > 0.0 && hqp_qp_factorise(s, DEFINITE) ? HQP_QP_SOLVED
                                                             : factorise_shifted(s, PROXIMITIES[0]);
}

/* Take out of a ray what rounding put there: P is flat, and held rows stay at their bound. Returns 0 where
 * most of it goes. */
static int straighten(hqp_qp_solver *s, double *ray) {
    double *down = s->gradient, *gap = s->scratch;
    hqp_qp_bend(s, ray, down);
    for (int i = 0; i < s->n; i++) down[i] = -down[i];
    for (int k = 0; k < s->count; k++) gap[k] = -s->side[s->id[k]] * hqp_qp_value(s, s->id[k], ray);
    hqp_qp_newton(s, down, gap);
    hqp_add(ray, 1.0, down, s->n);
    const double length = sqrt(hqp_qp_inner(ray, ray, s->n));
    for (int i = 0; i < s->n; i++) ray[i] /= length;
    return length > 0.5;
}

/* The last step goes on along s->rest, of length 1: how far the objective falls there inside the
 * constraints. */
static double stride(hqp_qp_solver *s) {
    const int n = s->n;
    double *ray = s->rest, slope = 0.0, bend = 0.0, most_bent = 0.0, tilted = 0.0, tilts = 0.0;
    for (int i = 0; i < n; i++) ray[i] = s->x[i] - s->center[i];
    const double length = sqrt(hqp_qp_inner(ray, ray, n));
    if (!(length > 0.0) || !(length < INFINITY)) return 0.0;
    for (int i = 0; i < n; i++) ray[i] /= length;
    if (!straighten(s, ray) || !straighten(s, ray)) return 0.0; /* twice: the first is rounded, too */
    double largest = 0.0;
    for (int i = 0; i < n; i++) largest = fmax(largest, fabs(ray[i]));
    for (int i = 0; i < n; i++) {
        if (fabs(ray[i]) <= GRAIN * largest) ray[i] = 0.0;
    }
    double *sizes = s->scratch, rounding = 0.0;
    hqp_qp_bend(s, ray, s->gradient);
    hqp_qp_bend_sizes(s, ray, sizes);
    for (int i = 0; i < n; i++) {
        const double bent = s->gradient[i], tilt = s->qp.q[i] * ray[i];
        slope += tilt + bent * s->x[i];
        rounding += ROUNDING * (fabs(tilt) + sizes[i] * fabs(s->x[i]));
        tilted += tilt;
        tilts += fabs(tilt);
        bend += bent * ray[i];
        most_bent = fmax(most_bent, fabs(bent));
    }
    if (!(slope < -rounding)) return 0.0;
    const int is_flat = most_bent <= FLAT * s->largest;
    if (is_flat && !(tilted < -FALLS * tilts)) return 0.0;
    double most = is_flat ? INFINITY : fmin(-slope / bend, LEAP * length);
    for (int i = 0; i < s->rows; i++) {
        const double value = hqp_qp_value(s, i, ray), bound = value > 0.0 ? s->hi[i] : s->lo[i];
        if (fabs(value) <= RAY * s->norm[i] || fabs(bound) == INFINITY) continue;
        most = fmin(most, fmax(0.0, (bound - hqp_qp_value(s, i, s->x)) / value));
    }
    return most;
}

/* The row on its way in and the held ones that do not let it add up to 0 x <= something negative: what they
 * weigh becomes their multiplier. */
static int is_clash(hqp_qp_solver *s) {
    const int k = s->count, n = s->n;
    double *sum = s->gradient, gap = 0.0, all = 0.0;
    memset(sum, 0, (size_t)n * sizeof(double));
    for (int i = 0; i <= k; i++) {
        const int id = s->id[i], side = s->side[id];
        double weight = i == k ? 1.0 : -s->pull[i];
        if (weight < 0.0 && !hqp_qp_is_equality(s, id)) weight = 0.0;
        s->multiplier[i] = weight;
        hqp_qp_add_row(s, id, weight * side, sum);
        gap += weight * side * hqp_qp_bound(s, id, side);
        all += fabs(weight * hqp_qp_bound(s, id, side));
    }
    double extent = 0.0, most = 0.0;
    for (int j = 0; j < n; j++) {
        extent += fabs(s->x[j]);
        most = fmax(most, fabs(sum[j]));
    }
    if (!(gap < -OPPOSED * all && -gap > FAR * most * (1.0 + extent))) return 0;
    s->count++; /* its multiplier is part of the answer */
    return 1;
}

/* The dual method to its end for this center, as often as refinement brings up rows that were not seen.
 * Returns a status, or ANOTHER_CENTER. */
static int solve_for_center(hqp_qp_solver *s) {
    for (int k = 0;; k++) {
        const hqp_qp_end end = hqp_qp_descend(s);
        if (end == HQP_QP_CLASH) return is_clash(s) ? HQP_QP_INFEASIBLE : HQP_QP_NOT_PROVEN;
        if (end == HQP_QP_CAPPED) {
            find_gradient(s);
            return s->iterations >= s->iteration_limit ? HQP_QP_ITERATION_CAP : HQP_QP_TIME_LIMIT;
        }
        memcpy(s->kept, s->x, (size_t)s->n * sizeof(double));
        if (prove(s)) return HQP_QP_SOLVED;
        if (s->is_shifted) return ANOTHER_CENTER;
        if (k == RETURNS) return HQP_QP_NOT_PROVEN;
    }
}

static hqp_qp_status solve(hqp_qp_solver *s) {
    hqp_qp_clear(s);
    for (int i = 0; i < s->qp.equalities; i++) {
        if (s->norm[i] > 0.0) hqp_qp_seat(s, i, 1);
    }
    if (s->qp.start) seat_guess(s);
    memset(s->center, 0, (size_t)s->ld * sizeof(double));
    for (int k = 0; k < STEPS; k++) {
        hqp_qp_settle(s);
        const int status = solve_for_center(s);
        if (status != ANOTHER_CENTER) return (hqp_qp_status)status;
        memcpy(s->x, s->kept, (size_t)s->n * sizeof(double));
        const double further = stride(s);
        if (further == INFINITY) return HQP_QP_UNBOUNDED;
        memcpy(s->center, s->x, (size_t)s->n * sizeof(double));
        if (further > 0.0) hqp_add(s->center, further, s->rest, s->n);
    }
    return HQP_QP_NOT_PROVEN;
}

/* Hand out the multipliers of held rows, which are numbered as they are. */
static void hand_out(const hqp_qp_solver *s, double *multipliers) {
    memset(multipliers, 0, (size_t)(s->qp.equalities + s->qp.inequalities + s->n) * sizeof(double));
    for (int i = 0; i < s->count; i++) multipliers[s->id[i]] = s->multiplier[i] * s->side[s->id[i]];
}

static hqp_qp_status begin(hqp_qp_solver *s, const hqp_qp *qp) {
    if (qp->n < 1 || qp->n > s->most_n || qp->equalities < 0 || qp->inequalities < 0 ||
        qp->equalities > s->most_rows - qp->inequalities || qp->max_iterations < 0 ||
        !(qp->time_limit >= 0.0))
        return HQP_QP_BAD_DATA;
    if (qp->start && !(hqp_qp_inner(qp->start, qp->start, qp->n) <= MOST * MOST)) return HQP_QP_BAD_DATA;
    lay_out(s, qp->n, qp->equalities + qp->inequalities, (char *)(s + 1));
    s->qp = *qp;
    s->n = qp->n;
    s->ld = (qp->n + 3) & ~3;
    s->count = s->iterations = 0;
    s->objective = 0.0;
    s->began = qp->time_limit > 0.0 ? hqp_now() : 0.0;
    hqp_qp_status status = hqp_qp_read(s);
    if (status == HQP_QP_SOLVED) status = hqp_qp_take(s);
    s->iteration_limit = qp->max_iterations > 0 ? qp->max_iterations : 128 + 64 * (s->n + s->rows);
    return status == HQP_QP_SOLVED ? factorise(s) : status;
}

/* From the start, with another shift. */
static hqp_qp_status try_again(hqp_qp_solver *s, double proximity) {
    return factorise_shifted(s, proximity) == HQP_QP_SOLVED ? solve(s) : HQP_QP_NOT_PROVEN;
}

hqp_qp_status hqp_qp_solve(hqp_qp_solver *s, const hqp_qp *qp, hqp_qp_answer *answer) {
    hqp_qp_status status = begin(s, qp);
    answer->iterations = 0;
    if (status < 0) return status;
    if (status == HQP_QP_SOLVED) {
        status = solve(s);
        for (int k = 1; k < SHIFTS && status == HQP_QP_NOT_PROVEN; k++) {
            const hqp_qp_status again = try_again(s, PROXIMITIES[k]);
            if (again == HQP_QP_SOLVED || again == HQP_QP_ITERATION_CAP || again == HQP_QP_TIME_LIMIT)
                status = again; /* rays and clashes that only the shift brings up are not believed */
        }
    } else {
        memset(s->x, 0, (size_t)s->n * sizeof(double));
    }
    memcpy(answer->x, status == HQP_QP_UNBOUNDED ? s->rest : s->x, (size_t)s->n * sizeof(double));
    if (answer->multipliers) hand_out(s, answer->multipliers);
    answer->objective = s->objective;
    answer->iterations = s->iterations;
    return status;
}

/* Hold the rows that have a multiplier. Returns 0 where that are more than there are variables. */
static int take_multipliers(hqp_qp_solver *s, const double *multipliers) {
    for (int i = 0; i < s->rows; i++) {
        const double value = multipliers[i];
        if (value == 0.0) continue;
        if (s->count == s->n) return 0;
        s->side[i] = value > 0.0 ? 1 : -1;
        s->multiplier[s->count] = fabs(value);
        s->id[s->count++] = i;
    }
    return 1;
}

int hqp_qp_is_proven(hqp_qp_solver *s, const hqp_qp *qp, const double *x, const double *multipliers) {
    if (begin(s, qp) != HQP_QP_SOLVED) return 0;
    hqp_qp_clear(s);
    if (!take_multipliers(s, multipliers)) return 0;
    memcpy(s->x, x, (size_t)s->n * sizeof(double));
    memcpy(s->kept, x, (size_t)s->n * sizeof(double));
    hqp_qp_find_values(s);
    return excess(s, s->scratch) <= 1.0 && is_feasible(s);
}
