/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact and fast queries against closed forms: spheres and ellipsoids (as bodies of degree 2, which
 * are searched), their centres, focal points and medial surfaces; caps, tolerances, arguments,
 * repetition, and no allocation.
 *
 * The oracle works in long double; an interval must hold its value without any tolerance, since the
 * interval is widened by the rounding of numbers of the size of p and of the body. */
#include "shcd/shcd.h"
#include "support/allocations.h"
#include "support/bodies.h"
#include "support/check.h"
#include "support/ellipsoid.h"

#define TRUNCATED SHCD_PROXIMITY_TRUNCATED
#define UNSURE SHCD_PROXIMITY_SIGN_UNSURE
#define NOT_STATIONARY SHCD_PROXIMITY_NOT_STATIONARY

/* ---- checks ---- */

typedef struct subject {
    double axes[3];
    shcd_model *model;
    shcd_model_info info;
    size_t n, truncated, unsure, not_stationary;
} subject;

static subject subject_open(double a, double b, double c) {
    shcd_model *model = bodies_searched(bodies_create_ellipsoid(a, b, c));
    subject s = {{a, b, c}, model, SHCD_MODEL_INFO_INIT, 0, 0, 0, 0};
    s.info = bodies_info(s.model);
    return s;
}

/* Turned in the parameter sphere: the same surface, but no symmetry in common with the tree. */
static subject subject_open_turned(double a, double b, double c, uint64_t seed) {
    check_random random = {seed};
    shcd_model *model = bodies_searched(bodies_create_ellipsoid_turned(a, b, c, &random));
    subject s = {{a, b, c}, model, SHCD_MODEL_INFO_INIT, 0, 0, 0, 0};
    s.info = bodies_info(s.model);
    return s;
}

static shcd_proximity query(const subject *s, shcd_vec3 p, int tier, double tolerance) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity got;
    options.tier = tier;
    options.tolerance = tolerance;
    assert_int_equal(shcd_closest(s->model, p, &options, &got), SHCD_OK);
    return got;
}

/* What every answer of the exact and fast tiers must satisfy, whatever its flags. */
static void assert_sound(const subject *s, shcd_vec3 p, const shcd_proximity *got, double truth) {
    const double rounding = 4e-15 * (s->info.diagonal_m + shcd_norm(p));
    shcd_vec3 at;
    if (!(got->lower_m <= truth && truth <= got->upper_m)) {
        fail_msg("p (%.17g, %.17g, %.17g): %.17g is not in [%.17g, %.17g], flags %u", p.x, p.y, p.z,
                 truth, got->lower_m, got->upper_m, got->flags);
    }
    assert_true(got->lower_m <= got->distance_m && got->distance_m <= got->upper_m);
    /* The point is on the surface, and at that distance. The last Newton step d is taken along a
     * Taylor expansion: m3 d^3/6, by which the interval is wider than the distance; and as a step
     * in the tangent plane it turns the parameter by atan d, off by m1 d^3/3. Along a great circle
     * of an ellipsoid the third derivative is the first one, negated: m1 <= m3. */
    const double size = fmax(fabs(got->lower_m), fabs(got->upper_m));
    assert_int_equal(shcd_model_surface(s->model, -1, got->parameter, &at, NULL, NULL), SHCD_OK);
    assert_at_most(shcd_norm(shcd_sub(at, got->point_m)),
                   rounding + 3.0 * (size - fabs(got->distance_m)));
    assert_near(shcd_norm(shcd_sub(p, got->point_m)), fabs(got->distance_m), rounding);
    assert_near(shcd_norm(got->parameter), 1.0, 1e-15);
    assert_near(shcd_norm(got->normal), 1.0, 1e-15);
    if ((got->flags & UNSURE) == 0 && (got->distance_m < 0.0) != (truth < 0.0)) {
        fail_msg("p (%.17g, %.17g, %.17g): sign of %.17g, truth %.17g, flags %u", p.x, p.y, p.z,
                 got->distance_m, truth, got->flags);
    }
}

/* Asked for rounding, Newton goes on until there: the point is the surface's at its parameter, and
 * p is that far from it. Whether so small an interval can be proven is not the question here. */
