/*
 * Simulated devices: what they do in every cycle, bytes in and bytes out, in plant time.
 *
 * A peer latches its slot of the output frames at SYNC and answers with its TPDO; it sends heartbeats, and
 * leaves OP when its output watchdog runs out. NMT commands and SDO, which come now and then, are for whoever
 * owns the peers: peers_take stops at such a frame.
 *
 * Quantities and words of all peers lie in arrays of the same layout as the master's process image.
 * All memory belongs to the caller; nothing here allocates.
 */
#ifndef HAPTICD_PEER_H
#define HAPTICD_PEER_H

#include <stdint.h>
#include "shape.h"
#include "wire.h"

enum { PEER_FRAMES = 64, PEER_SAYS = 3 };

typedef enum { PEER_PLAIN, PEER_DRIVE, PEER_SAFETY } peer_kind;

/* A mapped object. TPDO: raw = (value - shift) * gain. Slot: value = raw * gain + shift. */
typedef struct {
    double gain;
    double shift;
    int32_t target; /* where it is in the values, or in the words */
    int32_t offset; /* where it is in the TPDO, or in the slot */
    uint8_t type;   /* codec_type */
    uint8_t word;   /* 1 = bit field */
    uint8_t reserved[6];
} peer_entry;

/* The state machine of CiA 402 as the drive sees it. */
typedef struct {
    int32_t state;       /* as devices/cia402.py numbers them */
    int32_t mode;        /* of operation (6060h and 6061h) */
    int32_t own;         /* the mode in which it moves its axis */
    int32_t target;      /* where what it is to do is in output_values */
    uint32_t obeyed;     /* the controlword before */
    uint16_t error_code; /* 603Fh, stays until the fault is reset */
    uint16_t fault;      /* code of a fault whose cause is present, 0 = none */
    uint8_t deaf;        /* the controlword has no effect */
    uint8_t welded;      /* nor has the loss of valid outputs */
    uint8_t folded;      /* its i2t limits it to the rated torque */
    int64_t insisted;    /* for so long it has been told more meanwhile [ns] */
    double rated, peak; /* torques for ever and for a time, in units of the command; peak 0 = it has no i2t */
    double peak_time;   /* [s] */
    double used;        /* share of its i2t budget */
} peer_drive;

/* A safety controller with two-channel switches. */
typedef struct {
    uint8_t dead_man[2];       /* pressed */
    uint8_t supervisor[2];     /* the safety operator's dead-man switch, pressed */
    uint8_t override[2];       /* key that lets a machine move without a hand at it, turned */
    uint8_t emergency_stop[2]; /* pressed: open */
    uint8_t scanner_clear;     /* nobody in the scanned field */
    uint8_t latched;           /* STO acts until it is acknowledged */
    uint8_t deaf;              /* it is asked in vain */
    uint32_t obeyed;           /* the request before */
} peer_safety;

typedef struct {
    int32_t kind; /* peer_kind */
    int32_t node;
    int32_t input, inputs;   /* it reports peers.input[input .. input + inputs) */
    int32_t output, outputs; /* it is told peers.output[output .. output + outputs) */
    int32_t tpdo_length;     /* bytes on the wire */
    int32_t slot_size;       /* bytes of its outputs */
    int32_t told;            /* where its controlword or request is in output_words */
    int32_t says[3];         /* where in words is what its kind reports of itself, -1 = it is not mapped.
                                Drive: statusword, mode, error code. Safety controller: its inputs. */

    /* what SDO may write; times in ns */
    int64_t heartbeat_time; /* 0 = none */
    int64_t watchdog_time;
    int32_t slot_frame, slot_offset;

    int64_t heartbeat_age, output_age; /* [ns] */
    int32_t counter;                   /* of the last SYNC that it answered, -1 = none */
    uint8_t nmt_state, al_state, error_register;
    uint8_t tripped;  /* the output watchdog acted, and the master has not acknowledged that */
    uint8_t silent;   /* nothing it sends gets out */
    uint8_t tampered; /* somebody changes what it sends */

    peer_drive drive;
    peer_safety safety;
} peer;

typedef struct {
    int32_t count;
    int32_t safety; /* the controller that holds the STO line of all drives, -1 = none */
    peer *peers SHAPE(count);
    const peer_entry *input SHAPE(any), *output SHAPE(any);
    double *values SHAPE(any); /* what peers report */
    uint32_t *words SHAPE(any);
    double *output_values SHAPE(any); /* what they were told */
    uint32_t *output_words SHAPE(any);

    uint8_t payload[4096];      /* output frames, by their number, 64 bytes each */
    int32_t length[64];         /* of those that came since the last SYNC, 0 = did not come */
    wire_frames *outbox;        /* what waits to be sent */
    uint8_t *sender SHAPE(any); /* of each frame there: which peer */
    int32_t given;              /* how many of them are out */
} peers;

/* Takes frames from number `first` on. Returns the number of one that is not for here (NMT, SDO), or -1. */
int32_t peers_take(peers *p, const wire_frames *frames, int32_t first);

/* Moves what waits in the outbox to `out`, as far as there is room. Returns -1, or which peer the frame at
   `given` is of, because somebody changes it; whoever has taken that one counts it in `given`. */
int32_t peers_give(peers *p, wire_frames *out);

/* Lets plant time pass [ns]; what is sent meanwhile waits in the outbox. */
void peers_advance(peers *p, int64_t dt);

/* What one peer sends: any frame, or an EMCY message, code 0 = the error is gone. If the outbox is full, the
   oldest frame in it is lost. */
void peers_emit(peers *p, int32_t i, uint32_t id, const uint8_t *data, int32_t len);
void peers_emergency(peers *p, int32_t i, uint16_t code, uint8_t error_register);

/* What one peer does when it leaves OP because the master said so. */
void peers_invalid(peers *p, int32_t i);

/* Its TPDO as it would be now, tpdo_length bytes. */
void peers_report(const peers *p, int32_t i, uint8_t *payload);

/* Whether STO acts on the drives. */
int32_t peers_sto(const peers *p);

/* Whether a safety controller's STO acts: latched, or its cause is there. */
int32_t peers_safety_sto(const peers *p, int32_t i);

/* Whether a drive moves its axis; otherwise the brake is closed. */
int32_t peers_powered(const peers *p, int32_t i);

/* What a drive moves its axis with: what it is told, as far as its i2t lets it, and 0 without power. */
double peers_command(const peers *p, int32_t i);

/* Statusword (6041h) of a drive. */
uint32_t peers_statusword(const peers *p, int32_t i);

/* What n drives do: command, what their axes are moved with, 0 without power; braked, 1 without power. */
void peers_drives(const peers *p, const int32_t *drives, int32_t n, double *command, uint8_t *braked);

#endif
