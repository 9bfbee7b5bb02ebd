/* SPDX-License-Identifier: BSD-3-Clause */
/* The energy ledger of a ball in a groove, slowly: the slack of the inequality of shcd/energy.h
 * goes with the square of a tick's motion, so that at a few micrometres a tick it hides nothing.
 * The balls fit into the groove or do not, are pressed in as far as beyond their radius, and pass
 * focal points, where walls begin and end; the bodies are rigid and soft. SHCD_TEST_SCALE=100 walks
 * thousands of laps. */
#include "groove_walk.h"

#include "support/groove.h"

#include <float.h>

#define SEED 0x6007
#define LAPS 2
#define K_N_PER_M 500.0
#define ANCHOR_N_PER_M 300.0
#define DRAG_N_S_PER_M 0.5

/* A depth to 1e-9 of the diagonal, 0.1 m, which enters energy and work with k depth, and the
 * rounding of the sums. */
#define TOLERANCE_J (K_N_PER_M * 0.012 * 1e-9 * 0.1 * 2.0 + 1e-13)

/* A relief of 0.1 mm and 6 mm: the foot is pressed k (1 + (A q)^2 + D A q^2) stiff at most, q = 2
 * pi/6 mm and D, the depth in all walls, below 12 mm. */
#define RELIEF_M 1e-4
#define RELIEF_WAVE_M 6e-3
#define RELIEF_STIFFER 2.4

typedef enum beside { BESIDE_NOTHING, BESIDE_RUBBING, BESIDE_RELIEF } beside;

/* An ellipse in the plane of the groove's section, turned, with a part along the groove; first a
 * straight way in, last one out. */
typedef struct lap {
    double touched_m, in_m, deep_m, across_m, off_m, along_m, sense;
    int n_ticks;
} lap;

static shcd_vec3 lap_at(const lap *l, int i) {
    const double gate =
        fmin(1.0, fmin((double)i / l->n_ticks, (LAPS + 2.0) - (double)i / l->n_ticks));
    const double turn = 2.0 * GROOVE_PI * l->sense * i / l->n_ticks;
    const double x = l->touched_m + (1.0 - gate) * 1e-4 - gate * (l->in_m + l->deep_m * cos(turn));
    return shcd_vec3_make(x, gate * l->along_m * cos(2.0 * turn),
                          gate * (l->off_m + l->across_m * sin(turn)));
}

typedef struct result {
    double least_j; /* margin */
    double given_j, slack_j, most_n;
    uint32_t most_contacts;
    int n_changes;  /* of the number of contacts */
    int n_yielding; /* ticks */
} result;

static result walk(fixture *f, const lap *l, beside what) {
    const double stiffness = what == BESIDE_RUBBING  ? K_N_PER_M + ANCHOR_N_PER_M
                             : what == BESIDE_RELIEF ? RELIEF_STIFFER * K_N_PER_M
                                                     : K_N_PER_M;
    const double drag = what == BESIDE_RUBBING ? DRAG_N_S_PER_M : 0.0;
    result r = {.least_j = HUGE_VAL};
    uint32_t before = 0;
    shcd_ledger ledger;
    memset(&ledger, 0, sizeof ledger);
    assert_int_equal(shcd_state_init(f->scene, f->memory, shcd_state_size(f->scene), &f->state),
                     SHCD_OK);
    for (int i = 0; i <= (LAPS + 2) * l->n_ticks; i++) {
        (void)groove_book(f, &ledger, lap_at(l, i), stiffness, drag);
        r.least_j = fmin(r.least_j, shcd_ledger_margin(&ledger));
        r.most_n = fmax(r.most_n, shcd_norm(f->out[0].wrench.force_n));
        r.n_changes += i > 0 && f->out[0].n_contacts != before;
        r.n_yielding += (f->out[0].flags & SHCD_TOOL_OUTPUT_YIELDING) != 0;
        before = f->out[0].n_contacts;
        r.most_contacts = before > r.most_contacts ? before : r.most_contacts;
    }
    r.given_j = ledger.given_j;
    r.slack_j = ledger.slack_j;
    return r;
}

/* @param young_pa  of the membrane; 0: rigid
 * @param what      beside the spring: `friction` and `viscosity`, or `texture` */
