/*
 * Sealing and opening packets of the link: AES-256-GCM of OpenSSL's libcrypto, which is loaded when it is
 * asked for, so that neither its headers are needed to build this nor the library to import it.
 *
 * The nonce is the key's salt and the counter in the header (docs/link.md). A key's cipher is set up once.
 */
#ifndef HAPTICD_LINK_SEAL_H
#define HAPTICD_LINK_SEAL_H

#include <stdint.h>

/* Makes of `size` bytes `from` others, `to`; LINK_HEADER bytes of a `header` are authenticated. The sealed
 * ones are LINK_TAG more than `size`. Returns 0 where it fails; of a datagram that is not authentic, nothing
 * is to be read. */
typedef int32_t link_sealer(void *key, const uint8_t *header, const uint8_t *from, int32_t size, uint8_t *to);

/* A key, and what uses it. */
typedef struct {
    void *key;
    link_sealer *seal;
    link_sealer *open;
} link_sealing;

/* Loads a libcrypto by its file name. Returns whether all is there; asked again, whether it was. */
int32_t link_load(const char *library);

/* Makes a key of 32 bytes and a salt of 4. Returns 0 without libcrypto or memory. */
int32_t link_key(link_sealing *sealing, const uint8_t *key, const uint8_t *salt);

/* Wipes and frees it. */
void link_forget(link_sealing *sealing);

#endif
