/*
 * What is tried, one way after the other, until x is proven: sweeps (hqp_sweep.c), walks (hqp_walk.c), both
 * with levels as one, and joins (hqp_join.c); exactly at first, and in the end from cold.
 */
#include "hqp_internal.h"

#include <string.h>

static const real FARTHEST = 1e7; /* the length of an x of which the rounding hides what rows lack */
static const real TRACE = 1e-12;  /* times 1 + |x|: rounding of the start, of which x may bear a trace */
static const real COARSER = 1000.0, COARSEST = 1e-3; /* times the rank that was asked for */
static const real FINER = 10.0;                      /* that over this: the next try */
static const real FINEST = 100.0;                    /* that over this, for what nothing else solves */
enum { ATTEMPTS = 3 };                               /* walks of the levels that are not proven */
/* times 1 + slack: a multiplier for which others should give way, and which tells that they still should */
static const real HARD = 1e6, STILL_HARD = 1e3;
/* times norm of row (1 + |x|): what a row is missed by, more than rounding, and clearly */
static const real FAINT = 1e-12, MISSED = 1e-5;
/* times 1 + slack: more than a level may change by on the way to the face, and on a walk from there */
static const real MOVED = 1e-7, WALKED = 1e-12;
static const real HOPELESS = 1e5;  /* times what counts as none: left of a gradient, no rounding of doubles */
static const real LENIENT = 100.0; /* lenience for an answer that is the same from any start */
static const real FAR = 1e-9;      /* rounding times |x| that may be seen in a slack */
static const real SAME = 1e-10;    /* times 1 + |x|: no distance */
static const real CLOSER = 0.1;    /* times rounding, which rows are minded by where such an x is put right */
enum { USUAL = 16, LEAST_USUAL = 128 }; /* times n, and at least: iterations that nearly all do with */
enum { GLANCE = 16 };                   /* iterations to see whether joins are needed */
enum { SOFT_GLANCE = 3 };               /* times n / 4: the same, to find x with two levels as one */
enum { LEAST_SOFTENED = 2, MOST_SOFTENED = 3 }; /* levels as one on the way */

/* Iterations that nearly all solves do with. */
int hqp_usual(int n) {
    return USUAL * n > LEAST_USUAL ? USUAL * n : LEAST_USUAL;
}

/* Level by level from `first` on. */
static hqp_status walk_from(hqp_solver *s, int first) {
    hqp_status status = HQP_SOLVED;
    memset(s->forced, 0, (size_t)s->total);
    s->levels_done = first;
    for (int p = first; p < s->levels; p++) {
        s->rank_at[p] = s->rank;
        const hqp_status of_level = hqp_walk(s, p);
        if (of_level == HQP_SOLVED && status == HQP_SOLVED) s->levels_done = p + 1;
        if (of_level != HQP_SOLVED) status = of_level;
        if (of_level == HQP_ITERATION_CAP) break;
    }
    s->rank_at[s->levels] = s->rank;
    return status;
}

/* x, with its guesses, is a proven answer of this rank, found elsewhere: there is no factorisation for it. */
void hqp_end_here(hqp_solver *s, int rank) {
    hqp_find_values(s);
    s->warm = 1;
    s->levels_done = s->levels;
    s->rank_at[s->levels] = rank;
}

enum outcome { LOST, SETTLED, PROVEN }; /* SETTLED: x is likely, its proof is missing */

/* By the multipliers at hand. */
static int is_proven(hqp_solver *s) {
    hqp_find_values(s);
    return hqp_prove(s, s->levels) == s->levels;
}

/* x is looked for with levels as one, in the first try, and has to be proven without: whether it is with them
 * does not matter. */
static int is_on_the_way(const hqp_solver *s) {
    return s->is_exact && s->is_lax;
}

/*
 * Sweep, and prove the answer. Where that fails because rounding left too much while x was far away, or over
 * many solves with a factorisation that was kept, one more sweep with the same sets puts it right. So it does
 * where x is so long that rounding may be seen: rows that are broken by less than counts otherwise are
 * brought to their bounds.
 */
