/*
 * The inbox of the link between two stations: sealed datagrams out of a UDP socket, before anything is
 * opened.
 *
 * A call takes a capped number of datagrams, and keeps a smaller one: those that have the right length,
 * version, direction and session, and a counter that has not come yet. So a flood costs a known time.
 * docs/link.md has the layout of a datagram.
 */
#ifndef HAPTICD_LINK_H
#define HAPTICD_LINK_H

#include <stdint.h>

enum {
    LINK_HEADER = 20, /* bytes in the clear: magic u16, version u8, direction u8, session u64, counter u64 */
    LINK_LARGEST = 1232, /* bytes of the largest datagram: IPv6's least MTU less its header and UDP's */
    LINK_TAKE = 256,     /* datagrams that a call takes from the socket at most, ... */
    LINK_KEEP = 64,      /* ... and that it keeps to be opened */
    LINK_MAGIC = 0x4C48, /* "HL" */
    LINK_VERSION = 1,
    LINK_EPOCH_BITS = 20, /* a key seals so many counters: epoch = counter >> LINK_EPOCH_BITS */
    LINK_WINDOW = 64      /* counters behind the newest one that are still told apart */
};

enum { LINK_SEEN = 0, LINK_LATE = 1, LINK_NEWEST = 2 };

/* Which of the counters up to the newest have come. Starts as {0, ~0, 0}: counters count from 1. */
typedef struct {
    uint64_t newest;
    uint64_t seen; /* bit i: newest - i has come */
    int64_t lost;  /* counters that left the window and had not come */
} link_window;

typedef struct {
    /* what a datagram must have */
    uint64_t session;
    int32_t size; /* bytes, LINK_HEADER to LINK_LARGEST */
    int32_t direction;
    link_window window;
    /* how many datagrams came, and of those, how many were dropped because ... */
    int64_t taken;
    int64_t truncated; /* shorter than `size` */
    int64_t oversize;  /* longer */
    int64_t foreign;   /* another magic, version or session */
    int64_t reflected; /* the other direction: our own, sent back */
    int64_t duplicate; /* the counter has come, and is in the window */
    int64_t replayed;  /* the counter is behind the window */
    int64_t ahead;     /* the counter is beyond the next key's */
    int64_t shed;      /* LINK_KEEP newer ones are to be opened already */
    int64_t failures;  /* errors of the socket, among them the network's word that nobody listens there */
    int32_t error;     /* errno of the last one */
    /* what is to be opened, in the order of arrival unless some were shed */
    int32_t count;
    uint64_t counter[64];
    uint8_t datagram[64][1232];
} link_inbox;

/* Replaces what is to be opened by what waits in `fd`, without blocking. Returns how many. */
int32_t link_receive(int32_t fd, link_inbox *inbox);

/* Whether a counter has come: LINK_SEEN (it has, or it is behind the window), LINK_LATE, LINK_NEWEST. */
int32_t link_look(const link_window *window, uint64_t counter);

/* As link_look, and notes that it has. For counters of authentic datagrams only. */
int32_t link_mark(link_window *window, uint64_t counter);

#endif
