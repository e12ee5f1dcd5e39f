#include "nullspace.h"
#include "redundant.h"
#include "spd.h"

#include <math.h>
#include <string.h>

/* How much faster than it rises the posture's share may fall: the force is waiting for it. */
static const double FALLING = 2.5;
/* Parts of their limits by which the posture's torques may change in the time in which its share rises to
 * all: a posture that arrives at speed is braked within a few periods. */
static const double CHANGING = 2.0;
/* Part of the trace of J M^-1 J^T below which a direction of the hand begins to count as one that motors
 * cannot move. */
static const double HELD_STILL = 0.01;
/* Cosine of the angle between two pulls from which on they count as opposed. */
static const double ACROSS = 0.25;
/* Weight of what leads out of dead ends [N m]. */
static const double AVOID = 1.0;
/* Parts of their limits by which torques may step, beyond what is asked at the hand, in the time in which the
 * posture's share rises to all. */
static const double STEPPING = 2.8;
/* Part of a motor's room that is always taken to be left for the joint limits. */
static const double ALWAYS = 0.1;
/* How much more the force counts than the posture where the motors cannot give both. */
static const double FORCE_FIRST = 10.0;
/* Least |L^-1 J^T F| that the force counts as [N m/sqrt(kg m^2)]: without any, its share is still 1. */
static const double SLIGHT = 1.0;

enum { JOINTS = SERIAL_MAX_JOINTS, TASK = REDUNDANT_MAX_TASK };

/* D of (16) from (12) and (13): both are a multiple of the identity and one of a direction's u u^T. */
static void desired(const nullspace *s, double omega, double *D) {
    const int m = s->m;
    const double span = s->major - s->minor;
    for (int e = 0; e < m * m; e++) D[e] = span * ((1.0 - omega) * s->contact[e] - omega * s->motion[e]);
    for (int a = 0; a < m; a++) D[m * a + a] += omega * s->major + (1.0 - omega) * s->minor;
}

/* Upper bound of v's second derivatives H (n x n): tr(A^-1 dA_k A^-1 dA_l) / 2, from A^-1. */
static void curvature(const nullspace *s, const double *inverse, const double *weight, double *H) {
    const int n = s->n, m = s->m;
    double X[JOINTS][TASK * TASK];
    for (int k = 0; k < n; k++) {
        const double *dJ = s->dJ + m * n * k;
        double dA[TASK * TASK];
        for (int a = 0; a < m; a++)
            for (int b = 0; b < m; b++) {
                dA[m * a + b] = 0.0;
                for (int i = 0; i < n; i++)
                    dA[m * a + b] +=
                        weight[i] * (dJ[n * a + i] * s->J[n * b + i] + s->J[n * a + i] * dJ[n * b + i]);
            }
        for (int a = 0; a < m; a++)
            for (int b = 0; b < m; b++) {
                X[k][m * a + b] = 0.0;
                for (int c = 0; c < m; c++) X[k][m * a + b] += inverse[m * a + c] * dA[m * c + b];
            }
    }
    for (int k = 0; k < n; k++)
        for (int l = k; l < n; l++) {
            double sum = 0.0;
            for (int a = 0; a < m; a++)
                for (int b = 0; b < m; b++) sum += X[k][m * a + b] * X[l][m * b + a];
            H[n * k + l] = H[n * l + k] = 0.5 * sum;
        }
}