static enum outcome sweep(hqp_solver *s, int first, int repair) {
    s->is_rough = 0;
    s->hardest = 0.0;
    hqp_rewind(s, first);
    if (!hqp_sweep(s, first, repair)) return LOST;
    if (is_on_the_way(s)) {
        hqp_find_values(s);
        return SETTLED;
    }
    const int proven = is_proven(s);
    const real rounding = s->settings.rounding;
    const int is_far = rounding * s->x_norm > FAR;
    if (proven && !s->is_lax && !is_far) return PROVEN; /* small weights cost digits, and so does a long x */
    if (s->is_doubtful) return SETTLED;
    memcpy(s->kept, s->x, (size_t)s->ld * sizeof(real));
    hqp_rewind(s, 0);
    s->polishing = 1;
    s->settings.rounding = is_far ? CLOSER * rounding : rounding;
    const int settled = hqp_sweep(s, 0, 0);
    s->settings.rounding = rounding;
    s->polishing = 0;
    if (settled && is_proven(s)) return PROVEN;
    if (proven || !settled) {
        memcpy(s->x, s->kept, (size_t)s->ld * sizeof(real));
        hqp_find_values(s);
    }
    return proven ? PROVEN : SETTLED;
}

/* The first method: sweep, at first with fixings taken ahead of their turn. */
static enum outcome try_sweeps(hqp_solver *s, int *first) {
    const int left = s->settings.max_iterations - s->iterations, limit = left - left / 8;
    const int begin = s->iterations;
    s->iteration_limit = begin + limit / 2;
    *first = hqp_fix(s, *first);
    if (s->fixed_through >= 0) {
        const enum outcome outcome = sweep(s, *first, 1);
        if (outcome != LOST) return outcome;
        hqp_unfix(s);
        memcpy(s->x, s->start.x, (size_t)s->ld * sizeof(real));
        *first = 0;
    }
    s->iteration_limit = begin + limit;
    return sweep(s, *first, 1);
}

/* Prove the first `count` levels by projection, with a factorisation that hqp_resolve cannot take up. */
static int is_proven_by_descent(hqp_solver *s, int count) {
    const int rank = hqp_rank(s), leans = s->leans;
    const real least = s->least;
    s->resumable = 0;
    s->levels_done = hqp_prove_by_descent(s, count);
    if (leans >= 0) {
        s->leans = leans;
        s->least = least;
    }
    s->rank_at[s->levels] = rank; /* with the rows that the levels hold, and of all columns */
    return s->levels_done == s->levels;
}

static int is_confirmed(hqp_solver *s) {
    return s->settings.rank <= s->rank_asked || hqp_confirm(s);
}

/* Whether x, where the walk ended, is proven as it is or after a sweep with the walk's sets, which puts right
 * what rounding left. If not, s->levels_done levels are, and the next can be walked again. */
static int is_walk_proven(hqp_solver *s, hqp_status of_walk) {
    const int rank = hqp_rank(s);
    memcpy(s->kept, s->x, (size_t)s->ld * sizeof(real));
    if (of_walk == HQP_SOLVED && sweep(s, 0, 0) == PROVEN && is_confirmed(s)) return 1;
    memcpy(s->x, s->kept, (size_t)s->ld * sizeof(real));
    hqp_unfix(s);
    s->rank_at[s->levels] = rank;
    return is_proven_by_descent(s, of_walk == HQP_ITERATION_CAP ? s->levels_done : s->levels);
}

/* The second method: walk, from what the sweep found, of which levels before `first` are proven, or else from
 * the start; and again from the first level without proof. */
static hqp_status try_walk(hqp_solver *s, enum outcome of_sweep, int first) {
    hqp_status status = HQP_NOT_PROVEN;
    s->iteration_limit = s->settings.max_iterations;
    if (of_sweep == LOST) {
        hqp_go_to(s, s->start);
        hqp_rewind(s, first);
    }
    const int is_brief = s->is_exact || hqp_any_strict(s) || s->leans >= 0; /* there are other ways yet */
    const int attempts = is_brief ? 1 : ATTEMPTS;
    for (int i = 0; i < attempts && status != HQP_SOLVED && status != HQP_ITERATION_CAP; i++) {
        status = walk_from(s, first);
        if (is_on_the_way(s)) break;
        if (is_walk_proven(s, status))
            status = HQP_SOLVED;
        else if (status == HQP_SOLVED)
            status = HQP_NOT_PROVEN;
        first = s->levels_done;
    }
    hqp_find_values(s);
    return status;
}

/* A sweep finds what is to be held, and not what is to be fitted: rows to fit should be known for half of x.
 */
