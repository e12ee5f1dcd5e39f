/* Joint tracking of series-elastic drives (see control/tracking.py for the law and its reasons). */
#ifndef HAPTICD_TRACKING_H
#define HAPTICD_TRACKING_H

enum { TRACKING_MAX_JOINTS = 24 };

typedef struct {
    int n; /* joints, at most TRACKING_MAX_JOINTS */
    /* constants, (n): viscous friction, rotor inertia, spring stiffness, motor-side gains */
    const double *friction, *rotor, *stiffness, *p, *d;
    /* inputs of a tick: commanded state (n), rigid-body torque of it (n), handle Jacobian (6 x n), wrench on
     * the handle (6), measured motor state (n) */
    const double *q, *qd, *qdd, *rigid, *J, *wrench, *motor, *motor_rate;
    double *reference, *rate; /* (n) motor-side reference of the last tick; updated */
    double *torque;           /* (n) result */
} tracking;

/* `fresh`: there was no last tick. */
void tracking_update(const tracking *t, int fresh);

/* Operator's wrench (6) at the handle in B from the sensor's reading (6).
 *
 * mass, centre (3): of the tool, in the sensor's frame; R_sensor (9), arm (3): pose of the sensor in the
 * handle's frame; specific_force (3): at the handle, in its frame; R_handle (9): of the handle in B. */
void tracking_wrench(double mass, const double *centre, const double *R_sensor, const double *arm,
                     const double *measured, const double *specific_force, const double *R_handle,
                     double *wrench);

#endif
