/* SPDX-License-Identifier: BSD-3-Clause */
/* How stiff a soft body is in a tick, and held: against the force of ticks that press. */
#include "support/soft.h"

#define RADIUS_M 0.05
#define DEGREE 7
#define DEPTH_M 1e-4
/* A depth is found to 1e-9 of the diagonal, 2 sqrt(3) RADIUS_M. */
#define DEPTH_ERROR (1e-9 * 0.174 / DEPTH_M)
/* What a grid of n t = 0.7 leaves open: soft_stiffness.c */
#define SHARE 0.155

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

static void open_soft(fixture *f, double modes, double damping_ratio) {
    const shcd_parameter_value wave[2] = {{.name = "modes", .value = modes},
                                          {.name = "damping_ratio", .value = damping_ratio}};
    const shcd_effect_def effect = {"wave", wave, 2};
    const shcd_body_def body =
        fixture_body("organ", sphere, fixture_pose(0.0, 0.0, 0.0), &effect, 1);
    const shcd_tool_def tool = fixture_tool("point", 0.0);
    fixture_open(f, &body, 1, &tool, 1);
}

/* Force over depth of n ticks that hold a depth at w, on a body at rest at first. */
static double pressed(fixture *f, shcd_vec3 w, double dt_s, int n) {
    const shcd_input input = {.dt_s = dt_s, .tools = f->in, .n_tools = 1};
    shcd_output output = {.tools = f->out, .n_tools = 1};
    assert_int_equal(shcd_state_init(f->scene, f->memory, shcd_state_size(f->scene), &f->state),
                     SHCD_OK);
    f->in[0].tool_in_world.position_m = shcd_scale(RADIUS_M - DEPTH_M, w);
    for (int i = 0; i < n; i++) {
        assert_int_equal(shcd_step(f->scene, f->state, &input, &output), SHCD_OK);
    }
    return shcd_norm(f->out[0].wrench.force_n) / DEPTH_M;
}

/* With whole shells of harmonics all places are equal, by the addition theorem, and the grid leaves
 * nothing open. */
static void test_wave_stiffness_of_equal_places_is_what_a_press_meets(void **state) {
    fixture f;
    check_random random = {3};
    (void)state;
    open_soft(&f, 64.0, 1.0);
    for (int i = 0; i < 4; i++) {
        const double dt_s = (double[]){2.5e-4, 1e-3, 5e-3, 2e-2}[i];
        double tick, held;
        assert_int_equal(shcd_scene_wave_stiffness(f.scene, 0, dt_s, &tick, &held), SHCD_OK);
        const shcd_vec3 w = fixture_random_direction(&random);
        const double one = pressed(&f, w, dt_s, 1);
        print_message("%.2f ms: %.5f N/m in a tick, %.5f held\n", 1e3 * dt_s, tick, held);
        assert_near(tick, one, tick * DEPTH_ERROR);
        if (dt_s >= 5e-3) { /* a second and more. The foot stays; the shape is a little another */
            assert_near(held, pressed(&f, w, dt_s, 400), held * 2.0 * DEPTH_M / RADIUS_M);
        }
        assert_true(tick > held);
    }
    fixture_close(&f);
}

/* With a part of a shell the places differ: none is stiffer than stated, and the stiffest is not
 * much softer. */
static void test_wave_stiffness_is_above_every_place_and_not_by_much(void **state) {
    check_random random = {4};
    (void)state;
    for (int i = 0; i < 6; i++) {
        const double dt_s = i % 2 == 0 ? 1e-3 : 1e-2;
        double tick, held, least = HUGE_VAL, most = 0.0;
        fixture f;
        open_soft(&f, (double[]){2.0, 13.0, 53.0}[i / 2], 0.2);
        assert_int_equal(shcd_scene_wave_stiffness(f.scene, 0, dt_s, &tick, &held), SHCD_OK);
        for (size_t n = 0; n < 200 + check_scaled(1000); n++) {
            const double k = pressed(&f, fixture_random_direction(&random), dt_s, 1);
            least = fmin(least, k);
            most = fmax(most, k);
            assert_true(k <= tick * (1.0 + DEPTH_ERROR));
        }
        print_message("%.0f ms: %.4f to %.4f N/m found, at most %.4f stated\n", 1e3 * dt_s, least,
                      most, tick);
        assert_true(most > (1.0 + 10.0 * DEPTH_ERROR) * least);
        /* the places that were tried are not the extremes: a tenth of their difference more */
        assert_at_most(1.0 / most - 1.0 / tick,
                       (SHARE + 0.1) * (1.0 / least - 1.0 / most) + DEPTH_ERROR / most);
        fixture_close(&f);
    }
}

/* Force that the first tool meets per metre, within a tick, beside others that are held at the same
 * depth. */
