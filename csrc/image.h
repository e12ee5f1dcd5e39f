/*
 * The process image: what the frames of one tick say, in one place, at fixed offsets.
 *
 * Inputs: every device answers SYNC with its TPDO 1, which begins with the cycle counter it answers
 * (2 bytes) and its AL state (1 byte). A TPDO counts only if it echoes the counter of this tick; then
 * its bytes go to the raw image and its entries, scaled to SI, to `values` (quantities) or `words`
 * (bit fields). Everything else is dropped and counted.
 *
 * Outputs: the entries of all devices are encoded into a few frames, sent in order; the last one, on
 * 0x080, is SYNC. Each begins with the counter (2 bytes), flags (bit 0: outputs valid), a zero byte.
 *
 * All memory belongs to the caller; nothing here allocates. Tables are constant after set-up.
 */
#ifndef HAPTICD_IMAGE_H
#define HAPTICD_IMAGE_H

#include <stdint.h>
#include "codec.h"
#include "wire.h"
#include "shape.h"

enum { IMAGE_NODES = 128, IMAGE_EMERGENCIES = 16, IMAGE_HEADER = 4, IMAGE_NO_DEVICE = 255 };

/* One mapped object. A quantity is raw * scale + shift; a word is taken bit by bit. */
typedef struct {
    double scale;
    double shift;
    int32_t target; /* where it is in values, or in words */
    int32_t offset; /* where it is in the device's TPDO, or in the raw outputs */
    uint8_t type;   /* codec_type */
    uint8_t word;   /* 1 = bit field */
    uint8_t reserved[6];
} image_entry;

typedef struct {
    int32_t raw;   /* where its TPDO is in the raw inputs */
    int32_t first; /* its entries are input[first .. first + entries) */
    int32_t entries;
    uint8_t node;
    uint8_t length; /* bytes of its TPDO on the wire */
    uint8_t reserved[2];
} image_device;

typedef struct {
    uint32_t id;
    int32_t raw;    /* where its payload is in the raw outputs */
    int32_t length; /* bytes on the wire */
} image_output_frame;

/* What is known of a device besides its inputs. */
typedef struct {
    int32_t missed;        /* consecutive ticks without a fresh TPDO */
    int32_t heartbeat_age; /* ticks since the last heartbeat */
    uint16_t emcy;         /* error code of the last emergency, 0 = none or reset; an error that is reset
                              within its tick stands until the end of the tick */
    uint8_t fresh;         /* 1 if its TPDO of this tick arrived */
    uint8_t al_state;      /* INIT 1, PREOP 2, SAFEOP 4, OP 8; 0 = never heard */
    uint8_t nmt_state;     /* of the last heartbeat: 4, 5, 127; 0 = boot-up; 255 = never heard */
    uint8_t lost;          /* 1 once it rebooted or left operational after its first fresh TPDO */
    uint8_t running;       /* 1 after the first fresh TPDO */
    uint8_t struck;        /* of this tick: 0 no error, 1 an error, 2 an error and its reset */
} image_status;

/* Events since set-up. A dropped frame is counted exactly once. */
typedef struct {
    int64_t frames;        /* frames seen */
    int64_t stale;         /* TPDO with an older counter */
    int64_t ahead;         /* TPDO with a counter that was not sent yet */
    int64_t duplicate;     /* the same TPDO twice in a tick */
    int64_t conflict;      /* two different TPDOs of one device in a tick: a second sender */
    int64_t length;        /* TPDO of the wrong length */
    int64_t unknown;       /* an identifier that nobody here owns */
    int64_t foreign;       /* SYNC, NMT, output or SDO request: another master */
    int64_t bad_emcy;      /* malformed emergency */
    int64_t bad_heartbeat; /* malformed heartbeat */
    int64_t bad_sdo;       /* malformed SDO response */
    int64_t error_frames;  /* reported by the CAN controller */
    int64_t bus_off;       /* error frames that say bus-off */
    int64_t misses;        /* ticks in which a running device gave no fresh TPDO */
    int64_t not_finite;    /* outputs that were NaN or infinite and went out as zero */
    int64_t saturated;     /* outputs cut to what their type holds */
} image_counters;

typedef struct {
    int32_t device;
    uint16_t code;
    uint8_t error_register;
    uint8_t vendor[5];
} image_emergency;

typedef struct {
    int32_t devices;
    int32_t outputs;
    int32_t output_frames;
    int32_t raw_outputs; /* bytes */
    const image_device *device SHAPE(devices);
    const image_entry *input SHAPE(any);
    const image_entry *output SHAPE(outputs);
    const image_output_frame *output_frame SHAPE(output_frames); /* SYNC last */
    double *values SHAPE(any);
    uint32_t *words SHAPE(any);
    const double *output_values SHAPE(any);
    const uint32_t *output_words SHAPE(any);
    uint8_t *output_bad SHAPE(outputs); /* 1 where the last value was not finite */
    uint8_t *raw_in SHAPE(any);
    uint8_t *raw_out SHAPE(raw_outputs);
    image_status *status SHAPE(devices);
    image_counters *counters SHAPE(1);
    int32_t working_counter; /* devices whose TPDO of this tick is fresh */
    int32_t discarded;       /* frames of this tick dropped as stale, ahead or repeated */
    int32_t intruding;       /* frames of this tick that came from a second sender or master */
    int32_t emergencies;     /* of this tick, at most IMAGE_EMERGENCIES kept */
    image_emergency emergency[16];
    uint8_t device_of_node[128]; /* IMAGE_NO_DEVICE where there is none */
} image;

/* Forgets what was heard: freshness, ages, AL and NMT states, emergencies; values and counters stay. */
void image_reset(image *im);

/* Takes the frames of one tick; `counter` is the one of the last SYNC. Returns the working counter. */
int32_t image_latch(image *im, const wire_frames *frames, uint16_t counter);

/* 1 where every device answered this tick from OP, none was lost, none reports an error, and no frame was
 * discarded or came from a second sender or master. */
int32_t image_calm(const image *im);

/* Appends the output frames. Where `operational` is 0 the outputs go out as zeros, marked not valid.
   Returns the number of outputs that were not finite (sent as zero), or WIRE_FULL. */
int32_t image_compose(image *im, wire_frames *frames, uint16_t counter, int32_t operational);

#endif
