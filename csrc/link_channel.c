#include "link_channel.h"

#include <assert.h>
#include <time.h>

enum { SECOND = 1000000000, WAIT = 20000 };

static_assert(LINK_NONE == -1, "as link_open says it");

int64_t link_clock(void) {
    struct timespec now;
    clock_gettime(CLOCK_BOOTTIME, &now);
    return (int64_t)now.tv_sec * SECOND + now.tv_nsec;
}

static int64_t time_of(const link_channel *channel) {
    return channel->given ? channel->given : link_clock();
}

/* Each side writes its own word before it reads the other's: a call begins before the end and is waited for,
 * or learns of it. */
static int enter(link_channel *channel) {
    __atomic_fetch_add(&channel->inside, 1, __ATOMIC_SEQ_CST);
    return !__atomic_load_n(&channel->over, __ATOMIC_SEQ_CST);
}

static void leave(link_channel *channel) {
    __atomic_fetch_sub(&channel->inside, 1, __ATOMIC_RELEASE);
}

void link_channel_close(link_channel *channel) {
    const struct timespec wait = {.tv_nsec = WAIT};
    __atomic_store_n(&channel->over, 1, __ATOMIC_SEQ_CST);
    while (__atomic_load_n(&channel->inside, __ATOMIC_SEQ_CST)) nanosleep(&wait, NULL);
}

/* Whether the session is over by now; so it is for ever. */
static int ends(link_channel *channel, int64_t now) {
    if (now - channel->good <= channel->lease) return 0;
    __atomic_store_n(&channel->over, 1, __ATOMIC_SEQ_CST);
    return 1;
}

static int32_t send_next(link_channel *channel, const uint8_t *payload) {
    const int64_t now = time_of(channel);
    const uint64_t counter = channel->counter + 1;
    if (ends(channel, now)) return LINK_OVER;
    if (counter >> LINK_COUNTER_BITS) {
        __atomic_store_n(&channel->over, 1, __ATOMIC_SEQ_CST);
        return LINK_OVER;
    }
    if (counter >> LINK_EPOCH_BITS != channel->outbox.epoch) return LINK_SEALS;
    channel->counter = counter; /* before it is used: none is ever used twice */
    link_send(channel->fd, &channel->outbox, &channel->inbox, counter, now, payload);
    return 0;
}

int32_t link_channel_send(link_channel *channel, const uint8_t *payload) {
    const int32_t said = enter(channel) ? send_next(channel, payload) : LINK_OVER;
    channel->outbox.unsent += said == LINK_OVER;
    leave(channel);
    return said;
}

static int64_t receive_newest(link_channel *channel) {
    link_inbox *const inbox = &channel->inbox;
    if (inbox->window.newest >> LINK_EPOCH_BITS != inbox->epoch) return LINK_OPENS;
    link_receive(channel->fd, inbox);
    const int64_t now = channel->now = time_of(channel);
    if (ends(channel, now)) return LINK_OVER;
    channel->age = link_open(inbox, now);
    if (channel->age >= 0) channel->good = now;
    return now - channel->since >= SECOND ? LINK_WATCH : channel->age;
}

int64_t link_channel_receive(link_channel *channel) {
    const int64_t said = enter(channel) ? receive_newest(channel) : LINK_OVER;
    leave(channel);
    return said;
}
