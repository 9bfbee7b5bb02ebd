/* SPDX-License-Identifier: BSD-3-Clause */
/* How the foot of a point above a surface moves with that point: dS = J dp, symmetric, zero along
 * the normal. With I and II the fundamental forms of a parameter (II_ij = S_ij . n) and s the
 * distance, J = S_i (I - s II)^-1_ij S_j: infinite in a focal point. */
#ifndef SHCDI_FOOT_MOTION_H
#define SHCDI_FOOT_MOTION_H

#include "model/model.h"

#include <stdbool.h>

/** The larger of s k for both curvatures k of II by I: 1 in a focal point. */
static inline double shcdi_foot_nearness(double s, const double one[3], const double two[3]) {
    const double det = one[0] * one[2] - one[1] * one[1];
    const double mean = 0.5 * (two[0] * one[2] - 2.0 * two[1] * one[1] + two[2] * one[0]) / det;
    const double gauss = (two[0] * two[2] - two[1] * two[1]) / det;
    const double half = sqrt(shcdi_max(0.0, mean * mean - gauss));
    return shcdi_max(s * (mean + half), s * (mean - half));
}

/** The surface at a foot. */
typedef struct shcdi_foot_frame {
    shcdi_jet jet;
    double one[3], two[3]; /* I and II */
    double m[3];           /* I - s II, s no more than keeps 1 - s k above 1/2 */
    double turning; /* share of H that counts: where s k exceeds 1/2 it fades, to none at 1 */
} shcdi_foot_frame;

/** @return whether there is a tangent plane */
static inline bool shcdi_foot_frame_at(const shcdi_series *series, shcd_vec3 parameter, shcd_vec3 n,
                                       double s, shcdi_foot_frame *f) {
    shcdi_surface_jet(series, series->degree, parameter, &f->jet);
    const double one[3] = {shcd_dot(f->jet.s1, f->jet.s1), shcd_dot(f->jet.s1, f->jet.s2),
                           shcd_dot(f->jet.s2, f->jet.s2)};
    const double two[3] = {shcd_dot(f->jet.s11, n), shcd_dot(f->jet.s12, n),
                           shcd_dot(f->jet.s22, n)};
    if (!(one[0] * one[2] - one[1] * one[1] > 1e-12 * one[0] * one[2])) {
        return false;
    }
    const double near = shcdi_foot_nearness(s, one, two);
    const double b = near > 0.5 ? s * (0.5 / near) : s;
    const double left = 2.0 * shcdi_max(0.0, 1.0 - shcdi_max(0.5, near));
    f->turning = left * left;
    for (int i = 0; i < 3; i++) {
        f->one[i] = one[i];
        f->two[i] = two[i];
        f->m[i] = one[i] - b * two[i];
    }
    return true;
}

/** (x, y) of m (x, y) = (h1, h2). */
static inline void shcdi_foot_solve(const double m[3], double h1, double h2, double *x, double *y) {
    const double det = m[0] * m[2] - m[1] * m[1];
    *x = (m[2] * h1 - m[1] * h2) / det;
    *y = (m[0] * h2 - m[1] * h1) / det;
}

/** J u, and with it how far along t1 and t2 the parameter moves. */
static inline shcd_vec3 shcdi_foot_frame_motion(const shcdi_foot_frame *f, shcd_vec3 u, double *a1,
                                                double *a2) {
    shcdi_foot_solve(f->m, shcd_dot(u, f->jet.s1), shcd_dot(u, f->jet.s2), a1, a2);
    return shcd_add(shcd_scale(*a1, f->jet.s1), shcd_scale(*a2, f->jet.s2));
}

/** H u, fading: how the normal turns. */
static inline shcd_vec3 shcdi_foot_frame_turn(const shcdi_foot_frame *f, shcd_vec3 u) {
    double c1, c2, a1, a2;
    shcdi_foot_solve(f->one, shcd_dot(u, f->jet.s1), shcd_dot(u, f->jet.s2), &c1, &c2);
    shcdi_foot_solve(f->m, f->two[0] * c1 + f->two[1] * c2, f->two[1] * c1 + f->two[2] * c2, &a1,
                     &a2);
    return shcd_scale(-f->turning, shcd_add(shcd_scale(a1, f->jet.s1), shcd_scale(a2, f->jet.s2)));
}

/** J u at the foot of a parameter, s bounded; of u's flat part where the surface has no tangent
 *  plane, that part itself. */
static inline shcd_vec3 shcdi_foot_motion(const shcdi_series *series, shcd_vec3 parameter,
                                          shcd_vec3 n, double s, shcd_vec3 u) {
    shcdi_foot_frame f;
    double a1, a2;
    return shcdi_foot_frame_at(series, parameter, n, s, &f)
               ? shcdi_foot_frame_motion(&f, u, &a1, &a2)
               : shcd_mul_add(u, -shcd_dot(u, n), n);
}

/** How the normal at the foot turns as the point moves by u: H u, H = (1 - n n^T - J)/s, written
 *  as -S_i ((I - s II)^-1 II I^-1)_ij S_j, which holds on the surface and behind it, too. Fades
 *  towards a focal point; zero where the surface has no tangent plane. */
static inline shcd_vec3 shcdi_foot_turn(const shcdi_series *series, shcd_vec3 parameter,
                                        shcd_vec3 n, double s, shcd_vec3 u) {
    const shcd_vec3 none = {0.0, 0.0, 0.0};
    shcdi_foot_frame f;
    return shcdi_foot_frame_at(series, parameter, n, s, &f) ? shcdi_foot_frame_turn(&f, u) : none;
}

#endif
