/*
 * libFuzzer target over the solver's interface: any bytes are dimensions, settings, data and a sequence of
 * solves, resolves and resets. fuzz.py builds and runs it; seeds.py writes the same encoding:
 *
 *     n, levels, settings, per level (equalities, inequalities), all entries, then until the end:
 *     operation, first level of a resolve, number of changes, changes (level, part, entry, value)
 *
 * A value is one selector byte: below 32 an entry of `telling`, RAW eight bytes as they are, else a fraction.
 * Every array has its exact size on the heap, so that AddressSanitizer sees one step too far.
 */
#include "hqp.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_N = 6, MOST_LEVELS = 4, MOST_ROWS = 4, MOST_OPERATIONS = 5, RAW = 255, PARTS = 5 };
enum { OWN_SETTINGS = 1, NO_SLACKS = 2, ODD_DIMENSION = 4, FEW_ITERATIONS = 8 }; /* bits of `settings` */
enum { SOLVE, RESOLVE, RESET, OPERATIONS };

static const double telling[32] = {
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    2.0,
    -2.0,
    1e-6,
    -1e-6,
    1e-9,
    1e-13,
    -1e-13,
    1e6,
    -1e6,
    5e-324,
    -1e-310,
    1e-160,
    1e-100,
    1e50,
    -1e99,
    1e100,
    1.1e100,
    1e154,
    1e300,
    -1e308,
    DBL_MAX,
    -DBL_MAX,
    (double)NAN,
    3.0,
    (double)INFINITY,
    -(double)INFINITY,
};

static long solves[3]; /* refused, solved, with a remark */

typedef struct input {
    const uint8_t *at, *end;
} input;

typedef struct problem {
    int n, count, equalities[MOST_LEVELS], inequalities[MOST_LEVELS];
    double *part[MOST_LEVELS][PARTS]; /* A, b, C, lb, ub */
    hqp_level level[MOST_LEVELS];
} problem;

static void fail(const char *what) {
    fprintf(stderr, "broken promise: %s\n", what);
    abort();
}

static int byte(input *in) {
    return in->at < in->end ? *in->at++ : 0;
}

static double value(input *in) {
    const int selector = byte(in);
    double raw = 0.0;
    if (selector < 32) return telling[selector];
    if (selector != RAW) return (selector - 144) / 16.0;
    const size_t left = (size_t)(in->end - in->at), size = left < sizeof raw ? left : sizeof raw;
    memcpy(&raw, in->at, size);
    in->at += size;
    return raw;
}

static void *exact(int count, size_t size) {
    void *array = malloc((size_t)count * size);
    if (!array && count) abort();
    return array;
}

static int entries(const problem *p, int l, int part) {
    const int rows = part < 2 ? p->equalities[l] : p->inequalities[l];
    return part == 0 || part == 2 ? rows * p->n : rows;
}

static void read_problem(problem *p, input *in) {
    for (int l = 0; l < p->count; l++) {
        for (int k = 0; k < PARTS; k++) {
            const int size = entries(p, l, k);
            p->part[l][k] = exact(size, sizeof(double));
            for (int i = 0; i < size; i++) p->part[l][k][i] = value(in);
        }
        double *const *part = p->part[l];
        p->level[l] = (hqp_level){part[0], part[1], part[2], part[3], part[4], NULL};
    }
}

static void change(problem *p, input *in, int first) {
    const int l = first + byte(in) % (p->count - first), part = byte(in) % PARTS, size = entries(p, l, part);
    const int entry = byte(in);
    const double to = value(in);
    if (size) p->part[l][part][entry % size] = to;
}

static int has_nan(const problem *p, int first) {
    for (int l = first; l < p->count; l++) {
        for (int k = 0; k < PARTS; k++) {
            for (int i = 0; i < entries(p, l, k); i++) {
                if (isnan(p->part[l][k][i])) return 1;
            }
        }
    }
    return 0;
}

/* slack = what row . x lacks to lie in [lb, ub], unless a sum comes near overflow */
static void check_slack(const double *row, const double *x, int n, double lb, double ub, double slack) {
    double sum = 0.0, size = 0.0;
    for (int i = 0; i < n; i++) {
        sum += row[i] * x[i];
        size += fabs(row[i] * x[i]);
    }
    if (lb > ub) lb = ub = 0.5 * lb + 0.5 * ub; /* crossed by rounding */
    const double expected = sum < lb ? lb - sum : sum > ub ? ub - sum : 0.0;
    if (size < 1e300 && isfinite(expected) && !(fabs(slack - expected) <= 1e-13 * (size + fabs(expected))))
        fail("slack");
}

static void check_answer(const problem *p, const double *x, const hqp_info *info, int cap) {
    if (info->levels_done < 0 || info->levels_done > p->count) fail("levels_done is a number of levels");
    if (info->status == HQP_SOLVED && info->levels_done != p->count) fail("solved, but not all levels");
    if (info->status >= 0 && (info->rank < 0 || info->rank > p->n)) fail("rank");
    if (info->iterations < 0 || info->iterations > cap) fail("iterations are bounded");
    const double *w = info->w, *v = info->v;
    const signed char *active = info->active;
    for (int l = 0; l < p->count; l++) {
        const hqp_level *level = &p->level[l];
        for (int r = 0; r < p->equalities[l] && w; r++, w++) {
            if (info->status < 0 && !isnan(*w)) fail("w after a refusal");
            if (info->status >= 0) check_slack(level->A + r * p->n, x, p->n, level->b[r], level->b[r], *w);
        }
        for (int r = 0; r < p->inequalities[l] && v; r++, v++, active++) {
            if (*active < -1 || *active > 1) fail("active");
            if (info->status < 0 && (!isnan(*v) || *active)) fail("v and active after a refusal");
            if (info->status >= 0) check_slack(level->C + r * p->n, x, p->n, level->lb[r], level->ub[r], *v);
        }
    }
}

