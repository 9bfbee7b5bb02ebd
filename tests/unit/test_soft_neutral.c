/* SPDX-License-Identifier: BSD-3-Clause */
/* Beside `wave` an effect with neutral parameters, or one that is switched off, gives the same bits
 * as its absence (-0.0 counts as +0.0). The elastic law is the exception, and stated: of no force
 * it is a free surface, absent it is a rigid contact on the membrane. */
#include "support/soft.h"

#include <stdbool.h>

#define RADIUS_M 0.05
#define DEGREE 8
#define COUNT (3 * SHCD_COUNT(DEGREE))
#define TICKS 300

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

static void open_with(fixture *f, const shcd_effect_def *effects, size_t n) {
    const shcd_body_def body =
        fixture_body("organ", sphere, fixture_pose(0.0, 0.0, 0.0), effects, n);
    const shcd_tool_def tools[2] = {fixture_tool("ball", 0.004), fixture_tool("needle", 0.0)};
    fixture_open(f, &body, 1, tools, 2);
}

/* In, along the surface, out, and in again, with both tools. */
static void tick(fixture *f, int i) {
    const double s = 2.0 * SOFT_PI * i / TICKS, depth_m = 0.002 * sin(2.0 * s);
    for (int t = 0; t < 2; t++) {
        const double angle = 0.2 * sin(s) + 0.4 * t;
        const double r = RADIUS_M + (t == 0 ? 0.004 : 0.0) - depth_m;
        f->in[t].tool_in_world.position_m = shcd_vec3_make(r * sin(angle), 0.0, r * cos(angle));
        f->in[t].velocity_m_per_s = shcd_vec3_make(0.01 * cos(s), 0.002, -0.02 * cos(2.0 * s));
    }
    fixture_step(f);
}

static bool is_same(shcd_vec3 a, shcd_vec3 b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

static void expect_same_shape(const fixture *a, const fixture *b) {
    double c[2][COUNT];
    assert_int_equal(shcd_state_coefficients(a->scene, a->state, 0, c[0], COUNT), SHCD_OK);
    assert_int_equal(shcd_state_coefficients(b->scene, b->state, 0, c[1], COUNT), SHCD_OK);
    for (size_t k = 0; k < COUNT; k++) {
        assert_true(c[0][k] == c[1][k]);
    }
}

/* @return the largest force */
static double expect_same(fixture *a, fixture *b, const char *what) {
    double most_n = 0.0;
    for (int i = 0; i < TICKS; i++) {
        tick(a, i);
        tick(b, i);
        for (int t = 0; t < 2; t++) {
            const shcd_tool_output *x = &a->out[t], *y = &b->out[t];
            if (!is_same(x->wrench.force_n, y->wrench.force_n) ||
                !is_same(x->wrench.torque_n_m, y->wrench.torque_n_m) ||
                !is_same(x->proxy_m, y->proxy_m) || x->penetration_m != y->penetration_m ||
                x->flags != y->flags || x->n_contacts != y->n_contacts) {
                fail_msg("%s: tick %d, tool %d: %.17g N, without it %.17g N", what, i, t,
                         shcd_norm(y->wrench.force_n), shcd_norm(x->wrench.force_n));
            }
            most_n = fmax(most_n, shcd_norm(x->wrench.force_n));
        }
        expect_same_shape(a, b);
    }
    return most_n;
}

static void switch_off(fixture *f, const char *name) {
    size_t e = 0;
    while (strcmp(shcd_scene_effect_name(f->scene, e), name) != 0) {
        e++;
        assert_true(e < shcd_scene_effect_count(f->scene));
    }
    assert_int_equal(shcd_state_switch(f->scene, f->state, e, 0, 0.0), SHCD_OK);
}

static const shcd_parameter_value no_texture = SHCD_PARAMETER("amplitude_m", 0.0);
static const shcd_parameter_value no_damping = SHCD_PARAMETER("ratio", 0.0);
static const shcd_parameter_value no_friction[] = {SHCD_PARAMETER("static_ratio", 0.0),
                                                   SHCD_PARAMETER("kinetic_ratio", 0.0)};
static const shcd_parameter_value no_relaxation[] = {SHCD_PARAMETER("g_1", 0.0),
                                                     SHCD_PARAMETER("g_2", 0.0)};
static const shcd_parameter_value no_viscosity = SHCD_PARAMETER("damping_n_s_per_m", 0.0);
static const shcd_parameter_value no_pulse = SHCD_PARAMETER("amplitude_m", 0.0);

static const shcd_effect_def neutral[] = {
    {"texture", &no_texture, 1},      {"damping", &no_damping, 1},     {"friction", no_friction, 2},
    {"relaxation", no_relaxation, 2}, {"viscosity", &no_viscosity, 1}, {"pulse", &no_pulse, 1},
};

static void check(bool has_law, bool is_switched) {
    const shcd_effect_def wave = {"wave", NULL, 0}, spring = {"stiffness", NULL, 0};
    for (size_t i = 0; i < sizeof neutral / sizeof neutral[0]; i++) {
        const shcd_effect_def whole = {neutral[i].name, NULL, 0};
        const shcd_effect_def with[3] = {wave, is_switched ? whole : neutral[i], spring};
        const shcd_effect_def without[2] = {wave, spring};
        fixture a, b;
        open_with(&a, without, has_law ? 2 : 1);
        open_with(&b, with, has_law ? 3 : 2);
        if (is_switched) {
            switch_off(&b, neutral[i].name);
        }
        assert_true(expect_same(&a, &b, neutral[i].name) > 0.01);
        fixture_close(&a);
        fixture_close(&b);
    }
}

static void test_neutral_effects_beside_wave_are_absent(void **state) {
    (void)state;
    check(true, false);
    check(false, false);
}

static void test_effects_beside_wave_that_are_switched_off_are_absent(void **state) {
    (void)state;
    check(true, true);
    check(false, true);
}

/* Through a free surface a tool falls without a force; without a law it rests on the membrane. */
static void test_a_law_without_force_is_a_free_surface(void **state) {
    const shcd_parameter_value none = SHCD_PARAMETER("k_n_per_m", 0.0);
    const shcd_effect_def no_force[2] = {{"wave", NULL, 0}, {"stiffness", &none, 1}};
    const shcd_effect_def spring[2] = {{"wave", NULL, 0}, {"stiffness", NULL, 0}};
    fixture a, b, c;
    double most_n = 0.0;
    (void)state;
    open_with(&a, no_force, 2);
    open_with(&b, spring, 2);
    open_with(&c, spring, 1);
    switch_off(&b, "stiffness");
    for (int i = 0; i < TICKS; i++) {
        tick(&a, i);
        tick(&b, i);
        tick(&c, i);
        for (int t = 0; t < 2; t++) {
            assert_true(shcd_norm(a.out[t].wrench.force_n) == 0.0);
            assert_true(shcd_norm(b.out[t].wrench.force_n) == 0.0);
            most_n = fmax(most_n, shcd_norm(c.out[t].wrench.force_n));
        }
    }
    assert_true(most_n > 0.01);
    fixture_close(&a);
    fixture_close(&b);
    fixture_close(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_neutral_effects_beside_wave_are_absent),
        cmocka_unit_test(test_effects_beside_wave_that_are_switched_off_are_absent),
        cmocka_unit_test(test_a_law_without_force_is_a_free_surface),
    };
    return cmocka_run_group_tests(tests, make_sphere, free_sphere);
}
