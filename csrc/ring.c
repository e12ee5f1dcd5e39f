#include "ring.h"

#include <stdatomic.h>
#include <string.h>

static const uint64_t MAGIC = 0x676e697264706168; /* "hapdring" */
static const uint32_t SKIP = 0xffffffff;          /* the rest of the buffer holds no record */

struct ring {
    uint64_t magic;
    int64_t capacity;
    _Alignas(64) _Atomic int64_t head; /* bytes ever written; only the producer writes it */
    _Alignas(64) _Atomic int64_t tail; /* bytes ever read; only the consumer writes it */
    _Alignas(64) _Atomic int64_t dropped;
    _Alignas(64) uint8_t data[];
};

static int64_t padded(int64_t length) {
    return (4 + length + 7) / 8 * 8;
}

int64_t ring_size(int64_t capacity) {
    return (int64_t)sizeof(ring) + capacity;
}

void ring_init(ring *r, int64_t capacity) {
    r->capacity = capacity;
    atomic_store(&r->head, 0);
    atomic_store(&r->tail, 0);
    atomic_store(&r->dropped, 0);
    r->magic = MAGIC;
}

int ring_valid(const ring *r, int64_t size) {
    return size > (int64_t)sizeof(ring) && r->magic == MAGIC && r->capacity > 0 && r->capacity % 8 == 0 &&
           r->capacity <= size - (int64_t)sizeof(ring);
}

static void put_length(ring *r, int64_t at, uint32_t length) {
    memcpy(r->data + at, &length, sizeof length);
}

int ring_push(ring *r, const void *record, int64_t length) {
    int64_t head = atomic_load_explicit(&r->head, memory_order_relaxed);
    const int64_t tail = atomic_load_explicit(&r->tail, memory_order_acquire);
    const int64_t need = padded(length), at = head % r->capacity;
    const int64_t skip = at + need > r->capacity ? r->capacity - at : 0;
    if (length < 0 || head - tail + skip + need > r->capacity) {
        atomic_fetch_add_explicit(&r->dropped, 1, memory_order_relaxed);
        return 0;
    }
    if (skip) put_length(r, at, SKIP);
    head += skip;
    const int64_t start = head % r->capacity;
    put_length(r, start, (uint32_t)length);
    memcpy(r->data + start + 4, record, (size_t)length);
    atomic_store_explicit(&r->head, head + need, memory_order_release);
    return 1;
}

int64_t ring_pop(ring *r, void *out, int64_t room) {
    int64_t tail = atomic_load_explicit(&r->tail, memory_order_relaxed);
    for (;;) {
        if (tail == atomic_load_explicit(&r->head, memory_order_acquire)) return 0;
        const int64_t at = tail % r->capacity;
        uint32_t length;
        memcpy(&length, r->data + at, sizeof length);
        if (length == SKIP) {
            tail += r->capacity - at;
            atomic_store_explicit(&r->tail, tail, memory_order_release);
            continue;
        }
        if ((int64_t)length > room || at + padded(length) > r->capacity) return -1;
        memcpy(out, r->data + at + 4, length);
        atomic_store_explicit(&r->tail, tail + padded(length), memory_order_release);
        return length;
    }
}

int64_t ring_dropped(const ring *r) {
    return atomic_load_explicit(&r->dropped, memory_order_relaxed);
}

int64_t ring_read(const ring *r) {
    return atomic_load_explicit(&r->tail, memory_order_relaxed);
}

int64_t ring_unread(const ring *r) {
    return atomic_load_explicit(&r->head, memory_order_relaxed) - ring_read(r);
}
