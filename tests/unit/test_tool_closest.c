/* SPDX-License-Identifier: BSD-3-Clause */
/* Gap between convex tools and bodies against closed forms: ball bodies against every tool, inside
 * and outside; ellipsoids along their axes; a body inside of a tool and a tool inside of a body;
 * and arguments, flags and caps. */
#include "support/tools.h"

#include <string.h>

#define TIGHT 1e-9 /* relative tolerance asked for; the closed forms are exact */

static shcd_pose pose_at(double x, double y, double z) {
    const shcd_pose p = {{x, y, z}, {1.0, 0.0, 0.0, 0.0}};
    return p;
}

static test_tool *make(test_tool *t, int kind, double radius, double half_length, shcd_vec3 half) {
    const shcd_tool_geometry_def blank = SHCD_TOOL_GEOMETRY_DEF_INIT;
    t->def = blank;
    t->def.kind = kind;
    t->def.radius_m = radius;
    t->def.half_length_m = half_length;
    t->def.half_extents_m = half;
    t->def.n_points = 8;
    for (int i = 0; i < 8; i++) {
        t->points[i] =
            shcd_vec3_make(i % 2 != 0 ? half.x : -half.x, i / 2 % 2 != 0 ? half.y : -half.y,
                           i / 4 != 0 ? half.z : -half.z);
    }
    tools_make(t);
    return t;
}

static shcd_tool_proximity query(const shcd_model *model, const test_tool *t, shcd_pose pose,
                                 double tolerance) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_tool_proximity got;
    options.tolerance = tolerance;
    assert_int_equal(shcd_tool_closest(model, NULL, t->geometry, pose, &options, &got), SHCD_OK);
    assert_true(got.lower_m <= got.gap_m && got.gap_m <= got.upper_m);
    return got;
}

/* Outside, the gap to a ball is the distance from its centre to the core, less both radii. */
static void test_ball_body_outside_agrees_with_closed_form(void **state) {
    check_random random = {21};
    shcd_model *ball = bodies_create_ellipsoid(0.5, 0.5, 0.5);
    double worst = 0.0;
    size_t touching = 0;
    (void)state;
    for (size_t i = 0; i < check_scaled(600); i++) {
        test_tool t;
        tools_make_random(&t, SHCD_TOOL_POINT + (int)(i % 5), 0.4, &random);
        shcd_pose pose = tools_random_pose(0.4, 2.0, &random);
        if (t.def.kind == SHCD_TOOL_POINT) {
            t.def.radius_m = 0.0;
        }
        const shcd_vec3 centre = shcd_transform_inverse(pose, shcd_vec3_make(0.0, 0.0, 0.0));
        const double to_core = tools_core_distance(&t, centre);
        if (to_core > 0.5 + 1e-6) {
            const shcd_tool_proximity got = query(ball, &t, pose, TIGHT);
            const double expected = to_core - 0.5 - t.def.radius_m;
            assert_near(got.gap_m, expected, 1e-9);
            assert_true(got.lower_m <= expected + 1e-13 && expected <= got.upper_m + 1e-13);
            assert_int_equal(got.flags, 0);
            worst = fmax(worst, fabs(got.gap_m - expected));
            touching += expected < 0.0;
        }
        shcd_tool_geometry_free(t.geometry);
    }
    print_message("ball bodies: off by at most %.2g m, %zu in touch\n", worst, touching);
    assert_true(touching > 0 || check_scaled(600) < 400);
    shcd_model_free(ball);
}

/* A capsule whose axis cuts a ball: the deepest axis point is the one nearest to the centre. */
static void test_ball_body_with_capsule_through_it_agrees_with_closed_form(void **state) {
    check_random random = {22};
    shcd_model *ball = bodies_create_ellipsoid(0.5, 0.5, 0.5);
    (void)state;
    for (size_t i = 0; i < check_scaled(100); i++) {
        test_tool t;
        make(&t, SHCD_TOOL_CAPSULE, 0.01, check_uniform(&random, 0.01, 1.5),
             shcd_vec3_make(0.1, 0.1, 0.1));
        const shcd_pose pose = tools_random_pose(0.05, 0.5, &random);
        const shcd_vec3 centre = shcd_transform_inverse(pose, shcd_vec3_make(0.0, 0.0, 0.0));
        const double expected = tools_core_distance(&t, centre) - 0.5 - 0.01;
        const shcd_tool_proximity got = query(ball, &t, pose, 0.0);
        assert_near(got.gap_m, expected, 2e-6);
        assert_true(got.lower_m <= expected + 1e-12 && expected <= got.upper_m + 1e-12);
        shcd_tool_geometry_free(t.geometry);
    }
    shcd_model_free(ball);
}

