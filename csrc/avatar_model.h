/* The avatar's arm as the operator's side foresees it (Bimanual, IV-A and (6)).
 *
 * From the measured joints the closed form leads to the commanded pose at once, so that a tick bridges all
 * the lag of transport and impedance; what q7 will be the avatar's own pull on its elbow decides. The torques
 * against the limits of the joints foreseen come to the palm through a damped inverse:
 *     w = (J J^T + damping^2)^-1 J tau. */
#ifndef HAPTICD_AVATAR_MODEL_H
#define HAPTICD_AVATAR_MODEL_H

#include "limit_avoidance.h"
#include "panda_ik.h"
#include "serial.h"
#include "shape.h"

typedef struct {
    int n; /* 7 */
    const panda_arm *arm;
    const panda_wish *wish; /* its start: the measured joints */
    const serial_chain *chain;
    const serial_frame *palm;
    const limit_avoidance *limits; /* of the joints foreseen */
    double dt, share;              /* of a tick; of the velocity's low-pass in a tick */
    double damping;
    int begun, reached;
    const double *position SHAPE(3), *rotation SHAPE(3, 3); /* commanded, of the palm */
    double *q SHAPE(n), *qd SHAPE(n);                       /* foreseen */
    double *wrench SHAPE(6);                                /* at the palm in its axes */
} avatar_model;

void avatar_model_update(avatar_model *m);

#endif
