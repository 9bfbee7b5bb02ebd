/* SPDX-License-Identifier: BSD-3-Clause */
/* Body against body: spheres by their closed form, ellipsoids against alternating projections in
 * long double and against libccd. */
#include "shcd/pair.h"
#include "support/bodies.h"
#include "support/check.h"
#include "support/ellipsoid.h"

#include <ccd/ccd.h>

static size_t n_allocations;
void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t n, size_t size);
void *__wrap_malloc(size_t size) {
    n_allocations++;
    return __real_malloc(size);
}
void *__wrap_calloc(size_t n, size_t size) {
    n_allocations++;
    return __real_calloc(n, size);
}

#define TOLERANCE 1e-6 /* the default, of the larger diagonal */

static shcd_quat random_turn(check_random *r) {
    const double w = check_normal(r), x = check_normal(r), y = check_normal(r), z = check_normal(r);
    const double n = sqrt(w * w + x * x + y * y + z * z);
    const shcd_quat q = {w / n, x / n, y / n, z / n};
    return q;
}

static shcd_pose inverse(shcd_pose a) {
    shcd_pose b;
    b.orientation = shcd_conjugate(a.orientation);
    b.position_m = shcd_scale(-1.0, shcd_rotate(b.orientation, a.position_m));
    return b;
}

static shcd_pair_proximity closest(const shcd_model *a, const shcd_model *b, shcd_pose b_in_a) {
    shcd_pair_proximity out;
    assert_int_equal(shcd_pair_closest(a, NULL, b, NULL, b_in_a, NULL, &out), SHCD_OK);
    assert_true(out.lower_m <= out.gap_m && out.gap_m <= out.upper_m);
    return out;
}

static int overlaps(const shcd_pair_proximity *p) {
    return (p->flags & (uint32_t)SHCD_PAIR_OVERLAP) != 0;
}

/* ---- spheres ---- */

static void test_pair_spheres_apart_match_the_closed_form(void **state) {
    (void)state;
    check_random random = {20261201};
    const size_t n = check_scaled(500);
    shcd_model *a = bodies_create_ellipsoid(0.3, 0.3, 0.3);
    uint32_t evaluations = 0, patches = 0;
    for (int k = 0; k < 3; k++) {
        const double radius = k == 0 ? 0.3 : k == 1 ? 0.1 : 0.01;
        shcd_model *b = bodies_create_ellipsoid(radius, radius, radius);
        for (size_t i = 0; i < n; i++) {
            const double gap = pow(10.0, check_uniform(&random, -5.0, 0.5));
            shcd_pose pose;
            pose.orientation = random_turn(&random);
            pose.position_m = shcd_scale(0.3 + radius + gap, bodies_random_direction(&random));
            const shcd_pair_proximity out = closest(a, b, pose);
            assert_int_equal(out.flags, 0);
            /* rounding of the closed form: positions of 1 m */
            assert_true(out.lower_m <= gap + 1e-15 && gap <= out.upper_m + 1e-15);
            assert_true(out.lower_m > 0.0);
            assert_at_most(out.upper_m - out.lower_m, TOLERANCE * bodies_info(a).diagonal_m);
            const shcd_vec3 n_a = shcd_unit(pose.position_m);
            assert_near(shcd_dot(out.normal_a, n_a), 1.0, 1e-14);
            assert_near(shcd_dot(out.normal_b, n_a), -1.0, 1e-14);
            assert_near(shcd_norm(shcd_sub(out.point_a_m, out.point_b_m)), out.gap_m, 1e-14);
            evaluations = out.n_evaluations > evaluations ? out.n_evaluations : evaluations;
            patches = out.n_patches > patches ? out.n_patches : patches;
        }
        shcd_model_free(b);
    }
    print_message("seed 20261201: spheres: at most %u evaluations, %u patches\n", evaluations,
                  patches);
    /* the closed form, and the pair of points that it names */
    assert_true(evaluations == 3 && patches == 0);
    shcd_model_free(a);
}

/* A ball beside a body that is no ball costs one query of that body; and the answer is the
 * search's, which a ball that is none by a hair more than the tolerance gets. */
