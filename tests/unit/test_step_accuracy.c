/* SPDX-License-Identifier: BSD-3-Clause */
/* Tiers and budgets in the tick: which tier answers, in which order a tick degrades, what it says,
 * and that it never spends more than stated. */
#include "shcd/vec.h"
#include "support/bodies.h"
#include "support/scene_fixture.h"

#define DEGREE 8
#define EVALUATION_NS 100.0
#define PATCH_NS 1.0
#define EXACT_NS 4000.0
#define FAST_NS 2000.0
/* A proxy is followed by at most five times 16 Newton steps with up to 8 halvings each; a query
 * gets 8 evaluations and 64 bounds at least, and finishes what it has begun: one Newton run of 24
 * steps, four patches, one block of leaves, one winding number. */
#define OVERSPENT_EVALUATIONS 400.0

static shcd_model *make_model(void) {
    check_random random = {0x57e9};
    return bodies_create_random(&random, DEGREE, 0.05);
}

static shcd_body_accuracy accuracy_of(int tier, double budget_us) {
    shcd_body_accuracy a = SHCD_BODY_ACCURACY_DEFAULT;
    a.tier = tier;
    a.budget_us = budget_us;
    a.evaluation_ns = EVALUATION_NS;
    a.patch_ns = PATCH_NS;
    a.exact_ns = EXACT_NS;
    a.fast_ns = FAST_NS;
    return a;
}

static void open_scene(fixture *f, const shcd_model *model, shcd_body_accuracy accuracy,
                       size_t n_tools) {
    static const char *const names[] = {"a", "b", "c"};
    const shcd_effect_def spring = {"stiffness", NULL, 0};
    shcd_body_def body = fixture_body("body", model, fixture_pose(0.0, 0.0, 0.0), &spring, 1);
    shcd_tool_def tools[3];
    body.accuracy = accuracy;
    for (size_t t = 0; t < n_tools; t++) {
        tools[t] = fixture_tool(names[t], 0.01);
    }
    fixture_open(f, &body, 1, tools, n_tools);
}

/* A point outside, `way` of the way along a circle about the body, 5 cm above the surface. */
static shcd_vec3 above(const shcd_model *model, double way) {
    shcd_vec3 x, n;
    const shcd_vec3 w = {cos(way), sin(way), 0.3};
    assert_int_equal(shcd_model_surface(model, -1, w, &x, &n, NULL), SHCD_OK);
    return shcd_mul_add(x, 0.05, n);
}

static double spent_ns(const shcd_tool_output *out) {
    return EVALUATION_NS * out->n_evaluations + PATCH_NS * out->n_patches;
}

/* ---- tiers ---- */

/* Each tier answers as its own query does, and the output names it. */
static void test_step_tier_of_the_body_answers(void **state) {
    static const int tiers[] = {SHCD_TIER_EXACT, SHCD_TIER_FAST, SHCD_TIER_MAP};
    shcd_model *model = make_model();
    (void)state;
    for (size_t k = 0; k < 3; k++) {
        fixture f;
        const shcd_query_options options = {sizeof options, tiers[k], 0, 0.0, 0, 0};
        open_scene(&f, model, accuracy_of(tiers[k], 0.0), 1);
        for (int i = 0; i < 20; i++) {
            shcd_proximity query;
            const shcd_vec3 p = above(model, 0.01 * i);
            const shcd_tool_output *out = fixture_move(&f, p, shcd_vec3_make(0.0, 0.0, 0.0));
            assert_int_equal(shcd_closest(model, p, &options, &query), SHCD_OK);
            assert_int_equal(out->tier, tiers[k]);
            assert_true((out->flags & SHCD_TOOL_OUTPUT_DEGRADED) == 0);
            /* exact: the tolerance, 1e-9 of the diagonal, about 4 m */
            assert_near(out->distance_m, query.distance_m - 0.01, 1e-8);
        }
        fixture_close(&f);
    }
    shcd_model_free(model);
}

