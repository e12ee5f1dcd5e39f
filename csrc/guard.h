/* Joint limits of a redundant interface, kept by its posture and, at the very end, felt by the hand.
 *
 * What torques tau do to the posture and not to the hand is M^-1 N tau, N = I - J^T J#^T (ContactAware, (3)).
 * With the hand going on as it does, the motors accelerate by
 *     qdd = M^-1 N (tau - bias - friction qd) - J# drift,
 * and each shall be inside its limits one horizon ahead (bounds_c), and turn no faster than it may. Where tau
 * asks for something else, it gets the least change in the M^-1 metric: tau + N sum_i e_i lambda_i, softly,
 * so that motors that the posture can hardly move get no torque in vain. What the hand drags into the last
 * part of the margin meets an end stop. Postures in which only a motor next to its limit can follow the hand
 * are dead ends: avoided beforehand.
 */
#ifndef HAPTICD_GUARD_H
#define HAPTICD_GUARD_H

#include "shape.h"

typedef struct {
    int n, m; /* at most 16 joints, 3 directions */
    /* as redundant_update and nullspace_secondary leave them */
    const double *J SHAPE(m, n), *dJ SHAPE(n, m, n), *M SHAPE(n, n), *q SHAPE(n), *qd SHAPE(n);
    const double *drift SHAPE(m), *bias SHAPE(n);
    const double *inverse SHAPE(m, n); /* J#^T */
    const double *root SHAPE(n, n);    /* L^-1 of M = L L^T */
    const double *friction SHAPE(n);   /* viscous, of the motors */
    const double *limit SHAPE(n);      /* largest torques */
    const double *lower SHAPE(n), *upper SHAPE(n);
    const double *fastest SHAPE(n); /* speeds that the posture keeps, may be infinite */
    double kept;                    /* distance to the limits that the posture keeps */
    double zone;                    /* of the end stop */
    double room;                    /* distance from which on a motor counts fully */
    /* results of guard_update: floor <= rows tau <= ceiling, in torques: row i is M_ii (M^-1 N)_i */
    double *rows SHAPE(n, n), *floor SHAPE(n), *ceiling SHAPE(n);
    double *stop SHAPE(n); /* torque of the end stop, and against speed that the posture cannot keep */
} guard;

/* Rows, their bounds and the end stop for the present state. */
void guard_update(guard *g);

/* Gradient (n) of log(det A / det A_p) / 2, A = sum_i J_i J_i^T / limit_i^2 and A_p the same with each motor
 * weighted by the room that it has: what the hand would lose of its ease of motion if motors next to their
 * limits dropped out. It is 0 away from limits; it grows where one of them is all that moves the hand in some
 * direction, and the posture alone could not take it back. */
void guard_avoid(const guard *g, double *gradient);

/* What to add to the torques tau (n) so that the posture keeps its limits. */
void guard_hold(const guard *g, const double *tau, double *add);

#endif
