/* SPDX-License-Identifier: BSD-3-Clause */
/* Queries on bodies without a closed form: random ones against brute force, a bent one against its
 * implicit equation, and what must not change when a body is moved, turned or scaled; the tracker.
 *
 * Brute force polishes the best of some 40 000 samples: what it finds is an upper bound of the
 * distance, so the exact answer may be smaller but never larger by more than the tolerance. */
#include "shcd/shcd.h"
#include "support/bodies.h"
#include "support/brute.h"
#include "support/check.h"

#define TRUNCATED SHCD_PROXIMITY_TRUNCATED
#define UNSURE SHCD_PROXIMITY_SIGN_UNSURE
#define NOT_STATIONARY SHCD_PROXIMITY_NOT_STATIONARY

typedef struct subject {
    shcd_model *model;
    shcd_model_info info;
    brute *dense, *coarse;
    double deviation; /* where |d| is larger, the winding number around `coarse` is that of S */
    size_t n, truncated, unsure, signs, not_stationary;
} subject;

static subject subject_open(shcd_model *model) {
    subject s = {model,
                 bodies_info(model),
                 brute_create(model, 80),
                 brute_create(model, 40),
                 0.0,
                 0,
                 0,
                 0,
                 0,
                 0};
    assert_non_null(s.dense);
    assert_non_null(s.coarse);
    s.deviation = 2.0 * brute_deviation(s.coarse);
    return s;
}

static void subject_close(subject *s) {
    brute_free(s->dense);
    brute_free(s->coarse);
    shcd_model_free(s->model);
}

static shcd_proximity query(const shcd_model *model, shcd_vec3 p, int tier) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity got;
    options.tier = tier;
    assert_int_equal(shcd_closest(model, p, &options, &got), SHCD_OK);
    return got;
}

/* By default Newton ends where the interval meets the tolerance; this goes on down to rounding, and
 * leaves open whether that can be proven. */
static shcd_proximity query_sharp(const shcd_model *model, shcd_vec3 p) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity got;
    options.tolerance = 1e-15;
    options.patches_max = 5000;
    assert_int_equal(shcd_closest(model, p, &options, &got), SHCD_OK);
    return got;
}

static shcd_vec3 random_point(const subject *s, check_random *random) {
    shcd_vec3 at, n;
    if (check_uniform(random, 0.0, 1.0) < 0.3) {
        return shcd_mul_add(s->info.centre_m, check_uniform(random, 0.0, 3.0) * s->info.radius_m,
                            bodies_random_direction(random));
    }
    assert_int_equal(
        shcd_model_surface(s->model, -1, bodies_random_direction(random), &at, &n, NULL), SHCD_OK);
    const double size = pow(10.0, check_uniform(random, -7.0, -0.5)) * s->info.diagonal_m;
    return shcd_mul_add(at, check_uniform(random, -size, size), n);
}

/* Size of the true distance lies in [*low, *high] by the answer. */
static void sizes(const shcd_proximity *got, double *low, double *high) {
    const int both = got->lower_m < 0.0 && got->upper_m > 0.0;
    *low = both ? 0.0 : fmin(fabs(got->lower_m), fabs(got->upper_m));
    *high = fmax(fabs(got->lower_m), fabs(got->upper_m));
}

static void check_point(subject *s, shcd_vec3 p) {
    const shcd_proximity exact = query(s->model, p, SHCD_TIER_EXACT);
    const shcd_proximity fast = query(s->model, p, SHCD_TIER_FAST);
    const double allowed = 1e-9 * fmax(s->info.diagonal_m, fabs(exact.distance_m));
    shcd_vec3 w;
    const double found = brute_distance(s->dense, p, &w);
    double low, high;
    sizes(&exact, &low, &high);
    assert_true(low <= found);
    assert_true(exact.lower_m <= exact.distance_m && exact.distance_m <= exact.upper_m);
    s->n++;
    s->truncated += (exact.flags & TRUNCATED) != 0;
    s->unsure += (exact.flags & UNSURE) != 0;
    s->not_stationary += (exact.flags & NOT_STATIONARY) != 0;
    if ((exact.flags & TRUNCATED) == 0) {
        assert_at_most(fabs(exact.distance_m) - found, allowed);
    }
    sizes(&fast, &low, &high);
    assert_true(low <= fabs(exact.distance_m) && low <= found);
    assert_true(high >= fmin(found, fabs(exact.distance_m)) * (1.0 - 1e-15));
    assert_at_most(fabs(exact.distance_m) - fabs(fast.distance_m), allowed);
    if (found > s->deviation) {
        const int inside = brute_winding(s->coarse, p) > 0.5;
        if (((exact.flags & UNSURE) == 0 && (exact.distance_m < 0.0) != inside) ||
            ((fast.flags & UNSURE) == 0 && (fast.distance_m < 0.0) != inside)) {
            fail_msg("p (%.17g, %.17g, %.17g): inside %d, exact %.17g flags %u, fast %.17g %u", p.x,
                     p.y, p.z, inside, exact.distance_m, exact.flags, fast.distance_m, fast.flags);
        }
        s->signs += (exact.flags & UNSURE) == 0;
    }
    sizes(&exact, &low, &high);
    const shcd_proximity sharp = query_sharp(s->model, p);
    double sharp_low, sharp_high;
    sizes(&sharp, &sharp_low, &sharp_high);
    assert_true(sharp_low <= high && low <= sharp_high);
    if ((sharp.flags & (NOT_STATIONARY | UNSURE)) == 0) {
        /* p - S along the normal: Newton stops where a step would lower f = d^2/2 by less than its
         * rounding, 1e-15 d (d + |p|): an angle of the square root of that over d */
        const shcd_vec3 r = shcd_sub(p, sharp.point_m);
        const double across = shcd_norm(shcd_cross(r, sharp.normal));
        assert_at_most(across, 1e-6 * (shcd_norm(r) + 1e-6 * s->info.diagonal_m));
    }
}

