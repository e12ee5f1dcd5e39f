/*
 * The dual active-set method of Goldfarb and Idnani (1983): rows that x breaks are brought to their bound one
 * by one, and held rows are released where their multiplier falls to zero. The triangle T of T T^T = M M^T is
 * updated; what is left of a row beside the held ones is computed as a vector, so that rows at a small angle
 * are told apart.
 */
#include <string.h>

#include "hqp_qp_internal.h"

static const double BROKEN = 1e-10;    /* a row is broken beyond this, relative to bound and norm, */
static const double ROUNDING = 1e-14;  /* and this part of sum |c_j x_j| */
static const double WAIVED = 100.0;    /* times that, of a row that held ones determine */
static const double CANCELLED = 1e-4;  /* of |m|^2: less left of it is computed twice */
static const double DEPENDENT = 1e-20; /* of |m|^2: less left of it is none */
static const double SEATED = 1e-10;    /* of |m|^2: more must be left of a row that is only guessed */
static const double NO_PULL = 1e-24;   /* of |m|^2: a smaller pull, squared, is rounding */
enum { POLISHES = 12 };                /* Newton steps that take out rounding, at most */

/* What of the distance of a row to its bound counts as none, without what rounding makes of its sum. */
static double least_allowance(const hqp_qp_solver *s, int id, double bound) {
    const double norm = s->norm[id];
    return BROKEN * ((norm < 1.0 ? norm : 1.0) + fabs(bound));
}

double hqp_qp_allowance(const hqp_qp_solver *s, int id, double bound) {
    return least_allowance(s, id, bound) + ROUNDING * hqp_qp_terms(s, id, s->x);
}

/* No row is held. */
void hqp_qp_clear(hqp_qp_solver *s) {
    s->count = 0;
    for (int k = 0; k <= s->n; k++) s->slot[k] = k;
    memset(s->side, 0, (size_t)s->rows);
}

/* Row `id` becomes the one behind the held ones. */
static void place(hqp_qp_solver *s, int id, int side) {
    const int k = s->count, slot = s->slot[k];
    double *m = hqp_qp_row(s, k);
    memset(m, 0, (size_t)s->ld * sizeof(double));
    hqp_qp_add_row(s, id, side, m);
    if (s->is_diagonal) {
        for (int j = s->first[id]; j < s->last[id]; j++) m[j] *= s->inverse[j];
    } else {
        hqp_qp_forward(s, m, s->first[id]);
    }
    s->begins[slot] = s->first[id];
    s->ends[slot] = s->is_diagonal ? s->last[id] : s->n;
    while (s->ends[slot] > s->begins[slot] && m[s->ends[slot] - 1] == 0.0) s->ends[slot]--;
    s->size[slot] = hqp_qp_inner(m + s->begins[slot], m + s->begins[slot], s->ends[slot] - s->begins[slot]);
    s->id[k] = id;
    s->side[id] = (signed char)side;
    s->multiplier[k] = 0.0;
}

/* Pointers to four lines of T, and the inverses of their diagonal entries. */
static void four_lines(const hqp_qp_solver *s, int i, const double **line, double *inverse) {
    for (int k = 0; k < 4; k++) {
        line[k] = hqp_qp_line(s, i + k);
        inverse[k] = s->end[s->slot[i + k]];
    }
}

/* y = T^-1 y */
HQP_QP_INNER static void solve(const hqp_qp_solver *s, double *y) {
    const double *line[4];
    double inverse[4];
    int i = 0;
    for (; i + 4 <= s->count; i += 4) {
        four_lines(s, i, line, inverse);
        hqp_qp_forward4(line, inverse, y, 0, i);
    }
    for (; i < s->count; i++) y[i] = (y[i] - hqp_qp_inner(hqp_qp_line(s, i), y, i)) * s->end[s->slot[i]];
}

/* y = T^-T y */
HQP_QP_INNER static void solve_transposed(const hqp_qp_solver *s, double *y) {
    const double *line[4];
    double inverse[4];
    int i = s->count;
    for (; i % 4; i--) {
        y[i - 1] *= s->end[s->slot[i - 1]];
        hqp_add(y, -y[i - 1], hqp_qp_line(s, i - 1), i - 1);
    }
    for (i -= 4; i >= 0; i -= 4) {
        four_lines(s, i, line, inverse);
        hqp_qp_backward4(line, inverse, y, 0, i);
    }
}

