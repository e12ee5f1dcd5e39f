/* Simulated devices on their bus: frames in and out. */
#include <string.h>

#include "codec.h"
#include "peer_internal.h"

enum {
    ID_NMT = 0x000,
    ID_SYNC = 0x080,
    ID_EMCY = 0x080,
    ID_OUTPUT = 0x100,
    ID_LAST_OUTPUT = 0x13F,
    ID_SDO_REQUEST = 0x600,
    ID_LAST_SDO_REQUEST = 0x67F,
    HEADER = 4,
    VALID = 1
};

static void take_output(peers *p, int32_t number, const wire_frame *frame) {
    memcpy(p->payload + number * WIRE_DATA, frame->data, frame->len);
    p->length[number] = frame->len;
}

/* Output frames count where they carry the counter of this SYNC. */
static void take_sync(peers *p, const wire_frame *frame) {
    if (frame->len < HEADER) return;
    take_output(p, 0, frame);
    for (int32_t k = 1; k < PEER_FRAMES; k++) {
        if (p->length[k] < 2 || memcmp(p->payload + k * WIRE_DATA, frame->data, 2) != 0) p->length[k] = 0;
    }
    const uint16_t counter = codec_u16(frame->data);
    for (int32_t i = 0; i < p->count; i++) peer_sync(p, i, counter, frame->data[2] & VALID);
    memset(p->length, 0, sizeof(p->length));
}

int32_t peers_take(peers *p, const wire_frames *frames, int32_t first) {
    for (int32_t k = first; k < frames->count; k++) {
        const wire_frame *const frame = &frames->frame[k];
        const uint32_t id = frame->id;
        if (id == ID_SYNC) {
            take_sync(p, frame);
        } else if (id > ID_OUTPUT && id <= ID_LAST_OUTPUT) {
            take_output(p, (int32_t)(id - ID_OUTPUT), frame);
        } else if (id == ID_NMT || (id > ID_SDO_REQUEST && id <= ID_LAST_SDO_REQUEST)) {
            return k;
        }
    }
    return -1;
}

int32_t peers_give(peers *p, wire_frames *out) {
    wire_frames *const box = p->outbox;
    for (; p->given < box->count && out->count < out->capacity; p->given++) {
        const int32_t sender = p->sender[p->given];
        if (p->peers[sender].tampered) return sender;
        out->frame[out->count++] = box->frame[p->given];
    }
    const size_t left = (size_t)(box->count - p->given);
    memmove(box->frame, box->frame + p->given, left * sizeof(wire_frame));
    memmove(p->sender, p->sender + p->given, left);
    box->count = (int32_t)left;
    p->given = 0;
    return -1;
}

void peers_emit(peers *p, int32_t i, uint32_t id, const uint8_t *data, int32_t len) {
    wire_frames *const box = p->outbox;
    if (p->peers[i].silent) return;
    if (box->count == box->capacity) {
        box->count--;
        memmove(box->frame, box->frame + 1, (size_t)box->count * sizeof(wire_frame));
        memmove(p->sender, p->sender + 1, (size_t)box->count);
    }
    p->sender[box->count] = (uint8_t)i;
    wire_append(box, id, data, len);
}

void peers_emergency(peers *p, int32_t i, uint16_t code, uint8_t error_register) {
    peer *const d = &p->peers[i];
    const uint8_t data[8] = {(uint8_t)(code & 0xFF), (uint8_t)(code >> 8), error_register};
    d->error_register = error_register;
    peers_emit(p, i, ID_EMCY + (uint32_t)d->node, data, sizeof(data));
}
