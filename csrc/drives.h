/* Drives that were told to hold a state of CiA 402: does every one of them still say that it does?
 *
 * All arrays belong to the caller; nothing here allocates. */
#ifndef HAPTICD_DRIVES_H
#define HAPTICD_DRIVES_H

#include <stdint.h>
#include "shape.h"

/* A group of drives. */
typedef struct {
    int32_t n;
    const uint32_t *statusword SHAPE(n); /* 6041h */
    const uint32_t *mode SHAPE(n);       /* of operation, 6061h */
    const uint32_t *own_mode SHAPE(n);   /* that it should be in */
} drives_group;

/* 1 where the masked statusword of every drive is the wanted one, and its mode its own unless any will do. */
int32_t drives_there(const drives_group *groups, int32_t count, uint32_t mask, uint32_t wanted,
                     int32_t in_any_mode);

#endif
