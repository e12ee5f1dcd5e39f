#include "link.h"

#include <assert.h>
#include <errno.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>

enum { FIRST = 2, BATCH = 8, OVERHEAD = LINK_HEADER + LINK_STAMPS + LINK_TAG };

static_assert(sizeof(((link_inbox *)0)->counter) == LINK_KEEP * sizeof(uint64_t),
              "room for all that is kept");
static_assert(sizeof(((link_inbox *)0)->datagram) == LINK_KEEP * LINK_LARGEST, "room for all that is kept");
static_assert(sizeof(((link_inbox *)0)->payload) == LINK_LARGEST - OVERHEAD, "room for the payload");
static_assert(LINK_WINDOW == 8 * sizeof(((link_window *)0)->seen), "a bit for each counter of the window");
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the wire is little endian, and so is this host");

typedef struct {
    uint16_t magic;
    uint8_t version;
    uint8_t direction;
    uint64_t session;
    uint64_t counter;
} header;

static header read_header(const uint8_t *at) {
    header h = {.version = at[2], .direction = at[3]};
    memcpy(&h.magic, at, sizeof(h.magic));
    memcpy(&h.session, at + 4, sizeof(h.session));
    memcpy(&h.counter, at + 12, sizeof(h.counter));
    return h;
}

static void write_header(uint8_t *at, const header *h) {
    memcpy(at, &h->magic, sizeof(h->magic));
    at[2] = h->version;
    at[3] = h->direction;
    memcpy(at + 4, &h->session, sizeof(h->session));
    memcpy(at + 12, &h->counter, sizeof(h->counter));
}

int32_t link_look(const link_window *window, uint64_t counter) {
    if (counter > window->newest) return LINK_NEWEST;
    const uint64_t behind = window->newest - counter;
    if (behind >= LINK_WINDOW || (window->seen >> behind & 1)) return LINK_SEEN;
    return LINK_LATE;
}

int32_t link_mark(link_window *window, uint64_t counter) {
    const int32_t what = link_look(window, counter);
    if (what == LINK_LATE) window->seen |= UINT64_C(1) << (window->newest - counter);
    if (what != LINK_NEWEST) return what;
    const uint64_t step = counter - window->newest;
    if (step >= LINK_WINDOW) {
        window->lost += __builtin_popcountll(~window->seen) + (int64_t)(step - LINK_WINDOW);
        window->seen = 1;
    } else {
        window->lost += __builtin_popcountll(~window->seen >> (LINK_WINDOW - step));
        window->seen = window->seen << step | 1;
    }
    window->newest = counter;
    return what;
}

/* What is wrong with a datagram: its count, or NULL where it is to be opened. */
static int64_t *fault(link_inbox *inbox, const uint8_t *datagram, unsigned size, int message_flags) {
    if ((message_flags & MSG_TRUNC) || size > (unsigned)inbox->size) return &inbox->oversize;
    if (size < (unsigned)inbox->size) return &inbox->truncated;
    const header h = read_header(datagram);
    if (h.magic != LINK_MAGIC || h.version != LINK_VERSION || h.session != inbox->session) {
        return &inbox->foreign;
    }
    if (h.direction != inbox->direction) return &inbox->reflected;
    const uint64_t newest = inbox->window.newest;
    if (h.counter >> LINK_EPOCH_BITS > (newest >> LINK_EPOCH_BITS) + 1) return &inbox->ahead;
    if (link_look(&inbox->window, h.counter) == LINK_SEEN) {
        return newest - h.counter < LINK_WINDOW ? &inbox->duplicate : &inbox->replayed;
    }
    return NULL;
}

/* Keeps a datagram; where there is no room, instead of the oldest that is kept, or not at all. */
static void keep(link_inbox *inbox, const uint8_t *datagram) {
    const uint64_t counter = read_header(datagram).counter;
    int slot = inbox->count;
    if (slot == LINK_KEEP) {
        inbox->shed++;
        slot = 0;
        for (int i = 1; i < LINK_KEEP; i++) {
            if (inbox->counter[i] < inbox->counter[slot]) slot = i;
        }
        if (inbox->counter[slot] >= counter) return;
    } else {
        inbox->count++;
    }
    inbox->counter[slot] = counter;
    memcpy(inbox->datagram[slot], datagram, (size_t)inbox->size);
}

/* One system call: up to `room` datagrams. Returns how many, or -1 with errno set. */
static int receive_batch(int fd, int room, struct mmsghdr *messages, uint8_t (*datagrams)[LINK_LARGEST]) {
    struct iovec vectors[BATCH];
    memset(messages, 0, sizeof(*messages) * (size_t)room);
    for (int i = 0; i < room; i++) {
        vectors[i] = (struct iovec){.iov_base = datagrams[i], .iov_len = LINK_LARGEST};
        messages[i].msg_hdr.msg_iov = &vectors[i];
        messages[i].msg_hdr.msg_iovlen = 1;
    }
    return recvmmsg(fd, messages, (unsigned)room, MSG_DONTWAIT, NULL);
}