static double pressed_beside(fixture *f, const shcd_vec3 *w, size_t n, double dt_s) {
    const shcd_input input = {.dt_s = dt_s, .tools = f->in, .n_tools = n};
    shcd_output output = {.tools = f->out, .n_tools = n};
    double force_n[2];
    for (int k = 0; k < 2; k++) { /* what the contacts solve is linear while all of them press */
        assert_int_equal(shcd_state_init(f->scene, f->memory, shcd_state_size(f->scene), &f->state),
                         SHCD_OK);
        for (size_t t = 0; t < n; t++) {
            const double depth_m = t == 0 && k == 1 ? 1.001 * DEPTH_M : DEPTH_M;
            f->in[t].tool_in_world.position_m = shcd_scale(RADIUS_M - depth_m, w[t]);
        }
        assert_int_equal(shcd_step(f->scene, f->state, &input, &output), SHCD_OK);
        for (size_t t = 0; t < n; t++) {
            assert_true(shcd_norm(f->out[t].wrench.force_n) > 0.0);
        }
        force_n[k] = shcd_norm(f->out[0].wrench.force_n);
    }
    return (force_n[1] - force_n[0]) / (0.001 * DEPTH_M);
}

/* Other tools make a body stiffer for one: at the same place by as much as is stated, elsewhere by
 * less. */
static void test_wave_stiffness_beside_other_tools(void **state) {
    const shcd_effect_def effect = {"wave", NULL, 0};
    const shcd_body_def body =
        fixture_body("organ", sphere, fixture_pose(0.0, 0.0, 0.0), &effect, 1);
    check_random random = {5};
    double alone = 0.0;
    (void)state;
    for (size_t n = 1; n <= 4; n++) {
        const shcd_tool_def tool[4] = {fixture_tool("a", 0.0), fixture_tool("b", 0.0),
                                       fixture_tool("c", 0.0), fixture_tool("d", 0.0)};
        const double dt_s = 2e-2;
        double tick, held, most = 0.0;
        shcd_vec3 w[4];
        fixture f;
        fixture_open(&f, &body, 1, tool, n);
        assert_int_equal(shcd_scene_wave_stiffness(f.scene, 0, dt_s, &tick, &held), SHCD_OK);
        w[0] = w[1] = w[2] = w[3] = fixture_random_direction(&random);
        const double together = pressed_beside(&f, w, n, dt_s);
        for (size_t i = 0; i < check_scaled(50); i++) {
            for (size_t t = 1; t < n; t++) { /* near by */
                w[t] = shcd_unit(shcd_mul_add(w[0], 0.1, fixture_random_direction(&random)));
            }
            most = fmax(most, pressed_beside(&f, w, n, dt_s));
        }
        print_message("%zu tools: %.3f N/m at one place, up to %.3f near by, %.3f stated\n", n,
                      together, most, tick);
        alone = n == 1 ? tick : alone;
        assert_near(together, tick, 2e3 * tick * DEPTH_ERROR); /* a difference of 0.001 of it */
        assert_true(most <= tick * (1.0 + 2e3 * DEPTH_ERROR));
        assert_true(n == 1 || tick > 1.05 * alone);
        fixture_close(&f);
    }
}

static void test_wave_stiffness_refuses_what_has_none(void **state) {
    double tick = 7.0, held = 7.0;
    fixture f;
    (void)state;
    open_soft(&f, 4.0, 0.2);
    assert_int_equal(shcd_scene_wave_stiffness(NULL, 0, 1e-3, &tick, &held), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_scene_wave_stiffness(f.scene, 1, 1e-3, &tick, &held), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_scene_wave_stiffness(f.scene, 0, 0.0, &tick, &held), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_scene_wave_stiffness(f.scene, 0, 0.2, &tick, &held), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_scene_wave_stiffness(f.scene, 0, 1e-3, NULL, &held), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_scene_wave_stiffness(f.scene, 0, 1e-3, &tick, NULL), SHCD_ERR_ARGUMENT);
    fixture_close(&f);
    const shcd_effect_def spring = {"stiffness", NULL, 0};
    const shcd_body_def stone =
        fixture_body("stone", sphere, fixture_pose(0.0, 0.0, 0.0), &spring, 1);
    const shcd_tool_def tool = fixture_tool("point", 0.0);
    fixture_open(&f, &stone, 1, &tool, 1);
    assert_int_equal(shcd_scene_wave_stiffness(f.scene, 0, 1e-3, &tick, &held),
                     SHCD_ERR_UNSUPPORTED);
    fixture_close(&f);
    assert_true(tick == 7.0 && held == 7.0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wave_stiffness_of_equal_places_is_what_a_press_meets),
        cmocka_unit_test(test_wave_stiffness_is_above_every_place_and_not_by_much),
        cmocka_unit_test(test_wave_stiffness_beside_other_tools),
        cmocka_unit_test(test_wave_stiffness_refuses_what_has_none),
    };
    return cmocka_run_group_tests(tests, make_sphere, free_sphere);
}
