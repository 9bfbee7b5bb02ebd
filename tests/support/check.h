/* SPDX-License-Identifier: BSD-3-Clause */
/* What the packaged cmocka lacks: a comparison of doubles that prints both (its own casts to
 * float), a portable random generator, and the scale of the random tests. */
#ifndef SHCD_TESTS_CHECK_H
#define SHCD_TESTS_CHECK_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

/** SHCD_TEST_TOLERANCE_SCALE=0 makes every comparison fail and print its true residual. */
static inline double check_tolerance_scale(void) {
    const char *text = getenv("SHCD_TEST_TOLERANCE_SCALE");
    return text != NULL ? strtod(text, NULL) : 1.0;
}

#define assert_near(actual, expected, tolerance)                                                   \
    do {                                                                                           \
        const double a_ = (actual), e_ = (expected), t_ = (tolerance)*check_tolerance_scale();     \
        if (!(fabs(a_ - e_) <= t_)) {                                                              \
            fail_msg("%s = %.17g, expected %.17g, off by %.3g, tolerance %.3g", #actual, a_, e_,   \
                     fabs(a_ - e_), t_);                                                           \
        }                                                                                          \
    } while (0)

#define assert_at_most(actual, bound)                                                              \
    do {                                                                                           \
        const double a_ = (actual), b_ = (bound)*check_tolerance_scale();                          \
        if (!(a_ <= b_)) {                                                                         \
            fail_msg("%s = %.17g, bound %.17g", #actual, a_, b_);                                  \
        }                                                                                          \
    } while (0)

/** Number of random cases: n times SHCD_TEST_SCALE (1 by default), at least 1. */
static inline size_t check_scaled(size_t n) {
    const char *text = getenv("SHCD_TEST_SCALE");
    const double scale = text != NULL ? strtod(text, NULL) : 1.0;
    const double scaled = (double)n * (scale > 0.0 ? scale : 1.0);
    return scaled < 1.0 ? 1 : (size_t)scaled;
}

/** splitmix64: the same numbers on every platform. */
typedef struct check_random {
    uint64_t state;
} check_random;

static inline uint64_t check_random_bits(check_random *r) {
    uint64_t z = (r->state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/** Uniform in [low, high). */
static inline double check_uniform(check_random *r, double low, double high) {
    return low + (high - low) * ((double)(check_random_bits(r) >> 11) * 0x1p-53);
}

/** Standard normal (Box-Muller). */
static inline double check_normal(check_random *r) {
    const double u = 1.0 - check_uniform(r, 0.0, 1.0);
    return sqrt(-2.0 * log(u)) * cos(6.283185307179586 * check_uniform(r, 0.0, 1.0));
}

#endif