static int is_worth_a_sweep(const hqp_solver *s) {
    int known = 0;
    for (int i = s->total - 1; i >= 0 && 2 * known < s->n; i--)
        known += s->kind[i] == HQP_EQUALITY || (s->kind[i] == HQP_RANGE && s->guess_side[i]);
    return 2 * known >= s->n;
}

/* A sweep of so many iterations at most. */
static enum outcome glance(hqp_solver *s, int most) {
    const int limit = s->iterations + most;
    s->iteration_limit = limit < s->settings.max_iterations ? limit : s->settings.max_iterations;
    return sweep(s, 0, 1);
}

/* Whether x is proven by projection. */
static int is_proven_here(hqp_solver *s) {
    const int proven = is_proven_by_descent(s, s->levels);
    hqp_find_values(s);
    return proven;
}

/* What a proof says of x. */
typedef struct verdict {
    int is_rough, leans, levels_done;
    real least, hardest;
} verdict;

static verdict get_verdict(const hqp_solver *s) {
    return (verdict){s->is_rough, s->leans, s->levels_done, s->least, s->hardest};
}

static void set_verdict(hqp_solver *s, verdict of) {
    s->is_rough = of.is_rough;
    s->leans = of.leans;
    s->levels_done = of.levels_done;
    s->least = of.least;
    s->hardest = of.hardest;
}

/* x is where the first try could not prove it the last time. */
static int is_refuted(const hqp_solver *s) {
    real most = 0.0;
    for (int i = 0; i < s->ld; i++) most = fmax(most, fabs(s->x[i] - s->refuted.x[i]));
    return s->refuted.any && most <= SAME * (1.0 + s->x_norm);
}

/* The same at the minimum of the face that x is on, where multipliers may have any size. */
static int is_face_proven(hqp_solver *s) {
    if (!hqp_fit_face(s) || (s->is_exact && is_refuted(s))) return 0;
    const int proven = is_proven_here(s);
    if (!proven && s->is_exact) {
        memcpy(s->refuted.x, s->x, (size_t)s->ld * sizeof(real));
        s->refuted.any = 1;
        s->refuted.for_good = s->levels_done == s->levels - 1; /* of the last level no more is asked */
    }
    return proven;
}

/* The same or, where that does not go well, where x is, which is seldom proven exactly. */
static int is_proven_fitted(hqp_solver *s) {
    const verdict before = get_verdict(s);
    memcpy(s->kept, s->x, (size_t)s->ld * sizeof(real));
    const int is_fitted = is_face_proven(s);
    if (is_fitted && (s->is_exact || !s->is_rough)) return 1;
    const verdict fitted = get_verdict(s);
    hqp_swap_rows(s->x, s->kept, (int)s->ld);
    set_verdict(s, before);
    if (s->is_exact) {
        hqp_find_values(s);
        return 0;
    }
    const int is_proven = is_proven_here(s);
    if (!is_fitted || (is_proven && !s->is_rough)) return is_proven;
    memcpy(s->x, s->kept, (size_t)s->ld * sizeof(real));
    hqp_find_values(s);
    set_verdict(s, fitted);
    s->is_projected = 0;
    return 1;
}

/* The same of an x that was found with this level and the next ones as one. */
static int is_proven_softened(hqp_solver *s, int level) {
    const int proven = is_proven_fitted(s);
    if (proven && s->leans >= level) s->leans = -1;
    return proven;
}

/* The level is missed by more than a small weight leaves of it, or takes from the one before. */
static int is_clearly_missed(const hqp_solver *s, int level) {
    for (int i = s->first_row[level]; i < s->first_row[level + 1]; i++) {
        if (fabs(s->lacking[i]) > MISSED * s->norm[i] * (1.0 + s->x_norm)) return 1;
    }
    return 0;
}

/* Whether a short sweep from the start with two levels as one, both of which x must miss clearly, finds x,
 * which is proven without. */
static int is_found_softened(hqp_solver *s) {
    memcpy(s->x, s->start.x, (size_t)s->ld * sizeof(real));
    hqp_find_values(s);
    const hqp_run run = hqp_last_missed(s, LEAST_SOFTENED);
    if (!run.count) return 0;
    hqp_soften(s, run);
    const int level = run.first;
    const int half = (s->settings.max_iterations - s->iterations) / 2, most = SOFT_GLANCE * s->n / 4;
    const enum outcome outcome = glance(s, half < most ? half : most);
    hqp_harden(s);
    if (outcome != LOST && is_proven_softened(s, level) && is_clearly_missed(s, level) &&
        is_clearly_missed(s, level + 1))
        return 1;
    hqp_bring_back(s);
    return 0;
}

