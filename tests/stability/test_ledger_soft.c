/* SPDX-License-Identifier: BSD-3-Clause */
/* The energy ledger of soft bodies with `damping`, with `friction` beside it, and of two soft
 * bodies that a tool presses into at once: on closed paths the inequality of shcd/energy.h holds in
 * every tick. Parameters, bodies and paths are random; SHCD_TEST_SCALE=100 walks thousands of
 * paths. */
#include "account.h"

#define SEED 0x50f7
#define LEAD 60

typedef struct draw {
    shcd_parameter_value k, ratio, rub, young, zeta;
    double stiffness_n_per_m; /* of all springs that a tool feels at once */
} draw;

typedef enum mix { MIX_FRICTION = 1, MIX_TWO = 2, MIX_NO_LAW = 4 } mix;

/* @return number of effects */
static size_t make(draw *d, int m, check_random *r, shcd_effect_def effects[4]) {
    size_t n = 0;
    d->k = (shcd_parameter_value){.name = "k_n_per_m", .value = check_uniform(r, 100.0, 700.0)};
    d->ratio = (shcd_parameter_value){.name = "ratio", .value = check_uniform(r, 0.05, 1.0)};
    d->rub =
        (shcd_parameter_value){.name = "stiffness_n_per_m", .value = check_uniform(r, 50.0, 500.0)};
    d->young = (shcd_parameter_value){.name = "youngs_modulus_pa",
                                      .value = 1e3 * pow(30.0, check_uniform(r, 0.0, 1.0))};
    d->zeta = (shcd_parameter_value){.name = "damping_ratio", .value = check_uniform(r, 0.0, 0.4)};
    d->stiffness_n_per_m = 0.0;
    if ((m & MIX_NO_LAW) == 0) {
        effects[n++] = (shcd_effect_def){"stiffness", &d->k, 1};
        d->stiffness_n_per_m = d->k.value;
    }
    effects[n++] = (shcd_effect_def){"wave", &d->young, 1};
    effects[n++] = (shcd_effect_def){"damping", &d->ratio, 1};
    if ((m & MIX_FRICTION) != 0) {
        effects[n++] = (shcd_effect_def){"friction", &d->rub, 1};
        d->stiffness_n_per_m += d->rub.value;
    }
    return n;
}

static double share_of(int k) {
    return fmax(0.0, fmin((double)k / TICKS, 1.0));
}

/* Where a path begins outside of one body it may be inside of the other: first comes a way in, and
 * last one out, across the valley between the two. */
static shcd_vec3 from_the_valley(const path *p, int k) {
    const shcd_vec3 out = {0.759, -0.651, 0.0}; /* at a right angle to the line of centres */
    const double away = fmax(0.0, fmax(-k, k - TICKS)) / LEAD;
    return shcd_mul_add(path_at(p, share_of(k)), 0.01 * fmin(away, 1.0), out);
}

static void check_mix(int m) {
    account *a = malloc(sizeof *a);
    shcd_model *model = soft_sphere(0.05, 8);
    const shcd_vec3 other_at_m = {0.045, 0.0525, 0.0};
    const size_t n_paths = 4 + check_scaled(36);
    size_t n_moved = 0;
    uint32_t n_contacts = 0;
    assert_non_null(a);
    print_message("seed %d\n", SEED + m);
    for (size_t i = 0; i < n_paths; i++) {
        check_random r = {SEED + (uint64_t)m + 16 * i};
        draw d;
        shcd_effect_def effects[4];
        const bool is_two = (m & MIX_TWO) != 0;
        const size_t n = make(&d, m, &r, effects);
        account_open(a, model, is_two ? &other_at_m : NULL, effects, n, 0.0);
        if ((m & MIX_NO_LAW) != 0) { /* the membrane's own, in a tick or held */
            double tick, held;
            assert_int_equal(shcd_scene_wave_stiffness(a->f.scene, 0, FIXTURE_TICK_S, &tick, &held),
                             SHCD_OK);
            d.stiffness_n_per_m += fmax(tick, held);
            a->elastic = "wave";
        }
        a->stiffness_n_per_m = (is_two ? 2.0 : 1.0) * d.stiffness_n_per_m;
        a->damping_s_per_m = 1.5 * d.ratio.value / 0.1;
        const shcd_vec3 valley = {1.0, check_uniform(&r, 0.0, 0.1), check_uniform(&r, -0.3, 0.3)};
        const path p = path_make(
            model, (path_kind)(i % PATH_KINDS), is_two ? valley : bodies_random_direction(&r),
            RADIUS_M, check_uniform(&r, 5e-4, DEPTH_M), check_uniform(&r, 0.01, 0.15), &r);
        account_reset(a);
        for (int k = -LEAD; k <= TICKS + LEAD + 50; k++) {
            account_tick(a, is_two ? from_the_valley(&p, k) : path_at(&p, share_of(k)));
        }
        if (!(a->least_j >= -TOLERANCE_J * check_tolerance_scale())) {
            fail_msg(
                "path %zu kind %d: margin %.3g J, slack %.3g, given %.3g, taken %.3g, stored at "
                "most %.3g; k %.3g, E %.3g, ratio %.2g",
                i, (int)p.kind, a->least_j, a->ledger.slack_j, a->ledger.given_j, a->ledger.taken_j,
                a->stored_most_j, d.k.value, d.young.value, d.ratio.value);
        }
        n_contacts = a->most_contacts > n_contacts ? a->most_contacts : n_contacts;
        n_moved += a->stored_most_j > 100.0 * TOLERANCE_J;
        fixture_close(&a->f);
    }
    shcd_model_free(model);
    free(a);
    assert_true(10 * n_moved > 9 * n_paths); /* a random one may miss the body */
    assert_true(n_contacts >= ((m & MIX_TWO) != 0 ? 2u : 1u));
}

static void test_closed_paths_with_damping_on_a_soft_body(void **state) {
    (void)state;
    check_mix(0);
    check_mix(MIX_NO_LAW);
}

static void test_closed_paths_with_damping_and_friction_on_a_soft_body(void **state) {
    (void)state;
    check_mix(MIX_FRICTION);
    check_mix(MIX_FRICTION | MIX_NO_LAW);
}

static void test_closed_paths_with_damping_between_two_soft_bodies(void **state) {
    (void)state;
    check_mix(MIX_TWO);
    check_mix(MIX_TWO | MIX_NO_LAW);
}

static void test_closed_paths_with_damping_and_friction_between_two_soft_bodies(void **state) {
    (void)state;
    check_mix(MIX_TWO | MIX_FRICTION);
    check_mix(MIX_TWO | MIX_FRICTION | MIX_NO_LAW);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_paths_with_damping_on_a_soft_body),
        cmocka_unit_test(test_closed_paths_with_damping_and_friction_on_a_soft_body),
        cmocka_unit_test(test_closed_paths_with_damping_between_two_soft_bodies),
        cmocka_unit_test(test_closed_paths_with_damping_and_friction_between_two_soft_bodies),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
