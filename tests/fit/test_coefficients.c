/* SPDX-License-Identifier: BSD-3-Clause */
/* Least squares against samples of a series that is known, and of one that it cannot reach. */
#include "fit_support.h"

#include "coefficients.h"

static const shcdi_progress silent = {NULL, NULL};

/* Random directions with weights that vary tenfold; points of a random series. */
static shcdi_samples samples_of_series(int degree, size_t n, double *coefficients, uint64_t seed) {
    check_random random = {seed};
    shcdi_samples s = {.n = n};
    double *row = malloc(SHCD_COUNT(degree) * sizeof *row);
    s.points_m = malloc(n * sizeof *s.points_m);
    s.directions = malloc(n * sizeof *s.directions);
    s.weights = malloc(n * sizeof *s.weights);
    assert_true(row != NULL && s.points_m != NULL && s.directions != NULL && s.weights != NULL);
    for (size_t i = 0; i < 3 * SHCD_COUNT(degree); ++i) {
        coefficients[i] = check_normal(&random);
    }
    for (size_t k = 0; k < n; ++k) {
        s.directions[k] = shcd_unit(
            shcd_vec3_make(check_normal(&random), check_normal(&random), check_normal(&random)));
        s.weights[k] = check_uniform(&random, 0.1, 1.0) / (double)n;
        assert_int_equal(shcd_harmonics(degree, s.directions[k], row, NULL, NULL), SHCD_OK);
        s.points_m[k] = shcd_vec3_make(0.0, 0.0, 0.0);
        for (size_t i = 0; i < SHCD_COUNT(degree); ++i) {
            const double *c = coefficients + 3 * i;
            s.points_m[k] = shcd_mul_add(s.points_m[k], row[i], shcd_vec3_make(c[0], c[1], c[2]));
        }
    }
    free(row);
    return s;
}

static shcdi_least_squares *create(int degree, const shcdi_samples *samples) {
    shcdi_least_squares *ls = NULL;
    assert_int_equal(shcdi_least_squares_create(degree, samples, &silent, &ls), SHCD_OK);
    return ls;
}

static void test_least_squares_recovers_a_series_of_its_degree(void **state) {
    (void)state;
    double wanted[3 * 49], found[3 * 121];
    shcdi_samples s = samples_of_series(6, 1999, wanted, 1); /* no multiple of the block size */
    shcdi_least_squares *ls = create(10, &s);
    const double tolerance = 1e-14 / shcdi_least_squares_rcond(ls); /* condition x rounding x 50 */
    shcdi_least_squares_solve(ls, 10, found);
    for (size_t i = 0; i < 3 * 121; ++i) {
        assert_near(found[i], i < 3 * 49 ? wanted[i] : 0.0, tolerance);
    }
    shcdi_least_squares_free(ls);
    shcdi_samples_release(&s);
}

static void test_least_squares_lower_degree_is_solved_for_itself(void **state) {
    (void)state;
    double unused[3 * 121], from_high[3 * 25], from_low[3 * 25];
    shcdi_samples s = samples_of_series(10, 2000, unused, 2);
    shcdi_least_squares *high = create(8, &s), *low = create(4, &s);
    const double tolerance = 1e-14 / shcdi_least_squares_rcond(high);
    shcdi_least_squares_solve(high, 4, from_high);
    shcdi_least_squares_solve(low, 4, from_low);
    for (size_t i = 0; i < 3 * 25; ++i) {
        assert_near(from_high[i], from_low[i], tolerance);
    }
    shcdi_least_squares_free(high);
    shcdi_least_squares_free(low);
    shcdi_samples_release(&s);
}

/* The residual that the factorisation implies is the sum over the samples, and cannot grow with the
 * degree: the spaces are nested. */
