/* SPDX-License-Identifier: BSD-3-Clause */
/* The current shape of a deforming body: the bounds of a displacement and of its derivatives, what
 * is accepted, and that a shape is a plain block of bytes.
 *
 * Along a great circle a series of degree L is a trigonometric polynomial of degree L: its values
 * at 2 L + 2 equispaced angles give all its derivatives, without the library's gradients. */
#include "query/growth.h"
#include "shcd/shape.h"
#include "support/bodies.h"
#include "support/shapes.h"

#include <string.h>

#define SEED 20261122u
#define TOP 30
#define ORDERS 4

/* ---- B_k ---- */

static shcd_vec3 sum_at(int degree, const double *coefficients, shcd_vec3 w) {
    static double y[SHCD_COUNT(TOP)];
    shcd_vec3 s = {0.0, 0.0, 0.0};
    assert_int_equal(shcd_harmonics(degree, w, y, NULL, NULL), SHCD_OK);
    for (size_t i = 0; i < SHCD_COUNT(degree); i++) {
        const double *c = coefficients + 3 * i;
        s = shcd_mul_add(s, y[i], shcd_vec3_make(c[0], c[1], c[2]));
    }
    return s;
}

/* Largest |D|, |D'|, |D''|, |D'''| at angles of the great circle through w and v. */
static void largest_on_circle(int degree, const double *d, shcd_vec3 w, shcd_vec3 v,
                              double largest[ORDERS]) {
    static shcd_vec3 value[2 * TOP + 2], even[TOP + 1], odd[TOP + 1];
    const int n = 2 * degree + 2, n_angles = 8 * degree + 8;
    for (int j = 0; j < n; j++) {
        const double t = 2.0 * BODIES_PI * j / n;
        value[j] = sum_at(degree, d, shcd_mul_add(shcd_scale(cos(t), w), sin(t), v));
    }
    for (int k = 0; k <= degree; k++) {
        even[k] = odd[k] = shcd_vec3_make(0.0, 0.0, 0.0);
        for (int j = 0; j < n; j++) {
            const double t = 2.0 * BODIES_PI * j * k / n, share = (k == 0 ? 1.0 : 2.0) / n;
            even[k] = shcd_mul_add(even[k], share * cos(t), value[j]);
            odd[k] = shcd_mul_add(odd[k], share * sin(t), value[j]);
        }
    }
    for (int j = 0; j < n_angles; j++) {
        for (int order = 0; order < ORDERS; order++) {
            shcd_vec3 x = {0.0, 0.0, 0.0};
            for (int k = 0; k <= degree; k++) {
                const double t = 2.0 * BODIES_PI * j * k / n_angles + 0.5 * BODIES_PI * order;
                const double power = order == 0 ? 1.0 : pow(k, order);
                x = shcd_mul_add(x, power * cos(t), even[k]);
                x = shcd_mul_add(x, power * sin(t), odd[k]);
            }
            largest[order] = fmax(largest[order], shcd_norm(x));
        }
    }
}

static void test_growth_bounds_sampled_derivatives(void **state) {
    (void)state;
    check_random random = {SEED};
    double share[ORDERS] = {0.0};
    const size_t n = check_scaled(60);
    for (size_t i = 0; i < n; i++) {
        static double a[3 * SHCD_COUNT(TOP)], b[3 * SHCD_COUNT(TOP)], d[3 * SHCD_COUNT(TOP)];
        double bound[ORDERS], largest[ORDERS] = {0.0};
        const int degree = 1 + (int)check_uniform(&random, 0.0, TOP);
        const double fall = check_uniform(&random, 0.0, 3.0);
        for (int l = 0; l <= degree; l++) {
            for (size_t k = 3 * SHCD_INDEX(l, -l); k < 3 * SHCD_INDEX(l, l) + 3; k++) {
                b[k] = check_normal(&random);
                a[k] = b[k] + check_normal(&random) * pow(l + 1.0, -fall);
                d[k] = a[k] - b[k];
            }
        }
        shcdi_growth(degree, a, b, bound);
        for (int circle = 0; circle < 20; circle++) {
            const shcd_vec3 w = bodies_random_direction(&random);
            const shcd_vec3 v = shcd_unit(shcd_cross(w, bodies_random_direction(&random)));
            largest_on_circle(degree, d, w, v, largest);
        }
        for (int k = 0; k < ORDERS; k++) {
            assert_at_most(largest[k], bound[k]);
            share[k] = fmax(share[k], largest[k] / bound[k]);
        }
    }
    print_message(
        "seed %u, %zu differences: largest sampled share of B_0..B_3: %.3f %.3f %.3f %.3f\n", SEED,
        n, share[0], share[1], share[2], share[3]);
    /* a bound ten times too large would say nothing */
    for (int k = 0; k < ORDERS; k++) {
        assert_true(share[k] > 0.1);
    }
}