static shcd_proximity check_sharp(const subject *s, shcd_vec3 p, double truth) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity got;
    shcd_vec3 at;
    options.tolerance = 1e-15;
    options.patches_max = 2000;
    assert_int_equal(shcd_closest(s->model, p, &options, &got), SHCD_OK);
    assert_sound(s, p, &got, truth);
    assert_int_equal(shcd_model_surface(s->model, -1, got.parameter, &at, NULL, NULL), SHCD_OK);
    if ((got.flags & NOT_STATIONARY) == 0) {
        assert_at_most(shcd_norm(shcd_sub(at, got.point_m)),
                       4e-15 * (s->info.diagonal_m + shcd_norm(p)));
    }
    return got;
}

static void check_exact(subject *s, shcd_vec3 p) {
    const double truth = ellipsoid_distance(s->axes, p);
    const shcd_proximity got = query(s, p, SHCD_TIER_EXACT, 0.0);
    const double allowed = 1e-9 * fmax(s->info.diagonal_m, fabs(truth));
    assert_sound(s, p, &got, truth);
    (void)check_sharp(s, p, truth);
    s->n++;
    s->truncated += (got.flags & TRUNCATED) != 0;
    s->unsure += (got.flags & UNSURE) != 0;
    if ((got.flags & TRUNCATED) == 0) {
        /* unsure: the interval covers both signs, each side as narrow as promised */
        if ((got.flags & UNSURE) == 0) {
            assert_at_most(got.upper_m - got.lower_m, allowed);
        }
        assert_near(fabs(got.distance_m), fabs(truth), allowed);
    }
    /* Only what lies within the tolerance of the surface has no sign, or a foot that Newton did not
     * reach: around a needle the valley of f is narrow and bends, and steps are short. */
    s->not_stationary += (got.flags & NOT_STATIONARY) != 0;
    if ((got.flags & (TRUNCATED | NOT_STATIONARY)) == 0 && fabs(truth) > 2.0 * allowed) {
        assert_true((got.flags & UNSURE) == 0);
    }
}

static void check_fast(const subject *s, shcd_vec3 p) {
    const double truth = ellipsoid_distance(s->axes, p);
    const shcd_proximity got = query(s, p, SHCD_TIER_FAST, 0.0);
    assert_sound(s, p, &got, truth);
    assert_true((got.flags & TRUNCATED) != 0 || (got.flags & UNSURE) != 0 ||
                got.upper_m - got.lower_m <= 1e-9 * fmax(s->info.diagonal_m, fabs(truth)));
}

static shcd_vec3 random_near(subject *s, check_random *random) {
    const shcd_vec3 w = bodies_random_direction(random);
    shcd_vec3 at, n;
    assert_int_equal(shcd_model_surface(s->model, -1, w, &at, &n, NULL), SHCD_OK);
    const double size = pow(10.0, check_uniform(random, -12.0, -0.3)) * s->info.diagonal_m;
    return shcd_mul_add(at, check_uniform(random, -size, size), n);
}

static shcd_vec3 random_in_box(subject *s, check_random *random) {
    const double x = check_uniform(random, -3.0, 3.0), y = check_uniform(random, -3.0, 3.0);
    const double z = check_uniform(random, -3.0, 3.0);
    return shcd_vec3_make(x * s->axes[0], y * s->axes[1], z * s->axes[2]);
}

/* ---- spheres and ellipsoids ---- */

static void test_spheres_and_ellipsoids_at_random_points(void **state) {
    static const double axes[6][3] = {{1.0, 1.0, 1.0},       {1.0, 2.0, 3.0},
                                      {0.04, 0.03, 0.05},    {1.0, 1.0 + 1e-9, 1.0 - 1e-9},
                                      {3e-10, 5e-10, 4e-10}, {1e8, 2e8, 3e8}};
    check_random random = {81};
    (void)state;
    for (int i = 0; i < 6; i++) {
        subject s = subject_open(axes[i][0], axes[i][1], axes[i][2]);
        for (size_t n = 0; n < check_scaled(600); n++) {
            const shcd_vec3 p = n % 2 ? random_near(&s, &random) : random_in_box(&s, &random);
            check_exact(&s, p);
            check_fast(&s, p);
        }
        assert_int_equal(s.truncated + s.not_stationary, 0);
        shcd_model_free(s.model);
    }
}

