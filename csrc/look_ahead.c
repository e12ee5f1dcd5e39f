#include "look_ahead.h"
#include "serial.h"

#include <math.h>

/* Instants of a stop that are looked at anyhow: between two of them what approaches ever more slowly cannot
 * hide. */
enum { INSTANTS = 24, BISECTIONS = 40, EXIT_BISECTIONS = 8 };
/* By so much may come nearer what is nearer than the margin: measurements tremble [m]. */
static const double SLACK = 2e-3;
/* By so much a point may leave its room, or be further outside than it is, before a stop is none that the
 * machine does: its limits are kept on the way to rest, too [m]. */
static const double LEAVES = 10e-3;
/* By so much, before limits make the stop another one [m]. */
static const double TOUCHES = 2e-3;
/* Share of what is within a motor's reach that a stop counts on, and the least of a rated deceleration. */
static const double BRAKING_SHARE = 0.7, LEAST_SHARE = 0.1;
/* What is slower stands [rad/s or m/s]. */
static const double STILL = 1e-3;

typedef struct {
    double R[9 * SERIAL_MAX_JOINTS], p[3 * SERIAL_MAX_JOINTS];
} posture;

static double dot(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double clamp(double x, double lower, double upper) {
    return x < lower ? lower : x > upper ? upper : x;
}

/* A point of a body, in the axes of the base. */
static void place(const posture *at, int joint, const double *local, double *x) {
    if (joint < 0) {
        for (int k = 0; k < 3; k++) x[k] = local[k];
        return;
    }
    const double *R = at->R + 9 * joint, *p = at->p + 3 * joint;
    for (int k = 0; k < 3; k++) x[k] = p[k] + dot(R + 3 * k, local);
}

/* Distance of two segments: the nearest points of their lines, clamped (Ericson, Real-Time Collision
 * Detection, 5.1.9). */
static double segments(const double *p1, const double *q1, const double *p2, const double *q2) {
    double d1[3], d2[3], r[3];
    for (int k = 0; k < 3; k++) d1[k] = q1[k] - p1[k], d2[k] = q2[k] - p2[k], r[k] = p1[k] - p2[k];
    const double a = dot(d1, d1), e = dot(d2, d2), f = dot(d2, r), c = dot(d1, r), tiny = 1e-18;
    double s = 0.0, t = 0.0;
    if (a <= tiny) {
        t = e <= tiny ? 0.0 : clamp(f / e, 0.0, 1.0);
    } else if (e <= tiny) {
        s = clamp(-c / a, 0.0, 1.0);
    } else {
        const double b = dot(d1, d2), denominator = a * e - b * b;
        s = denominator > tiny ? clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
        t = (b * s + f) / e;
        if (t < 0.0)
            t = 0.0, s = clamp(-c / a, 0.0, 1.0);
        else if (t > 1.0)
            t = 1.0, s = clamp((b - c) / a, 0.0, 1.0);
    }
    double gap[3];
    for (int k = 0; k < 3; k++) gap[k] = r[k] + s * d1[k] - t * d2[k];
    return sqrt(dot(gap, gap));
}

/* Squared distance of a point of a segment from a box, and its slope along the segment. */
static double outside(const double *from, const double *way, const double *half, double t, double *slope) {
    double sum = 0.0;
    *slope = 0.0;
    for (int k = 0; k < 3; k++) {
        const double x = from[k] + t * way[k], over = x - clamp(x, -half[k], half[k]);
        sum += over * over, *slope += over * way[k];
    }
    return sum;
}

/* Distance of a segment from a box: convex along the segment, so that its slope is bisected. */
static double segment_box(const double *p, const double *q, const look_ahead_body *box) {
    double from[3], way[3], slope;
    for (int k = 0; k < 3; k++) {
        from[k] = way[k] = 0.0;
        for (int i = 0; i < 3; i++) {
            from[k] += box->R[3 * i + k] * (p[i] - box->a[i]);
            way[k] += box->R[3 * i + k] * (q[i] - p[i]);
        }
    }
    double low = 0.0, high = 1.0;
    const double at_p = outside(from, way, box->b, 0.0, &slope);
    if (slope >= 0.0) return sqrt(at_p);
    const double at_q = outside(from, way, box->b, 1.0, &slope);
    if (slope <= 0.0) return sqrt(at_q);
    for (int k = 0; k < BISECTIONS; k++) {
        const double t = 0.5 * (low + high);
        outside(from, way, box->b, t, &slope);
        if (slope > 0.0)
            high = t;
        else
            low = t;
    }
    return sqrt(outside(from, way, box->b, low, &slope));
}

static double segment_plane(const double *p, const double *q, const look_ahead_body *plane) {
    const double at = dot(plane->a, plane->b);
    return fmin(dot(p, plane->b), dot(q, plane->b)) - at;
}

static double distance(const look_ahead *l, int pair, const posture *at) {
    const look_ahead_body *const first = &l->body[l->pair[pair].first];
    const look_ahead_body *const second = &l->body[l->pair[pair].second];
    double p[3], q[3], a[3], b[3];
    place(at, first->joint, first->a, p), place(at, first->joint, first->b, q);
    if (second->kind == LOOK_BOX) return segment_box(p, q, second) - first->radius;
    if (second->kind == LOOK_PLANE) return segment_plane(p, q, second) - first->radius;
    place(at, second->joint, second->a, a), place(at, second->joint, second->b, b);
    return segments(p, q, a, b) - first->radius - second->radius;
}

static void assume(const look_ahead *l, const double *q, posture *at) {
    serial_places(l->chain, q, at->R, at->p);
}

/* How hard each joint brakes at least: all of them together ask of each motor no more than its share. */
static void brake(look_ahead *l) {
    const int base = l->n - l->m;
    double wanted[SERIAL_MAX_JOINTS];
    for (int i = 0; i < l->n; i++) {
        const double v = l->rate[i];
        l->braking[i] = l->rated[i];
        wanted[i] = fabs(v) < STILL ? 0.0 : -copysign(l->rated[i], v);
    }
    for (int i = 0; i < l->m && l->inertia; i++) {
        double torque = 0.0;
        for (int j = 0; j < l->m; j++) torque += l->inertia[l->m * i + j] * wanted[base + j];
        const double room = torque > 0.0 ? l->most[i] - l->load[i] : l->load[i] - l->least[i];
        const double share = torque == 0.0 ? 1.0 : BRAKING_SHARE * room / fabs(torque);
        l->braking[base + i] *= clamp(share, LEAST_SHARE, 1.0);
    }
}

/* Way of a joint within t of a stop, its speed then, and the way that is left: it goes on until the stop is
 * felt, then brakes. */
static double way(const look_ahead *l, const double *braking, int i, double t, double *speed, double *left) {
    const double felt = fmin(t, l->reaction[i]), v = fabs(l->rate[i]), a = braking[i];
    const double braked = fmin(t - felt, v / a), slower = v - a * braked;
    *speed = t < l->reaction[i] ? fmax(fabs(l->drift[i]), v) : slower;
    *left = fabs(l->drift[i]) * (l->reaction[i] - felt) + 0.5 * slower * slower / a;
    return l->drift[i] * felt + copysign(0.5 * (v + slower) * braked, l->rate[i]);
}

/* Sum of what the joints contribute to a pair. */
static double along(const look_ahead *l, int pair, const double *ways) {
    double sum = 0.0;
    for (int i = 0; i < l->n; i++) sum += l->reach[l->n * pair + i] * ways[i];
    return sum;
}

void look_ahead_reset(look_ahead *l) {
    for (int i = 0; i < l->n; i++) l->seen[i] = l->q[i];
    for (int k = 0; k < l->pairs; k++) l->known[k] = l->allowed[k] = -INFINITY;
}

/* How near each pair may have come since the last tick. */
static void recall(look_ahead *l) {
    double moved[SERIAL_MAX_JOINTS];
    for (int i = 0; i < l->n; i++) moved[i] = fabs(l->q[i] - l->seen[i]), l->seen[i] = l->q[i];
    for (int k = 0; k < l->pairs; k++) l->known[k] -= along(l, k, moved);
}

/* What comes no nearer than it may, whatever the joints do on so much of their way, needs no look. */
static int find_near(look_ahead *l, const double *ahead, int *near) {
    posture here;
    int stale = 0, count = 0;
    recall(l);
    for (int k = 0; k < l->pairs; k++)
        if (!(l->known[k] - l->allowed[k] > along(l, k, ahead))) near[stale++] = k;
    if (stale) assume(l, l->q, &here), l->looks++;
    for (int j = 0; j < stale; j++) {
        const int k = near[j];
        const double d = l->known[k] = distance(l, k, &here);
        const double hardly = d > 0.0 ? fmax(0.0, d - SLACK) : d - SLACK;
        l->allowed[k] = fmin(l->margin, fmax(l->allowed[k], hardly));
        if (!(d - l->allowed[k] > along(l, k, ahead))) near[count++] = k;
    }
    return count;
}

/* The joint that carries a point of the machine which is by so much further out of its room, and than where
 * the stop begins; or -1. */
static int leaves(const look_ahead *l, const posture *begin, const posture *there, double by) {
    for (int i = 0; i < l->rooms; i++) {
        const look_ahead_room *const room = &l->room[i];
        double x[3], now[3];
        place(there, room->joint, room->at, x), place(begin, room->joint, room->at, now);
        for (int k = 0; k < 3; k++)
            if (x[k] > fmax(room->upper[k], now[k]) + by || x[k] < fmin(room->lower[k], now[k]) - by)
                return room->joint;
    }
    return -1;
}

/* Where the joints are within t of a stop; how fast they go then, and the way that is left. */
static void go_on(const look_ahead *l, const double *braking, double t, posture *there, double *speed,
                  double *left) {
    double q[SERIAL_MAX_JOINTS];
    for (int i = 0; i < l->n; i++) q[i] = l->q[i] + way(l, braking, i, t, &speed[i], &left[i]);
    assume(l, q, there);
}

/* Follows the pairs that may come too near through a stop in which the joints brake so hard. exit: the joint
 * whose point left its room; else as it was. */
static int follow(look_ahead *l, const double *braking, const int *from, int count, int *exit) {
    const int n = l->n;
    double left[SERIAL_MAX_JOINTS], speed[SERIAL_MAX_JOINTS], end = 0.0;
    double gap[LOOK_MAX_PAIRS];
    int near[LOOK_MAX_PAIRS];
    posture begin;
    if (!count) return -1;
    assume(l, l->q, &begin);
    for (int i = 0; i < n; i++) {
        end = fmax(end, l->reaction[i] + fabs(l->rate[i]) / braking[i]);
        way(l, braking, i, 0.0, &speed[i], &left[i]);
    }
    for (int j = 0; j < count; j++) {
        near[j] = from[j];
        gap[j] = l->known[near[j]] - l->allowed[near[j]];
    }
    for (double t = 0.0; count && t < end;) {
        double step = end;
        for (int j = 0; j < count; j++) step = fmin(step, gap[j] / fmax(along(l, near[j], speed), 1e-12));
        double inside = t;
        t = fmin(end, t + fmax(step, end / INSTANTS));
        posture there;
        go_on(l, braking, t, &there, speed, left), l->looks++;
        const int outside = leaves(l, &begin, &there, TOUCHES);
        if (outside >= 0) *exit = outside;
        const int left_room = outside >= 0 && leaves(l, &begin, &there, LEAVES) >= 0;
        for (int k = 0; left_room && k < EXIT_BISECTIONS; k++) { /* what is met before is met */
            const double middle = 0.5 * (inside + t);
            go_on(l, braking, middle, &there, speed, left);
            *(leaves(l, &begin, &there, LEAVES) >= 0 ? &t : &inside) = middle;
        }
        if (left_room) go_on(l, braking, inside, &there, speed, left);
        int kept = 0, met = -1;
        double worst = 0.0;
        for (int j = 0; j < count; j++) {
            const int k = near[j];
            const double over = distance(l, k, &there) - l->allowed[k];
            if (over < worst) {
                met = k, worst = over;
                l->apart = l->known[k], l->after = over + l->allowed[k], l->time = t;
            }
            if (over <= along(l, k, left)) near[kept] = k, gap[kept++] = fmax(over, 0.0);
        }
        if (met >= 0 || left_room) return met;
        count = kept;
    }
    return -1;
}

/* How hard each joint brakes where all come to rest with the slowest. */
static void together(const look_ahead *l, double *braking) {
    double end = 0.0;
    for (int i = 0; i < l->n; i++) end = fmax(end, l->reaction[i] + fabs(l->rate[i]) / l->rated[i]);
    for (int i = 0; i < l->n; i++)
        braking[i] = l->rate[i] == 0.0 ? l->rated[i] : fabs(l->rate[i]) / (end - l->reaction[i]);
}

int look_ahead_update(look_ahead *l) {
    double slowest[SERIAL_MAX_JOINTS], braking[SERIAL_MAX_JOINTS], ahead[SERIAL_MAX_JOINTS], speed;
    int near[LOOK_MAX_PAIRS], exit = -1, passed;
    brake(l);
    together(l, slowest);
    for (int i = 0; i < l->n; i++) braking[i] = fmin(slowest[i], l->braking[i]);
    for (int i = 0; i < l->n; i++) way(l, braking, i, 0.0, &speed, &ahead[i]);
    l->looks = 0;
    const int count = find_near(l, ahead, near);
    int met = follow(l, l->braking, near, count, &exit);
    /* joints that make up for one another's motion do so no longer where some of them stop sooner */
    if (met < 0) met = follow(l, l->rated, near, count, &exit);
    /* limits keep a point in its room: a joint that moves it makes up for the others until they stand */
    for (int i = l->n - l->m; met < 0 && i <= exit; i++) {
        if (fabs(l->rate[i]) < STILL) continue;
        for (int k = 0; k < l->n; k++) braking[k] = k == i ? slowest[k] : l->rated[k];
        met = follow(l, braking, near, count, &passed);
    }
    return met;
}

int look_ahead_pressed(look_ahead *l, double share) {
    posture here;
    int placed = 0;
    recall(l);
    l->looks = 0;
    for (int k = 0; k < l->pairs; k++) {
        const double least = share * l->allowed[k];
        if (!(l->allowed[k] > 0.0) || l->known[k] >= least) continue;
        if (!placed) assume(l, l->q, &here), l->looks++;
        placed = 1;
        l->known[k] = distance(l, k, &here);
        if (l->known[k] < least) {
            l->apart = l->known[k];
            return k;
        }
    }
    return -1;
}

void look_ahead_distances(const look_ahead *l, const double *q, double *distances) {
    posture at;
    assume(l, q, &at);
    for (int k = 0; k < l->pairs; k++) distances[k] = distance(l, k, &at);
}