/* A box whose corner dips into a big ball straight from above, and one that lies in it. */
static void test_ball_body_with_box_corner_in_it_agrees_with_closed_form(void **state) {
    shcd_model *ball = bodies_create_ellipsoid(1.0, 1.0, 1.0);
    test_tool t;
    (void)state;
    make(&t, SHCD_TOOL_BOX, 0.0, 0.0, shcd_vec3_make(0.1, 0.1, 0.1));
    /* the diagonal along -z: turns (1, 1, 1) into (0, 0, 1) */
    const double angle = acos(1.0 / sqrt(3.0)), s = sin(0.5 * angle) / sqrt(2.0);
    const shcd_pose pose = {{0.0, 0.0, 1.0 + 0.1 * sqrt(3.0) - 0.03},
                            {cos(0.5 * angle), s, -s, 0.0}};
    shcd_tool_proximity got = query(ball, &t, pose, 0.0);
    assert_near(got.gap_m, -0.03, 3e-6);
    assert_int_equal(got.flags, 0);
    assert_near(shcd_norm(shcd_sub(got.tool_point_m, shcd_vec3_make(0.0, 0.0, 0.97))), 0.0, 1e-3);
    assert_near(got.normal.z, 1.0, 1e-3);
    /* wholly inside, off the middle: its corner nearest to the middle is deepest */
    got = query(ball, &t, pose_at(0.3, 0.3, 0.3), 1e-4);
    assert_near(got.gap_m, sqrt(3.0) * 0.2 - 1.0, 4e-4);
    assert_true(got.lower_m <= sqrt(3.0) * 0.2 - 1.0 && got.upper_m >= sqrt(3.0) * 0.2 - 1.0);
    shcd_tool_geometry_free(t.geometry);
    shcd_model_free(ball);
}

/* The body inside of the tool: the tool holds the ball's centre, the deepest point there is. */
static void test_body_inside_of_the_tool_is_overlap(void **state) {
    static const int kinds[2] = {SHCD_TOOL_BOX, SHCD_TOOL_HULL};
    shcd_model *ball = bodies_create_ellipsoid(0.1, 0.1, 0.1);
    (void)state;
    for (int i = 0; i < 2; i++) {
        test_tool t;
        make(&t, kinds[i], 0.0, 0.0, shcd_vec3_make(0.5, 0.5, 0.5));
        const shcd_tool_proximity got = query(ball, &t, pose_at(0.05, 0.02, -0.03), 1e-3);
        assert_true(got.upper_m < -0.099);
        assert_true(got.lower_m <= -0.1 && got.lower_m > -0.101);
        shcd_tool_geometry_free(t.geometry);
    }
    shcd_model_free(ball);
}

/* Tools on the axes of an ellipsoid touch its end first if they are blunter than it. */
static void test_ellipsoid_on_its_axes_agrees_with_closed_form(void **state) {
    shcd_model *body = bodies_create_ellipsoid(0.9, 0.6, 0.3);
    test_tool t;
    (void)state;
    make(&t, SHCD_TOOL_BOX, 0.02, 0.0, shcd_vec3_make(0.2, 0.4, 1.0));
    assert_near(query(body, &t, pose_at(1.5, 0.1, -0.2), TIGHT).gap_m, 1.5 - 0.2 - 0.02 - 0.9,
                1e-9);
    assert_near(query(body, &t, pose_at(0.05, 1.5, 0.1), TIGHT).gap_m, 1.5 - 0.4 - 0.02 - 0.6,
                1e-9);
    assert_near(query(body, &t, pose_at(0.05, 0.1, 1.5), TIGHT).gap_m, 1.5 - 1.0 - 0.02 - 0.3,
                1e-9);
    shcd_tool_geometry_free(t.geometry);
    make(&t, SHCD_TOOL_HULL, 0.0, 0.0, shcd_vec3_make(0.2, 0.4, 1.0));
    assert_near(query(body, &t, pose_at(1.5, 0.1, -0.2), TIGHT).gap_m, 1.5 - 0.2 - 0.9, 1e-9);
    shcd_tool_geometry_free(t.geometry);
    /* a capsule across: its axis along z stands over the end of the x axis */
    make(&t, SHCD_TOOL_CAPSULE, 0.05, 2.0, shcd_vec3_make(0.1, 0.1, 0.1));
    assert_near(query(body, &t, pose_at(1.2, 0.0, 0.3), TIGHT).gap_m, 1.2 - 0.9 - 0.05, 1e-9);
    shcd_tool_geometry_free(t.geometry);
    shcd_model_free(body);
}

