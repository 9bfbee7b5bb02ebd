/* SPDX-License-Identifier: BSD-3-Clause */
/* The energy ledger of effects with a memory: friction's anchor, relaxation's Maxwell elements, the
 * modes of a soft body, a heartbeat that brings energy in. What they hold and bring in is what the
 * tick reports (shcd_effect_output); on closed paths the inequality of shcd/energy.h holds in every
 * tick, with K the sum of the springs that the tool feels at once. */
#include "paths.h"

#include "shcd/shcd.h"
#include "support/soft.h"

#include <float.h>
#include <stdbool.h>
#include <string.h>

#define TICKS 300
#define RADIUS_M 0.003
#define K_N_PER_M 700.0
#define DEPTH_M 0.005
#define EFFECTS_MAX 8
/* As in test_ledger.c: a depth to 1e-9 of the diagonal, and the rounding of the sums. A soft body's
 * modes move with millinewton seconds and hold their energy to 4 ulp a tick. */
#define TOLERANCE_J (K_N_PER_M * DEPTH_M * 1e-9 * 0.2 * 2.0 + TICKS * 8.0 * DBL_EPSILON)

typedef struct account {
    fixture f;
    shcd_ledger ledger;
    shcd_effect_output effects[EFFECTS_MAX];
    shcd_vec3 forces_n[EFFECTS_MAX];
    double entry_j[EFFECTS_MAX];
    size_t n_effects;
    double stiffness_n_per_m;
    double driven_j;
    double least_j;
    double stored_most_j;
} account;

static void account_open(account *a, const shcd_model *model, const shcd_effect_def *effects,
                         size_t n, double stiffness_n_per_m) {
    const shcd_body_def body = fixture_body("body", model, fixture_pose(0, 0, 0), effects, n);
    const shcd_tool_def tool = fixture_tool("tool", RADIUS_M);
    memset(a, 0, sizeof *a);
    fixture_open(&a->f, &body, 1, &tool, 1);
    a->n_effects = shcd_scene_effect_count(a->f.scene);
    assert_int_equal(a->n_effects, n);
    a->stiffness_n_per_m = stiffness_n_per_m;
}

static void account_reset(account *a) {
    memset(&a->ledger, 0, sizeof a->ledger);
    memset(a->forces_n, 0, sizeof a->forces_n);
    memset(a->entry_j, 0, sizeof a->entry_j);
    assert_int_equal(
        shcd_state_init(a->f.scene, a->f.memory, shcd_state_size(a->f.scene), &a->f.state),
        SHCD_OK);
    a->least_j = HUGE_VAL;
    a->stored_most_j = a->driven_j = 0.0;
}

static void account_tick(account *a, shcd_vec3 p) {
    const shcd_pose pose = {p, {1.0, 0.0, 0.0, 0.0}};
    (void)shcd_ledger_move(&a->ledger, &pose, FIXTURE_TICK_S);
    shcd_ledger_share(&a->ledger, a->forces_n, a->n_effects, a->entry_j);
    a->f.in[0].tool_in_world = pose;
    a->f.in[0].velocity_m_per_s = shcd_scale(1.0 / FIXTURE_TICK_S, a->ledger.moved_m);
    const shcd_input input = {.dt_s = FIXTURE_TICK_S, .tools = a->f.in, .n_tools = 1};
    shcd_output output = {.tools = a->f.out,
                          .n_tools = 1,
                          .effects = a->effects,
                          .n_effects = a->n_effects,
                          .effect_forces_n = a->forces_n};
    assert_int_equal(shcd_step(a->f.scene, a->f.state, &input, &output), SHCD_OK);
    double stored_j = 0.0, driven_j = 0.0;
    for (size_t e = 0; e < a->n_effects; e++) {
        stored_j += a->effects[e].stored_j;
        driven_j += a->effects[e].work_j;
    }
    const shcd_ledger_input held = {.published = a->f.out[0].wrench,
                                    .model = a->f.out[0].wrench,
                                    .velocity_m_per_s = a->f.in[0].velocity_m_per_s,
                                    .stored_j = stored_j,
                                    .driven_j = driven_j - a->driven_j,
                                    .stiffness_n_per_m = a->stiffness_n_per_m};
    assert_int_equal(shcd_ledger_hold(&a->ledger, &held), SHCD_OK);
    assert_true(stored_j >= 0.0);
    a->driven_j = driven_j;
    a->stored_most_j = fmax(a->stored_most_j, stored_j);
    a->least_j = fmin(a->least_j, shcd_ledger_margin(&a->ledger));
}

/* Closed paths; then the tool waits outside, as bodies go on moving. */
static void check_paths(const shcd_model *model, const shcd_effect_def *effects, size_t n,
                        double stiffness_n_per_m, uint64_t seed) {
    account *a = malloc(sizeof *a);
    check_random r = {seed};
    const size_t n_paths = check_scaled(60);
    assert_non_null(a);
    account_open(a, model, effects, n, stiffness_n_per_m);
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
