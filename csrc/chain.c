#include "chain.h"
#include "rotation.h"

#include <math.h>
#include <string.h>

/* Offsets into x, and its length. */
static int at_twin(const chain *c) {
    return c->m;
}
static int at_alpha(const chain *c) {
    return c->m + c->n;
}
static int dimension(const chain *c) {
    return c->m + c->n + c->torques;
}

/* Y = J_m^-1 J_a (6 x n), by Gaussian elimination with partial pivoting. */
static int solve_coupling(const chain *c, double *Y) {
    const int n = c->n;
    double J[36];
    memcpy(J, c->J, sizeof J);
    memcpy(Y, c->J_a, (size_t)(6 * n) * sizeof *Y);
    for (int k = 0; k < 6; k++) {
        int pivot = k;
        for (int i = k + 1; i < 6; i++)
            if (fabs(J[6 * i + k]) > fabs(J[6 * pivot + k])) pivot = i;
        if (!(fabs(J[6 * pivot + k]) > 1e-9)) return -1;
        if (pivot != k) {
            for (int j = 0; j < 6; j++) {
                const double t = J[6 * k + j];
                J[6 * k + j] = J[6 * pivot + j], J[6 * pivot + j] = t;
            }
            for (int j = 0; j < n; j++) {
                const double t = Y[n * k + j];
                Y[n * k + j] = Y[n * pivot + j], Y[n * pivot + j] = t;
            }
        }
        for (int i = k + 1; i < 6; i++) {
            const double f = J[6 * i + k] / J[6 * k + k];
            for (int j = k; j < 6; j++) J[6 * i + j] -= f * J[6 * k + j];
            for (int j = 0; j < n; j++) Y[n * i + j] -= f * Y[n * k + j];
        }
    }
    for (int k = 5; k >= 0; k--)
        for (int j = 0; j < n; j++) {
            double sum = Y[n * k + j];
            for (int i = k + 1; i < 6; i++) sum -= J[6 * k + i] * Y[n * i + j];
            Y[n * k + j] = sum / J[6 * k + k];
        }
    return 0;
}

/* M = L L^T, in place in the lower triangle. */
static int factor(int n, double *M) {
    for (int j = 0; j < n; j++) {
        double d = M[n * j + j];
        for (int k = 0; k < j; k++) d -= M[n * j + k] * M[n * j + k];
        if (!(d > 0.0)) return -1;
        M[n * j + j] = sqrt(d);
        for (int i = j + 1; i < n; i++) {
            double sum = M[n * i + j];
            for (int k = 0; k < j; k++) sum -= M[n * i + k] * M[n * j + k];
            M[n * i + j] = sum / M[n * j + j];
        }
    }
    return 0;
}

/* B <- (L L^T)^-1 B for n rows of `columns` numbers that lie `stride` apart. */
static void solve_inertia(int n, const double *L, double *B, int columns, int stride) {
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            for (int j = 0; j < columns; j++) B[stride * i + j] -= L[n * i + k] * B[stride * k + j];
        for (int j = 0; j < columns; j++) B[stride * i + j] /= L[n * i + i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            for (int j = 0; j < columns; j++) B[stride * i + j] -= L[n * k + i] * B[stride * k + j];
        for (int j = 0; j < columns; j++) B[stride * i + j] /= L[n * i + i];
    }
}

/* A point of the manipulator in B: the base carries it along x and y. */
typedef struct {
    double x[3], v[6], drift[6];
} motion;

static motion carried(const chain *c, const double *x, const double *J, const double *drift) {
    const int m = c->m;
    motion p;
    for (int i = 0; i < 6; i++) {
        p.v[i] = 0.0;
        for (int j = 0; j < m; j++) p.v[i] += J[m * i + j] * c->qd[j];
        p.drift[i] = drift[i];
    }
    for (int i = 0; i < 3; i++) p.x[i] = x[i];
    for (int i = 0; i < 2; i++) {
        p.x[i] += c->q_p[i];
        p.v[i] += c->qd_p[i];
        p.drift[i] += c->qdd_p[i];
    }
    return p;
}