static void test_needles_and_discs_of_aspect_1000(void **state) {
    static const double axes[4][3] = {
        {1.0, 1.0, 1000.0}, {1000.0, 1000.0, 1.0}, {1.0, 1000.0, 1.0}, {1000.0, 30.0, 1.0}};
    check_random random = {82};
    (void)state;
    for (int i = 0; i < 4; i++) {
        subject s = subject_open_turned(axes[i][0], axes[i][1], axes[i][2], 820);
        for (size_t n = 0; n < check_scaled(200); n++) {
            const shcd_vec3 p = n % 2 ? random_near(&s, &random) : random_in_box(&s, &random);
            check_exact(&s, p);
            check_fast(&s, p);
        }
        print_message("axes %g %g %g: of %zu truncated %zu, not stationary %zu\n", axes[i][0],
                      axes[i][1], axes[i][2], s.n, s.truncated, s.not_stationary);
        assert_int_equal(s.truncated, 0);
        shcd_model_free(s.model);
    }
}

static void test_axes_planes_focal_curves_and_evolutes(void **state) {
    static const double axes[3][3] = {{3.0, 2.0, 1.0}, {1.0, 1.0, 2.0}, {1.0, 2.0, 2.0}};
    check_random random = {83};
    (void)state;
    for (int i = 0; i < 3; i++) {
        subject s = subject_open(axes[i][0], axes[i][1], axes[i][2]);
        const double *a = s.axes;
        for (int k = 0; k < 3; k++) {
            for (int m = 0; m < 3; m++) {
                /* the cusp (a_k^2 - a_m^2)/a_k of the evolute, exactly, and to both sides */
                const double cusp = (a[k] * a[k] - a[m] * a[m]) / a[k];
                for (int n = 0; n < 9; n++) {
                    static const double shift[9] = {0.0,  1e-12, -1e-12, 1e-7, -1e-7,
                                                    1e-3, -1e-3, 0.1,    -0.1};
                    double p[3] = {0.0, 0.0, 0.0};
                    p[k] = cusp + shift[n];
                    check_exact(&s, shcd_vec3_make(p[0], p[1], p[2]));
                    p[m] += n % 2 ? 1e-9 : 0.01; /* off the axis, or off the cusp if m == k */
                    check_exact(&s, shcd_vec3_make(p[0], p[1], p[2]));
                }
            }
            for (size_t n = 0; n < check_scaled(40);
                 n++) { /* in a plane: a medial surface inside */
                double p[3];
                for (int m = 0; m < 3; m++) {
                    p[m] = m == k ? 0.0 : check_uniform(&random, -1.2, 1.2) * a[m];
                }
                check_exact(&s, shcd_vec3_make(p[0], p[1], p[2]));
                check_fast(&s, shcd_vec3_make(p[0], p[1], p[2]));
            }
        }
        print_message("axes %g %g %g: %zu of %zu truncated\n", a[0], a[1], a[2], s.truncated, s.n);
        shcd_model_free(s.model);
    }
}

static void test_poles_of_the_parameter_sphere_are_no_special_place(void **state) {
    subject s = subject_open(1.0, 1.3, 0.8);
    check_random random = {84};
    (void)state;
    for (int n = 0; n < 60; n++) {
        const double r = pow(10.0, -0.3 * n), z = n % 2 ? -1.0 : 1.0;
        check_exact(&s, shcd_vec3_make(r * check_uniform(&random, -1.0, 1.0), r, z * 0.9));
        check_exact(&s, shcd_vec3_make(0.0, r, z * 0.7));
        check_exact(&s, shcd_vec3_make(0.0, 0.0, z * (0.8 + r)));
    }
    assert_int_equal(s.truncated, 0);
    shcd_model_free(s.model);
}

static void test_points_on_the_surface_are_within_rounding_of_zero(void **state) {
    subject s = subject_open(1.0, 2.0, 3.0);
    check_random random = {85};
    (void)state;
    for (size_t n = 0; n < check_scaled(300); n++) {
        shcd_vec3 p;
        const shcd_vec3 w = bodies_random_direction(&random);
        assert_int_equal(shcd_model_surface(s.model, -1, w, &p, NULL, NULL), SHCD_OK);
        const shcd_proximity got = query(&s, p, SHCD_TIER_EXACT, 0.0);
        assert_near(got.distance_m, 0.0, 1e-9 * s.info.diagonal_m);
        /* down to rounding: some 1e-15 of the size */
        assert_near(check_sharp(&s, p, 0.0).distance_m, 0.0, 4e-15 * s.info.diagonal_m);
        assert_true(got.lower_m <= 0.0 && got.upper_m >= 0.0);
        assert_true((got.flags & UNSURE) != 0);
        assert_true((got.flags & TRUNCATED) == 0);
        check_fast(&s, p);
    }
    shcd_model_free(s.model);
}

