/* SPDX-License-Identifier: BSD-3-Clause */
/* The tick's own elementary functions against the C library, and E1 against GSL. */
#include "base/elementary.h"
#include "response/soft.h"

#include "support/check.h"

#include <gsl/gsl_sf_expint.h>

static void test_sine_and_cosine(void **state) {
    check_random random = {1};
    (void)state;
    for (size_t i = 0; i < check_scaled(200000); i++) {
        const double x = (check_uniform(&random, 0.0, 1.0) < 0.5 ? -1.0 : 1.0) *
                         pow(10.0, check_uniform(&random, -4.0, 6.0));
        double s, c;
        shcdi_sincos(x, &s, &c);
        assert_near(s, sin(x), 3e-16);
        assert_near(c, cos(x), 3e-16);
    }
}

static void test_quarters_leave_at_most_an_eighth_of_a_turn(void **state) {
    check_random random = {2};
    (void)state;
    for (size_t i = 0; i < check_scaled(100000); i++) {
        const double x = check_uniform(&random, 0.0, 1e6);
        int n;
        const double rest = shcdi_quarters(x, &n);
        assert_true(fabs(rest) <= 0.78539816339744831 * (1.0 + 1e-9));
        assert_true(n >= 0 && n <= 3);
        assert_near(shcdi_half_tangent(rest), tan(0.5 * rest), 4e-16);
        assert_near(shcdi_sine_small(rest), sin(rest), 3e-16);
    }
}

static void test_beyond_the_range_nothing_is_undefined(void **state) {
    const double wild[] = {1e7, -1e300, NAN, INFINITY};
    (void)state;
    for (size_t i = 0; i < sizeof wild / sizeof wild[0]; i++) {
        double s, c;
        shcdi_sincos(wild[i], &s, &c);
        assert_true(s == 0.0 && c == 1.0);
    }
    assert_true(shcdi_exp(NAN) == 0.0);
    assert_true(shcdi_exp(-1e9) == 0.0);
    assert_true(shcdi_exp(-INFINITY) == 0.0);
}

static void test_exponential(void **state) {
    check_random random = {3};
    (void)state;
    assert_true(shcdi_exp(0.0) == 1.0);
    for (size_t i = 0; i < check_scaled(200000); i++) {
        const double x = -pow(10.0, check_uniform(&random, -8.0, 2.84));
        const double z = check_uniform(&random, -1.0, 1.0);
        assert_near(shcdi_exp(x), exp(x), 5e-16 * exp(x));
        assert_near(shcdi_expm1_ratio(z), expm1(z) / z, 5e-16 * expm1(z) / z);
    }
}

static void test_logarithm(void **state) {
    check_random random = {6};
    (void)state;
    assert_true(shcdi_log(1.0) == 0.0);
    for (size_t i = 0; i < check_scaled(200000); i++) {
        const double x =
            pow(10.0, check_uniform(&random, i % 2 == 0 ? -300.0 : -0.5, i % 2 == 0 ? 300.0 : 0.5));
        assert_near(shcdi_log(x), log(x), 3e-16 * fmax(1.0, fabs(log(x))));
    }
}

static void test_exponential_integral(void **state) {
    check_random random = {4};
    (void)state;
    for (size_t i = 0; i < check_scaled(20000); i++) {
        const double x = pow(10.0, check_uniform(&random, -12.0, 2.5));
        const double expected = gsl_sf_expint_E1_scaled(x);
        assert_near(shcdi_scaled_e1(x), expected, 1e-14 * expected);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sine_and_cosine),
        cmocka_unit_test(test_quarters_leave_at_most_an_eighth_of_a_turn),
        cmocka_unit_test(test_beyond_the_range_nothing_is_undefined),
        cmocka_unit_test(test_exponential),
        cmocka_unit_test(test_logarithm),
        cmocka_unit_test(test_exponential_integral),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
