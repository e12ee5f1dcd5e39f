/* Products and sums of rows of numbers, four lanes at a time: the order of every sum is fixed by the source,
 * not by the machine. */
#ifndef HQP_LANES_H
#define HQP_LANES_H

#include <float.h>

#ifdef HQP_EXTENDED
typedef long double real;
#define HQP_EPSILON LDBL_EPSILON
#else
typedef double real;
#define HQP_EPSILON DBL_EPSILON
#endif

/* With AVX2 one vector, else two pairs, which each x86-64 and ARM64 has. Of more digits there are no vectors:
 * one lane leaves the sums of four rows in the eight registers. */
#ifdef HQP_EXTENDED
typedef real hqp_lanes;
enum { HQP_LANES = 1, HQP_ROWS_AT_ONCE = 1 };

static inline hqp_lanes hqp_no_lanes(void) {
    return 0.0;
}
static inline real hqp_total(hqp_lanes a) {
    return a;
}
#elif defined __AVX2__
typedef real hqp_lanes __attribute__((vector_size(32), may_alias));
typedef real hqp_loose __attribute__((vector_size(32), aligned(8), may_alias));
enum { HQP_LANES = 4, HQP_ROWS_AT_ONCE = 2 };

static inline hqp_lanes hqp_no_lanes(void) {
    return (hqp_lanes){0.0, 0.0, 0.0, 0.0};
}
static inline real hqp_total(hqp_lanes a) {
    return (a[0] + a[1]) + (a[2] + a[3]);
}
static inline hqp_lanes hqp_load_anywhere(const real *a) {
    return *(const hqp_loose *)a;
}
static inline void hqp_store_anywhere(real *a, hqp_lanes b) {
    *(hqp_loose *)a = b;
}
#endif

#if defined HQP_EXTENDED || defined __AVX2__
static inline hqp_lanes hqp_load(const real *a) {
    return *(const hqp_lanes *)a;
}
static inline void hqp_store(real *a, hqp_lanes b) {
    *(hqp_lanes *)a = b;
}
static inline hqp_lanes hqp_plus(hqp_lanes a, hqp_lanes b) {
    return a + b;
}
static inline hqp_lanes hqp_minus(hqp_lanes a, hqp_lanes b) {
    return a - b;
}
static inline hqp_lanes hqp_product(hqp_lanes a, hqp_lanes b) {
    return a * b;
}
static inline hqp_lanes hqp_scaled(real t, hqp_lanes a) {
    return t * a;
}
#else
typedef real hqp_pair __attribute__((vector_size(16), may_alias));
typedef real hqp_loose __attribute__((vector_size(16), aligned(8), may_alias));
typedef struct hqp_lanes {
    hqp_pair low, high;
} hqp_lanes;
enum { HQP_LANES = 4, HQP_ROWS_AT_ONCE = 1 }; /* for two there are too few registers */

static inline hqp_lanes hqp_no_lanes(void) {
    return (hqp_lanes){{0.0, 0.0}, {0.0, 0.0}};
}
static inline hqp_lanes hqp_load(const real *a) {
    return (hqp_lanes){*(const hqp_pair *)a, *(const hqp_pair *)(a + 2)};
}
static inline void hqp_store(real *a, hqp_lanes b) {
    *(hqp_pair *)a = b.low;
    *(hqp_pair *)(a + 2) = b.high;
}
static inline hqp_lanes hqp_load_anywhere(const real *a) {
    return (hqp_lanes){*(const hqp_loose *)a, *(const hqp_loose *)(a + 2)};
}
static inline void hqp_store_anywhere(real *a, hqp_lanes b) {
    *(hqp_loose *)a = b.low;
    *(hqp_loose *)(a + 2) = b.high;
}
static inline hqp_lanes hqp_plus(hqp_lanes a, hqp_lanes b) {
    return (hqp_lanes){a.low + b.low, a.high + b.high};
}
static inline hqp_lanes hqp_minus(hqp_lanes a, hqp_lanes b) {
    return (hqp_lanes){a.low - b.low, a.high - b.high};
}
static inline hqp_lanes hqp_product(hqp_lanes a, hqp_lanes b) {
    return (hqp_lanes){a.low * b.low, a.high * b.high};
}
static inline hqp_lanes hqp_scaled(real t, hqp_lanes a) {
    return (hqp_lanes){t * a.low, t * a.high};
}
static inline real hqp_total(hqp_lanes a) {
    return (a.low[0] + a.low[1]) + (a.high[0] + a.high[1]);
}
#endif

/* sum + a b */
static inline hqp_lanes hqp_with_product(hqp_lanes sum, hqp_lanes a, hqp_lanes b) {
    return hqp_plus(sum, hqp_product(a, b));
}

