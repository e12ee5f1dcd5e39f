/* What an inertial unit on a link says of the joints that carry it, and the correction of their filters by it
 * (see control/inertial_kalman.py). */
#ifndef HAPTICD_INERTIAL_UNIT_H
#define HAPTICD_INERTIAL_UNIT_H

#include "joint_kalman.h"
#include "shape.h"

/* Accelerometer, then gyroscope, in the axes of the unit. */
enum { INERTIAL_MEASURED = 6, INERTIAL_MAX_JOINTS = 16 };

typedef struct {
    int n; /* joints, at most INERTIAL_MAX_JOINTS */
    /* constants: covariance of the state of each joint's filter, variances of noise and of doubt in the
     * biases, gravity in the axes of the base */
    const double *P SHAPE(n, 7, 7), *noise SHAPE(6), *doubt SHAPE(6), *gravity SHAPE(3);
    /* of the unit, in the axes of the base: Jacobian, acceleration at qdd = 0, pose; acceleration of the base
     * along x and y */
    const double *J SHAPE(6, n), *drift SHAPE(6), *rotation SHAPE(3, 3), *base SHAPE(2);
    const double *specific SHAPE(3), *turning SHAPE(3); /* measured: specific force, angular velocity */
    double *expected SHAPE(6);                          /* without biases */
    double *bias SHAPE(6);                              /* updated */
} inertial_unit;

/* What the unit would measure of the filters' links. */
void inertial_expect(const inertial_unit *u, const joint_kalman *f);

/* Biases are what the unit measures beyond that. */
void inertial_reset(const inertial_unit *u, const joint_kalman *f);

/* Correct filters and biases by what is measured; nothing where that is not finite. */
void inertial_correct(const inertial_unit *u, const joint_kalman *f);

#endif