/* ---- against brute force and winding numbers ---- */

static void check_random_bodies(int degree, double rough, uint64_t seed, size_t n) {
    check_random random = {seed};
    for (int b = 0; b < 2; b++) {
        subject s = subject_open(bodies_create_random(&random, degree, rough));
        for (size_t i = 0; i < check_scaled(n); i++) {
            check_point(&s, random_point(&s, &random));
        }
        print_message(
            "degree %d, roughness %g: embedded %d, star %d; of %zu: truncated %zu, unsure "
            "%zu, signs checked %zu, not stationary %zu\n",
            degree, rough, s.info.is_embedded, s.info.is_star_shaped, s.n, s.truncated, s.unsure,
            s.signs, s.not_stationary);
        assert_at_most((double)s.truncated, 0.01 * (double)s.n + 1.0);
        subject_close(&s);
    }
}

static void test_random_smooth_bodies(void **state) {
    (void)state;
    check_random_bodies(15, 0.05, 101, 400);
    check_random_bodies(4, 0.1, 102, 400);
}

static void test_random_rough_bodies(void **state) {
    (void)state;
    check_random_bodies(15, 0.2, 103, 400);
    check_random_bodies(25, 0.1, 104, 150);
}

static void test_random_bodies_that_cut_themselves(void **state) {
    (void)state;
    check_random_bodies(15, 0.6, 105, 300);
    check_random_bodies(6, 0.8, 106, 300);
}

static void test_bent_bodies_have_the_sign_of_their_equation(void **state) {
    static const double shape[4][4] = {{0.5, 0.6, 1.2, 3.0},
                                       {0.02, 0.5, 1.0, 1.0}, /* a sheet */
                                       {0.1, 0.1, 2.0, 4.0},  /* a hook */
                                       {1.0, 1.0, 1.0, 0.2}};
    check_random random = {107};
    (void)state;
    for (int b = 0; b < 4; b++) {
        subject s =
            subject_open(bodies_create_bent(shape[b][0], shape[b][1], shape[b][2], shape[b][3]));
        for (size_t i = 0; i < check_scaled(400); i++) {
            const shcd_vec3 p = random_point(&s, &random);
            const shcd_proximity exact = query(s.model, p, SHCD_TIER_EXACT);
            const shcd_proximity fast = query(s.model, p, SHCD_TIER_FAST);
            check_point(&s, p);
            /* the equation's own rounding is 1e-14 of distances of order one */
            const double level = bodies_bent_level(p, shape[b]) - 1.0;
            if (fabs(level) > 1e-12) {
                assert_true((exact.flags & UNSURE) != 0 ||
                            (exact.distance_m < 0.0) == (level < 0.0));
                assert_true((fast.flags & UNSURE) != 0 || (fast.distance_m < 0.0) == (level < 0.0));
            }
            /* a sign is missing only within the tolerance of the surface */
            if ((exact.flags & TRUNCATED) == 0 &&
                fabs(exact.distance_m) > 4e-9 * s.info.diagonal_m) {
                assert_true((exact.flags & UNSURE) == 0);
            }
        }
        assert_int_equal(s.truncated, 0);
        subject_close(&s);
    }
}

/* ---- invariance ---- */

