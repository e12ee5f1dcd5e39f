/*
 * A session of the link, one call each way: clock, lease and counter, then what csrc/link.h does.
 *
 * What only the caller can do, it is asked for before anything is sent or received; then it calls again.
 */
#ifndef HAPTICD_LINK_CHANNEL_H
#define HAPTICD_LINK_CHANNEL_H

#include <stdint.h>

#include "link.h"

enum { LINK_COUNTER_BITS = 48 }; /* at 2^48 a session ends; at 1 kHz after 8900 years */

/* What a call says beside an age, or 0 for done. */
enum {
    LINK_NONE = -1,  /* nothing has come that is to move something */
    LINK_OVER = -2,  /* the session is over: nothing is sent or received any more */
    LINK_SEALS = -3, /* asks for the key of the next counter's epoch, and that as outbox.epoch */
    LINK_OPENS = -4, /* asks for the keys of the newest counter's epoch, and that as inbox.epoch */
    LINK_WATCH = -5  /* instead of `age`: a second has passed since `since`, asks for a new one */
};

typedef struct {
    int32_t fd;       /* a connected datagram socket */
    int32_t over;     /* whether the session is over; never unset */
    int32_t inside;   /* calls under way */
    uint64_t counter; /* of the last datagram that was sealed */
    int64_t lease;    /* the session is over so long after `good` [ns] */
    int64_t good;     /* when the last one came that may move something, or the session began [ns] */
    int64_t since;    /* when the second began that LINK_WATCH ends [ns] */
    int64_t now;      /* when what the last call received had come [ns] */
    int64_t age;      /* what it said of that: see link_open */
    int64_t given;    /* what a call takes for the time [ns]; 0: what link_clock says */
    link_outbox outbox;
    link_inbox inbox;
} link_channel;

/* Since the host booted, sleep included [ns]; no change of the time of day moves it. */
int64_t link_clock(void);

/* Seals and sends a payload, outbox.size bytes, see link_send. Returns 0, or LINK_OVER or LINK_SEALS. */
int32_t link_channel_send(link_channel *channel, const uint8_t *payload);

/* Receives and opens what has come, see link_receive and link_open. Returns the likely age of the newest
 * [ns], or LINK_NONE, LINK_OVER, LINK_OPENS or LINK_WATCH. */
int64_t link_channel_receive(link_channel *channel);

/* Ends the session from any thread, and waits for calls under way: then nobody uses socket and keys. */
void link_channel_close(link_channel *channel);

#endif
