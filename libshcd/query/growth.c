/* SPDX-License-Identifier: BSD-3-Clause */
/* The bounds of norms.c, without tables at hand. */
#include "query/growth.h"

#include "model/norms.h"

void shcdi_growth(int degree, const double *a, const double *b, double growth[4]) {
    double factors[SHCDI_NORMS * (SHCD_DEGREE_MAX + 1)], sum[SHCDI_NORMS];
    for (int l = 0; l <= degree; l++) {
        shcdi_norm_factors(degree, l, factors + SHCDI_NORMS * l);
    }
    shcdi_norms(SHCD_SIMD_PORTABLE, factors, degree, a, b, sum);
    for (int k = 0; k < 4; k++) {
        growth[k] = sum[k];
    }
}