static void test_pair_ball_and_body_agree_with_the_search(void **state) {
    (void)state;
    check_random random = {20261209};
    shcd_model *ball = bodies_create_ellipsoid(0.05, 0.05, 0.05);
    shcd_model *nearly = bodies_create_ellipsoid(0.05, 0.05, 0.05 * (1.0 + 1e-4));
    size_t quick = 0;
    for (size_t i = 0; i < check_scaled(6); i++) {
        shcd_model *body = i % 2 == 0 ? bodies_create_random(&random, 6, 0.05)
                                      : bodies_create_ellipsoid(0.5, 0.4, 0.02);
        const shcd_model_info info = bodies_info(body);
        for (int k = 0; k < 20; k++) {
            shcd_pose pose;
            pose.orientation = random_turn(&random);
            pose.position_m =
                shcd_mul_add(info.centre_m, check_uniform(&random, 0.9, 1.6) * info.radius_m,
                             bodies_random_direction(&random));
            shcd_proximity at_centre;
            assert_int_equal(shcd_closest(body, pose.position_m, NULL, &at_centre), SHCD_OK);
            const shcd_pair_proximity out = closest(body, ball, pose);
            const shcd_pair_proximity swapped = closest(ball, body, inverse(pose));
            const shcd_pair_proximity searched = closest(body, nearly, pose);
            if (!(at_centre.lower_m > 0.051)) {
                continue;
            }
            quick++;
            assert_int_equal(out.flags, 0);
            assert_int_equal(out.n_patches, at_centre.n_patches);
            assert_int_equal(out.n_evaluations, at_centre.n_evaluations + 2);
            assert_true(searched.n_patches > out.n_patches);
            assert_true(searched.n_evaluations > out.n_evaluations);
            assert_at_most(out.upper_m - out.lower_m, TOLERANCE * info.diagonal_m);
            assert_true(out.lower_m <= at_centre.upper_m - 0.05 + 1e-14);
            assert_true(at_centre.lower_m - 0.05 <= out.upper_m + 1e-14);
            /* the surfaces are nowhere farther apart than that */
            assert_near(out.gap_m, searched.gap_m, 0.05 * 1e-4 + TOLERANCE * info.diagonal_m);
            assert_near(out.gap_m, swapped.gap_m, TOLERANCE * info.diagonal_m);
            assert_near(shcd_norm(shcd_sub(out.point_a_m, out.point_b_m)), out.gap_m, 1e-14);
            assert_near(shcd_dot(out.normal_a, out.normal_b), -1.0, 1e-6);
        }
        shcd_model_free(body);
    }
    print_message("seed 20261209: %zu pairs by one query\n", quick);
    assert_true(quick > 40 * check_scaled(6) / 6);
    shcd_model_free(nearly);
    shcd_model_free(ball);
}

static void test_pair_spheres_overlapping_match_the_closed_form(void **state) {
    (void)state;
    check_random random = {20261202};
    const size_t n = check_scaled(200);
    shcd_model *a = bodies_create_ellipsoid(0.3, 0.3, 0.3);
    shcd_model *b = bodies_create_ellipsoid(0.1, 0.1, 0.1);
    for (size_t i = 0; i < n; i++) {
        const double d = check_uniform(&random, 0.0, 0.399);
        shcd_pose pose;
        pose.orientation = random_turn(&random);
        pose.position_m = shcd_scale(d, bodies_random_direction(&random));
        const shcd_pair_proximity out = closest(a, b, pose);
        assert_true(overlaps(&out));
        /* deepest point of b's surface in a, and of a's in b */
        const double b_in_a = 0.3 - fabs(d - 0.1), a_in_b = 0.1 - fabs(d - 0.3);
        const double depth = fmax(b_in_a, a_in_b);
        assert_true(out.lower_m <= -depth + 1e-12 && -depth <= out.upper_m + 1e-12);
        assert_true(out.upper_m < 0.0);
        if (d > 0.11) {
            /* where the depth is smooth the ascent ends within 1e-3 tolerances a step, of which the
             * last few may be lost */
            assert_near(out.gap_m, -depth, 1e-5);
        }
    }
    shcd_model_free(a);
    shcd_model_free(b);
}

static void test_pair_sphere_within_a_sphere_overlaps(void **state) {
    (void)state;
    shcd_model *a = bodies_create_ellipsoid(0.02, 0.02, 0.02);
    shcd_model *b = bodies_create_ellipsoid(0.3, 0.3, 0.3);
    const shcd_pose pose = {{0.1, 0.0, 0.05}, {1.0, 0.0, 0.0, 0.0}};
    const shcd_pair_proximity in = closest(a, b, pose), out = closest(b, a, inverse(pose));
    const double depth = 0.3 - (sqrt(0.0125) - 0.02);
    assert_true(overlaps(&in) && overlaps(&out));
    assert_near(in.gap_m, -depth, 1e-5);
    assert_near(out.gap_m, -depth, 1e-5);
    shcd_model_free(a);
    shcd_model_free(b);
}

/* ---- ellipsoids ---- */

typedef struct solid {
    double axes[3];
    shcd_pose pose;
} solid;

