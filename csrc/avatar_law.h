/* Torques of an avatar arm (Bimanual, (7) and (8)), gravity apart: an impedance about a goal, which is the
 * commanded pose, the held one, or on the way from one to the other.
 *
 * Beyond the paper, the arm keeps away from its own limits, for (6) lets the operator feel only what its palm
 * can tell; and what holds up the arm beside the spring as it begins to hold goes on doing so: the spring
 * alone would let it sag by all that its model lacks. An integral takes the rest, within bounds, and both
 * fade as the arm follows again. */
#ifndef HAPTICD_AVATAR_LAW_H
#define HAPTICD_AVATAR_LAW_H

#include "shape.h"

typedef struct {
    int n;
    double stiffness[6], damping[6]; /* S, D: diagonals */
    double rate;                     /* of the integral that keeps the held pose [1/s] */
    double most_force, most_torque;  /* of that integral */
    double most_pull, most_turn;     /* of the springs: force [N], torque [N m] */
    double dt, fade;                 /* of a tick, of the way from the held to the commanded pose [s] */
    const double *J SHAPE(6, n), *position SHAPE(3), *rotation SHAPE(3, 3), *twist SHAPE(6);
    const double *null SHAPE(n), *coriolis SHAPE(n), *own SHAPE(n);
    const double *commanded SHAPE(3), *commanded_rotation SHAPE(3, 3);
    /* state */
    double held[3], held_rotation[9], steady[6], turn[3];
    double share; /* of the way to the commanded pose: 0 while it holds, 1 where it follows */
    /* results */
    double *goal SHAPE(3), *goal_rotation SHAPE(3, 3);
    double *error SHAPE(6);  /* current less goal, in the axes of the base */
    double *wrench SHAPE(6); /* of the impedance on the palm, in the axes of the base */
    double *torque SHAPE(n);
} avatar_law;

/* The pose of now is held from now on; `steady`: what held the arm there goes on. */
void avatar_law_hold(avatar_law *l, int steady);

/* One tick; `follow`: there is a commanded pose to go to. */
void avatar_law_update(avatar_law *l, int follow);

#endif