/* track: the first answer is found, all others are followed from it. */
static void test_step_track_follows_the_first_foot(void **state) {
    shcd_model *model = make_model();
    shcd_proximity foot;
    fixture f;
    (void)state;
    open_scene(&f, model, accuracy_of(SHCD_TIER_TRACK, 0.0), 1);
    const shcd_vec3 still = {0.0, 0.0, 0.0};
    assert_int_equal(fixture_move(&f, above(model, 0.0), still)->tier, SHCD_TIER_FAST);
    const shcd_query_options fast = {sizeof fast, SHCD_TIER_FAST, 0, 0.0, 0, 0};
    assert_int_equal(shcd_closest(model, above(model, 0.0), &fast, &foot), SHCD_OK);
    for (int i = 1; i < 50; i++) {
        const shcd_vec3 p = above(model, 0.002 * i);
        const shcd_tool_output *out = fixture_move(&f, p, still);
        assert_int_equal(out->tier, SHCD_TIER_TRACK);
        assert_int_equal(out->n_patches, 0);
        assert_int_equal(out->flags, 0);
        assert_int_equal(shcd_track(model, p, foot.parameter, &foot), SHCD_OK);
        assert_true(out->distance_m == foot.distance_m - 0.01);
    }
    fixture_close(&f);
    shcd_model_free(model);
}

/* ---- budgets ---- */

static const shcd_tool_output *second_tick(fixture *f, const shcd_model *model) {
    (void)fixture_move(f, above(model, 0.0), shcd_vec3_make(0.0, 0.0, 0.0));
    return fixture_move(f, above(model, 0.002), shcd_vec3_make(0.0, 0.0, 0.0));
}

/* The order: exact, exact with less certainty, fast, track; each step below its stated price. */
static void test_step_budget_degrades_in_order(void **state) {
    static const struct {
        double budget_us;
        int tier;
        int is_degraded;
    } steps[] = {{1e3, SHCD_TIER_EXACT, 0},
                 {1e-3 * EXACT_NS, SHCD_TIER_EXACT, 0},
                 {0.999e-3 * EXACT_NS, SHCD_TIER_FAST, 1},
                 {1e-3 * FAST_NS, SHCD_TIER_FAST, 1},
                 {0.999e-3 * FAST_NS, SHCD_TIER_TRACK, 1},
                 {1e-6, SHCD_TIER_TRACK, 1}};
    shcd_model *model = make_model();
    (void)state;
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
        fixture f;
        open_scene(&f, model, accuracy_of(SHCD_TIER_EXACT, steps[i].budget_us), 1);
        const shcd_tool_output *out = second_tick(&f, model);
        assert_int_equal(out->tier, steps[i].tier);
        assert_int_equal((out->flags & SHCD_TOOL_OUTPUT_DEGRADED) != 0, steps[i].is_degraded);
        fixture_close(&f);
    }
    shcd_model_free(model);
}

/* An exact query that its caps cut short says so, and is still exact as far as it says. Near the
 * middle of a round body nothing can be excluded cheaply. */
static void test_step_budget_exact_is_truncated_first(void **state) {
    check_random random = {77};
    shcd_model *model = bodies_create_random(&random, DEGREE, 0.001);
    const shcd_model_info info = bodies_info(model);
    shcd_body_accuracy accuracy = accuracy_of(SHCD_TIER_EXACT, 1.0);
    (void)state;
    accuracy.exact_ns = accuracy.fast_ns = 0.0;
    fixture f;
    open_scene(&f, model, accuracy, 1);
    const shcd_tool_output *out =
        fixture_move(&f, info.star_centre_m, shcd_vec3_make(0.0, 0.0, 0.0));
    assert_int_equal(out->tier, SHCD_TIER_EXACT);
    assert_true((out->flags & SHCD_TOOL_OUTPUT_TRUNCATED) != 0);
    assert_true((out->flags & SHCD_TOOL_OUTPUT_DEGRADED) == 0);
    fixture_close(&f);
    shcd_model_free(model);
}

/* Three tools share; what the first two do not need the third may spend, and an inactive tool's
 * share is not lost. */