/* to -= M^T y. Rows with wide windows, which begin anywhere, are taken together four by four. */
HQP_QP_INNER static void subtract(const hqp_qp_solver *s, const double *y, double *to) {
    const double *row[4];
    double factor[4];
    int wide = 0;
    for (int k = 0; k < s->count; k++) {
        const int slot = s->slot[k], from = s->begins[slot], to_end = s->ends[slot];
        const double *m = s->M + (ptrdiff_t)slot * s->ld;
        if (2 * (to_end - from) < s->n) {
            hqp_add(to + from, -y[k], m + from, to_end - from);
            continue;
        }
        factor[wide] = y[k];
        row[wide++] = m;
        if (wide < 4) continue;
        hqp_qp_take_off(to, factor, row, s->n);
        wide = 0;
    }
    for (int k = 0; k < wide; k++) hqp_add(to, -factor[k], row[k], s->n);
}

/* to = M v, v zero outside of [from, to_end). Wide rows are taken four at a time. */
HQP_QP_INNER static void multiply(const hqp_qp_solver *s, const double *v, int from, int to_end, double *to) {
    const double *row[4];
    int at[4], wide = 0;
    double sum[4];
    for (int k = 0; k < s->count; k++) {
        const int slot = s->slot[k];
        const int first = s->begins[slot] > from ? s->begins[slot] : from;
        const int last = s->ends[slot] < to_end ? s->ends[slot] : to_end;
        const double *m = s->M + (ptrdiff_t)slot * s->ld;
        if (2 * (last - first) < to_end - from) {
            to[k] = first < last ? hqp_qp_inner(m + first, v + first, last - first) : 0.0;
            continue;
        }
        row[wide] = m + from;
        at[wide++] = k;
        if (wide < 4) continue;
        hqp_qp_inner4(row, v + from, to_end - from, sum);
        for (int l = 0; l < 4; l++) to[at[l]] = sum[l];
        wide = 0;
    }
    for (int l = 0; l < wide; l++) to[at[l]] = hqp_qp_inner(row[l], v + from, to_end - from);
}

/* Line of T of the row behind, but for its end. */
static void reduce(hqp_qp_solver *s) {
    const int slot = s->slot[s->count];
    double *line = hqp_qp_line(s, s->count);
    multiply(s, hqp_qp_row(s, s->count), s->begins[slot], s->ends[slot], line);
    solve(s, line);
}

/* s->pull and s->rest of the row behind. Returns |rest|^2. */
static double find_rest(hqp_qp_solver *s) {
    const int count = s->count, n = s->n;
    double *line = hqp_qp_line(s, count), *rest = s->rest, *more = s->scratch;
    memcpy(s->pull, line, (size_t)count * sizeof(double));
    solve_transposed(s, s->pull);
    memcpy(rest, hqp_qp_row(s, count), (size_t)n * sizeof(double));
    subtract(s, s->pull, rest);
    const double left = hqp_qp_inner(rest, rest, n);
    if (count == 0 || left > CANCELLED * s->size[s->slot[count]]) return left;
    multiply(s, rest, 0, n, more);
    solve(s, more);
    hqp_add(line, 1.0, more, count);
    solve_transposed(s, more);
    hqp_add(s->pull, 1.0, more, count);
    subtract(s, more, rest);
    return hqp_qp_inner(rest, rest, n);
}

/* The row behind is held. */
static void hold(hqp_qp_solver *s, double left) {
    const int k = s->count++;
    const double end = sqrt(left);
    hqp_qp_line(s, k)[k] = end;
    s->end[s->slot[k]] = 1.0 / end;
}

/* Make lines [drop, lines) of T a triangle again, whose columns are one too many, by rotations of columns. */
HQP_QP_INNER static void rotate(hqp_qp_solver *s, int drop, int lines) {
    for (int i = drop; i < lines; i++) {
        double *line = hqp_qp_line(s, i), carry = line[drop];
        const int full = i < s->count ? i : s->count;
        for (int c = drop; c < full; c++) {
            const double right = line[c + 1];
            line[c] = s->cosine[c] * carry + s->sine[c] * right;
            carry = s->cosine[c] * right - s->sine[c] * carry;
        }
        if (i >= s->count) continue;
        const double right = line[i + 1], end = sqrt(carry * carry + right * right);
        s->cosine[i] = carry / end;
        s->sine[i] = right / end;
        line[i] = end;
        s->end[s->slot[i]] = 1.0 / end;
    }
}

