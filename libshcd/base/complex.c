/* SPDX-License-Identifier: BSD-3-Clause */
/* Between the real orthonormal basis without the Condon-Shortley phase and the complex basis with
 * it.
 *
 * Complex: Y_l^m = (-1)^m K_lm P_lm e^{i m phi} for m >= 0 and Y_l^-m = (-1)^m conj(Y_l^m), so
 * Y_lm(real) = sqrt(2) (-1)^m Re Y_l^m and Y_l,-m(real) = sqrt(2) (-1)^m Im Y_l^m. Matching
 * a_lm Y_l^m + a_l,-m Y_l^-m = 2 Re(a_lm Y_l^m) with c_lm Y_lm + c_l,-m Y_l,-m gives
 * a_lm = (-1)^m (c_lm - i c_l,-m)/sqrt(2): sum |a|^2 = sum c^2 (Parseval).
 */
#include "base/internal.h"

#define SQRT_HALF 0.70710678118654752

shcd_status shcd_coefficients_to_complex(int degree, const double *real, size_t stride,
                                         double *complex_re_im) {
    if (degree < 0 || degree > SHCD_DEGREE_MAX || real == NULL || stride == 0 ||
        complex_re_im == NULL) {
        return SHCD_ERR_ARGUMENT;
    }
    for (int l = 0; l <= degree; l++) {
        complex_re_im[2 * SHCD_INDEX(l, 0)] = real[stride * SHCD_INDEX(l, 0)];
        complex_re_im[2 * SHCD_INDEX(l, 0) + 1] = 0.0;
        for (int m = 1; m <= l; m++) {
            const double sign = m % 2 == 0 ? 1.0 : -1.0;
            const double re = SQRT_HALF * real[stride * SHCD_INDEX(l, m)];
            const double im = -SQRT_HALF * real[stride * SHCD_INDEX(l, -m)];
            complex_re_im[2 * SHCD_INDEX(l, m)] = sign * re;
            complex_re_im[2 * SHCD_INDEX(l, m) + 1] = sign * im;
            complex_re_im[2 * SHCD_INDEX(l, -m)] = re;
            complex_re_im[2 * SHCD_INDEX(l, -m) + 1] = -im;
        }
    }
    return SHCD_OK;
}

shcd_status shcd_coefficients_from_complex(int degree, const double *complex_re_im, double *real,
                                           size_t stride) {
    if (degree < 0 || degree > SHCD_DEGREE_MAX || complex_re_im == NULL || stride == 0 ||
        real == NULL) {
        return SHCD_ERR_ARGUMENT;
    }
    for (int l = 0; l <= degree; l++) {
        real[stride * SHCD_INDEX(l, 0)] = complex_re_im[2 * SHCD_INDEX(l, 0)];
        for (int m = 1; m <= l; m++) {
            const double scale = (m % 2 == 0 ? 1.0 : -1.0) / SQRT_HALF;
            real[stride * SHCD_INDEX(l, m)] = scale * complex_re_im[2 * SHCD_INDEX(l, m)];
            real[stride * SHCD_INDEX(l, -m)] = -scale * complex_re_im[2 * SHCD_INDEX(l, m) + 1];
        }
    }
    return SHCD_OK;
}
