/*
 * What the link between two stations does with packets.
 *
 * Inbox: a call takes a capped number of datagrams out of a UDP socket, and keeps a smaller one: those that
 * have the right length, version, direction and session, and a counter that has not come yet. So a flood
 * costs a known time. Those are opened, and of the authentic ones the newest is judged.
 * Outbox: a packet's header and stamps, its seal, and the way to the socket.
 * docs/link.md has the layout of a datagram.
 */
#ifndef HAPTICD_LINK_H
#define HAPTICD_LINK_H

#include <stdint.h>

#include "link_age.h"
#include "link_seal.h"

enum {
    LINK_HEADER = 20, /* bytes in the clear: magic u16, version u8, direction u8, session u64, counter u64 */
    LINK_STAMPS = 20, /* sealed before the payload: sent u64, echo u64, held u32 [ns] */
    LINK_TAG = 16,    /* behind it */
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
    /* what it must be younger than to move something [ns]: by its likely age, and since its sender heard us
     */
    int64_t oldest;
    int64_t deaf;
    /* keys of the epoch, of the one before (NULL: forgotten), and of the next one */
    uint64_t epoch;
    const link_sealing *now;
    const link_sealing *before;
    const link_sealing *next;
    link_window window;
    /* stamps of the newest one that is authentic, and when we had it [ns]; 0: none has come */
    uint64_t sent;
    uint64_t echo;
    uint32_t held;
    int64_t heard;
    link_ages ages;
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
    int64_t forged;    /* not sealed with the key of its epoch */
    /* how many were authentic, and of those, how many moved nothing because ... */
    int64_t received;
    int64_t reordered; /* a newer one had come */
    int64_t unproven;  /* it echoes no stamp of ours: its age is unknown */
    int64_t deafened;  /* its sender has not heard of us for too long */
    int64_t stale;     /* its likely age is above `oldest`, or its age may be above twice that */
    int64_t failures;  /* errors of the socket, among them the network's word that nobody listens there */
    int32_t error;     /* errno of the last one */
    /* what is to be opened, in the order of arrival unless some were shed */
    int32_t count;
    uint8_t payload[1176]; /* of the newest one that is authentic; near to what else is touched */
    uint64_t counter[64];
    uint8_t datagram[64][1232];
} link_inbox;

/* Replaces what is to be opened by what waits in `fd`, without blocking. Returns how many. */
int32_t link_receive(int32_t fd, link_inbox *inbox);

/* Whether a counter has come: LINK_SEEN (it has, or it is behind the window), LINK_LATE, LINK_NEWEST. */
int32_t link_look(const link_window *window, uint64_t counter);

/* As link_look, and notes that it has. For counters of authentic datagrams only. */
int32_t link_mark(link_window *window, uint64_t counter);

/* Opens what is kept, came by `now` [ns]: notes the counters of the authentic ones, and stamps and payload of
 * the newest. An authentic one of the next epoch is for the caller to see (the window's newest): all keys are
 * to be moved on then. Returns the likely age of the newest [ns]; -1 where none came that is newer than all
 * before, or, counted, where it is to move nothing. Its greatest possible age is at most twice `oldest`, so
 * that no network, be it an attacker's, has anything moved by a packet that is older. */
int64_t link_open(link_inbox *inbox, int64_t now);

typedef struct {
    uint64_t session;
    int32_t size; /* bytes of a payload, 1 to LINK_LARGEST - LINK_HEADER - LINK_STAMPS - LINK_TAG */
    int32_t direction;
    uint64_t epoch;          /* of the counters that are sealed */
    const link_sealing *now; /* its key */
    int64_t sent;            /* datagrams */
    int64_t unsent;          /* the kernel did not take them */
    int64_t unreachable;     /* times the network said that nobody listens there */
} link_outbox;

/* Seals a payload and sends it `now` [ns]; the stamps tell what the inbox has heard. No counter may come
 * twice with a key. What the kernel does not take is counted and gone. */
void link_send(int32_t fd, link_outbox *outbox, const link_inbox *inbox, uint64_t counter, int64_t now,
               const uint8_t *payload);

#endif
