/* A simulated drive: the state machine of CiA 402 as the drive sees it, brake, STO, faults. It moves its axis
 * only in OP, operation enabled, in its mode and without STO; otherwise the brake is closed. */
#include "peer_internal.h"

#include <math.h>

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
enum { REMOTE = 0x0200, VOLTAGE_ENABLED = 0x0010, LIMITED = 0x0800, FAULT_RESET = 0x80 };
enum { LOAD_LEVEL = 0x2350 }; /* i2t, thermal state */
/* A drive that folded back gives its peak again below this share of its budget; told more than its rated
 * torque for so long [ns], it has a fault. */
static const double RECOVERED = 0.9;
static const int64_t INSISTED = 100000000;

static void follow(peer_drive *d, const uint8_t *next) {
    if (next[d->state]) d->state = next[d->state];
}

int32_t peers_powered(const peers *p, int32_t i) {
    const peer *const d = &p->peers[i];
    return d->drive.state == OPERATION_ENABLED && d->al_state == AL_OP && d->drive.mode == d->drive.own &&
           !peers_sto(p);
}

double peers_command(const peers *p, int32_t i) {
    if (!peers_powered(p, i)) return 0.0;
    const peer_drive *const d = &p->peers[i].drive;
    const double told = p->output_values[d->target], most = d->folded ? d->rated : d->peak;
    return d->peak > 0.0 ? fmin(fmax(told, -most), most) : told;
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
        if ((controlword & ~before & FAULT_RESET) && !d->fault && !d->folded) { /* 15 */
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

static void warm(peers *p, int32_t i, int64_t dt) {
    peer_drive *const d = &p->peers[i].drive;
    const double torque = peers_command(p, i), s = 1e-9 * (double)dt;
    const double whole = (d->peak * d->peak - d->rated * d->rated) * d->peak_time;
    d->used = fmax(0.0, d->used + s * (torque * torque - d->rated * d->rated) / whole);
    d->folded = d->used >= (d->folded ? RECOVERED : 1.0);
    d->insisted = d->folded && peers_powered(p, i) && fabs(p->output_values[d->target]) > d->rated
                      ? d->insisted + dt
                      : 0;
    if (d->insisted >= INSISTED) trip(p, i, LOAD_LEVEL);
}

void drive_advance(peers *p, int32_t i, int64_t dt) {
    peer_drive *const d = &p->peers[i].drive;
    if (d->peak > 0.0) warm(p, i, dt);
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
    const peer_drive *const d = &p->peers[i].drive;
    return STATUSWORD[d->state] | REMOTE | (peers_sto(p) ? 0 : VOLTAGE_ENABLED) | (d->folded ? LIMITED : 0);
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
        command[k] = peers_command(p, drives[k]);
        braked[k] = !peers_powered(p, drives[k]);
    }
}
