/* SPDX-License-Identifier: BSD-3-Clause */
/* Real spherical harmonics, their gradients and Hessians, against closed forms, GSL, a long double
 * reference, the addition theorem and finite differences.
 *
 * Errors of degree l are measured in units of its scale s_l = sqrt((2l+1)/(4 pi)), the largest
 * value a harmonic of that degree can take (and l s_l, l^2 s_l for derivatives): the header
 * promises 1e-13 in these units. The addition theorem's tolerances follow from that promise: with
 * an error e_m <= 1e-13 s_l in each of 2l+1 terms and sum Y^2 = s_l^2, Cauchy-Schwarz gives
 * 2 |sum Y e| <= 2e-13 sqrt(2l+1) s_l^2. */
#include "shcd/base.h"
#include "shcd/vec.h"
#include "support/check.h"

#include <gsl/gsl_sf_legendre.h>
#include <string.h>

#define TOP SHCD_DEGREE_MAX
#define N SHCD_COUNT(SHCD_DEGREE_MAX)
#define PI 3.14159265358979324
#define STATED 1e-13

static double y[N], gradient[3 * N], hessian[6 * N];

static double scale_of(int l) {
    return sqrt((2.0 * l + 1.0) / (4.0 * PI));
}

static shcd_vec3 random_direction(check_random *random) {
    const double a = check_normal(random), b = check_normal(random);
    return shcd_unit(shcd_vec3_make(a, b, check_normal(random)));
}

static void evaluate(int degree, shcd_vec3 w) {
    assert_int_equal(shcd_harmonics(degree, w, y, gradient, hessian), SHCD_OK);
}

/* ---- reference: long double, z-derivatives by raising m instead of a recurrence of their own:
 * Q_lm is a multiple of the m-th derivative of P_l, so Q_lm' = sqrt((l-m)(l+m+1)) Q_l,m+1 ---- */

typedef long double real;

static real reference_q[TOP + 1][TOP + 3];

static void reference_legendre(int degree, real z) {
    memset(reference_q, 0, sizeof reference_q);
    real diagonal = 0.282094791773878143474L;
    for (int m = 0; m <= degree; m++) {
        /* without the sqrt(2) of m > 0, which the caller applies */
        diagonal *= m == 0 ? 1.0L : sqrtl((2.0L * m + 1.0L) / (2.0L * m));
        reference_q[m][m] = diagonal;
        for (int l = m + 1; l <= degree; l++) {
            const real below = l > m + 1 ? reference_q[l - 2][m] : 0.0L;
            const real n = (real)l * l - (real)m * m;
            const real k = (real)(l - 1) * (l - 1);
            const real a = sqrtl((4.0L * l * l - 1.0L) / n);
            const real b = sqrtl((k - (real)m * m) / (4.0L * k - 1.0L));
            reference_q[l][m] = a * (z * reference_q[l - 1][m] - (l > m + 1 ? b : 0.0L) * below);
        }
    }
}

/* P H P - (w.G) P and P G for P = I - w w^T */
static void restrict_to_sphere(const real w[3], const real g[3], const real h[3][3], real out_g[3],
                               real out_h[3][3]) {
    real p[3][3], wg = 0.0L;
    for (int i = 0; i < 3; i++) {
        wg += w[i] * g[i];
        for (int k = 0; k < 3; k++) {
            p[i][k] = (i == k ? 1.0L : 0.0L) - w[i] * w[k];
        }
    }
    for (int i = 0; i < 3; i++) {
        out_g[i] = g[i] - wg * w[i];
        for (int k = 0; k < 3; k++) {
            out_h[i][k] = -wg * p[i][k];
            for (int a = 0; a < 3; a++) {
                for (int b = 0; b < 3; b++) {
                    out_h[i][k] += p[i][a] * h[a][b] * p[b][k];
                }
            }
        }
    }
}

typedef struct reference {
    real y, g[3], h[3][3];
} reference;

/* Power (x + i y)^n as (re, im); zero for n < 0. */
typedef struct complex_power {
    real re[TOP + 1], im[TOP + 1];
} complex_power;

static real part(const complex_power *p, int n, int imaginary) {
    return n < 0 ? 0.0L : imaginary ? p->im[n] : p->re[n];
}