static void test_step_budget_flows_on_in_scene_order(void **state) {
    shcd_model *model = make_model();
    (void)state;
    for (int n_inactive = 0; n_inactive < 3; n_inactive++) {
        fixture f;
        /* a share of a third pays for a fast query, one of a half or all of it for an exact one */
        open_scene(&f, model, accuracy_of(SHCD_TIER_EXACT, 2.1e-3 * EXACT_NS), 3);
        for (int tick = 0; tick < 2; tick++) {
            for (int t = 0; t < 3; t++) {
                f.in[t].tool_in_world.position_m = above(model, t + 0.002 * tick);
                f.in[t].flags = t < 3 - n_inactive ? SHCD_TOOL_INPUT_ACTIVE : 0;
            }
            fixture_step(&f);
        }
        double left_ns = 2.1 * EXACT_NS;
        for (int t = 0; t < 3 - n_inactive; t++) {
            const double share = left_ns / (double)(3 - n_inactive - t);
            const int expected = share >= EXACT_NS  ? SHCD_TIER_EXACT
                                 : share >= FAST_NS ? SHCD_TIER_FAST
                                                    : SHCD_TIER_TRACK;
            assert_int_equal(f.out[t].tier, expected);
            left_ns = fmax(0.0, left_ns - spent_ns(&f.out[t]));
        }
        assert_int_equal(f.out[0].tier, n_inactive == 0 ? SHCD_TIER_FAST : SHCD_TIER_EXACT);
        fixture_close(&f);
    }
    shcd_model_free(model);
}

static shcd_vec3 wander(check_random *r, const shcd_model_info *info, shcd_vec3 p) {
    const shcd_vec3 step = shcd_scale(0.002 * info->diagonal_m, fixture_random_direction(r));
    const shcd_vec3 home = shcd_scale(1e-3, shcd_sub(info->centre_m, p));
    return shcd_add(p, shcd_add(step, home));
}

/* In and out of the body, with budgets from far too small to ample: the counts never exceed what
 * the budget pays for by more than what is stated, and two runs agree to the bit. */
static void test_step_budget_is_kept_and_deterministic(void **state) {
    static const double budgets_us[] = {0.01, 1.0, 3.0, 10.0, 100.0};
    shcd_model *model = make_model();
    const shcd_model_info info = bodies_info(model);
    (void)state;
    for (size_t k = 0; k < sizeof budgets_us / sizeof budgets_us[0]; k++) {
        fixture f[2];
        check_random r = {0xb0d9e7u + k};
        shcd_vec3 p[2] = {above(model, 0.5), above(model, 2.5)};
        size_t n_degraded = 0;
        for (int i = 0; i < 2; i++) {
            open_scene(&f[i], model, accuracy_of(SHCD_TIER_EXACT, budgets_us[k]), 2);
        }
        for (size_t tick = 0; tick < check_scaled(1500); tick++) {
            for (size_t t = 0; t < 2; t++) {
                p[t] = wander(&r, &info, p[t]);
                f[0].in[t].tool_in_world.position_m = f[1].in[t].tool_in_world.position_m = p[t];
            }
            fixture_step(&f[0]);
            fixture_step(&f[1]);
            assert_memory_equal(f[0].out, f[1].out, 2 * sizeof f[0].out[0]);
            const double spent = spent_ns(&f[0].out[0]) + spent_ns(&f[0].out[1]);
            const double leaves_ns = 2.0 * PATCH_NS * (double)info.n_leaves;
            assert_true(spent <= 1e3 * budgets_us[k] + leaves_ns +
                                     2.0 * OVERSPENT_EVALUATIONS * EVALUATION_NS);
            for (size_t t = 0; t < 2; t++) {
                const int is_degraded = (f[0].out[t].flags & SHCD_TOOL_OUTPUT_DEGRADED) != 0;
                assert_int_equal(is_degraded, f[0].out[t].tier != SHCD_TIER_EXACT);
                n_degraded += (size_t)is_degraded;
            }
        }
        print_message("budget %g us: %zu answers degraded\n", budgets_us[k], n_degraded);
        assert_true(budgets_us[k] > 0.1 || n_degraded > 0);
        assert_true(budgets_us[k] < 50.0 || n_degraded == 0);
        fixture_close(&f[0]);
        fixture_close(&f[1]);
    }
    shcd_model_free(model);
}

/* Another accuracy is another scene: a state of one is not accepted by the other. */
static void test_step_accuracy_is_part_of_the_scene(void **state) {
    shcd_model *model = make_model();
    fixture a, b;
    (void)state;
    open_scene(&a, model, accuracy_of(SHCD_TIER_EXACT, 10.0), 1);
    open_scene(&b, model, accuracy_of(SHCD_TIER_EXACT, 11.0), 1);
    const shcd_input input = {FIXTURE_TICK_S, a.in, 1};
    shcd_output output = {a.out, 1};
    assert_int_equal(shcd_step(b.scene, a.state, &input, &output), SHCD_ERR_ARGUMENT);
    fixture_close(&a);
    fixture_close(&b);
    shcd_model_free(model);
}

/* ---- from a table, and what is refused ---- */

