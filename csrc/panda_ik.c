#include "panda_ik.h"

#include <math.h>
#include <string.h>

static const double PI = 3.141592653589793;
static const double SLACK = 1e-9;                                 /* rounding at a limit [rad] */
static const double ALIGNED = 1e-12;                              /* sine below which two axes are one */
static const double DIFFERENCE = 1e-3, LONGEST = 0.2, SCAN = 0.1; /* of q7, in the search [rad] */
enum { ITERATIONS = 12, HALVINGS = 6 };

/* Pose of the frame of joint 7 from the shoulder, in the frame of joint 1 at rest. */
typedef struct {
    double R[9], p[3];
} wrist_pose;

static double dot(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double wrapped(double q, double lower, double upper) {
    const double centre = 0.5 * (lower + upper);
    return centre + remainder(q - centre, 2.0 * PI);
}

static wrist_pose without_palm(const panda_arm *arm, const double *position, const double *rotation) {
    wrist_pose w;
    double world[9], r[3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) world[3 * i + j] = dot(rotation + 3 * i, arm->R_palm + 3 * j);
    for (int i = 0; i < 3; i++) r[i] = position[i] - dot(world + 3 * i, arm->t_palm) - arm->t_base[i];
    for (int i = 0; i < 3; i++) {
        const double *B = arm->R_base + i;
        w.p[i] = B[0] * r[0] + B[3] * r[1] + B[6] * r[2];
        for (int j = 0; j < 3; j++)
            w.R[3 * i + j] = B[0] * world[j] + B[3] * world[3 + j] + B[6] * world[6 + j];
    }
    return w;
}

/* Joints 1 to 3 from the axes x, z of the frame of joint 3: Rz(q1) Ry(q2) Rz(q3); `side`: sign of q2. */
static void shoulder(const double *x, const double *z, double side, double q1, double *q) {
    const double sine = hypot(z[0], z[1]);
    q[0] = sine > ALIGNED ? atan2(side * z[1], side * z[0]) : q1;
    q[1] = atan2(side * sine, z[2]);
    const double c1 = cos(q[0]), s1 = sin(q[0]), c2 = cos(q[1]), s2 = sin(q[1]);
    q[2] = atan2(c1 * x[1] - s1 * x[0], c1 * c2 * x[0] + s1 * c2 * x[1] - s2 * x[2]);
}

static int inside(const panda_arm *arm, double *q) {
    for (int i = 0; i < PANDA_JOINTS; i++) {
        q[i] = wrapped(q[i], arm->lower[i], arm->upper[i]);
        if (!(q[i] >= arm->lower[i] - SLACK && q[i] <= arm->upper[i] + SLACK)) return 0;
    }
    return 1;
}

/* The rest from q4, q6 and q7: W, the axes of joint 6, and of W in the frame of joint 4 the coordinates along
 * x and y. */
static int finish(const panda_arm *arm, const double *W, double axes[3][3], double along, double reach,
                  double q1, double *q, double *found) {
    const double c6 = cos(q[5]), s6 = sin(q[5]), c4 = cos(q[3]), s4 = sin(q[3]);
    double x4[3], y4[3], z4[3], x5[3], x3[3], z3[3], size = 0.0;
    int count = 0;
    for (int k = 0; k < 3; k++) {
        y4[k] = s6 * axes[0][k] + c6 * axes[1][k];
        x5[k] = c6 * axes[0][k] - s6 * axes[1][k];
        x4[k] = W[k] - along * y4[k];
        size += x4[k] * x4[k];
    }
    size = copysign(sqrt(size), reach);
    if (!(fabs(size) > ALIGNED)) return 0;
    for (int k = 0; k < 3; k++) x4[k] /= size;
    for (int k = 0; k < 3; k++) z4[k] = x4[(k + 1) % 3] * y4[(k + 2) % 3] - x4[(k + 2) % 3] * y4[(k + 1) % 3];
    q[4] = atan2(-dot(x5, z4), dot(x5, x4));
    for (int k = 0; k < 3; k++) {
        x3[k] = c4 * x4[k] - s4 * y4[k];
        z3[k] = s4 * x4[k] + c4 * y4[k];
    }
    for (int side = -1; side <= 1; side += 2) {
        double *all = found + PANDA_JOINTS * count;
        memcpy(all, q, sizeof(double) * PANDA_JOINTS);
        shoulder(x3, z3, side, q1, all);
        count += inside(arm, all);
    }
    return count;
}

static int branches(const panda_arm *arm, const wrist_pose *w, double q7, double q1, double *found) {
    const double a = arm->a4, b = arm->a5, d3 = arm->d3, d5 = arm->d5, c7 = cos(q7), s7 = sin(q7);
    double axes[3][3], W[3], V[2], q[PANDA_JOINTS];
    for (int k = 0; k < 3; k++) {
        const double *R = w->R + 3 * k;
        axes[0][k] = c7 * R[0] - s7 * R[1];
        axes[1][k] = -R[2];
        axes[2][k] = s7 * R[0] + c7 * R[1];
        W[k] = w->p[k] - arm->a7 * axes[0][k];
    }
    V[0] = dot(axes[0], W), V[1] = dot(axes[1], W);
    const double across = hypot(V[0], V[1]), towards = atan2(V[0], V[1]);
    const double A = a * b - d3 * d5, B = a * d5 + d3 * b, sides = hypot(A, B);
    const double C = 0.5 * (a * a + d3 * d3 + b * b + d5 * d5 - dot(W, W));
    const double opening = atan2(sqrt((sides - C) * (sides + C)), C), straight = atan2(B, A);
    int count = 0;
    if (!(fabs(C) <= sides)) return 0;
    q[6] = q7;
    for (int bend = -1; bend <= 1; bend += 2) {
        q[3] = straight + bend * opening;
        const double c4 = cos(q[3]), s4 = sin(q[3]);
        const double along = d5 - a * s4 + d3 * c4, reach = a * c4 + d3 * s4 - b;
        if (!(fabs(along) <= across)) continue;
        const double swing = atan2(sqrt((across - along) * (across + along)), along);
        for (int flip = -1; flip <= 1; flip += 2) {
            q[5] = towards + flip * swing;
            count += finish(arm, W, axes, along, reach, q1, q, found + PANDA_JOINTS * count);
        }
    }
    return count;
}

static int nearest(const panda_arm *arm, const wrist_pose *w, double q7, const double *near, double *q) {
    double found[PANDA_BRANCHES * PANDA_JOINTS], least = INFINITY;
    const int count = branches(arm, w, q7, near[0], found);
    int best = -1;
    for (int k = 0; k < count; k++) {
        double distance = 0.0;
        for (int i = 0; i < PANDA_JOINTS; i++) {
            const double d = found[PANDA_JOINTS * k + i] - near[i];
            distance += d * d;
        }
        if (distance < least) least = distance, best = k;
    }
    if (best >= 0) memcpy(q, found + PANDA_JOINTS * best, sizeof(double) * PANDA_JOINTS);
    return best >= 0;
}

int panda_branches(const panda_arm *arm, const double *position, const double *rotation, double q7, double q1,
                   double *q) {
    const wrist_pose w = without_palm(arm, position, rotation);
    return branches(arm, &w, q7, q1, q);
}

int panda_nearest(const panda_arm *arm, const double *position, const double *rotation, double q7,
                  const double *near, double *q) {
    const wrist_pose w = without_palm(arm, position, rotation);
    return nearest(arm, &w, q7, near, q);
}

/* Cost of the branch at q7 that is next to `near`; infinite where there is none. */
static double cost(const panda_arm *arm, const panda_wish *wish, const wrist_pose *w, double q7,
                   const double *near, double *q) {
    double sum = 0.0;
    if (!nearest(arm, w, q7, near, q)) return INFINITY;
    for (int i = 0; i < PANDA_JOINTS; i++) {
        const double moved = q[i] - wish->start[i], off = q[i] - wish->home[i];
        sum += wish->inertia * moved * moved + wish->pull * off * off;
    }
    return sum;
}

/* The q7 next to the start's that has a solution. */
static int begin(const panda_arm *arm, const panda_wish *wish, const wrist_pose *w, double *q) {
    const double q7 = wish->start[6];
    const int most = (int)((arm->upper[6] - arm->lower[6]) / SCAN) + 1;
    for (int k = 0; k <= most; k++)
        for (int side = -1; side <= 1; side += 2)
            if (nearest(arm, w, q7 + side * k * SCAN, wish->start, q)) return 1;
    return 0;
}

int panda_best(const panda_arm *arm, const panda_wish *wish, const double *position, const double *rotation,
               double *q) {
    const wrist_pose w = without_palm(arm, position, rotation);
    double now[PANDA_JOINTS], other[PANDA_JOINTS];
    if (!begin(arm, wish, &w, now)) return 0;
    double here = cost(arm, wish, &w, now[6], now, now);
    for (int k = 0; k < ITERATIONS; k++) {
        const double up = cost(arm, wish, &w, now[6] + DIFFERENCE, now, other);
        const double down = cost(arm, wish, &w, now[6] - DIFFERENCE, now, other);
        double step = up < down ? LONGEST : -LONGEST;
        if (isfinite(up) && isfinite(down)) {
            const double slope = 0.5 * (up - down) / DIFFERENCE;
            const double bend = (up - 2.0 * here + down) / (DIFFERENCE * DIFFERENCE);
            if (bend > 0.0) step = fmax(-LONGEST, fmin(LONGEST, -slope / bend));
        }
        double there = cost(arm, wish, &w, now[6] + step, now, other);
        for (int h = 0; h < HALVINGS && !(there <= here); h++) {
            step *= 0.5;
            there = cost(arm, wish, &w, now[6] + step, now, other);
        }
        if (!(there <= here)) break;
        here = there;
        memcpy(now, other, sizeof now);
        if (fabs(step) < SLACK) break;
    }
    memcpy(q, now, sizeof now);
    return 1;
}

void panda_reach(const panda_arm *arm, int count, const double *position, const double *rotation, int steps,
                 unsigned char *reached) {
    double found[PANDA_BRANCHES * PANDA_JOINTS];
    const double width = arm->upper[6] - arm->lower[6];
    for (int i = 0; i < count; i++) {
        const wrist_pose w = without_palm(arm, position + 3 * i, rotation + 9 * i);
        reached[i] = 0;
        for (int k = 0; k < steps && !reached[i]; k++) {
            const double q7 = arm->lower[6] + width * (k + 0.5) / steps;
            reached[i] = branches(arm, &w, q7, 0.0, found) > 0;
        }
    }
}
