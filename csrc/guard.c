#include "guard.h"

#include <math.h>
#include <string.h>

#include "bounds.h"
#include "redundant.h"

enum { JOINTS = SERIAL_MAX_JOINTS, TASK = REDUNDANT_MAX_TASK };

/* Shares of the margin that the posture keeps, and in which the end stop is. */
static const double KEPT = 0.5, STOP = 0.2;
/* How far ahead a motor is to be inside its limits [s]: it brakes with a time constant of this. */
static const double HORIZON = 0.05;
/* A motor of which the posture moves less than this share is hardly asked. */
static const double SOFT = 0.01;
/* Damping ratio of the end stop. */
static const double ABSORBED = 0.5;
enum { SWEEPS = 12 };

/* rows = diag(M) M^-1 N, from M^-1 = L^-T L^-1 and M^-1 N = M^-1 - M^-1 J^T J#^T. */
static void mobility(guard *g) {
    const int n = g->n, m = g->m;
    double inverse[JOINTS * JOINTS];
    for (int i = 0; i < n; i++)
        for (int j = i; j < n; j++) {
            double sum = 0.0;
            for (int k = j; k < n; k++) sum += g->root[n * k + i] * g->root[n * k + j];
            inverse[n * i + j] = inverse[n * j + i] = sum;
        }
    for (int i = 0; i < n; i++) {
        const double scale = g->M[n * i + i];
        double hand[TASK] = {0.0}; /* row i of M^-1 J^T */
        for (int a = 0; a < m; a++)
            for (int k = 0; k < n; k++) hand[a] += inverse[n * i + k] * g->J[n * a + k];
        for (int j = 0; j < n; j++) {
            double sum = inverse[n * i + j];
            for (int a = 0; a < m; a++) sum -= hand[a] * g->inverse[n * a + j];
            g->rows[n * i + j] = scale * sum;
        }
    }
}

/* Torque of one motor's end stop, `depth` inside it and moving out of it at `rate`. */
static double stopped(double depth, double rate, double zone, double limit, double inertia) {
    if (!(depth > 0.0)) return 0.0;
    const double stiffness = limit / zone, damping = 2.0 * ABSORBED * sqrt(stiffness * inertia);
    const double absorbed = rate < 0.0 ? -damping * rate * fmin(depth / zone, 1.0) : 0.0;
    return fmin(stiffness * depth + absorbed, limit);
}

void guard_update(guard *g) {
    const int n = g->n, m = g->m;
    const double kept = KEPT * g->margin, zone = STOP * g->margin;
    double load[JOINTS];
    mobility(g);
    for (int i = 0; i < n; i++) load[i] = g->bias[i] + g->friction[i] * g->qd[i];
    for (int i = 0; i < n; i++) {
        const double inertia = g->M[n * i + i], q = g->q[i], qd = g->qd[i];
        double own = 0.0; /* what the motor does without tau */
        for (int k = 0; k < n; k++) own -= g->rows[n * i + k] * load[k];
        for (int a = 0; a < m; a++) own -= inertia * g->inverse[n * a + i] * g->drift[a];
        const bounds_interval b = bounds_c(g->lower[i] + kept, g->upper[i] - kept, q, qd, HORIZON);
        g->floor[i] = inertia * b.lower - own;
        g->ceiling[i] = inertia * b.upper - own;
        g->stop[i] = stopped(g->lower[i] + zone - q, qd, zone, g->limit[i], inertia) -
                     stopped(q - g->upper[i] + zone, -qd, zone, g->limit[i], inertia);
    }
}

static double clamp(double x, double most) { return fmax(fmin(x, most), -most); }

void guard_hold(const guard *g, const double *tau, double *add) {
    const int n = g->n, m = g->m;
    double moved[JOINTS], lambda[JOINTS] = {0.0}; /* rows tau, with the lambdas so far */
    for (int i = 0; i < n; i++) {
        moved[i] = 0.0;
        for (int k = 0; k < n; k++) moved[i] += g->rows[n * i + k] * tau[k];
    }
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        double change = 0.0;
        for (int i = 0; i < n; i++) {
            const double own = g->rows[n * i + i], rest = moved[i] - own * lambda[i];
            const double lack = rest < g->floor[i]     ? g->floor[i] - rest
                                : rest > g->ceiling[i] ? g->ceiling[i] - rest
                                                       : 0.0;
            const double wanted = clamp(lack / (own + SOFT), g->limit[i]), step = wanted - lambda[i];
            lambda[i] = wanted;
            change += fabs(step);
            if (step != 0.0)
                for (int k = 0; k < n; k++) moved[k] += g->rows[n * k + i] * step;
        }
        if (change == 0.0) break;
    }
    double felt[TASK] = {0.0}; /* what the lambdas would do to the hand */
    for (int a = 0; a < m; a++)
        for (int i = 0; i < n; i++) felt[a] += g->inverse[n * a + i] * lambda[i];
    for (int i = 0; i < n; i++) {
        add[i] = lambda[i];
        for (int a = 0; a < m; a++) add[i] -= g->J[n * a + i] * felt[a];
    }
}