static void support_solid(const void *object, const ccd_vec3_t *d, ccd_vec3_t *out) {
    const solid *e = object;
    const shcd_vec3 world = {(double)d->v[0], (double)d->v[1], (double)d->v[2]};
    const shcd_vec3 u = shcd_rotate(shcd_conjugate(e->pose.orientation), world);
    const double *a = e->axes;
    const double n =
        sqrt(a[0] * a[0] * u.x * u.x + a[1] * a[1] * u.y * u.y + a[2] * a[2] * u.z * u.z);
    const shcd_vec3 x = {a[0] * a[0] * u.x / n, a[1] * a[1] * u.y / n, a[2] * a[2] * u.z / n};
    const shcd_vec3 p = shcd_transform(e->pose, x);
    ccdVec3Set(out, p.x, p.y, p.z);
}

/* Closest point of the solid, by the secular equation. */
static shcd_vec3 project(const solid *e, shcd_vec3 p) {
    const shcd_vec3 q = shcd_transform_inverse(e->pose, p);
    const double y[3] = {q.x, q.y, q.z};
    int order[3] = {0, 1, 2};
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 2 - i; k++) {
            if (e->axes[order[k]] < e->axes[order[k + 1]]) {
                const int swap = order[k];
                order[k] = order[k + 1];
                order[k + 1] = swap;
            }
        }
    }
    long double a[3], b[3], x[3], level = 0.0L;
    for (int i = 0; i < 3; i++) {
        a[i] = (long double)e->axes[order[i]];
        b[i] = (long double)fabs(y[order[i]]);
        level += b[i] * b[i] / (a[i] * a[i]);
    }
    if (level <= 1.0L) {
        return p;
    }
    ellipsoid_foot(a, b, x);
    double foot[3];
    for (int i = 0; i < 3; i++) {
        foot[order[i]] = y[order[i]] < 0.0 ? -(double)x[i] : (double)x[i];
    }
    return shcd_transform(e->pose, shcd_vec3_make(foot[0], foot[1], foot[2]));
}

/* Alternating projections between convex sets fall to their distance (Cheney and Goldstein,
 * Proximity maps for convex sets, Proc. AMS 10, 1959). */
static double solids_apart(const solid *a, const solid *b) {
    shcd_vec3 p = a->pose.position_m;
    double distance = HUGE_VAL;
    for (int i = 0; i < 20000; i++) {
        const shcd_vec3 on_b = project(b, p);
        p = project(a, on_b);
        const double now = shcd_norm(shcd_sub(p, on_b));
        if (distance - now < 1e-13) {
            return fmin(now, distance);
        }
        distance = now;
    }
    return distance;
}