/* Y_lm at the unit vector w; needs reference_legendre() at w[2] and the powers of w[0] + i w[1]. */
static reference reference_harmonic(const real w[3], const complex_power *p, int l, int m) {
    const int n = abs(m), sine = m < 0;
    const real factor = n > 0 ? sqrtl(2.0L) : 1.0L;
    const real raise1 = sqrtl((real)(l - n) * (l + n + 1));
    const real raise2 = raise1 * (l > n ? sqrtl((real)(l - n - 1) * (l + n + 2)) : 0.0L);
    const real q0 = factor * reference_q[l][n];
    const real q1 = factor * raise1 * reference_q[l][n + 1];
    const real q2 = factor * raise2 * reference_q[l][n + 2];
    /* d/dx takes (x+iy)^n to n (x+iy)^(n-1), d/dy to i n (x+iy)^(n-1): Re(i u) = -Im u */
    const real t = part(p, n, sine), tx = n * part(p, n - 1, sine);
    const real ty = n * (sine ? part(p, n - 1, 0) : -part(p, n - 1, 1));
    const real txx = (real)n * (n - 1) * part(p, n - 2, sine);
    const real txy = (real)n * (n - 1) * (sine ? part(p, n - 2, 0) : -part(p, n - 2, 1));
    const real g[3] = {q0 * tx, q0 * ty, q1 * t};
    const real h[3][3] = {
        {q0 * txx, q0 * txy, q1 * tx}, {q0 * txy, -q0 * txx, q1 * ty}, {q1 * tx, q1 * ty, q2 * t}};
    reference r;
    r.y = q0 * t;
    restrict_to_sphere(w, g, h, r.g, r.h);
    return r;
}

typedef struct residuals {
    double y, gradient, hessian; /* largest, in units of s_l, l s_l, l^2 s_l */
} residuals;

