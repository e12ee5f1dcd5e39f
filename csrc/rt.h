/* Real-time helpers: an absolute periodic timer, a log-linear histogram, process settings. */
#ifndef HAPTICD_RT_H
#define HAPTICD_RT_H

#include <stdint.h>

/* Nanoseconds of CLOCK_MONOTONIC. */
int64_t rt_now(void);

/* A non-blocking timerfd on the grid first_ns + k period_ns; returns the descriptor or -errno. */
int rt_timer_open(int64_t first_ns, int64_t period_ns);

/* Puts an open timer on another grid; 0 or -errno. */
int rt_timer_set(int fd, int64_t first_ns, int64_t period_ns);

/* Expirations since the last read, 0 where there was none, or -errno. */
int64_t rt_timer_read(int fd);

/* mlockall(MCL_CURRENT | MCL_FUTURE); 0 or -errno. */
int rt_lock_memory(void);

/* The calling process gets `number` when its parent is gone, even where `parent` died before this call;
 * it stays so across exec. 0 or -errno. */
int rt_die_with_parent(int number, int parent);

/* Waits, busy, until CLOCK_MONOTONIC reaches `until_ns`; returns the time then. */
int64_t rt_spin(int64_t until_ns);

/* Where the time of a tick goes. Each mark gives the time since the last one to a stage. */
enum { RT_STAGES = 11 };
typedef struct {
    int64_t begin, last;
    uint32_t ns[11]; /* RT_STAGES */
} rt_stages;

/* Starts a tick and returns the time; the last stage keeps its duration, for it ends after it was logged. */
int64_t rt_stages_begin(rt_stages *s);
void rt_stages_mark(rt_stages *s, int stage);

/* What the kernel did to the calling thread so far. */
typedef struct {
    int64_t minor_faults, major_faults, preemptions; /* preemptions: involuntary context switches */
} rt_usage;

void rt_usage_read(rt_usage *usage);

/* Log-linear histogram of non-negative nanoseconds: 64 buckets an octave, 1.6 % wide. Zero is a valid
 * start. */
enum { RT_OCTAVES = 36, RT_STEPS = 64 };
typedef struct {
    int64_t count, sum, largest;
    uint32_t bucket[2304]; /* RT_OCTAVES * RT_STEPS */
} rt_histogram;

void rt_histogram_add(rt_histogram *h, int64_t ns);

/* One duration each into `n` histograms; `ns` are the bytes of as many uint32_t. */
void rt_histogram_add_each(rt_histogram *h, int n, const uint8_t *ns);

/* Upper edge of the bucket that holds the quantile q in [0, 1], never above the largest value; 0 if empty. */
int64_t rt_histogram_quantile(const rt_histogram *h, double q);

/* Upper edge of a bucket [ns]. */
int64_t rt_histogram_edge(int bucket);

/* A bare C loop on the same grid: clock_nanosleep(TIMER_ABSTIME) for `ticks` periods, lateness into `h`.
 * Returns how many deadlines were missed by a whole period. */
int64_t rt_nanosleep_loop(int64_t period_ns, int64_t ticks, rt_histogram *h);

#endif
