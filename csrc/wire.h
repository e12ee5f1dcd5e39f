/*
 * The wire: CAN FD frames moved in batches, one system call each way.
 *
 * A frame has the layout of Linux's struct canfd_frame. A SocketCAN socket carries one frame a packet;
 * a Unix SEQPACKET socket carries a whole batch in one, so that a batch arrives whole or not at all.
 * Received classic frames (16 bytes, struct can_frame) are taken too: their layout is a prefix of the other.
 */
#ifndef HAPTICD_WIRE_H
#define HAPTICD_WIRE_H

#include <stdint.h>
#include "shape.h"

enum {
    WIRE_DATA = 64,       /* payload of the longest frame, bytes */
    WIRE_TIME = 0x100,    /* identifier of the TIME object of CiA 301 */
    WIRE_FLAG_BRS = 0x01, /* canfd_frame.flags: payload at the fast bit rate */
    WIRE_CLOSED = -1,     /* results below zero: the peer is gone, ... */
    WIRE_TRUNCATED = -2,  /* ... packed bytes end inside a frame, ... */
    WIRE_BAD_LENGTH = -3, /* ... a frame claims more than 64 bytes, ... */
    WIRE_FULL = -4        /* ... there is no room for another frame */
};

typedef struct {
    uint32_t id;   /* 11-bit identifier; Linux's EFF, RTR and ERR flags in the top three bits */
    uint8_t len;   /* bytes of data in use, 0 to 64 */
    uint8_t flags; /* BRS 0x01, ESI 0x02, FDF 0x04 */
    uint8_t reserved[2];
    uint8_t data[64];
} wire_frame;

typedef struct {
    int32_t capacity;
    int32_t count; /* frames in use */
    wire_frame *frame SHAPE(capacity);
} wire_frames;

typedef struct {
    int64_t malformed; /* datagrams dropped because their size is no frame's */
    int64_t unsent;    /* frames dropped because the kernel's queue was full */
    int32_t error;     /* errno of the last failure other than "try again", 0 = none */
    int32_t closed;    /* 1 once the peer is gone */
    int32_t batched;   /* 1 where one packet carries a batch */
    int64_t time_ns;   /* when the last TIME object of a call arrived, CLOCK_MONOTONIC; 0 = none, see below */
} wire_link;

/* Replaces the contents of `frames` by what waits in `fd`, without blocking. Arrival times need the option
   SO_TIMESTAMPNS on the socket: the kernel takes them, so they do not depend on when this is called.
   Returns the number of frames, or WIRE_CLOSED when the peer is gone and nothing is left. */
int32_t wire_receive(int32_t fd, wire_frames *frames, wire_link *link);

/* Sends all frames without blocking. Returns the number sent; the rest is counted in link->unsent. */
int32_t wire_send(int32_t fd, const wire_frames *frames, wire_link *link);

/* Appends one frame with the BRS flag set. Returns 0, WIRE_FULL or WIRE_BAD_LENGTH. */
int32_t wire_append(wire_frames *frames, uint32_t id, const uint8_t *data, int32_t len);

/* Appends the frames of `from` from number `first` on. Returns 0 or WIRE_FULL. */
int32_t wire_extend(wire_frames *to, const wire_frames *from, int32_t first);

/* Replaces the contents of `to` by those of `from`, which is empty then. Returns their number, or WIRE_FULL,
   and then nothing has changed. */
int32_t wire_take(wire_frames *to, wire_frames *from);

/* How many frames have an identifier in [first, last]. */
int32_t wire_count(const wire_frames *frames, uint32_t first, uint32_t last);

/* The compact form for the log: id (4 bytes, little endian), len, flags, data[len] per frame.
   `out` has room for 70 bytes per frame. Returns the bytes written. */
int32_t wire_pack(const wire_frames *frames, uint8_t *out);

/* Replaces the contents of `frames` by `size` packed bytes.
   Returns their number, WIRE_TRUNCATED, WIRE_BAD_LENGTH or WIRE_FULL (`frames` is then empty). */
int32_t wire_unpack(wire_frames *frames, const uint8_t *packed, int32_t size);

#endif
