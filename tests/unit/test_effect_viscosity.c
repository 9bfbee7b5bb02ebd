/* SPDX-License-Identifier: BSD-3-Clause */
/* viscosity: drag by the velocity over the medium, the share that is in, Stokes' law, and the limit
 * of a held damper. */
#include "support/touch.h"

#define C 0.8
/* products of a handful of numbers of order 1 */
#define ROUNDING 1e-15

static touch_effect open_drag(double c, double length_m) {
    const shcd_parameter_value values[] = {{"damping_n_s_per_m", c}, {"length_m", length_m}};
    return touch_open("viscosity", values, 2);
}

static void test_drag_is_against_the_velocity_over_the_medium(void **state) {
    touch_effect e = open_drag(C, 0.001);
    shcdi_touch t = touch_plane(0.01);
    (void)state;
    t.velocity_m_per_s = shcd_vec3_make(0.3, -0.2, 0.5);
    t.surface_velocity_m_per_s = shcd_vec3_make(0.1, 0.1, 0.1);
    const shcdi_response r = touch_apply(&e, &t, 1.5);
    assert_near(r.other_force_n.x, -C * 0.2, ROUNDING);
    assert_near(r.other_force_n.y, C * 0.3, ROUNDING);
    assert_near(r.other_force_n.z, -C * 0.4, ROUNDING);
    assert_true(r.normal_force_n == 1.5 && r.stored_j == 0.0);
    t.velocity_m_per_s = t.surface_velocity_m_per_s;
    assert_true(touch_apply(&e, &t, 1.5).other_force_n.x == 0.0);
}

/* From nothing at the surface to all of it at the length: the diameter, 2 mm for a sharp tool, or
 * as given; t^2 (3 - 2t) in between. */
static void test_drag_grows_with_the_share_that_is_in(void **state) {
    const double radii[] = {0.0, 0.004, 0.004}, given[] = {0.0, 0.0, 0.02};
    const double lengths[] = {0.002, 0.008, 0.02};
    (void)state;
    for (int i = 0; i < 3; i++) {
        touch_effect e = open_drag(C, given[i]);
        double last = 0.0;
        for (int k = 1; k <= 150; k++) {
            const double share = fmin(1.0, k / 100.0);
            shcdi_touch t = touch_plane(lengths[i] * k / 100.0);
            t.tool_radius_m = radii[i];
            t.velocity_m_per_s.y = 1.0;
            const double force = -touch_apply(&e, &t, 0.0).other_force_n.y;
            assert_near(force, C * share * share * (3.0 - 2.0 * share), 4.0 * ROUNDING);
            assert_at_most(force - last, C * 1.5 / 100.0); /* its steepest slope */
            last = force;
        }
    }
}

static void test_drag_of_a_ball_is_stokes(void **state) {
    const shcd_parameter_value value = {"viscosity_pa_s", 1.4};
    touch_effect e = touch_open("viscosity", &value, 1);
    shcdi_touch t = touch_plane(0.05);
    (void)state;
    t.tool_radius_m = 0.005;
    t.velocity_m_per_s.x = 0.1;
    assert_near(touch_apply(&e, &t, 0.0).other_force_n.x, -6.0 * 3.14159265358979324 * 1.4 * 5e-4,
                ROUNDING);
}

static void test_wild_velocity_counts_as_ten_metres_a_second(void **state) {
    touch_effect e = open_drag(100.0, 0.001);
    shcdi_touch t = touch_plane(0.05);
    (void)state;
    t.velocity_m_per_s = shcd_vec3_make(6e8, 8e8, 0.0);
    const shcd_vec3 f = touch_apply(&e, &t, 0.0).other_force_n;
    assert_near(f.x, -600.0, 1e-12);
    assert_near(f.y, -800.0, 1e-12);
}

/* A mass that is free in the medium, its velocity known at the tick: v' = v (1 - c T/m), which
 * settles for c < 2 m/T and not beyond. */
static void test_held_damper_is_stable_below_two_masses_over_the_tick(void **state) {
    const double mass = 0.02, dt = 0.001;
    (void)state;
    for (int stable = 0; stable < 2; stable++) {
        touch_effect e = open_drag((stable ? 1.9 : 2.1) * mass / dt, 0.001);
        shcdi_touch t = touch_plane(0.05);
        double v = 1e-3;
        for (int i = 0; i < 60; i++) {
            t.velocity_m_per_s.x = v;
            v += touch_apply(&e, &t, 0.0).other_force_n.x * dt / mass;
        }
        assert_true(stable ? fabs(v) < 1e-3 * 0.01 : fabs(v) > 1e-3 * 100.0);
    }
}

static void test_two_ways_to_say_the_drag_are_refused(void **state) {
    const shcd_parameter_value values[] = {{"damping_n_s_per_m", 0.2}, {"viscosity_pa_s", 0.3}};
    const char *const words[] = {"'viscosity'", "damping_n_s_per_m", "viscosity_pa_s", NULL};
    (void)state;
    touch_expect_refusal("viscosity", values, 2, words);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_drag_is_against_the_velocity_over_the_medium),
        cmocka_unit_test(test_drag_grows_with_the_share_that_is_in),
        cmocka_unit_test(test_drag_of_a_ball_is_stokes),
        cmocka_unit_test(test_wild_velocity_counts_as_ten_metres_a_second),
        cmocka_unit_test(test_held_damper_is_stable_below_two_masses_over_the_tick),
        cmocka_unit_test(test_two_ways_to_say_the_drag_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
