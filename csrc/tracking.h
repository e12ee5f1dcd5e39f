/* Joint tracking of series-elastic drives (see control/tracking.py for the law and its reasons). */
#ifndef HAPTICD_TRACKING_H
#define HAPTICD_TRACKING_H

#include "drift.h"
#include "serial_model.h"
#include "shape.h"

enum { TRACKING_MAX_JOINTS = 24, TRACKING_STAGES = 3 };

typedef struct {
    int n; /* joints, at most TRACKING_MAX_JOINTS */
    double dt;
    const serial_chain *chain; /* of the links */
    double still[3];           /* gravity on a base that stands */
    /* constants: viscous friction of the links, rotor inertia, spring stiffness, motor-side gains */
    const double *friction SHAPE(n), *rotor SHAPE(n), *stiffness SHAPE(n), *p SHAPE(n), *d SHAPE(n);
    /* constants: dry and viscous friction of the gears, what they have besides as a share of the torque in
     * the spring, dry friction of the bearings, and the speed beyond which dry friction is almost whole */
    const double *gear SHAPE(n), *gear_damping SHAPE(n), *load_share SHAPE(n), *bearing SHAPE(n);
    const double *slow SHAPE(n);
    /* inputs of a tick: commanded state, handle Jacobian, wrench on the handle, measured motor state, link
     * and torque between both */
    const double *q SHAPE(n), *qd SHAPE(n), *qdd SHAPE(n);
    const double *J SHAPE(6, n), *wrench SHAPE(6), *motor SHAPE(n), *motor_rate SHAPE(n);
    const double *link SHAPE(n), *sensed SHAPE(n);
    double *rigid SHAPE(n);                     /* rigid-body torque of the commanded state */
    double *reference SHAPE(n), *rate SHAPE(n); /* motor-side reference of the last tick; updated */
    /* torque through the spring in the stages of its filter, and its first and second derivative; updated */
    double *smoothed SHAPE(n, 3), *slope SHAPE(n), *curve SHAPE(n);
    double *torque SHAPE(n); /* result */
    /* torque of the wrench that each spring, or torque sensor without one, showed in the last tick, and
     * whether no more of it is believed */
    double *shown SHAPE(n);
    int doubted;

    /* what the drives are admitted: torque, its product with the measured speed, and the measured positions
     * of the links beyond which no torque leads further out */
    const double *most_torque SHAPE(n), *most_power SHAPE(n);
    const double *lower SHAPE(n), *upper SHAPE(n);
    /* forecast of a tick: inertia of links and rotors, torque at qdd = 0 without the feedback, the feedback,
     * what of that no yielding of the spring explains, and the torques between which the drives are
     * admitted */
    double *inertia SHAPE(n, n), *load SHAPE(n), *feedback SHAPE(n), *strain SHAPE(n);
    double *least SHAPE(n), *most SHAPE(n);
} tracking;

/* Before qdd is known. base (2): acceleration of what carries the chain, along x and y. */
void tracking_forecast(const tracking *t, const double *base, int fresh);

/* Whether a joint shows less of the wrench than there should be. */
int tracking_contradicted(const tracking *t);

/* `fresh`: there was no last tick; `planned`: there was a forecast of this one. */
void tracking_update(const tracking *t, const double *base, int fresh, int planned);

/* A force-torque sensor with a tool on it: what the operator pulls is what it reads, less the tool's weight,
 * inertia, and the sensor's bias and drift. */
typedef struct {
    double mass;                                       /* of the tool */
    const double *centre SHAPE(3);                     /* of the tool, in the sensor's frame */
    const double *bias SHAPE(6);                       /* of the sensor */
    const double *R_sensor SHAPE(3, 3), *arm SHAPE(3); /* pose of the sensor in the handle's frame */
    /* inputs of a tick: reading, specific force at the handle in its frame, rotation of the handle in B */
    const double *measured SHAPE(6), *specific_force SHAPE(3), *R_handle SHAPE(3, 3);
    drift *drift;            /* updated */
    double *wrench SHAPE(6); /* of the operator, at the handle in B; the result */
} tracking_tool;

void tracking_wrench(const tracking_tool *t);

#endif
