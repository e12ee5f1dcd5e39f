#include "image.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Identifiers of CiA 301's predefined connection set; the low seven bits are the node. */
enum {
    ID_NMT = 0x000,
    ID_SYNC_EMCY = 0x080,
    ID_OUTPUT = 0x100, /* 0x101 ... 0x13f: output frames that do not fit into SYNC */
    ID_LAST_OUTPUT = 0x13F,
    ID_TPDO = 0x180,
    ID_SDO_RESPONSE = 0x580,
    ID_SDO_REQUEST = 0x600,
    ID_HEARTBEAT = 0x700,
    ID_FUNCTION = 0x780,
    ID_NODE = 0x07F,
    ID_STANDARD = 0x7FF,
    ERROR_BUS_OFF = 0x40,
    ERROR_CLASS = 0xFF00,
    SDO_LENGTH = 8,
    EMCY_LENGTH = 8,
    NMT_BOOT_UP = 0,
    NMT_STOPPED = 4,
    NMT_OPERATIONAL = 5,
    NMT_PRE_OPERATIONAL = 127,
    NEVER_HEARD = 255
};
static const uint32_t FLAG_ERROR_FRAME = 0x20000000u;

enum { STRUCK = 1, STRUCK_AND_RESET = 2 };

/* raw = round((SI - shift) / scale), cut to the type. Returns 1 if it was cut. */
static int write_quantity(uint8_t *at, const image_entry *entry, double si) {
    const double raw = (si - entry->shift) / entry->scale;
    return codec_put_number(at, entry->type, fmin(fmax(raw, -DBL_MAX), DBL_MAX));
}

static void decode(image *im, const image_device *device, const uint8_t *tpdo) {
    for (int i = device->first; i < device->first + device->entries; i++) {
        const image_entry *const entry = &im->input[i];
        const uint8_t *const at = tpdo + entry->offset;
        if (entry->word) {
            im->words[entry->target] = codec_word(at, entry->type);
        } else {
            im->values[entry->target] = codec_number(at, entry->type) * entry->scale + entry->shift;
        }
    }
}

static void take_tpdo(image *im, int index, const wire_frame *frame, uint16_t counter) {
    const image_device *const device = &im->device[index];
    image_status *const status = &im->status[index];
    if (frame->len != device->length) {
        im->counters->length++;
        return;
    }
    const int16_t lead = (int16_t)(uint16_t)(codec_u16(frame->data) - counter);
    if (lead != 0) {
        int64_t *const count = lead < 0 ? &im->counters->stale : &im->counters->ahead;
        (*count)++;
        return;
    }
    uint8_t *const raw = im->raw_in + device->raw;
    if (status->fresh) {
        const int same = memcmp(raw, frame->data, frame->len) == 0;
        int64_t *const count = same ? &im->counters->duplicate : &im->counters->conflict;
        (*count)++;
        return;
    }
    memcpy(raw, frame->data, frame->len);
    decode(im, device, raw);
    status->al_state = raw[2];
    status->fresh = 1;
    status->running = 1;
    im->working_counter++;
}

static void take_emergency(image *im, int index, const wire_frame *frame) {
    if (frame->len != EMCY_LENGTH) {
        im->counters->bad_emcy++;
        return;
    }
    const uint16_t code = codec_u16(frame->data);
    image_status *const status = &im->status[index];
    if (code & ERROR_CLASS) {
        status->emcy = code;
        status->struck = STRUCK;
    } else if (status->struck) { /* 00xxh: error reset; whoever looks once a tick must see what it was */
        status->struck = STRUCK_AND_RESET;
    } else {
        status->emcy = 0;
    }
    if (im->emergencies < IMAGE_EMERGENCIES) {
        image_emergency *const event = &im->emergency[im->emergencies++];
        event->device = index;
        event->code = code;
        event->error_register = frame->data[2];
        memcpy(event->vendor, frame->data + 3, sizeof(event->vendor));
    }
}

static void take_heartbeat(image *im, int index, const wire_frame *frame) {
    image_status *const status = &im->status[index];
    const uint8_t state = frame->data[0];
    const int known = state == NMT_BOOT_UP || state == NMT_STOPPED || state == NMT_OPERATIONAL ||
                      state == NMT_PRE_OPERATIONAL;
    if (frame->len != 1 || !known) {
        im->counters->bad_heartbeat++;
        return;
    }
    status->nmt_state = state;
    status->heartbeat_age = 0;
    if (status->running && state != NMT_OPERATIONAL) status->lost = 1;
}

