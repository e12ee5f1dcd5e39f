/*
 * Two levels as one, where rounding would have the last word between them.
 *
 * A level that holds a row by next to no multiplier loses next to nothing where the row is left, and the
 * level below may gain a lot. Which of both an exact hierarchy asks for depends on the last digits of the
 * data: feet that stand at one height but for 1e-8 m are enough. So such a level takes the next one in, with
 * a small weight. What it can lose by that is at most the weight times what the next one gains, and the
 * answer is that of a least-squares problem, which a proof finds optimal or not. The weight is a power of 4:
 * rows are scaled by its root, and back again without rounding.
 */
#include "hqp_internal.h"

#include <string.h>

/* times 1 + slack: what a level may lose by a join, and what the next one must gain at least */
static const real LOSS = 3e-7, GAIN = 4e-6;
/* times what the weight alone gains: what a join must gain at least */
static const real CLEARLY = 2.0;
/* times 1 + slack: a loss that counts as none */
static const real NOTHING = 1e-9;
/* times the root of half of a level's squared slack: how hard it may pull at a row that the one before holds
 */
static const real PULL = 16.0;
/* times a gradient that counts as none at x: where so much counted as none, multipliers are those of
 * elsewhere */
static const real ELSEWHERE = 10.0;
enum { LEAST = 15, MOST = 18 }; /* -log2 of the root of a weight; with less, rounding has the last word */

static void scale_row(hqp_solver *s, int id, real by) {
    real *row = hqp_row(s, s->given, id);
    for (int c = s->given.first[id]; c < s->given.last[id]; c++) row[c] *= by;
    s->norm[id] *= by;
    s->lb[id] *= by;
    s->ub[id] *= by;
    hqp_forget_row(s, id);
}

/* Scale the rows of levels that are joined to the one before, and number rows by the levels in use. */
static void scale(hqp_solver *s, int sign) {
    for (int p = 0; p + 1 < s->levels; p++) {
        for (int i = s->first_row[p + 1]; i < s->first_row[p + 2] && s->joined[p]; i++)
            scale_row(s, i, ldexp(1.0, -sign * s->joined[p]));
    }
}

int hqp_any_joined(const hqp_solver *s) {
    int any = 0;
    for (int p = 0; p < s->levels; p++) any |= s->joined[p];
    return any;
}

/* A level was joined, or could not be. */
int hqp_any_strict(const hqp_solver *s) {
    int any = 0;
    for (int p = 0; p < s->levels; p++) any |= s->strict[p];
    return any;
}

/* Number rows with the levels that are joined as one. */
void hqp_join(hqp_solver *s) {
    memcpy(s->row0, s->first_row, (size_t)(s->levels + 1) * sizeof(int));
    if (!hqp_any_joined(s)) return;
    scale(s, 1);
    for (int p = s->levels - 2; p >= 0; p--) {
        if (s->joined[p]) s->row0[p + 1] = s->row0[p + 2];
    }
    s->resumable = 0;
}

/* Take up the joins of the solve before that had the largest weight, and with that weight those that had a
 * `smaller` one: it is found from there, as more than one may be right by its own answer. */
void hqp_take_up(hqp_solver *s, const signed char *joined, int smaller) {
    for (int p = 0; p < s->levels; p++) s->joined[p] = joined[p] <= LEAST ? joined[p] : smaller ? LEAST : 0;
    hqp_join(s);
}

/* The caller's levels again, with values and slacks. */
void hqp_part(hqp_solver *s) {
    memcpy(s->row0, s->first_row, (size_t)(s->levels + 1) * sizeof(int));
    if (!hqp_any_joined(s)) return;
    scale(s, -1);
    hqp_find_values(s);
    s->resumable = 0;
}

/* Forget all joins. */
void hqp_unjoin(hqp_solver *s) {
    hqp_part(s);
    memset(s->joined, 0, (size_t)s->levels);
    memset(s->strict, 0, (size_t)s->levels);
}

/* What the value of the row lacks at this x. */
static real slack_at(const hqp_solver *s, int id, const real *x) {
    const real value = hqp_value(s, id, x);
    return fmax(s->lb[id] - value, 0.0) + fmin(s->ub[id] - value, 0.0);
}