/* The first try could not prove x: keep the best of these. */
static void keep_close(hqp_solver *s, int off_face) {
    if (!s->is_exact || hqp_any_joined(s)) return;
    if (s->close.any && hqp_is_kept_better(s, s->close.at.x)) return;
    hqp_keep(s, s->close.at);
    s->close.any = 1;
    s->close.off_face = off_face;
}

/* Both methods, one after the other. */
static hqp_status try_both(hqp_solver *s, int first) {
    hqp_keep(s, s->start);
    s->resumable = s->levels_done = s->levels;
    s->softened = 0;
    if (!is_worth_a_sweep(s)) {
        if (s->fixed_through >= 0) first = 0;
        hqp_unfix(s); /* the walk needs the columns that the last solve had fixed */
        return try_walk(s, LOST, first);
    }
    const enum outcome outcome = try_sweeps(s, &first);
    if (outcome == PROVEN && is_confirmed(s)) return HQP_SOLVED;
    if (outcome == SETTLED && is_on_the_way(s)) return HQP_SOLVED;
    if (outcome != LOST && is_proven_here(s)) return HQP_SOLVED;
    if (outcome == SETTLED && s->is_exact) { /* a walk from there seldom ends where there is an exact proof */
        keep_close(s, 0);
        return HQP_NOT_PROVEN;
    }
    /* a walk that begins with what was held needs fewer working sets */
    if (outcome == LOST && !s->before.warm) {
        s->softened = is_found_softened(s);
        if (s->softened) return HQP_SOLVED;
    }
    const hqp_status status = try_walk(s, outcome, outcome == LOST ? 0 : s->levels_done);
    if (status == HQP_NOT_PROVEN) keep_close(s, 0);
    return status;
}

/* Whether the last level would gain so much, were others to give way by next to nothing. */
static int is_hard(const hqp_solver *s, real limit) {
    real squares = 0.0;
    for (int i = s->first_row[s->levels - 1]; i < s->total; i++) squares += s->lacking[i] * s->lacking[i];
    return s->hardest > limit * (1.0 + sqrt(squares));
}

/* No level is known to lean on a row. */
static void forget_leaning(hqp_solver *s) {
    s->leans = -1;
    memset(s->then, 0, (size_t)s->levels * sizeof(real));
}

/* Whether x is proven at the minimum of its face with more digits. */
static int is_face_proven_extended(hqp_solver *s) {
    if (!hqp_prove_extended(s)) return 0;
    forget_leaning(s);
    return 1;
}

/* Iterations that are usual, from here on. */
static int usual_limit(const hqp_solver *s) {
    const int usual = s->iterations + hqp_usual(s->n), most = s->settings.max_iterations;
    return usual < most ? usual : most;
}

/* No more than the last level is not proven where x is, and a walk of it leads to where it is. */
static int is_proven_walked(hqp_solver *s) {
    if (s->levels_done < s->levels - 1) return 0;
    s->iteration_limit = usual_limit(s);
    return walk_from(s, s->levels - 1) == HQP_SOLVED && is_proven_here(s);
}

/* The same from the minimum of the face, if it changes no level above. */
static int is_proven_from_face(hqp_solver *s) {
    memcpy(s->face, s->x, (size_t)s->ld * sizeof(real));
    return is_proven_walked(s) && hqp_first_apart(s, s->face, WALKED) >= s->levels - 1;
}

/* Whether x, which was found with all of the last levels that have a slack as one, is proven as well as any x
 * may be: at the minimum of its face or where it is, and there with more lenience if the way to the face
 * changes no level above the last. More digits are asked where on the face the last level alone is not
 * proven, or another one nearly is: before that of a face that is elsewhere, and else after it. It is nearly
 * always the same from any start. */
