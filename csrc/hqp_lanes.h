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

/* With AVX2 one vector, else two pairs, which each x86-64 and ARM64 has; of more digits there are no vectors.
 */
#ifdef HQP_EXTENDED
typedef struct hqp_four {
    real a, b, c, d;
} hqp_four;
enum { HQP_ROWS_AT_ONCE = 1 };

static inline hqp_four hqp_no_four(void) {
    return (hqp_four){0.0, 0.0, 0.0, 0.0};
}
static inline hqp_four hqp_load_four(const real *a) {
    return (hqp_four){a[0], a[1], a[2], a[3]};
}
static inline void hqp_store_four(real *a, hqp_four b) {
    a[0] = b.a;
    a[1] = b.b;
    a[2] = b.c;
    a[3] = b.d;
}
static inline hqp_four hqp_plus(hqp_four a, hqp_four b) {
    return (hqp_four){a.a + b.a, a.b + b.b, a.c + b.c, a.d + b.d};
}
static inline hqp_four hqp_minus(hqp_four a, hqp_four b) {
    return (hqp_four){a.a - b.a, a.b - b.b, a.c - b.c, a.d - b.d};
}
static inline hqp_four hqp_product(hqp_four a, hqp_four b) {
    return (hqp_four){a.a * b.a, a.b * b.b, a.c * b.c, a.d * b.d};
}
static inline hqp_four hqp_scaled(real t, hqp_four a) {
    return (hqp_four){t * a.a, t * a.b, t * a.c, t * a.d};
}
static inline real hqp_total(hqp_four a) {
    return (a.a + a.b) + (a.c + a.d);
}
#elif defined __AVX2__
typedef real hqp_four __attribute__((vector_size(32), may_alias));
enum { HQP_ROWS_AT_ONCE = 2 };

static inline hqp_four hqp_no_four(void) {
    return (hqp_four){0.0, 0.0, 0.0, 0.0};
}
static inline hqp_four hqp_load_four(const real *a) {
    return *(const hqp_four *)a;
}
static inline void hqp_store_four(real *a, hqp_four b) {
    *(hqp_four *)a = b;
}
static inline hqp_four hqp_plus(hqp_four a, hqp_four b) {
    return a + b;
}
static inline hqp_four hqp_minus(hqp_four a, hqp_four b) {
    return a - b;
}
static inline hqp_four hqp_product(hqp_four a, hqp_four b) {
    return a * b;
}
static inline hqp_four hqp_scaled(real t, hqp_four a) {
    return t * a;
}
static inline real hqp_total(hqp_four a) {
    return (a[0] + a[1]) + (a[2] + a[3]);
}
#else
typedef real hqp_pair __attribute__((vector_size(16), may_alias));
typedef struct hqp_four {
    hqp_pair low, high;
} hqp_four;
enum { HQP_ROWS_AT_ONCE = 1 }; /* for two there are too few registers */

static inline hqp_four hqp_no_four(void) {
    return (hqp_four){{0.0, 0.0}, {0.0, 0.0}};
}
static inline hqp_four hqp_load_four(const real *a) {
    return (hqp_four){*(const hqp_pair *)a, *(const hqp_pair *)(a + 2)};
}
static inline void hqp_store_four(real *a, hqp_four b) {
    *(hqp_pair *)a = b.low;
    *(hqp_pair *)(a + 2) = b.high;
}
static inline hqp_four hqp_plus(hqp_four a, hqp_four b) {
    return (hqp_four){a.low + b.low, a.high + b.high};
}
static inline hqp_four hqp_minus(hqp_four a, hqp_four b) {
    return (hqp_four){a.low - b.low, a.high - b.high};
}
static inline hqp_four hqp_product(hqp_four a, hqp_four b) {
    return (hqp_four){a.low * b.low, a.high * b.high};
}
static inline hqp_four hqp_scaled(real t, hqp_four a) {
    return (hqp_four){t * a.low, t * a.high};
}
static inline real hqp_total(hqp_four a) {
    return (a.low[0] + a.low[1]) + (a.high[0] + a.high[1]);
}
#endif

/* sum + a b */
static inline hqp_four hqp_with_product(hqp_four sum, hqp_four a, hqp_four b) {
    return hqp_plus(sum, hqp_product(a, b));
}

/* sum a_i b_i over [from, to), multiples of 4, aligned */
static inline real hqp_dot(const real *a, const real *b, int from, int to) {
    hqp_four sum = hqp_no_four(), next = sum;
    int i = from;
    for (; i + 8 <= to; i += 8) {
        sum = hqp_with_product(sum, hqp_load_four(a + i), hqp_load_four(b + i));
        next = hqp_with_product(next, hqp_load_four(a + i + 4), hqp_load_four(b + i + 4));
    }
    if (i < to) sum = hqp_with_product(sum, hqp_load_four(a + i), hqp_load_four(b + i));
    return hqp_total(hqp_plus(sum, next));
}

/* a += t b over [from, to), multiples of 4, aligned */
static inline void hqp_axpy(real *a, real t, const real *b, int from, int to) {
    for (int i = from; i < to; i += 4)
        hqp_store_four(a + i, hqp_plus(hqp_load_four(a + i), hqp_scaled(t, hqp_load_four(b + i))));
}

/* row -= (row . v) v over [from, to) for four rows at once: the loads of v are shared and the sums do not
 * wait for each other */
static inline void hqp_reflect_four(real *const rows[4], const real *v, int from, int to) {
    hqp_four sum[4] = {hqp_no_four(), hqp_no_four(), hqp_no_four(), hqp_no_four()};
    for (int i = from; i < to; i += 4) {
        const hqp_four vi = hqp_load_four(v + i);
        for (int r = 0; r < 4; r++) sum[r] = hqp_with_product(sum[r], hqp_load_four(rows[r] + i), vi);
    }
    const real t[4] = {hqp_total(sum[0]), hqp_total(sum[1]), hqp_total(sum[2]), hqp_total(sum[3])};
    for (int i = from; i < to; i += 4) {
        const hqp_four vi = hqp_load_four(v + i);
        for (int r = 0; r < 4; r++)
            hqp_store_four(rows[r] + i, hqp_minus(hqp_load_four(rows[r] + i), hqp_scaled(t[r], vi)));
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
typedef real hqp_loose __attribute__((vector_size(16), aligned(8), may_alias));

static inline real hqp_inner(const real *a, const real *b, int count) {
    hqp_loose low = {0.0, 0.0}, high = {0.0, 0.0};
    real rest = 0.0;
    int i = 0;
    for (; i + 4 <= count; i += 4) {
        low += *(const hqp_loose *)(a + i) * *(const hqp_loose *)(b + i);
        high += *(const hqp_loose *)(a + i + 2) * *(const hqp_loose *)(b + i + 2);
    }
    for (; i < count; i++) rest += a[i] * b[i];
    return (low[0] + low[1]) + (high[0] + high[1]) + rest;
}

static inline void hqp_add(real *a, real t, const real *b, int count) {
    int i = 0;
    for (; i + 2 <= count; i += 2) *(hqp_loose *)(a + i) += t * *(const hqp_loose *)(b + i);
    if (i < count) a[i] += t * b[i];
}
#endif

#endif
