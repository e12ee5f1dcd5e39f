/* A single-producer single-consumer ring of byte records in shared memory.
 *
 * The producer never waits: a record that does not fit is counted and dropped. Each record is stored as
 * a 4-byte length and its bytes, padded to 8. A record never wraps: where it would, the rest of the
 * buffer is skipped. */
#ifndef HAPTICD_RING_H
#define HAPTICD_RING_H

#include <stdint.h>

typedef struct ring ring;

/* Bytes of shared memory for a ring of `capacity` bytes of records; capacity is a multiple of 8. */
int64_t ring_size(int64_t capacity);

/* Starts a ring in zeroed shared memory; every process then uses the same address of its own mapping. */
void ring_init(ring *r, int64_t capacity);

/* Whether shared memory of `size` bytes holds a ring. */
int ring_valid(const ring *r, int64_t size);

/* 1 where the record was stored, 0 where it was dropped. */
int ring_push(ring *r, const void *record, int64_t length);

/* Copies the oldest record to `out` and returns its length; 0 where the ring is empty, -1 where the
 * record is longer than `room` (it stays) or the memory is damaged. */
int64_t ring_pop(ring *r, void *out, int64_t room);

int64_t ring_dropped(const ring *r);

/* Bytes ever read, and bytes that wait to be read: who reads moves the first while the second is not 0. */
int64_t ring_read(const ring *r);
int64_t ring_unread(const ring *r);

#endif
