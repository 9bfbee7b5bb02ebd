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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_paths_with_friction),
        cmocka_unit_test(test_closed_paths_with_relaxation),
        cmocka_unit_test(test_closed_paths_on_a_soft_body),
        cmocka_unit_test(test_closed_paths_on_a_beating_body_with_friction),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
