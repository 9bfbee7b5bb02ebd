/* SPDX-License-Identifier: BSD-3-Clause */
/* The closed loop on soft bodies: `wave` in series with the spring, on convex and hollow places.
 * The spring's own stiffness decides: a body that gives way only makes the surface softer. Without
 * a spring it is the membrane's stiffness within a tick. */
#include "paths.h"
#include "session.h"

#include "shcd/fit.h"
#include "shcd/vec.h"
#include "support/soft.h"

#define DEGREE 10
#define BODIES 2
#define PERIOD_S 1e-3
#define SEED 0x10af

static shcd_model *bodies[BODIES];
static rig loop_rig;

/* The bent body again, with its modes. */
static shcd_model *make_bent(void) {
    const double parameters[4] = {0.05, 0.04, 0.06, 0.04};
    double coefficients[3 * SHCD_COUNT(DEGREE)];
    shcd_modes_options options = SHCD_MODES_OPTIONS_INIT;
    shcd_modes *modes = NULL;
    shcd_model *plain, *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    bodies_project(DEGREE, bodies_bent, parameters, coefficients);
    plain = bodies_create(DEGREE, coefficients);
    if (shcd_fit_modes(plain, &options, &modes, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    def.degree = DEGREE;
    def.coefficients = coefficients;
    def.modes = modes;
    if (shcd_model_create(&def, NULL, &model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    shcd_modes_free(modes);
    shcd_model_free(plain);
    return model;
}

static int make_bodies(void **state) {
    (void)state;
    bodies[0] = soft_sphere(0.05, DEGREE);
    bodies[1] = make_bent();
    return 0;
}

static int free_bodies(void **state) {
    (void)state;
    shcd_model_free(bodies[0]);
    shcd_model_free(bodies[1]);
    return 0;
}

static void run(size_t i, double margin, check_random *r, bool expected) {
    const bool is_hard = expected || i % 5 == 0;
    const double k = 10.0 * pow(2000.0, is_hard ? 1.0 : check_uniform(r, 0.0, 1.0));
    const double e_pa = 1e3 * pow(1e3, expected ? 1.0 : check_uniform(r, 0.0, 1.0));
    const double delay_s = 5e-5 * floor(check_uniform(r, 0.0, 41.0));
    const size_t body = i % BODIES;
    const rig_setup setup = {.model = bodies[body],
                             .radius_m = 0.003,
                             .stiffness_n_per_m = k,
                             .youngs_modulus_pa = e_pa,
                             .device = &rig_bare_device,
                             .reserve_j = HUGE_VAL,
                             .hand = {.mass_kg = 0.1,
                                      .damping_n_s_per_m = margin * k * (0.5 * PERIOD_S + delay_s),
                                      .grip_n_per_m = 300.0,
                                      .grip_n_s_per_m = expected ? 0.0 : 0.2,
                                      .delay_s = delay_s,
                                      .rate_hz = 1.0 / PERIOD_S}};
    const shcd_vec3 w = {1.0, check_uniform(r, -0.2, 0.2), check_uniform(r, -0.3, 0.3)};
    /* a dent of at most 4 mm */
    const double force_n = fmin(2.0, 0.004 * rig_static_stiffness(&setup));
    const session s = session_make((session_kind)(i / BODIES % SESSION_KINDS), &setup, w,
                                   bodies_random_direction(r), force_n);
    const watch seen = session_run(&loop_rig, &setup, &s);
    if (watch_is_oscillating(&seen, 0.0) != expected || (!expected && loop_rig.excess_j > 0.0)) {
        fail_msg("%zu: k %.6g N/m, E %.6g Pa, delay %.3g ms, session %d: second %.3g m, third "
                 "%.3g m, %d changes, excess %.3g J",
                 i, k, e_pa, 1e3 * delay_s, (int)s.kind, seen.second_m, seen.third_m,
                 seen.n_changes, loop_rig.excess_j);
    }
    assert_true(seen.deepest_m > 0.0);
    rig_close(&loop_rig);
}

static void test_soft_loop_inside_the_region_comes_to_rest(void **state) {
    (void)state;
    check_random r = {21};
    const size_t n = check_scaled(24);
    for (size_t i = 0; i < n; i++) {
        run(i, 1.05, &r, false);
    }
}

/* A tool in the valley between two soft bodies, pressed into both: springs beside each other add
 * up, so the loop needs the damping of twice the stiffness. */
static void test_loop_between_two_soft_bodies_comes_to_rest(void **state) {
    (void)state;
    check_random r = {23};
    uint32_t most = 0;
    for (size_t i = 0; i < 4 + check_scaled(16); i++) {
        const double k = 10.0 * pow(2000.0, check_uniform(&r, 0.0, 1.0));
        const double e_pa = 1e3 * pow(1e3, check_uniform(&r, 0.0, 1.0));
        const double delay_s = 5e-5 * floor(check_uniform(&r, 0.0, 41.0));
        const rig_setup setup = {
            .model = bodies[0],
            .other = bodies[0],
            .other_at_m = {0.045, 0.0525, 0.0},
            .radius_m = 0.003,
            .stiffness_n_per_m = k,
            .youngs_modulus_pa = e_pa,
            .device = &rig_bare_device,
            .reserve_j = HUGE_VAL,
            .hand = {.mass_kg = 0.1,
                     .damping_n_s_per_m = 1.05 * 2.0 * k * (0.5 * PERIOD_S + delay_s),
                     .grip_n_per_m = 300.0,
                     .grip_n_s_per_m = 0.2,
                     .delay_s = delay_s,
                     .rate_hz = 1.0 / PERIOD_S}};
        const shcd_vec3 w = {1.0, 0.0, 0.0}, along = {0.0, 0.3, 1.0};
        const session s = session_make((session_kind)(i % SESSION_KINDS), &setup, w, along,
                                       fmin(2.0, 0.004 * rig_static_stiffness(&setup)));
        const watch seen = session_run(&loop_rig, &setup, &s);
        if (watch_is_oscillating(&seen, 0.0) || loop_rig.excess_j > 0.0) {
            fail_msg("%zu: k %.6g N/m, E %.6g Pa, delay %.3g ms, session %d: excess %.3g J", i, k,
                     e_pa, 1e3 * delay_s, (int)s.kind, loop_rig.excess_j);
        }
        most = loop_rig.most_contacts > most ? loop_rig.most_contacts : most;
        rig_close(&loop_rig);
    }
    print_message("up to %u contacts at once\n", most);
    assert_true(most >= 2);
}

/* Membrane alone or in series with a spring, `damping` and `friction` together, one body or the
 * valley between two: the region is that of the stiffness within a tick (rig_tick_stiffness()). A
 * damper or an anchor that moved with the surface without pushing it would shake the hand here. */
static rig_setup draw_mix(size_t i, check_random *r) {
    const bool is_two = i % 2 == 1;
    const double delay_s = 5e-5 * floor(check_uniform(r, 0.0, 41.0));
    rig_setup setup = {
        .model = is_two ? bodies[0] : bodies[i / 2 % BODIES],
        .other = is_two ? bodies[0] : NULL,
        .other_at_m = {0.045, 0.0525, 0.0},
        .radius_m = 0.003,
        .stiffness_n_per_m = i % 3 == 0 ? 0.0 : 10.0 * pow(2000.0, check_uniform(r, 0.0, 1.0)),
        .damping_ratio = i % 4 == 0 ? 0.0 : check_uniform(r, 0.05, 0.6),
        .friction_n_per_m = i % 5 < 2 ? 0.0 : 10.0 * pow(300.0, check_uniform(r, 0.0, 1.0)),
        .youngs_modulus_pa = 1e3 * pow(1e3, check_uniform(r, 0.0, 1.0)),
        .wave_damping_ratio = check_uniform(r, 0.02, 0.4),
        .device = &rig_bare_device,
        .reserve_j = HUGE_VAL,
        .hand = {.mass_kg = 0.1,
                 .grip_n_per_m = 300.0,
                 .grip_n_s_per_m = 0.2,
                 .delay_s = delay_s,
                 .rate_hz = 1.0 / PERIOD_S}};
    setup.hand.damping_n_s_per_m =
        1.05 * (is_two ? 2.0 : 1.0) * rig_tick_stiffness(&setup) * (0.5 * PERIOD_S + delay_s);
    return setup;
}

static void test_loop_with_damping_and_friction_on_soft_bodies_comes_to_rest(void **state) {
    (void)state;
    uint32_t most = 0;
    print_message("seed %d\n", SEED);
    for (size_t i = 0; i < 12 + check_scaled(48); i++) {
        check_random r = {SEED + i};
        const rig_setup setup = draw_mix(i, &r);
        const shcd_vec3 w = {1.0, 0.0, check_uniform(&r, -0.2, 0.2)}, along = {0.0, 0.3, 1.0};
        const session s = session_make((session_kind)(i % SESSION_KINDS), &setup, w, along,
                                       fmin(2.0, 0.004 * rig_static_stiffness(&setup)));
        const watch seen = session_run(&loop_rig, &setup, &s);
        if (watch_is_oscillating(&seen, 0.0) || loop_rig.excess_j > 0.0) {
            fail_msg("%zu: k %.6g N/m, damping %.3g, friction %.4g N/m, E %.4g Pa, zeta %.3g, "
                     "delay %.3g ms, session %d: second %.3g m, third %.3g m, %d changes, excess "
                     "%.3g J",
                     i, setup.stiffness_n_per_m, setup.damping_ratio, setup.friction_n_per_m,
                     setup.youngs_modulus_pa, setup.wave_damping_ratio, 1e3 * setup.hand.delay_s,
                     (int)s.kind, seen.second_m, seen.third_m, seen.n_changes, loop_rig.excess_j);
        }
        most = loop_rig.most_contacts > most ? loop_rig.most_contacts : most;
        rig_close(&loop_rig);
    }
    assert_true(most >= 2);
}

/* Gristle at 1 MPa in series with 20 kN/m, and a tenth of the damping. */
static void test_soft_loop_outside_the_region_oscillates(void **state) {
    (void)state;
    check_random r = {22};
    const size_t n = check_scaled(12);
    for (size_t i = 0; i < n; i++) {
        run(i, 0.1, &r, true);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_soft_loop_inside_the_region_comes_to_rest),
        cmocka_unit_test(test_loop_between_two_soft_bodies_comes_to_rest),
        cmocka_unit_test(test_loop_with_damping_and_friction_on_soft_bodies_comes_to_rest),
        cmocka_unit_test(test_soft_loop_outside_the_region_oscillates),
    };
    return cmocka_run_group_tests(tests, make_bodies, free_bodies);
}