static int is_proven_from_any_start(hqp_solver *s) {
    hqp_keep(s, s->start);
    const int is_fitted = hqp_fit_face(s);
    s->is_exact = 0;
    hqp_find_values(s);
    const int is_on_face = is_fitted && hqp_first_apart(s, s->start.x, MOVED) >= s->levels - 1;
    int proven = is_fitted && is_proven_here(s);
    const int is_last = is_fitted && s->levels_done >= s->levels - 1;
    const int is_close = is_last || (is_fitted && s->left < HOPELESS);
    if (!proven && is_last) proven = is_proven_from_face(s);
    if (!proven) {
        hqp_go_to(s, s->start);
        hqp_find_values(s);
        proven = is_close && !is_on_face && is_face_proven_extended(s);
    }
    if (!proven) {
        s->lenience = is_on_face ? LENIENT : 1.0;
        proven = is_proven_here(s);
        s->lenience = 1.0;
    }
    if (!proven) proven = is_close && is_on_face && is_face_proven_extended(s);
    s->is_exact = 1;
    if (proven) s->leans = -1;
    return proven;
}

/* As many of the last levels that have a slack at x as may be one on the way. */
static hqp_run find_most_missed(hqp_solver *s) {
    const hqp_run most = hqp_last_missed(s, MOST_SOFTENED);
    return most.count ? most : hqp_last_missed(s, LEAST_SOFTENED);
}

static int is_same_run(hqp_run a, hqp_run b) {
    return a.first == b.first && a.count == b.count;
}

/* Back to the x that was put aside, and proven so far as this. */
static void bring_back(hqp_solver *s, int leans, real least) {
    hqp_bring_back(s);
    s->levels_done = s->levels;
    s->leans = leans;
    s->least = least;
}

/*
 * Look for x with these levels as one, from where x is, and prove it without. That x stands, whatever was
 * found before, where these are as many of its levels as may be. Returns 0 where there is none, and x stays
 * where it is.
 */
static int try_run_softened(hqp_solver *s, hqp_run run) {
    const int leans = s->leans, most = s->settings.max_iterations;
    const real least = s->least;
    if (!run.count) return 0;
    hqp_soften(s, run);
    s->warm = 1;
    s->settings.max_iterations = usual_limit(s);
    const int found = try_both(s, 0) == HQP_SOLVED;
    s->settings.max_iterations = most;
    hqp_harden(s);
    if (found && is_proven_from_any_start(s)) return 1;
    bring_back(s, leans, least);
    return 0;
}

/* The same with those of the solve before that led to its answer, as long as that is a hard one: what is
 * tried first elsewhere would be thrown away for it. */
static int try_foreseen(hqp_solver *s) {
    const hqp_run run = s->foreseen;
    s->foreseen.count = 0;
    if (!s->is_exact || !run.count || hqp_any_joined(s)) return 0;
    const int leans = s->leans;
    const real least = s->least;
    if (!try_run_softened(s, run)) return 0;
    if (!is_same_run(find_most_missed(s), run)) {
        bring_back(s, leans, least);
        return 0;
    }
    if (is_hard(s, STILL_HARD)) s->foreseen = run;
    return 1;
}

/* The same with as many levels as may be. */
static int try_most_softened(hqp_solver *s) {
    const hqp_run run = find_most_missed(s);
    if (!try_run_softened(s, run)) return 0;
    s->foreseen = run;
    return 1;
}

/*
 * Look for x with the last two levels that have a slack as one, or the last three, which needs no large
 * multipliers, and prove it without. The better of this and of what was found before stands. Where nothing is
 * proven yet, what led to a proof the last time comes first: mostly the other does not.
 */
static hqp_status try_softened(hqp_solver *s, hqp_status status) {
    const int leans = s->leans, begin = status != HQP_SOLVED && s->softest ? s->softest : LEAST_SOFTENED;
    const real least = s->least;
    const hqp_run tried = s->is_exact ? find_most_missed(s) : (hqp_run){0};
    s->softest = 0;
    if (s->is_exact && !s->is_late && try_most_softened(s)) return HQP_SOLVED;
    for (int k = 0; k < 2 && !s->is_late; k++) {
        const int count = k == 0 ? begin : LEAST_SOFTENED + MOST_SOFTENED - begin;
        const hqp_run run = hqp_last_missed(s, count);
        if (!run.count || (status == HQP_SOLVED && is_same_run(run, tried))) continue;
        hqp_soften(s, run);
        s->warm = 1;
        const int found = try_both(s, 0) == HQP_SOLVED;
        hqp_harden(s);
        const int proven = is_proven_softened(s, run.first);
        if (found && !proven && status != HQP_SOLVED) keep_close(s, s->refuted.for_good);
        if (proven && (status != HQP_SOLVED || !hqp_is_kept_better(s, s->apart.at.x))) {
            s->softest = count;
            return HQP_SOLVED;
        }
        if (status == HQP_SOLVED) bring_back(s, leans, least);
    }
    return status;
}

