/*
 * Motors in torque mode and the torque sensors behind their gears: what a motor gives and its rotor does not
 * take, its sensor must show. Nothing here knows how far a spring yields.
 *
 * All arrays belong to the caller; nothing here allocates. Times count in ticks.
 */
#ifndef HAPTICD_BALANCE_H
#define HAPTICD_BALANCE_H

#include <stdint.h>
#include "shape.h"

/* Ticks at the least, besides the window, for which a command must have been known: see torque_balance. */
enum { BALANCE_LATE = 2 };

typedef struct {
    int n;
    int window;   /* ticks over which torques are averaged */
    int depth;    /* window + BALANCE_LATE */
    double dt;    /* of a tick [s] */
    double doubt; /* share by which a rotor's inertia may be another */
    double rub;   /* share of the load that a gear may take by friction */
    const double *command SHAPE(n), *load SHAPE(n),
        *rate SHAPE(n);               /* told torque, torque and motor's speed */
    const int32_t *age SHAPE(n);      /* ticks since the drive was heard */
    const double *rotor SHAPE(n);     /* inertia */
    const double *tolerance SHAPE(n); /* contradiction that is none */
    double *commands SHAPE(depth, n), *loads SHAPE(depth, n), *rates SHAPE(depth, n);
    int *head SHAPE(1);           /* oldest row of them */
    int32_t *since SHAPE(n);      /* ticks in a row that can be compared, at most the depth */
    uint8_t *agree SHAPE(n);      /* 1 where both agree to half of what is no contradiction */
    uint8_t *unbalanced SHAPE(n); /* 1 where they contradict each other */
} torque_balance;

/* Takes a tick, so many ticks after the last; returns how many motors and sensors contradict each other.
 *
 * The measurement of a tick answers to the command of the tick before the last, or one earlier or later. What
 * a drive is told is compared only where it may move its axis and is told anything: else its brake may be
 * closed. */
int balance_torques(const torque_balance *b, int elapsed, int free_to_move);

#endif
