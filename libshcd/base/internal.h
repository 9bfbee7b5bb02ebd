/* SPDX-License-Identifier: BSD-3-Clause */
/* Errors, allocation and assertions shared by the library's own files. */
#ifndef SHCDI_BASE_INTERNAL_H
#define SHCDI_BASE_INTERNAL_H

#include "shcd/base.h"
#include "shcd/vec.h"

#include <stddef.h>

#ifdef SHCD_ENABLE_ASSERT
#include <assert.h>
#define SHCD_ASSERT(condition) assert(condition)
#else
#define SHCD_ASSERT(condition) ((void)0)
#endif

/** Fills the caller's error, if there is one, and returns the status. Not RT safe. */
shcd_status shcdi_fail(shcd_error *error, shcd_status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/** A copy of the given allocator, or malloc and free. */
shcd_allocator shcdi_allocator(const shcd_allocator *given);

static inline double shcdi_min(double a, double b) {
    return a < b ? a : b;
}
static inline double shcdi_max(double a, double b) {
    return a > b ? a : b;
}
static inline int shcdi_is_finite(double a) {
    return a - a == 0.0;
}

/** A number that will be reported or kept: tiny ones are zero, so that a processor that flushes
 *  denormal numbers gives the same bits as one that does not. Nothing in SI units is that small. */
static inline double shcdi_flushed(double a) {
    return fabs(a) < 1e-200 ? 0.0 : a;
}
static inline shcd_vec3 shcdi_flushed3(shcd_vec3 a) {
    return shcd_vec3_make(shcdi_flushed(a.x), shcdi_flushed(a.y), shcdi_flushed(a.z));
}

/** Right-handed orthonormal tangent frame t1 x t2 = w of a unit vector, without a branch cut at the
 *  poles (Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1), 2017). */
static inline void shcdi_tangent_frame(shcd_vec3 w, shcd_vec3 *t1, shcd_vec3 *t2) {
    const double s = w.z >= 0.0 ? 1.0 : -1.0;
    const double a = -1.0 / (s + w.z);
    const double b = w.x * w.y * a;
    *t1 = shcd_vec3_make(1.0 + s * w.x * w.x * a, s * b, -s * w.x);
    *t2 = shcd_vec3_make(b, s + w.y * w.y * a, -w.y);
}

#endif
