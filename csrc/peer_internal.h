/* What kinds of simulated devices add to what all of them do (see peer.c). */
#ifndef HAPTICD_PEER_INTERNAL_H
#define HAPTICD_PEER_INTERNAL_H

#include "peer.h"

enum { ERROR_GENERIC = 0x01, ERROR_COMMUNICATION = 0x10, EMCY_RPDO_TIMEOUT = 0x8250 };
enum { AL_PREOP = 2, AL_SAFEOP = 4, AL_OP = 8 };

/* One SYNC: latches the outputs where the master marks them valid, and answers. */
void peer_sync(peers *p, int32_t i, uint16_t counter, int valid);

/* New outputs were latched; the device left OP, because the master said so or is silent; the master has
   acknowledged that it was; plant time passes; what the device says of itself goes into words. */
void drive_latched(peers *p, int32_t i);
void drive_invalid(peer *d);
void drive_tripped(peers *p, int32_t i);
void drive_advance(peers *p, int32_t i, int64_t dt);
void drive_report(const peers *p, int32_t i);

void safety_latched(peers *p, int32_t i);
void safety_invalid(peers *p, int32_t i);
void safety_tripped(peers *p, int32_t i);
void safety_advance(peers *p, int32_t i);
void safety_report(const peers *p, int32_t i);

#endif