static void play(problem *p, input *in, hqp_solver *s, hqp_info *info, int cap) {
    double *x = exact(p->n, sizeof(double)), *good = exact(p->n, sizeof(double));
    const size_t bytes = (size_t)p->n * sizeof(double);
    memset(good, 0, bytes);
    for (int operation = 0; operation < MOST_OPERATIONS; operation++) {
        const int what = operation ? byte(in) % OPERATIONS : SOLVE;
        const int drawn = (int8_t)byte(in) / 16, given = what == RESOLVE ? drawn : 0;
        const int first = given < 0 ? 0 : given > p->count ? p->count : given;
        for (int i = byte(in) % 8; i > 0 && first < p->count; i--) change(p, in, first);
        if (what == RESET) {
            hqp_reset(s);
            memset(good, 0, bytes);
        }
        memset(x, 0x5a, bytes);
        const hqp_status status =
            what == RESOLVE ? hqp_resolve(s, p->level, given, x, info) : hqp_solve(s, p->level, x, info);
        solves[status < 0 ? 0 : status == HQP_SOLVED ? 1 : 2]++;
        if (status != info->status) fail("one status");
        if (!strcmp(hqp_status_name(status), "unknown status")) fail("a status with a name");
        if (has_nan(p, first) && status >= 0) fail("NaN is refused");
        for (int i = 0; i < p->n; i++) {
            if (!isfinite(x[i])) fail("x is finite");
        }
        if (status < 0 && memcmp(x, good, bytes) != 0) fail("x is the last good one");
        check_answer(p, x, info, cap);
        memcpy(good, x, bytes);
        if (in->at == in->end) break;
    }
    free(x);
    free(good);
}

static hqp_settings read_settings(input *in, int bits) {
    hqp_settings settings = hqp_default_settings();
    if (bits & OWN_SETTINGS) {
        settings.feasibility = value(in);
        settings.rank = value(in);
        settings.rounding = value(in);
    }
    if (bits & FEW_ITERATIONS) settings.max_iterations = 1 + byte(in) % 8;
    return settings;
}

static int is_part(double t) {
    return t > 0.0 && t < 1.0;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
    input in = {bytes, bytes + size};
    problem p = {0};
    p.n = 1 + byte(&in) % MOST_N;
    p.count = 1 + byte(&in) % MOST_LEVELS;
    const int bits = byte(&in);
    const hqp_settings t = read_settings(&in, bits);
    int v = 0, w = 0;
    for (int l = 0; l < p.count; l++) {
        w += p.equalities[l] = byte(&in) % (MOST_ROWS + 1);
        v += p.inequalities[l] = byte(&in) % (MOST_ROWS + 1);
    }
    hqp_dims dims = {p.n, p.count, p.equalities, p.inequalities};
    if (bits & ODD_DIMENSION) {
        static const int odd[] = {-1, INT_MIN, 16385, INT_MAX};
        int *const dimension[] = {&dims.n, &dims.levels, &p.equalities[0], &p.inequalities[0]};
        const int pick = byte(&in);
        *dimension[pick / 4 % 4] = odd[pick % 4];
    }
    hqp_solver *s = hqp_create(&dims, bits & (OWN_SETTINGS | FEW_ITERATIONS) ? &t : NULL);
    const int fits =
        !(bits & ODD_DIMENSION) && is_part(t.feasibility) && is_part(t.rank) && is_part(t.rounding);
    if (!!s != fits) fail("what is out of range is refused, and nothing else");
    if (!s) return 0;
    hqp_info info = {0};
    if (!(bits & NO_SLACKS)) {
        info.w = exact(w, sizeof(double));
        info.v = exact(v, sizeof(double));
        info.active = exact(v, 1);
    }
    read_problem(&p, &in);
    play(&p, &in, s, &info, t.max_iterations ? t.max_iterations : 384);
    for (int l = 0; l < p.count; l++) {
        for (int k = 0; k < PARTS; k++) free(p.part[l][k]);
    }
    free(info.w);
    free(info.v);
    free(info.active);
    hqp_destroy(s);
    return 0;
}

#ifdef REPLAY /* without libFuzzer: the files named on the command line, once each */
int main(int argc, char **argv) {
    static uint8_t bytes[1 << 16];
    for (int i = 1; i < argc; i++) {
        FILE *file = fopen(argv[i], "rb");
        if (!file) return perror(argv[i]), 2;
        const size_t size = fread(bytes, 1, sizeof bytes, file);
        fclose(file);
        LLVMFuzzerTestOneInput(bytes, size);
    }
    printf("%d inputs: %ld refused, %ld solved, %ld remarks\n", argc - 1, solves[0], solves[1], solves[2]);
    return 0;
}
#endif
