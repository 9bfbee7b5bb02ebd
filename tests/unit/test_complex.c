/* SPDX-License-Identifier: BSD-3-Clause */
/* Conversion to the complex coefficients of the SPHARM literature, against complex harmonics with
 * the Condon-Shortley phase built from GSL, the Parseval identity and the forward transform. */
#include "shcd/base.h"
#include "support/bodies.h"
#include "support/check.h"

#include <complex.h>
#include <gsl/gsl_sf_legendre.h>

#define DEGREE 24
#define COUNT SHCD_COUNT(24)
#define N_THETA (DEGREE + 1)
#define N_PHI (2 * DEGREE + 2)
#define PI BODIES_PI

/* Y_l^m(theta, phi) for all l, m; m < 0 by (-1)^m conj. */
static void complex_basis(double z, double phi, double complex *out) {
    static double p[2 * SHCD_COUNT(DEGREE)];
    assert_true(gsl_sf_legendre_array_n(DEGREE) <= sizeof p / sizeof p[0]);
    assert_int_equal(gsl_sf_legendre_array_e(GSL_SF_LEGENDRE_SPHARM, DEGREE, z, -1.0, p), 0);
    for (int l = 0; l <= DEGREE; l++) {
        for (int m = 0; m <= l; m++) {
            const double q = p[gsl_sf_legendre_array_index((size_t)l, (size_t)m)];
            const double complex v = CMPLX(q * cos(m * phi), q * sin(m * phi));
            out[SHCD_INDEX(l, m)] = v;
            out[SHCD_INDEX(l, -m)] = m == 0 ? v : (m % 2 == 0 ? 1.0 : -1.0) * conj(v);
        }
    }
}

static void random_coefficients(uint64_t seed, double *c) {
    check_random random = {seed};
    for (size_t i = 0; i < COUNT; i++) {
        c[i] = check_normal(&random);
    }
}

/* sum |c_i| s_l: the largest that the series, and each error relative to a term, can grow to */
static double size_of(const double *c) {
    double sum = 0.0;
    for (int l = 0; l <= DEGREE; l++) {
        for (size_t i = SHCD_INDEX(l, -l); i <= SHCD_INDEX(l, l); i++) {
            sum += fabs(c[i]) * sqrt((2.0 * l + 1.0) / (4.0 * PI));
        }
    }
    return sum;
}

static void test_complex_series_is_the_same_function(void **state) {
    static double c[COUNT], a[2 * COUNT], y[COUNT];
    static double complex basis[COUNT];
    check_random random = {21};
    (void)state;
    random_coefficients(20, c);
    assert_int_equal(shcd_coefficients_to_complex(DEGREE, c, 1, a), SHCD_OK);
    for (int n = 0; n < 100; n++) {
        const double z = check_uniform(&random, -0.99, 0.99), s = sqrt(1.0 - z * z);
        const double phi = check_uniform(&random, -PI, PI);
        double expected = 0.0;
        double complex sum = 0.0;
        complex_basis(z, phi, basis);
        assert_int_equal(
            shcd_harmonics(DEGREE, shcd_vec3_make(s * cos(phi), s * sin(phi), z), y, NULL, NULL),
            SHCD_OK);
        for (size_t i = 0; i < COUNT; i++) {
            expected += c[i] * y[i];
            sum += CMPLX(a[2 * i], a[2 * i + 1]) * basis[i];
        }
        /* relative to each term: 1e-13 of our harmonics, and the direction, which both round to
         * 2e-16/sin(theta) <= 1.5e-15, times l = 24, 4e-14; 625 additions add as many 1.1e-16 */
        assert_near(creal(sum), expected, 3e-13 * size_of(c));
        assert_near(cimag(sum), 0.0, 3e-13 * size_of(c));
    }
}

static void test_single_harmonics_have_the_documented_complex_coefficients(void **state) {
    static double c[COUNT], a[2 * COUNT];
    const double h = sqrt(0.5);
    (void)state;
    memset(c, 0, sizeof c);
    c[SHCD_INDEX(3, 1)] = 1.0;   /* odd m: the phase shows */
    c[SHCD_INDEX(4, -2)] = 1.0;  /* sine */
    c[SHCD_INDEX(24, 0)] = -2.5; /* zonal */
    assert_int_equal(shcd_coefficients_to_complex(DEGREE, c, 1, a), SHCD_OK);
    for (size_t i = 0; i < COUNT; i++) {
        const double re = i == SHCD_INDEX(3, 1)    ? -h
                          : i == SHCD_INDEX(3, -1) ? h
                          : i == SHCD_INDEX(24, 0) ? -2.5
                                                   : 0.0;
        const double im = i == SHCD_INDEX(4, 2) ? -h : i == SHCD_INDEX(4, -2) ? h : 0.0;
        assert_near(a[2 * i], re, 2e-16); /* one rounding, and that of sqrt(1/2) */
        assert_near(a[2 * i + 1], im, 2e-16);
    }
}

