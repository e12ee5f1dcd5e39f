/* Inverse kinematics of the Panda in closed form; q7 is free.
 *
 * With q7 the centre of the wrist W, where the axes of joints 5 and 6 meet, is known, and with it the
 * triangle of shoulder, joint 4 and wrist: two angles q4. What W's distance along the axis of joint 5 must be
 * gives two angles q6, and the arm's plane; what remains are Euler angles of the shoulder, two again. All the
 * constants but these are those of the arm's maker: quarter turns from joint to joint, axes along z. */
#ifndef HAPTICD_PANDA_IK_H
#define HAPTICD_PANDA_IK_H

#include "shape.h"

enum { PANDA_JOINTS = 7, PANDA_BRANCHES = 8 };

typedef struct {
    double d3, a4, a5, d5, a7;   /* lengths: upper arm, elbow, forearm, wrist */
    double R_base[9], t_base[3]; /* of joint 1 at rest in the station */
    double R_palm[9], t_palm[3]; /* of the palm in the frame of joint 7 */
    double lower[7], upper[7];   /* of what counts as a solution */
} panda_arm;

/* Branches q (8 x 7) inside the limits at a pose of the palm and q7; returns how many. Where joints 1 and 3
 * turn about one axis, joint 1 is at q1. */
int panda_branches(const panda_arm *arm, const double *position, const double *rotation, double q7, double q1,
                   double *q);

/* The branch next to a configuration, q (7); 0 where there is none, and q is left as it is. */
int panda_nearest(const panda_arm *arm, const double *position, const double *rotation, double q7,
                  const double *near, double *q);

/* What the solutions for all q7 are compared by: sum_i inertia (q_i - start_i)^2 + pull (q_i - home_i)^2. */
typedef struct {
    double inertia, pull;
    const double *start SHAPE(7), *home SHAPE(7);
} panda_wish;

/* The best solution among those that the self-motion leads to from the branch next to the start, q (7);
 * 0 where the pose is out of reach, and q is left as it is. */
int panda_best(const panda_arm *arm, const panda_wish *wish, const double *position, const double *rotation,
               double *q);

/* For so many poses (count x 3, count x 9): 1 where any of so many q7 between its limits has a solution. */
void panda_reach(const panda_arm *arm, int count, const double *position, const double *rotation, int steps,
                 unsigned char *reached);

#endif
