/* A serial chain's constants, which come from pinocchio's model (models/serial.py). */
#ifndef HAPTICD_SERIAL_MODEL_H
#define HAPTICD_SERIAL_MODEL_H

enum { SERIAL_MAX_JOINTS = 16 };

typedef struct {
    double R[9], t[3]; /* pose of the joint at rest in the frame of the joint before it */
    double axis[3];    /* unit vector in its own frame */
    int prismatic;
    double mass, centre[3], inertia[9]; /* of what it carries, in its own frame; inertia about the centre */
} serial_joint;

typedef struct {
    int n; /* joints, at most SERIAL_MAX_JOINTS */
    serial_joint joint[16];
} serial_chain;

#endif
