/* A simulated safety controller: two-channel switches, and the STO line to the drives, a wire that needs no
 * frame and no time. STO acts at once on an open emergency stop or on request, and stays until it is
 * acknowledged. */
#include "peer_internal.h"

enum {                  /* 2500h, 1 = safe to move */
       DEAD_MAN = 0x01, /* ... and the next bit for the second channel */
       EMERGENCY_STOP = 0x04,
       SCANNER_CLEAR = 0x10,
       TORQUE_PERMITTED = 0x60,
       SUPERVISOR = 0x80,
       OVERRIDE = 0x200
};
enum { REQUEST_STO = 0x01, REQUEST_RESET = 0x02 }; /* 2501h */

int32_t peers_safety_sto(const peers *p, int32_t i) {
    const peer *const d = &p->peers[i];
    const uint8_t *const pressed = d->safety.emergency_stop;
    const int requested = (p->output_words[d->told] & REQUEST_STO) && d->al_state == AL_OP;
    return d->safety.latched || pressed[0] || pressed[1] || requested;
}

int32_t peers_sto(const peers *p) {
    return p->safety >= 0 && peers_safety_sto(p, p->safety);
}

/* An acknowledgement is a rising edge, and needs the cause gone. */
void safety_latched(peers *p, int32_t i) {
    peer_safety *const d = &p->peers[i].safety;
    uint32_t *const request = &p->output_words[p->peers[i].told];
    if (d->deaf) *request = 0;
    if (*request & ~d->obeyed & REQUEST_RESET) d->latched = 0;
    d->obeyed = *request;
    d->latched = (uint8_t)peers_safety_sto(p, i); /* again, where the cause is still there */
}

/* Without valid outputs there is no request; what was latched stays. */
void safety_invalid(peers *p, int32_t i) {
    p->peers[i].safety.latched = (uint8_t)peers_safety_sto(p, i);
    p->output_words[p->peers[i].told] = p->peers[i].safety.obeyed = 0;
}

/* A silent master: STO. */
void safety_tripped(peers *p, int32_t i) {
    p->peers[i].safety.latched = 1;
    p->output_words[p->peers[i].told] = p->peers[i].safety.obeyed = 0;
}

/* A cause that shows now is latched. */
void safety_advance(peers *p, int32_t i) {
    p->peers[i].safety.latched = (uint8_t)peers_safety_sto(p, i);
}

void safety_report(const peers *p, int32_t i) {
    const peer *const d = &p->peers[i];
    uint32_t bits = d->safety.scanner_clear ? SCANNER_CLEAR : 0;
    for (int channel = 0; channel < 2; channel++) {
        if (d->safety.dead_man[channel]) bits |= (uint32_t)DEAD_MAN << channel;
        if (d->safety.supervisor[channel]) bits |= (uint32_t)SUPERVISOR << channel;
        if (d->safety.override[channel]) bits |= (uint32_t)OVERRIDE << channel;
        if (!d->safety.emergency_stop[channel]) bits |= (uint32_t)EMERGENCY_STOP << channel;
    }
    if (!peers_safety_sto(p, i)) bits |= TORQUE_PERMITTED;
    if (d->says[0] >= 0) p->words[d->says[0]] = bits;
}