/* Two thirds of the iterations, or as many as are usual. */
static int share(const hqp_solver *s, int most) {
    const int part = most - most / 3, enough = part > hqp_usual(s->n) ? part : hqp_usual(s->n);
    return enough < most ? enough : most;
}

/* Both methods, with two thirds of the iterations or as many as are usual; where they find nothing that is
 * proven well, the other way; and where they were cut short by that, on with the rest. */
static hqp_status try_first(hqp_solver *s, int first) {
    const int most = s->settings.max_iterations, is_foreseen = s->foreseen.count > 0;
    if (try_foreseen(s)) return HQP_SOLVED;
    s->settings.max_iterations = share(s, most);
    const hqp_status status = try_both(s, is_foreseen ? 0 : first);
    s->settings.max_iterations = most;
    if (status == HQP_SOLVED ? s->softened || (!s->is_rough && !is_hard(s, HARD))
                             : s->is_late || s->iterations >= most)
        return status;
    const hqp_status softened = try_softened(s, status);
    const int is_cut = softened == HQP_ITERATION_CAP && s->iterations < most && !s->is_late;
    return is_cut ? try_both(s, 0) : softened;
}

/* Whether x, however it was found, is proven with no levels joined. */
static int is_proven_apart(hqp_solver *s) {
    if (s->is_late) return 0;
    hqp_part(s);
    memset(s->joined, 0, (size_t)s->levels);
    s->is_lax = 1;
    const int proven = is_proven_fitted(s);
    s->is_lax = 0;
    return proven;
}

/* x is proven with joins that an earlier solve needed. Whether it is found without them now, and no worse. */
static int needs_no_joins(hqp_solver *s) {
    signed char joined[HQP_MOST_LEVELS];
    const int leans = s->leans;
    if (!hqp_set_apart(s, joined)) return 0;
    hqp_unfix(s); /* what was fixed was so with the joins */
    s->leans = -1;
    const enum outcome outcome = glance(s, GLANCE);
    if (outcome == PROVEN ? is_confirmed(s) : outcome == SETTLED && is_proven_by_descent(s, s->levels)) {
        if (!hqp_may_gain(s) || !hqp_is_worth_joins(s, joined)) return 1;
    }
    hqp_take_back(s, joined);
    s->leans = leans;
    s->levels_done = s->levels;
    return 0;
}

static hqp_status try_again(hqp_solver *s, int is_first) {
    forget_leaning(s);
    return is_first ? try_first(s, 0) : try_both(s, 0);
}

/*
 * What was tried ended like this: again with levels joined, where it failed, or where a level leans on rows.
 * Of two proven answers the one with the join is kept if the level below gains by it. Where that cannot be
 * told nothing is proven. That levels are joined for want of a proof, or by a smaller weight than in the
 * solve before, is not for the first try.
 */
static hqp_status weigh_joins(hqp_solver *s, hqp_status status) {
    int kept = 0, more = 1; /* more: no levels were joined in this solve yet */
    for (;; status = try_again(s, more)) {
        const int failed = s->levels_done;
        s->warm = 1;
        if (s->is_late && !kept) return status;
        if (status == HQP_SOLVED && more && needs_no_joins(s)) return status;
        if (status == HQP_SOLVED && hqp_weigh(s, kept)) {
            if (more && s->is_exact) hqp_unjoin(s);
            continue;
        }
        more = 0;
        if (kept) return hqp_choose(s, status);
        if (status == HQP_SOLVED) {
            if (!hqp_may_gain(s)) return status;
            if (s->strict[s->leans] == UNPROVEN) {
                const int level = s->leans;
                if (is_proven_apart(s)) return HQP_SOLVED;
                s->levels_done = level + 1;
                return HQP_NOT_PROVEN;
            }
            if (!hqp_try_join(s)) return status;
            kept = 1;
        } else if (s->is_exact) {
            return status;
        } else if (status == HQP_ITERATION_CAP ||
                   !(hqp_join_next(s, failed - 1) || hqp_join_next(s, failed) || hqp_part_last(s))) {
            return is_proven_apart(s) ? HQP_SOLVED : status;
        }
    }
}