/* Half of the squared slack of the caller's level at this x. */
static real half_square_at(const hqp_solver *s, int level, const real *x) {
    real sum = 0.0;
    for (int i = s->first_row[level]; i < s->first_row[level + 1]; i++) {
        const real slack = slack_at(s, i, x);
        if (s->kind[i] != HQP_IDLE) sum += 0.5 * slack * slack;
    }
    return sum;
}

static real half_square(const hqp_solver *s, int level) {
    return half_square_at(s, level, s->x);
}

/* Whether the level after this one gains by the answer `joined` over the one `apart`. */
static int gains(const hqp_solver *s, int level, const real *joined, const real *apart) {
    const real size = sqrt(2.0 * half_square_at(s, level + 1, apart));
    return sqrt(2.0 * half_square_at(s, level + 1, joined)) < size - GAIN * (1.0 + size);
}

/*
 * What the weight 2^-2k alone may gain of half of the next level's square: rows that the level meets apart
 * from the join are missed by next to nothing, and the next level has a multiplier for each. That is no gain.
 */
static real gain_by_weight(const hqp_solver *s, int level, int k, const real *joined, const real *apart) {
    real squares = 0.0;
    for (int i = s->first_row[level]; i < s->first_row[level + 1]; i++) {
        const real change = slack_at(s, i, joined) - slack_at(s, i, apart);
        if (s->kind[i] != HQP_IDLE) squares += change * change;
    }
    return ldexp(squares, 2 * k);
}

/* Whether `joined` leaves a row that the level holds in the answer apart, whose guesses are at hand. */
static int leaves_a_row(const hqp_solver *s, int level, const real *joined) {
    const real x_norm = hqp_length(s, joined);
    for (int i = 0; i < s->first_row[level]; i++) {
        if (s->guess_held_at[i] != level || s->kind[i] != HQP_RANGE) continue;
        if (!hqp_touches_with(s, i, s->guess_held_side[i], hqp_value(s, i, joined), x_norm)) return 1;
    }
    return 0;
}

/* The same by leaving a row, and by more than the weight alone, 2^-2k, at next to no cost. */
static int is_better(const hqp_solver *s, int level, int k, const real *joined, const real *apart) {
    if (!leaves_a_row(s, level, joined)) return 0;
    const real gain = half_square_at(s, level + 1, apart) - half_square_at(s, level + 1, joined);
    if (!(gain > CLEARLY * gain_by_weight(s, level, k, joined, apart))) return 0;
    const real size = sqrt(2.0 * half_square_at(s, level, apart));
    return sqrt(2.0 * half_square_at(s, level, joined)) <= size + LOSS * (1.0 + size) &&
           gains(s, level, joined, apart);
}

/* Whether the levels before this one are as small at x as at the answer apart from joins. */
static int loses_nothing(const hqp_solver *s, int level) {
    for (int p = 0; p < level; p++) {
        const real size = sqrt(2.0 * half_square_at(s, p, s->apart.at.x));
        if (!(sqrt(2.0 * half_square(s, p)) <= size + NOTHING * (1.0 + size))) return 0;
    }
    return 1;
}

/* With these slacks, -log2 of the root of the weight that the next level may have; more than MOST: none. */
static int needed(hqp_solver *s, int level) {
    const real size = sqrt(2.0 * half_square(s, level)), gain = half_square(s, level + 1);
    int k = LEAST;
    while (k <= MOST && ldexp(gain, -2 * k) > LOSS * size * (1.0 + size)) k++;
    return k;
}

/* Join the level with the next one, whose rows are scaled by 2^-k, and what that one holds. */
static void lower(hqp_solver *s, int level, int k) {
    s->joined[level] = (signed char)k;
    for (int i = 0; i < s->first_row[level + 1]; i++) {
        if (s->guess_held_at[i] == level + 1) s->guess_held_at[i] = (short)level;
    }
    hqp_join(s);
}

/* The same in the place of what was joined; k > MOST: part them. */
static void set(hqp_solver *s, int level, int k) {
    hqp_part(s);
    s->strict[level] = k > MOST ? PARTED : UNPROVEN;
    if (k <= MOST) {
        lower(s, level, k);
    } else {
        s->joined[level] = 0;
        hqp_join(s);
    }
}

/* Join a level with the next one, with the largest weight, if both have a slack; each pair once in a solve.
 * Returns whether that was done. */
