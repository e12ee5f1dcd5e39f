/*
 * Variables fixed ahead of their turn: an equality with a single nonzero, a x_c = b, takes column c out of
 * the problem.
 *
 * Levels that can all be met exactly need no order among them: whoever meets all of them is minimal. So the
 * fixings of the levels up to `fixed_through` are taken first, and the sweep goes on in the other columns; it
 * has to meet each of these levels exactly, with independent rows and no clash. Where it cannot, this was a
 * wrong guess, and the same sweep runs again with all columns.
 */
#include "hqp_internal.h"

#include <string.h>

enum { WORTHWHILE = 4 }; /* at least every fourth variable */

static int is_in_play(const hqp_solver *s, int c) {
    return !s->fixed_column[c] && !s->unseen[c];
}

/* place[c], column[place]: columns in play, in their order; fixed columns have fixed_column[c] set */
static void number_columns(hqp_solver *s) {
    const int before = s->width;
    int others = 0;
    s->width = 0;
    for (int c = 0; c < s->n; c++) {
        s->place[c] = s->width;
        if (!is_in_play(s, c)) continue;
        others |= s->column[s->width] != c;
        s->column[s->width++] = c;
    }
    for (int c = s->n; c <= s->ld; c++) s->place[c] = s->width;
    if (others || s->width != before) hqp_forget_reflectors(s);
}

static void forget(hqp_solver *s) {
    memset(s->fixed_column, 0, (size_t)s->n);
    memset(s->fixing, 0, (size_t)s->total);
    s->fixed_through = -1;
}

/* All columns that rows see are in play. */
void hqp_unfix(hqp_solver *s) {
    forget(s);
    number_columns(s);
}

/*
 * Take the variables out of play that no row sees: with rounding they would move, the farther the less rows
 * differ. Where these are others than before the factorisation is of no use. Returns whether they are.
 */
int hqp_leave_unseen(hqp_solver *s) {
    enum { BEFORE = 1, NOW = 2 };
    int changed = 0;
    s->unseen_count = s->n;
    for (int c = 0; c < s->n; c++) s->unseen[c] |= NOW;
    for (int i = s->total - 1; i >= 0 && s->unseen_count; i--) {
        const real *row = hqp_row(s, s->given, i);
        if (s->kind[i] == HQP_IDLE) continue;
        for (int c = s->given.first[i]; c < s->given.last[i] && c < s->n; c++) {
            if (row[c] == 0.0 || !(s->unseen[c] & NOW)) continue;
            s->unseen[c] &= BEFORE;
            s->unseen_count--;
        }
    }
    for (int c = 0; c < s->n; c++) {
        changed |= s->unseen[c] == BEFORE || s->unseen[c] == NOW;
        s->unseen[c] = s->unseen[c] >= NOW;
    }
    if (changed) {
        hqp_unfix(s);
        s->resumable = 0;
    }
    return changed;
}

/* Choose the fixings, among all levels but the last; none, where that is not worthwhile. */
static void choose(hqp_solver *s) {
    int count = 0;
    forget(s);
    for (int level = 0; s->row0[level + 1] < s->total; level++) {
        for (int i = s->row0[level]; i < s->row0[level + 1]; i++) {
            const int c = s->only[i];
            if (s->kind[i] != HQP_EQUALITY || c < 0 || s->fixed_column[c]) continue;
            s->fixing[i] = s->fixed_column[c] = 1;
            s->fixed_through = level;
            count++;
        }
    }
    if (WORTHWHILE * count < s->n) forget(s);
    number_columns(s);
}

/*
 * Decide about fixings where the levels from `first` on have changed, and put x there. Returns the level to
 * begin at: 0 where the columns in play are no longer those of the last solve.
 */
int hqp_fix(hqp_solver *s, int first) {
    const int before = s->fixed_through;
    if (before < 0 || before >= first) {
        choose(s);
        if (before < 0 && s->fixed_through < first) hqp_unfix(s); /* these are known not to do */
        if (before >= 0 || s->fixed_through >= 0) first = 0;
    }
    for (int i = 0; i < s->row0[s->fixed_through + 1]; i++) {
        if (s->fixing[i]) s->x[s->only[i]] = s->ub[i] / hqp_row(s, s->given, i)[s->only[i]];
    }
    return first;
}

/* to = a row of `given` in the columns in play */
void hqp_gather(const hqp_solver *s, real *to, const real *row) {
    if (s->width == s->n) {
        memcpy(to, row, (size_t)s->ld * sizeof(real));
        return;
    }
    for (int j = 0; j < s->width; j++) to[j] = row[s->column[j]];
    for (int j = s->width; j < s->ld; j++) to[j] = 0.0;
}

/* The way back, in place, with 0 in the columns that are not in play. */
void hqp_scatter(const hqp_solver *s, real *row) {
    if (s->width == s->n) return;
    for (int c = s->n - 1; c >= 0; c--) row[c] = is_in_play(s, c) ? row[s->place[c]] : 0.0;
}