/* (11): s = k_P (E - H) + k_D (E - H)', the rotation as the log of C_H^T C_E resolved in B. */
static void synchronise(const chain *c, const motion *H, double *sync) {
    double relative[9], vector[3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            relative[3 * i + j] =
                c->R_H[i] * c->R_E[j] + c->R_H[3 + i] * c->R_E[3 + j] + c->R_H[6 + i] * c->R_E[6 + j];
    rotation_log(relative, vector);
    for (int i = 0; i < 3; i++) {
        c->error[i] = c->x_E[i] - H->x[i];
        c->error[3 + i] =
            c->R_H[3 * i] * vector[0] + c->R_H[3 * i + 1] * vector[1] + c->R_H[3 * i + 2] * vector[2];
    }
    for (int i = 0; i < 6; i++) sync[i] = c->k_p[i] * c->error[i] + c->k_d[i] * (c->v_E[i] - H->v[i]);
}

/* Level 1, kinematic coupling (12):  J_m qdd_m - J_a qdd_a = s - drift_H + drift_E. */
static void coupling(const chain *c, const motion *H) {
    const int m = c->m, n = c->n, dim = dimension(c);
    double sync[6];
    synchronise(c, H, sync);
    for (int k = 0; k < c->rows; k++) {
        const int i = c->direction[k];
        double *row = c->A1 + dim * k;
        for (int j = 0; j < m; j++) row[j] = c->J[m * i + j];
        for (int j = 0; j < n; j++) row[at_twin(c) + j] = -c->J_a[n * i + j];
        c->b1[k] = sync[i] - H->drift[i] + c->drift_a[i];
    }
}

/* Bounds of a twin's joint under its lock, (31): locked it stands, caught it may fall but not rise. Both
 * brake it as rated and no harder: these bounds rank above the manipulator's accelerations. */
static bounds_interval held(const chain *c, int i, bounds_interval free) {
    const double most = c->twin[i].acceleration, stop = -c->qd_a[i] / c->dt;
    if (!c->held || c->held[i] == CHAIN_FREE) return free;
    const double upper = fmax(stop, -most), still = fmin(upper, most);
    if (c->held[i] == CHAIN_LOCKED) return (bounds_interval){still, still};
    free.upper = fmin(free.upper, upper);
    free.lower = fmin(free.lower, free.upper);
    return free;
}

/* Levels 2 and 7 of the manipulator, 6 and 8 of the twin: (13), (17), (18), (19). */
static void joint_limits(const chain *c) {
    for (int i = 0; i < c->m; i++) {
        const bounds_interval a = bounds_a(&c->manipulator[i], c->q[i], c->qd[i], c->dt);
        const bounds_interval b = bounds_b(&c->manipulator[i], c->q[i], c->qd[i], c->viability_horizon);
        c->lb2[i] = a.lower, c->ub2[i] = a.upper;
        c->lb7[i] = b.lower, c->ub7[i] = b.upper;
    }
    for (int i = 0; i < c->n; i++) {
        const bounds_interval a = bounds_a(&c->twin[i], c->q_a[i], c->qd_a[i], c->dt);
        const bounds_interval b = bounds_b(&c->twin[i], c->q_a[i], c->qd_a[i], c->viability_horizon);
        const bounds_interval position = held(c, i, a), ever = held(c, i, b);
        c->lb6[i] = position.lower, c->ub6[i] = position.upper;
        c->lb8[i] = ever.lower, c->ub8[i] = ever.upper;
    }
}

/* Level 3, (14): sums of joints, with the bounds (8). */
static void sums(const chain *c) {
    const int m = c->m;
    for (int k = 0; k < c->sums; k++) {
        double s = 0.0, sd = 0.0;
        for (int j = 0; j < m; j++)
            s += c->weight[m * k + j] * c->q[j], sd += c->weight[m * k + j] * c->qd[j];
        const bounds_interval limit = bounds_c(c->sum_lower[k], c->sum_upper[k], s, sd, c->point_horizon);
        c->lb3[k] = limit.lower, c->ub3[k] = limit.upper;
    }
}

/* Levels 4 and 5, (15) and (16): lb <= J qdd_m + drift <= ub with the bounds (8) of a point in its box. */
static void box(const chain *c, const chain_point *point) {
    const int m = c->m, dim = dimension(c);
    const motion p = carried(c, point->x, point->J, point->drift);
    for (int i = 0; i < 3; i++) {
        const bounds_interval limit =
            bounds_c(point->lower[i], point->upper[i], p.x[i], p.v[i], c->point_horizon);
        for (int j = 0; j < m; j++) point->C[dim * i + j] = point->J[m * i + j];
        point->lb[i] = limit.lower - p.drift[i];
        point->ub[i] = limit.upper - p.drift[i];
    }
}

void chain_limits(const chain *c) {
    const motion H = carried(c, c->x_H, c->J, c->drift);
    coupling(c, &H);
    joint_limits(c);
    sums(c);
    for (int k = 0; k < c->points; k++) box(c, &c->point[k]);
}

/* The column of T for a constraint that acts on the manipulator along `row` of its joints: what reaches
 * joint i of the twin, J_a^T J_m^-T row, (21) to (24). */
static double transmitted(const chain *c, const double *Y, const double *row, int i) {
    double sum = 0.0;
    for (int k = 0; k < 6; k++) sum += Y[c->n * k + i] * row[k];
    return sum;
}

int chain_dynamics(const chain *c) {
    const int n = c->n, dim = dimension(c);
    double Y[6 * CHAIN_MAX_DOF], L[CHAIN_MAX_DOF * CHAIN_MAX_DOF];
    if (solve_coupling(c, Y) < 0) return -1;
    memcpy(L, c->M_a, (size_t)(n * n) * sizeof *L);
    if (factor(n, L) < 0) return -1;

    for (int i = 0; i < n; i++) {
        double *T = c->A9 + dim * i + at_alpha(c);
        double *T_m = T + n, *T_sum = T_m + 6, *T_point = T_sum + c->sums;
        for (int j = 0; j < n; j++) T[j] = i == j ? -1.0 : 0.0;
        for (int j = 0; j < 6; j++) T_m[j] = -Y[n * j + i];
        for (int k = 0; k < c->sums; k++) T_sum[k] = -transmitted(c, Y, c->weight + 6 * k, i);
        for (int k = 0; k < c->points; k++)
            for (int j = 0; j < 3; j++) T_point[3 * k + j] = -transmitted(c, Y, c->point[k].J + 6 * j, i);
        c->b9[i] = c->force_a[i];
    }
    solve_inertia(n, L, c->A9 + at_alpha(c), c->torques, dim);
    solve_inertia(n, L, c->b9, 1, 1);
    return 0;
}

int chain_gauss(const chain *c) {
    const int n = c->n, dim = dimension(c);
    double L[CHAIN_MAX_DOF * CHAIN_MAX_DOF];
    memcpy(L, c->M_a, (size_t)(n * n) * sizeof *L);
    if (factor(n, L) < 0) return -1;
    for (int i = 0; i < n; i++) {
        double sum = c->force_a[i];
        for (int k = 0; k < i; k++) sum -= L[n * i + k] * c->b9[k];
        c->b9[i] = sum / L[n * i + i];
        for (int j = i; j < n; j++) c->A9[dim * i + at_twin(c) + j] = L[n * j + i];
    }
    return 0;
}

void chain_range(const chain *c, const unsigned char *active) {
    for (int i = 0; i < c->torques; i++) {
        c->lb10[i] = active[i] & CHAIN_UPPER_ACTIVE ? -INFINITY : 0.0;
        c->ub10[i] = active[i] & CHAIN_LOWER_ACTIVE ? INFINITY : 0.0;
    }
}

static int mark(double y, double lb, double ub, double tolerance, unsigned char *flag) {
    unsigned char now = *flag;
    if (y <= lb + tolerance * (1.0 + fabs(lb))) now |= CHAIN_LOWER_ACTIVE;
    if (y >= ub - tolerance * (1.0 + fabs(ub))) now |= CHAIN_UPPER_ACTIVE;
    const int added = now != *flag;
    *flag = now;
    return added;
}

static double row_times(const double *row, const double *x, int m) {
    double sum = 0.0;
    for (int j = 0; j < m; j++) sum += row[j] * x[j];
    return sum;
}

int chain_detect(const chain *c, const double *x, double tolerance, unsigned char *active) {
    const int m = c->m, n = c->n, dim = dimension(c);
    unsigned char *twin = active, *manipulator = twin + n, *sum = manipulator + m, *point = sum + c->sums;
    int added = 0;
    for (int i = 0; i < n; i++) {
        added += mark(x[at_twin(c) + i], c->lb6[i], c->ub6[i], tolerance, &twin[i]);
        added += mark(x[at_twin(c) + i], c->lb8[i], c->ub8[i], tolerance, &twin[i]);
    }
    for (int i = 0; i < m; i++) {
        added += mark(x[i], c->lb2[i], c->ub2[i], tolerance, &manipulator[i]);
        added += mark(x[i], c->lb7[i], c->ub7[i], tolerance, &manipulator[i]);
    }
    for (int k = 0; k < c->sums; k++)
        added += mark(row_times(c->weight + m * k, x, m), c->lb3[k], c->ub3[k], tolerance, &sum[k]);
    for (int k = 0; k < c->points; k++) {
        const chain_point *p = &c->point[k];
        for (int i = 0; i < 3; i++)
            added += mark(row_times(p->C + dim * i, x, m), p->lb[i], p->ub[i], tolerance, &point[3 * k + i]);
    }
    return added;
}
