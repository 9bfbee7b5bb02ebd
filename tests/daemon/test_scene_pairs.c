/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies that a tool can press at once, and are stiffer together than the device renders, are told;
 * all others are not. */
#include "config.h"
#include "scene_pairs.h"
#include "support/scene_fixture.h"

#define RADIUS_M 0.02
#define LIMIT_N_PER_M 2000.0

static shcd_model *ball;

static int make_ball(void **state) {
    (void)state;
    ball = fixture_ellipsoid(RADIUS_M, RADIUS_M, RADIUS_M);
    return 0;
}

static int free_ball(void **state) {
    (void)state;
    shcd_model_free(ball);
    return 0;
}

/* Lines for two balls that are so far apart, the second one turned by 90 degrees. */
static size_t told(double apart_m, double width_m, double k, double other_k) {
    const shcd_body_def bodies[2] = {
        {.name = "left", .model = ball, .body_in_world = {{0.01, 0.0, 0.0}, {0.6, 0.8, 0.0, 0.0}}},
        {.name = "right",
         .model = ball,
         .body_in_world = {{0.01, 0.0, 2.0 * RADIUS_M + apart_m}, {0.8, 0.0, 0.0, 0.6}}}};
    const double stiffness[2] = {k, other_k};
    const scene_device device = {.profile = &device_profiles[0],
                                 .rate_hz = 1000.0,
                                 .stiffness_limit_n_per_m = LIMIT_N_PER_M};
    return scene_pairs_tell(bodies, stiffness, 2, width_m, &device);
}

static void test_two_bodies_within_a_tool_s_width_are_told(void **state) {
    (void)state;
    assert_int_equal(told(0.004, 0.005, 1200.0, 900.0), 1);
    assert_int_equal(told(0.006, 0.005, 1200.0, 900.0), 0);
    assert_int_equal(told(-0.01, 0.0, 1200.0, 900.0), 1); /* one in the other: a point can */
    assert_int_equal(told(0.001, 0.0, 1200.0, 900.0), 0);
    assert_int_equal(told(10.0, HUGE_VAL, 1200.0, 900.0), 1);
}

static void test_bodies_that_are_soft_enough_are_not_told(void **state) {
    (void)state;
    assert_int_equal(told(0.0, 0.005, 1200.0, 800.0), 0);
    assert_int_equal(told(0.0, 0.005, 0.0, 2001.0), 1);
}

static void test_width_of_a_tool(void **state) {
    const shcd_tool_geometry_def sphere = {.kind = SHCD_TOOL_SPHERE, .radius_m = 0.003};
    const shcd_tool_geometry_def capsule = {
        .kind = SHCD_TOOL_CAPSULE, .radius_m = 0.003, .half_length_m = 0.05};
    const shcd_tool_geometry_def box = {
        .kind = SHCD_TOOL_BOX, .radius_m = 0.001, .half_extents_m = {0.003, 0.004, 0.012}};
    const shcd_tool_geometry_def hull = {.kind = SHCD_TOOL_HULL};
    const shcd_tool_geometry_def point = {.kind = SHCD_TOOL_POINT};
    (void)state;
    assert_near(scene_tool_width(&point), 0.0, 0.0);
    assert_near(scene_tool_width(&sphere), 0.006, 1e-18);
    assert_near(scene_tool_width(&capsule), 0.106, 1e-16);
    assert_near(scene_tool_width(&box), 0.028, 1e-16); /* (3, 4, 12) is 13 long */
    assert_true(scene_tool_width(&hull) == HUGE_VAL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_bodies_within_a_tool_s_width_are_told),
        cmocka_unit_test(test_bodies_that_are_soft_enough_are_not_told),
        cmocka_unit_test(test_width_of_a_tool),
    };
    return cmocka_run_group_tests(tests, make_ball, free_ball);
}
