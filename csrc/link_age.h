/*
 * How old a packet of the link is, by what both stations have heard of each other, without a clock that
 * they share.
 *
 * A packet bears the sender's clock when it was sent, the newest of our own stamps that the sender has
 * heard, and how long ago that was. It was sent after our stamp was heard, and arrived before now: so the
 * other clock is ahead of ours by at least `sent - now` and at most `sent - held - echo`. The closest bounds
 * of all packets are kept, and loosened by what clocks drift.
 *
 * Both clocks may show anything: differences are taken modulo 2^64, and whatever a station stamps, an age is
 * neither negative nor above the round trip.
 */
#ifndef HAPTICD_LINK_AGE_H
#define HAPTICD_LINK_AGE_H

#include <stdint.h>

enum { LINK_DRIFT = 1000 /* two clocks run apart by no more than one part of it; NTP slews each by half */ };

/* Starts as {0}. */
typedef struct {
    /* how far the other clock is ahead of ours, at least and at most, as of a time of ours [ns] */
    int64_t least, most, at;
    int32_t begun;
    int64_t jumps; /* how often the bounds contradicted each other: a clock has jumped */
} link_ages;

/* What is known of a packet's age [ns]. */
typedef struct {
    int64_t likely;  /* if the way there and back, at their fastest, take the same time */
    int64_t most;    /* it is not older, whatever the network does */
    int64_t unheard; /* since the sender last heard of us */
} link_age;

/* Judges a packet that arrives `now`, by its stamps [ns]. Returns 0, and no age, where the echo is not one of
 * our stamps. */
int32_t link_judge(link_ages *ages, int64_t now, uint64_t sent, uint64_t echo, uint32_t held, link_age *age);

#endif
