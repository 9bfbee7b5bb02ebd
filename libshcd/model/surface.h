/* SPDX-License-Identifier: BSD-3-Clause */
/* Evaluation of S(w) = sum_i c_i Y_i(w), c_i in R^3, and of its derivatives on the unit sphere. The
 * only place that knows how coefficients are laid out for evaluation. */
#ifndef SHCDI_MODEL_SURFACE_H
#define SHCDI_MODEL_SURFACE_H

#include "base/internal.h"

/** A series ready for evaluation. Both tables run over m = 0..L, within it l = m..L. */
typedef struct shcdi_series {
    int degree;
    const double *recurrence; /**< 2 per (l,m): a_lm, b_lm; then L+1 diagonal factors */
    const double *packed;     /**< 6 per (l,m): c_lm and c_l,-m, each x, y, z */
} shcdi_series;

/** Number of (l, m >= 0) pairs up to a degree. */
static inline size_t shcdi_pair_count(int degree) {
    return ((size_t)degree + 1) * ((size_t)degree + 2) / 2;
}

static inline size_t shcdi_recurrence_size(int degree) {
    return 2 * shcdi_pair_count(degree) + (size_t)degree + 1;
}

void shcdi_recurrence_fill(int degree, double *recurrence);

/** From the public order, 3 (degree+1)^2 values, to the packed one. */
void shcdi_pack(int degree, const double *coefficients, double *packed);

/** Value and derivatives along the tangent frame of w (t1 x t2 = w): first derivatives s1, s2 and
 *  covariant second derivatives s11, s12, s22, so that along the great circle that leaves w with
 *  direction v = v1 t1 + v2 t2 the derivative is v1 s1 + v2 s2 and the second derivative is
 *  v1^2 s11 + 2 v1 v2 s12 + v2^2 s22. */
typedef struct shcdi_jet {
    shcd_vec3 t1, t2;
    shcd_vec3 s, s1, s2, s11, s12, s22;
} shcdi_jet;

/** S(w) truncated at `degree` <= series degree; w a unit vector. RT safe. */
shcd_vec3 shcdi_surface_point(const shcdi_series *series, int degree, shcd_vec3 w);

/** S, first and second derivatives. RT safe. */
void shcdi_surface_jet(const shcdi_series *series, int degree, shcd_vec3 w, shcdi_jet *jet);

#endif
