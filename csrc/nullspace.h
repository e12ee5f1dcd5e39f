/* Null-space control of a redundant interface (ContactAware), the part that every tick needs.
 *
 * The force ellipsoid M = A^-1, A = J W^2 J^T, W = diag(1/limit), is pulled towards a desired D = B^-1 by the
 * Stein divergence, which inversion leaves as it is:
 *     v = logdet((A + B)/2) - logdet(A B)/2,   dv/dq_k = 2 tr(G dJ_k W^2 J^T),   G = (A + B)^-1 - A^-1/2.
 * The secondary torque moves the posture and not the hand:
 *     tau_N = (I - J^T J#^T) tau_s,   J# = M^-1 J^T (J M^-1 J^T)^-1,   tau_s = -beta dv/dq - K_d qd.
 * tau_N does not accelerate the hand, but the motion that it causes does: the coupling force
 *     f = J#^T (bias + friction qd_N) - (J M^-1 J^T)^-1 drift,   qd_N = (I - J# J) qd
 * cancels that. Beyond the paper, tau_s may also pull towards known postures, so that the way is no detour,
 * and is no stiffer and no less damped than suits the tick: with H an upper bound of v's second derivatives
 * and w^2 = tr(M^-1 N (beta H + stiffness)), at least the square of the fastest swing about an optimum, the
 * pull is scaled until w <= fastest, and -2 ratio w M qd damps it.
 */
#ifndef HAPTICD_NULLSPACE_H
#define HAPTICD_NULLSPACE_H

#include "guard.h"
#include "shape.h"

typedef struct {
    int n, m;     /* at most 16 joints, 3 directions */
    guard *guard; /* of the joint limits */
    /* inputs of a tick, as redundant_update leaves them */
    const double *J SHAPE(m, n), *dJ SHAPE(n, m, n), *M SHAPE(n, n), *q SHAPE(n), *qd SHAPE(n);
    const double *drift SHAPE(m), *bias SHAPE(n);
    const double *friction SHAPE(n);   /* viscous, of the motors */
    const double *limit SHAPE(n);      /* largest torques, of the ellipsoids */
    const double *room SHAPE(n);       /* what the weight of the arm leaves of them, above 0 */
    const double *motion SHAPE(m, m);  /* u u^T of the direction of motion */
    const double *contact SHAPE(m, m); /* the same of the environment's force */
    double major, minor;               /* eigenvalues of the desired ellipsoids along and across */
    double beta, damping, cap;         /* step, K_d, largest norm of the projected pull */
    double ratio, fastest; /* of the damping besides, 0 for K_d alone; and the fastest swing [rad/s] */
    /* postures that are best for free motion and for contact */
    const double *free SHAPE(n), *stiff SHAPE(n);
    double stiffness; /* of the pull towards them, 0 for none */
    /* results of nullspace_secondary */
    double *gradient SHAPE(n);  /* dv/dq */
    double *secondary SHAPE(n); /* tau_s */
    double *null SHAPE(n);      /* tau_N; of the tick before when called */
    double cost;                /* v */
    double drive;               /* norm of the projected pull on the posture, uncapped */
    /* results of nullspace_secondary for a hierarchy of tasks, which weighs torques by |L^-1 tau|, M = L L^T
     */
    double *inverse SHAPE(m, n); /* J#^T: the force on the hand that torques make */
    double *root SHAPE(n, n);    /* L^-1 */
    double *coupling SHAPE(m);   /* force on the hand that cancels what the posture's motion does to it */
    /* results of nullspace_compose */
    double *wanted SHAPE(n); /* J^T F */
    double *torque SHAPE(n);
    double alpha; /* share of the wanted torque */
    double share; /* share of the null-space torque; of the tick before when called */
    double slew;  /* largest rise of it in a call, less for a posture that asks for more than the limits; it
                   * falls 2.5 times as fast, and null changes by twice as much, as a part of limit */
    /* torques, force and share of the call of nullspace_ease before */
    double *given SHAPE(n), *asked SHAPE(m);
    double rendered;
} nullspace;

/* Cost, gradient, secondary and null-space torque for D = omega D_free + (1 - omega) D_stiff, (12), (13),
 * (16); 0 in a singular posture, where the results are void. */
int nullspace_secondary(nullspace *s, double omega);

/* J^T F for a force F (m) on the hand. */
void nullspace_wanted(nullspace *s, const double *force);

/* Actuator saturation observer V of the torques J^T F in a posture with Jacobian J (m x n), (14): 1 without
 * torque, 0 where any motor saturates. */
double nullspace_reserve(const nullspace *s, const double *J, const double *force, double steepness);

/* Largest share <= 1 of J^T F that keeps this part (0 to 1) of the limits. */
double nullspace_within(const nullspace *s, double part);

/* The same, beside what else the hand is to feel: f and the end stop. A hierarchy that renders more has
 * to drive the posture into the corners of the torque box for it. */
double nullspace_bearable(const nullspace *s, double part);

/* alpha J^T F + share (gain tau_N + J^T f) with the largest alpha <= 1 that keeps this part (0 to 1) of the
 * limits, then the largest share <= 1 that keeps the limits. What the joint limits need besides comes before
 * both, and share changes by no more than slew: alpha yields to them. */
void nullspace_compose(nullspace *s, double part, double gain);

/* Let torques (n), which render this share of a force (m), follow what they are to be, and return the share
 * that they render: beyond what the change of the force explains none steps by more than 2.8 slew, as a part
 * of limit. */
double nullspace_ease(nullspace *s, const double *force, double share, double *torque);

/* Rows of a hierarchy over (tau, alpha), each n + 1 wide, with their right-hand sides:
 *     force (m):       J#^T (tau - alpha J^T F) = J#^T (stop + J^T f + gain tau_N)
 *     limits (n):      floor <= rows tau <= ceiling, of the guard
 *     posture (n + 1): L^-1 (tau - alpha J^T F) = L^-1 (N stop + gain tau_N), w alpha = w
 * Bounds of the guard give way to what guard_hold leaves. Posture and force are one level: where the force
 * came first torques would jump from one corner of the box to another where a little of alpha is to be had
 * there. With w = 10 |L^-1 J^T F| what is wanting of the force counts ten times as far as the same torques
 * of the posture. */
void nullspace_levels(const nullspace *s, double gain, double *force, double *force_b, double *limits,
                      double *posture, double *posture_b);

#endif