static void test_round_trip_is_exact_to_rounding_at_any_stride(void **state) {
    enum { TOP = SHCD_DEGREE_MAX };
    static double c[3 * SHCD_COUNT(TOP)], a[2 * SHCD_COUNT(TOP)], back[3 * SHCD_COUNT(TOP)];
    check_random random = {22};
    (void)state;
    for (size_t i = 0; i < 3 * SHCD_COUNT(TOP); i++) {
        c[i] = check_normal(&random) * pow(10.0, check_uniform(&random, -12.0, 9.0));
        back[i] = -1.0;
    }
    assert_int_equal(shcd_coefficients_to_complex(TOP, c + 1, 3, a), SHCD_OK);
    for (int l = 1; l <= TOP; l++) { /* the inverse must not look at m < 0 */
        for (int m = -l; m < 0; m++) {
            a[2 * SHCD_INDEX(l, m)] = a[2 * SHCD_INDEX(l, m) + 1] = NAN;
        }
    }
    assert_int_equal(shcd_coefficients_from_complex(TOP, a, back + 1, 3), SHCD_OK);
    for (size_t i = 0; i < 3 * SHCD_COUNT(TOP); i++) {
        if (i % 3 == 1) {
            /* two products, a quotient and the rounding of sqrt(1/2): four units of 1.1e-16 */
            assert_near(back[i], c[i], 4.5e-16 * fabs(c[i]));
        } else {
            assert_true(back[i] == -1.0);
        }
    }
}

/* f on a Gauss-Legendre x uniform grid that integrates products of two series exactly. */
typedef struct grid {
    double z[N_THETA], weight[N_THETA], f[N_THETA][N_PHI];
} grid;

static void sample(const double *c, grid *g) {
    static double y[COUNT];
    bodies_gauss_legendre(N_THETA, g->z, g->weight);
    for (int j = 0; j < N_THETA; j++) {
        const double s = sqrt(1.0 - g->z[j] * g->z[j]);
        for (int k = 0; k < N_PHI; k++) {
            const double phi = 2.0 * PI * k / N_PHI;
            assert_int_equal(shcd_harmonics(DEGREE,
                                            shcd_vec3_make(s * cos(phi), s * sin(phi), g->z[j]), y,
                                            NULL, NULL),
                             SHCD_OK);
            g->f[j][k] = 0.0;
            for (size_t i = 0; i < COUNT; i++) {
                g->f[j][k] += c[i] * y[i];
            }
        }
    }
}

static void test_energy_is_the_integral_of_the_square(void **state) {
    static double c[COUNT], a[2 * COUNT];
    static grid g;
    double energy = 0.0, integral = 0.0;
    (void)state;
    random_coefficients(23, c);
    assert_int_equal(shcd_coefficients_to_complex(DEGREE, c, 1, a), SHCD_OK);
    for (size_t i = 0; i < 2 * COUNT; i++) {
        energy += a[i] * a[i];
    }
    sample(c, &g);
    for (int j = 0; j < N_THETA; j++) {
        for (int k = 0; k < N_PHI; k++) {
            integral += g.weight[j] * (2.0 * PI / N_PHI) * g.f[j][k] * g.f[j][k];
        }
    }
    /* Each f errs by e <= 1e-13 size; by Cauchy-Schwarz the integral by
     * 2 sqrt(integral) sqrt(4 pi) e; nodes and weights to 1e-14 relative */
    assert_near(energy, integral,
                2.0 * sqrt(4.0 * PI * integral) * 1e-13 * size_of(c) + 2e-14 * integral);
}

static void test_forward_transform_gives_the_coefficients(void **state) {
    static double c[COUNT], a[2 * COUNT];
    static double complex basis[COUNT], found[COUNT];
    static grid g;
    (void)state;
    random_coefficients(24, c);
    assert_int_equal(shcd_coefficients_to_complex(DEGREE, c, 1, a), SHCD_OK);
    sample(c, &g);
    memset(found, 0, sizeof found);
    for (int j = 0; j < N_THETA; j++) {
        for (int k = 0; k < N_PHI; k++) {
            complex_basis(g.z[j], 2.0 * PI * k / N_PHI, basis);
            for (size_t i = 0; i < COUNT; i++) {
                found[i] += g.weight[j] * (2.0 * PI / N_PHI) * g.f[j][k] * conj(basis[i]);
            }
        }
    }
    for (size_t i = 0; i < COUNT; i++) {
        /* f errs by 1e-13 size, and so does the basis relative to its largest value; the integral
         * of |Y| over the sphere is at most sqrt(4 pi) */
        const double tolerance = 2.0 * sqrt(4.0 * PI) * 1e-13 * size_of(c);
        assert_near(creal(found[i]), a[2 * i], tolerance);
        assert_near(cimag(found[i]), a[2 * i + 1], tolerance);
    }
}

static void test_bad_arguments_are_refused(void **state) {
    double c[1] = {1.0}, a[2] = {5.0, 5.0};
    (void)state;
    assert_int_equal(shcd_coefficients_to_complex(-1, c, 1, a), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_coefficients_to_complex(151, c, 1, a), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_coefficients_to_complex(0, NULL, 1, a), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_coefficients_to_complex(0, c, 0, a), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_coefficients_to_complex(0, c, 1, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_coefficients_from_complex(-1, a, c, 1), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_coefficients_from_complex(151, a, c, 1), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_coefficients_from_complex(0, NULL, c, 1), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_coefficients_from_complex(0, a, NULL, 1), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_coefficients_from_complex(0, a, c, 0), SHCD_ERR_ARGUMENT);
    assert_true(c[0] == 1.0 && a[0] == 5.0 && a[1] == 5.0);
    assert_int_equal(shcd_coefficients_to_complex(0, c, 1, a), SHCD_OK);
    assert_true(a[0] == 1.0 && a[1] == 0.0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_complex_series_is_the_same_function),
        cmocka_unit_test(test_single_harmonics_have_the_documented_complex_coefficients),
        cmocka_unit_test(test_round_trip_is_exact_to_rounding_at_any_stride),
        cmocka_unit_test(test_energy_is_the_integral_of_the_square),
        cmocka_unit_test(test_forward_transform_gives_the_coefficients),
        cmocka_unit_test(test_bad_arguments_are_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