/* What is tried first, and then joins. */
static hqp_status try_joined(hqp_solver *s, int first) {
    forget_leaning(s);
    return weigh_joins(s, try_first(s, first));
}

/* Put the start of the solve aside. */
static void keep_start(hqp_solver *s) {
    hqp_keep(s, s->before.at);
    memcpy(s->before.joined, s->joined, (size_t)s->levels);
    s->before.warm = s->warm;
    s->before.softest = s->softest;
    s->before.foreseen = s->foreseen;
}

/* Back to that. */
static void back_to_start(hqp_solver *s) {
    hqp_go_to(s, s->before.at);
    hqp_take_up(s, s->before.joined, 1);
    s->warm = s->before.warm;
    s->softest = s->before.softest;
    s->foreseen = s->before.foreseen;
}

/* x is proven with levels joined, which depends on the solve before. The answer that does not stands, where
 * it can be proven. */
static void try_apart(hqp_solver *s) {
    const int rank = hqp_rank(s);
    signed char joined[HQP_MOST_LEVELS];
    memcpy(joined, s->joined, (size_t)s->levels);
    hqp_keep(s, s->close.at);
    hqp_unjoin(s);
    if (try_most_softened(s)) return;
    hqp_go_to(s, s->close.at);
    memcpy(s->joined, joined, (size_t)s->levels);
    hqp_join(s);
    hqp_end_here(s, rank);
}

/* With two thirds of the iterations, as no proof may be that exact, or as many as are usual. */
static hqp_status try_exact(hqp_solver *s, int first) {
    const int most = s->settings.max_iterations;
    s->settings.max_iterations = share(s, most);
    s->is_exact = 1;
    s->close.any = s->refuted.any = 0;
    const hqp_status status = try_joined(s, first);
    if (status == HQP_SOLVED && hqp_any_joined(s) && !s->is_late) try_apart(s);
    s->is_exact = 0;
    s->settings.max_iterations = most;
    return status;
}

/* What that found and could not prove may be proven less exactly. */
static hqp_status try_close(hqp_solver *s) {
    if (!s->close.any || s->is_late) return HQP_NOT_PROVEN;
    hqp_unjoin(s);
    hqp_go_to(s, s->close.at);
    s->warm = 1;
    forget_leaning(s);
    const int proven = s->close.off_face ? is_proven_here(s) : is_proven_fitted(s);
    return proven ? weigh_joins(s, HQP_SOLVED) : HQP_NOT_PROVEN;
}

/* A level is missed by more than rounding and by less than is clear: along a direction that it hardly sees
 * its gradient is none although it could be met. */
static int is_faintly_missed(const hqp_solver *s) {
    for (int p = 0; p < s->levels && s->sees_faintly; p++) {
        real most = 0.0;
        for (int i = s->first_row[p]; i < s->first_row[p + 1]; i++) {
            if (s->kind[i] != HQP_IDLE) most = fmax(most, fabs(s->lacking[i]) / s->norm[i]);
        }
        if (most > FAINT * (1.0 + s->x_norm) && most <= MISSED * (1.0 + s->x_norm)) return 1;
    }
    return 0;
}

/*
 * Only what is proven is solved, and exactly if that can be done: of several answers that are proven less
 * well the start decides. What is not proven is tried once more from the start, less exactly, and then with
 * more digits, where an exact proof is not looked for first: that takes as long again, and as many answers
 * depend on the start. Where there are no more digits, rows at a tiny angle may be one row but for the
 * rounding of the data, which decides everything then: all is tried from cold with other ideas of rank, first
 * a finer one, and at last with the first. The one that led to a proof is kept.
 */
