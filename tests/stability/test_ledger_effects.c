/* SPDX-License-Identifier: BSD-3-Clause */
/* The energy ledger of effects with a memory: friction's anchor, relaxation's Maxwell elements, the
 * modes of a soft body, a heartbeat that brings energy in. What they hold and bring in is what the
 * tick reports (shcd_effect_output); on closed paths the inequality of shcd/energy.h holds in every
 * tick, with K the sum of the springs that the tool feels at once. */
#include "account.h"

/* Closed paths; then the tool waits outside, as bodies go on moving. */
static void check_paths(const shcd_model *model, const shcd_effect_def *effects, size_t n,
                        double stiffness_n_per_m, uint64_t seed) {
    account *a = malloc(sizeof *a);
    check_random r = {seed};
    const size_t n_paths = check_scaled(60);
    assert_non_null(a);
    account_open(a, model, NULL, effects, n, stiffness_n_per_m);
    for (size_t i = 0; i < n_paths; i++) {
        const path p =
            path_make(model, (path_kind)(i % PATH_KINDS), bodies_random_direction(&r), RADIUS_M,
                      check_uniform(&r, 5e-4, DEPTH_M), check_uniform(&r, 0.01, 0.15), &r);
        account_reset(a);
        for (int k = 0; k <= TICKS + 50; k++) {
            account_tick(a, path_at(&p, fmin((double)k / TICKS, 1.0)));
        }
        if (!(a->least_j >= -TOLERANCE_J * check_tolerance_scale())) {
            fail_msg("path %zu kind %d: margin %.3g J, slack %.3g, given %.3g, taken %.3g, driven "
                     "%.3g, stored at most %.3g",
                     i, (int)p.kind, a->least_j, a->ledger.slack_j, a->ledger.given_j,
                     a->ledger.taken_j, a->ledger.driven_j, a->stored_most_j);
        }
        /* every joule of the model's force has its effect */
        double sum_j = 0.0;
        for (size_t e = 0; e < n; e++) {
            sum_j += a->entry_j[e];
        }
        assert_near(sum_j, a->ledger.given_j - a->ledger.taken_j, TOLERANCE_J);
        assert_true(i % PATH_KINDS == PATH_RANDOM || a->stored_most_j > 0.0);
    }
    fixture_close(&a->f);
    free(a);
}

static const shcd_parameter_value spring = {.name = "k_n_per_m", .value = K_N_PER_M};
static const shcd_parameter_value rubbing = {.name = "stiffness_n_per_m", .value = 400.0};
static const shcd_parameter_value quick[] = {{.name = "tau_1_s", .value = 0.02},
                                             {.name = "tau_2_s", .value = 0.2}};
static const shcd_parameter_value liver = {.name = "youngs_modulus_pa", .value = 5000.0};
static const shcd_parameter_value beat = {.name = "frequency_hz", .value = 8.0};

static void test_closed_paths_with_friction(void **state) {
    const shcd_effect_def effects[] = {{"stiffness", &spring, 1}, {"friction", &rubbing, 1}};
    shcd_model *model = paths_random(3);
    (void)state;
    check_paths(model, effects, 2, K_N_PER_M + 400.0, 31);
    shcd_model_free(model);
}

static void test_closed_paths_with_relaxation(void **state) {
    const shcd_effect_def effects[] = {{"stiffness", &spring, 1}, {"relaxation", quick, 2}};
    shcd_model *model = paths_random(4);
    (void)state;
    check_paths(model, effects, 2, K_N_PER_M, 32);
    shcd_model_free(model);
}

static void test_closed_paths_on_a_soft_body(void **state) {
    const shcd_effect_def effects[] = {{"stiffness", &spring, 1}, {"wave", &liver, 1}};
    shcd_model *model = soft_sphere(0.05, 8);
    (void)state;
    check_paths(model, effects, 2, K_N_PER_M, 33);
    shcd_model_free(model);
}

static void test_closed_paths_on_a_beating_body_with_friction(void **state) {
    const shcd_effect_def effects[] = {{"stiffness", &spring, 1},
                                       {"friction", &rubbing, 1},
                                       {"wave", &liver, 1},
                                       {"pulse", &beat, 1}};
    shcd_model *model = soft_sphere(0.05, 8);
    (void)state;
    check_paths(model, effects, 4, K_N_PER_M + 400.0, 34);
    shcd_model_free(model);
}

/* A beating surface drags a tool along whose hand only takes: what it takes is what the heart
 * brings in, and nothing else. */
static void check_carried(const shcd_effect_def *rub, double stiffness, double drag) {
    const shcd_parameter_value beats[] = {
        {.name = "mode", .value = 3.0},         {.name = "amplitude_m", .value = 0.004},
        {.name = "frequency_hz", .value = 2.0}, {.name = "direction_x", .value = 0.0},
        {.name = "direction_y", .value = 1.0},  {.name = "direction_z", .value = 0.0}};
    /* undamped modes give back what they got: nothing else that could pay for the hand */
    const shcd_parameter_value undamped[] = {liver, {.name = "damping_ratio", .value = 0.0}};
    const shcd_effect_def effects[] = {
        {"stiffness", &spring, 1}, *rub, {"wave", undamped, 2}, {"pulse", beats, 6}};
    shcd_model *model = soft_sphere(0.05, 8);
    account *a = malloc(sizeof *a);
    shcd_vec3 p = {0.05 + RADIUS_M + 1e-4, 0.0, 0.0};
    double carried_j = 0.0;
    assert_non_null(a);
    account_open(a, model, NULL, effects, 4, K_N_PER_M + stiffness);
    a->drag_n_s_per_m = drag;
    account_reset(a);
    for (int i = 0; i < 6000; i++) {
        const double x = 0.05 + RADIUS_M + 1e-4 - fmin(3e-3, 1e-5 * i);
        const shcd_vec3 force = a->f.out[0].wrench.force_n;
        const double step_m = i > 400 ? 0.3 * FIXTURE_TICK_S * force.y : 0.0;
        carried_j += step_m * force.y;
        p = shcd_vec3_make(x, p.y + step_m, 0.0);
        account_tick(a, p);
    }
    print_message(
        "%s: %.3g J taken along the surface, %.3g J brought in, slack %.3g J, least margin "
        "%.3g J\n",
        rub->name, carried_j, a->driven_j, a->ledger.slack_j, a->least_j);
    assert_true(carried_j > 1e-4);
    assert_true(a->least_j >= -TOLERANCE_J * check_tolerance_scale());
    fixture_close(&a->f);
    shcd_model_free(model);
    free(a);
}

static void test_what_a_beating_surface_carries_is_brought_in_by_pulse(void **state) {
    const shcd_parameter_value drag = {.name = "damping_n_s_per_m", .value = 3.0};
    const shcd_effect_def drags = {"viscosity", &drag, 1}, rubs = {"friction", &rubbing, 1};
    (void)state;
    check_carried(&drags, 0.0, 3.0);
    check_carried(&rubs, 400.0, 0.0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_paths_with_friction),
        cmocka_unit_test(test_closed_paths_with_relaxation),
        cmocka_unit_test(test_closed_paths_on_a_soft_body),
        cmocka_unit_test(test_closed_paths_on_a_beating_body_with_friction),
        cmocka_unit_test(test_what_a_beating_surface_carries_is_brought_in_by_pulse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