static void test_least_squares_residual_is_true_and_falls(void **state) {
    (void)state;
    double unused[3 * 169], c[3 * 100], row[100], last = HUGE_VAL;
    shcdi_samples s = samples_of_series(12, 3000, unused, 3);
    shcdi_least_squares *ls = create(9, &s);
    for (int degree = 0; degree <= 9; ++degree) {
        double sum = 0.0;
        shcdi_least_squares_solve(ls, degree, c);
        for (size_t k = 0; k < s.n; ++k) {
            shcd_vec3 gap = s.points_m[k];
            assert_int_equal(shcd_harmonics(degree, s.directions[k], row, NULL, NULL), SHCD_OK);
            for (size_t i = 0; i < SHCD_COUNT(degree); ++i) {
                gap = shcd_mul_add(gap, -row[i],
                                   shcd_vec3_make(c[3 * i], c[3 * i + 1], c[3 * i + 2]));
            }
            sum += s.weights[k] * shcd_dot(gap, gap);
        }
        const double residual = shcdi_least_squares_residual(ls, degree);
        assert_near(residual, sum, 1e-12 * shcdi_least_squares_residual(ls, 0));
        assert_true(residual < last);
        last = residual;
    }
    shcdi_least_squares_free(ls);
    shcdi_samples_release(&s);
}

static void test_least_squares_with_too_few_samples_is_refused(void **state) {
    (void)state;
    double unused[3 * 9];
    shcdi_samples s = samples_of_series(2, 80, unused, 4); /* 100 terms wanted */
    shcdi_least_squares *ls = NULL;
    assert_int_equal(shcdi_least_squares_create(9, &s, &silent, &ls), SHCD_ERR_CONVERGENCE);
    assert_null(ls);
    shcdi_samples_release(&s);
}

static void test_least_squares_with_an_empty_hemisphere_is_refused(void **state) {
    (void)state;
    double unused[3 * 9];
    shcdi_samples s = samples_of_series(2, 4000, unused, 5);
    for (size_t k = 0; k < s.n; ++k) {
        s.directions[k].z = fabs(s.directions[k].z);
    }
    shcdi_least_squares *ls = NULL;
    assert_int_equal(shcdi_least_squares_create(20, &s, &silent, &ls), SHCD_ERR_CONVERGENCE);
    assert_null(ls);
    shcdi_samples_release(&s);
}

static void test_samples_weigh_the_area_and_stay_on_their_faces(void **state) {
    (void)state;
    const double axes[3] = {1.0, 2.0, 3.0};
    soup shape = soup_ellipsoid(10, axes);
    shcd_mesh *mesh = mesh_of(&shape);
    shcdi_body body;
    shcdi_samples s;
    double sum = 0.0;
    assert_int_equal(shcdi_body_init(&body, mesh), SHCD_OK);
    assert_int_equal(shcdi_samples_make(&s, &body, NULL, 5000), SHCD_OK);
    assert_true(s.n >= 5000 && s.n <= 5000 + body.n_triangles);
    for (size_t k = 0, face = 0; k < s.n; ++k) {
        assert_true(s.faces[k] == face || s.faces[k] == face + 1); /* no face is left out */
        face = s.faces[k];
        const uint32_t *t = body.triangles + 3 * face;
        const shcd_vec3 a = body.positions_m[t[0]];
        const shcd_vec3 normal = shcd_unit(
            shcd_cross(shcd_sub(body.positions_m[t[1]], a), shcd_sub(body.positions_m[t[2]], a)));
        assert_near(shcd_dot(normal, shcd_sub(s.points_m[k], a)), 0.0, 1e-14);
        sum += s.weights[k];
    }
    assert_near(sum, 1.0, 1e-12);
    shcdi_samples_release(&s);
    shcdi_body_release(&body);
    shcd_mesh_free(mesh);
    soup_free(&shape);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_least_squares_recovers_a_series_of_its_degree),
        cmocka_unit_test(test_least_squares_lower_degree_is_solved_for_itself),
        cmocka_unit_test(test_least_squares_residual_is_true_and_falls),
        cmocka_unit_test(test_least_squares_with_too_few_samples_is_refused),
        cmocka_unit_test(test_least_squares_with_an_empty_hemisphere_is_refused),
        cmocka_unit_test(test_samples_weigh_the_area_and_stay_on_their_faces),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
