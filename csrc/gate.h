/*
 * The gate's rule: what of a command is admitted, and why not all of it.
 *
 * All arrays belong to the caller; nothing here allocates.
 */
#ifndef HAPTICD_GATE_H
#define HAPTICD_GATE_H

#include <stdint.h>
#include "shape.h"

/* What is wrong with a command; where it is several things, the last of them. */
enum {
    GATE_FINE = 0,
    GATE_NO_NUMBER,    /* NaN or infinite */
    GATE_EXCEEDS,      /* more than its axis may be told now */
    GATE_JUMPS,        /* more than a step from the last one */
    GATE_BEYOND_UPPER, /* pushes further out at a position beyond the upper limit, or at none that is known */
    GATE_BEYOND_LOWER,
    GATE_POWER /* gives more power than it may */
};

/* Axes in units of their commands: N m for torques, m/s for velocities. */
typedef struct {
    int n;
    const double *most SHAPE(n);  /* largest magnitude now */
    const double *step SHAPE(n);  /* largest change from one tick to the next; may be infinite */
    const double *power SHAPE(n); /* largest command times velocity along it, not negative; may be infinite */
    const double *lower SHAPE(n); /* positions at which commands further out are neutralised */
    const double *upper SHAPE(n);
    const double *command SHAPE(n);  /* what is asked for */
    const double *position SHAPE(n); /* measured */
    const double *velocity SHAPE(n);
    const uint8_t *dropped SHAPE(n); /* 1: gets no command any more, whatever is asked for */
    double *admitted SHAPE(n);       /* what is written; at entry, what was written last */
    uint8_t *wrong SHAPE(n);         /* with each command; a dropped axis has nothing wrong */
} gate_axes;

/* Admits a tick's commands, whatever numbers they are. Instead of what is no number the last one stands.
 * Returns for how many axes something else is admitted than what was asked for. */
int gate_admit(const gate_axes *g);

/* Where the commands of some of the axes are encoded from. */
typedef struct {
    int n;
    double *commands SHAPE(n);
} gate_output;

/* Writes what was admitted to the outputs, one after the other. */
void gate_write(const gate_axes *g, const gate_output *outputs, int count);

#endif