/* sum a_i b_i over [from, to), multiples of 4, aligned */
static inline real hqp_dot(const real *a, const real *b, int from, int to) {
    hqp_lanes sum = hqp_no_lanes(), next = sum;
    int i = from;
    for (; i + 2 * HQP_LANES <= to; i += 2 * HQP_LANES) {
        sum = hqp_with_product(sum, hqp_load(a + i), hqp_load(b + i));
        next = hqp_with_product(next, hqp_load(a + i + HQP_LANES), hqp_load(b + i + HQP_LANES));
    }
    if (i < to) sum = hqp_with_product(sum, hqp_load(a + i), hqp_load(b + i));
    return hqp_total(hqp_plus(sum, next));
}

/* a += t b over [from, to), multiples of 4, aligned */
static inline void hqp_axpy(real *a, real t, const real *b, int from, int to) {
    for (int i = from; i < to; i += HQP_LANES)
        hqp_store(a + i, hqp_plus(hqp_load(a + i), hqp_scaled(t, hqp_load(b + i))));
}

/* row -= (row . v) v over [from, to) for four rows at once: the loads of v are shared and the sums do not
 * wait for each other */
static inline void hqp_reflect_four(real *const rows[4], const real *v, int from, int to) {
    hqp_lanes sum[4] = {hqp_no_lanes(), hqp_no_lanes(), hqp_no_lanes(), hqp_no_lanes()};
    for (int i = from; i < to; i += HQP_LANES) {
        const hqp_lanes vi = hqp_load(v + i);
        for (int r = 0; r < 4; r++) sum[r] = hqp_with_product(sum[r], hqp_load(rows[r] + i), vi);
    }
    const real t[4] = {hqp_total(sum[0]), hqp_total(sum[1]), hqp_total(sum[2]), hqp_total(sum[3])};
    for (int i = from; i < to; i += HQP_LANES) {
        const hqp_lanes vi = hqp_load(v + i);
        for (int r = 0; r < 4; r++)
            hqp_store(rows[r] + i, hqp_minus(hqp_load(rows[r] + i), hqp_scaled(t[r], vi)));
    }
}

typedef struct hqp_four {
    const real *row[4];
} hqp_four;

/* out[0 .. 4) = four rows . a over [0, to), a multiple of 4, aligned */
static inline void hqp_dot_four(real *out, hqp_four of, const real *a, int to) {
    hqp_lanes sum[4] = {hqp_no_lanes(), hqp_no_lanes(), hqp_no_lanes(), hqp_no_lanes()};
    for (int j = 0; j < to; j += HQP_LANES) {
        const hqp_lanes aj = hqp_load(a + j);
        for (int i = 0; i < 4; i++) sum[i] = hqp_with_product(sum[i], hqp_load(of.row[i] + j), aj);
    }
    for (int i = 0; i < 4; i++) out[i] = hqp_total(sum[i]);
}

/* a -= t[0 .. 4) . four rows, over the same */
static inline void hqp_take_four(real *a, const real *t, hqp_four of, int to) {
    for (int j = 0; j < to; j += HQP_LANES) {
        const hqp_lanes left =
            hqp_plus(hqp_scaled(t[0], hqp_load(of.row[0] + j)), hqp_scaled(t[1], hqp_load(of.row[1] + j)));
        const hqp_lanes right =
            hqp_plus(hqp_scaled(t[2], hqp_load(of.row[2] + j)), hqp_scaled(t[3], hqp_load(of.row[3] + j)));
        hqp_store(a + j, hqp_minus(hqp_load(a + j), hqp_plus(left, right)));
    }
}

#ifdef HQP_EXTENDED
/* sum a_i b_i over [0, count), anywhere in memory */
static inline real hqp_inner(const real *a, const real *b, int count) {
    real even = 0.0, odd = 0.0;
    int i = 0;
    for (; i + 2 <= count; i += 2) {
        even += a[i] * b[i];
        odd += a[i + 1] * b[i + 1];
    }
    return i < count ? even + odd + a[i] * b[i] : even + odd;
}

/* a += t b over [0, count), anywhere in memory */
static inline void hqp_add(real *a, real t, const real *b, int count) {
    for (int i = 0; i < count; i++) a[i] += t * b[i];
}
#else
static inline real hqp_inner(const real *a, const real *b, int count) {
    hqp_lanes sum = hqp_no_lanes();
    real rest = 0.0;
    int i = 0;
    for (; i + HQP_LANES <= count; i += HQP_LANES)
        sum = hqp_with_product(sum, hqp_load_anywhere(a + i), hqp_load_anywhere(b + i));
    for (; i < count; i++) rest += a[i] * b[i];
    return hqp_total(sum) + rest;
}

static inline void hqp_add(real *a, real t, const real *b, int count) {
    int i = 0;
    for (; i + HQP_LANES <= count; i += HQP_LANES)
        hqp_store_anywhere(a + i,
                           hqp_plus(hqp_load_anywhere(a + i), hqp_scaled(t, hqp_load_anywhere(b + i))));
    for (; i < count; i++) a[i] += t * b[i];
}
#endif

#endif