/* Cost, gradient and a bound of the curvature H (n x n); 0 where A or D is singular. */
static int stein(nullspace *s, double omega, double *H) {
    const int n = s->n, m = s->m;
    double A[TASK * TASK], B[TASK * TASK], D[TASK * TASK], mean[TASK * TASK], G[TASK * TASK];
    double weight[JOINTS], inverse[TASK * TASK], pull[TASK * JOINTS];
    for (int i = 0; i < n; i++) weight[i] = 1.0 / (s->limit[i] * s->limit[i]);
    desired(s, omega, D);
    if (spd_factor(m, D) < 0) return 0;
    spd_invert(m, D, B);
    for (int a = 0; a < m; a++)
        for (int b = 0; b < m; b++) {
            A[m * a + b] = 0.0;
            for (int i = 0; i < n; i++) A[m * a + b] += s->J[n * a + i] * weight[i] * s->J[n * b + i];
            mean[m * a + b] = A[m * a + b] + B[m * a + b];
        }
    if (spd_factor(m, A) < 0 || spd_factor(m, mean) < 0) return 0;
    s->cost = spd_logdet(m, mean) - m * log(2.0) - 0.5 * (spd_logdet(m, A) - spd_logdet(m, D));
    spd_invert(m, mean, G);
    spd_invert(m, A, inverse);
    curvature(s, inverse, weight, H);
    for (int e = 0; e < m * m; e++) G[e] -= 0.5 * inverse[e];
    for (int a = 0; a < m; a++)
        for (int i = 0; i < n; i++) {
            pull[n * a + i] = 0.0; /* 2 G J W^2 */
            for (int b = 0; b < m; b++) pull[n * a + i] += 2.0 * G[m * a + b] * s->J[n * b + i];
            pull[n * a + i] *= weight[i];
        }
    for (int k = 0; k < n; k++) {
        s->gradient[k] = 0.0;
        for (int e = 0; e < m * n; e++) s->gradient[k] += pull[e] * s->dJ[m * n * k + e];
    }
    return 1;
}

/* tau -= J^T (J M^-1 J^T)^-1 J M^-1 tau, from the factors of M and of J M^-1 J^T. */
static void project(const nullspace *s, const double *M, const double *S, double *tau) {
    const int n = s->n, m = s->m;
    double acceleration[JOINTS], force[TASK];
    memcpy(acceleration, tau, sizeof(double) * (size_t)n);
    spd_solve(n, M, acceleration);
    for (int a = 0; a < m; a++) {
        force[a] = 0.0;
        for (int i = 0; i < n; i++) force[a] += s->J[n * a + i] * acceleration[i];
    }
    spd_solve(m, S, force);
    for (int i = 0; i < n; i++)
        for (int a = 0; a < m; a++) tau[i] -= s->J[n * a + i] * force[a];
}

/* The coupling force, from J#^T and the factor of J M^-1 J^T. */
static void couple(const nullspace *s, const double *S) {
    const int n = s->n, m = s->m;
    double hand[TASK] = {0.0}, inertial[TASK];
    for (int a = 0; a < m; a++)
        for (int i = 0; i < n; i++) hand[a] += s->J[n * a + i] * s->qd[i];
    memcpy(inertial, s->drift, sizeof(double) * (size_t)m);
    spd_solve(m, S, inertial);
    for (int a = 0; a < m; a++) s->coupling[a] = -inertial[a];
    for (int i = 0; i < n; i++) {
        double null_rate = s->qd[i];
        for (int a = 0; a < m; a++) null_rate -= s->inverse[n * a + i] * hand[a];
        const double load = s->bias[i] + s->friction[i] * null_rate;
        for (int a = 0; a < m; a++) s->coupling[a] += s->inverse[n * a + i] * load;
    }
}

/* J#^T and L^-1, from the factors of M and of J M^-1 J^T. */
static void hierarchy(const nullspace *s, const double *M, const double *S) {
    const int n = s->n, m = s->m;
    for (int j = 0; j < n; j++) {
        double column[JOINTS] = {0.0}, force[TASK];
        column[j] = 1.0;
        spd_solve(n, M, column);
        for (int a = 0; a < m; a++) {
            force[a] = 0.0;
            for (int i = 0; i < n; i++) force[a] += s->J[n * a + i] * column[i];
        }
        spd_solve(m, S, force);
        for (int a = 0; a < m; a++) s->inverse[n * a + j] = force[a];
        for (int i = 0; i < n; i++) { /* L x = unit vector j */
            double sum = i == j ? 1.0 : 0.0;
            for (int k = j; k < i; k++) sum -= M[n * i + k] * s->root[n * k + j];
            s->root[n * i + j] = i < j ? 0.0 : sum / M[n * i + i];
        }
    }
    couple(s, S);
}

static double dot(int n, const double *a, const double *b) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}

static double norm(int n, const double *x) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) sum += x[i] * x[i];
    return sqrt(sum);
}

/* Fastest angular frequency squared of the posture on the spring beta H + stiffness: at most the trace of
 * M^-1 N times that. */
