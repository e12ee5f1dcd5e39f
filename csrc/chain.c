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

static double length(const double *v) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* (11): s = k_P (E - H) + k_D (E - H)', the rotation as the log of C_H^T C_E resolved in B. Where limits have
 * held the handle back, it returns to E no faster than what is outside its limits does. */
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
    for (int i = 0; i < 6; i++) {
        const double pull = c->k_p[i] * length(c->error + i / 3 * 3), most = c->k_d[i] * c->homing;
        const double share = pull > most ? most / pull : 1.0;
        sync[i] = share * c->k_p[i] * c->error[i] + c->k_d[i] * (c->v_E[i] - H->v[i]);
    }
}

/* Kinematic coupling (12):  J_m qdd_m - J_a qdd_a = s - drift_H + drift_E. */
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

/* Accelerations within reach of the motors at this state, in either direction. */
typedef struct {
    double up[CHAIN_MAX_JOINTS], down[CHAIN_MAX_JOINTS];           /* of a joint by its own motor */
    double room_up[CHAIN_MAX_JOINTS], room_down[CHAIN_MAX_JOINTS]; /* torques that are left */
    double L[CHAIN_MAX_JOINTS * CHAIN_MAX_JOINTS];                 /* of the inertia */
    double twin_up[CHAIN_MAX_DOF], twin_down[CHAIN_MAX_DOF];       /* of a joint of the twin by all motors */
} reach;

/* Shares of what is within reach that the viable sets count on: joints brake together and the feedback of
 * the tracking needs its part; and the least of a rated acceleration or torque, however strong the hand. */
static const double JOINT_SHARE = 0.7, POINT_SHARE = 0.5, LEAST_SHARE = 0.1;
/* Largest and least acceleration that boxes and sums count on [m/s^2 or rad/s^2]. */
static const double POINT_MOST = 15.0, POINT_LEAST = 1.0;
/* The slowest springs here ring with some 16 Hz. */
static bounds_pace pace(const chain *c) {
    return (bounds_pace){.ease = 20e-3, .settle = 50e-3, .homing = c->homing};
}

static double between(double x, double lower, double upper) {
    return x < lower ? lower : x > upper ? upper : x;
}

static int ends(const bounds_limits *limits) {
    return isfinite(limits->lower) || isfinite(limits->upper);
}

/* How often a motion that takes `x` fits into what is left in its direction. */
static double with(double x, double up, double down) {
    return (x > 0.0 ? up : down) / fabs(x);
}

/* How fast the manipulator can make the twin's joints move one by one, its handle on their end: what joint i
 * of the twin does takes the torques J_m^T (J_m M^-1 J_m^T)^-1 J_a e_i. A singular posture reaches the least.
 */
static void find_twin_reach(const chain *c, reach *r) {
    const int m = c->m, n = c->n, rows = c->rows;
    double Y[CHAIN_MAX_JOINTS * 6], mobility[36];
    for (int j = 0; j < m; j++)
        for (int k = 0; k < rows; k++) Y[rows * j + k] = c->J[m * c->direction[k] + j];
    solve_inertia(m, r->L, Y, rows, rows);
    for (int k = 0; k < rows; k++)
        for (int l = 0; l < rows; l++) {
            double sum = 0.0;
            for (int j = 0; j < m; j++) sum += c->J[m * c->direction[k] + j] * Y[rows * j + l];
            mobility[rows * k + l] = sum;
        }
    const int regular = factor(rows, mobility) == 0;
    for (int i = 0; i < n; i++) {
        const double rated = c->twin[i].acceleration, least = LEAST_SHARE * rated;
        double force[6], up = INFINITY, down = INFINITY;
        for (int k = 0; k < rows; k++) force[k] = c->J_a[n * c->direction[k] + i];
        if (regular) solve_inertia(rows, mobility, force, 1, 1);
        for (int j = 0; j < m; j++) {
            double torque = 0.0, moves = 0.0;
            for (int k = 0; k < rows; k++) {
                torque += c->J[m * c->direction[k] + j] * force[k];
                moves += Y[rows * j + k] * force[k];
            }
            up = fmin(up,
                      fmin(with(torque, r->room_up[j], r->room_down[j]), with(moves, r->up[j], r->down[j])));
            down = fmin(
                down, fmin(with(torque, r->room_down[j], r->room_up[j]), with(moves, r->down[j], r->up[j])));
        }
        r->twin_up[i] = regular ? between(POINT_SHARE * up, least, rated) : least;
        r->twin_down[i] = regular ? between(POINT_SHARE * down, least, rated) : least;
    }
}

