/* Acceleration intervals that keep one joint inside its limits (HapticGiant, section VI-B; Del Prete,
 * "Joint position and velocity bounds in discrete-time acceleration/torque control", RA-L 2018).
 *
 * Units are those of the joint: rad or m, s. Position limits may be infinite. An interval whose ends
 * cross by rounding closes to the point between them. */
#ifndef HAPTICD_BOUNDS_H
#define HAPTICD_BOUNDS_H

typedef struct {
    double lower, upper; /* position */
    double velocity;     /* largest speed, > 0 */
    double acceleration; /* largest magnitude, > 0 */
} bounds_limits;

typedef struct {
    double lower, upper;
} bounds_interval;

/* Set A of (7): position and velocity hold at every instant of the next dt; acceleration is free. */
bounds_interval bounds_a(const bounds_limits *limits, double q, double qd, double dt);

/* Set B of (7): position, velocity and acceleration hold for ever (viability). */
bounds_interval bounds_b(const bounds_limits *limits, double q, double qd, double dt);

/* Set B of a joint that can brake no harder than its motor allows: `down` and `up` are the accelerations
 * within reach in either direction, > 0. Set B itself is that of a joint that reaches what it is rated for.
 */
bounds_interval bounds_able(const bounds_limits *limits, double down, double up, double q, double qd,
                            double dt);

/* (8): the position is inside its limits one horizon ahead; returns from outside, too. */
bounds_interval bounds_c(double lower, double upper, double q, double qd, double horizon);

/* (8) within the viable set: what moves towards a limit can still brake in front of it with what is within
 * reach, and what is outside returns at no more than `homing` [1/s]. `viability`: horizon of the braking. */
bounds_interval bounds_point(double lower, double upper, double down, double up, double q, double qd,
                             double horizon, double viability, double homing);

#endif