static void test_pair_ellipsoids_match_projections_and_gjk(void **state) {
    (void)state;
    check_random random = {20261203};
    const size_t n_bodies = check_scaled(12);
    size_t n_apart = 0, n_overlapping = 0;
    uint32_t evaluations = 0;
    ccd_t ccd;
    CCD_INIT(&ccd);
    ccd.support1 = support_solid;
    ccd.support2 = support_solid;
    ccd.max_iterations = 1000;
    for (size_t i = 0; i < n_bodies; i++) {
        solid a, b;
        for (int k = 0; k < 3; k++) {
            a.axes[k] = check_uniform(&random, i % 3 == 0 ? 0.02 : 0.1, 0.4);
            b.axes[k] = check_uniform(&random, i % 4 == 0 ? 0.02 : 0.1, 0.3);
        }
        shcd_model *model_a = bodies_create_ellipsoid(a.axes[0], a.axes[1], a.axes[2]);
        shcd_model *model_b = bodies_create_ellipsoid(b.axes[0], b.axes[1], b.axes[2]);
        const double diagonal =
            fmax(bodies_info(model_a).diagonal_m, bodies_info(model_b).diagonal_m);
        for (int k = 0; k < 40; k++) {
            const shcd_pose rest = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
            a.pose = rest;
            b.pose.orientation = random_turn(&random);
            b.pose.position_m =
                shcd_scale(check_uniform(&random, 0.2, 0.8), bodies_random_direction(&random));
            const shcd_pair_proximity out = closest(model_a, model_b, b.pose);
            const double apart = solids_apart(&a, &b);
            evaluations = out.n_evaluations > evaluations ? out.n_evaluations : evaluations;
            if (apart > 1e-5) {
                n_apart++;
                assert_int_equal(out.flags, 0);
                assert_true(ccdGJKIntersect(&a, &b, &ccd) == 0);
                assert_true(out.lower_m <= apart + 1e-12);
                assert_at_most(out.upper_m - apart, TOLERANCE * diagonal);
                assert_at_most(out.upper_m - out.lower_m, TOLERANCE * diagonal);
            } else if (ccdGJKIntersect(&a, &b, &ccd) && apart == 0.0) {
                n_overlapping++;
                assert_true(overlaps(&out) || (out.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0);
                assert_true(overlaps(&out) || out.upper_m < 1e-6);
            }
        }
        shcd_model_free(model_a);
        shcd_model_free(model_b);
    }
    print_message("seed 20261203: %zu apart, %zu overlapping, at most %u evaluations\n", n_apart,
                  n_overlapping, evaluations);
    assert_true(n_apart > 10 && n_overlapping > 10);
}

/* ---- the contract ---- */

static void test_pair_capped_is_truncated_and_true(void **state) {
    (void)state;
    shcd_model *a = bodies_create_bent(0.5, 0.6, 1.0, 0.9);
    shcd_model *b = bodies_create_ellipsoid(0.4, 0.2, 0.3);
    const shcd_pose pose = {{1.2, 0.3, 0.1}, {0.5, 0.5, 0.5, 0.5}};
    const shcd_pair_proximity full = closest(a, b, pose);
    assert_int_equal(full.flags, 0);
    size_t n_truncated = 0;
    for (uint32_t cap = 20; cap <= 400; cap += 20) {
        shcd_pair_options options = SHCD_PAIR_OPTIONS_INIT;
        shcd_pair_proximity out;
        options.patches_max = cap;
        options.evaluations_max = cap;
        assert_int_equal(shcd_pair_closest(a, NULL, b, NULL, pose, &options, &out), SHCD_OK);
        assert_true(out.lower_m <= full.gap_m && full.gap_m <= out.upper_m + 1e-12);
        n_truncated += (out.flags & SHCD_PROXIMITY_TRUNCATED) != 0;
        /* one more leaf, block or Newton step may be under way when a cap is reached */
        assert_true(out.n_evaluations <= cap + 100);
    }
    assert_true(n_truncated > 5);
    shcd_model_free(a);
    shcd_model_free(b);
}

static void test_pair_does_not_allocate(void **state) {
    (void)state;
    shcd_model *a = bodies_create_ellipsoid(0.4, 0.2, 0.3);
    const shcd_pose apart = {{0.9, 0.1, 0.0}, {1.0, 0.0, 0.0, 0.0}};
    const shcd_pose into = {{0.5, 0.1, 0.0}, {1.0, 0.0, 0.0, 0.0}};
    const size_t before = n_allocations;
    const shcd_pair_proximity out = closest(a, a, apart), in = closest(a, a, into);
    assert_int_equal(n_allocations, before);
    assert_true(!overlaps(&out) && overlaps(&in));
    shcd_model_free(a);
}

static void test_pair_bad_arguments_are_refused(void **state) {
    (void)state;
    shcd_model *a = bodies_create_ellipsoid(0.4, 0.2, 0.3);
    const shcd_pose good = {{0.9, 0.1, 0.0}, {1.0, 0.0, 0.0, 0.0}};
    shcd_pair_options options = SHCD_PAIR_OPTIONS_INIT;
    shcd_pair_proximity out;
    out.gap_m = 7.0;
    assert_int_equal(shcd_pair_closest(NULL, NULL, a, NULL, good, NULL, &out), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_pair_closest(a, NULL, NULL, NULL, good, NULL, &out), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_pair_closest(a, NULL, a, NULL, good, NULL, NULL), SHCD_ERR_ARGUMENT);
    options.tolerance = 1e-10;
    assert_int_equal(shcd_pair_closest(a, NULL, a, NULL, good, &options, &out), SHCD_ERR_ARGUMENT);
    options.tolerance = (double)NAN;
    assert_int_equal(shcd_pair_closest(a, NULL, a, NULL, good, &options, &out), SHCD_ERR_ARGUMENT);
    options.tolerance = 0.0;
    options.struct_size = 0;
    assert_int_equal(shcd_pair_closest(a, NULL, a, NULL, good, &options, &out), SHCD_ERR_ARGUMENT);
    shcd_pose bad = good;
    bad.orientation.x = 0.5;
    assert_int_equal(shcd_pair_closest(a, NULL, a, NULL, bad, NULL, &out), SHCD_ERR_ARGUMENT);
    bad = good;
    bad.position_m.z = (double)INFINITY;
    assert_int_equal(shcd_pair_closest(a, NULL, a, NULL, bad, NULL, &out), SHCD_ERR_NOT_FINITE);
    assert_true(out.gap_m == 7.0);
    shcd_model_free(a);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pair_spheres_apart_match_the_closed_form),
        cmocka_unit_test(test_pair_ball_and_body_agree_with_the_search),
        cmocka_unit_test(test_pair_spheres_overlapping_match_the_closed_form),
        cmocka_unit_test(test_pair_sphere_within_a_sphere_overlaps),
        cmocka_unit_test(test_pair_ellipsoids_match_projections_and_gjk),
        cmocka_unit_test(test_pair_capped_is_truncated_and_true),
        cmocka_unit_test(test_pair_does_not_allocate),
        cmocka_unit_test(test_pair_bad_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
