#include "rt.h"

#include <errno.h>
#include <signal.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

static const int64_t SECOND = 1000000000;

static struct timespec to_timespec(int64_t ns) {
    return (struct timespec){.tv_sec = (time_t)(ns / SECOND), .tv_nsec = (long)(ns % SECOND)};
}

int64_t rt_now(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * SECOND + now.tv_nsec;
}

int rt_timer_open(int64_t first_ns, int64_t period_ns) {
    const int fd = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
    if (fd < 0) return -errno;
    const int error = rt_timer_set(fd, first_ns, period_ns);
    if (error) close(fd);
    return error ? error : fd;
}

int rt_timer_set(int fd, int64_t first_ns, int64_t period_ns) {
    const struct itimerspec grid = {.it_interval = to_timespec(period_ns), .it_value = to_timespec(first_ns)};
    return timerfd_settime(fd, TFD_TIMER_ABSTIME, &grid, NULL) < 0 ? -errno : 0;
}

int64_t rt_timer_read(int fd) {
    uint64_t expirations;
    if (read(fd, &expirations, sizeof expirations) == (ssize_t)sizeof expirations)
        return (int64_t)expirations;
    return errno == EAGAIN ? 0 : -errno;
}

int rt_lock_memory(void) {
    return mlockall(MCL_CURRENT | MCL_FUTURE) < 0 ? -errno : 0;
}

int rt_die_with_parent(int number, int parent) {
    if (prctl(PR_SET_PDEATHSIG, (unsigned long)number) < 0) return -errno;
    return getppid() != parent && raise(number) != 0 ? -errno : 0;
}

int64_t rt_spin(int64_t until_ns) {
    int64_t now;
    do {
        now = rt_now();
    } while (now < until_ns);
    return now;
}

int64_t rt_stages_begin(rt_stages *s) {
    for (int i = 0; i < RT_STAGES - 1; i++) s->ns[i] = 0;
    s->begin = s->last = rt_now();
    return s->begin;
}

void rt_stages_mark(rt_stages *s, int stage) {
    const int64_t now = rt_now();
    if (stage == RT_STAGES - 1) s->ns[stage] = 0;
    if (stage >= 0 && stage < RT_STAGES) s->ns[stage] += (uint32_t)(now - s->last);
    s->last = now;
}

void rt_usage_read(rt_usage *usage) {
    struct rusage r;
    getrusage(RUSAGE_THREAD, &r);
    *usage = (rt_usage){r.ru_minflt, r.ru_majflt, r.ru_nivcsw};
}

/* Values below RT_STEPS have a bucket each; above, an octave [2^k, 2^(k+1)) has RT_STEPS / 2 new ones. */
static int bucket_of(int64_t ns) {
    if (ns < RT_STEPS) return ns > 0 ? (int)ns : 0;
    const int top = 63 - __builtin_clzll((unsigned long long)ns); /* >= 6 */
    const int shift = top - 5;
    const int bucket = shift * (RT_STEPS / 2) + (int)(ns >> shift);
    return bucket < RT_OCTAVES * RT_STEPS ? bucket : RT_OCTAVES * RT_STEPS - 1;
}

int64_t rt_histogram_edge(int bucket) {
    if (bucket < RT_STEPS) return bucket;
    const int shift = bucket / (RT_STEPS / 2) - 1;
    const int64_t mantissa = bucket - shift * (RT_STEPS / 2);
    return ((mantissa + 1) << shift) - 1;
}

void rt_histogram_add(rt_histogram *h, int64_t ns) {
    if (ns < 0) ns = 0;
    h->count++;
    h->sum += ns;
    if (ns > h->largest) h->largest = ns;
    h->bucket[bucket_of(ns)]++;
}

void rt_histogram_add_each(rt_histogram *h, int n, const uint8_t *ns) {
    for (int i = 0; i < n; i++) {
        uint32_t one;
        memcpy(&one, ns + (size_t)i * sizeof(one), sizeof(one));
        rt_histogram_add(&h[i], one);
    }
}

int64_t rt_histogram_quantile(const rt_histogram *h, double q) {
    const double wanted = q * (double)h->count;
    int64_t seen = 0;
    for (int i = 0; i < RT_OCTAVES * RT_STEPS; i++) {
        seen += h->bucket[i];
        if (seen > 0 && (double)seen >= wanted) {
            const int64_t edge = rt_histogram_edge(i);
            return edge < h->largest ? edge : h->largest;
        }
    }
    return h->largest;
}

int64_t rt_nanosleep_loop(int64_t period_ns, int64_t ticks, rt_histogram *h) {
    int64_t deadline = rt_now() + period_ns, missed = 0;
    for (int64_t k = 0; k < ticks; k++, deadline += period_ns) {
        const struct timespec until = to_timespec(deadline);
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL) == EINTR) {
        }
        const int64_t late = rt_now() - deadline;
        rt_histogram_add(h, late);
        for (int64_t skipped = late / period_ns; skipped > 0 && k + 1 < ticks; skipped--, k++) {
            missed++;
            deadline += period_ns;
        }
    }
    return missed;
}
