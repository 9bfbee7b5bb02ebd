/* SPDX-License-Identifier: BSD-3-Clause */
/* shcd_model_partial_sums(): every degree's surface from one pass, against one call for each degree
 * and against the plain sum of harmonics. */
#include "support/bodies.h"

#define DEGREE 40

static void test_partial_sums_are_the_surfaces_of_all_degrees(void **state) {
    static const int degrees[] = {1, 2, 7, 8, 15, 16, 17, DEGREE};
    (void)state;
    for (size_t i = 0; i < sizeof degrees / sizeof degrees[0]; i++) {
        check_random r = {0x5e15u + i};
        shcd_model *model = bodies_create_random(&r, degrees[i], 0.05);
        const double *c = shcd_model_coefficients(model);
        for (int k = 0; k < 20; k++) {
            static double y[SHCD_COUNT(DEGREE)];
            shcd_vec3 sums[DEGREE + 1], plain = {0.0, 0.0, 0.0};
            const shcd_vec3 w = bodies_random_direction(&r);
            assert_int_equal(shcd_model_partial_sums(model, shcd_scale(3.0, w), sums), SHCD_OK);
            assert_int_equal(shcd_harmonics(degrees[i], w, y, NULL, NULL), SHCD_OK);
            for (int l = 0, at = 0; l <= degrees[i]; l++) {
                shcd_vec3 x;
                for (; at < (int)SHCD_COUNT(l); at++) {
                    plain = shcd_mul_add(plain, y[at],
                                         shcd_vec3_make(c[3 * at], c[3 * at + 1], c[3 * at + 2]));
                }
                assert_int_equal(shcd_model_surface(model, l, w, &x, NULL, NULL), SHCD_OK);
                /* bodies of size 1: stated accuracy of the harmonics, 1e-13, times their number */
                assert_near(shcd_norm(shcd_sub(sums[l], plain)), 0.0, 1e-12);
                assert_near(shcd_norm(shcd_sub(sums[l], x)), 0.0, 1e-12);
            }
        }
        shcd_model_free(model);
    }
}

static void test_partial_sums_bad_arguments_are_refused(void **state) {
    shcd_model *model = bodies_create_ellipsoid(1.0, 0.8, 0.6);
    const shcd_vec3 w = {0.0, 0.0, 1.0}, zero = {0.0, 0.0, 0.0}, bad = {(double)NAN, 0.0, 0.0};
    shcd_vec3 sums[2];
    (void)state;
    assert_int_equal(shcd_model_partial_sums(NULL, w, sums), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_partial_sums(model, w, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_partial_sums(model, zero, sums), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_partial_sums(model, bad, sums), SHCD_ERR_NOT_FINITE);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_partial_sums_are_the_surfaces_of_all_degrees),
        cmocka_unit_test(test_partial_sums_bad_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
