/* SPDX-License-Identifier: BSD-3-Clause */
/* The simulated hand against closed forms: it must not be the one that adds or hides energy. */
#include "hand.h"

#include "shcd/vec.h"
#include "support/check.h"

#include <float.h>

static const hand_parameters free_hand = {.mass_kg = 0.1, .grip_n_per_m = 200.0, .rate_hz = 1000.0};

static const shcd_vec3 origin = {0.0, 0.0, 0.0};

/* Each substep is exact to a few roundings, which add up at random signs at worst linearly. */
static void test_hand_without_friction_keeps_its_energy(void **state) {
    (void)state;
    hand h;
    hand_begin(&h, &free_hand, origin);
    h.position_m = shcd_vec3_make(0.01, -0.02, 0.005);
    h.velocity_m_per_s = shcd_vec3_make(0.0, 0.3, -0.1);
    const double before = hand_energy(&h);
    const int n = 100000;
    for (int i = 0; i < n; i++) {
        hand_tick(&h, origin, origin);
    }
    assert_near(hand_energy(&h), before, before * n * HAND_SUBSTEPS * 4.0 * DBL_EPSILON);
}

/* m x'' + b x' + k x = F from rest: x = F/k (1 - e^{-st} (cos wt + s/w sin wt)). */
static void test_hand_step_response_is_the_closed_form(void **state) {
    (void)state;
    hand_parameters p = free_hand;
    p.damping_n_s_per_m = 1.5;
    p.grip_n_s_per_m = 0.7;
    hand h;
    hand_begin(&h, &p, origin);
    const double s = 2.2 / (2.0 * p.mass_kg);
    const double w = sqrt(p.grip_n_per_m / p.mass_kg - s * s);
    const double rest = 3.0 / p.grip_n_per_m;
    for (int i = 1; i <= 500; i++) {
        const double t = 1e-3 * i;
        hand_tick(&h, shcd_vec3_make(0.0, 3.0, 0.0), origin);
        assert_near(h.position_m.y, rest * (1.0 - exp(-s * t) * (cos(w * t) + s / w * sin(w * t))),
                    rest * i * HAND_SUBSTEPS * 4.0 * DBL_EPSILON);
    }
}

/* A target that moves evenly drags the mass with it at b v/k behind. */
static void test_hand_follows_a_moving_target(void **state) {
    (void)state;
    hand_parameters p = free_hand;
    p.damping_n_s_per_m = 4.0;
    p.grip_n_s_per_m = 6.0;
    hand h;
    hand_begin(&h, &p, origin);
    double x = 0.0;
    for (int i = 0; i < 2000; i++) { /* 40 time constants of 50 ms */
        x += 1e-4;
        hand_tick(&h, origin, shcd_vec3_make(x, 0.0, 0.0));
    }
    assert_near(h.velocity_m_per_s.x, 0.1, 1e-9);
    assert_near(x - h.position_m.x, 4.0 * 0.1 / 200.0, 1e-9);
}

/* Sliding to rest over v^2 m/(2 f), and nothing else: the energy only falls. */
static void test_hand_coulomb_friction_brakes_and_stops(void **state) {
    (void)state;
    hand_parameters p = free_hand;
    p.grip_n_per_m = 0.0;
    p.coulomb_n = 0.5;
    hand h;
    hand_begin(&h, &p, origin);
    h.velocity_m_per_s = shcd_vec3_make(0.3, 0.4, 0.0);
    double last = hand_energy(&h);
    for (int i = 0; i < 200; i++) {
        hand_tick(&h, origin, origin);
        assert_at_most(hand_energy(&h), last);
        last = hand_energy(&h);
    }
    assert_true(last == 0.0);
    /* 0.5 m/s at 5 m/s^2; the last half substep may cut off up to v h */
    assert_near(shcd_norm(h.position_m), 0.025, 0.5 * h.step_s * 5.0 * h.step_s * 2.0 + 1e-9);
    assert_near(h.dissipated_j, 0.5 * 0.1 * 0.25, 1e-12);
}

/* Work of a held force = change of energy + what was dissipated. The books of the dissipation are
 * of second order in the substep: its share of an oscillation's period, squared. */
static void test_hand_books_balance(void **state) {
    (void)state;
    hand_parameters p = free_hand;
    p.damping_n_s_per_m = 1.0;
    p.coulomb_n = 0.1;
    hand h;
    check_random r = {7};
    hand_begin(&h, &p, origin);
    double work = 0.0, sum = 0.0;
    for (int i = 0; i < 5000; i++) {
        const shcd_vec3 f = {check_normal(&r), check_normal(&r), check_normal(&r)};
        const shcd_vec3 before = h.position_m;
        hand_tick(&h, f, origin);
        work += shcd_dot(f, shcd_sub(h.position_m, before));
        sum += fabs(shcd_dot(f, shcd_sub(h.position_m, before)));
    }
    const double rate = 2.0 * sqrt(p.grip_n_per_m / p.mass_kg);
    assert_near(work, hand_energy(&h) + h.dissipated_j, sum * rate * rate * h.step_s * h.step_s);
}

static void test_hand_measures_late_and_in_steps(void **state) {
    (void)state;
    hand_parameters p = free_hand;
    p.delay_s = 1.35e-3;
    p.encoder_m = 1e-5;
    hand h;
    hand_begin(&h, &p, origin);
    h.position_m = shcd_vec3_make(0.02, 0.0, 0.0);
    shcd_vec3 path[HAND_SUBSTEPS * 100];
    for (int i = 0; i < 100; i++) {
        hand_tick(&h, origin, origin);
        for (size_t k = 0; k < HAND_SUBSTEPS; k++) {
            path[(size_t)i * HAND_SUBSTEPS + k] =
                h.history_m[((size_t)i * HAND_SUBSTEPS + k + 1) % HAND_HISTORY];
        }
        if (i >= 2) { /* 27 substeps before the end of this tick */
            const double x = path[(size_t)(i + 1) * HAND_SUBSTEPS - 1 - 27].x;
            assert_near(hand_measured(&h).x, x, 0.5e-5 * (1.0 + 1e-9));
            assert_near(remainder(hand_measured(&h).x, 1e-5), 0.0, 1e-15);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hand_without_friction_keeps_its_energy),
        cmocka_unit_test(test_hand_step_response_is_the_closed_form),
        cmocka_unit_test(test_hand_follows_a_moving_target),
        cmocka_unit_test(test_hand_coulomb_friction_brakes_and_stops),
        cmocka_unit_test(test_hand_books_balance),
        cmocka_unit_test(test_hand_measures_late_and_in_steps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
