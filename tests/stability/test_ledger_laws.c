/* SPDX-License-Identifier: BSD-3-Clause */
/* The energy ledger of every elastic law, of a relief and of a drag: on closed paths the inequality
 * of shcd/energy.h holds in every tick, with K the Lipschitz constant of the law's force down to
 * the depth of the paths, and D the drag. */
#include "account.h"
#include "support/network.h"

/* What a law is, and how stiff and dragging it is over the paths. */
typedef struct law {
    const shcd_effect_def *effects;
    size_t n;
    const char *elastic;
    double stiffness_n_per_m, drag_n_s_per_m;
} law;

/* A random path goes to 0.5 and twice 25/12, the sum of its terms, of its depth. */
#define DEEPEST_M (5.0 * DEPTH_M)

static void check_law(const shcd_model *model, const law *l, uint64_t seed) {
    account *a = malloc(sizeof *a);
    check_random r = {seed};
    double stored_most_j = 0.0;
    assert_non_null(a);
    account_open(a, model, NULL, l->effects, l->n, l->stiffness_n_per_m);
    a->elastic = l->elastic;
    a->drag_n_s_per_m = l->drag_n_s_per_m;
    for (size_t i = 0; i < check_scaled(80); i++) {
        const path p =
            path_make(model, (path_kind)(i % PATH_KINDS), bodies_random_direction(&r), RADIUS_M,
                      check_uniform(&r, 5e-4, DEPTH_M), check_uniform(&r, 0.01, 0.15), &r);
        account_reset(a);
        for (int k = 0; k <= TICKS; k++) {
            account_tick(a, path_at(&p, (double)k / TICKS));
        }
        if (!(a->least_j >= -TOLERANCE_J * check_tolerance_scale())) {
            fail_msg("path %zu kind %d: margin %.3g J, slack %.3g, given %.3g, taken %.3g, stored "
                     "at most %.3g",
                     i, (int)p.kind, a->least_j, a->ledger.slack_j, a->ledger.given_j,
                     a->ledger.taken_j, a->stored_most_j);
        }
        stored_most_j = fmax(stored_most_j, a->stored_most_j);
    }
    print_message("%s: up to %.3g J stored\n", l->effects[l->n - 1].name, stored_most_j);
    assert_true(stored_most_j > 100.0 * TOLERANCE_J);
    fixture_close(&a->f);
    free(a);
}

static const shcd_parameter_value spring = {.name = "k_n_per_m", .value = K_N_PER_M};

/* 2 E* sqrt(R depth), rising */
static void test_closed_paths_with_hertz(void **state) {
    const shcd_parameter_value young = {.name = "youngs_modulus_pa", .value = 20000.0};
    const shcd_effect_def effect = {"stiffness", &young, 1};
    const double k = 2.0 * 20000.0 / (1.0 - 0.45 * 0.45) * sqrt(RADIUS_M * DEEPEST_M);
    const law l = {&effect, 1, "stiffness", k, 0.0};
    shcd_model *model = paths_random(5);
    (void)state;
    check_law(model, &l, 41);
    shcd_model_free(model);
}

/* The steepest row: (20 - 4) kPa over 0.3 of 1 cm, on pi (3 mm)^2. */
static void test_closed_paths_with_a_table(void **state) {
    const double rows[] = {0.0, 0.0, 0.1, 1000.0, 0.3, 4000.0, 0.6, 20000.0};
    const shcd_parameter_value table = {
        .name = "stress_strain", .table = rows, .n_rows = sizeof rows / sizeof rows[0] / 2};
    const shcd_effect_def effect = {"stiffness", &table, 1};
    const double area_m2 = 3.14159265358979324 * RADIUS_M * RADIUS_M;
    const law l = {&effect, 1, "stiffness", 16000.0 / (0.3 * 0.01) * area_m2, 0.0};
    shcd_model *model = paths_random(6);
    (void)state;
    check_law(model, &l, 42);
    shcd_model_free(model);
}

