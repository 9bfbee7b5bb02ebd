/* SPDX-License-Identifier: BSD-3-Clause */
/* Infinitesimal rotations acting on coefficients.
 *
 * D_a f = a . (w x grad f) = i a . L f with the angular momentum operator L = -i w x grad, which
 * mixes only orders of one degree: L_z Y_l^m = m Y_l^m, (L_x +- i L_y) Y_l^m = sqrt(l(l+1) -
 * m(m+-1)) Y_l^{m+-1}. Since R_a(t) w runs along a great circle when a is orthogonal to w, the k-th
 * derivative of f along it is (a . D)^k f at w: all derivatives along great circles are values of
 * other series of the same degree, and a bound on values is a bound on derivatives.
 */
#include "model/generators.h"

typedef struct pair {
    double re, im;
} pair;

/* a_lm for any m from storage that is right for m >= 0 */
static pair at(const double *a, int l, int m) {
    pair p = {0.0, 0.0};
    const int n = m < 0 ? -m : m;
    if (n <= l) {
        p.re = a[2 * SHCD_INDEX(l, n)];
        p.im = a[2 * SHCD_INDEX(l, n) + 1];
        if (m < 0) {
            const double sign = n % 2 == 0 ? 1.0 : -1.0;
            p.re *= sign;
            p.im *= -sign;
        }
    }
    return p;
}

void shcdi_generator(int degree, int axis, const double *in, double *out, double *work) {
    double *a = work;
    double *b = work + 2 * SHCD_COUNT(degree);
    (void)!shcd_coefficients_to_complex(degree, in, 1, a);
    for (int l = 0; l <= degree; l++) {
        for (int m = 0; m <= l; m++) {
            const double ll = (double)l * (l + 1.0);
            const double up = 0.5 * sqrt(ll - (double)m * (m - 1.0));
            const double down = 0.5 * sqrt(ll - (double)m * (m + 1.0));
            const pair p = at(a, l, m - 1), q = at(a, l, m + 1), r = at(a, l, m);
            double *d = b + 2 * SHCD_INDEX(l, m);
            if (axis == 0) { /* i (up p + down q) */
                d[0] = -(up * p.im + down * q.im);
                d[1] = up * p.re + down * q.re;
            } else if (axis == 1) { /* up p - down q */
                d[0] = up * p.re - down * q.re;
                d[1] = up * p.im - down * q.im;
            } else { /* i m r */
                d[0] = -(double)m * r.im;
                d[1] = (double)m * r.re;
            }
        }
    }
    (void)!shcd_coefficients_from_complex(degree, b, out, 1);
}