static void compare_moved(const shcd_model *a, const shcd_model *b, double scale, shcd_quat q,
                          shcd_vec3 shift, double rounding, check_random *random) {
    const shcd_model_info info = bodies_info(a);
    for (size_t i = 0; i < check_scaled(150); i++) {
        const shcd_vec3 p =
            shcd_mul_add(info.centre_m, check_uniform(random, 0.0, 2.0) * info.radius_m,
                         bodies_random_direction(random));
        const shcd_vec3 moved = shcd_add(shift, shcd_scale(scale, shcd_rotate(q, p)));
        const shcd_proximity x = query(a, p, SHCD_TIER_EXACT);
        const shcd_proximity y = query(b, moved, SHCD_TIER_EXACT);
        double low[2], high[2];
        sizes(&x, &low[0], &high[0]);
        sizes(&y, &low[1], &high[1]);
        /* both intervals hold the one distance, up to what moving p and the body rounds */
        assert_true(low[1] <= scale * high[0] + rounding);
        assert_true(scale * low[0] <= high[1] + rounding);
        if ((x.flags | y.flags) == 0) {
            assert_near(y.distance_m, scale * x.distance_m,
                        1e-9 * scale * fmax(info.diagonal_m, fabs(x.distance_m)) + rounding);
        } else if (((x.flags | y.flags) & UNSURE) == 0) {
            assert_true((x.distance_m < 0.0) == (y.distance_m < 0.0));
        }
    }
}

static void test_distance_moves_turns_and_scales_with_the_body(void **state) {
    enum { DEGREE = 9, COUNT = 100 };
    static const double scales[4] = {1.0, 1e-6, 1e6, 0.37};
    static const double shifts[4] = {1.0, 1e-6, 0.0, 1e6};
    check_random random = {108};
    double c[3 * COUNT], moved[3 * COUNT];
    (void)state;
    bodies_random_coefficients(&random, DEGREE, 0.15, c);
    shcd_model *a = bodies_create(DEGREE, c);
    for (int n = 0; n < 4; n++) {
        const shcd_vec3 axis = bodies_random_direction(&random);
        const double angle = check_uniform(&random, 0.0, 3.0);
        const shcd_quat q = {cos(angle), sin(angle) * axis.x, sin(angle) * axis.y,
                             sin(angle) * axis.z};
        const shcd_vec3 shift = shcd_scale(shifts[n], bodies_random_direction(&random));
        for (size_t i = 0; i < COUNT; i++) {
            const shcd_vec3 v = {c[3 * i], c[3 * i + 1], c[3 * i + 2]};
            shcd_vec3 u = shcd_scale(scales[n], shcd_rotate(q, v));
            if (i == 0) { /* Y_00 = 1/sqrt(4 pi) */
                u = shcd_mul_add(u, sqrt(4.0 * BODIES_PI), shift);
            }
            moved[3 * i] = u.x;
            moved[3 * i + 1] = u.y;
            moved[3 * i + 2] = u.z;
        }
        shcd_model *b = bodies_create(DEGREE, moved);
        compare_moved(a, b, scales[n], q, shift, 2e-15 * (shifts[n] + 20.0 * scales[n]), &random);
        shcd_model_free(b);
    }
    shcd_model_free(a);
}

static void test_body_far_from_the_origin_keeps_true_intervals_and_signs(void **state) {
    const double shape[4] = {0.5, 0.6, 1.2, 3.0};
    const shcd_vec3 shift = {1e6, -2e6, 5e5};
    check_random random = {109};
    double c[27];
    (void)state;
    bodies_project(2, bodies_bent, shape, c);
    for (size_t k = 0; k < 3; k++) {
        c[k] += sqrt(4.0 * BODIES_PI) * (k == 0 ? shift.x : k == 1 ? shift.y : shift.z);
    }
    subject near = subject_open(bodies_create_bent(shape[0], shape[1], shape[2], shape[3]));
    shcd_model *far = bodies_create(2, c);
    for (size_t i = 0; i < check_scaled(300); i++) {
        const shcd_vec3 p = random_point(&near, &random);
        const shcd_vec3 moved = shcd_add(shift, p), back = shcd_sub(moved, shift);
        const double truth = query(near.model, back, SHCD_TIER_EXACT).distance_m;
        const shcd_proximity got = query(far, moved, SHCD_TIER_EXACT);
        /* coefficients of 7e6 round to 9e-10, S and p to as much: all inside the interval */
        assert_true(got.lower_m <= truth + 1e-9 * 4.0 && truth <= got.upper_m + 1e-9 * 4.0);
        assert_near(fabs(got.distance_m), fabs(truth), 1e-7);
        if ((got.flags & UNSURE) == 0 && fabs(truth) > 1e-8) {
            assert_true((got.distance_m < 0.0) == (truth < 0.0));
        }
    }
    shcd_model_free(far);
    subject_close(&near);
}

/* ---- tracker ---- */

