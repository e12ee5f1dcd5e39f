/*
 * Simulated gateways: what their master tells them goes to their peers at the other station, all of it in one
 * packet, and what these say is what they report.
 *
 * All memory belongs to the caller; nothing here allocates.
 */
#ifndef HAPTICD_GATEWAY_H
#define HAPTICD_GATEWAY_H

#include <stdint.h>
#include "peer.h"
#include "shape.h"

/* Entries have neither gain nor shift; their offsets are in the packet. */
typedef struct {
    int32_t count;
    int32_t said;
    const int32_t *device SHAPE(count); /* which of the peers each is */
    const int32_t *age SHAPE(count);    /* where in peers.values the age of what it reports is */
    const int32_t *hears SHAPE(count);  /* how many of `hear` are its own; those of the first come first */
    const peer_entry *say SHAPE(said);  /* what they were told */
    const peer_entry *hear SHAPE(any);  /* what they report */
} gateways;

/* Writes the packet that goes out. Returns 0, and writes nothing, where one of them is not in OP: what it was
   told is not valid. */
int32_t gateways_say(const gateways *g, const peers *p, uint8_t *packet);

/* They report what came in; one of them nothing of it where a number of its own is not finite. Returns 0
   where there was such a number. */
int32_t gateways_hear(const gateways *g, peers *p, const uint8_t *packet);

/* How old what they report is [s]. */
void gateways_age(const gateways *g, peers *p, double age);

#endif