/* Without an inertia the joints reach what they are rated for. Returns 0, or -1 where it is not positive
 * definite. */
static int find_reach(const chain *c, reach *r) {
    const int m = c->m;
    for (int i = 0; i < m; i++) r->up[i] = r->down[i] = c->manipulator[i].acceleration;
    if (!c->inertia) return 0;
    for (int i = 0; i < m; i++) {
        const double rated = c->manipulator[i].acceleration, M = c->inertia[(m + 1) * i];
        const double least = LEAST_SHARE * (c->most[i] - c->least[i]);
        r->room_up[i] = fmax(c->most[i] - c->load[i], least);
        r->room_down[i] = fmax(c->load[i] - c->least[i], least);
        r->up[i] = between(JOINT_SHARE * r->room_up[i] / M, LEAST_SHARE * rated, rated);
        r->down[i] = between(JOINT_SHARE * r->room_down[i] / M, LEAST_SHARE * rated, rated);
    }
    memcpy(r->L, c->inertia, (size_t)(m * m) * sizeof *r->L);
    if (factor(m, r->L) < 0) return -1;
    for (int i = 0; i < c->n; i++)
        if (ends(&c->twin[i])) {
            find_twin_reach(c, r);
            break;
        }
    return 0;
}

/* Accelerations by all motors together, and no more than by all joints as they are rated, along up to three
 * rows of the joints, in either direction. */
typedef struct {
    double up[3], down[3];
} together;

static together move_along(const chain *c, const reach *r, const double *rows, int count) {
    const int m = c->m;
    together a = {{0.0}, {0.0}};
    if (!c->inertia) return a;
    double y[3 * CHAIN_MAX_JOINTS], rated[3] = {0.0};
    for (int j = 0; j < m; j++)
        for (int k = 0; k < count; k++) y[count * j + k] = rows[m * k + j];
    solve_inertia(m, r->L, y, count, count);
    for (int j = 0; j < m; j++)
        for (int k = 0; k < count; k++) {
            const double moved = y[count * j + k];
            a.up[k] += moved * (moved > 0.0 ? r->room_up[j] : -r->room_down[j]);
            a.down[k] += moved * (moved > 0.0 ? r->room_down[j] : -r->room_up[j]);
            rated[k] += fabs(rows[m * k + j]) * c->manipulator[j].acceleration;
        }
    for (int k = 0; k < count; k++) a.up[k] = fmin(a.up[k], rated[k]), a.down[k] = fmin(a.down[k], rated[k]);
    return a;
}

/* (8) of what the motors can accelerate so hard. */
static bounds_interval in_reach(const chain *c, double up, double down, double lower, double upper, double x,
                                double v) {
    if (!c->inertia) return bounds_c(lower, upper, x, v, c->point_horizon);
    up = between(POINT_SHARE * up, POINT_LEAST, POINT_MOST);
    down = between(POINT_SHARE * down, POINT_LEAST, POINT_MOST);
    const bounds_limits free = {lower, upper, INFINITY, INFINITY};
    const bounds_pace gently = pace(c);
    return bounds_able(&free, &gently, down, up, x, v);
}

/* The torques of the motors: least <= inertia qdd_m + load + feedback <= most. What the feedback adds for a
 * moment gives no room: a rotor that winds up its spring is braked by its damping, and has no more to give to
 * the link for that. */
