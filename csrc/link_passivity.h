/* Passivity of the link between an operator arm and an avatar arm, in the time domain, with energy tanks.
 *
 * Each side keeps a tank. What the operator does against the rendered wrench f fills his: dE = -f^T v dt,
 * what f does on him empties it. What the avatar does to the world, and holds in its spring because of it,
 * empties the other: dE = F^T v dt - d(F^T S^-1 F / 2), F the world's wrench on the palm. Tanks hand energy
 * to each other as a total that only grows, so that lost, late and reordered packets take away and never add.
 * From a tank comes no more power than `rate` times its level: the operator's wrench loses what of it does
 * work beyond that, along the motion and no other part; the avatar's reference is led along F, and comes back
 * to the command as energy allows, so that no drift stays. A wrench at rest does no work and is felt in full.
 * What contacts have used up a light damping of the operator's motion brings in again. */
#ifndef HAPTICD_LINK_PASSIVITY_H
#define HAPTICD_LINK_PASSIVITY_H

#include "shape.h"

enum { PASSIVITY_EMPTY = 1, PASSIVITY_DEBT = 2, PASSIVITY_DRIFT = 4, PASSIVITY_FILLS = 8 };

typedef struct {
    double dt;
    double begin, keep, most; /* levels: at the start, that is not handed over, at which it spills */
    double rate, grant;       /* of what a tank gives out, of what it hands over [1/s] */
    double radius;            /* at which torques count like forces */
    /* state and report */
    double level;
    double sent, received; /* handed over, in all */
    double taken, spilt;   /* from what the wrench would have done, over the rim, in all */
    double damping;        /* of this tick [N s/m] */
    int why;
} energy_tank;

typedef struct {
    energy_tank tank;
    double fill,
        harvest;         /* level below which the motion is damped to fill the tank [J], by so much [N s/m] */
    double most_damping; /* with which a debt is collected */
    const double *wrench SHAPE(6); /* of the avatar's world, as it came, at the palm in its axes */
    const double *rotation SHAPE(3, 3), *twist SHAPE(6); /* of the operator's palm, in the station's axes */
    double *felt SHAPE(6);                               /* what is rendered */
    double before[6];                                    /* twist of the last tick, in the palm's axes */
} operator_port;

typedef struct {
    energy_tank tank;
    double stiffness[6];             /* S of the avatar's impedance */
    double retreat;                  /* fastest way back where there is a debt [m/s] */
    double return_time, speed, turn; /* of the drift: time constant, fastest [m/s, rad/s] */
    const double *felt SHAPE(6);     /* world's wrench on the palm, in its axes */
    const double *rotation SHAPE(3, 3), *twist SHAPE(6);
    const double *position SHAPE(3), *orientation SHAPE(3, 3); /* commanded */
    double *reference SHAPE(3), *reference_rotation SHAPE(3, 3);
    double *drift SHAPE(6);           /* commanded less reference */
    double last[3], last_rotation[9]; /* commanded, of the last tick */
    double stored;                    /* in the spring because of F */
} avatar_port;

/* Start with nothing but `begin` in the tank. */
void operator_port_reset(operator_port *p);

/* The reference is the command. */
void avatar_port_reset(avatar_port *p);

/* One tick; granted: what the other side has handed over in all, as far as is known. */
void operator_port_update(operator_port *p, double granted);
void avatar_port_update(avatar_port *p, double granted);

#endif
