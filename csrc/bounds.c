#include "bounds.h"

#include <math.h>

static double clamp(double x, double lower, double upper) {
    return x < lower ? lower : x > upper ? upper : x; /* what is not a number stays so */
}

static bounds_interval closed(double lower, double upper) {
    if (lower > upper) lower = upper = 0.5 * (lower + upper);
    return (bounds_interval){lower, upper};
}

/* Least acceleration that keeps a joint, `gap` above its lower limit and moving at v, from passing it
 * within dt (Del Prete, algorithm 1), but at most `a_max`. The upper limit is the mirror image: negate v
 * and the result. */
static double least_for_position(double gap, double v, double a_max, double dt) {
    const double at_end = -2.0 * (gap + dt * v) / (dt * dt); /* gap + dt v + dt^2 a / 2 = 0 */
    const double stop = -v / dt;
    if (v >= 0.0 || at_end < stop) return at_end; /* the lowest point is the end of the step */
    /* it turns inside the step, v^2 = 2 a gap; on the limit that is infinite, and a full stop is right */
    return gap > 0.0 ? fmin(v * v / (2.0 * gap), a_max) : stop;
}

/* Least acceleration after which the joint can still brake in front of its lower limit: at the end of
 * the step, v'^2 = 2 a_max gap' (Del Prete, algorithm 2). */
static double least_for_viability(double gap, double v, double a_max, double dt) {
    const double a = dt * dt;
    const double b = 2.0 * dt * v - a_max * a;
    const double c = v * v - 2.0 * a_max * (gap + dt * v);
    const double discriminant = b * b - 4.0 * a * c;
    const double stop = -v / dt;
    if (discriminant < 0.0) return stop;
    return fmin(stop, (-b - sqrt(discriminant)) / (2.0 * a));
}

static bounds_interval velocity_within(const bounds_limits *limits, double qd, double dt) {
    return (bounds_interval){(-limits->velocity - qd) / dt, (limits->velocity - qd) / dt};
}

bounds_interval bounds_a(const bounds_limits *limits, double q, double qd, double dt) {
    /* close to the limit a joint must not be thrown back faster than it came */
    const double rebound = 2.0 * fabs(qd) / dt;
    bounds_interval a = velocity_within(limits, qd, dt);
    q = clamp(q, limits->lower, limits->upper);
    if (isfinite(limits->lower))
        a.lower = fmax(a.lower, least_for_position(q - limits->lower, qd, rebound, dt));
    if (isfinite(limits->upper))
        a.upper = fmin(a.upper, -least_for_position(limits->upper - q, -qd, rebound, dt));
    return closed(a.lower, a.upper);
}

/* The brakes that a joint has in front of a limit `gap` away when it moves towards it at v: those within
 * reach, or what is needed by now. */
static double brakes(double within, double rated, double gap, double v) {
    return fmin(rated, v > 0.0 ? fmax(within, v * v / (2.0 * gap)) : within);
}

bounds_interval bounds_b_within(const bounds_limits *limits, double down, double up, double q, double qd,
                                double dt) {
    const double a_max = limits->acceleration;
    q = clamp(q, limits->lower, limits->upper);
    down = brakes(down, a_max, limits->upper - q, qd);
    up = brakes(up, a_max, q - limits->lower, -qd);
    /* speeds from which the joint can still brake in front of its limits (Del Prete, (10)) */
    const double fastest_down = fmin(limits->velocity, sqrt(2.0 * up * (q - limits->lower)));
    const double fastest_up = fmin(limits->velocity, sqrt(2.0 * down * (limits->upper - q)));
    qd = clamp(qd, -fastest_down, fastest_up);

    bounds_interval b = velocity_within(limits, qd, dt);
    if (isfinite(limits->lower)) {
        const double gap = q - limits->lower;
        b.lower = fmax(b.lower, least_for_position(gap, qd, up, dt));
        b.lower = fmax(b.lower, least_for_viability(gap, qd, up, dt));
    }
    if (isfinite(limits->upper)) {
        const double gap = limits->upper - q;
        b.upper = fmin(b.upper, -least_for_position(gap, -qd, down, dt));
        b.upper = fmin(b.upper, -least_for_viability(gap, -qd, down, dt));
    }
    return closed(fmax(b.lower, -a_max), fmin(b.upper, a_max));
}

bounds_interval bounds_b(const bounds_limits *limits, double q, double qd, double dt) {
    return bounds_b_within(limits, limits->acceleration, limits->acceleration, q, qd, dt);
}

bounds_interval bounds_c(double lower, double upper, double q, double qd, double horizon) {
    const double scale = 2.0 / (horizon * horizon);
    const double ahead = q + horizon * qd;
    return closed(scale * (lower - ahead), scale * (upper - ahead));
}

/* Speed at which a limit may be approached from `gap` away: braking with `a`, which gives way to an
 * exponential approach; from beyond it, that at which to return. */
static double approach(const bounds_pace *pace, double gap, double a) {
    const double tail = a * pace->settle * pace->settle; /* where both meet */
    if (gap > tail) return sqrt(2.0 * a * (gap - 0.5 * tail));
    return fmax(gap / pace->settle, -pace->homing);
}

/* Largest acceleration towards a limit that is `gap` away, at a speed v towards it. */
static double towards(const bounds_pace *pace, double gap, double v, double velocity, double a) {
    const double to_velocity = (velocity - v) / pace->settle;
    if (isinf(gap)) return to_velocity;
    return fmin(to_velocity, (approach(pace, gap - pace->ease * v, a) - v) / pace->ease);
}

bounds_interval bounds_able(const bounds_limits *limits, const bounds_pace *pace, double down, double up,
                            double q, double qd) {
    const double a_max = limits->acceleration;
    const double upper = towards(pace, limits->upper - q, qd, limits->velocity, down);
    const double lower = -towards(pace, q - limits->lower, -qd, limits->velocity, up);
    return closed(clamp(lower, -a_max, a_max), clamp(upper, -a_max, a_max));
}