static void test_far_points_and_points_about_the_centre_are_sound(void **state) {
    subject s = subject_open(0.1, 0.1, 0.1), e = subject_open(0.1, 0.2, 0.15);
    check_random random = {86};
    (void)state;
    for (int n = 0; n < 100; n++) {
        const shcd_vec3 d = bodies_random_direction(&random);
        const double far = pow(10.0, check_uniform(&random, 0.0, 12.0));
        check_exact(&s, shcd_scale(far, d));
        check_exact(&e, shcd_scale(far, d));
        check_fast(&s, shcd_scale(far, d));
    }
    check_exact(&e, shcd_scale(1e9 * 0.2, shcd_vec3_make(0.0, 0.0, 1.0)));
    assert_int_equal(s.truncated + e.truncated, 0);
    assert_int_equal(s.unsure + e.unsure, 0);
    for (int n = 0; n < 3; n++) { /* nothing can be told apart there */
        const double near = n == 0 ? 0.0 : n == 1 ? 1e-15 : 1e-13;
        check_exact(&s, shcd_scale(near, bodies_random_direction(&random)));
    }
    shcd_model_free(s.model);
    shcd_model_free(e.model);
}

static void test_centre_of_a_sphere_ends_truncated_with_a_true_interval(void **state) {
    subject s = subject_open(1.0, 1.0, 1.0);
    const shcd_proximity got = query(&s, shcd_vec3_make(0.0, 0.0, 0.0), SHCD_TIER_EXACT, 0.0);
    (void)state;
    assert_sound(&s, shcd_vec3_make(0.0, 0.0, 0.0), &got, -1.0);
    assert_true((got.flags & TRUNCATED) != 0);
    assert_near(fabs(got.distance_m), 1.0, 4e-15);
    /* the leaves are all known to lie within their deviation, so the sign is known as well */
    assert_true((got.flags & UNSURE) == 0);
    assert_true(got.lower_m >= -1.0 - 5e-14);
    assert_true(got.upper_m <= -1.0 + 2.0 * s.info.max_deviation_m);
    shcd_model_free(s.model);
}

/* ---- options ---- */

static void test_tolerance_is_honoured_or_truncation_is_said(void **state) {
    static const double tolerance[6] = {0.3, 1e-2, 1e-4, 1e-7, 1e-11, 1e-300};
    subject s = subject_open_turned(1.0, 2.0, 3.0, 870);
    check_random random = {87};
    (void)state;
    for (size_t n = 0; n < check_scaled(300); n++) {
        const shcd_vec3 p = n % 2 ? random_near(&s, &random) : random_in_box(&s, &random);
        const double truth = ellipsoid_distance(s.axes, p);
        uint32_t cost = 0;
        for (int i = 0; i < 6; i++) {
            const double allowed = tolerance[i] * fmax(s.info.diagonal_m, fabs(truth));
            for (int tier = SHCD_TIER_EXACT; tier <= SHCD_TIER_FAST; tier++) {
                const shcd_proximity got = query(&s, p, tier, tolerance[i]);
                assert_sound(&s, p, &got, truth);
                if ((got.flags & TRUNCATED) == 0) {
                    const double width = (got.flags & UNSURE) != 0 ? got.upper_m : 0.0;
                    assert_at_most(got.upper_m - got.lower_m - 2.0 * width + fabs(width),
                                   allowed + fabs(width));
                    assert_at_most(fabs(got.distance_m) - fabs(truth), allowed);
                }
                if (tier == SHCD_TIER_EXACT && i == 4) {
                    assert_true((got.flags & TRUNCATED) == 0 || allowed < 1e-13 * 7.0);
                }
                cost += got.n_evaluations;
            }
        }
        assert_true(cost > 0);
    }
    shcd_model_free(s.model);
}