static void test_body_accuracy_of_a_row_has_prices(void **state) {
    shcd_cost_row rows[2];
    shcd_body_accuracy a;
    (void)state;
    memset(rows, 0, sizeof rows);
    rows[0].degree = rows[1].degree = DEGREE;
    rows[1].tier = SHCD_TIER_FAST;
    rows[0].ns_p50 = 1000.0;
    rows[0].evaluations_mean = 5.0;
    rows[0].patches_mean = 160.0;
    rows[1].evaluations_mean = 3.0;
    rows[1].patches_mean = 64.0;
    assert_int_equal(shcd_body_accuracy_of(rows, 2, 0, 7.0, &a), SHCD_OK);
    assert_int_equal(a.tier, SHCD_TIER_EXACT);
    assert_near(a.budget_us, 7.0, 0.0);
    /* no prices in the table: a usual query costs its median, 5 + 160/32 = 10 evaluations */
    assert_near(a.evaluation_ns, 100.0, 1e-10);
    assert_near(a.exact_ns, 1000.0, 1e-9);
    assert_near(a.fast_ns, 500.0, 1e-9);
    assert_near(a.evaluation_share, 0.5, 1e-12);
    rows[0].evaluation_ns = 80.0;
    rows[0].patch_ns = 2.0;
    assert_int_equal(shcd_body_accuracy_of(rows, 2, 0, 0.0, &a), SHCD_OK);
    assert_near(a.exact_ns, 5.0 * 80.0 + 160.0 * 2.0, 1e-9);
    assert_int_equal(shcd_body_accuracy_of(rows, 2, 2, 0.0, &a), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_body_accuracy_of(NULL, 2, 0, 0.0, &a), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_body_accuracy_of(rows, 2, 0, -1.0, &a), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_body_accuracy_of(rows, 2, 0, (double)NAN, &a), SHCD_ERR_NOT_FINITE);
}

static void refused(const shcd_model *model, shcd_body_accuracy accuracy, shcd_status expected,
                    const char *text) {
    shcd_body_def body = fixture_body("egg", model, fixture_pose(0.0, 0.0, 0.0), NULL, 0);
    const shcd_tool_def tool = fixture_tool("tool", 0.0);
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    shcd_scene *scene = NULL;
    shcd_error error = {SHCD_OK, ""};
    body.accuracy = accuracy;
    def.bodies = &body;
    def.n_bodies = 1;
    def.tools = &tool;
    def.n_tools = 1;
    const shcd_status status = shcd_scene_create(&def, NULL, &scene, &error);
    if (status != expected || strstr(error.message, text) == NULL || scene != NULL) {
        fail_msg("status %d, '%s', not '%s'", (int)status, error.message, text);
    }
}

static void test_scene_create_bad_accuracy_is_refused(void **state) {
    shcd_model *model = fixture_sphere(0.05);
    shcd_body_accuracy a = accuracy_of(4, 0.0);
    (void)state;
    refused(model, a, SHCD_ERR_ARGUMENT, "body 'egg': unknown tier 4");
    a = accuracy_of(SHCD_TIER_EXACT, -1.0);
    refused(model, a, SHCD_ERR_ARGUMENT, "negative");
    a = accuracy_of(SHCD_TIER_EXACT, (double)NAN);
    refused(model, a, SHCD_ERR_NOT_FINITE, "not finite");
    a = accuracy_of(SHCD_TIER_EXACT, 1.0);
    a.patch_ns = 0.0;
    refused(model, a, SHCD_ERR_ARGUMENT, "a budget needs evaluation_ns and patch_ns");
    a = accuracy_of(SHCD_TIER_EXACT, 1.0);
    a.evaluation_share = 1.5;
    refused(model, a, SHCD_ERR_ARGUMENT, "evaluation_share");
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_step_tier_of_the_body_answers),
        cmocka_unit_test(test_step_track_follows_the_first_foot),
        cmocka_unit_test(test_step_budget_degrades_in_order),
        cmocka_unit_test(test_step_budget_exact_is_truncated_first),
        cmocka_unit_test(test_step_budget_flows_on_in_scene_order),
        cmocka_unit_test(test_step_budget_is_kept_and_deterministic),
        cmocka_unit_test(test_step_accuracy_is_part_of_the_scene),
        cmocka_unit_test(test_body_accuracy_of_a_row_has_prices),
        cmocka_unit_test(test_scene_create_bad_accuracy_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
