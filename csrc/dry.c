#include "dry.h"
#include "spd.h"

#include <math.h>
#include <string.h>

enum { STICKS = 0, UP = 1, DOWN = -1, PIVOTS = 64, SWEEPS = 100 };

/* Rounding of an impulse beside the largest, and of a speed beside those before. */
static const double SLACK = 1e-12;

/* p for a guess of which joints stick: those come to rest, the others have all of their friction. */
static int guess(int n, const double *A, const double *v, const double *most, const int *state, double *p) {
    int held[DRY_MAX], k = 0;
    double S[DRY_MAX * DRY_MAX], b[DRY_MAX];
    for (int i = 0; i < n; i++) {
        p[i] = state[i] * most[i];
        if (state[i] == STICKS) held[k++] = i;
    }
    for (int a = 0; a < k; a++) {
        b[a] = -v[held[a]];
        for (int j = 0; j < n; j++) b[a] -= A[n * held[a] + j] * p[j];
        for (int c = 0; c < k; c++) S[k * a + c] = A[n * held[a] + held[c]];
    }
    if (spd_factor(k, S) < 0) return -1;
    spd_solve(k, S, b);
    for (int a = 0; a < k; a++) p[held[a]] = b[a];
    return 0;
}

/* What contradicts the guess, and what it should be instead. Returns how many do. */
static int contradictions(int n, const double *A, const double *v, const double *most, const double *p,
                          const int *state, int *wanted) {
    int count = 0;
    double scale = 0.0;
    for (int i = 0; i < n; i++) scale = fmax(scale, fabs(v[i]));
    for (int i = 0; i < n; i++) {
        wanted[i] = state[i];
        if (state[i] == STICKS) {
            if (fabs(p[i]) > most[i] * (1.0 + SLACK)) wanted[i] = p[i] > 0.0 ? UP : DOWN;
        } else if (most[i] > 0.0) {
            double u = v[i];
            for (int j = 0; j < n; j++) u += A[n * i + j] * p[j];
            if (state[i] * u > SLACK * scale) wanted[i] = STICKS;
        }
        count += wanted[i] != state[i];
    }
    return count;
}

/* One coordinate after the other: slow, but each step takes energy away, so it may end at any time. */
static void sweep(int n, const double *A, const double *v, const double *most, double *p) {
    memset(p, 0, (size_t)n * sizeof *p);
    for (int k = 0; k < SWEEPS; k++)
        for (int i = 0; i < n; i++) {
            double u = v[i];
            for (int j = 0; j < n; j++) u += A[n * i + j] * p[j];
            p[i] = fmax(-most[i], fmin(most[i], p[i] - u / A[n * i + i]));
        }
}

/* Principal pivoting (Judice and Pires 1994): all contradictions are mended at once as long as they get
 * fewer, and the first of them alone otherwise. */
void dry_impulse(int n, const double *A, const double *v, const double *most, double *p,
                 unsigned char *stuck) {
    int state[DRY_MAX], wanted[DRY_MAX], fewest = n + 1, patience = 3;
    for (int i = 0; i < n; i++) {
        const int slides = fabs(p[i]) >= most[i] * (1.0 - SLACK);
        state[i] = !slides ? STICKS : p[i] < 0.0 ? DOWN : UP;
    }
    for (int k = 0; k < PIVOTS && guess(n, A, v, most, state, p) == 0; k++) {
        const int count = contradictions(n, A, v, most, p, state, wanted);
        if (count == 0) {
            for (int i = 0; i < n; i++) stuck[i] = state[i] == STICKS;
            return;
        }
        if (count < fewest) fewest = count, patience = 3;
        const int all = patience-- > 0;
        for (int i = 0; i < n; i++)
            if (state[i] != wanted[i]) {
                state[i] = wanted[i];
                if (!all) break;
            }
    }
    memset(stuck, 0, (size_t)n);
    sweep(n, A, v, most, p);
}
