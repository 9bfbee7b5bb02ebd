/* SPDX-License-Identifier: BSD-3-Clause */
/* The bound of the passivity controller in the closed loop: what the hand takes out, by the
 * published force and its own true motion, never exceeds the reserve as long as the loop is no
 * later than was stated; whatever the stiffness, the effects and the damping of the hand.
 * SHCD_TEST_SCALE=100 runs thousands of loops. */
#include "paths.h"
#include "session.h"

#include "shcd/vec.h"
#include "support/soft.h"

#include <float.h>

#define RATE_HZ 1000.0
#define LATEST_S 2e-3
#define SEED 0x5eed

static shcd_model *bodies[2];
static rig loop_rig;

static int make_bodies(void **state) {
    (void)state;
    bodies[0] = soft_sphere(0.05, 8);
    bodies[1] = paths_bent();
    return 0;
}

static int free_bodies(void **state) {
    (void)state;
    shcd_model_free(bodies[0]);
    shcd_model_free(bodies[1]);
    return 0;
}

/* A hand that damps little on a body that may be ten times too stiff. */
static rig_setup draw(size_t i, double delay_s, double stated_s, check_random *r) {
    device_profile stated = device_profiles[0];
    stated.delay_s = stated_s;
    rig_setup setup = {.model = bodies[i % 2],
                       .radius_m = 0.003,
                       .stiffness_n_per_m = 500.0 * pow(40.0, check_uniform(r, 0.0, 1.0)),
                       .damping_ratio = i % 3 == 0 ? 0.0 : check_uniform(r, 0.1, 1.0),
                       .friction_n_per_m = i % 4 == 1 ? check_uniform(r, 300.0, 5000.0) : 0.0,
                       .device = &device_profiles[0],
                       .reserve_j = device_reserve_j(&stated, RATE_HZ),
                       .delay_s = stated_s,
                       .hand = {.mass_kg = check_uniform(r, 0.08, 0.3),
                                .damping_n_s_per_m = check_uniform(r, 0.0, 1.0),
                                .grip_n_per_m = check_uniform(r, 200.0, 500.0),
                                .delay_s = delay_s,
                                .rate_hz = RATE_HZ}};
    setup.youngs_modulus_pa = i % 6 == 2 ? 1e4 * pow(30.0, check_uniform(r, 0.0, 1.0)) : 0.0;
    return setup;
}

/* @return what was taken beyond the bound [J] */
static double run(size_t i, const rig_setup *setup, check_random *r) {
    const session s =
        session_make((session_kind)(i % SESSION_KINDS), setup, bodies_random_direction(r),
                     bodies_random_direction(r), check_uniform(r, 0.5, 4.0));
    (void)session_run(&loop_rig, setup, &s);
    /* between two whole ticks of delay: the proof in daemon/passivity.h, with its last term */
    const double uneven_j = loop_rig.uneven_j + setup->device->force_max_n * loop_rig.uneven_most_m;
    /* and the rounding of sums of N terms of at most 10 mJ */
    const double n = (double)loop_rig.seq;
    return loop_rig.taken_most_j - setup->reserve_j - uneven_j - n * n * DBL_EPSILON * 0.01;
}

static void test_reserve_bounds_what_is_taken_up_to_the_stated_delay(void **state) {
    const size_t n = 24 + check_scaled(72);
    double whole = 0.0, between = 0.0;
    size_t n_guarded = 0;
    (void)state;
    print_message("seed %d\n", SEED);
    for (size_t i = 0; i < n; i++) {
        check_random r = {SEED + i};
        /* every other loop is late by whole ticks, where the bound is the reserve alone */
        const double delay_s =
            i % 2 == 0 ? 1e-3 * (double)(i / 2 % 3) : 5e-5 * floor(check_uniform(&r, 0.0, 41.0));
        const rig_setup setup = draw(i, delay_s, LATEST_S, &r);
        const double beyond_j = run(i, &setup, &r);
        if (beyond_j > 0.0) {
            fail_msg("loop %zu: k %.6g N/m, damping %.3g, friction %.4g N/m, E %.4g Pa, delay %.3g "
                     "ms: %.4g J taken, %.4g J beyond the bound",
                     i, setup.stiffness_n_per_m, setup.damping_ratio, setup.friction_n_per_m,
                     setup.youngs_modulus_pa, 1e3 * delay_s, loop_rig.taken_most_j, beyond_j);
        }
        double *most = loop_rig.uneven_most_m > 0.0 ? &between : &whole;
        *most = fmax(*most, loop_rig.taken_most_j / setup.reserve_j);
        n_guarded += loop_rig.n_guarded > 0;
        rig_close(&loop_rig);
    }
    print_message("taken at most, of the reserve: %.4f late by whole ticks, %.4f else; %zu of %zu "
                  "loops guarded\n",
                  whole, between, n_guarded, n);
    /* the bound is met, not only kept: 0.88 of it in 31 loops, 1.0000 in 300 and more */
    assert_true(whole > 0.6 && 3 * n_guarded > n);
}

/* Two milliseconds late where one was stated: the hand takes out more. What the daemon is told of
 * the motion cannot show it: its own books stay within the reserve. */
static void test_reserve_does_not_bound_a_loop_that_is_later_than_stated(void **state) {
    double most_j = 0.0;
    (void)state;
    for (size_t i = 0; i < 6; i++) {
        check_random r = {SEED + i};
        rig_setup setup = draw(0, LATEST_S, device_profiles[0].delay_s, &r);
        setup.stiffness_n_per_m = 2000.0;
        setup.damping_ratio = 0.3;
        setup.hand.damping_n_s_per_m = 0.5;
        (void)run(i, &setup, &r);
        const tick_energy e = tick_energy_of(&loop_rig.core);
        assert_true(e.taken_j - e.given_j <= setup.reserve_j);
        most_j = fmax(most_j, loop_rig.taken_most_j / setup.reserve_j);
        rig_close(&loop_rig);
    }
    print_message("%.3g times the reserve\n", most_j);
    assert_true(most_j > 2.0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reserve_bounds_what_is_taken_up_to_the_stated_delay),
        cmocka_unit_test(test_reserve_does_not_bound_a_loop_that_is_later_than_stated),
    };
    return cmocka_run_group_tests(tests, make_bodies, free_bodies);
}
