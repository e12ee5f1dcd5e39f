/* The PPU's share of a tick: observer of its motion, prepositioning (HapticGiant, (27)-(30)).
 * Arrays hold one entry an axis: x, y. */
#ifndef HAPTICD_PPU_H
#define HAPTICD_PPU_H

#include "shape.h"

typedef struct {
    double dt;
    double gain[3];             /* of the correction of position, velocity and bias, times dt */
    double q[2], v[2], bias[2]; /* state: at the measurement, accelerometer bias */
    double *q_now SHAPE(2), *v_now SHAPE(2), *a_now SHAPE(2); /* estimate for the present tick */
} ppu_observer;

/* One tick: encoders (2) [m] and horizontal specific force (2) [m/s^2], both one tick old. */
void ppu_observe(ppu_observer *o, const double *position, const double *force);

typedef struct {
    double link[2];       /* lengths that the elbow and the wrist turn about: joints 2, 3 */
    double best_angle[2]; /* of joints 2 and 3 */
    double lower[2], upper[2];
    double least_angle[2], most_angle[2];  /* limits of joints 2 and 3 */
    double elbow_lower[2], elbow_upper[2]; /* of the box of the elbow, which the PPU carries along */
    double velocity, acceleration;         /* largest */
    double braking;                        /* acceleration that braking in front of a limit counts on */
    double time_constant;                  /* lag of the velocity loop */
    double gain, dt;
    double *command SHAPE(2); /* velocities; state and result */
} ppu_positioning;

/* (30): PPU position (2) that would put joints 2 and 3 at their best angles with the handle at rest.
 *
 * The yaw q1 + q2 + q3 stays as it is, so forearm and handle cancel out of (30) and the difference of the
 * elbow's positions remains. */
void ppu_reference(const ppu_positioning *p, const double *q, const double *q_ppu, double *target);

/* (27) within (28), (29) and a braking curve: wanted velocity of an axis, and its bounds.
 * error: from position to reference; ahead: position with what the lag will still add. */
double ppu_wanted(const ppu_positioning *p, int axis, double error, double ahead, double *least,
                  double *most);

/* Bounds (2) of the velocities that leave the arm the time to stop the elbow in front of its box: as fast as
 * the PPU itself could stop there, but not below PPU_CREEP [m/s], so that it still gets to its place. */
void ppu_approach(const ppu_positioning *p, const double *q, const double *q_ppu, const double *qd_ppu,
                  double *least, double *most);

/* Speeds (2) that move joints 2 and 3 no closer to their limits than the gantry can stop, while the handle is
 * held where it is: as near to the wanted ones as that allows.
 * least, most: of the axes; qd_ppu: of the PPU (2). */
void ppu_yield(const ppu_positioning *p, const double *q, const double *qd_ppu, const double *least,
               const double *most, double *wanted);

/* One tick from joints (6) and the PPU's position and velocity (2). */
void ppu_update(const ppu_positioning *p, const double *q, const double *q_ppu, const double *qd_ppu);

/* One tick of braking at the rated acceleration. */
void ppu_stop(const ppu_positioning *p);

#endif