static void torques(const chain *c) {
    const int m = c->m, dim = dimension(c);
    if (!c->inertia) return;
    for (int i = 0; i < m; i++) {
        memcpy(c->C_torque + dim * i, c->inertia + m * i, (size_t)m * sizeof *c->C_torque);
        /* where it alone asks for more than there is, the link gets all that the motor has against it */
        const double room = c->most[i] - c->least[i], feedback = between(c->feedback[i], -room, room);
        c->lb_torque[i] = c->least[i] - c->load[i] - fmin(0.0, feedback);
        c->ub_torque[i] = fmax(c->lb_torque[i], c->most[i] - c->load[i] - fmax(0.0, feedback));
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

/* Sets A and B of the manipulator, and of the twin: (13), (17), (18), (19). */
static void joint_limits(const chain *c, const reach *r) {
    const bounds_pace gently = pace(c);
    for (int i = 0; i < c->m; i++) {
        const bounds_interval a = bounds_a(&c->manipulator[i], c->q[i], c->qd[i], c->dt);
        const bounds_interval b =
            c->inertia ? bounds_able(&c->manipulator[i], &gently, r->down[i], r->up[i], c->q[i], c->qd[i])
                       : bounds_b(&c->manipulator[i], c->q[i], c->qd[i], c->viability_horizon);
        c->lb2[i] = a.lower, c->ub2[i] = a.upper;
        c->lb7[i] = b.lower, c->ub7[i] = b.upper;
    }
    for (int i = 0; i < c->n; i++) {
        const bounds_interval a = bounds_a(&c->twin[i], c->q_a[i], c->qd_a[i], c->dt);
        /* the twin's stops are met as the machine can stop its handle; what never ends is as it is rated */
        const bounds_interval b = c->inertia && ends(&c->twin[i])
                                      ? bounds_b_within(&c->twin[i], r->twin_down[i], r->twin_up[i],
                                                        c->q_a[i], c->qd_a[i], c->viability_horizon)
                                      : bounds_b(&c->twin[i], c->q_a[i], c->qd_a[i], c->viability_horizon);
        const bounds_interval position = held(c, i, a), ever = held(c, i, b);
        c->lb6[i] = position.lower, c->ub6[i] = position.upper;
        c->lb8[i] = ever.lower, c->ub8[i] = ever.upper;
    }
}

/* (14): sums of joints, with the bounds (8). */
static void sums(const chain *c, const reach *r) {
    const int m = c->m;
    for (int k = 0; k < c->sums; k++) {
        double s = 0.0, sd = 0.0;
        for (int j = 0; j < m; j++)
            s += c->weight[m * k + j] * c->q[j], sd += c->weight[m * k + j] * c->qd[j];
        const together a = move_along(c, r, c->weight + m * k, 1);
        const bounds_interval limit =
            in_reach(c, a.up[0], a.down[0], c->sum_lower[k], c->sum_upper[k], s, sd);
        c->lb3[k] = limit.lower, c->ub3[k] = limit.upper;
    }
}

/* (15) and (16): lb <= J qdd_m + drift <= ub with the bounds (8) of a point in its box. */
static void box(const chain *c, const reach *r, const chain_point *point) {
    const int m = c->m, dim = dimension(c);
    const motion p = carried(c, point->x, point->J, point->drift);
    const together a = move_along(c, r, point->J, 3);
    for (int i = 0; i < 3; i++) {
        const bounds_interval limit =
            in_reach(c, a.up[i], a.down[i], point->lower[i], point->upper[i], p.x[i], p.v[i]);
        for (int j = 0; j < m; j++) point->C[dim * i + j] = point->J[m * i + j];
        point->lb[i] = limit.lower - p.drift[i];
        point->ub[i] = limit.upper - p.drift[i];
    }
}

int chain_limits(const chain *c) {
    const motion H = carried(c, c->x_H, c->J, c->drift);
    reach r;
    if (find_reach(c, &r) < 0) return -1;
    coupling(c, &H);
    torques(c);
    joint_limits(c, &r);
    sums(c, &r);
    for (int k = 0; k < c->points; k++) box(c, &r, &c->point[k]);
    return 0;
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

int chain_assemble(chain *c, double homing) {
    c->homing = homing;
    if (chain_limits(c) < 0) return -1;
    return c->torques ? chain_dynamics(c) : chain_gauss(c);
}

void chain_draw(const chain *c, const double *home, double stiffness, double damping, double *pull) {
    for (int i = 0; i < c->m; i++) pull[i] = stiffness * (home[i] - c->q[i]) - damping * c->qd[i];
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

void chain_spend(const chain *c, const double *x, double tolerance, unsigned char *spent) {
    for (int i = 0; c->inertia && i < c->m; i++) {
        spent[i] = 0;
        mark(row_times(c->C_torque + dimension(c) * i, x, c->m), c->lb_torque[i], c->ub_torque[i], tolerance,
             &spent[i]);
    }
}

void chain_settle(const chain *c, const double *x, double tolerance, unsigned char *active,
                  unsigned char *spent) {
    memset(active, 0, (size_t)(c->n + c->m + c->sums + 3 * c->points));
    chain_spend(c, x, tolerance, spent);
    chain_detect(c, x, tolerance, active);
}