static void test_coarse_tolerance_never_gives_a_sure_wrong_sign(void **state) {
    /* thinner than the tolerance, so that the far side's foot is good enough as a distance */
    static const double axes[2][3] = {{1.0, 1.0, 0.001}, {1.0, 0.001, 0.9}};
    check_random random = {88};
    (void)state;
    for (int i = 0; i < 2; i++) {
        subject s = subject_open_turned(axes[i][0], axes[i][1], axes[i][2], 880);
        for (size_t n = 0; n < check_scaled(2000); n++) {
            const double size = pow(10.0, check_uniform(&random, -5.0, 0.0));
            shcd_vec3 p, normal;
            assert_int_equal(shcd_model_surface(s.model, -1, bodies_random_direction(&random), &p,
                                                &normal, NULL),
                             SHCD_OK);
            p = shcd_mul_add(p, check_uniform(&random, -size, size), normal);
            const double truth = ellipsoid_distance(s.axes, p);
            for (int k = 0; k < 4; k++) {
                static const double tolerance[4] = {0.3, 0.02, 1e-3, 1e-4};
                const shcd_proximity exact = query(&s, p, SHCD_TIER_EXACT, tolerance[k]);
                const shcd_proximity fast = query(&s, p, SHCD_TIER_FAST, tolerance[k]);
                assert_sound(&s, p, &exact, truth);
                assert_sound(&s, p, &fast, truth);
            }
        }
        shcd_model_free(s.model);
    }
}

static void test_caps_bound_the_work_and_the_interval_stays_true(void **state) {
    static const uint32_t cap[6] = {1, 7, 30, 300, 3000, 30000};
    subject s = subject_open(1.0, 1.0, 1.0), e = subject_open_turned(1.0, 1.2, 0.7, 890);
    check_random random = {89};
    (void)state;
    for (size_t n = 0; n < check_scaled(100); n++) {
        const int centre = n % 4 == 0;
        subject *which = centre ? &s : &e;
        const shcd_vec3 p = centre ? shcd_vec3_make(0.0, 0.0, 0.0) : random_in_box(&e, &random);
        const double truth = ellipsoid_distance(which->axes, p);
        for (int i = 0; i < 36; i++) {
            shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
            shcd_proximity got;
            options.patches_max = cap[i / 6];
            options.evaluations_max = cap[i % 6];
            assert_int_equal(shcd_closest(which->model, p, &options, &got), SHCD_OK);
            assert_sound(which, p, &got, truth);
            /* beyond a cap: the node and the patch that are open are finished, and so is one
             * descent by Newton, 24 steps of at most 10 evaluations, that began below it */
            assert_true(got.n_patches <= options.patches_max + 12);
            assert_true(got.n_evaluations <= options.evaluations_max + 245);
            assert_true(got.n_newton <= got.n_evaluations);
        }
    }
    shcd_model_free(s.model);
    shcd_model_free(e.model);
}

/* ---- arguments, repetition, memory ---- */

