/* SPDX-License-Identifier: BSD-3-Clause */
/* How the foot of a point above a surface moves with that point: dS = J dp, symmetric, zero along
 * the normal. With I and II the fundamental forms of a parameter (II_ij = S_ij . n) and s the
 * distance, J = S_i (I - s II)^-1_ij S_j: infinite in a focal point. */
#ifndef SHCDI_FOOT_MOTION_H
#define SHCDI_FOOT_MOTION_H

#include "model/model.h"

/** s, or as much of it as keeps 1 - s k above 1/2 for both curvatures k of II by I. */
static inline double shcdi_foot_bounded(double s, const double one[3], const double two[3]) {
    const double det = one[0] * one[2] - one[1] * one[1];
    const double mean = 0.5 * (two[0] * one[2] - 2.0 * two[1] * one[1] + two[2] * one[0]) / det;
    const double gauss = (two[0] * two[2] - two[1] * two[1]) / det;
    const double half = sqrt(shcdi_max(0.0, mean * mean - gauss));
    const double worst = shcdi_max(s * (mean + half), s * (mean - half));
    return worst > 0.5 ? s * (0.5 / worst) : s;
}

/** J u at the foot of a parameter, s bounded; of u's flat part where the surface has no tangent
 *  plane, that part itself.
 *  @param[out] bounded_m  s as it was used */
static inline shcd_vec3 shcdi_foot_motion(const shcd_model *model, shcd_vec3 parameter, shcd_vec3 n,
                                          double s, shcd_vec3 u, double *bounded_m) {
    const shcd_vec3 flat = shcd_mul_add(u, -shcd_dot(u, n), n);
    shcdi_jet jet;
    shcdi_surface_jet(&model->series, model->degree, parameter, &jet);
    const double one[3] = {shcd_dot(jet.s1, jet.s1), shcd_dot(jet.s1, jet.s2),
                           shcd_dot(jet.s2, jet.s2)};
    const double det_one = one[0] * one[2] - one[1] * one[1];
    *bounded_m = s;
    if (!(det_one > 1e-12 * one[0] * one[2])) {
        return flat;
    }
    const double two[3] = {shcd_dot(jet.s11, n), shcd_dot(jet.s12, n), shcd_dot(jet.s22, n)};
    const double b = *bounded_m = shcdi_foot_bounded(s, one, two);
    const double m[3] = {one[0] - b * two[0], one[1] - b * two[1], one[2] - b * two[2]};
    const double det = m[0] * m[2] - m[1] * m[1];
    const double h1 = shcd_dot(u, jet.s1), h2 = shcd_dot(u, jet.s2);
    const double a1 = (m[2] * h1 - m[1] * h2) / det, a2 = (m[0] * h2 - m[1] * h1) / det;
    return shcd_add(shcd_scale(a1, jet.s1), shcd_scale(a2, jet.s2));
}

#endif