int32_t link_receive(int32_t fd, link_inbox *inbox) {
    struct mmsghdr messages[BATCH];
    uint8_t datagrams[BATCH][LINK_LARGEST];
    inbox->count = 0;
    /* an error counts as a batch: the network's answers must not hold us here either */
    for (int taken = 0; taken < LINK_TAKE;) {
        /* mostly one waits: the first batch is small */
        const int asked = taken ? BATCH : FIRST;
        const int room = LINK_TAKE - taken < asked ? LINK_TAKE - taken : asked;
        const int got = receive_batch(fd, room, messages, datagrams);
        if (got < 0) {
            if (errno == EAGAIN || errno == EWOULDBLOCK) break;
            inbox->failures++;
            inbox->error = errno;
            taken += BATCH;
            continue;
        }
        for (int i = 0; i < got; i++) {
            int64_t *const wrong =
                fault(inbox, datagrams[i], messages[i].msg_len, messages[i].msg_hdr.msg_flags);
            if (wrong) {
                ++*wrong;
            } else {
                keep(inbox, datagrams[i]);
            }
        }
        inbox->taken += got;
        taken += got;
        if (got < room) break;
    }
    return inbox->count;
}

/* Notes that an authentic datagram has come. Returns whether it is newer than all before. */
static int accept_datagram(link_inbox *inbox, uint64_t counter) {
    const int32_t what = link_mark(&inbox->window, counter);
    if (what == LINK_SEEN) {
        inbox->duplicate++; /* twice in one batch: the first one was not marked when this one was kept */
    } else {
        inbox->received++;
        inbox->reordered += what == LINK_LATE;
    }
    return what == LINK_NEWEST;
}

/* The key that a counter belongs to; NULL where it is forgotten or too far away. */
static const link_sealing *key_of(const link_inbox *inbox, uint64_t counter) {
    const uint64_t epoch = counter >> LINK_EPOCH_BITS;
    if (epoch == inbox->epoch) return inbox->now;
    if (epoch == inbox->epoch + 1) return inbox->next;
    return epoch + 1 == inbox->epoch ? inbox->before : NULL;
}

/* The likely age of the newest datagram, or -1, counted, where it is to move nothing. */
static int64_t fresh(link_inbox *inbox, int64_t now) {
    inbox->heard = now;
    link_age age;
    if (!link_judge(&inbox->ages, now, inbox->sent, inbox->echo, inbox->held, &age)) {
        inbox->unproven++;
    } else if (age.unheard > inbox->deaf) {
        inbox->deafened++;
    } else if (age.likely > inbox->oldest || age.most > 2 * inbox->oldest) {
        inbox->stale++;
    } else {
        return age.likely;
    }
    return -1;
}

int64_t link_open(link_inbox *inbox, int64_t now) {
    const int32_t size = inbox->size - LINK_HEADER - LINK_TAG;
    uint8_t content[LINK_LARGEST];
    int newer = 0;
    for (int slot = 0; slot < inbox->count; slot++) {
        const uint8_t *const datagram = inbox->datagram[slot];
        const link_sealing *const with = key_of(inbox, inbox->counter[slot]);
        if (!with || !with->open(with->key, datagram, datagram + LINK_HEADER, size, content)) {
            inbox->forged++;
            continue;
        }
        if (!accept_datagram(inbox, inbox->counter[slot])) continue;
        newer = 1;
        memcpy(&inbox->sent, content, sizeof(inbox->sent));
        memcpy(&inbox->echo, content + 8, sizeof(inbox->echo));
        memcpy(&inbox->held, content + 16, sizeof(inbox->held));
        memcpy(inbox->payload, content + LINK_STAMPS, (size_t)(size - LINK_STAMPS));
    }
    inbox->count = 0;
    return newer ? fresh(inbox, now) : -1;
}

/* What is sealed: stamps and payload. */
static void write_content(uint8_t *at, const link_inbox *inbox, int64_t now, const uint8_t *payload,
                          int32_t size) {
    const int64_t ago = now - inbox->heard;
    const uint32_t held = inbox->sent && ago >= 0 && ago < UINT32_MAX ? (uint32_t)ago : UINT32_MAX;
    memcpy(at, &now, sizeof(now));
    memcpy(at + 8, &inbox->sent, sizeof(inbox->sent));
    memcpy(at + 16, &held, sizeof(held));
    memcpy(at + LINK_STAMPS, payload, (size_t)size);
}

void link_send(int32_t fd, link_outbox *outbox, const link_inbox *inbox, uint64_t counter, int64_t now,
               const uint8_t *payload) {
    const header h = {.magic = LINK_MAGIC,
                      .version = LINK_VERSION,
                      .direction = (uint8_t)outbox->direction,
                      .session = outbox->session,
                      .counter = counter};
    uint8_t content[LINK_LARGEST];
    uint8_t datagram[LINK_LARGEST];
    const int32_t size = LINK_STAMPS + outbox->size;
    const link_sealing *const with = outbox->now;
    write_header(datagram, &h);
    write_content(content, inbox, now, payload, outbox->size);
    if (!with->seal(with->key, datagram, content, size, datagram + LINK_HEADER)) {
        outbox->unsent++;
        return;
    }
    const size_t whole = LINK_HEADER + (size_t)size + LINK_TAG;
    ssize_t done = send(fd, datagram, whole, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (done < 0 && errno == ECONNREFUSED) { /* of an earlier packet; this one was not tried */
        outbox->unreachable++;
        done = send(fd, datagram, whole, MSG_DONTWAIT | MSG_NOSIGNAL);
        outbox->unreachable += done < 0 && errno == ECONNREFUSED;
    }
    outbox->sent += done >= 0;
    outbox->unsent += done < 0;
}