static void test_bad_arguments_are_refused_and_out_is_untouched(void **state) {
    subject s = subject_open(1.0, 1.0, 2.0);
    const double bad[3] = {NAN, INFINITY, -INFINITY};
    const shcd_vec3 p = {1.0, 1.0, 1.0}, zero = {0.0, 0.0, 0.0};
    shcd_proximity out, before;
    shcd_query_options o = SHCD_QUERY_OPTIONS_INIT;
    (void)state;
    memset(&out, 0x5a, sizeof out);
    before = out;
    for (int i = 0; i < 9; i++) {
        double q[3] = {0.5, 0.5, 0.5};
        q[i / 3] = bad[i % 3];
        const shcd_vec3 v = {q[0], q[1], q[2]};
        assert_int_equal(shcd_closest(s.model, v, NULL, &out), SHCD_ERR_NOT_FINITE);
        assert_int_equal(shcd_track(s.model, v, p, &out), SHCD_ERR_NOT_FINITE);
        assert_int_equal(shcd_track(s.model, p, v, &out), SHCD_ERR_NOT_FINITE);
    }
    assert_int_equal(shcd_closest(NULL, p, NULL, &out), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_closest(s.model, p, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_track(NULL, p, p, &out), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_track(s.model, p, p, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_track(s.model, p, zero, &out), SHCD_ERR_ARGUMENT);
    for (int i = 0; i < 6; i++) {
        const shcd_query_options fresh = SHCD_QUERY_OPTIONS_INIT;
        o = fresh;
        if (i < 2) {
            o.tier = i == 0 ? -1 : 3;
        } else if (i < 5) {
            o.tolerance = i == 2 ? -1e-9 : bad[i - 3];
        } else {
            o.struct_size = sizeof(size_t) - 1;
        }
        assert_int_equal(shcd_closest(s.model, p, &o, &out), SHCD_ERR_ARGUMENT);
    }
    assert_memory_equal(&out, &before, sizeof out);
    shcd_model_free(s.model);
}

static void test_options_of_older_and_newer_callers_are_read(void **state) {
    subject s = subject_open(1.0, 1.0, 2.0);
    const shcd_vec3 p = {0.3, 0.2, 0.1};
    struct {
        shcd_query_options o;
        unsigned char later[32];
    } newer = {SHCD_QUERY_OPTIONS_INIT, {0}};
    shcd_proximity defaults, got;
    (void)state;
    memset(newer.later, 0xff, sizeof newer.later);
    newer.o.struct_size = sizeof newer;
    assert_int_equal(shcd_closest(s.model, p, NULL, &defaults), SHCD_OK);
    assert_int_equal(shcd_closest(s.model, p, &newer.o, &got), SHCD_OK);
    assert_memory_equal(&got, &defaults, sizeof got);
    newer.o.struct_size = offsetof(shcd_query_options, tolerance); /* knows tier only */
    newer.o.tolerance = NAN;
    newer.o.patches_max = 1;
    assert_int_equal(shcd_closest(s.model, p, &newer.o, &got), SHCD_OK);
    assert_memory_equal(&got, &defaults, sizeof got);
    shcd_model_free(s.model);
}

static void test_queries_repeat_bit_by_bit_and_never_allocate(void **state) {
    check_random random = {90};
    shcd_model *model = bodies_create_random(&random, 12, 0.2);
    const shcd_model_info info = bodies_info(model);
    const size_t n = check_scaled(150);
    shcd_proximity *first = __real_malloc(4 * n * sizeof *first);
    (void)state;
    assert_non_null(first);
    for (int pass = 0; pass < 2; pass++) {
        const size_t before = n_allocations;
        random.state = 91;
        for (size_t i = 0; i < n; i++) {
            const shcd_vec3 p =
                shcd_mul_add(info.centre_m, check_uniform(&random, 0.0, 1.5) * info.radius_m,
                             bodies_random_direction(&random));
            for (int tier = 0; tier < 4; tier++) {
                shcd_query_options o = SHCD_QUERY_OPTIONS_INIT;
                shcd_proximity got;
                memset(&got, pass ? 0xff : 0x11, sizeof got);
                o.tier = tier;
                const shcd_status status =
                    tier < 3 ? shcd_closest(model, p, &o, &got) : shcd_track(model, p, p, &got);
                assert_int_equal(status, SHCD_OK);
                if (pass == 0) {
                    memcpy(&first[4 * i + (size_t)tier], &got, sizeof got);
                } else {
                    assert_memory_equal(&first[4 * i + (size_t)tier], &got, sizeof got);
                }
            }
        }
        assert_int_equal(n_allocations, before);
    }
    assert_true(n_allocations > 0); /* the counter does count: the model was made with malloc */
    free(first);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_spheres_and_ellipsoids_at_random_points),
        cmocka_unit_test(test_needles_and_discs_of_aspect_1000),
        cmocka_unit_test(test_axes_planes_focal_curves_and_evolutes),
        cmocka_unit_test(test_poles_of_the_parameter_sphere_are_no_special_place),
        cmocka_unit_test(test_points_on_the_surface_are_within_rounding_of_zero),
        cmocka_unit_test(test_far_points_and_points_about_the_centre_are_sound),
        cmocka_unit_test(test_centre_of_a_sphere_ends_truncated_with_a_true_interval),
        cmocka_unit_test(test_tolerance_is_honoured_or_truncation_is_said),
        cmocka_unit_test(test_coarse_tolerance_never_gives_a_sure_wrong_sign),
        cmocka_unit_test(test_caps_bound_the_work_and_the_interval_stays_true),
        cmocka_unit_test(test_bad_arguments_are_refused_and_out_is_untouched),
        cmocka_unit_test(test_options_of_older_and_newer_callers_are_read),
        cmocka_unit_test(test_queries_repeat_bit_by_bit_and_never_allocate)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