static void check_laps(double young_pa, beside what, size_t n_laps, double tolerance_j) {
    const shcd_parameter_value spring = {.name = "k_n_per_m", .value = K_N_PER_M};
    const shcd_parameter_value wave[] = {{.name = "youngs_modulus_pa", .value = young_pa},
                                         {.name = "damping_ratio", .value = 0.05}};
    const shcd_parameter_value anchor = {.name = "stiffness_n_per_m", .value = ANCHOR_N_PER_M};
    const shcd_parameter_value drag = {.name = "damping_n_s_per_m", .value = DRAG_N_S_PER_M};
    const shcd_parameter_value relief[] = {{.name = "amplitude_m", .value = RELIEF_M},
                                           {.name = "wavelength_m", .value = RELIEF_WAVE_M}};
    shcd_effect_def effects[4] = {{"stiffness", &spring, 1}};
    size_t n_effects = 1;
    if (young_pa > 0.0) {
        effects[n_effects++] = (shcd_effect_def){"wave", wave, 2};
    }
    if (what == BESIDE_RELIEF) {
        effects[n_effects++] = (shcd_effect_def){"texture", relief, 2};
    }
    if (what == BESIDE_RUBBING) {
        effects[n_effects++] = (shcd_effect_def){"friction", &anchor, 1};
        effects[n_effects++] = (shcd_effect_def){"viscosity", &drag, 1};
    }
    check_random random = {SEED};
    int n_changes = 0, n_yielding = 0;
    double least_j = HUGE_VAL, given_j = 0.0;
    for (size_t i = 0; i < n_laps; i++) {
        const double waist = check_uniform(&random, 0.1, 0.75);
        const double radius_m = check_uniform(&random, 0.003, 0.016);
        shcd_model *model =
            young_pa > 0.0 ? groove_soft_body(8, waist) : groove_body(GROOVE_DEGREE_MAX, waist);
        const shcd_body_def body =
            fixture_body("body", model, fixture_pose(0, 0, 0), effects, n_effects);
        const shcd_tool_def tool = fixture_tool("ball", radius_m);
        fixture f;
        fixture_open(&f, &body, 1, &tool, 1);
        const double in_m = fmin(radius_m, 0.006) * check_uniform(&random, 0.2, 1.2);
        const lap l = {.touched_m = groove_touched_at(&f, 2e-5),
                       .in_m = in_m,
                       .deep_m = in_m * check_uniform(&random, 0.1, 0.6),
                       .across_m = check_uniform(&random, 2e-4, 2.5e-3),
                       .off_m = check_uniform(&random, -1e-3, 1e-3),
                       .along_m = check_uniform(&random, 0.0, 1e-3),
                       .sense = i % 2 == 0 ? 1.0 : -1.0,
                       .n_ticks = 2000};
        const result r = walk(&f, &l, what);
        if (!(r.least_j >= -tolerance_j * check_tolerance_scale())) {
            fail_msg("lap %zu: waist %.3f, ball of %.2f mm, %.2f mm in: margin %.3g J of %.3g J "
                     "given, slack %.3g J",
                     i, waist, 1e3 * radius_m, 1e3 * in_m, r.least_j, r.given_j, r.slack_j);
        }
        assert_true(r.most_n > 0.0);
        assert_true(10.0 * r.slack_j < r.given_j);
        assert_true(r.most_contacts > 1 || what == BESIDE_RELIEF || r.n_yielding == 0);
        n_yielding += r.n_yielding > 0;
        least_j = fmin(least_j, r.least_j);
        given_j = fmax(given_j, r.given_j);
        n_changes += r.n_changes > 2; /* more than touching and leaving */
        fixture_close(&f);
        shcd_model_free(model);
    }
    print_message("least margin %.3g J, up to %.3g J given; of %zu walls began or ended in %d, and "
                  "yielded in %d\n",
                  least_j, given_j, n_laps, n_changes, n_yielding);
    assert_true(n_changes > 0);
    assert_true(n_yielding > 0 || n_laps < 6);
}

static void test_slow_laps_in_a_rigid_groove_yield_nothing(void **state) {
    (void)state;
    check_laps(0.0, BESIDE_NOTHING, 2 + check_scaled(16), TOLERANCE_J);
}

static void test_slow_laps_in_a_soft_groove_yield_nothing(void **state) {
    (void)state;
    check_laps(1e6, BESIDE_NOTHING, 1 + check_scaled(7), TOLERANCE_J);
    check_laps(1e4, BESIDE_NOTHING, 1 + check_scaled(7), TOLERANCE_J);
}

static void test_slow_laps_with_friction_and_viscosity_yield_nothing(void **state) {
    (void)state;
    check_laps(0.0, BESIDE_RUBBING, 1 + check_scaled(9), TOLERANCE_J);
    check_laps(1e4, BESIDE_RUBBING, 1 + check_scaled(5), TOLERANCE_J);
}

static void test_slow_laps_over_a_relief_yield_nothing(void **state) {
    (void)state;
    check_laps(0.0, BESIDE_RELIEF, 1 + check_scaled(9), TOLERANCE_J);
    check_laps(1e4, BESIDE_RELIEF, 1 + check_scaled(5), TOLERANCE_J);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slow_laps_in_a_rigid_groove_yield_nothing),
        cmocka_unit_test(test_slow_laps_in_a_soft_groove_yield_nothing),
        cmocka_unit_test(test_slow_laps_over_a_relief_yield_nothing),
        cmocka_unit_test(test_slow_laps_with_friction_and_viscosity_yield_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
