/* SPDX-License-Identifier: BSD-3-Clause */
/* A ball in a groove: its walls together are no stiffer than the one spring that the device was
 * promised, so that the loop at the device's own limit comes to rest there, too; and on closed
 * paths through the groove no law yields more than a held spring does. */
#include "groove_walk.h"
#include "paths.h"
#include "session.h"

#include "shcd/energy.h"
#include "support/groove.h"
#include "support/scene_fixture.h"

#include <float.h>

#define K_N_PER_M 700.0
#define TICKS 300
#define DEPTH_M 0.002
#define PRESS_TICKS 8000

/* A depth to 1e-9 of the diagonal, 0.1 m, which enters the energy with k depth and the work with
 * k |dx|, and the rounding of the sums. */
#define TOLERANCE_J (K_N_PER_M * 3.0 * DEPTH_M * 1e-9 * 0.1 * 2.0 + TICKS * DBL_EPSILON)

/* ---- the loop ------------------------------------------------------------------------------- */

/* Where a ball is led, and how. */
typedef struct press_path {
    double radius_m, from_m, off_m, across_m, grip_n_per_m;
    double speed_m_per_s;
} press_path;

/* Presses along the middle, beside it, and across it, where a ball of that radius fits in and where
 * it does not. */
static watch press(const device_profile *device, const shcd_model *model, const press_path *p,
                   uint32_t *most_contacts) {
    const double rate_hz = 1000.0, force_n = 3.0;
    const rig_setup setup = {.model = model,
                             .radius_m = p->radius_m,
                             .stiffness_n_per_m = device_stiffness_max(device, rate_hz),
                             .device = device,
                             .reserve_j = HUGE_VAL,
                             .hand = {.mass_kg = device->mass_kg,
                                      .damping_n_s_per_m = device->damping_n_s_per_m,
                                      .grip_n_per_m = p->grip_n_per_m,
                                      .grip_n_s_per_m = 0.2,
                                      .delay_s = device->delay_s,
                                      .rate_hz = rate_hz}};
    shcd_vec3 at = {p->from_m, 0.0, p->off_m};
    static rig r;
    rig_open(&r, &setup, at);
    /* in until the grip presses with the force, then across */
    for (int i = 0; i < PRESS_TICKS && p->grip_n_per_m * (r.hand.position_m.x - at.x) < force_n;
         i++) {
        at.x -= p->speed_m_per_s / rate_hz;
        rig_tick(&r, at);
    }
    for (int i = 1; i <= 500; i++) {
        at.z = p->off_m + p->across_m * sin(2.0 * 3.14159265358979324 * i / 500.0);
        rig_tick(&r, at);
    }
    const watch w = watch_hold(&r);
    *most_contacts = r.most_contacts;
    rig_close(&r);
    return w;
}

static void test_the_loop_in_a_groove_comes_to_rest_at_the_device_limit(void **state) {
    const double depths[] = {0.3, 0.525, 0.75};
    (void)state;
    for (size_t d = 0; d < 3; d++) {
        shcd_model *model = groove_body(12, depths[d]);
        for (double radius_m = 0.010; radius_m < 0.0205; radius_m += 0.002) {
            for (int k = 0; k < 2; k++) {
                uint32_t n = 0;
                const press_path p = {radius_m, 0.06, k == 0 ? 0.0 : 3e-4, k == 0 ? 0.0 : 2e-3,
                                      300.0,    0.01};
                const watch w = press(&device_profiles[0], model, &p, &n);
                print_message("waist %.3f, ball of %2.0f mm, %s: there and back %.3g and %.3g m, "
                              "%u walls\n",
                              depths[d], 1e3 * radius_m, k == 0 ? "pressed" : "slid across",
                              w.second_m, w.third_m, n);
                assert_true(n >= 2);
                assert_true(w.deepest_m > 0.0);
                assert_false(watch_is_oscillating(&w, 0.0));
            }
        }
        shcd_model_free(model);
    }
}

/* Balls of 2 to 5 mm in grooves of a body of 12 mm, pressed in by half of their radius and more by
 * a stiff grip, out to where they slip through to another wall: the force changes faster than k
 * |dx| there, but the contact gives no more than it was given, and the loop comes to rest, without
 * the passivity controller. */
