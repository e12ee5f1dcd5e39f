/* Rotors and springs of series-elastic joints: the plant's inner steps (see sim/dynamics.py). */
#ifndef HAPTICD_ELASTIC_H
#define HAPTICD_ELASTIC_H

typedef struct {
    int n;
    /* constants (n): spring stiffness and damping, rotor inertia, viscous friction and brake of each joint */
    const double *stiffness, *damping, *rotor, *friction, *brake;
    const double *torque;        /* (n) of the motors */
    const unsigned char *braked; /* (n) */
    const double *qdd;           /* (n) of the links */
    double *q, *qd;              /* (n) links */
    double *motor, *motor_rate;  /* (n) rotors, in joint units */
    double *spring;              /* (n) torque in the springs */
    double *load;                /* (n) spring less friction: what moves the links */
} elastic;

/* Torques at the present state. */
void elastic_torques(const elastic *e);

/* Symplectic Euler over h: rates first, then positions. Brakes are dry friction on the rotors. */
void elastic_advance(const elastic *e, double h);

#endif