int hqp_join_next(hqp_solver *s, int level) {
    if (level < 0 || level + 1 >= s->levels || s->strict[level]) return 0;
    const int have_slack = hqp_has_slack(s, level) && hqp_has_slack(s, level + 1);
    s->strict[level] = PARTED;
    if (s->joined[level] || s->joined[level + 1] || (level > 0 && s->joined[level - 1])) return 0;
    if (!have_slack) return 0;
    set(s, level, LEAST);
    return 1;
}

/* No proof was found: part the last levels that are joined. Returns whether there were any. */
int hqp_part_last(hqp_solver *s) {
    int level = s->levels - 1;
    while (level >= 0 && !s->joined[level]) level--;
    if (level >= 0) {
        set(s, level, MOST + 1);
        s->strict[level] = UNPROVEN;
    }
    return level >= 0;
}

/*
 * x is the answer with the joins. Where a level may have lost too much by one, give the next level less
 * weight, or part them. Returns whether that is to be solved. With `kept`, a join by which the next level has
 * gained nothing is left as it is, for by a smaller weight it gains no more; and once that one is parted,
 * what was kept is the answer.
 */
int hqp_weigh(hqp_solver *s, int kept) {
    int level = -1, k = 0;
    hqp_part(s);
    const int is_vain = kept && !gains(s, s->apart.level, s->x, s->apart.at.x);
    for (int p = 0; p + 1 < s->levels && level < 0 && !is_vain; p++) {
        if (!s->joined[p]) continue;
        k = needed(s, p);
        if (k > s->joined[p]) level = p;
    }
    hqp_join(s);
    if (level >= 0) set(s, level, k);
    return level >= 0 && !(kept && !s->joined[s->apart.level]);
}

static void swap_flags(signed char **a, signed char **b) {
    signed char *const kept = *a;
    *a = *b;
    *b = kept;
}

/* Exchange the guesses of the solve without joins for those of the one with this. */
static void exchange_guesses(hqp_solver *s) {
    short *const kept = s->guess_held_at;
    s->guess_held_at = s->apart.at.held_at;
    s->apart.at.held_at = kept;
    swap_flags(&s->guess_side, &s->apart.at.side);
    swap_flags(&s->guess_held_side, &s->apart.at.held_side);
}

/* Put x and its guesses aside. */
void hqp_keep(const hqp_solver *s, hqp_place to) {
    memcpy(to.x, s->x, (size_t)s->ld * sizeof(real));
    memcpy(to.side, s->guess_side, (size_t)s->total);
    memcpy(to.held_side, s->guess_held_side, (size_t)s->total);
    memcpy(to.held_at, s->guess_held_at, (size_t)s->total * sizeof(short));
}

/* Go to what was put aside there. */
void hqp_go_to(hqp_solver *s, hqp_place from) {
    memcpy(s->x, from.x, (size_t)s->ld * sizeof(real));
    memcpy(s->guess_side, from.side, (size_t)s->total);
    memcpy(s->guess_held_side, from.held_side, (size_t)s->total);
    memcpy(s->guess_held_at, from.held_at, (size_t)s->total * sizeof(short));
}

/* Put them aside for no join of one level. */
static void keep(hqp_solver *s) {
    s->apart.level = -1;
    hqp_keep(s, s->apart.at);
}

/* Back to what was put aside. */
void hqp_bring_back(hqp_solver *s) {
    exchange_guesses(s);
    memcpy(s->x, s->apart.at.x, (size_t)s->ld * sizeof(real));
    hqp_find_values(s);
    s->resumable = s->is_projected = 0;
}

static int pulls(const hqp_solver *s) {
    return s->leans >= 0 && s->leans + 1 < s->levels &&
           ldexp(PULL * sqrt(half_square(s, s->leans + 1)), -2 * LEAST) > s->least;
}

/* Whether the level below one that leans on rows may gain by leaving them, as far as a multiplier of many
 * tells. Multipliers that were found far from x say nothing of that. */
int hqp_may_gain(hqp_solver *s) {
    if (pulls(s)) return 1;
    for (int p = s->levels - 1; p >= 0; p--) {
        if (s->strict[p] == PARTED || !s->slack[p] || !(s->then[p] > ELSEWHERE * s->none[p])) continue;
        s->leans = p;
        s->least = 0.0;
    }
    return pulls(s);
}

/*
 * x is proven, and a level leans on rows: keep the answer, and join that level with the next one if that may
 * gain by it, for which it has to leave a row. Returns whether that was done.
 */
