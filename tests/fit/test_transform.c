/* SPDX-License-Identifier: BSD-3-Clause */
/* Analysis and synthesis on the grid, against the library's own point-wise harmonics, Parseval and
 * the integrals of the definition. */
#include "support/check.h"

#include "shcd/fit.h"

#include <gsl/gsl_integration.h>

static double *take(size_t n) {
    double *values = calloc(n, sizeof *values);
    assert_non_null(values);
    return values;
}

static double *random_series(int degree, uint64_t seed) {
    check_random random = {seed};
    double *c = take(SHCD_COUNT(degree));
    for (size_t i = 0; i < SHCD_COUNT(degree); ++i) {
        c[i] = check_uniform(&random, -1.0, 1.0);
    }
    return c;
}

/* Nodes from GSL's table for n = 64 (27 digits there, so that no polishing is needed). */
static double node_of_64(size_t j) {
    double z = 0.0, weight = 0.0;
    gsl_integration_glfixed_table *table = gsl_integration_glfixed_table_alloc(64);
    assert_non_null(table);
    assert_int_equal(gsl_integration_glfixed_point(-1.0, 1.0, 63 - j, &z, &weight, table), 0);
    gsl_integration_glfixed_table_free(table);
    return z;
}

static void check_round_trip(int degree, size_t n_latitudes, size_t n_longitudes) {
    double *c = random_series(degree, 11), *back = take(SHCD_COUNT(degree));
    double *values = take(n_latitudes * n_longitudes);
    assert_int_equal(shcd_synthesis(degree, c, n_latitudes, n_longitudes, values), SHCD_OK);
    assert_int_equal(shcd_analysis(degree, values, n_latitudes, n_longitudes, back), SHCD_OK);
    for (size_t i = 0; i < SHCD_COUNT(degree); ++i) {
        assert_near(back[i], c[i], 1e-12);
    }
    free(c);
    free(back);
    free(values);
}

static void test_transform_round_trip_on_smallest_grid(void **state) {
    (void)state;
    const int degrees[] = {0, 1, 2, 15, 50, 100, 150};
    for (size_t k = 0; k < sizeof degrees / sizeof *degrees; ++k) {
        const size_t n = (size_t)degrees[k];
        check_round_trip(degrees[k], n + 1, 2 * n + 1);
    }
}

static void test_transform_round_trip_on_larger_grid(void **state) {
    (void)state;
    check_round_trip(15, 64, 100);
    check_round_trip(150, 200, 421);
}

static void test_synthesis_agrees_with_harmonics_at_the_nodes(void **state) {
    (void)state;
    enum { degree = 40, n_longitudes = 90 };
    double *c = random_series(degree, 12), *values = take(64 * n_longitudes);
    double *row = take(SHCD_COUNT(degree));
    assert_int_equal(shcd_synthesis(degree, c, 64, n_longitudes, values), SHCD_OK);
    for (size_t j = 0; j < 64; j += 7) {
        const double z = node_of_64(j), r = sqrt((1.0 - z) * (1.0 + z));
        for (size_t k = 0; k < n_longitudes; k += 11) {
            const double phi = 6.283185307179586 * (double)k / n_longitudes;
            const shcd_vec3 w = {r * cos(phi), r * sin(phi), z};
            double sum = 0.0, size = 0.0;
            assert_int_equal(shcd_harmonics(degree, w, row, NULL, NULL), SHCD_OK);
            for (size_t i = 0; i < SHCD_COUNT(degree); ++i) {
                sum += c[i] * row[i];
                size += fabs(c[i] * row[i]);
            }
            /* 1e-13 per harmonic at its scale, see shcd_harmonics(); a sum of 1681 of them */
            assert_near(values[j * n_longitudes + k], sum, 1e-13 * (100.0 + size));
        }
    }
    free(c);
    free(values);
    free(row);
}

static void test_analysis_of_one_harmonic_is_one_coefficient(void **state) {
    (void)state;
    enum { degree = 20, n_longitudes = 64 };
    const int cases[][2] = {{0, 0}, {1, -1}, {1, 1}, {7, 0}, {13, -9}, {20, 20}, {20, -20}};
    double *values = take(64 * n_longitudes), *c = take(SHCD_COUNT(degree));
    double *row = take(SHCD_COUNT(degree));
    for (size_t n = 0; n < sizeof cases / sizeof *cases; ++n) {
        const size_t index = SHCD_INDEX(cases[n][0], cases[n][1]);
        for (size_t j = 0; j < 64; ++j) {
            const double z = node_of_64(j), r = sqrt((1.0 - z) * (1.0 + z));
            for (size_t k = 0; k < n_longitudes; ++k) {
                const double phi = 6.283185307179586 * (double)k / n_longitudes;
                const shcd_vec3 w = {r * cos(phi), r * sin(phi), z};
                assert_int_equal(shcd_harmonics(degree, w, row, NULL, NULL), SHCD_OK);
                values[j * n_longitudes + k] = row[index];
            }
        }
        assert_int_equal(shcd_analysis(degree, values, 64, n_longitudes, c), SHCD_OK);
        for (size_t i = 0; i < SHCD_COUNT(degree); ++i) {
            assert_near(c[i], i == index ? 1.0 : 0.0, 1e-12);
        }
    }
    free(values);
    free(c);
    free(row);
}

/* Parseval: the integral of f^2 over the sphere, by the same quadrature but on a grid that is exact
 * for degree 2 L, is the sum of the squared coefficients. The integral of f^2 is sqrt(4 pi) times
 * the first coefficient of f^2. */
static void test_transform_obeys_parseval(void **state) {
    (void)state;
    enum { degree = 30, n_latitudes = 64, n_longitudes = 130 };
    double *c = random_series(degree, 13), *values = take(n_latitudes * n_longitudes);
    double *square = take(SHCD_COUNT(2 * degree));
    double sum = 0.0;
    assert_int_equal(shcd_synthesis(degree, c, n_latitudes, n_longitudes, values), SHCD_OK);
    for (size_t i = 0; i < (size_t)n_latitudes * n_longitudes; ++i) {
        values[i] *= values[i];
    }
    assert_int_equal(shcd_analysis(2 * degree, values, n_latitudes, n_longitudes, square), SHCD_OK);
    for (size_t i = 0; i < SHCD_COUNT(degree); ++i) {
        sum += c[i] * c[i];
    }
    assert_near(square[0] * sqrt(12.566370614359172954), sum, 1e-12 * sum);
    free(c);
    free(values);
    free(square);
}

static void test_transform_refuses_a_grid_too_small(void **state) {
    (void)state;
    double c[16] = {0.0}, values[64] = {0.0};
    assert_int_equal(shcd_synthesis(3, c, 4, 7, values), SHCD_OK);
    assert_int_equal(shcd_synthesis(3, c, 3, 7, values), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_synthesis(3, c, 4, 6, values), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_analysis(3, values, 3, 7, c), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_analysis(3, values, 4, 6, c), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_analysis(-1, values, 4, 7, c), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_analysis(SHCD_DEGREE_MAX + 1, values, 400, 700, c), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_synthesis(3, NULL, 4, 7, values), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_analysis(3, values, 4, 7, NULL), SHCD_ERR_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_transform_round_trip_on_smallest_grid),
        cmocka_unit_test(test_transform_round_trip_on_larger_grid),
        cmocka_unit_test(test_synthesis_agrees_with_harmonics_at_the_nodes),
        cmocka_unit_test(test_analysis_of_one_harmonic_is_one_coefficient),
        cmocka_unit_test(test_transform_obeys_parseval),
        cmocka_unit_test(test_transform_refuses_a_grid_too_small),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