/* The pose may be given in any frame: body and tool turned together, the gap stays. */
static void test_gap_does_not_depend_on_the_frame_of_a_ball(void **state) {
    check_random random = {23};
    shcd_model *ball = bodies_create_ellipsoid(0.5, 0.5, 0.5);
    test_tool t;
    (void)state;
    make(&t, SHCD_TOOL_BOX, 0.0, 0.0, shcd_vec3_make(0.3, 0.1, 0.2));
    const shcd_pose pose = {{0.7, 0.4, 0.2}, tools_random_rotation(&random)};
    const double gap = query(ball, &t, pose, TIGHT).gap_m;
    for (int i = 0; i < 20; i++) {
        const shcd_quat a = tools_random_rotation(&random), b = pose.orientation;
        const shcd_pose turned = {shcd_rotate(a, pose.position_m),
                                  {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
                                   a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                                   a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                                   a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w}};
        assert_near(query(ball, &t, turned, TIGHT).gap_m, gap, 1e-9);
    }
    shcd_tool_geometry_free(t.geometry);
    shcd_model_free(ball);
}

/* Needles and plates of aspect 1000 against a needle and a plate of a body. */
static void test_thin_tools_and_bodies_keep_the_tolerance(void **state) {
    check_random random = {24};
    shcd_model *bodies[2] = {bodies_create_ellipsoid(1.0, 0.01, 0.01),
                             bodies_create_ellipsoid(1.0, 1.0, 0.01)};
    size_t n = 0, truncated = 0;
    (void)state;
    for (size_t i = 0; i < check_scaled(200); i++) {
        test_tool t;
        if (i % 2 == 0) {
            make(&t, SHCD_TOOL_CAPSULE, 1e-3, 1.0, shcd_vec3_make(0.1, 0.1, 0.1));
        } else {
            make(&t, SHCD_TOOL_BOX, 0.0, 0.0, shcd_vec3_make(1.0, 1.0, 1e-3));
        }
        const shcd_pose pose = tools_random_pose(1.2, 3.0, &random);
        const shcd_tool_proximity got = query(bodies[i / 2 % 2], &t, pose, 0.0);
        if (got.lower_m > 0.0) {
            n++;
            truncated += (got.flags & SHCD_PROXIMITY_TRUNCATED) != 0;
        }
        shcd_tool_geometry_free(t.geometry);
    }
    print_message("thin against thin: %zu separated, %zu truncated\n", n, truncated);
    assert_true(10 * n > check_scaled(200));
    assert_at_most((double)truncated, 0.02 * (double)n);
    shcd_model_free(bodies[0]);
    shcd_model_free(bodies[1]);
}

/* A capsule along the axis of a prolate body: a whole circle of feet, which no ball of convexity
 * can end. Caps end it, and the interval stays true. */
static void test_circle_of_feet_ends_at_the_caps(void **state) {
    shcd_model *body = bodies_create_ellipsoid(0.5, 0.5, 1.0);
    test_tool t;
    (void)state;
    make(&t, SHCD_TOOL_CAPSULE, 0.0, 0.2, shcd_vec3_make(0.1, 0.1, 0.1));
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    options.evaluations_max = 2000;
    shcd_tool_proximity got;
    assert_int_equal(shcd_tool_closest(body, NULL, t.geometry, pose_at(0, 0, 0), &options, &got),
                     SHCD_OK);
    /* the middle of its axis is deepest, 0.5 m, its ends 0.484 m: those are found in any case */
    assert_true(got.lower_m <= -0.5 && got.upper_m >= -0.5 - 1e-12);
    assert_in_range(got.n_evaluations, 1, 2000 + 250);
    assert_at_most(got.gap_m, -0.48);
    shcd_tool_geometry_free(t.geometry);
    shcd_model_free(body);
}

/* ---- caps, flags, arguments ------------------------------------------------------------------ */