static void test_track_follows_the_exact_foot_of_a_slow_tool(void **state) {
    check_random random = {110};
    subject s = subject_open(bodies_create_random(&random, 15, 0.05));
    (void)state;
    for (size_t i = 0; i < check_scaled(40); i++) {
        shcd_vec3 at, n;
        const shcd_vec3 w = bodies_random_direction(&random);
        assert_int_equal(shcd_model_surface(s.model, -1, w, &at, &n, NULL), SHCD_OK);
        const double height = check_uniform(&random, -0.02, 0.05) * s.info.diagonal_m;
        shcd_vec3 p = shcd_mul_add(at, height, n);
        shcd_proximity last = query(s.model, p, SHCD_TIER_EXACT);
        const shcd_vec3 step =
            shcd_scale(1e-4 * s.info.diagonal_m, bodies_random_direction(&random));
        for (int tick = 0; tick < 50; tick++) {
            shcd_proximity now;
            p = shcd_add(p, step);
            assert_int_equal(shcd_track(s.model, p, last.parameter, &now), SHCD_OK);
            assert_true(now.n_newton <= 16);
            assert_true(now.lower_m == -HUGE_VAL && now.upper_m == HUGE_VAL);
            assert_int_equal(now.flags & ~(uint32_t)NOT_STATIONARY, 0);
            /* local and continuous: with curvatures of 1/(0.1 diagonal) and no focal point within
             * the heights above, the foot moves a few times as far as the tool */
            assert_true(shcd_norm(shcd_sub(now.point_m, last.point_m)) <= 20.0 * shcd_norm(step));
            const shcd_proximity exact = query(s.model, p, SHCD_TIER_EXACT);
            assert_true(fabs(now.distance_m) >= fabs(exact.distance_m) - 1e-9 * s.info.diagonal_m);
            if (shcd_norm(shcd_sub(exact.parameter, now.parameter)) < 1e-3) {
                assert_near(now.distance_m, exact.distance_m, 1e-9 * s.info.diagonal_m);
                assert_true((now.flags & NOT_STATIONARY) == 0);
            }
            last = now;
        }
    }
    subject_close(&s);
}

static void test_track_never_ends_farther_than_it_began(void **state) {
    check_random random = {111};
    shcd_model *model = bodies_create_random(&random, 12, 0.3);
    const shcd_model_info info = bodies_info(model);
    size_t not_stationary = 0, inward = 0;
    const size_t n = check_scaled(1500);
    (void)state;
    for (size_t i = 0; i < n; i++) {
        const shcd_vec3 p =
            shcd_mul_add(info.centre_m, check_uniform(&random, 0.0, 2.0) * info.radius_m,
                         bodies_random_direction(&random));
        const shcd_vec3 w = bodies_random_direction(&random);
        shcd_vec3 at;
        shcd_proximity got;
        assert_int_equal(shcd_model_surface(model, -1, w, &at, NULL, NULL), SHCD_OK);
        assert_int_equal(shcd_track(model, p, shcd_scale(1e-30, w), &got), SHCD_OK);
        assert_true(fabs(got.distance_m) <= shcd_norm(shcd_sub(p, at)) * (1.0 + 1e-13));
        assert_near(fabs(got.distance_m), shcd_norm(shcd_sub(p, got.point_m)),
                    4e-15 * (info.radius_m + shcd_norm(p)));
        const double along = shcd_dot(shcd_sub(p, got.point_m), got.normal);
        assert_true((got.distance_m < 0.0) == (along < 0.0));
        if ((got.flags & NOT_STATIONARY) == 0) {
            const double across = shcd_norm(shcd_cross(shcd_sub(p, got.point_m), got.normal));
            assert_at_most(across, 1e-5 * (info.diagonal_m + fabs(got.distance_m)));
        }
        not_stationary += (got.flags & NOT_STATIONARY) != 0;
        inward += along < 0.0;
    }
    print_message("of %zu random starts %zu are not stationary after 16 steps\n", n,
                  not_stationary);
    /* a start anywhere on the body needs more steps now and then; the rule is that it does not */
    assert_true(not_stationary < n / 4);
    assert_true(inward > 0 && inward < n);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_smooth_bodies),
        cmocka_unit_test(test_random_rough_bodies),
        cmocka_unit_test(test_random_bodies_that_cut_themselves),
        cmocka_unit_test(test_bent_bodies_have_the_sign_of_their_equation),
        cmocka_unit_test(test_distance_moves_turns_and_scales_with_the_body),
        cmocka_unit_test(test_body_far_from_the_origin_keeps_true_intervals_and_signs),
        cmocka_unit_test(test_track_follows_the_exact_foot_of_a_slow_tool),
        cmocka_unit_test(test_track_never_ends_farther_than_it_began)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