/* A zonal function has its maximum, B_0, at the pole. The bound is rounded outward by 1e-11. */
static void test_growth_is_attained_by_zonal_functions(void **state) {
    (void)state;
    for (int l = 0; l <= SHCD_DEGREE_MAX; l++) {
        static double c[3 * SHCD_COUNT(SHCD_DEGREE_MAX)], none[3 * SHCD_COUNT(SHCD_DEGREE_MAX)];
        static double y[SHCD_COUNT(SHCD_DEGREE_MAX)];
        double bound[ORDERS];
        memset(c, 0, sizeof c);
        c[3 * SHCD_INDEX(l, 0) + 1] = -0.7;
        shcdi_growth(l, c, none, bound);
        assert_int_equal(shcd_harmonics(l, shcd_vec3_make(0.0, 0.0, 1.0), y, NULL, NULL), SHCD_OK);
        const double top = 0.7 * fabs(y[SHCD_INDEX(l, 0)]);
        assert_true(bound[0] >= top);
        assert_near(bound[0] / (1.0 + 1e-11) / top, 1.0, 1e-12);
    }
}

/* P_l(cos t) = sum over k of a_k a_(l-k) cos((l - 2 k) t), a_k = (2k)!/(4^k k!^2), so that
 * g_n(l) = sum a_k a_(l-k) (l - 2k)^(2n), all terms positive. */
static void test_growth_factors_are_derivatives_of_legendre_polynomials(void **state) {
    (void)state;
    static double c[3 * SHCD_COUNT(SHCD_DEGREE_MAX)], none[3 * SHCD_COUNT(SHCD_DEGREE_MAX)];
    long double a[SHCD_DEGREE_MAX + 1];
    a[0] = 1.0L;
    for (int k = 1; k <= SHCD_DEGREE_MAX; k++) {
        a[k] = a[k - 1] * (2.0L * k - 1.0L) / (2.0L * k);
    }
    for (int l = 0; l <= SHCD_DEGREE_MAX; l++) {
        double bound[ORDERS];
        memset(c, 0, sizeof c);
        c[3 * SHCD_INDEX(l, l)] = 1.0;
        shcdi_growth(l, c, none, bound);
        for (int n = 0; n < ORDERS; n++) {
            long double g = 0.0L;
            for (int k = 0; k <= l; k++) {
                const long double f = (long double)(l - 2 * k);
                long double power = 1.0L;
                for (int i = 0; i < 2 * n; i++) {
                    power *= f;
                }
                g += a[k] * a[l - k] * power;
            }
            const double expected =
                (double)sqrtl(g * (2.0L * l + 1.0L) / (4.0L * 3.141592653589793238L));
            assert_near(bound[n], expected, 2e-11 * expected);
            assert_true(bound[n] >= expected);
        }
    }
}

/* ---- the block ---- */

static void random_change(check_random *random, const shcd_model *model, double size, double *c) {
    const double *rest = shcd_model_coefficients(model);
    const size_t n = 3 * SHCD_COUNT(shcd_model_degree(model));
    for (size_t i = 0; i < n; i++) {
        c[i] = rest[i] + size * check_normal(random);
    }
}

