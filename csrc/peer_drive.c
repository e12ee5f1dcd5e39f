/* A simulated drive: the state machine of CiA 402 as the drive sees it, brake, STO, faults. It moves its axis
 * only in OP, operation enabled, in its mode and without STO; otherwise the brake is closed. */
#include "peer_internal.h"

typedef enum {
    UNKNOWN,
    NOT_READY_TO_SWITCH_ON,
    SWITCH_ON_DISABLED,
    READY_TO_SWITCH_ON,
    SWITCHED_ON,
    OPERATION_ENABLED,
    QUICK_STOP_ACTIVE,
    FAULT_REACTION_ACTIVE,
    FAULT,
    STATES
} state;

/* What each command makes of each state, with the standard's transition numbers; 0 = it stays. */
static const uint8_t SHUTDOWN[STATES] = {
    [SWITCH_ON_DISABLED] = READY_TO_SWITCH_ON, /* 2 */
    [SWITCHED_ON] = READY_TO_SWITCH_ON,        /* 6 */
    [OPERATION_ENABLED] = READY_TO_SWITCH_ON,  /* 8 */
};
static const uint8_t SWITCH_ON[STATES] = {
    [READY_TO_SWITCH_ON] = SWITCHED_ON, /* 3 */
    [OPERATION_ENABLED] = SWITCHED_ON,  /* 5 */
};
static const uint8_t ENABLE_OPERATION[STATES] = {
    [READY_TO_SWITCH_ON] = SWITCHED_ON,      /* 3 */
    [SWITCHED_ON] = OPERATION_ENABLED,       /* 4 */
    [QUICK_STOP_ACTIVE] = OPERATION_ENABLED, /* 16 */
};
static const uint8_t DISABLE_VOLTAGE[STATES] = {
    [READY_TO_SWITCH_ON] = SWITCH_ON_DISABLED, /* 7 */
    [OPERATION_ENABLED] = SWITCH_ON_DISABLED,  /* 9 */
    [SWITCHED_ON] = SWITCH_ON_DISABLED,        /* 10 */
    [QUICK_STOP_ACTIVE] = SWITCH_ON_DISABLED,  /* 12 */
};
static const uint8_t QUICK_STOP[STATES] = {
    [READY_TO_SWITCH_ON] = SWITCH_ON_DISABLED, /* 7 */
    [SWITCHED_ON] = SWITCH_ON_DISABLED,        /* 10 */
    [OPERATION_ENABLED] = QUICK_STOP_ACTIVE,   /* 11 */
};

/* Controlword: mask and value of each command. */
static const struct {
    uint32_t mask, value;
    const uint8_t *next;
} COMMANDS[] = {
    {0x8F, 0x0F, ENABLE_OPERATION}, {0x8F, 0x07, SWITCH_ON},       {0x87, 0x06, SHUTDOWN},
    {0x86, 0x02, QUICK_STOP},       {0x82, 0x00, DISABLE_VOLTAGE},
};
enum { COMMAND_COUNT = sizeof(COMMANDS) / sizeof(COMMANDS[0]) };

static const uint32_t STATUSWORD[STATES] = {
    [SWITCH_ON_DISABLED] = 0x40,
    [READY_TO_SWITCH_ON] = 0x21,
    [SWITCHED_ON] = 0x23,
    [OPERATION_ENABLED] = 0x27,
    [QUICK_STOP_ACTIVE] = 0x07,
    [FAULT_REACTION_ACTIVE] = 0x0F,
    [FAULT] = 0x08,
};
enum { REMOTE = 0x0200, VOLTAGE_ENABLED = 0x0010, FAULT_RESET = 0x80 };

static void follow(peer_drive *d, const uint8_t *next) {
    if (next[d->state]) d->state = next[d->state];
}

int32_t peers_powered(const peers *p, int32_t i) {
    const peer *const d = &p->peers[i];
    return d->drive.state == OPERATION_ENABLED && d->al_state == AL_OP && d->drive.mode == d->drive.own &&
           !peers_sto(p);
}

static void trip(peers *p, int32_t i, uint16_t code) { /* 13 */
    p->peers[i].drive.state = FAULT_REACTION_ACTIVE;
    p->peers[i].drive.error_code = code;
    peers_emergency(p, i, code, ERROR_GENERIC);
}

void drive_latched(peers *p, int32_t i) {
    peer_drive *const d = &p->peers[i].drive;
    if (d->deaf) return;
    const uint32_t controlword = p->output_words[p->peers[i].told], before = d->obeyed;
    d->obeyed = controlword;
    if (d->state == FAULT) {
        if ((controlword & ~before & FAULT_RESET) && !d->fault) { /* 15 */
            d->state = SWITCH_ON_DISABLED;
            d->error_code = 0;
            peers_emergency(p, i, 0, 0);
        }
        return;
    }
    if (peers_sto(p)) return;
    for (int k = 0; k < COMMAND_COUNT; k++) {
        if ((controlword & COMMANDS[k].mask) == COMMANDS[k].value) {
            follow(d, COMMANDS[k].next);
            return;
        }
    }
}

void drive_invalid(peer *d) {
    if (d->drive.welded) return;
    d->drive.obeyed = 0;
    follow(&d->drive, DISABLE_VOLTAGE);
}

void drive_tripped(peers *p, int32_t i) {
    p->peers[i].drive.obeyed = 0;
    if (p->peers[i].drive.state != FAULT) trip(p, i, EMCY_RPDO_TIMEOUT);
}

void drive_advance(peers *p, int32_t i) {
    peer_drive *const d = &p->peers[i].drive;
    if (d->state == NOT_READY_TO_SWITCH_ON) { /* 1 */
        d->state = SWITCH_ON_DISABLED;
    } else if (d->state == FAULT_REACTION_ACTIVE) { /* 14 */
        d->state = FAULT;
    } else if (d->fault && d->state != FAULT) {
        trip(p, i, d->fault);
    } else if (peers_sto(p)) {
        follow(d, DISABLE_VOLTAGE);
    }
}

uint32_t peers_statusword(const peers *p, int32_t i) {
    return STATUSWORD[p->peers[i].drive.state] | REMOTE | (peers_sto(p) ? 0 : VOLTAGE_ENABLED);
}

void drive_report(const peers *p, int32_t i) {
    const peer *const d = &p->peers[i];
    const uint32_t said[PEER_SAYS] = {peers_statusword(p, i), (uint32_t)d->drive.mode, d->drive.error_code};
    for (int k = 0; k < PEER_SAYS; k++) {
        if (d->says[k] >= 0) p->words[d->says[k]] = said[k];
    }
}

void peers_drives(const peers *p, const int32_t *drives, int32_t n, double *command, uint8_t *braked) {
    for (int32_t k = 0; k < n; k++) {
        const int on = peers_powered(p, drives[k]);
        command[k] = on ? p->output_values[p->peers[drives[k]].drive.target] : 0.0;
        braked[k] = !on;
    }
}
