/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounds of a displacement D(w) = sum_i d_i Y_i(w) and of its derivatives along great circles.
 *
 * Along a great circle w(t), |sum over m of d_lm Y_lm^(k)(w(t))| <= |D_l| (sum over m of
 * Y_lm^(k)^2)^(1/2) by Cauchy-Schwarz, D_l the 3 x (2l+1) block of degree l and |.| its spectral
 * norm, which the Frobenius norm bounds. The addition theorem, sum over m of Y_lm(w(s)) Y_lm(w(t))
 * = (2l+1)/(4 pi) P_l(cos(s - t)), differentiated k times in s and in t at s = t, gives
 * sum over m of Y_lm^(k)^2 = (2l+1)/(4 pi) g_k(l), g_k = (-1)^k d^2k/dt^2k P_l(cos t) at t = 0.
 * Legendre's equation P'' + cot(t) P' + x P = 0 with x = l (l + 1), solved by a power series in t:
 *
 *   g_0 = 1,  g_1 = x/2,  g_2 = x (3 x - 2)/8,  g_3 = x (5 (3 x - 2)(3 x - 4)/144 + 2/9).
 */
#include "model/norms.h"

/* 1/(4 pi) */
#define INVERSE_SPHERE 0.079577471545947668
/* more than the roundings of the sums over (150 + 1)^2 terms */
#define OUTWARD (1.0 + 1e-11)

void shcdi_norm_factors(int degree, int l, double factor[SHCDI_NORMS]) {
    const double x = (double)l * (l + 1.0);
    const double size = sqrt((2.0 * l + 1.0) * INVERSE_SPHERE);
    factor[0] = size;
    factor[1] = size * sqrt(x / 2.0);
    factor[2] = size * sqrt(x * (3.0 * x - 2.0) / 8.0);
    factor[3] = size * sqrt(x * (5.0 * (3.0 * x - 2.0) * (3.0 * x - 4.0) / 144.0 + 2.0 / 9.0));
    factor[4] = size * shcdi_evaluation_weight(degree, l);
}

void shcdi_norms(int simd, const double *factors, int degree, const double *a, const double *b,
                 double sum[SHCDI_NORMS]) {
    double square[SHCD_DEGREE_MAX + 1];
    shcdi_surface_squares(simd, degree, a, b, square);
    for (int k = 0; k < SHCDI_NORMS; k++) {
        sum[k] = 0.0;
    }
    for (int l = 0; l <= degree; l++, factors += SHCDI_NORMS) {
        const double size = sqrt(square[l]);
        for (int k = 0; k < SHCDI_NORMS; k++) {
            sum[k] += size * factors[k];
        }
    }
    for (int k = 0; k < SHCDI_NORMS; k++) {
        sum[k] *= OUTWARD;
    }
}
