/* One simulated device: AL state, output watchdog, heartbeat, and its PDOs. */
#include "peer.h"

#include <string.h>

#include "codec.h"
#include "peer_internal.h"

enum { ID_TPDO = 0x180, ID_HEARTBEAT = 0x700, NMT_OPERATIONAL = 5 };

static void latched(peers *p, int32_t i) {
    switch ((peer_kind)p->peers[i].kind) {
    case PEER_DRIVE:
        drive_latched(p, i);
        break;
    case PEER_SAFETY:
        safety_latched(p, i);
        break;
    case PEER_PLAIN:
        break;
    }
}

void peers_invalid(peers *p, int32_t i) {
    switch ((peer_kind)p->peers[i].kind) {
    case PEER_DRIVE:
        drive_invalid(&p->peers[i]);
        break;
    case PEER_SAFETY:
        safety_invalid(p, i);
        break;
    case PEER_PLAIN:
        break;
    }
}

static void tripped(peers *p, int32_t i) {
    switch ((peer_kind)p->peers[i].kind) {
    case PEER_DRIVE: /* a fault, to be reset by the master */
        drive_tripped(p, i);
        return;
    case PEER_SAFETY:
        safety_tripped(p, i);
        break;
    case PEER_PLAIN:
        break;
    }
    peers_emergency(p, i, EMCY_RPDO_TIMEOUT, ERROR_GENERIC | ERROR_COMMUNICATION);
}

static void report(const peers *p, int32_t i) {
    switch ((peer_kind)p->peers[i].kind) {
    case PEER_DRIVE:
        drive_report(p, i);
        break;
    case PEER_SAFETY:
        safety_report(p, i);
        break;
    case PEER_PLAIN:
        break;
    }
}

void peers_report(const peers *p, int32_t i, uint8_t *payload) {
    const peer *const d = &p->peers[i];
    report(p, i);
    memset(payload, 0, (size_t)d->tpdo_length);
    const int32_t counter = d->counter < 0 ? 0 : d->counter;
    payload[0] = (uint8_t)(counter & 0xFF);
    payload[1] = (uint8_t)(counter >> 8);
    payload[2] = d->al_state;
    for (int32_t k = d->input; k < d->input + d->inputs; k++) {
        const peer_entry *const entry = &p->input[k];
        uint8_t *const at = payload + entry->offset;
        if (entry->word) {
            codec_put_word(at, entry->type, p->words[entry->target]);
        } else {
            codec_put_number(at, entry->type, (p->values[entry->target] - entry->shift) * entry->gain);
        }
    }
}

/* Without new outputs the watchdog goes on. */
static void latch(peers *p, int32_t i, uint16_t counter) {
    peer *const d = &p->peers[i];
    if (!d->outputs) {
        d->al_state = AL_OP;
        return;
    }
    const int known = d->slot_frame >= 0 && d->slot_frame < PEER_FRAMES && d->slot_offset >= 0;
    if (counter == d->counter || !known || p->length[d->slot_frame] < d->slot_offset + d->slot_size) return;
    const uint8_t *const slot = p->payload + d->slot_frame * WIRE_DATA + d->slot_offset;
    d->al_state = AL_OP;
    d->output_age = 0;
    for (int32_t k = d->output; k < d->output + d->outputs; k++) {
        const peer_entry *const entry = &p->output[k];
        const uint8_t *const at = slot + entry->offset;
        if (entry->word) {
            p->output_words[entry->target] = codec_word(at, entry->type);
        } else {
            p->output_values[entry->target] = codec_number(at, entry->type) * entry->gain + entry->shift;
        }
    }
    latched(p, i);
}

void peer_sync(peers *p, int32_t i, uint16_t counter, int valid) {
    peer *const d = &p->peers[i];
    if (d->nmt_state != NMT_OPERATIONAL) return;
    if (!valid) {
        if (d->tripped) { /* the master knows: it asked for SAFEOP */
            d->tripped = 0;
            if (d->kind != PEER_DRIVE) peers_emergency(p, i, 0, 0); /* a drive's fault is to be reset */
        }
        if (d->al_state == AL_OP) {
            d->al_state = AL_SAFEOP;
            peers_invalid(p, i);
        }
    } else if (!d->tripped) {
        latch(p, i, counter);
    }
    d->counter = counter;
    uint8_t payload[WIRE_DATA];
    peers_report(p, i, payload);
    peers_emit(p, i, ID_TPDO + (uint32_t)d->node, payload, d->tpdo_length);
}

static void advance(peers *p, int32_t i, int64_t dt) {
    peer *const d = &p->peers[i];
    if (d->heartbeat_time) {
        d->heartbeat_age += dt;
        if (d->heartbeat_age >= d->heartbeat_time) {
            d->heartbeat_age %= d->heartbeat_time;
            peers_emit(p, i, ID_HEARTBEAT + (uint32_t)d->node, &d->nmt_state, 1);
        }
    }
    if (d->outputs && d->al_state == AL_OP) {
        d->output_age += dt;
        if (d->output_age >= d->watchdog_time) {
            d->tripped = 1;
            d->al_state = AL_SAFEOP;
            tripped(p, i);
        }
    }
}

void peers_advance(peers *p, int64_t dt) {
    for (int32_t i = 0; i < p->count; i++) {
        advance(p, i, dt);
        if (p->peers[i].kind == PEER_DRIVE) drive_advance(p, i, dt);
        if (p->peers[i].kind == PEER_SAFETY) safety_advance(p, i);
    }
}