/* Release the held row at `drop`; `behind`: there is a row behind the held ones, which moves up, too. */
static void release(hqp_qp_solver *s, int drop, int behind) {
    const int slot = s->slot[drop], lines = s->count - 1 + behind;
    s->side[s->id[drop]] = 0;
    for (int i = drop; i < lines; i++) {
        s->id[i] = s->id[i + 1];
        s->multiplier[i] = s->multiplier[i + 1];
        s->slot[i] = s->slot[i + 1];
    }
    s->slot[lines] = slot;
    s->count--;
    s->iterations++;
    rotate(s, drop, lines);
}

/* How far the multiplier of the row behind can grow; *first: who is released then, or -1. */
static double ratio(const hqp_qp_solver *s, double length, int *first) {
    const double size = s->size[s->slot[s->count]];
    *first = -1;
    for (int k = 0; k < s->count; k++) {
        const double pull = s->pull[k];
        if (!(pull > 0.0) || hqp_qp_is_equality(s, s->id[k])) continue;
        if (pull * pull * s->size[s->slot[k]] <= NO_PULL * size || !(s->multiplier[k] < length * pull))
            continue;
        length = s->multiplier[k] / pull;
        *first = k;
    }
    return length;
}

static int is_out_of_time(const hqp_qp_solver *s) {
    if (s->iterations >= s->iteration_limit) return 1;
    return s->qp.time_limit > 0.0 && hqp_now() - s->began >= s->qp.time_limit;
}

/* Bring row `id`, broken by `missing`, to its bound. HQP_QP_CLASH: held rows do not let it, and s->pull says
 * how. */
static hqp_qp_end bring(hqp_qp_solver *s, int id, int side, double missing) {
    double *move = s->step, own = 0.0, left;
    place(s, id, side);
    reduce(s);
    memset(move, 0, (size_t)s->ld * sizeof(double));
    for (int first = 0;;) {
        if (is_out_of_time(s)) {
            s->side[id] = 0;
            return HQP_QP_CAPPED;
        }
        left = find_rest(s);
        const int is_free = s->count < s->n && left > DEPENDENT * s->size[s->slot[s->count]];
        const double length = ratio(s, is_free ? missing / left : INFINITY, &first);
        if (!(length < INFINITY)) return HQP_QP_CLASH;
        for (int k = 0; k < s->count; k++) {
            s->multiplier[k] -= length * s->pull[k];
            if (s->multiplier[k] < 0.0 && !hqp_qp_is_equality(s, s->id[k])) s->multiplier[k] = 0.0;
        }
        own += length;
        if (is_free) {
            hqp_add(move, -length, s->rest, s->n);
            missing -= length * left;
        }
        if (first < 0) break;
        release(s, first, 1);
    }
    s->multiplier[s->count] = own;
    hold(s, left);
    s->iterations++;
    hqp_qp_backward(s, move);
    hqp_add(s->x, 1.0, move, s->n);
    return HQP_QP_DONE;
}

/* The row that x breaks most, by distance; -1: none. */
static int most_broken(hqp_qp_solver *s, int *side, double *missing) {
    double most = 0.0;
    int worst = -1;
    hqp_qp_find_values(s);
    for (int i = 0; i < s->rows; i++) {
        const double value = s->value[i];
        if (value <= s->hi[i] && value >= s->lo[i]) continue;
        if (s->side[i] || s->waived[i]) continue;
        const int at = value > s->hi[i] ? 1 : -1;
        const double bound = hqp_qp_bound(s, i, at), beyond = at * (value - bound);
        if (beyond <= most * s->norm[i] || beyond <= least_allowance(s, i, bound)) continue;
        if (beyond <= hqp_qp_allowance(s, i, bound)) continue;
        most = beyond / s->norm[i];
        *missing = beyond;
        *side = at;
        worst = i;
    }
    return worst;
}

/* The row on its way in is a combination of held ones: it is let be if it is missed by little. */
static int waive(hqp_qp_solver *s, int id, int side, double missing) {
    if (missing > WAIVED * hqp_qp_allowance(s, id, hqp_qp_bound(s, id, side))) return 0;
    s->side[id] = 0;
    s->waived[id] = 1;
    return 1;
}

