/* Whether a serial machine would meet itself or its surroundings if it began to stop now.
 *
 * What moves is covered by capsules; what stands is a capsule, a box or a half-space. Along the way of the
 * stop a pair is looked at again no later than it can have come as near as it may: a point of one body moves
 * no faster against the other than `reach` times the speeds of the joints between them. */
#ifndef HAPTICD_LOOK_AHEAD_H
#define HAPTICD_LOOK_AHEAD_H

#include "serial_model.h"
#include "shape.h"

enum { LOOK_CAPSULE = 0, LOOK_BOX = 1, LOOK_PLANE = 2, LOOK_MAX_PAIRS = 1024 };

typedef struct {
    int kind;
    int joint;     /* the one that carries it, -1: it stands */
    double radius; /* of a capsule */
    double a[3]; /* one end of a capsule, the centre of a box, or a point of a plane; in the joint's frame */
    double b[3]; /* the other end, half of a box's sides, or a plane's normal */
    double R[9]; /* axes of a box */
} look_ahead_body;

typedef struct {
    int first, second; /* bodies; the first is a capsule */
} look_ahead_pair;

/* A point of the machine, and the room that its limits keep it in, in a stop, too, as long as all that they
 * depend on is measured. */
typedef struct {
    int joint;                 /* the one that carries it */
    double at[3];              /* in its frame */
    double lower[3], upper[3]; /* along the axes of the base */
} look_ahead_room;

typedef struct {
    int n, bodies, pairs; /* at most SERIAL_MAX_JOINTS, any number, LOOK_MAX_PAIRS */
    int rooms;            /* points that have one */
    int m;                /* the last joints, whose motors may give less than they are rated for */
    const serial_chain *chain;
    const look_ahead_body *body SHAPE(bodies);
    const look_ahead_pair *pair SHAPE(pairs);
    const look_ahead_room *room SHAPE(rooms);
    const double *reach SHAPE(pairs, n); /* most that a pair comes closer by a unit of a joint's way */
    double margin;                       /* no pair may come nearer [m] */
    /* inputs of a tick: where the joints are, how fast they go on until the stop is felt and for how long,
     * and from which speed they brake then, as hard as rated or only as the motors can: inertia with rotors,
     * torque at rest, and what may be commanded (csrc/tracking.h) */
    const double *q SHAPE(n), *drift SHAPE(n), *reaction SHAPE(n), *rate SHAPE(n), *rated SHAPE(n);
    const double *inertia OPTIONAL(m, m), *load OPTIONAL(m), *least OPTIONAL(m), *most OPTIONAL(m);
    double *braking SHAPE(n);
    double *seen SHAPE(n); /* where the joints were at the last tick */
    /* how near each pair may be at most to now, and how near it may come: as near as the margin, or where it
     * was nearer already, hardly nearer */
    double *known SHAPE(pairs), *allowed SHAPE(pairs);
    double apart, after, time; /* of the pair that would meet: now, in the stop [m], and when in it [s] */
    int looks;                 /* postures of the last tick in which pairs were looked at */
} look_ahead;

/* Forget where the joints were: what is near now may stay so. */
void look_ahead_reset(look_ahead *l);

/* The pair that would come too near in a stop from here, or -1. */
int look_ahead_update(look_ahead *l);

/* A pair that is nearer than a share of what it may be, of a machine that is held; or -1. */
int look_ahead_pressed(look_ahead *l, double share);

/* Distances of all pairs (pairs) at a posture (n); what overlaps is below 0, a box at -radius. */
void look_ahead_distances(const look_ahead *l, const double *q, double *distance);

#endif