static double swing(const nullspace *s, const double *H) {
    const int n = s->n;
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            const double mobile = s->guard->rows[n * i + j] / s->M[n * i + i];
            sum += mobile * (s->beta * H[n * j + i] + (i == j ? s->stiffness : 0.0));
        }
    return fmax(sum, 0.0);
}

/* Scale the pull until it swings no faster than it may, and return how fast it is to be damped [1/s]. */
static double calm(const nullspace *s, const double *H, double *scale) {
    if (!(s->ratio > 0.0)) return 0.0;
    const double square = swing(s, H), most = s->fastest * s->fastest;
    if (*scale * square > most) *scale = most / square;
    return 2.0 * s->ratio * sqrt(*scale * square);
}

/* Share of the gradient that pulls. Where it pulls away from known postures (`pull` towards them, n), that is
 * no more than the cap: a local optimum of v holds the posture no further from them than the cap is worth. */
static double yielding(const nullspace *s, const double *M, const double *S, const double *pull) {
    const int n = s->n;
    double steep[JOINTS], known[JOINTS];
    if (!(s->stiffness > 0.0)) return 1.0;
    for (int i = 0; i < n; i++) steep[i] = s->beta * s->gradient[i], known[i] = pull[i];
    project(s, M, S, steep);
    project(s, M, S, known);
    const double size = norm(n, steep);
    if (!(size > s->cap)) return 1.0;
    const double against = -dot(n, steep, known) / (size * fmax(norm(n, known), s->cap));
    return 1.0 - (1.0 - s->cap / size) * fmin(fmax(against / ACROSS, 0.0), 1.0);
}

/* How much of the cap the way out of a dead end takes: all of it where its projection asks for that much. */
static double retreating(const nullspace *s, const double *M, const double *S, const double *retreat) {
    double projected[JOINTS];
    memcpy(projected, retreat, sizeof(double) * (size_t)s->n);
    project(s, M, S, projected);
    const double size = AVOID * norm(s->n, projected);
    return AVOID * (size > s->cap ? s->cap / size : 1.0);
}

/* Let the null-space torque go towards the one that is wanted (n). */
static void approach(const nullspace *s, const double *M, const double *S, const double *wanted) {
    const int n = s->n;
    const double most = CHANGING * s->slew;
    double fastest = 0.0;
    for (int i = 0; i < n; i++) fastest = fmax(fastest, fabs(wanted[i] - s->null[i]) / s->limit[i]);
    const double share = fastest > most ? most / fastest : 1.0;
    for (int i = 0; i < n; i++)
        s->null[i] = share < 1.0 ? s->null[i] + share * (wanted[i] - s->null[i]) : wanted[i];
    if (share < 1.0) project(s, M, S, s->null); /* what it was belonged to the posture of the period before */
}

int nullspace_secondary(nullspace *s, double omega) {
    const int n = s->n, m = s->m;
    double M[JOINTS * JOINTS], S[TASK * TASK], pull[JOINTS], projected[JOINTS];
    double retreat[JOINTS], H[JOINTS * JOINTS];
    if (!stein(s, omega, H)) return 0;
    memcpy(M, s->M, sizeof(double) * (size_t)(n * n));
    if (spd_factor(n, M) < 0) return 0;
    for (int b = 0; b < m; b++) {
        double column[JOINTS];
        memcpy(column, s->J + n * b, sizeof(double) * (size_t)n);
        spd_solve(n, M, column);
        for (int a = 0; a < m; a++) {
            S[m * a + b] = 0.0;
            for (int i = 0; i < n; i++) S[m * a + b] += s->J[n * a + i] * column[i];
        }
    }
    double easiest = 0.0;
    for (int a = 0; a < m; a++) easiest += S[m * a + a];
    spd_raise(m, S, HELD_STILL * easiest);
    if (spd_factor(m, S) < 0) return 0;
    hierarchy(s, M, S);
    guard_update(s->guard);
    for (int i = 0; i < n; i++) {
        const double target = omega * s->free[i] + (1.0 - omega) * s->stiff[i];
        pull[i] = s->stiffness * (s->q[i] - target);
    }
    const double share = yielding(s, M, S, pull);
    for (int i = 0; i < n; i++) pull[i] = share * s->beta * s->gradient[i] + pull[i];
    memcpy(projected, pull, sizeof(double) * (size_t)n);
    project(s, M, S, projected);
    s->drive = norm(n, projected);
    double scale = s->drive > s->cap ? s->cap / s->drive : 1.0;
    const double rate = calm(s, H, &scale);
    guard_avoid(s->guard, retreat);
    const double away = retreating(s, M, S, retreat);
    for (int i = 0; i < n; i++) {
        double momentum = 0.0;
        for (int k = 0; k < n; k++) momentum += s->M[n * i + k] * s->qd[k];
        s->secondary[i] = -scale * pull[i] - away * retreat[i] - s->damping * s->qd[i] - rate * momentum;
    }
    memcpy(projected, s->secondary, sizeof(double) * (size_t)n);
    project(s, M, S, projected);
    approach(s, M, S, projected);
    return isfinite(s->cost) && isfinite(s->drive);
}

