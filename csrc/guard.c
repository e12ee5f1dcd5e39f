#include "guard.h"

#include <math.h>
#include <string.h>

#include "bounds.h"
#include "redundant.h"
#include "spd.h"

enum { JOINTS = SERIAL_MAX_JOINTS, TASK = REDUNDANT_MAX_TASK };

/* How far ahead a motor is to be inside its limits [s]: it brakes with a time constant of this. */
static const double HORIZON = 0.07;
/* The same of its speed [s]. */
static const double SLOWING = 0.01;
/* A motor of which the posture moves less than this share is hardly asked. */
static const double SOFT = 0.002;
/* Largest lambda, in torques of its motor: N leaves little of it where the posture hardly moves the motor. */
static const double MOST = 20.0;
/* Part of the end stop in which its spring is at the motor's limit: a hand is stopped before its end. */
static const double FULL = 0.6;
/* Time constant with which a motor may come to the end stop [s]. */
static const double FORESEEN = 0.05;
/* Speed beyond that which takes all of the motor's torque [rad/s]. */
static const double BRAKED = 1.0;
enum { SWEEPS = 300 };
/* Change of all lambdas in a sweep that ends them [N m]. */
static const double SETTLED = 1e-6;
/* What counts of a motor at its limit. */
static const double LEFT = 0.02;

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

/* Torque of one motor's end stop, so far from its limit and moving away from that at `rate`: a spring in the
 * zone, and against the speed from which the motor would not come to rest in front of it. */
static double stopped(double room, double rate, double zone, double limit) {
    const double spring = fmax(zone - room, 0.0) / (FULL * zone);
    const double excess = fmax(-rate - fmax(room - zone, 0.0) / FORESEEN, 0.0);
    return limit * fmin(spring + excess / BRAKED, 1.0);
}

/* Torque against the speed of a motor beyond its fastest. */
static double slowed(double rate, double fastest, double limit, double inertia) {
    const double excess = fabs(rate) - fastest;
    return excess > 0.0 ? copysign(fmin(inertia / SLOWING * excess, limit), -rate) : 0.0;
}

void guard_update(guard *g) {
    const int n = g->n, m = g->m;
    const double zone = g->zone;
    double load[JOINTS];
    mobility(g);
    for (int i = 0; i < n; i++) load[i] = g->bias[i] + g->friction[i] * g->qd[i];
    for (int i = 0; i < n; i++) {
        const double inertia = g->M[n * i + i], q = g->q[i], qd = g->qd[i];
        double own = 0.0; /* what the motor does without tau */
        for (int k = 0; k < n; k++) own -= g->rows[n * i + k] * load[k];
        for (int a = 0; a < m; a++) own -= inertia * g->inverse[n * a + i] * g->drift[a];
        const bounds_interval b = bounds_c(g->lower[i] + g->kept, g->upper[i] - g->kept, q, qd, HORIZON);
        const double slower = (-g->fastest[i] - qd) / SLOWING, faster = (g->fastest[i] - qd) / SLOWING;
        g->floor[i] = inertia * fmin(fmax(b.lower, slower), faster) - own;
        g->ceiling[i] = inertia * fmax(fmin(b.upper, faster), slower) - own;
        g->stop[i] = stopped(q - g->lower[i], qd, zone, g->limit[i]) -
                     stopped(g->upper[i] - q, -qd, zone, g->limit[i]) +
                     slowed(qd, g->fastest[i], g->limit[i], inertia);
    }
}

/* What counts of a motor at q, and its derivative. */
static double weight(const guard *g, int i, double *slope) {
    const double below = g->q[i] - g->lower[i], above = g->upper[i] - g->q[i];
    const double span = g->room - g->kept, room = fmin(below, above) - g->kept;
    const double s = fmax(fmin(room / span, 1.0), 0.0);
    *slope = (1.0 - LEFT) * 6.0 * s * (1.0 - s) / span * (below < above ? 1.0 : -1.0);
    return LEFT + (1.0 - LEFT) * s * s * (3.0 - 2.0 * s);
}

/* d log det(A) / dq_k / 2 for A = sum_i c_i J_i J_i^T, from A^-1: sum_i c_i J_i^T A^-1 dJ_i/dq_k. */
static double turning(const guard *g, const double *c, const double *inverse, int k) {
    const int n = g->n, m = g->m;
    double sum = 0.0;
    for (int a = 0; a < m; a++)
        for (int b = 0; b < m; b++)
            for (int i = 0; i < n; i++)
                sum += c[i] * g->J[n * a + i] * inverse[m * a + b] * g->dJ[m * n * k + n * b + i];
    return sum;
}

/* A^-1 of A = sum_i c_i J_i J_i^T; 0 where A is singular. */
static int weighted(const guard *g, const double *c, double *inverse) {
    const int n = g->n, m = g->m;
    double A[TASK * TASK];
    for (int a = 0; a < m; a++)
        for (int b = 0; b < m; b++) {
            A[m * a + b] = 0.0;
            for (int i = 0; i < n; i++) A[m * a + b] += c[i] * g->J[n * a + i] * g->J[n * b + i];
        }
    if (spd_factor(m, A) < 0) return 0;
    spd_invert(m, A, inverse);
    return 1;
}

void guard_avoid(const guard *g, double *gradient) {
    const int n = g->n, m = g->m;
    double full[JOINTS], left[JOINTS], slope[JOINTS], of_full[TASK * TASK], of_left[TASK * TASK];
    int near = 0;
    for (int i = 0; i < n; i++) {
        full[i] = 1.0 / (g->limit[i] * g->limit[i]);
        const double share = weight(g, i, &slope[i]);
        left[i] = full[i] * share, slope[i] *= full[i];
        near |= share < 1.0;
    }
    memset(gradient, 0, sizeof(double) * (size_t)n);
    if (!near || !weighted(g, full, of_full) || !weighted(g, left, of_left)) return;
    for (int k = 0; k < n; k++) {
        double own = 0.0; /* J_k^T A_p^-1 J_k */
        for (int a = 0; a < m; a++)
            for (int b = 0; b < m; b++) own += g->J[n * a + k] * of_left[m * a + b] * g->J[n * b + k];
        gradient[k] = turning(g, full, of_full, k) - turning(g, left, of_left, k) - 0.5 * slope[k] * own;
    }
}

static double clamp(double x, double most) {
    return fmax(fmin(x, most), -most);
}

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
            const double wanted = clamp(lack / (own + SOFT), MOST * g->limit[i]), step = wanted - lambda[i];
            lambda[i] = wanted;
            change += fabs(step);
            if (step != 0.0)
                for (int k = 0; k < n; k++) moved[k] += g->rows[n * k + i] * step;
        }
        if (change < SETTLED) break;
    }
    double felt[TASK] = {0.0}; /* what the lambdas would do to the hand */
    for (int a = 0; a < m; a++)
        for (int i = 0; i < n; i++) felt[a] += g->inverse[n * a + i] * lambda[i];
    for (int i = 0; i < n; i++) {
        add[i] = lambda[i];
        for (int a = 0; a < m; a++) add[i] -= g->J[n * a + i] * felt[a];
    }
}
