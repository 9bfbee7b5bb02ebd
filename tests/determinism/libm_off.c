/* SPDX-License-Identifier: BSD-3-Clause */
/* A mathematics library that rounds differently: every result but zero is moved to a neighbouring
 * double, up, down, or by its own bits, as LIBM_OFF says. Linked in place of the real functions
 * (--wrap), it stands for another version of libm, of which accuracy within about one unit in the
 * last place is all that can be relied on. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifndef LIBM_OFF
#error "LIBM_OFF is 1 (up), -1 (down) or 0 (either, by the bits of the result)"
#endif

static double off(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    if (x != 0.0 && isfinite(x)) {
        const uint64_t mixed = (bits * 0x9e3779b97f4a7c15u) >> 62;
        bits += LIBM_OFF != 0 ? (uint64_t)(int64_t)LIBM_OFF : mixed % 3 - 1;
    }
    memcpy(&x, &bits, sizeof x);
    return x;
}

#define WRAP(name)                                                                                 \
    double __real_##name(double x);                                                                \
    double __wrap_##name(double x);                                                                \
    double __wrap_##name(double x) {                                                               \
        return off(__real_##name(x));                                                              \
    }

WRAP(sin)
WRAP(cos)
WRAP(tan)
WRAP(asin)
WRAP(acos)
WRAP(exp)

#define WRAP_TWO(name)                                                                             \
    double __real_##name(double x, double y);                                                      \
    double __wrap_##name(double x, double y);                                                      \
    double __wrap_##name(double x, double y) {                                                     \
        return off(__real_##name(x, y));                                                           \
    }

WRAP_TWO(atan2)
WRAP_TWO(pow)

/* the GNU pair that compilers make of a sine and a cosine of the same angle */
void __wrap_sincos(double x, double *sine, double *cosine);
void __wrap_sincos(double x, double *sine, double *cosine) {
    *sine = __wrap_sin(x);
    *cosine = __wrap_cos(x);
}