void nullspace_wanted(nullspace *s, const double *force) {
    for (int i = 0; i < s->n; i++) {
        s->wanted[i] = 0.0;
        for (int a = 0; a < s->m; a++) s->wanted[i] += s->J[s->n * a + i] * force[a];
    }
}

double nullspace_reserve(const nullspace *s, const double *J, const double *force, double steepness) {
    double p = 1.0;
    for (int i = 0; i < s->n; i++) {
        double torque = 0.0;
        for (int a = 0; a < s->m; a++) torque += J[s->n * a + i] * force[a];
        /* beyond a limit counts as on it: two of them would give a positive p */
        const double part = fmin(fabs(torque) / s->room[i], 1.0);
        p *= 1.0 - part * part;
    }
    return expm1(-steepness * p) / expm1(-steepness);
}

double nullspace_within(const nullspace *s, double part) {
    double alpha = 1.0;
    for (int i = 0; i < s->n; i++) {
        const double most = part * s->room[i], size = fabs(s->wanted[i]);
        if (size * alpha > most) alpha = most / size;
    }
    return alpha;
}

/* Largest share of J^T F, at most alpha, that keeps the limits beside these torques. */
static double beside(const nullspace *s, const double *torque, double alpha) {
    for (int i = 0; i < s->n; i++) {
        const double w = s->wanted[i], used = w < 0.0 ? -torque[i] : torque[i];
        const double room = fmax(s->room[i] - used, 0.0), size = fabs(w);
        if (size * alpha > room) alpha = room / size;
    }
    return alpha;
}

/* Largest share, at most 1, of what is more (n) that finds room beside these torques, of which a little is
 * always taken to be left: it goes on where torques beside a full motor change their sides. */
static double fitting(const nullspace *s, const double *torque, const double *more) {
    double share = 1.0;
    for (int i = 0; i < s->n; i++) {
        const double used = more[i] < 0.0 ? -torque[i] : torque[i];
        const double room = fmax(s->room[i] - used, ALWAYS * s->room[i]), size = fabs(more[i]);
        if (size * share > room) share = room / size;
    }
    return share;
}

double nullspace_bearable(const nullspace *s, double part) {
    const int n = s->n, m = s->m;
    double torque[JOINTS] = {0.0};
    for (int a = 0; a < m; a++) {
        const double *force = s->inverse + n * a;
        const double felt = s->coupling[a] + dot(n, force, s->guard->stop);
        for (int i = 0; i < n; i++) torque[i] += s->J[n * a + i] * felt;
    }
    return beside(s, torque, nullspace_within(s, part));
}

void nullspace_compose(nullspace *s, double part, double gain) {
    const int n = s->n;
    double share = 1.0, fit = 1.0, posture[JOINTS], kept[JOINTS];
    s->alpha = nullspace_within(s, part);
    for (int i = 0; i < n; i++) {
        posture[i] = gain * s->null[i];
        for (int a = 0; a < s->m; a++) posture[i] += s->J[n * a + i] * s->coupling[a];
        const double used = s->alpha * s->wanted[i];
        const double room = s->room[i] - (posture[i] < 0.0 ? -used : used);
        if (fabs(posture[i]) * share > room) share = fmax(room, 0.0) / fabs(posture[i]);
        if (fabs(posture[i]) * fit > s->room[i]) fit = s->room[i] / fabs(posture[i]);
    }
    const double rise = fit * s->slew; /* of a torque, as a part of its limit, no more than slew */
    share = fmin(fmin(fmax(share, s->share - FALLING * rise), s->share + rise), 1.0);
    for (int i = 0; i < n; i++) posture[i] *= share;
    guard_hold(s->guard, posture, kept);
    for (int i = 0; i < n; i++) posture[i] += s->guard->stop[i];
    const double most = fitting(s, posture, kept); /* cut motor by motor they would move the hand */
    for (int i = 0; i < n; i++) posture[i] += most * kept[i];
    s->alpha = beside(s, posture, s->alpha);
    for (int i = 0; i < n; i++) {
        const double sum = s->alpha * s->wanted[i] + posture[i];
        s->torque[i] = fmax(fmin(sum, s->room[i]), -s->room[i]); /* the end stop may ask for more */
    }
    s->share = share;
}