/* Sorts one frame by identifier; whatever is not ours to take is counted. */
static void take(image *im, const wire_frame *frame, uint16_t counter) {
    image_counters *const count = im->counters;
    const uint32_t id = frame->id;
    count->frames++;
    if (id & FLAG_ERROR_FRAME) {
        count->error_frames++;
        if (id & ERROR_BUS_OFF) count->bus_off++;
        return;
    }
    if (id == ID_NMT || id == ID_SYNC_EMCY || (id > ID_OUTPUT && id <= ID_LAST_OUTPUT)) {
        count->foreign++;
        return;
    }
    if (id == WIRE_TIME) return; /* the clock of the bus: its arrival is what counts */
    const uint8_t index = im->device_of_node[id & ID_NODE];
    if (id > ID_STANDARD || index == IMAGE_NO_DEVICE) {
        count->unknown++;
        return;
    }
    switch (id & ID_FUNCTION) {
    case ID_SYNC_EMCY:
        take_emergency(im, index, frame);
        break;
    case ID_TPDO:
        take_tpdo(im, index, frame, counter);
        break;
    case ID_SDO_RESPONSE:
        count->bad_sdo += frame->len != SDO_LENGTH;
        break;
    case ID_SDO_REQUEST:
        count->foreign++;
        break;
    case ID_HEARTBEAT:
        take_heartbeat(im, index, frame);
        break;
    default:
        count->unknown++;
        break;
    }
}

enum { AL_OP = 8 };

void image_reset(image *im) {
    memset(im->status, 0, sizeof(image_status) * (size_t)im->devices);
    for (int i = 0; i < im->devices; i++) im->status[i].nmt_state = NEVER_HEARD;
    im->working_counter = 0;
    im->emergencies = 0;
}

static int64_t discarded(const image_counters *count) {
    return count->stale + count->ahead + count->duplicate;
}

static int64_t intruding(const image_counters *count) {
    return count->conflict + count->foreign;
}

int32_t image_latch(image *im, const wire_frames *frames, uint16_t counter) {
    const image_counters before = *im->counters;
    im->working_counter = 0;
    im->emergencies = 0;
    for (int i = 0; i < im->devices; i++) {
        image_status *const status = &im->status[i];
        if (status->struck == STRUCK_AND_RESET) status->emcy = 0;
        status->struck = 0;
        status->fresh = 0;
        status->heartbeat_age++;
    }
    for (int i = 0; i < frames->count; i++) take(im, &frames->frame[i], counter);
    for (int i = 0; i < im->devices; i++) {
        image_status *const status = &im->status[i];
        status->missed = status->fresh ? 0 : status->missed + 1;
        im->counters->misses += status->running && !status->fresh;
    }
    im->discarded = (int32_t)(discarded(im->counters) - discarded(&before));
    im->intruding = (int32_t)(intruding(im->counters) - intruding(&before));
    return im->working_counter;
}

int32_t image_calm(const image *im) {
    if (im->discarded || im->intruding) return 0;
    for (int i = 0; i < im->devices; i++) {
        const image_status *const status = &im->status[i];
        if (!status->fresh || status->lost || status->emcy || status->al_state != AL_OP) return 0;
    }
    return 1;
}

/* Encodes all outputs into the raw image; returns how many were not finite. */
static int32_t encode(image *im) {
    int32_t bad = 0;
    for (int i = 0; i < im->outputs; i++) {
        const image_entry *const entry = &im->output[i];
        uint8_t *const at = im->raw_out + entry->offset;
        if (entry->word) {
            codec_put_word(at, entry->type, im->output_words[entry->target]);
        } else if (isfinite(im->output_values[entry->target])) {
            im->counters->saturated += write_quantity(at, entry, im->output_values[entry->target]);
        } else { /* the bytes are zero already */
            im->output_bad[i] = 1;
            bad++;
        }
    }
    im->counters->not_finite += bad;
    return bad;
}

int32_t image_compose(image *im, wire_frames *frames, uint16_t counter, int32_t operational) {
    memset(im->raw_out, 0, (size_t)im->raw_outputs);
    memset(im->output_bad, 0, (size_t)im->outputs);
    const int32_t bad = operational ? encode(im) : 0;
    for (int i = 0; i < im->output_frames; i++) {
        const image_output_frame *const frame = &im->output_frame[i];
        uint8_t *const payload = im->raw_out + frame->raw;
        payload[0] = (uint8_t)(counter & 0xFF);
        payload[1] = (uint8_t)(counter >> 8);
        payload[2] = operational ? 1 : 0;
        const int32_t result = wire_append(frames, frame->id, payload, frame->length);
        if (result < 0) return result;
    }
    return bad;
}