static void test_caps_are_kept(void **state) {
    static const uint32_t evaluations_max[5] = {1, 10, 60, 300, 1000};
    static const uint32_t patches_max[5] = {1, 100, 1000, 5000, 20000};
    check_random random = {25};
    shcd_model *body = bodies_create_random(&random, 15, 0.1);
    double evaluations_over = 0.0, patches_over = 0.0;
    size_t truncated = 0;
    (void)state;
    for (size_t i = 0; i < check_scaled(500); i++) {
        test_tool t;
        tools_make_random(&t, SHCD_TOOL_POINT + (int)(i % 5), 0.8, &random);
        const shcd_pose pose = tools_random_pose(0.0, 3.0, &random);
        shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
        shcd_tool_proximity got;
        options.evaluations_max = evaluations_max[i / 5 % 5];
        options.patches_max = patches_max[i / 5 % 5];
        options.tier = i / 25 % 2 == 0 ? SHCD_TIER_EXACT : SHCD_TIER_FAST;
        assert_int_equal(shcd_tool_closest(body, NULL, t.geometry, pose, &options, &got), SHCD_OK);
        assert_true(got.lower_m <= got.gap_m && got.gap_m <= got.upper_m);
        assert_true(got.n_newton <= got.n_evaluations);
        assert_true((got.flags & SHCD_PROXIMITY_TRUNCATED) != 0 ||
                    got.upper_m - got.lower_m <=
                        2e-6 * fmax(got.gap_m, bodies_info(body).diagonal_m));
        truncated += (got.flags & SHCD_PROXIMITY_TRUNCATED) != 0;
        evaluations_over =
            fmax(evaluations_over, (double)got.n_evaluations - options.evaluations_max);
        patches_over = fmax(patches_over, (double)got.n_patches - options.patches_max);
        shcd_tool_geometry_free(t.geometry);
    }
    print_message("caps: %zu truncated; beyond them at most %g evaluations, %g bounds\n", truncated,
                  evaluations_over, patches_over);
    /* what was begun is finished: Newton runs (24 steps of at most 10 trials, each) of the search
     * and of the point query that tells the side or the depth; a block's leaves, the leaves that
     * wait */
    assert_at_most(evaluations_over, 4 * (1 + 24 * 10));
    assert_at_most(patches_over, 2000);
    shcd_model_free(body);
}

static void test_bad_arguments_are_refused(void **state) {
    shcd_model *ball = bodies_create_ellipsoid(0.5, 0.5, 0.5);
    test_tool t;
    shcd_tool_proximity got, untouched;
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    (void)state;
    make(&t, SHCD_TOOL_BOX, 0.0, 0.0, shcd_vec3_make(0.1, 0.1, 0.1));
    memset(&got, 0x55, sizeof got);
    untouched = got;
    const shcd_pose good = pose_at(1.0, 0.0, 0.0);
    shcd_pose bad = good;
    assert_int_equal(shcd_tool_closest(NULL, NULL, t.geometry, good, NULL, &got),
                     SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_tool_closest(ball, NULL, NULL, good, NULL, &got), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_tool_closest(ball, NULL, t.geometry, good, NULL, NULL),
                     SHCD_ERR_ARGUMENT);
    options.tolerance = -1.0;
    assert_int_equal(shcd_tool_closest(ball, NULL, t.geometry, good, &options, &got),
                     SHCD_ERR_ARGUMENT);
    options.tolerance = 0.0;
    options.tier = 7;
    assert_int_equal(shcd_tool_closest(ball, NULL, t.geometry, good, &options, &got),
                     SHCD_ERR_ARGUMENT);
    bad.orientation.w = 1.01;
    assert_int_equal(shcd_tool_closest(ball, NULL, t.geometry, bad, NULL, &got), SHCD_ERR_ARGUMENT);
    bad.orientation.w = NAN;
    assert_int_equal(shcd_tool_closest(ball, NULL, t.geometry, bad, NULL, &got),
                     SHCD_ERR_NOT_FINITE);
    bad = pose_at(INFINITY, 0.0, 0.0);
    assert_int_equal(shcd_tool_closest(ball, NULL, t.geometry, bad, NULL, &got),
                     SHCD_ERR_NOT_FINITE);
    shcd_tool_geometry_free(t.geometry);
    shcd_vec3 p[1] = {{0.0, 0.0, 0.0}}, n[1] = {{0.0, 0.0, 1.0}};
    shcd_tool_geometry_def def = SHCD_TOOL_GEOMETRY_DEF_INIT;
    def.kind = SHCD_TOOL_SHELL;
    def.points = p;
    def.normals = n;
    def.n_points = 1;
    shcd_tool_geometry *shell = NULL;
    assert_int_equal(shcd_tool_geometry_create(&def, NULL, &shell, NULL), SHCD_OK);
    assert_int_equal(shcd_tool_closest(ball, NULL, shell, good, NULL, &got), SHCD_ERR_UNSUPPORTED);
    shcd_tool_geometry_free(shell);
    assert_memory_equal(&got, &untouched, sizeof got);
    shcd_model_free(ball);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ball_body_outside_agrees_with_closed_form),
        cmocka_unit_test(test_ball_body_with_capsule_through_it_agrees_with_closed_form),
        cmocka_unit_test(test_ball_body_with_box_corner_in_it_agrees_with_closed_form),
        cmocka_unit_test(test_body_inside_of_the_tool_is_overlap),
        cmocka_unit_test(test_ellipsoid_on_its_axes_agrees_with_closed_form),
        cmocka_unit_test(test_gap_does_not_depend_on_the_frame_of_a_ball),
        cmocka_unit_test(test_thin_tools_and_bodies_keep_the_tolerance),
        cmocka_unit_test(test_circle_of_feet_ends_at_the_caps),
        cmocka_unit_test(test_caps_are_kept),
        cmocka_unit_test(test_bad_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
