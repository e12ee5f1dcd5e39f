#include "wire.h"

#include <assert.h>
#include <errno.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <time.h>

enum { BATCH = 64, CLASSIC_SIZE = 16, CLASSIC_DATA = 8, FD_SIZE = 72, PACKED_HEADER = 6 };

static_assert(sizeof(wire_frame) == FD_SIZE, "a frame is laid out like struct canfd_frame");
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the wire is little endian, and so is this host");

/* Room for the arrival time that the kernel may add to a packet. */
typedef union {
    struct cmsghdr header;
    char room[CMSG_SPACE(sizeof(struct timespec))];
} control;

static int64_t clock_ns(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* Notes when a TIME object arrived. */
static void note_time(wire_link *link, const wire_frame *frame, struct msghdr *message) {
    if (frame->id != WIRE_TIME) return;
    for (struct cmsghdr *c = CMSG_FIRSTHDR(message); c; c = CMSG_NXTHDR(message, c)) {
        if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
        struct timespec at;
        memcpy(&at, CMSG_DATA(c), sizeof(at));
        const int64_t ago = clock_ns(CLOCK_REALTIME) - ((int64_t)at.tv_sec * 1000000000 + at.tv_nsec);
        link->time_ns = clock_ns(CLOCK_MONOTONIC) - ago;
    }
}

/* One system call: up to `room` datagrams into frames[0..room). */
static int receive_batch(int fd, wire_frame *frames, int room, struct mmsghdr *messages, control *controls) {
    struct iovec vectors[BATCH];
    memset(messages, 0, sizeof(*messages) * (size_t)room);
    for (int i = 0; i < room; i++) {
        vectors[i] = (struct iovec){.iov_base = &frames[i], .iov_len = FD_SIZE};
        messages[i].msg_hdr.msg_iov = &vectors[i];
        messages[i].msg_hdr.msg_iovlen = 1;
        messages[i].msg_hdr.msg_control = &controls[i];
        messages[i].msg_hdr.msg_controllen = sizeof(controls[i]);
    }
    int got;
    do {
        got = recvmmsg(fd, messages, (unsigned)room, MSG_DONTWAIT, NULL);
    } while (got < 0 && errno == EINTR);
    return got;
}

/* Whether a datagram of `size` bytes is a frame; clears the bytes that the sender left undefined. */
static int is_frame(wire_frame *frame, unsigned size, int message_flags) {
    const int classic = size == CLASSIC_SIZE && frame->len <= CLASSIC_DATA;
    const int fd = size == FD_SIZE && frame->len <= WIRE_DATA;
    if ((message_flags & MSG_TRUNC) || !(classic || fd)) return 0;
    if (classic) frame->flags = 0;
    memset(frame->reserved, 0, sizeof(frame->reserved));
    memset(frame->data + frame->len, 0, (size_t)(WIRE_DATA - frame->len));
    return 1;
}

static void note_failure(wire_link *link, int error) {
    if (error == EAGAIN || error == EWOULDBLOCK) return;
    link->error = error;
    if (error == ECONNRESET || error == EPIPE || error == ENOTCONN || error == EBADF || error == ENODEV) {
        link->closed = 1;
    }
}

/* Packets of a frame each. */
static void receive_single(int fd, wire_frames *frames, wire_link *link) {
    struct mmsghdr messages[BATCH];
    control controls[BATCH];
    int taken = 0; /* datagrams, frames or not: a flood of others must not hold us here */
    while (!link->closed && taken < frames->capacity) {
        const int room = frames->capacity - taken;
        const int asked = room < BATCH ? room : BATCH;
        wire_frame *const batch = &frames->frame[frames->count];
        const int got = receive_batch(fd, batch, asked, messages, controls);
        if (got < 0) {
            note_failure(link, errno);
            break;
        }
        int kept = 0;
        for (int i = 0; i < got && !link->closed; i++) {
            if (messages[i].msg_len == 0) { /* end of file */
                link->closed = 1;
            } else if (is_frame(&batch[i], messages[i].msg_len, messages[i].msg_hdr.msg_flags)) {
                if (kept != i) batch[kept] = batch[i];
                note_time(link, &batch[kept++], &messages[i].msg_hdr);
            } else {
                link->malformed++;
            }
        }
        frames->count += kept;
        taken += got;
        if (got < asked) break;
    }
}

/* Packets of several frames each. */
static void receive_batches(int fd, wire_frames *frames, wire_link *link) {
    for (int taken = 0; taken < frames->capacity && frames->count < frames->capacity; taken++) {
        wire_frame *const batch = &frames->frame[frames->count];
        const size_t room = FD_SIZE * (size_t)(frames->capacity - frames->count);
        if (frames->count > 0) { /* a packet that does not fit any more stays for the next call */
            const ssize_t next = recv(fd, NULL, 0, MSG_DONTWAIT | MSG_PEEK | MSG_TRUNC);
            if (next < 0) note_failure(link, errno);
            if (next < 0 || (size_t)next > room) return;
        }
        struct iovec vector = {.iov_base = batch, .iov_len = room};
        control arrival;
        struct msghdr message = {
            .msg_iov = &vector, .msg_iovlen = 1, .msg_control = &arrival, .msg_controllen = sizeof(arrival)};
        const ssize_t size = recvmsg(fd, &message, MSG_DONTWAIT | MSG_TRUNC);
        if (size < 0) {
            if (errno == EINTR) continue;
            note_failure(link, errno);
            return;
        }
        if (size == 0) { /* end of file */
            link->closed = 1;
            return;
        }
        const int classic = size == CLASSIC_SIZE;
        if ((size_t)size > room || (size % FD_SIZE != 0 && !classic)) {
            link->malformed++;
            continue;
        }
        const int count = classic ? 1 : (int)(size / FD_SIZE);
        int kept = 0;
        for (int i = 0; i < count; i++) {
            if (!is_frame(&batch[i], classic ? CLASSIC_SIZE : FD_SIZE, 0)) {
                link->malformed++;
                continue;
            }
            if (kept != i) batch[kept] = batch[i];
            note_time(link, &batch[kept++], &message);
        }
        frames->count += kept;
    }
}

int32_t wire_receive(int32_t fd, wire_frames *frames, wire_link *link) {
    frames->count = 0;
    link->time_ns = 0;
    if (link->batched) {
        receive_batches(fd, frames, link);
    } else {
        receive_single(fd, frames, link);
    }
    return frames->count == 0 && link->closed ? WIRE_CLOSED : frames->count;
}

/* One system call: up to `count` frames. Returns the number sent, or -1 with errno set. */
static int send_batch(int fd, const wire_frame *frames, int count) {
    struct mmsghdr messages[BATCH];
    struct iovec vectors[BATCH];
    memset(messages, 0, sizeof(*messages) * (size_t)count);
    for (int i = 0; i < count; i++) {
        vectors[i] = (struct iovec){.iov_base = (void *)&frames[i], .iov_len = FD_SIZE};
        messages[i].msg_hdr.msg_iov = &vectors[i];
        messages[i].msg_hdr.msg_iovlen = 1;
    }
    int sent;
    do {
        sent = sendmmsg(fd, messages, (unsigned)count, MSG_DONTWAIT | MSG_NOSIGNAL);
    } while (sent < 0 && errno == EINTR);
    return sent;
}

/* All frames in one packet. Returns how many were sent. */
static int send_whole(int fd, const wire_frames *frames, wire_link *link) {
    if (link->closed || frames->count == 0) return 0;
    ssize_t sent;
    do {
        sent = send(fd, frames->frame, FD_SIZE * (size_t)frames->count, MSG_DONTWAIT | MSG_NOSIGNAL);
    } while (sent < 0 && errno == EINTR);
    if (sent < 0) note_failure(link, errno);
    return sent < 0 ? 0 : frames->count;
}

/* A frame in each packet. Returns how many were sent. */
static int send_single(int fd, const wire_frames *frames, wire_link *link) {
    int done = 0;
    while (!link->closed && done < frames->count) {
        const int left = frames->count - done;
        const int sent = send_batch(fd, &frames->frame[done], left < BATCH ? left : BATCH);
        if (sent < 0) {
            note_failure(link, errno);
            break;
        }
        done += sent;
    }
    return done;
}

int32_t wire_send(int32_t fd, const wire_frames *frames, wire_link *link) {
    const int done = link->batched ? send_whole(fd, frames, link) : send_single(fd, frames, link);
    link->unsent += frames->count - done;
    return done;
}

int32_t wire_append(wire_frames *frames, uint32_t id, const uint8_t *data, int32_t len) {
    if (len < 0 || len > WIRE_DATA) return WIRE_BAD_LENGTH;
    if (frames->count >= frames->capacity) return WIRE_FULL;
    wire_frame *const frame = &frames->frame[frames->count++];
    memset(frame, 0, sizeof(*frame));
    frame->id = id;
    frame->len = (uint8_t)len;
    frame->flags = WIRE_FLAG_BRS;
    if (len > 0) memcpy(frame->data, data, (size_t)len);
    return 0;
}

int32_t wire_extend(wire_frames *to, const wire_frames *from, int32_t first) {
    const int32_t more = from->count - first;
    if (to->capacity - to->count < more) return WIRE_FULL;
    memcpy(&to->frame[to->count], &from->frame[first], sizeof(wire_frame) * (size_t)more);
    to->count += more;
    return 0;
}

int32_t wire_take(wire_frames *to, wire_frames *from) {
    const int32_t count = from->count;
    if (count > to->capacity) return WIRE_FULL;
    memcpy(to->frame, from->frame, (size_t)count * sizeof(wire_frame));
    to->count = count;
    from->count = 0;
    return count;
}

int32_t wire_count(const wire_frames *frames, uint32_t first, uint32_t last) {
    int32_t count = 0;
    for (int i = 0; i < frames->count; i++) {
        count += frames->frame[i].id >= first && frames->frame[i].id <= last;
    }
    return count;
}

int32_t wire_pack(const wire_frames *frames, uint8_t *out) {
    uint8_t *at = out;
    for (int i = 0; i < frames->count; i++) {
        const wire_frame *const frame = &frames->frame[i];
        memcpy(at, &frame->id, 4);
        at[4] = frame->len;
        at[5] = frame->flags;
        memcpy(at + PACKED_HEADER, frame->data, frame->len);
        at += PACKED_HEADER + frame->len;
    }
    return (int32_t)(at - out);
}

int32_t wire_unpack(wire_frames *frames, const uint8_t *packed, int32_t size) {
    int32_t used = 0;
    int32_t count = 0;
    frames->count = 0;
    while (used < size) {
        if (count == frames->capacity) return WIRE_FULL;
        if (size - used < PACKED_HEADER) return WIRE_TRUNCATED;
        const uint8_t *const at = packed + used;
        const uint8_t len = at[4];
        if (len > WIRE_DATA) return WIRE_BAD_LENGTH;
        if (size - used - PACKED_HEADER < len) return WIRE_TRUNCATED;
        wire_frame *const frame = &frames->frame[count++];
        memset(frame, 0, sizeof(*frame));
        memcpy(&frame->id, at, 4);
        frame->len = len;
        frame->flags = at[5];
        memcpy(frame->data, at + PACKED_HEADER, len);
        used += PACKED_HEADER + len;
    }
    frames->count = count;
    return count;
}
