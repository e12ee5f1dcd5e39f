#include "link_seal.h"

#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

#include "link.h"

enum { SALT = 4, NONCE = 12, COUNTER_AT = LINK_HEADER - (NONCE - SALT), GET_TAG = 0x10, SET_TAG = 0x11 };

/* What is used of libcrypto, as openssl/evp.h of versions 1.1 to 3 declares it. */
static struct {
    void *(*new_context)(void);
    void (*free_context)(void *context);
    const void *(*aes_256_gcm)(void);
    int (*init)(void *context, const void *cipher, void *engine, const uint8_t *key, const uint8_t *nonce,
                int encrypt);
    int (*update)(void *context, uint8_t *out, int *written, const uint8_t *in, int size);
    int (*final)(void *context, uint8_t *out, int *written);
    int (*control)(void *context, int what, int size, void *value);
    void (*clear_errors)(void);
    void (*wipe)(void *at, size_t size);
} crypto;

static const struct {
    const char *name;
    void *function;
} NEEDED[] = {
    {"EVP_CIPHER_CTX_new", &crypto.new_context}, {"EVP_CIPHER_CTX_free", &crypto.free_context},
    {"EVP_aes_256_gcm", &crypto.aes_256_gcm},    {"EVP_CipherInit_ex", &crypto.init},
    {"EVP_CipherUpdate", &crypto.update},        {"EVP_CipherFinal_ex", &crypto.final},
    {"EVP_CIPHER_CTX_ctrl", &crypto.control},    {"ERR_clear_error", &crypto.clear_errors},
    {"OPENSSL_cleanse", &crypto.wipe},
};

typedef struct {
    void *context;
    uint8_t salt[SALT];
} salted;

int32_t link_load(const char *library) {
    static int32_t loaded;
    if (loaded) return 1;
    void *const handle = dlopen(library, RTLD_NOW | RTLD_LOCAL);
    if (!handle) return 0;
    for (size_t i = 0; i < sizeof(NEEDED) / sizeof(NEEDED[0]); i++) {
        void *const found = dlsym(handle, NEEDED[i].name);
        if (!found) {
            dlclose(handle);
            return 0;
        }
        memcpy(NEEDED[i].function, &found, sizeof(found)); /* a function's address, as POSIX has it */
    }
    loaded = 1;
    return 1;
}

/* Begins with a packet: its nonce, and its header. */
static int begin(const salted *key, const uint8_t *header, int encrypt) {
    uint8_t nonce[NONCE];
    int written;
    memcpy(nonce, key->salt, SALT);
    memcpy(nonce + SALT, header + COUNTER_AT, NONCE - SALT);
    return crypto.init(key->context, NULL, NULL, NULL, nonce, encrypt) > 0 &&
           crypto.update(key->context, NULL, &written, header, LINK_HEADER) > 0;
}

static int32_t seal(void *key, const uint8_t *header, const uint8_t *content, int32_t size, uint8_t *sealed) {
    const salted *const with = key;
    int written, rest;
    const int done = begin(with, header, 1) &&
                     crypto.update(with->context, sealed, &written, content, size) > 0 &&
                     crypto.final(with->context, sealed + size, &rest) > 0 && written + rest == size &&
                     crypto.control(with->context, GET_TAG, LINK_TAG, sealed + size) > 0;
    if (!done) crypto.clear_errors();
    return done;
}

static int32_t open_sealed(void *key, const uint8_t *header, const uint8_t *sealed, int32_t size,
                           uint8_t *content) {
    const salted *const with = key;
    uint8_t tag[LINK_TAG], none[LINK_TAG];
    int written, rest;
    memcpy(tag, sealed + size, LINK_TAG);
    const int authentic = begin(with, header, 0) &&
                          crypto.update(with->context, content, &written, sealed, size) > 0 &&
                          crypto.control(with->context, SET_TAG, LINK_TAG, tag) > 0 &&
                          crypto.final(with->context, none, &rest) > 0 && written == size && rest == 0;
    if (!authentic) {
        memset(content, 0, (size_t)size);
        crypto.clear_errors();
    }
    return authentic;
}

void link_forget(link_sealing *sealing) {
    salted *const key = sealing->key;
    *sealing = (link_sealing){0};
    if (!key) return;
    crypto.free_context(key->context);
    crypto.wipe(key, sizeof(*key));
    free(key);
}

int32_t link_key(link_sealing *sealing, const uint8_t *key, const uint8_t *salt) {
    if (!crypto.new_context) return 0;
    salted *const made = calloc(1, sizeof(*made));
    if (!made) return 0;
    *sealing = (link_sealing){.key = made, .seal = seal, .open = open_sealed};
    memcpy(made->salt, salt, SALT);
    made->context = crypto.new_context();
    if (!made->context || crypto.init(made->context, crypto.aes_256_gcm(), NULL, key, NULL, 1) <= 0) {
        link_forget(sealing);
        return 0;
    }
    return 1;
}