static void compare_one(const reference *r, int l, size_t i, residuals *worst) {
    static const int at[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    const double s = scale_of(l), n = l > 0 ? l : 1.0;
    real g2 = 0.0L, h2 = 0.0L;
    for (size_t a = 0; a < 3; a++) {
        const real dg = gradient[3 * i + a] - r->g[a];
        g2 += dg * dg;
        for (size_t b = 0; b < 3; b++) {
            const real dh = hessian[6 * i + (size_t)at[a][b]] - r->h[a][b];
            h2 += dh * dh;
        }
    }
    worst->y = fmax(worst->y, (double)fabsl(y[i] - r->y) / s);
    worst->gradient = fmax(worst->gradient, (double)sqrtl(g2) / (n * s));
    worst->hessian = fmax(worst->hessian, (double)sqrtl(h2) / (n * n * s));
}

/* Library against reference at a direction of any length. */
static void compare(int degree, shcd_vec3 d, residuals *worst) {
    real w[3] = {d.x, d.y, d.z};
    const real length = sqrtl(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    static complex_power p;
    for (int k = 0; k < 3; k++) {
        w[k] /= length;
    }
    p.re[0] = 1.0L;
    p.im[0] = 0.0L;
    for (int n = 1; n <= degree; n++) {
        p.re[n] = w[0] * p.re[n - 1] - w[1] * p.im[n - 1];
        p.im[n] = w[0] * p.im[n - 1] + w[1] * p.re[n - 1];
    }
    reference_legendre(degree, w[2]);
    evaluate(degree, d);
    for (int l = 0; l <= degree; l++) {
        for (int m = -l; m <= l; m++) {
            const reference r = reference_harmonic(w, &p, l, m);
            compare_one(&r, l, SHCD_INDEX(l, m), worst);
        }
    }
}

static void assert_stated(const residuals *worst) {
    print_message("worst errors, scaled: value %.2g, gradient %.2g, Hessian %.2g\n", worst->y,
                  worst->gradient, worst->hessian);
    assert_at_most(worst->y, STATED);
    assert_at_most(worst->gradient, STATED);
    assert_at_most(worst->hessian, STATED);
}

/* ---- tests ---- */

static void test_values_up_to_degree_3_are_the_textbook_polynomials(void **state) {
    check_random random = {11};
    (void)state;
    for (int n = 0; n < 200; n++) {
        const shcd_vec3 w = random_direction(&random);
        const double x = w.x, v = w.y, z = w.z;
        const double expected[16] = {sqrt(1.0 / (4.0 * PI)),
                                     sqrt(3.0 / (4.0 * PI)) * v,
                                     sqrt(3.0 / (4.0 * PI)) * z,
                                     sqrt(3.0 / (4.0 * PI)) * x,
                                     sqrt(15.0 / (4.0 * PI)) * x * v,
                                     sqrt(15.0 / (4.0 * PI)) * v * z,
                                     sqrt(5.0 / (16.0 * PI)) * (3.0 * z * z - 1.0),
                                     sqrt(15.0 / (4.0 * PI)) * x * z,
                                     sqrt(15.0 / (16.0 * PI)) * (x * x - v * v),
                                     sqrt(35.0 / (32.0 * PI)) * v * (3.0 * x * x - v * v),
                                     sqrt(105.0 / (4.0 * PI)) * x * v * z,
                                     sqrt(21.0 / (32.0 * PI)) * v * (5.0 * z * z - 1.0),
                                     sqrt(7.0 / (16.0 * PI)) * z * (5.0 * z * z - 3.0),
                                     sqrt(21.0 / (32.0 * PI)) * x * (5.0 * z * z - 1.0),
                                     sqrt(105.0 / (16.0 * PI)) * z * (x * x - v * v),
                                     sqrt(35.0 / (32.0 * PI)) * x * (x * x - 3.0 * v * v)};
        evaluate(3, w);
        for (int i = 0; i < 16; i++) {
            /* about ten roundings of numbers below 3, and the length of w, off by 1e-16 */
            assert_near(y[i], expected[i], 3e-15);
        }
    }
}

static void test_all_up_to_degree_150_agree_with_extended_precision(void **state) {
    check_random random = {12};
    residuals worst = {0.0, 0.0, 0.0};
    (void)state;
    for (size_t n = 0; n < check_scaled(150); n++) {
        compare(TOP, random_direction(&random), &worst);
    }
    assert_stated(&worst);
}

static void test_at_and_near_the_poles_the_stated_accuracy_holds(void **state) {
    check_random random = {13};
    residuals worst = {0.0, 0.0, 0.0};
    (void)state;
    for (int side = -1; side <= 1; side += 2) {
        compare(TOP, shcd_vec3_make(0.0, 0.0, side), &worst);
        compare(TOP, shcd_vec3_make(-0.0, 0.0, side), &worst);
        for (int decade = -300; decade <= -1; decade += decade < -20 ? 20 : 1) {
            const double r = pow(10.0, decade) * check_uniform(&random, 0.5, 2.0);
            const double phi = check_uniform(&random, 0.0, 2.0 * PI);
            compare(TOP, shcd_vec3_make(r * cos(phi), r * sin(phi), side), &worst);
            compare(TOP, shcd_vec3_make(r, 0.0, side), &worst);
        }
        /* from where the harmonics of degree 150 begin to turn (1/150) to mid-latitudes */
        for (double theta = 0.002; theta < 1.2; theta *= 1.09) {
            const double phi = check_uniform(&random, 0.0, 2.0 * PI);
            compare(TOP,
                    shcd_vec3_make(sin(theta) * cos(phi), sin(theta) * sin(phi), side * cos(theta)),
                    &worst);
        }
    }
    assert_stated(&worst);
}

static void test_on_axes_planes_and_near_the_equator_the_stated_accuracy_holds(void **state) {
    residuals worst = {0.0, 0.0, 0.0};
    (void)state;
    for (int i = -1; i <= 1; i++) {
        for (int j = -1; j <= 1; j++) {
            for (int k = -1; k <= 1; k++) {
                if (i != 0 || j != 0 || k != 0) {
                    compare(TOP, shcd_vec3_make(i, j, k), &worst);
                }
            }
        }
    }
    compare(TOP, shcd_vec3_make(0.6, 0.8, 1e-12), &worst);
    compare(TOP, shcd_vec3_make(0.6, -0.8, -1e-300), &worst);
    compare(TOP, shcd_vec3_make(1e-9, 1.0, 1e-9), &worst);
    assert_stated(&worst);
}

static void test_values_agree_with_gsl(void **state) {
    check_random random = {14};
    static double p[SHCD_COUNT(TOP) * 2];
    double worst = 0.0;
    (void)state;
    for (int n = 0; n < 40; n++) {
        const double z = check_uniform(&random, -0.9, 0.9), s = sqrt(1.0 - z * z);
        const double phi = check_uniform(&random, -PI, PI);
        evaluate(TOP, shcd_vec3_make(s * cos(phi), s * sin(phi), z));
        assert_true(gsl_sf_legendre_array_n(TOP) <= sizeof p / sizeof p[0]);
        assert_int_equal(gsl_sf_legendre_array(GSL_SF_LEGENDRE_SPHARM, TOP, z, p), 0);
        for (int l = 0; l <= TOP; l++) {
            for (int m = -l; m <= l; m++) {
                const double q = p[gsl_sf_legendre_array_index((size_t)l, (size_t)abs(m))];
                const double angular = m == 0  ? 1.0
                                       : m > 0 ? sqrt(2.0) * cos(m * phi)
                                               : sqrt(2.0) * sin(-m * phi);
                const double error = fabs(y[SHCD_INDEX(l, m)] - q * angular) / scale_of(l);
                worst = fmax(worst, error);
            }
        }
    }
    /* ours, and the oracle's: m phi rounds by 150 pi 1.1e-16, and the direction that both were
     * given differs by 2e-16/sin(theta), times l, twice: 1.3e-13 */
    assert_at_most(worst, STATED + 1.3e-13);
}

/* Worst relative error of the sums over m of Y^2, |grad Y|^2, |H|^2 and (v.H.v)^2, over
 * sqrt(2l+1). */
static void addition_errors(shcd_vec3 w, shcd_vec3 v, double worst[4]) {
    evaluate(TOP, w);
    for (int l = 1; l <= TOP; l++) {
        const double ll = l * (l + 1.0), s2 = (2.0 * l + 1.0) / (4.0 * PI);
        double sum[4] = {0.0};
        for (int m = -l; m <= l; m++) {
            const size_t i = SHCD_INDEX(l, m);
            const double *g = gradient + 3 * i, *h = hessian + 6 * i;
            const double vhv = v.x * (h[0] * v.x + 2.0 * h[1] * v.y + 2.0 * h[2] * v.z) +
                               v.y * (h[3] * v.y + 2.0 * h[4] * v.z) + v.z * h[5] * v.z;
            sum[0] += y[i] * y[i];
            sum[1] += g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
            sum[2] += h[0] * h[0] + h[3] * h[3] + h[5] * h[5] +
                      2.0 * (h[1] * h[1] + h[2] * h[2] + h[4] * h[4]);
            sum[3] += vhv * vhv;
        }
        /* |H|^2 by Bochner's formula with the curvature of the sphere; (v.H.v)^2 is the fourth
         * derivative of P_l(cos t) at 0 */
        const double expected[4] = {s2, ll * s2, ll * (ll - 1.0) * s2,
                                    ll * (3.0 * ll - 2.0) / 8.0 * s2};
        /* H: l^2 s_l against sqrt(expected), l = 1 apart (H = -Y P there) */
        for (int k = 0; k < 4; k++) {
            worst[k] = fmax(worst[k], fabs(sum[k] - expected[k]) / expected[k] / sqrt(2.0 * l + 1));
        }
    }
}

static void test_sums_over_m_obey_the_addition_theorem(void **state) {
    check_random random = {15};
    double worst[4] = {0.0};
    (void)state;
    for (size_t n = 0; n < check_scaled(200); n++) {
        const double r = pow(10.0, check_uniform(&random, -18.0, 0.3));
        shcd_vec3 w = random_direction(&random);
        if (n % 2 == 0) { /* near a pole */
            w = shcd_unit(shcd_vec3_make(w.x * r, w.y * r, n % 4 == 0 ? 1.0 : -1.0));
        }
        const shcd_vec3 v = shcd_unit(shcd_cross(w, random_direction(&random)));
        addition_errors(w, v, worst);
    }
    assert_at_most(worst[0], 2.0 * STATED);
    assert_at_most(worst[1], 2.0 * STATED);
    /* sqrt(expected) is at least l^2 s_l/sqrt(8/3) for v.H.v, l^2 s_l for |H| */
    assert_at_most(worst[2], 2.0 * STATED);
    assert_at_most(worst[3], 2.0 * STATED * sqrt(8.0 / 3.0));
}

static void test_derivatives_agree_with_differences_along_great_circles(void **state) {
    enum { DEGREE = 6, COUNT = 49 };
    static const double first[4] = {0.0, 45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0};
    static const double second[4] = {-490.0 / 180.0, 270.0 / 180.0, -27.0 / 180.0, 2.0 / 180.0};
    const double step = 0.02;
    check_random random = {16};
    (void)state;
    for (int n = 0; n < 60; n++) {
        const shcd_vec3 w =
            n < 2 ? shcd_vec3_make(0.0, 0.0, 1.0 - 2.0 * n) : random_direction(&random);
        const shcd_vec3 v = shcd_unit(shcd_cross(w, random_direction(&random)));
        double d1[COUNT] = {0.0}, d2[COUNT] = {0.0}, at[COUNT];
        for (int k = -3; k <= 3; k++) {
            const double t = k * step;
            const shcd_vec3 u = shcd_mul_add(shcd_scale(cos(t), w), sin(t), v);
            assert_int_equal(shcd_harmonics(DEGREE, u, at, NULL, NULL), SHCD_OK);
            for (int i = 0; i < COUNT; i++) {
                d1[i] += (k < 0 ? -1.0 : 1.0) * first[abs(k)] / step * at[i];
                d2[i] += second[abs(k)] / (step * step) * at[i];
            }
        }
        evaluate(DEGREE, w);
        for (int l = 0; l <= DEGREE; l++) {
            /* truncation h^6 f^(7)/140 and h^6 f^(8)/560 with |f^(k)| <= l^k s_l (Bernstein), and
             * 1e-14 in the values times the sum of the weights */
            const double s = scale_of(l), h6 = pow(step, 6.0);
            const double error1 = s * (pow(l, 7.0) * h6 / 140.0 + 2e-14 / step);
            const double error2 = s * (pow(l, 8.0) * h6 / 560.0 + 6e-14 / (step * step));
            for (size_t i = SHCD_INDEX(l, -l); i <= SHCD_INDEX(l, l); i++) {
                const double *g = gradient + 3 * i, *h = hessian + 6 * i;
                assert_near(g[0] * v.x + g[1] * v.y + g[2] * v.z, d1[i], error1);
                assert_near(v.x * (h[0] * v.x + 2.0 * h[1] * v.y + 2.0 * h[2] * v.z) +
                                v.y * (h[3] * v.y + 2.0 * h[4] * v.z) + v.z * h[5] * v.z,
                            d2[i], error2);
            }
        }
    }
}

static void test_derivatives_are_tangential_and_the_trace_is_the_laplacian(void **state) {
    check_random random = {17};
    double radial = 0.0, radial2 = 0.0, laplacian = 0.0;
    (void)state;
    for (int n = 0; n < 60; n++) {
        const double r = n % 2 == 0 ? pow(10.0, -n / 4.0) : 1.0;
        shcd_vec3 w = random_direction(&random);
        w = shcd_unit(shcd_vec3_make(r * w.x, r * w.y, w.z));
        evaluate(TOP, w);
        for (int l = 1; l <= TOP; l++) {
            const double s = scale_of(l), ll = (double)l * l;
            for (size_t i = SHCD_INDEX(l, -l); i <= SHCD_INDEX(l, l); i++) {
                const double *g = gradient + 3 * i, *h = hessian + 6 * i;
                const shcd_vec3 hw = {h[0] * w.x + h[1] * w.y + h[2] * w.z,
                                      h[1] * w.x + h[3] * w.y + h[4] * w.z,
                                      h[2] * w.x + h[4] * w.y + h[5] * w.z};
                radial = fmax(radial, fabs(g[0] * w.x + g[1] * w.y + g[2] * w.z) / (l * s));
                radial2 = fmax(radial2, shcd_norm(hw) / (ll * s));
                laplacian = fmax(laplacian, fabs(h[0] + h[3] + h[5] + l * (l + 1.0) * y[i]) / ll);
            }
        }
    }
    assert_at_most(radial, STATED);
    assert_at_most(radial2, STATED);
    /* sqrt(3) entries of the Hessian's error and l(l+1)/l^2 <= 2 of the value's, s_150 = 4.9 */
    assert_at_most(laplacian, (sqrt(3.0) + 2.0) * 4.9 * STATED);
}

static void test_length_of_the_direction_does_not_matter(void **state) {
    static double first[10 * N];
    check_random random = {18};
    residuals worst = {0.0, 0.0, 0.0};
    (void)state;
    for (int exponent = -300; exponent <= 300; exponent += 25) {
        const shcd_vec3 w = random_direction(&random);
        compare(TOP, shcd_scale(pow(10.0, exponent), w), &worst);
    }
    assert_stated(&worst);
    for (int power = -900; power <= 900; power += 180) { /* exact scaling: the same bits */
        const shcd_vec3 w = {0.36, -0.48, 0.8};
        evaluate(TOP, w);
        memcpy(first, y, sizeof y);
        memcpy(first + N, gradient, sizeof gradient);
        memcpy(first + 4 * N, hessian, sizeof hessian);
        evaluate(TOP, shcd_scale(ldexp(1.0, power), w));
        assert_memory_equal(first, y, sizeof y);
        assert_memory_equal(first + N, gradient, sizeof gradient);
        assert_memory_equal(first + 4 * N, hessian, sizeof hessian);
    }
}

static void test_bits_repeat_and_do_not_depend_on_what_else_is_asked(void **state) {
    static double alone[6 * N];
    const shcd_vec3 w = {0.1, 0.02, -0.7};
    (void)state;
    evaluate(TOP, w);
    assert_int_equal(shcd_harmonics(TOP, w, alone, NULL, NULL), SHCD_OK);
    assert_memory_equal(alone, y, sizeof y);
    assert_int_equal(shcd_harmonics(TOP, w, NULL, alone, NULL), SHCD_OK);
    assert_memory_equal(alone, gradient, sizeof gradient);
    assert_int_equal(shcd_harmonics(TOP, w, NULL, NULL, alone), SHCD_OK);
    assert_memory_equal(alone, hessian, sizeof hessian);
    /* a lower degree is a prefix of a higher one */
    assert_int_equal(shcd_harmonics(40, w, alone, NULL, NULL), SHCD_OK);
    assert_memory_equal(alone, y, SHCD_COUNT(40) * sizeof *y);
    assert_int_equal(shcd_harmonics(3, w, NULL, NULL, NULL), SHCD_OK);
}

static void test_bad_arguments_are_refused_and_nothing_is_written(void **state) {
    const shcd_vec3 w = {0.0, 0.6, 0.8};
    double out[10] = {7.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0};
    const double bad[3] = {NAN, INFINITY, -INFINITY};
    (void)state;
    assert_int_equal(shcd_harmonics(-1, w, out, out, out), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_harmonics(TOP + 1, w, out, out, out), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_harmonics(0, shcd_vec3_make(0.0, -0.0, 0.0), out, out, out),
                     SHCD_ERR_ARGUMENT);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            const shcd_vec3 d = {k == 0 ? bad[i] : 0.5, k == 1 ? bad[i] : 0.5,
                                 k == 2 ? bad[i] : 0.5};
            assert_int_equal(shcd_harmonics(0, d, out, out, out), SHCD_ERR_NOT_FINITE);
        }
    }
    for (int i = 0; i < 10; i++) {
        assert_true(out[i] == 7.0);
    }
    /* the smallest and the largest numbers are directions as good as any */
    assert_int_equal(shcd_harmonics(0, shcd_vec3_make(0x1p-1074, 0.0, 0.0), out, NULL, NULL),
                     SHCD_OK);
    assert_int_equal(shcd_harmonics(0, shcd_vec3_make(1.7e308, -1.7e308, 1.7e308), out, NULL, NULL),
                     SHCD_OK);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_values_up_to_degree_3_are_the_textbook_polynomials),
        cmocka_unit_test(test_all_up_to_degree_150_agree_with_extended_precision),
        cmocka_unit_test(test_at_and_near_the_poles_the_stated_accuracy_holds),
        cmocka_unit_test(test_on_axes_planes_and_near_the_equator_the_stated_accuracy_holds),
        cmocka_unit_test(test_values_agree_with_gsl),
        cmocka_unit_test(test_sums_over_m_obey_the_addition_theorem),
        cmocka_unit_test(test_derivatives_agree_with_differences_along_great_circles),
        cmocka_unit_test(test_derivatives_are_tangential_and_the_trace_is_the_laplacian),
        cmocka_unit_test(test_length_of_the_direction_does_not_matter),
        cmocka_unit_test(test_bits_repeat_and_do_not_depend_on_what_else_is_asked),
        cmocka_unit_test(test_bad_arguments_are_refused_and_nothing_is_written)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
