/*
 * Plausibility of what was measured, before anything integrates, differentiates or feeds it forward.
 *
 * All arrays belong to the caller and have n entries unless they say otherwise; nothing here allocates. NULL
 * where an array is optional. Times count in ticks.
 */
#ifndef HAPTICD_PLAUSIBILITY_H
#define HAPTICD_PLAUSIBILITY_H

#include <stdint.h>

enum { PLAUSIBILITY_NEVER = 1 << 30, PLAUSIBILITY_EXTRAPOLATED = 3 };

/* Values of one kind, as decoded. */
typedef struct {
    int n;
    double *value;        /* what is rejected is replaced by what was accepted last, extrapolated */
    const double *rate;   /* optional: measured rate of each, checked before [1/s] */
    const int *device;    /* which device sends it */
    const uint8_t *fresh; /* (devices) 1 where its frame arrived in this tick, `stride` bytes apart */
    int stride;
    double dt;          /* of a tick [s] */
    const double *most; /* largest magnitude */
    const double *step; /* largest change in a tick */
    double *accepted;   /* last accepted value */
    int32_t *age;       /* ticks since that; PLAUSIBILITY_NEVER before the first */
    uint8_t *rejected;  /* 1 where this tick's value was not accepted */
} plausible_values;

/* Takes a tick; `elapsed` ticks after the last. Returns how many values are not of this tick, for whatever
   reason. Before anything was accepted the last accepted value is 0. */
int plausible_accept(const plausible_values *v, int elapsed);

/* Encoders of one kind: does one stand still although its axis must move? */
typedef struct {
    int n;
    int limit;              /* ticks of standstill that are enough */
    double dt;              /* [s] */
    const double *position; /* by the encoder */
    const double *velocity; /* measured, of the axis */
    const double *command;  /* what the drive was told: torque or velocity */
    const double *opposing; /* optional: measured torque that balances the command */
    const double *acting;   /* command less opposing torque beyond which the axis must move */
    const double *quantum;  /* less is no motion */
    const double *reach;    /* travel by the measured velocity beyond which the encoder must have moved */
    double *anchor;         /* where it stands */
    double *travel;         /* by the measured velocity since then */
    int32_t *still;         /* ticks since then */
    int32_t *pushed;        /* ticks of them that the command acts in one direction, negative: backwards */
    uint8_t *frozen;        /* 1 where it stands still although the axis must move */
} plausible_motion;

/* Takes a tick; `free_to_move`: whether commands may move the axes. Returns how many encoders are frozen.
 * Ticks that were skipped do not count: nobody saw what the axes did meanwhile. */
int plausible_move(const plausible_motion *m, int free_to_move);

/* Pairs of encoders on both sides of a spring, or of nothing that yields. */
typedef struct {
    int n;
    const double *motor, *link; /* positions */
    const double *load;         /* measured torque through the spring */
    const double *compliance;   /* of the spring, 0 where there is none */
    const double *tolerance;    /* largest contradiction */
    uint8_t *mismatched;        /* 1 where they contradict each other */
} plausible_pairs;

/* Returns how many pairs contradict each other. */
int plausible_agree(const plausible_pairs *p);

#endif
