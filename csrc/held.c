#include "held.h"
#include "spd.h"

#include <math.h>
#include <string.h>

/* The chain beside a grip some of whose parts give all their strength: those are a constant push, the others,
 * `f` rows of the wrench, add to its inertia. */
typedef struct {
    int n, f, row[6];
    double A[DRY_MAX * DRY_MAX]; /* inverse inertia with the grip's damping and stiffness */
    double v[DRY_MAX];           /* speeds without friction */
    double B[DRY_MAX * 6];       /* h M^-1 J^T */
    double S[36], b[6];          /* S w = b without friction; S factored */
} gripped;

static double grip(const held *c, int row, double h) {
    return c->damping[row / 3] + h * c->stiffness[row / 3];
}

static double entry(const held *c, int i, int j) {
    return i < j ? c->inverse[c->n * i + j] : c->inverse[c->n * j + i];
}

/* h M^-1 J^T of one row of the wrench. */
static void response(const held *c, int row, double h, double *column) {
    for (int i = 0; i < c->n; i++) {
        double sum = 0.0;
        for (int j = 0; j < c->n; j++) sum += entry(c, i, j) * c->J[c->n * row + j];
        column[i] = h * sum;
    }
}

static double along(const held *c, int row, const double *v) {
    double sum = 0.0;
    for (int j = 0; j < c->n; j++) sum += c->J[c->n * row + j] * v[j];
    return sum;
}

/* (G^-1 + h J M^-1 J^T) w = G^-1 K e + r - J v with G = D + h K, for the rows that yield. */
static void hold(const held *c, double h, const double *v, const int *fixed, gripped *g) {
    const int n = g->n = c->n;
    double column[DRY_MAX];
    memcpy(g->v, v, (size_t)n * sizeof *v);
    g->f = 0;
    for (int k = 0; k < c->rows; k++) {
        if (!fixed[k / 3]) {
            g->row[g->f++] = k;
        } else if (c->wrench[k] != 0.0) {
            response(c, k, h, column);
            for (int i = 0; i < n; i++) g->v[i] += column[i] * c->wrench[k];
        }
    }
    const int f = g->f;
    for (int a = 0; a < f; a++) response(c, g->row[a], h, g->B + n * a);
    for (int a = 0; a < f; a++) {
        const int k = g->row[a];
        for (int e = 0; e <= a; e++) g->S[f * a + e] = along(c, k, g->B + n * e);
        g->S[f * a + a] += 1.0 / grip(c, k, h);
        g->b[a] = c->stiffness[k / 3] * c->error[k] / grip(c, k, h) + c->rate[k] - along(c, k, g->v);
    }
    spd_factor(f, g->S);
}

/* The wrench of those rows after impulses p (n) in the joints, NULL for none; adds what it does to v. */
static void pull(const held *c, double h, const gripped *g, const double *p, double *v) {
    double w[6];
    for (int a = 0; a < g->f; a++) {
        w[a] = g->b[a];
        for (int i = 0; p && i < g->n; i++) w[a] -= g->B[g->n * a + i] * p[i] / h;
    }
    spd_solve(g->f, g->S, w);
    for (int a = 0; a < g->f; a++) {
        c->wrench[g->row[a]] = w[a];
        for (int i = 0; i < g->n; i++) v[i] += g->B[g->n * a + i] * w[a];
    }
}

/* Friction feels the chain with the grip on it: A = M^-1 - B S^-1 B^T / h. */
static void rub(const held *c, double h, gripped *g, double *v) {
    const int n = g->n, f = g->f;
    double p[DRY_MAX], most[DRY_MAX], loose[DRY_MAX];
    unsigned char stuck[DRY_MAX];
    double Y[DRY_MAX * 6]; /* L^-1 B^T: S = L L^T */
    for (int j = 0; j < n; j++) {
        for (int a = 0; a < f; a++) Y[f * j + a] = g->B[n * a + j];
        spd_lower(f, g->S, Y + f * j);
        for (int i = 0; i <= j; i++) {
            double sum = 0.0;
            for (int a = 0; a < f; a++) sum += Y[f * i + a] * Y[f * j + a];
            g->A[n * i + j] = g->A[n * j + i] = entry(c, i, j) - sum / h;
        }
    }
    memcpy(loose, g->v, sizeof loose);
    pull(c, h, g, NULL, loose);
    for (int i = 0; i < n; i++) most[i] = h * c->dry[i], p[i] = h * c->friction[i];
    dry_impulse(n, g->A, loose, most, p, stuck);
    for (int i = 0; i < n; i++) {
        c->friction[i] = p[i] / h;
        v[i] = g->v[i];
        for (int j = 0; j < n; j++) v[i] += entry(c, i, j) * p[j];
    }
    pull(c, h, g, p, v);
    for (int i = 0; i < n; i++)
        if (stuck[i]) v[i] = 0.0; /* exactly: what sticks does not creep */
}

static double size(const double *w) {
    return sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
}

/* The part of the wrench that is the most times what the hand has strength for, brought there; or -1. The
 * other may be strong only because this one was. */
static int beyond(const held *c, int parts, const int *fixed) {
    double most = 1.0;
    int found = -1;
    for (int k = 0; k < parts; k++) {
        const double times = fixed[k] ? 0.0 : size(c->wrench + 3 * k) / c->strength[k];
        if (times > most) most = times, found = k;
    }
    for (int i = 0; found >= 0 && i < 3; i++) c->wrench[3 * found + i] /= most;
    return found;
}

void held_step(const held *c, double h, double *v) {
    const int n = c->n, parts = c->rows / 3;
    int fixed[2] = {0, 0}, strong, rubs = 0;
    double after[DRY_MAX];
    gripped g;
    for (int i = 0; i < n; i++) rubs |= c->dry[i] > 0.0;
    for (int k = 0; k < parts; k++)
        if (!(c->strength[k] > 0.0)) {
            fixed[k] = 1;
            for (int i = 0; i < 3; i++) c->wrench[3 * k + i] = 0.0;
        }
    do { /* a part that turns out too strong becomes a constant push: at most twice */
        hold(c, h, v, fixed, &g);
        if (rubs) {
            rub(c, h, &g, after);
        } else {
            memcpy(after, g.v, (size_t)n * sizeof *after);
            memset(c->friction, 0, (size_t)n * sizeof *c->friction);
            pull(c, h, &g, NULL, after);
        }
        strong = beyond(c, parts, fixed);
        if (strong >= 0) fixed[strong] = 1;
    } while (strong >= 0);
    memcpy(v, after, (size_t)n * sizeof *v);
    for (int k = 0; k < c->rows; k++) c->error[k] += h * (c->rate[k] - along(c, k, v));
}
