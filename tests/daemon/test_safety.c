/* SPDX-License-Identifier: BSD-3-Clause */
/* The safety chain against closed forms, and against random and hostile input. Bounds that hold up
 * to rounding get 8 units in the last place: each stage is a handful of operations. */
#include "safety.h"

#include "shcd/vec.h"
#include "support/check.h"

#include <float.h>
#include <string.h>

#define ROUNDING (8.0 * DBL_EPSILON)

static const safety_limits limits = {5.0, 0.1, 500.0};
static const double dt_s = 0.001;

static shcd_wrench force(double x, double y, double z) {
    const shcd_wrench w = {{x, y, z}, {0.0, 0.0, 0.0}};
    return w;
}

static double random_size(check_random *r) {
    return pow(10.0, check_uniform(r, -3.0, 3.0)) * (check_uniform(r, -1.0, 1.0) < 0 ? -1 : 1);
}

static shcd_vec3 random_vector(check_random *r) {
    return shcd_scale(random_size(r),
                      shcd_vec3_make(check_normal(r), check_normal(r), check_normal(r)));
}

static void test_watchdog_levels_follow_the_age(void **state) {
    (void)state;
    const int64_t ms = 1000000;
    assert_int_equal(watchdog_of_age(-1), WATCHDOG_INACTIVE);
    assert_int_equal(watchdog_of_age(0), WATCHDOG_FRESH);
    assert_int_equal(watchdog_of_age(20 * ms), WATCHDOG_FRESH);
    assert_int_equal(watchdog_of_age(20 * ms + 1), WATCHDOG_HOLD);
    assert_int_equal(watchdog_of_age(50 * ms), WATCHDOG_HOLD);
    assert_int_equal(watchdog_of_age(50 * ms + 1), WATCHDOG_RAMP);
    assert_int_equal(watchdog_of_age(500 * ms), WATCHDOG_RAMP);
    assert_int_equal(watchdog_of_age(500 * ms + 1), WATCHDOG_INACTIVE);
    assert_int_equal(watchdog_of_age(INT64_MAX), WATCHDOG_INACTIVE);
}

static void test_clamp_inside_passes_bits_outside_keeps_direction(void **state) {
    (void)state;
    check_random r = {1};
    for (size_t i = 0; i < check_scaled(20000); i++) {
        bool acted;
        const shcd_vec3 v = random_vector(&r);
        const shcd_vec3 c = safety_clamp(v, 5.0, &acted);
        if (!acted) {
            assert_memory_equal(&c, &v, sizeof v);
            assert_at_most(shcd_norm(v), 5.0 * (1.0 + ROUNDING));
        } else {
            assert_near(shcd_norm(c), 5.0, 5.0 * ROUNDING);
            assert_near(shcd_dot(shcd_unit(c), shcd_unit(v)), 1.0, ROUNDING);
            assert_at_most(shcd_norm(shcd_cross(shcd_unit(c), shcd_unit(v))), ROUNDING);
        }
    }
}

static void test_clamp_of_the_largest_numbers_is_finite(void **state) {
    (void)state;
    bool acted;
    const shcd_vec3 v = {-DBL_MAX, DBL_MAX, DBL_MAX};
    const shcd_vec3 c = safety_clamp(v, 5.0, &acted);
    assert_true(acted);
    assert_near(c.x, -5.0 / sqrt(3.0), 5.0 * ROUNDING);
    assert_near(c.y, 5.0 / sqrt(3.0), 5.0 * ROUNDING);
    assert_near(c.z, 5.0 / sqrt(3.0), 5.0 * ROUNDING);
}

static void test_slew_never_exceeds_its_step_and_arrives(void **state) {
    (void)state;
    check_random r = {2};
    for (size_t i = 0; i < check_scaled(20000); i++) {
        bool acted;
        const shcd_vec3 last = random_vector(&r), wanted = random_vector(&r);
        const double step = fabs(random_size(&r));
        const double scale = shcd_norm(last) + shcd_norm(wanted);
        const shcd_vec3 w = safety_slew(last, wanted, step, &acted);
        assert_at_most(shcd_norm(shcd_sub(w, last)), step + scale * ROUNDING);
        if (!acted) {
            assert_memory_equal(&w, &wanted, sizeof w);
        }
    }
}