static hqp_status solve_by_rank(hqp_solver *s, int first) {
    const real rank = s->settings.rank, asked = s->rank_asked;
    const real coarser = COARSER * asked < COARSEST ? COARSER * asked : asked / COARSER;
    const real other = rank == asked ? coarser : asked, ranks[] = {rank, asked / FINER, other, rank};
    s->lenience = 1.0;
    if (!(hqp_length(s, s->x) < FARTHEST)) hqp_forget(s);
    memset(s->strict, 0, (size_t)s->levels);
    if (hqp_leave_unseen(s)) first = 0;
    keep_start(s);
    hqp_take_up(s, s->before.joined, 0);
    if (s->resumable < first) first = 0;
    if (first == 0) s->sees_faintly = 0;
    hqp_status status = HQP_FINENESS < 1.0 ? HQP_NOT_PROVEN : try_exact(s, first);
    if (status != HQP_SOLVED && try_close(s) == HQP_SOLVED) status = HQP_SOLVED;
    const int last = s->extended ? 0 : s->before.warm ? 3 : 2;
    for (int attempt = 0; attempt <= last; attempt++) {
        const int is_spent = attempt > 0 || s->is_late || s->iterations >= s->settings.max_iterations;
        if (status == HQP_SOLVED || (status == HQP_ITERATION_CAP && is_spent)) break;
        if (attempt > 1 && hqp_any_strict(s)) break; /* a coarser one is not what decides there */
        s->settings.rank = ranks[attempt];
        hqp_unjoin(s);
        hqp_forget(s);
        if (attempt == 0) back_to_start(s);
        status = try_joined(s, 0);
    }
    if (status != HQP_SOLVED || is_faintly_missed(s)) status = hqp_try_extended(s, status);
    if (status != HQP_SOLVED) s->settings.rank = rank;
    hqp_part(s);
    return status;
}

/* The same and, where that leaves it unsolved and there are more digits, all of it again from the start with
 * a finer idea of rank. */
static hqp_status solve_once(hqp_solver *s, int first) {
    const hqp_status status = solve_by_rank(s, first);
    const real rank = s->settings.rank, asked = s->rank_asked;
    if (status == HQP_SOLVED || status == HQP_ITERATION_CAP || !s->extended || s->is_late) return status;
    hqp_unjoin(s);
    hqp_forget(s);
    back_to_start(s);
    s->settings.rank = s->rank_asked = asked / FINEST;
    const hqp_status finer = solve_by_rank(s, 0);
    s->rank_asked = asked;
    if (finer != HQP_SOLVED) s->settings.rank = rank;
    return finer == HQP_SOLVED || finer == HQP_ITERATION_CAP ? finer : status;
}

/* From cold, but for variables that no row sees. */
static hqp_status solve_from_cold(hqp_solver *s) {
    memcpy(s->kept, s->x, (size_t)s->ld * sizeof(real));
    hqp_reset(s);
    for (int c = 0; c < s->n; c++) s->x[c] = s->unseen[c] ? s->kept[c] : 0.0;
    return solve_once(s, 0);
}

/* The start was so much longer than x that its rounding may be left there: of a row that could be met, a
 * slack which lower levels would take for one that is needed. */
static int bears_trace(const hqp_solver *s) {
    const real start = hqp_length(s, s->before.at.x);
    return s->settings.rounding * start > TRACE * (1.0 + hqp_length(s, s->x));
}

/* x is proven at the minimum of its face, or from there a walk of the last level leads to a proof. */
static hqp_status solve_on_face(hqp_solver *s) {
    s->lenience = 1.0;
    s->levels_done = 0;
    memset(s->strict, 0, (size_t)s->levels);
    hqp_leave_unseen(s);
    forget_leaning(s);
    hqp_find_values(s);
    if (hqp_fit_face(s) && is_proven_here(s)) return HQP_SOLVED;
    return is_proven_walked(s) ? HQP_SOLVED : HQP_NOT_PROVEN;
}

/* The same, once more where x bears a trace of the start; and where x has become so long that its rounding
 * hides what rows lack, a shorter one is looked for from cold. */
hqp_status hqp_solve_from(hqp_solver *s, int first) {
    if (s->only_face) return solve_on_face(s);
    hqp_status status = solve_once(s, first);
    if (status == HQP_SOLVED && bears_trace(s)) status = solve_once(s, 0);
    if (status != HQP_SOLVED || !s->before.warm || hqp_length(s, s->x) < FARTHEST) return status;
    const int rank = hqp_rank(s);
    hqp_keep(s, s->distant);
    if (solve_from_cold(s) == HQP_SOLVED && hqp_length(s, s->x) < FARTHEST) return HQP_SOLVED;
    hqp_reset(s);
    hqp_unfix(s);
    hqp_go_to(s, s->distant);
    hqp_end_here(s, rank);
    return HQP_SOLVED;
}
