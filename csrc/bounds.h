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

/* The same where brakes reach no more than `down` and `up`, > 0, the accelerations in either direction: what
 * is too fast for that brakes as hard as is needed by now, and rated. */
bounds_interval bounds_b_within(const bounds_limits *limits, double down, double up, double q, double qd,
                                double dt);

/* How gently limits are met: springs between motors and links ring where accelerations step. */
typedef struct {
    double ease;   /* looks so far ahead [s] */
    double settle; /* time constant of the last of the way, and of speeds [s] */
    double homing; /* fastest return from outside [1/s] */
} bounds_pace;

/* Position, velocity and acceleration of what can brake no harder than its motors allow: `down` and `up` are
 * the accelerations within reach in either direction, > 0. In place of set B, for ever like that; from
 * outside it returns. */
bounds_interval bounds_able(const bounds_limits *limits, const bounds_pace *pace, double down, double up,
                            double q, double qd);

/* (8): the position is inside its limits one horizon ahead; returns from outside, too. */
bounds_interval bounds_c(double lower, double upper, double q, double qd, double horizon);

#endif