static void test_slew_step_response_is_a_straight_line(void **state) {
    (void)state;
    safety_state s = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, 1.0, {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}};
    for (int k = 1; k <= 12; k++) {
        uint32_t flags;
        const shcd_wrench w =
            safety_apply(&limits, &s, force(4.0, 0.0, 0.0), SAFETY_FULL, dt_s, &flags);
        assert_near(w.force_n.x, fmin(0.5 * k, 4.0), 4.0 * ROUNDING); /* 500 N/s, 1 ms */
        assert_int_equal(flags, k < 8 ? SAFETY_SLEW : 0);
    }
}

static void test_torque_is_clamped_and_slewed_by_its_own_cap(void **state) {
    (void)state;
    safety_state s = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, 1.0, {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}};
    const shcd_wrench wanted = {{0.0, 0.0, 0.0}, {0.0, -3.0, 0.0}};
    for (int k = 1; k <= 15; k++) {
        uint32_t flags;
        const shcd_wrench w = safety_apply(&limits, &s, wanted, SAFETY_FULL, dt_s, &flags);
        /* the whole cap takes 5 N/(500 N/s) = 10 ms, for torque as for force */
        assert_near(w.torque_n_m.y, -fmin(0.01 * k, 0.1), 0.1 * ROUNDING);
        assert_true((flags & SAFETY_LIMITED) != 0);
    }
}

static void test_ramp_takes_its_time_and_arrives_exactly(void **state) {
    (void)state;
    const double steps[] = {0.00025, 0.001, 0.0005, 0.002};
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
        double gain = 0.0;
        const int up = (int)lround(SAFETY_RAMP_ON_S / steps[i]);
        const int down = (int)lround(SAFETY_RAMP_OFF_S / steps[i]);
        for (int k = 1; k <= up; k++) {
            assert_true(gain < 1.0);
            gain = safety_ramp(gain, true, steps[i]);
            assert_near(gain, (double)k / up, 1e-12); /* k sums, each within an ulp of 1 */
        }
        assert_true(gain == 1.0 && safety_ramp(gain, true, steps[i]) == 1.0);
        for (int k = 1; k <= down; k++) {
            assert_true(gain > 0.0);
            gain = safety_ramp(gain, false, steps[i]);
            assert_near(gain, 1.0 - (double)k / down, 1e-12);
        }
        assert_true(gain == 0.0 && safety_ramp(gain, false, steps[i]) == 0.0);
    }
}

static void test_chain_at_rest_passes_the_model_force_bit_for_bit(void **state) {
    (void)state;
    check_random r = {3};
    for (int i = 0; i < 100; i++) {
        safety_state s = {0};
        uint32_t flags = 0;
        shcd_wrench w = {0}, wanted;
        wanted.force_n = safety_clamp(random_vector(&r), 4.9, &(bool){false});
        wanted.torque_n_m = safety_clamp(random_vector(&r), 0.09, &(bool){false});
        for (int k = 0; k < 210; k++) { /* 0.2 s of soft start, the slew within it */
            w = safety_apply(&limits, &s, wanted, SAFETY_FULL, dt_s, &flags);
        }
        assert_memory_equal(&w, &wanted, sizeof w);
        assert_int_equal(flags, 0);
    }
}

static void test_chain_soft_start_is_linear(void **state) {
    (void)state;
    safety_state s = {0};
    for (int k = 1; k <= 200; k++) {
        uint32_t flags;
        const shcd_wrench w =
            safety_apply(&limits, &s, force(0.0, 0.4, 0.0), SAFETY_FULL, dt_s, &flags);
        assert_near(w.force_n.y, 0.4 * k / 200.0, 1e-12);
        assert_int_equal(flags, k < 200 ? SAFETY_RAMP : 0);
    }
}