double nullspace_ease(nullspace *s, const double *force, double share, double *torque) {
    const int n = s->n, m = s->m;
    double base[JOINTS], part = 1.0;
    for (int i = 0; i < n; i++) {
        double asked = 0.0;
        for (int a = 0; a < m; a++) asked += s->J[n * a + i] * (force[a] - s->asked[a]);
        base[i] = fmax(fmin(s->given[i] + s->rendered * asked, s->room[i]), -s->room[i]);
        const double way = torque[i] - base[i], gone = copysign(1.0, way) * (base[i] - s->given[i]);
        const double most = fmax(STEPPING * s->slew * s->limit[i] + fabs(asked) - gone, 0.0);
        if (part * fabs(way) > most) part = most / fabs(way);
    }
    if (part < 1.0) {
        for (int i = 0; i < n; i++) torque[i] = base[i] + part * (torque[i] - base[i]);
        share = s->rendered + part * (share - s->rendered);
    }
    memcpy(s->given, torque, sizeof(double) * (size_t)n);
    memcpy(s->asked, force, sizeof(double) * (size_t)m);
    s->rendered = share;
    return share;
}

/* Bounds as far as the guard's own soft answer to a wish keeps them. */
static void soften(const nullspace *s, const double *wish) {
    const int n = s->n;
    const double nothing[JOINTS] = {0.0};
    double kept[JOINTS], base[JOINTS];
    guard *g = s->guard;
    const double share = fitting(s, nothing, wish);
    for (int i = 0; i < n; i++) base[i] = share * wish[i];
    guard_hold(g, base, kept);
    const double most = fitting(s, base, kept);
    for (int i = 0; i < n; i++) kept[i] = base[i] + most * kept[i];
    for (int i = 0; i < n; i++) {
        const double moved = dot(n, g->rows + n * i, kept);
        g->floor[i] = fmin(g->floor[i], moved);
        g->ceiling[i] = fmax(g->ceiling[i], moved);
    }
}

void nullspace_levels(const nullspace *s, double gain, double *force, double *force_b, double *limits,
                      double *posture, double *posture_b) {
    const int n = s->n, wide = n + 1;
    const size_t row = sizeof(double) * (size_t)n;
    double wish[JOINTS], felt[JOINTS]; /* the end stop as a whole: what the hand feels is another level's */
    for (int i = 0; i < n; i++) {
        wish[i] = felt[i] = s->guard->stop[i] + gain * s->null[i];
        for (int a = 0; a < s->m; a++) felt[i] += s->J[n * a + i] * s->coupling[a];
    }
    soften(s, wish);
    double effort = 0.0; /* |L^-1 J^T F|^2 */
    for (int a = 0; a < s->m; a++) {
        memcpy(force + wide * a, s->inverse + n * a, row);
        force[wide * a + n] = -dot(n, s->inverse + n * a, s->wanted);
        force_b[a] = dot(n, s->inverse + n * a, felt);
    }
    for (int i = 0; i < n; i++) {
        memcpy(limits + wide * i, s->guard->rows + n * i, row);
        memcpy(posture + wide * i, s->root + n * i, row);
        const double push = dot(n, s->root + n * i, s->wanted);
        posture[wide * i + n] = -push;
        posture_b[i] = dot(n, s->root + n * i, wish);
        effort += push * push;
    }
    posture[wide * n + n] = posture_b[n] = FORCE_FIRST * fmax(sqrt(effort), SLIGHT);
}