static void test_the_loop_of_a_ball_that_does_not_fit_comes_to_rest(void **state) {
    const double scale = 0.2, depths[] = {0.3, 0.525, 0.75};
    check_random random = {31};
    double deepest = 0.0;
    int n_several = 0;
    (void)state;
    for (size_t i = 0; i < 2 + check_scaled(10); i++) {
        double c[GROOVE_COUNT];
        uint32_t n = 0;
        groove_coefficients(GROOVE_DEGREE_MAX, depths[i % 3], c);
        for (size_t k = 0; k < GROOVE_COUNT; k++) {
            c[k] *= scale;
        }
        shcd_model *model = groove_model(GROOVE_DEGREE_MAX, c, NULL);
        const press_path p = {.radius_m = check_uniform(&random, 0.002, 0.0048),
                              .from_m = 0.06 * scale,
                              .off_m = check_uniform(&random, -6e-5, 6e-5),
                              .across_m = check_uniform(&random, 0.0, 4e-4),
                              .grip_n_per_m = check_uniform(&random, 600.0, 3000.0),
                              .speed_m_per_s = 0.002};
        const watch w = press(&device_profiles[0], model, &p, &n);
        if (watch_is_oscillating(&w, 0.0)) {
            fail_msg("%zu: waist %.3f, ball of %.2f mm, grip %.0f N/m: there and back %.3g and "
                     "%.3g m",
                     i, depths[i % 3], 1e3 * p.radius_m, p.grip_n_per_m, w.second_m, w.third_m);
        }
        deepest = fmax(deepest, w.deepest_m / p.radius_m);
        n_several += n > 1;
        shcd_model_free(model);
    }
    print_message("up to %.2f radii deep, several walls in %d\n", deepest, n_several);
    assert_true(deepest > 0.5 && n_several > 0);
}

/* ---- the ledger ----------------------------------------------------------------------------- */

/* A closed path: from outside in, about in depth, across the groove and along it, and out again at
 * the same place. */
typedef struct groove_path {
    path waves;
    double touched_m; /* distance from the axis at which the ball touches, in the middle */
    double depth_m, across_m, along_rad;
} groove_path;

static shcd_vec3 groove_at(const groove_path *p, double s) {
    const double gate = path_gate(s), out_m = 3e-3;
    const double depth_m = p->depth_m * (0.5 + path_wave(&p->waves, 2, s));
    const double x = p->touched_m + out_m - gate * (out_m + depth_m);
    const double turn = gate * p->along_rad * path_wave(&p->waves, 0, s);
    return shcd_vec3_make(x * cos(turn), x * sin(turn),
                          gate * p->across_m * path_wave(&p->waves, 1, s));
}

/* What the account of a path comes to. */
typedef struct account {
    double least_j;      /* smallest margin */
    double least_bare_j; /* the same without the slack */
    double given_j, stored_most_j;
    uint32_t most_contacts;
} account;

static account walk_groove(fixture *f, const groove_path *p, double stiffness_n_per_m) {
    account a = {HUGE_VAL, HUGE_VAL, 0.0, 0.0, 0};
    shcd_ledger ledger;
    memset(&ledger, 0, sizeof ledger);
    assert_int_equal(shcd_state_init(f->scene, f->memory, shcd_state_size(f->scene), &f->state),
                     SHCD_OK);
    for (int i = 0; i <= TICKS; i++) {
        const double stored_j =
            groove_book(f, &ledger, groove_at(p, (double)i / TICKS), stiffness_n_per_m, 0.0);
        a.least_j = fmin(a.least_j, shcd_ledger_margin(&ledger));
        a.least_bare_j = fmin(a.least_bare_j, shcd_ledger_margin(&ledger) - ledger.slack_j);
        a.stored_most_j = fmax(a.stored_most_j, stored_j);
        a.most_contacts =
            f->out[0].n_contacts > a.most_contacts ? f->out[0].n_contacts : a.most_contacts;
    }
    a.given_j = ledger.given_j;
    return a;
}

static void check_law(const shcd_effect_def *effects, size_t n_effects,
                      double (*stiffness_at)(double, double), uint64_t seed) {
    const double radii[] = {0.010, 0.012, 0.016};
    check_random r = {seed};
    shcd_model *model = groove_body(12, 0.525);
    for (size_t i = 0; i < 3; i++) {
        const shcd_body_def body =
            fixture_body("body", model, fixture_pose(0, 0, 0), effects, n_effects);
        const shcd_tool_def tool = fixture_tool("ball", radii[i]);
        double least_j = HUGE_VAL, bare_j = HUGE_VAL, given_j = 0.0, stored_j = 0.0;
        fixture f;
        fixture_open(&f, &body, 1, &tool, 1);
        const double touched_m = groove_touched_at(&f, 1e-4);
        for (size_t n = 0; n < check_scaled(60); n++) {
            const groove_path p = {.waves = path_make(model, PATH_RANDOM, shcd_vec3_make(1, 0, 0),
                                                      radii[i], 0.0, 0.0, &r),
                                   .touched_m = touched_m,
                                   .depth_m = check_uniform(&r, 1e-4, DEPTH_M),
                                   .across_m = check_uniform(&r, 0.0, 1.5e-3),
                                   .along_rad = check_uniform(&r, 0.0, 0.2)};
            const account a = walk_groove(&f, &p, stiffness_at(radii[i], 3.0 * DEPTH_M));
            least_j = fmin(least_j, a.least_j);
            bare_j = fmin(bare_j, a.least_bare_j);
            given_j = fmax(given_j, a.given_j);
            stored_j = fmax(stored_j, a.stored_most_j);
        }
        print_message("ball of %2.0f mm: least margin %.3g J, %.3g J without the slack, of up to "
                      "%.3g J given and %.3g J stored\n",
                      1e3 * radii[i], least_j, bare_j, given_j, stored_j);
        assert_true(least_j >= -TOLERANCE_J * check_tolerance_scale());
        assert_true(bare_j < -100.0 * TOLERANCE_J); /* the slack is not idle */
        fixture_close(&f);
    }
    shcd_model_free(model);
}