static void test_shape_checks_its_arguments(void **state) {
    (void)state;
    check_random random = {SEED + 1};
    shcd_model *model = bodies_create_random(&random, 4, 0.05);
    shcd_model *other = bodies_create_random(&random, 5, 0.05);
    const size_t size = shcd_shape_size(model);
    unsigned char *memory = aligned_alloc(16, (size + 47) / 16 * 16);
    shcd_shape *shape = NULL, *untouched = NULL;
    double c[3 * SHCD_COUNT(5)];
    assert_non_null(memory);
    assert_int_equal(shcd_shape_size(NULL), 0);
    assert_true(size > 3 * SHCD_COUNT(4) * sizeof(double));
    assert_int_equal(shcd_shape_init(NULL, memory, size, &untouched), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_init(model, NULL, size, &untouched), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_init(model, memory, size - 1, &untouched), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_init(model, memory + 8, size, &untouched), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_init(model, memory, size, NULL), SHCD_ERR_ARGUMENT);
    assert_null(untouched);
    assert_int_equal(shcd_shape_init(model, memory, size, &shape), SHCD_OK);
    assert_ptr_equal(shape, memory);
    assert_memory_equal(shcd_shape_coefficients(shape), shcd_model_coefficients(model),
                        3 * SHCD_COUNT(4) * sizeof(double));
    assert_null(shcd_shape_coefficients(NULL));

    random_change(&random, model, 0.01, c);
    assert_int_equal(shcd_shape_set(NULL, shape, c, 0), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_set(model, NULL, c, 0), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_set(model, shape, NULL, 0), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_set(model, shape, c, -1), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_set(model, shape, c, 4), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_set(other, shape, c, 0), SHCD_ERR_ARGUMENT);
    assert_int_equal(shapes_info(model, shape).n_sets, 0);

    shcd_shape_info info = SHCD_SHAPE_INFO_INIT;
    assert_int_equal(shcd_shape_describe(NULL, shape, &info), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_describe(model, NULL, &info), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_describe(model, shape, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_describe(other, shape, &info), SHCD_ERR_ARGUMENT);
    info.struct_size = 0;
    assert_int_equal(shcd_shape_describe(model, shape, &info), SHCD_ERR_ARGUMENT);
    /* an older caller's smaller structure is not written beyond its end */
    info.struct_size = offsetof(shcd_shape_info, inflation_m);
    info.inflation_m = -7.0;
    assert_int_equal(shcd_shape_describe(model, shape, &info), SHCD_OK);
    assert_true(info.inflation_m == -7.0);

    shcd_proximity out;
    shcd_certificate certificate = {{0.0}, {0}};
    shcd_query_options fast = SHCD_QUERY_OPTIONS_INIT;
    const shcd_vec3 p = {1.0, 2.0, 3.0}, bad = {1.0, (double)NAN, 3.0};
    fast.tier = SHCD_TIER_FAST;
    assert_int_equal(shcd_shape_closest(NULL, shape, p, NULL, &out), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_closest(model, shape, p, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_shape_closest(model, shape, bad, NULL, &out), SHCD_ERR_NOT_FINITE);
    assert_int_equal(shcd_closest_next(NULL, shape, p, NULL, &certificate, &out),
                     SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_closest_next(model, shape, p, NULL, NULL, &out), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_closest_next(model, shape, p, NULL, &certificate, NULL),
                     SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_closest_next(model, shape, p, &fast, &certificate, &out),
                     SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_closest_next(model, shape, bad, NULL, &certificate, &out),
                     SHCD_ERR_NOT_FINITE);
    assert_int_equal(shcd_shape_track(model, shape, p, bad, &out), SHCD_ERR_NOT_FINITE);
    assert_int_equal(shcd_shape_track(model, NULL, bad, p, &out), SHCD_ERR_NOT_FINITE);
    free(memory);
    shcd_model_free(other);
    shcd_model_free(model);
}

static void test_shape_refuses_coefficients_that_are_not_finite(void **state) {
    (void)state;
    check_random random = {SEED + 2};
    shcd_model *model = bodies_create_random(&random, 4, 0.05);
    const size_t size = shcd_shape_size(model);
    shcd_shape *shape = shapes_create(model);
    double c[3 * SHCD_COUNT(4)];
    random_change(&random, model, 0.01, c);
    assert_int_equal(shcd_shape_set(model, shape, c, SHCD_FOLLOW_REFRESH), SHCD_OK);
    void *before = malloc(size);
    assert_non_null(before);
    memcpy(before, shape, size);
    const double bad[] = {(double)NAN, HUGE_VAL, -HUGE_VAL, 1e300};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        for (size_t at = 0; at < 3 * SHCD_COUNT(4); at += 37) {
            const double keep = c[at];
            c[at] = bad[i];
            assert_int_equal(shcd_shape_set(model, shape, c, SHCD_FOLLOW_AUTO),
                             SHCD_ERR_NOT_FINITE);
            assert_memory_equal(shape, before, size);
            c[at] = keep;
        }
    }
    free(before);
    free(shape);
    shcd_model_free(model);
}

static void test_shape_is_relocatable(void **state) {
    (void)state;
    check_random random = {SEED + 3};
    shcd_model *model = bodies_create_random(&random, 6, 0.05);
    const size_t size = shcd_shape_size(model);
    shcd_shape *shape = shapes_create(model);
    double c[3 * SHCD_COUNT(6)];
    for (int follow = SHCD_FOLLOW_AUTO; follow <= SHCD_FOLLOW_PROGRESSIVE; follow++) {
        random_change(&random, model, 0.003, c);
        assert_int_equal(shcd_shape_set(model, shape, c, follow), SHCD_OK);
        shcd_shape *copy = memcpy(shapes_block(model), shape, size);
        shapes_assert_same_answers(model, shape, copy, &random);
        /* and goes on alike */
        random_change(&random, model, 0.003, c);
        assert_int_equal(shcd_shape_set(model, shape, c, follow), SHCD_OK);
        assert_int_equal(shcd_shape_set(model, copy, c, follow), SHCD_OK);
        assert_memory_equal(shape, copy, size);
        free(copy);
    }
    free(shape);
    shcd_model_free(model);
}

static void test_rest_shape_answers_like_the_model(void **state) {
    (void)state;
    check_random random = {SEED + 4};
    shcd_model *model = bodies_create_random(&random, 8, 0.05);
    const shcd_model_info info = bodies_info(model);
    shcd_shape *shape = shapes_create(model), *set = shapes_create(model);
    for (int i = 0; i < 500; i++) {
        shcd_proximity a, b;
        const shcd_vec3 p = shapes_point_near(&random, &info);
        memset(&a, 0, sizeof a);
        memset(&b, 0, sizeof b);
        assert_int_equal(shcd_closest(model, p, NULL, &a), SHCD_OK);
        assert_int_equal(shcd_shape_closest(model, shape, p, NULL, &b), SHCD_OK);
        assert_memory_equal(&a, &b, sizeof a);
        assert_int_equal(shcd_track(model, p, a.parameter, &a), SHCD_OK);
        assert_int_equal(shcd_shape_track(model, shape, p, b.parameter, &b), SHCD_OK);
        assert_memory_equal(&a, &b, sizeof a);
    }
    /* setting what already holds changes no answer, and neither does going there and back */
    assert_int_equal(
        shcd_shape_set(model, set, shcd_model_coefficients(model), SHCD_FOLLOW_INFLATE), SHCD_OK);
    shapes_assert_same_answers(model, shape, set, &random);
    double c[3 * SHCD_COUNT(8)];
    random_change(&random, model, 0.01, c);
    assert_int_equal(shcd_shape_set(model, set, c, SHCD_FOLLOW_INFLATE), SHCD_OK);
    assert_int_equal(
        shcd_shape_set(model, set, shcd_model_coefficients(model), SHCD_FOLLOW_INFLATE), SHCD_OK);
    shapes_assert_same_answers(model, shape, set, &random);
    const shcd_shape_info back = shapes_info(model, set);
    assert_true(back.inflation_m == 0.0 && back.displacement_bound[0] == 0.0);
    assert_int_equal(back.n_sets, 3);
    free(set);
    free(shape);
    shcd_model_free(model);
}

static void test_follow_decides_on_refreshes(void **state) {
    (void)state;
    check_random random = {SEED + 5};
    shcd_model *model = bodies_create_random(&random, 6, 0.05);
    const shcd_model_info rest = bodies_info(model);
    const double *at_rest = shcd_model_coefficients(model);
    shcd_shape *shape = shapes_create(model);
    double c[3 * SHCD_COUNT(6)], bound[ORDERS];
    uint64_t refreshes = 0, automatic = 0, spared = 0;
    for (uint64_t i = 1; i <= 300; i++) {
        const int follow = (int)check_uniform(&random, 0.0, 3.0);
        random_change(&random, model,
                      rest.max_deviation_m * pow(10.0, check_uniform(&random, -4.0, 1.0)), c);
        const shcd_shape_info before = shapes_info(model, shape);
        assert_int_equal(shcd_shape_set(model, shape, c, follow), SHCD_OK);
        const shcd_shape_info after = shapes_info(model, shape);
        const int refreshed = after.n_refreshes != before.n_refreshes;
        refreshes += (uint64_t)refreshed;
        assert_int_equal(after.n_refreshes, refreshes);
        assert_int_equal(after.n_sets, i);
        if (follow == SHCD_FOLLOW_REFRESH) {
            assert_true(refreshed);
        } else if (follow == SHCD_FOLLOW_INFLATE) {
            assert_false(refreshed);
        } else {
            /* never left staler than the leaves' own deviation */
            assert_at_most(after.inflation_m, rest.max_deviation_m);
            automatic += (uint64_t)refreshed;
            spared += (uint64_t)!refreshed;
        }
        if (refreshed) {
            assert_true(after.inflation_m == 0.0);
        }
        shcdi_growth(6, c, at_rest, bound);
        assert_memory_equal(bound, after.displacement_bound, sizeof bound);
        for (int k = 0; k < 50; k++) {
            shcd_vec3 s;
            const shcd_vec3 w = bodies_random_direction(&random);
            assert_int_equal(shcd_shape_surface(model, shape, w, &s, NULL, NULL), SHCD_OK);
            assert_at_most(shcd_norm(shcd_sub(s, rest.centre_m)), after.radius_m);
        }
    }
    assert_true(automatic > 10 && spared > 10);
    free(shape);
    shcd_model_free(model);
}

static void test_shape_surface_is_the_sum_of_harmonics(void **state) {
    (void)state;
    check_random random = {SEED + 6};
    shcd_model *model = bodies_create_random(&random, 15, 0.05);
    shcd_shape *shape = shapes_create(model);
    static double c[3 * SHCD_COUNT(15)], g[3 * SHCD_COUNT(15)];
    for (int i = 0; i < 100; i++) {
        const shcd_vec3 w = bodies_random_direction(&random);
        shcd_vec3 s, n;
        double j[9], sum[9] = {0.0};
        random_change(&random, model, 0.05, c);
        assert_int_equal(shcd_shape_set(model, shape, c, i % 3), SHCD_OK);
        assert_memory_equal(shcd_shape_coefficients(shape), c, sizeof c);
        assert_int_equal(shcd_shape_surface(model, shape, w, &s, &n, j), SHCD_OK);
        const shcd_vec3 expected = sum_at(15, c, w);
        assert_int_equal(shcd_harmonics(15, w, NULL, g, NULL), SHCD_OK);
        for (size_t h = 0; h < SHCD_COUNT(15); h++) {
            for (size_t k = 0; k < 9; k++) {
                sum[k] += c[3 * h + k / 3] * g[3 * h + k % 3];
            }
        }
        /* size times the basis' 1e-13 per degree: sum over l of |c_l| s_l is below 20, times l for
         * the slopes */
        assert_near(shcd_norm(shcd_sub(s, expected)), 0.0, 2e-12);
        for (int k = 0; k < 9; k++) {
            assert_near(j[k], sum[k], 3e-11);
        }
        assert_near(shcd_norm(n), 1.0, 1e-14);
        for (int k = 0; k < 3; k++) {
            assert_near(n.x * j[k] + n.y * j[3 + k] + n.z * j[6 + k], 0.0, 3e-11);
        }
    }
    assert_int_equal(
        shcd_shape_surface(model, NULL, shcd_vec3_make(1.0, 0.0, 0.0), NULL, NULL, NULL),
        SHCD_ERR_ARGUMENT);
    assert_int_equal(
        shcd_shape_surface(NULL, shape, shcd_vec3_make(1.0, 0.0, 0.0), NULL, NULL, NULL),
        SHCD_ERR_ARGUMENT);
    free(shape);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_growth_bounds_sampled_derivatives),
        cmocka_unit_test(test_growth_is_attained_by_zonal_functions),
        cmocka_unit_test(test_growth_factors_are_derivatives_of_legendre_polynomials),
        cmocka_unit_test(test_shape_checks_its_arguments),
        cmocka_unit_test(test_shape_refuses_coefficients_that_are_not_finite),
        cmocka_unit_test(test_shape_is_relocatable),
        cmocka_unit_test(test_rest_shape_answers_like_the_model),
        cmocka_unit_test(test_follow_decides_on_refreshes),
        cmocka_unit_test(test_shape_surface_is_the_sum_of_harmonics),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
