/*
 * The solver in extended precision, for what the rounding of doubles leaves unproven: the same source,
 * compiled once more (extended/) with another `real`, where the machine has one of 64 bits. It takes ten
 * times as long.
 */
#ifndef HQP_EXTENDED_H
#define HQP_EXTENDED_H

#include <float.h>

#include "hqp.h"

/* Whether there are more digits than these. */
#ifdef HQP_EXTENDED
enum { HQP_HAS_EXTENDED = 0 };
#else
enum { HQP_HAS_EXTENDED = LDBL_MANT_DIG == 64 };
#endif

typedef struct hqp_extended hqp_extended;

/* As those of hqp.h. The settings are for doubles. */
hqp_extended *hqp_extended_create(const hqp_dims *dims, const hqp_settings *settings);
hqp_status hqp_extended_solve(hqp_extended *e, const hqp_level *levels, double *x, hqp_info *info);
void hqp_extended_destroy(hqp_extended *e);

/* extended/extended_place.c: limits of the next solve and its rank, and where it begins; the working sets
 * where it ended. With `only_face` x is proven at the minimum of its face, and nothing else is tried.
 */
void hqp_extended_limit(hqp_extended *e, int max_iterations, double time_limit, double rank);
void hqp_extended_begin(hqp_extended *e, const double *x, const signed char *side,
                        const signed char *held_side, const short *held_at, int only_face);
void hqp_extended_end(const hqp_extended *e, signed char *side, signed char *held_side, short *held_at);

#endif