/* Bring rows to their bound until x breaks none. What rounding left in x is no clash. */
hqp_qp_end hqp_qp_descend(hqp_qp_solver *s) {
    double missing = 0.0;
    int side = 0, refreshed = -1;
    for (;;) {
        const int broken = most_broken(s, &side, &missing);
        if (broken < 0) return HQP_QP_DONE;
        const hqp_qp_end end = bring(s, broken, side, missing);
        if (end == HQP_QP_CAPPED) return end;
        if (end == HQP_QP_DONE || waive(s, broken, side, missing)) continue;
        if (refreshed == s->iterations) return end;
        s->side[broken] = 0;
        hqp_qp_refresh(s);
        refreshed = s->iterations;
    }
}

/* Hold a row that is guessed to be at its bound, unless held ones determine it. */
void hqp_qp_seat(hqp_qp_solver *s, int id, int side) {
    if (s->count >= s->n) return;
    place(s, id, side);
    reduce(s);
    const double *line = hqp_qp_line(s, s->count), size = s->size[s->slot[s->count]];
    double left = size - hqp_qp_inner(line, line, s->count);
    if (!(left > CANCELLED * size)) left = find_rest(s);
    if (left > SEATED * size) {
        hold(s, left);
    } else {
        s->side[id] = 0;
    }
}

/* Multipliers and x for the held rows; those with a negative multiplier are released. */
void hqp_qp_settle(hqp_qp_solver *s) {
    double *u = s->u, *multiplier = s->multiplier;
    const int n = s->n;
    for (int j = 0; j < n; j++) u[j] = s->shift[j] * s->center[j] - s->qp.q[j];
    hqp_qp_forward(s, u, 0);
    for (;;) {
        int worst = -1;
        double least = 0.0;
        multiply(s, u, 0, n, multiplier);
        for (int k = 0; k < s->count; k++) {
            const int id = s->id[k], side = s->side[id];
            multiplier[k] -= side * hqp_qp_bound(s, id, side);
        }
        solve(s, multiplier);
        solve_transposed(s, multiplier);
        for (int k = 0; k < s->count; k++) {
            const double strength = multiplier[k] * s->norm[s->id[k]];
            if (strength >= least || hqp_qp_is_equality(s, s->id[k])) continue;
            least = strength;
            worst = k;
        }
        if (worst < 0) break;
        release(s, worst, 0);
    }
    memcpy(s->x, u, (size_t)n * sizeof(double));
    subtract(s, multiplier, s->x);
    hqp_qp_backward(s, s->x);
}

/* Newton's step of x and multipliers for the held rows, from what is left of the gradient (down = -gradient)
 * and of the distance to their bounds (gap); it takes the place of both. */
void hqp_qp_newton(hqp_qp_solver *s, double *down, double *gap) {
    hqp_qp_forward(s, down, 0);
    multiply(s, down, 0, s->n, s->pull);
    for (int k = 0; k < s->count; k++) gap[k] = s->pull[k] - gap[k];
    solve(s, gap);
    solve_transposed(s, gap);
    subtract(s, gap, down);
    hqp_qp_backward(s, down);
}

/* Take a Newton step of x and multipliers. Returns how far, in allowances, the held row that is missed most
 * was missed before. */
static double polish(hqp_qp_solver *s) {
    double *down = s->gradient, *gap = s->scratch, most = 0.0;
    hqp_qp_bend(s, s->x, down);
    for (int i = 0; i < s->n; i++) {
        down[i] = -down[i] - s->qp.q[i] - s->shift[i] * (s->x[i] - s->center[i]);
    }
    for (int k = 0; k < s->count; k++) {
        const int id = s->id[k], side = s->side[id];
        hqp_qp_add_row(s, id, -s->multiplier[k] * side, down);
        const double bound = hqp_qp_bound(s, id, side);
        gap[k] = side * (bound - hqp_qp_value(s, id, s->x));
        most = fmax(most, fabs(gap[k]) / hqp_qp_allowance(s, id, bound));
    }
    hqp_qp_newton(s, down, gap);
    hqp_add(s->x, 1.0, down, s->n);
    hqp_add(s->multiplier, 1.0, gap, s->count);
    return most;
}

/* Take out of x and multipliers what rounding left there. */
void hqp_qp_refresh(hqp_qp_solver *s) {
    double before = INFINITY;
    for (int k = 0; k < POLISHES; k++) {
        const double missed = polish(s);
        if (!(missed > 1.0) || !(missed < before)) break;
        before = missed;
    }
    for (int k = 0; k < s->count; k++) {
        if (s->multiplier[k] < 0.0 && !hqp_qp_is_equality(s, s->id[k])) s->multiplier[k] = 0.0;
    }
}
