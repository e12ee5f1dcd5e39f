/*
 * Plausibility of what was measured, before anything integrates, differentiates or feeds it forward.
 *
 * All arrays belong to the caller; nothing here allocates. Times count in ticks.
 */
#ifndef HAPTICD_PLAUSIBILITY_H
#define HAPTICD_PLAUSIBILITY_H

#include <stdint.h>
#include "balance.h"
#include "shape.h"
#include "springs.h"

enum { PLAUSIBILITY_NEVER = 1 << 30, PLAUSIBILITY_EXTRAPOLATED = 3 };

/* A change beyond the largest is motion all the same where the measured rate confirms it to this part of the
   largest, which a spring between both allows for: it is fast, not wrong. */
#define PLAUSIBILITY_CONFIRMED 0.5

/* Values of one kind, as decoded. */
typedef struct {
    int n;
    double *value SHAPE(n);         /* what is rejected is replaced by what was accepted last, extrapolated */
    const double *rate OPTIONAL(n); /* measured rate of each, checked before [1/s] */
    const int32_t *rate_age OPTIONAL(n);       /* with it: ticks since each rate was accepted */
    const int *device SHAPE(n);                /* which device sends it */
    const uint8_t *fresh STRIDED(any, stride); /* of each device, 1 where its frame arrived in this tick */
    int stride;
    double dt;                   /* of a tick [s] */
    const double *most SHAPE(n); /* largest magnitude */
    const double *step SHAPE(n); /* largest change in a tick */
    double *accepted SHAPE(n);   /* last accepted value */
    int32_t *age SHAPE(n);       /* ticks since that; PLAUSIBILITY_NEVER before the first */
    uint8_t *rejected SHAPE(n);  /* 1 where this tick's value was not accepted */
    int32_t *still SHAPE(1);     /* how often in a row fresh values came that were all the same as before */
    int32_t *old SHAPE(1);       /* how many are not of the last tick that was taken, for whatever reason */
} plausible_values;

/* Takes a tick; `elapsed` ticks after the last. Returns how many values are old. Before anything was accepted
   the last accepted value is 0. */
int plausible_accept(const plausible_values *v, int elapsed);

/* Encoders of one kind: does one stand still although its axis must move? */
typedef struct {
    int n;
    int limit;                          /* ticks of standstill that are enough */
    double dt;                          /* [s] */
    const double *position SHAPE(n);    /* by the encoder */
    const double *velocity SHAPE(n);    /* measured, of the axis */
    const double *command SHAPE(n);     /* what the drive was told: torque or velocity */
    const double *opposing OPTIONAL(n); /* measured torque that balances the command */
    const double *acting SHAPE(n);      /* command less opposing torque beyond which the axis must move */
    const double *quantum SHAPE(n);     /* less is no motion */
    const double *reach SHAPE(n);       /* travel by the measured velocity that an encoder must see */
    const int32_t *patience SHAPE(n); /* ticks of a command in one direction after which it must have moved */
    const double *load OPTIONAL(n); /* torque in the spring between what the velocity is of and the encoder */
    const double *compliance OPTIONAL(n); /* of it: with the load, both or none */
    double *anchor SHAPE(n);              /* where it stands */
    double *loaded SHAPE(n);              /* load when it got there */
    double *travel SHAPE(n);              /* by the measured velocity since then */
    int32_t *still SHAPE(n);              /* ticks since then */
    int32_t *pushed SHAPE(n); /* ticks of them that the command acts in one direction, negative: backwards */
    uint8_t *frozen SHAPE(n); /* 1 where it stands still although the axis must move */
} plausible_motion;

/* Takes a tick; `free_to_move`: whether commands may move the axes. Returns how many encoders are frozen.
 * Ticks that were skipped do not count: nobody saw what the axes did meanwhile. */
int plausible_move(const plausible_motion *m, int free_to_move);

/* Position and velocity of axes, compared over a window of ticks. */
typedef struct {
    int n;
    int window;                                          /* ticks */
    int limit;                                           /* ticks of contradiction in a row that are enough */
    double dt;                                           /* [s] */
    const double *position SHAPE(n), *velocity SHAPE(n); /* accepted */
    const int32_t *position_age SHAPE(n), *velocity_age SHAPE(n); /* ticks since they were */
    const double *tolerance SHAPE(n);                        /* largest contradiction within the window */
    double *errors SHAPE(window, n);                         /* contradictions so far */
    double *places SHAPE(window, n);                         /* positions */
    int *head SHAPE(1);                                      /* oldest row of them */
    double *error SHAPE(n);                                  /* position less the integral of the velocity */
    double *last_position SHAPE(n), *last_velocity SHAPE(n); /* last accepted ones */
    int32_t *gap SHAPE(n);   /* ticks since them; PLAUSIBILITY_NEVER before the first */
    int32_t *apart SHAPE(n); /* ticks in a row that both contradict each other */
    uint8_t *wrong SHAPE(n); /* 1 where that is enough */
    int32_t *since SHAPE(n); /* ticks since the way began, at most the window */
    double *way SHAPE(n);    /* magnitude of the speed by the way within the window */
    double *speed SHAPE(n);  /* by the velocity or by the way within the window: the larger magnitude */
} plausible_course;

/* Takes a tick; `elapsed` ticks after the last. Returns how many axes contradict themselves. Only
   samples of neighbouring ticks are compared: whether a plant that lost its host's processor, too, moved on
   in a gap is not known here, and nor is what the velocity did meanwhile; the way begins anew after one. */
int plausible_travel(const plausible_course *c, int elapsed);

/* Pairs of encoders on both sides of a spring, or of nothing that yields. */
typedef struct {
    int n;
    const double *motor SHAPE(n), *link SHAPE(n); /* positions */
    const double *load SHAPE(n);                  /* measured torque through the spring */
    const double *compliance SHAPE(n);            /* believed of the spring, 0 where there is none */
    const double *least SHAPE(n), *most SHAPE(n); /* what it may be instead: the nearest fit counts */
    const double *tolerance SHAPE(n); /* largest contradiction; of a stiffer spring less in proportion */
    double relaxing;                  /* ticks that the deflection may lag behind the torque: springs damp */
    double *deflection SHAPE(n);      /* motor less link in the last tick */
    const double *quantum SHAPE(n);   /* change of the load torque that is less is none */
    const double *reach SHAPE(n); /* change of motor less link that does not come without the load torque's */
    double *load_stood SHAPE(n);  /* where the load torque stands */
    double *deflection_stood SHAPE(n); /* motor less link when it got there */
    double *lag_stood SHAPE(n);        /* how far that may have lagged behind besides */
    uint8_t *mismatched SHAPE(n);      /* 1 where they contradict each other */
} plausible_pairs;

/* Returns how many pairs contradict each other. */
int plausible_agree(const plausible_pairs *p);

/* All that is measured of a machine. */
typedef struct {
    int values_count, motions_count, courses_count, balances_count, springs_count, pairs_count;
    int sensors; /* the first of the values are not of axes */
    const plausible_values *const *values SHAPE(values_count);
    const plausible_motion *const *motions SHAPE(motions_count);
    const plausible_course *const *courses SHAPE(courses_count);
    const torque_balance *const *balances SHAPE(balances_count);
    const spring_bounds *const *springs SHAPE(springs_count);
    const plausible_pairs *const *pairs SHAPE(pairs_count);
} plausible_machine;

/* Takes a tick of all that is measured: values, then what is compared of them. Returns how much was found of
   axes: values that are old, encoders, axes, motors and pairs. */
int plausible_tick(const plausible_machine *m, int elapsed, int free_to_move);

#endif
