/* A rigid arm in its motors' coordinates q; the joints turn by T q (see sim/rigid.py). */
#ifndef HAPTICD_RIGID_H
#define HAPTICD_RIGID_H

#include "held.h"
#include "links.h"
#include "shape.h"

typedef struct {
    int n, rows;                                      /* motors; directions of what the hand holds, 3 or 6 */
    const double *transmission SHAPE(n, n);           /* T */
    const double *rotor SHAPE(n), *friction SHAPE(n); /* inertia and viscous friction of each motor */
    const double *torque SHAPE(n);                    /* of the motors */
    const double *force SHAPE(3);                     /* on the frame's origin besides the hand's */
    double *q SHAPE(n), *qd SHAPE(n);
    double *qdd SHAPE(n);                         /* of the last step, but for hand and dry friction */
    double *joint SHAPE(n), *joint_rate SHAPE(n); /* T q, T qd */
    double *bias SHAPE(n);                        /* torques that weight and motion of the links take */
    double *inverse SHAPE(n, n);                  /* of the inertia */
    double *J SHAPE(rows, n), *twist SHAPE(rows); /* of the frame */
} rigid;

/* All that depends on the state; `joint` and `joint_rate` are those of the links l. Returns 0, or -1 where
 * the inertia is not positive definite. */
int rigid_observe(const rigid *r, const links *l);

/* A step of h by symplectic Euler; c has the hand and the brakes, as dry friction. Returns as rigid_observe.
 */
int rigid_move(const rigid *r, const links *l, const held *c, double h);

#endif
