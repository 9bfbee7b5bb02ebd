/* SPDX-License-Identifier: BSD-3-Clause */
/* What a tick reports of a contact with a soft body is the state at the tick's end, where a long
 * tick's own force has moved the surface by tenths of a millimetre: against the closest point of
 * the surface that the state then has. */
#include "support/soft.h"

#include <stdbool.h>

#define RADIUS_M 0.05
#define DEGREE 8
#define TICK_S 5e-3
#define DIAGONAL_M (2.0 * 1.7320508075688772 * RADIUS_M)

static shcd_model *sphere;

static int make_sphere(void **state) {
    (void)state;
    sphere = soft_sphere(RADIUS_M, DEGREE);
    return 0;
}

static int free_sphere(void **state) {
    (void)state;
    shcd_model_free(sphere);
    return 0;
}

/* Two needles on a body that is turned and put elsewhere. */
static void open_soft(fixture *f, shcd_pose at, bool has_law) {
    const shcd_effect_def effects[2] = {{"wave", NULL, 0}, {"stiffness", NULL, 0}};
    const shcd_body_def body = fixture_body("organ", sphere, at, effects, has_law ? 2 : 1);
    const shcd_tool_def tools[2] = {fixture_tool("a", 0.0), fixture_tool("b", 0.003)};
    fixture_open(f, &body, 1, tools, 2);
}

static void tick(fixture *f) {
    const shcd_input input = {.dt_s = TICK_S, .tools = f->in, .n_tools = 2};
    shcd_output output = {.tools = f->out, .n_tools = 2};
    assert_int_equal(shcd_step(f->scene, f->state, &input, &output), SHCD_OK);
}

/* Of the surface as it is now, in the body's frame. */
static double depth_now(const fixture *f, shcd_vec3 p, shcd_vec3 *foot, shcd_vec3 *parameter) {
    double c[3 * SHCD_COUNT(DEGREE)];
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *now = NULL;
    shcd_proximity found;
    assert_int_equal(shcd_state_coefficients(f->scene, f->state, 0, c, sizeof c / sizeof c[0]),
                     SHCD_OK);
    def.degree = DEGREE;
    def.coefficients = c;
    assert_int_equal(shcd_model_create(&def, NULL, &now, NULL), SHCD_OK);
    assert_int_equal(shcd_closest(now, p, NULL, &found), SHCD_OK);
    shcd_model_free(now);
    *foot = found.point_m;
    *parameter = found.parameter;
    return -found.distance_m;
}

/* A needle comes in by some depth within a tick, alone: the dent is round about it, so that the
 * closest point stays the same point of the surface. */
static void test_report_of_one_contact_is_that_of_the_surface_afterwards(void **state) {
    check_random random = {5};
    (void)state;
    for (int i = 0; i < 4 + (int)check_scaled(16); i++) {
        const shcd_vec3 w = fixture_random_direction(&random);
        const shcd_pose at = fixture_random_pose(&random, 0.3);
        const double depth_m = check_uniform(&random, 1e-4, 2e-3);
        double moved_most_m = 0.0;
        fixture f;
        open_soft(&f, at, i % 2 == 0);
        f.in[0].tool_in_world.position_m = shcd_transform(at, shcd_scale(RADIUS_M - depth_m, w));
        f.in[1].flags = 0;
        for (int n = 0; n < 8; n++) {
            shcd_vec3 foot, parameter, rest;
            tick(&f);
            const shcd_tool_output *out = &f.out[0];
            const double now_m =
                depth_now(&f, shcd_scale(RADIUS_M - depth_m, w), &foot, &parameter);
            assert_int_equal(shcd_model_surface(sphere, -1, parameter, &rest, NULL, NULL), SHCD_OK);
            /* two certified distances; where what is flat about the foot lets it slide, no more */
            assert_near(out->penetration_m, now_m, 4e-9 * DIAGONAL_M);
            assert_near(out->distance_m, -out->penetration_m, 0.0);
            assert_near(out->displacement_m, shcd_norm(shcd_sub(foot, rest)), 1e-6);
            assert_near(shcd_norm(shcd_sub(out->proxy_m, shcd_transform(at, foot))), 0.0, 1e-6);
            moved_most_m = fmax(moved_most_m, out->displacement_m);
        }
        assert_true(moved_most_m > 0.2 * depth_m);
        fixture_close(&f);
    }
}

/* Two tools beside each other: each moves the other's surface. The closest point is another one
 * then. A surface that is tilted by s about the same point, at a distance d, is closer by d s^2/2;
 * the rest is for its curvature, which is small against 1/d. A dent of depth u and of a Gaussian's
 * width sigma = 2.5 mm, half of the patch's radius, is nowhere steeper than 0.61 u/sigma. */
static void test_report_of_two_contacts_counts_both_forces(void **state) {
    check_random random = {6};
    double corrected_m = 0.0;
    (void)state;
    for (int i = 0; i < 4 + (int)check_scaled(16); i++) {
        const shcd_pose at = fixture_pose(0.1, 0.0, 0.0);
        const double angle = check_uniform(&random, 0.2, 0.6);
        const shcd_vec3 w[2] = {{0.0, 0.0, 1.0}, {sin(angle), 0.0, cos(angle)}};
        const double depth_m[2] = {check_uniform(&random, 5e-4, 1.5e-3), 1.5e-3};
        fixture f;
        open_soft(&f, at, true);
        for (int k = 0; k < 2; k++) {
            const double r = RADIUS_M - depth_m[k] + (k == 1 ? 0.003 : 0.0);
            f.in[k].tool_in_world.position_m = shcd_transform(at, shcd_scale(r, w[k]));
        }
        tick(&f);
        for (int k = 0; k < 2; k++) {
            shcd_vec3 foot, parameter;
            const double r = k == 1 ? 0.003 : 0.0;
            const double now_m =
                r + depth_now(&f, shcd_scale(RADIUS_M - depth_m[k] + r, w[k]), &foot, &parameter);
            const double slope =
                0.61 / 0.0025 * (f.out[0].displacement_m + f.out[1].displacement_m);
            assert_near(f.out[k].penetration_m, now_m,
                        slope * slope * fabs(now_m - r) + 4e-9 * DIAGONAL_M);
            corrected_m = fmax(corrected_m, depth_m[k] - f.out[k].penetration_m);
        }
        fixture_close(&f);
    }
    print_message("the force of a tick moves the surface by up to %.3g m\n", corrected_m);
    assert_true(corrected_m > 2e-4);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_report_of_one_contact_is_that_of_the_surface_afterwards),
        cmocka_unit_test(test_report_of_two_contacts_counts_both_forces),
    };
    return cmocka_run_group_tests(tests, make_sphere, free_sphere);
}