static double linear_at(double radius_m, double depth_m) {
    (void)radius_m;
    (void)depth_m;
    return K_N_PER_M;
}

#define YOUNG_PA 5000.0
static double hertz_at(double radius_m, double depth_m) {
    return 2.0 * YOUNG_PA / (1.0 - 0.45 * 0.45) * sqrt(radius_m * depth_m);
}

static void test_closed_paths_through_a_groove(void **state) {
    const shcd_parameter_value spring = {.name = "k_n_per_m", .value = K_N_PER_M};
    const shcd_parameter_value hertz = {.name = "youngs_modulus_pa", .value = YOUNG_PA};
    const shcd_effect_def laws[] = {{"stiffness", &spring, 1}, {"stiffness", &hertz, 1}};
    (void)state;
    check_law(&laws[0], 1, linear_at, 21);
    check_law(&laws[1], 1, hertz_at, 22);
}

/* Anchors on both walls, whose shares change as the ball goes about: their spring yields its own
 * k |dx|^2/2 beside that of the law, and no more. */
#define ANCHOR_N_PER_M 500.0
static double anchored_at(double radius_m, double depth_m) {
    return linear_at(radius_m, depth_m) + ANCHOR_N_PER_M;
}

static void test_closed_paths_with_friction(void **state) {
    const shcd_parameter_value spring = {.name = "k_n_per_m", .value = K_N_PER_M};
    const shcd_parameter_value anchor[] = {
        {.name = "stiffness_n_per_m", .value = ANCHOR_N_PER_M},
        {.name = "static_ratio", .value = 2.0},
        {.name = "kinetic_ratio", .value = 1.0},
    };
    const shcd_effect_def effects[] = {{"stiffness", &spring, 1}, {"friction", anchor, 3}};
    (void)state;
    check_law(effects, 2, anchored_at, 23);
}

/* A ball pressed into the groove and moved along it by less than the friction breaks away at is
 * held by the spring of one anchor, in all. */
static void test_friction_along_a_groove_is_one_spring(void **state) {
    const shcd_parameter_value spring = {.name = "k_n_per_m", .value = K_N_PER_M};
    const shcd_parameter_value anchor[] = {
        {.name = "stiffness_n_per_m", .value = ANCHOR_N_PER_M},
        {.name = "static_ratio", .value = 10.0},
    };
    const shcd_effect_def effects[] = {{"stiffness", &spring, 1}, {"friction", anchor, 2}};
    (void)state;
    for (int k = 0; k < 3; k++) {
        shcd_model *model = groove_body(12, 0.3 + 0.225 * k);
        const shcd_body_def body = fixture_body("body", model, fixture_pose(0, 0, 0), effects, 2);
        const shcd_tool_def tool = fixture_tool("ball", 0.012);
        const double along_m = 2e-5;
        fixture f;
        fixture_open(&f, &body, 1, &tool, 1);
        const double x = groove_touched_at(&f, 1e-4) - 1e-3;
        const shcd_vec3 rest = {0.0, 0.0, 0.0};
        for (int i = 0; i < 1000; i++) { /* until the contact has yielded */
            (void)fixture_move(&f, shcd_vec3_make(x, 0.0, 0.0), rest);
        }
        const double before_n = f.out[0].wrench.force_n.y;
        const shcd_tool_output *out = fixture_move(&f, shcd_vec3_make(x, along_m, 0.0), rest);
        const double stiffness = (before_n - out->wrench.force_n.y) / along_m;
        print_message("waist %.3f: %u walls, %.1f N/m along it\n", 0.3 + 0.225 * k, out->n_contacts,
                      stiffness);
        assert_int_equal(out->n_contacts, 2);
        /* the waist bends away by (along/x)^2/2, 1e-6 */
        assert_true(stiffness <= ANCHOR_N_PER_M * (1.0 + 1e-3));
        assert_true(stiffness >= 0.5 * ANCHOR_N_PER_M);
        fixture_close(&f);
        shcd_model_free(model);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_paths_through_a_groove),
        cmocka_unit_test(test_closed_paths_with_friction),
        cmocka_unit_test(test_friction_along_a_groove_is_one_spring),
        cmocka_unit_test(test_the_loop_in_a_groove_comes_to_rest_at_the_device_limit),
        cmocka_unit_test(test_the_loop_of_a_ball_that_does_not_fit_comes_to_rest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
