/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounds of a series, and of its derivatives along great circles, by the norms of its degrees. */
#ifndef SHCDI_MODEL_NORMS_H
#define SHCDI_MODEL_NORMS_H

#include "model/surface.h"

/** B_0 .. B_3, and what rounds an evaluation. */
#define SHCDI_NORMS 5

/** Factors of degree l: B_k of sum over m of c_lm Y_lm is |c_l| factor[k], |.| the Frobenius norm
 *  of a degree's 3 x (2l+1) block; factor[4] is that of shcdi_evaluation_error(). */
void shcdi_norm_factors(int degree, int l, double factor[SHCDI_NORMS]);

/** The sums over l, rounded up, of the difference of two sets of coefficients, 3 (degree+1)^2
 *  values each. `factors` holds SHCDI_NORMS for each degree. RT safe. */
void shcdi_norms(int simd, const double *factors, int degree, const double *a, const double *b,
                 double sum[SHCDI_NORMS]);

#endif
