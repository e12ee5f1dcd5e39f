#include "gateway.h"

#include <math.h>

#include "codec.h"
#include "peer_internal.h"

int32_t gateways_say(const gateways *g, const peers *p, uint8_t *packet) {
    for (int32_t i = 0; i < g->count; i++) {
        if (p->peers[g->device[i]].al_state != AL_OP) return 0;
    }
    for (int32_t k = 0; k < g->said; k++) {
        const peer_entry *const entry = &g->say[k];
        uint8_t *const at = packet + entry->offset;
        if (entry->word) {
            codec_put_word(at, entry->type, p->output_words[entry->target]);
        } else {
            codec_put_number(at, entry->type, p->output_values[entry->target]);
        }
    }
    return 1;
}

static int sane(const peer_entry *entry, int32_t n, const uint8_t *packet) {
    for (int32_t k = 0; k < n; k++) {
        if (!entry[k].word && !isfinite(codec_number(packet + entry[k].offset, entry[k].type))) return 0;
    }
    return 1;
}

static void report(const peer_entry *entry, int32_t n, peers *p, const uint8_t *packet) {
    for (int32_t k = 0; k < n; k++) {
        const uint8_t *const at = packet + entry[k].offset;
        if (entry[k].word) {
            p->words[entry[k].target] = codec_word(at, entry[k].type);
        } else {
            p->values[entry[k].target] = codec_number(at, entry[k].type);
        }
    }
}

int32_t gateways_hear(const gateways *g, peers *p, const uint8_t *packet) {
    int32_t good = 1;
    const peer_entry *own = g->hear;
    for (int32_t i = 0; i < g->count; own += g->hears[i], i++) {
        if (sane(own, g->hears[i], packet)) {
            report(own, g->hears[i], p, packet);
        } else {
            good = 0;
        }
    }
    return good;
}

void gateways_age(const gateways *g, peers *p, double age) {
    for (int32_t i = 0; i < g->count; i++) p->values[g->age[i]] = age;
}
