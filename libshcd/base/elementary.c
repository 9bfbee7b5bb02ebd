/* SPDX-License-Identifier: BSD-3-Clause */
/* Range reduction and Taylor sums. Speed matters little here: a tick needs these only when its
 * length changes. */
#include "base/elementary.h"

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* pi/2 in four parts, the first three of at most 33 bits: their products with whole numbers below
 * 2^20 are exact (W. J. Cody, W. Waite, Software Manual for the Elementary Functions,
 * Prentice-Hall, 1980). */
#define HALF_PI_1 1.57079632673412561417e+00
#define HALF_PI_2 6.07710050630396597660e-11
#define HALF_PI_3 2.02226624871116645580e-21
#define HALF_PI_4 8.47842766036889956997e-32
#define TWO_OVER_PI 6.36619772367581382433e-01
#define LN2_1 6.93147180369123816490e-01
#define LN2_2 1.90821492927058770002e-10
#define ONE_OVER_LN2 1.44269504088896338700e+00
#define ARGUMENT_MAX 1e6
#define EXPONENT_MIN (-700.0)

/* Taylor series without their leading terms; what follows the last is below 1e-18 in the range. */
static const double sine_terms[] = {
    -0.16666666666666666,   0.008333333333333333,   -0.0001984126984126984, 2.7557319223985893e-06,
    -2.505210838544172e-08, 1.6059043836821613e-10, -7.647163731819816e-13, 2.8114572543455206e-15};
static const double cosine_terms[] = {-0.5,
                                      0.041666666666666664,
                                      -0.001388888888888889,
                                      2.48015873015873e-05,
                                      -2.755731922398589e-07,
                                      2.08767569878681e-09,
                                      -1.1470745597729725e-11,
                                      4.779477332387385e-14,
                                      -1.5619206968586225e-16};
static const double exp_terms[] = {0.5,
                                   0.16666666666666666,
                                   0.041666666666666664,
                                   0.008333333333333333,
                                   0.001388888888888889,
                                   0.0001984126984126984,
                                   2.48015873015873e-05,
                                   2.7557319223985893e-06,
                                   2.755731922398589e-07,
                                   2.505210838544172e-08,
                                   2.08767569878681e-09,
                                   1.6059043836821613e-10,
                                   1.1470745597729725e-11};
static const double ratio_terms[] = {0.5,
                                     0.16666666666666666,
                                     0.041666666666666664,
                                     0.008333333333333333,
                                     0.001388888888888889,
                                     0.0001984126984126984,
                                     2.48015873015873e-05,
                                     2.7557319223985893e-06,
                                     2.755731922398589e-07,
                                     2.505210838544172e-08,
                                     2.08767569878681e-09,
                                     1.6059043836821613e-10,
                                     1.1470745597729725e-11,
                                     7.647163731819816e-13,
                                     4.779477332387385e-14,
                                     2.8114572543455206e-15,
                                     1.5619206968586225e-16,
                                     8.22063524662433e-18};
/* of atanh, for |x| <= 0.1716: 0.1716^48/49 < 1e-38 */
static const double atanh_terms[] = {0.3333333333333333,   0.2,
                                     0.14285714285714285,  0.1111111111111111,
                                     0.09090909090909091,  0.07692307692307693,
                                     0.06666666666666667,  0.058823529411764705,
                                     0.05263157894736842,  0.047619047619047616,
                                     0.043478260869565216, 0.04,
                                     0.037037037037037035, 0.034482758620689655,
                                     0.03225806451612903,  0.030303030303030304,
                                     0.02857142857142857,  0.02702702702702703,
                                     0.02564102564102564,  0.024390243902439025,
                                     0.023255813953488372, 0.022222222222222223,
                                     0.02127659574468085};

#define SUM(terms, t) polynomial(terms, sizeof(terms) / sizeof(terms)[0], t)

/* terms[0] + terms[1] t + ..., from the small end */
static double polynomial(const double *terms, size_t n, double t) {
    double sum = 0.0;
    while (n > 0) {
        sum = terms[--n] + t * sum;
    }
    return sum;
}

static double nearest_whole(double x) {
    return x < 0.0 ? (double)(int32_t)(x - 0.5) : (double)(int32_t)(x + 0.5);
}

double shcdi_quarters(double x, int *n_quarters) {
    *n_quarters = 0;
    if (!(fabs(x) <= ARGUMENT_MAX)) {
        return 0.0;
    }
    const double n = nearest_whole(x * TWO_OVER_PI);
    *n_quarters = (int)((uint32_t)(int32_t)n & 3u);
    return (((x - n * HALF_PI_1) - n * HALF_PI_2) - n * HALF_PI_3) - n * HALF_PI_4;
}

static double cosine_small(double x) {
    const double t = x * x;
    return 1.0 + t * SUM(cosine_terms, t);
}

double shcdi_sine_small(double x) {
    const double t = x * x;
    return x + x * (t * SUM(sine_terms, t));
}

double shcdi_half_tangent(double x) {
    return shcdi_sine_small(x) / (1.0 + cosine_small(x));
}

void shcdi_sincos(double x, double *sine, double *cosine) {
    int n;
    const double rest = shcdi_quarters(x, &n);
    const double s = shcdi_sine_small(rest), c = cosine_small(rest);
    *sine = n == 0 ? s : n == 1 ? c : n == 2 ? -s : -c;
    *cosine = n == 0 ? c : n == 1 ? -s : n == 2 ? -c : s;
}

double shcdi_exp(double x) {
    if (!(x >= EXPONENT_MIN) || x > 1.0) {
        return x > 1.0 ? 2.71828182845904523536 : 0.0;
    }
    const double n = nearest_whole(x * ONE_OVER_LN2);
    const double r = (x - n * LN2_1) - n * LN2_2;
    const double value = 1.0 + (r + r * r * SUM(exp_terms, r));
    const uint64_t bits = (uint64_t)(1023 + (int64_t)n) << 52; /* 2^n, a normal number */
    double power;
    memcpy(&power, &bits, sizeof power);
    return value * power;
}

/* x = 2^n m, m in [sqrt(1/2), sqrt(2)): ln m = 2 atanh((m - 1)/(m + 1)) */
double shcdi_log(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    int64_t n = (int64_t)(bits >> 52) - 1023;
    bits = (bits & 0xfffffffffffffu) | ((uint64_t)1023 << 52);
    double m;
    memcpy(&m, &bits, sizeof m);
    if (m > 1.41421356237309505) {
        m *= 0.5;
        n++;
    }
    const double t = (m - 1.0) / (m + 1.0);
    const double tail = t * t * SUM(atanh_terms, t * t);
    return (double)n * LN2_1 + (2.0 * (t + t * tail) + (double)n * LN2_2);
}

double shcdi_expm1_ratio(double x) {
    return 1.0 + x * SUM(ratio_terms, x);
}
