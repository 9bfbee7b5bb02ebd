/* SPDX-License-Identifier: BSD-3-Clause */
/* stiffness by Hertz on a body that gives way by `wave`: nothing counts twice, and the sum does not
 * jump where one takes over from the other, or when the wave is switched. */
#include "support/soft.h"

#define BODY_M 0.05
#define BALL_M 0.01
#define PATCH_M 0.005
#define E_PA 5000.0
#define NU 0.45
#define E_STAR_PA (E_PA / (1.0 - NU * NU))

static shcd_model *sphere;

static int make_sphere(void **state) {
    (void)state;
    sphere = soft_sphere(BODY_M, 15);
    return 0;
}

static int free_sphere(void **state) {
    (void)state;
    shcd_model_free(sphere);
    return 0;
}

static void open_tissue(fixture *f) {
    const shcd_parameter_value wave[] = {{"modes", 64.0},
                                         {"youngs_modulus_pa", E_PA},
                                         {"poisson_ratio", NU},
                                         {"patch_radius_m", PATCH_M},
                                         {"damping_ratio", 1.0}};
    const shcd_parameter_value law[] = {{"youngs_modulus_pa", E_PA}, {"poisson_ratio", NU}};
    const shcd_effect_def effects[] = {{"stiffness", law, 2}, {"wave", wave, 5}};
    const shcd_body_def body =
        fixture_body("tissue", sphere, fixture_pose(0.0, 0.0, 0.0), effects, 2);
    const shcd_tool_def tool = fixture_tool("ball", BALL_M);
    fixture_open(f, &body, 1, &tool, 1);
}

static double push(fixture *f, double depth_m) {
    return fixture_move(f, shcd_vec3_make(0.0, 0.0, BODY_M + BALL_M - depth_m),
                        shcd_vec3_make(0.0, 0.0, 0.0))
        ->wrench.force_n.z;
}

static double settle(fixture *f, double depth_m) {
    double force = 0.0;
    for (int n = 1; n <= 2200; n++) {
        force = push(f, depth_m * (n < 200 ? n / 200.0 : 1.0));
    }
    return force;
}

/* At rest the membrane is the half-space within 3 % (test_wave), so the two in series are Hertz
 * within that share of 3 % that the membrane gives way, a/p; and the flat punch beyond. */
static void test_static_press_is_that_of_a_half_space(void **state) {
    const double depths[] = {1e-4, 5e-4, 1e-3, 2e-3, 4e-3};
    (void)state;
    for (size_t i = 0; i < 5; i++) {
        const double d = depths[i], a = sqrt(BALL_M * d);
        const double hertz = 4.0 / 3.0 * E_STAR_PA * sqrt(BALL_M) * pow(d, 1.5);
        const double punch = 2.0 * E_STAR_PA * PATCH_M * (d - PATCH_M * PATCH_M / (3.0 * BALL_M));
        const double expected = a < PATCH_M ? hertz : punch;
        fixture f;
        open_tissue(&f);
        const double force = settle(&f, d);
        print_message("depth %g mm: %.4f N, half-space %.4f N\n", 1e3 * d, force, expected);
        assert_near(force, expected, 0.03 * fmin(1.0, a / PATCH_M) * expected);
        fixture_close(&f);
    }
}

/* Slowly through the depth at which the contact outgrows the patch: in a tick the force changes by
 * no more than the stiffest the two can be at one tick's depth. */
static void test_force_rises_without_a_jump_through_the_patch_radius(void **state) {
    const double step = 2e-6;
    double last = 0.0, largest = 0.0, sum = 0.0;
    size_t n = 0;
    fixture f;
    (void)state;
    open_tissue(&f);
    for (double d = step; d < 4e-3; d += step) {
        const double force = push(&f, d);
        largest = fmax(largest, fabs(force - last));
        sum += force - last;
        last = force;
        n++;
    }
    /* the mean slope times four: Hertz's slope at the end is 1.5 times its mean, and the inertia of
     * the membrane at 2 mm/s adds less than as much again */
    assert_at_most(largest, 4.0 * sum / (double)n);
    fixture_close(&f);
}

/* Over a ramp of 500 ticks the shown surface moves by a 500th of its displacement, which is below
 * the depth; once more as much because what pushes it is scaled, too. A tool that moves by that in
 * a tick makes the same change. */
static void test_switching_the_wave_makes_no_jump(void **state) {
    const double depth = 2e-3;
    fixture f, still;
    double largest = 0.0;
    (void)state;
    open_tissue(&still);
    const double settled = settle(&still, depth);
    const double bound = push(&still, depth + 2.0 * depth / 500.0) - settled;
    open_tissue(&f);
    double last = settle(&f, depth);
    for (int k = 0; k < 2; k++) {
        assert_string_equal(shcd_scene_effect_name(f.scene, 1), "wave");
        assert_int_equal(shcd_state_switch(f.scene, f.state, 1, k, 0.5), SHCD_OK);
        for (int n = 0; n < 1000; n++) {
            const double force = push(&f, depth);
            largest = fmax(largest, fabs(force - last));
            last = force;
        }
        if (k == 0) { /* off: Hertz on a rigid body, by the query's 1e-9 of the diagonal */
            const double hertz = 4.0 / 3.0 * E_STAR_PA * sqrt(BALL_M) * pow(depth, 1.5);
            assert_near(last, hertz, 1e-6 * hertz);
        }
    }
    print_message("at most %.3g N a tick of %.3g N, bound %.3g N\n", largest, settled, bound);
    assert_at_most(largest, bound);
    fixture_close(&still);
    fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_static_press_is_that_of_a_half_space),
        cmocka_unit_test(test_force_rises_without_a_jump_through_the_patch_radius),
        cmocka_unit_test(test_switching_the_wave_makes_no_jump),
    };
    return cmocka_run_group_tests(tests, make_sphere, free_sphere);
}