/* The law's potential U(D + w h) has (1 + |w' h| + |grad h|)^2 U'' + (|w''| |h| + 2 |w'| |grad h| +
 * |h''|) U' at most, h <= A, its slope A q and curvature A q^2, w' <= 1.5/(3 A), w'' <= 6/(3 A)^2;
 * U' = k D where w does not change, and k 3 A at most where it does. */
static void test_closed_paths_with_a_relief(void **state) {
    const double amplitude_m = 1e-4, q = 2.0 * 3.14159265358979324 / 0.02;
    const shcd_parameter_value relief[] = {{.name = "amplitude_m", .value = amplitude_m},
                                           {.name = "wavelength_m", .value = 0.02},
                                           {.name = "pattern", .value = 1.0}};
    const shcd_effect_def effects[] = {{"stiffness", &spring, 1}, {"texture", relief, 3}};
    const double slope = amplitude_m * q, rise = 1.0 + 0.5 + slope;
    const double k = K_N_PER_M * (rise * rise + 2.0 + 3.0 * slope + DEEPEST_M * slope * q);
    const law l = {effects, 2, "stiffness", k, 0.0};
    shcd_model *model = paths_random(7);
    (void)state;
    check_law(model, &l, 43);
    shcd_model_free(model);
}

static void test_closed_paths_with_a_drag(void **state) {
    const shcd_parameter_value drag = {.name = "damping_n_s_per_m", .value = 3.0};
    const shcd_effect_def effects[] = {{"stiffness", &spring, 1}, {"viscosity", &drag, 1}};
    const law l = {effects, 2, "stiffness", K_N_PER_M, 3.0};
    shcd_model *model = paths_random(8);
    (void)state;
    check_law(model, &l, 44);
    shcd_model_free(model);
}

static shcd_model *trained_body(const shcd_learned *network) {
    double coefficients[12];
    const double eigenvalues[NETWORK_MODES] = {0.0, 800.0};
    const double rows[NETWORK_MODES * 4] = {20.0, 0.0, 0.0, 0.0, 0.0, 20.0};
    const shcd_modes modes = {NETWORK_MODES, eigenvalues, rows, 0.03, 0.0, 5e-4, 0, 0};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    bodies_ellipsoid_coefficients(0.06, 0.05, 0.04, coefficients);
    def.degree = 1;
    def.coefficients = coefficients;
    def.modes = &modes;
    def.learned = network;
    assert_int_equal(shcd_model_create(&def, NULL, &model, NULL), SHCD_OK);
    return model;
}

/* The network's stiffness is measured along the normal at many places, and doubled for what a
 * stiffness that varies over a support adds along the surface. */
static void test_closed_paths_with_a_learned_response(void **state) {
    double numbers[NETWORK_NUMBERS];
    const shcd_learned network = network_by_hand(numbers);
    const shcd_effect_def effect = {"learned", NULL, 0};
    shcd_model *model = trained_body(&network);
    check_random r = {9};
    double k = 0.0;
    (void)state;
    for (int i = 0; i < 2000; i++) {
        shcd_learned_output out;
        const shcd_vec3 x = shcd_scale(0.05, bodies_random_direction(&r));
        const double depth_m = check_uniform(&r, 0.0, DEEPEST_M);
        assert_int_equal(shcd_learned_evaluate(&network, x, depth_m, &out), SHCD_OK);
        k = fmax(k, out.stiffness_n_per_m);
    }
    const law l = {&effect, 1, "learned", 2.0 * k, 0.0};
    check_law(model, &l, 45);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_paths_with_hertz),
        cmocka_unit_test(test_closed_paths_with_a_table),
        cmocka_unit_test(test_closed_paths_with_a_relief),
        cmocka_unit_test(test_closed_paths_with_a_drag),
        cmocka_unit_test(test_closed_paths_with_a_learned_response),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
