/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  Inline 3-vectors, quaternions and poses. Header only: it adds nothing to the ABI.
 */
#ifndef SHCD_VEC_H
#define SHCD_VEC_H

#include "shcd/base.h"

#include <math.h>

#ifdef __cplusplus
extern "C" {
#endif

static inline shcd_vec3 shcd_vec3_make(double x, double y, double z) {
    shcd_vec3 r;
    r.x = x;
    r.y = y;
    r.z = z;
    return r;
}

static inline shcd_vec3 shcd_add(shcd_vec3 a, shcd_vec3 b) {
    return shcd_vec3_make(a.x + b.x, a.y + b.y, a.z + b.z);
}

static inline shcd_vec3 shcd_sub(shcd_vec3 a, shcd_vec3 b) {
    return shcd_vec3_make(a.x - b.x, a.y - b.y, a.z - b.z);
}

static inline shcd_vec3 shcd_scale(double s, shcd_vec3 a) {
    return shcd_vec3_make(s * a.x, s * a.y, s * a.z);
}

/** a + s b */
static inline shcd_vec3 shcd_mul_add(shcd_vec3 a, double s, shcd_vec3 b) {
    return shcd_vec3_make(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}

static inline double shcd_dot(shcd_vec3 a, shcd_vec3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline shcd_vec3 shcd_cross(shcd_vec3 a, shcd_vec3 b) {
    return shcd_vec3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

static inline double shcd_norm(shcd_vec3 a) {
    return sqrt(shcd_dot(a, a));
}

/** a / |a|; the zero vector gives zero. */
static inline shcd_vec3 shcd_unit(shcd_vec3 a) {
    const double n = shcd_norm(a);
    return n > 0.0 ? shcd_scale(1.0 / n, a) : a;
}

static inline int shcd_vec3_is_finite(shcd_vec3 a) {
    /* x - x is 0 for finite x and NaN otherwise; no libm call, so usable in a tick */
    return a.x - a.x == 0.0 && a.y - a.y == 0.0 && a.z - a.z == 0.0;
}

/** R(q) v for a unit quaternion. */
static inline shcd_vec3 shcd_rotate(shcd_quat q, shcd_vec3 v) {
    const shcd_vec3 u = shcd_vec3_make(q.x, q.y, q.z);
    const shcd_vec3 t = shcd_scale(2.0, shcd_cross(u, v));
    return shcd_add(shcd_mul_add(v, q.w, t), shcd_cross(u, t));
}

static inline shcd_quat shcd_conjugate(shcd_quat q) {
    shcd_quat r;
    r.w = q.w;
    r.x = -q.x;
    r.y = -q.y;
    r.z = -q.z;
    return r;
}

/** A point of the inner frame, expressed in the outer frame. */
static inline shcd_vec3 shcd_transform(shcd_pose inner_in_outer, shcd_vec3 p) {
    return shcd_add(inner_in_outer.position_m, shcd_rotate(inner_in_outer.orientation, p));
}

/** A point of the outer frame, expressed in the inner frame. */
static inline shcd_vec3 shcd_transform_inverse(shcd_pose inner_in_outer, shcd_vec3 p) {
    return shcd_rotate(shcd_conjugate(inner_in_outer.orientation),
                       shcd_sub(p, inner_in_outer.position_m));
}

#ifdef __cplusplus
}
#endif
#endif