static void test_chain_fault_falls_to_zero_and_starts_softly_again(void **state) {
    (void)state;
    const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    for (size_t i = 0; i < 3; i++) {
        safety_state s = {
            {{2.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, 1.0, {{2.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}};
        uint32_t flags;
        shcd_wrench w;
        for (int k = 1; k <= 4; k++) { /* 2 N at 0.5 N a tick */
            w = safety_apply(&limits, &s, force(2.0, bad[i], 0.0), SAFETY_FULL, dt_s, &flags);
            assert_near(w.force_n.x, 2.0 - 0.5 * k, 2.0 * ROUNDING);
            assert_true((flags & SAFETY_FAULT) != 0);
        }
        assert_true(w.force_n.x == 0.0 && s.gain == 0.0);
        w = safety_apply(&limits, &s, force(0.4, 0.0, 0.0), SAFETY_FULL, dt_s, &flags);
        assert_near(w.force_n.x, 0.4 / 200.0, 1e-12);
        assert_int_equal(flags, SAFETY_RAMP);
    }
}

static void test_chain_cut_obeys_the_slew_and_then_starts_softly(void **state) {
    (void)state;
    safety_state s = {
        {{0.0, 0.0, -3.0}, {0.0, 0.0, 0.0}}, 1.0, {{0.0, 0.0, -3.0}, {0.0, 0.0, 0.0}}};
    uint32_t flags;
    for (int k = 1; k <= 6; k++) {
        assert_true(s.gain == 1.0);
        const shcd_wrench w =
            safety_apply(&limits, &s, force(0.0, 0.0, -3.0), SAFETY_CUT, dt_s, &flags);
        assert_near(w.force_n.z, -3.0 + 0.5 * k, 3.0 * ROUNDING);
    }
    assert_true(s.gain == 0.0);
}

static void test_chain_fade_reaches_zero_in_its_time(void **state) {
    (void)state;
    const shcd_wrench five = {{5.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    safety_state s = {five, 1.0, five};
    for (int k = 1; k <= 50; k++) {
        uint32_t flags;
        const shcd_wrench w =
            safety_apply(&limits, &s, force(5.0, 0.0, 0.0), SAFETY_FADE, dt_s, &flags);
        assert_near(w.force_n.x, 5.0 * (1.0 - k / 50.0), 1e-11);
        assert_int_equal(flags, SAFETY_RAMP);
    }
    assert_true(s.gain == 0.0);
}

/* Whatever comes in: finite, inside the caps, and between two ticks no more than the slew. */
static void test_chain_output_is_bounded_for_any_input(void **state) {
    (void)state;
    check_random r = {4};
    safety_state s = {0};
    shcd_wrench last = {0};
    const double step_n = limits.slew_max_n_per_s * dt_s;
    const double share = limits.torque_max_n_m / limits.force_max_n;
    for (size_t i = 0; i < check_scaled(200000); i++) {
        shcd_wrench wanted = {random_vector(&r), random_vector(&r)};
        const uint64_t dice = check_random_bits(&r) % 40;
        if (dice < 4) {
            const double odd[] = {(double)NAN, (double)INFINITY, DBL_MAX, -DBL_MAX};
            wanted.force_n.y = odd[dice];
            wanted.torque_n_m.z = odd[3 - dice];
        }
        const safety_wish wish = dice > 37 ? SAFETY_CUT : dice > 34 ? SAFETY_FADE : SAFETY_FULL;
        uint32_t flags;
        const shcd_wrench w = safety_apply(&limits, &s, wanted, wish, dt_s, &flags);
        assert_true(shcd_vec3_is_finite(w.force_n) && shcd_vec3_is_finite(w.torque_n_m));
        assert_at_most(shcd_norm(w.force_n), limits.force_max_n * (1.0 + ROUNDING));
        assert_at_most(shcd_norm(w.torque_n_m), limits.torque_max_n_m * (1.0 + ROUNDING));
        assert_at_most(shcd_norm(shcd_sub(w.force_n, last.force_n)), step_n * (1.0 + 1e-9));
        assert_at_most(shcd_norm(shcd_sub(w.torque_n_m, last.torque_n_m)),
                       step_n * share * (1.0 + 1e-9));
        last = w;
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_watchdog_levels_follow_the_age),
        cmocka_unit_test(test_clamp_inside_passes_bits_outside_keeps_direction),
        cmocka_unit_test(test_clamp_of_the_largest_numbers_is_finite),
        cmocka_unit_test(test_slew_never_exceeds_its_step_and_arrives),
        cmocka_unit_test(test_slew_step_response_is_a_straight_line),
        cmocka_unit_test(test_torque_is_clamped_and_slewed_by_its_own_cap),
        cmocka_unit_test(test_ramp_takes_its_time_and_arrives_exactly),
        cmocka_unit_test(test_chain_at_rest_passes_the_model_force_bit_for_bit),
        cmocka_unit_test(test_chain_soft_start_is_linear),
        cmocka_unit_test(test_chain_fault_falls_to_zero_and_starts_softly_again),
        cmocka_unit_test(test_chain_cut_obeys_the_slew_and_then_starts_softly),
        cmocka_unit_test(test_chain_fade_reaches_zero_in_its_time),
        cmocka_unit_test(test_chain_output_is_bounded_for_any_input),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
