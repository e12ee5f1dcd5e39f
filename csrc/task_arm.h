/* What the laws of telemanipulation need of an arm in every tick: where its palm is, what moves it, and the
 * torque that draws the elbow home without a push on the palm. */
#ifndef HAPTICD_TASK_ARM_H
#define HAPTICD_TASK_ARM_H

#include "serial.h"
#include "shape.h"

typedef struct {
    const serial_chain *chain;
    const serial_frame *palm; /* of the chain */
    int n;                    /* of its joints */
    double gravity[3];        /* in the axes of the base */
    double stiffness, damping;
    const double *posture SHAPE(n); /* that the elbow is drawn to */
    const double *q SHAPE(n), *qd SHAPE(n);
    double *twist SHAPE(6); /* of the palm in the axes of the base */
    double *M SHAPE(n, n);
    double *coriolis SHAPE(n), *weight SHAPE(n); /* torques */
    double *null SHAPE(n);
} task_arm;

/* Everything, the chain's frame included. */
void task_arm_update(const task_arm *a);

/* tau (n) += J^T w for a wrench in the axes of the palm, or of the base. */
void task_arm_push_palm(int n, const double *J, const double *rotation, const double *wrench, double *tau);
void task_arm_push(int n, const double *J, const double *wrench, double *tau);

#endif