int hqp_try_join(hqp_solver *s) {
    const int level = s->leans;
    const int known = s->apart.level == level;
    const int may = needed(s, level) <= MOST && !hqp_holds_joined(s, level, LEAST);
    if (known)
        memcpy(s->apart.at.x, s->x, (size_t)s->ld * sizeof(real));
    else
        keep(s);
    s->apart.level = level;
    exchange_guesses(s);
    if (may && hqp_join_next(s, level)) return 1;
    exchange_guesses(s);
    return 0;
}

/*
 * The end of that. The answer with the join stands if it is proven, if the next level has gained by it, and
 * if the level has lost next to nothing; else the one before comes back. An answer with the join that is
 * better, and not proven, leaves none of both proven.
 */
hqp_status hqp_choose(hqp_solver *s, hqp_status status) {
    const int level = s->apart.level, joined = s->joined[level];
    if (joined) set(s, level, MOST + 1);
    exchange_guesses(s);
    const int better = joined && is_better(s, level, joined, s->x, s->apart.at.x);
    if (!(better && status == HQP_SOLVED)) {
        const int refuted = better && loses_nothing(s, level);
        memcpy(s->x, s->apart.at.x, (size_t)s->ld * sizeof(real));
        status = refuted ? HQP_NOT_PROVEN : HQP_SOLVED;
    }
    hqp_find_values(s);
    s->levels_done = status == HQP_SOLVED ? s->levels : level + 1;
    s->resumable = 0;
    return status;
}

/* x is proven with the joins of an earlier solve: put it aside, and part the levels. Returns whether any were
 * joined. */
int hqp_set_apart(hqp_solver *s, signed char *joined) {
    if (!hqp_any_joined(s)) return 0;
    memcpy(joined, s->joined, (size_t)s->levels);
    keep(s);
    hqp_part(s);
    memset(s->joined, 0, (size_t)s->levels);
    return 1;
}

/* Whether one of those joins, of which x is the proven answer without, gains anything. */
int hqp_is_worth_joins(const hqp_solver *s, const signed char *joined) {
    for (int p = 0; p + 1 < s->levels; p++) {
        if (joined[p] && is_better(s, p, joined[p], s->apart.at.x, s->x)) return 1;
    }
    return 0;
}

/* Back to that. */
void hqp_take_back(hqp_solver *s, const signed char *joined) {
    memcpy(s->joined, joined, (size_t)s->levels);
    hqp_join(s);
    hqp_bring_back(s);
}

/* The last `count` levels in a row that have a slack at x; none where so many are not, or levels are joined.
 */
hqp_run hqp_last_missed(hqp_solver *s, int count) {
    int level = s->levels, run = 0;
    while (level > 0 && run < count) run = hqp_has_slack(s, --level) ? run + 1 : 0;
    return (hqp_run){level, run < count || hqp_any_joined(s) ? 0 : count};
}

/* No levels are joined: join these, to find an x that is to be proven without, and put the one at hand aside.
 */
void hqp_soften(hqp_solver *s, hqp_run run) {
    const int level = run.first, count = run.count;
    keep(s);
    for (int q = 1; q < count; q++) s->joined[level + q - 1] = (signed char)(q * LEAST);
    for (int i = 0; i < s->first_row[level + count - 1]; i++) {
        const int at = s->guess_held_at[i];
        if (at > level && at < level + count) s->guess_held_at[i] = (short)level;
    }
    hqp_join(s);
    s->is_lax = 1;
}

/* Part them again. */
void hqp_harden(hqp_solver *s) {
    hqp_part(s);
    memset(s->joined, 0, (size_t)s->levels);
    s->is_lax = 0;
}

/* First level whose slack at x and at what was kept differ by more than this, or the number of levels. */
int hqp_first_apart(const hqp_solver *s, const real *kept_x, real most) {
    for (int p = 0; p < s->levels; p++) {
        const real now = sqrt(2.0 * half_square(s, p));
        const real kept = sqrt(2.0 * half_square_at(s, p, kept_x));
        if (fabs(now - kept) > most * (1.0 + fmin(now, kept))) return p;
    }
    return s->levels;
}

/* Whether the first level that differs is smaller at what was kept than at x. */
int hqp_is_kept_better(const hqp_solver *s, const real *kept_x) {
    const int p = hqp_first_apart(s, kept_x, LOSS);
    return p < s->levels && half_square_at(s, p, kept_x) < half_square(s, p);
}
