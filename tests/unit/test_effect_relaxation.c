/* SPDX-License-Identifier: BSD-3-Clause */
/* relaxation: step, ramp and unloading against the analytic convolution, for ticks of any length;
 * energy; no pulling. */
#include "support/touch.h"

static const double g[3] = {0.3, 0.2, 0.1}, tau[3] = {0.05, 1.0, 30.0};

static touch_effect open_relaxation(void) {
    const shcd_parameter_value values[] = {{"g_1", g[0]},       {"g_2", g[1]},
                                           {"g_3", g[2]},       {"tau_1_s", tau[0]},
                                           {"tau_2_s", tau[1]}, {"tau_3_s", tau[2]}};
    return touch_open("relaxation", values, 6);
}

/* Response at t to a ramp of F_e at 1 N/s from 0 to t_end, which is held then: with
 * G(s) = 1 - sum g (1 - e^(-s/tau)), int_0^min(t,t_end) G(t - s) ds. */
static double ramp_response(double t, double t_end) {
    const double loaded = fmin(t, t_end);
    double force = loaded;
    for (int i = 0; i < 3; i++) {
        const double past = fmax(0.0, t - t_end);
        force -= g[i] * (loaded + tau[i] * exp(-past / tau[i]) * expm1(-loaded / tau[i]));
    }
    return force;
}

/* F_e is a ramp within each tick, as here: exact but for rounding, about 2^-53 a tick and term. */
static void test_ramp_and_hold_is_the_analytic_convolution(void **state) {
    const double ticks[] = {1e-4, 1e-3, 0.02, 0.1};
    (void)state;
    for (int k = 0; k < 4; k++) {
        const double dt = ticks[k], t_end = 2.0;
        const int n = (int)(20.0 / dt);
        touch_effect e = open_relaxation();
        shcdi_touch t = touch_plane(0.001);
        t.dt_s = dt;
        for (int i = 1; i <= n; i++) {
            const double force = touch_apply(&e, &t, fmin(dt * i, t_end)).normal_force_n;
            const double expected = ramp_response(dt * i, t_end);
            assert_near(force, expected, 1e-9 * expected);
        }
    }
}

/* A step is a ramp within one tick: against the true step the ramp is half a tick late, and the
 * share lost by then is sum g dt/(2 tau) to first order. Against the ramp it is exact. */
static void test_step_relaxes_to_the_remaining_share(void **state) {
    const double dt = 1e-3;
    touch_effect e = open_relaxation();
    shcdi_touch t = touch_plane(0.001);
    (void)state;
    for (int i = 1; i <= 5000; i++) {
        const double force = touch_apply(&e, &t, 2.0).normal_force_n;
        const double ramp = 2.0 / dt * ramp_response(dt * i, dt);
        double step = 1.0;
        assert_near(force, ramp, 1e-9 * ramp);
        for (int k = 0; k < 3; k++) {
            step -= g[k] * -expm1(-dt * i / tau[k]);
        }
        assert_near(force, 2.0 * step, 2.0 * dt * (g[0] / tau[0] + g[1] / tau[1] + g[2] / tau[2]));
    }
    t.dt_s = 0.1;
    for (int i = 0; i < 12000; i++) {
        (void)touch_apply(&e, &t, 2.0);
    }
    /* 1200 s later, e^-40 of the slowest term is left */
    assert_near(touch_apply(&e, &t, 2.0).normal_force_n, 2.0 * (1.0 - 0.6), 1e-12);
}

/* Ticks of different lengths give the same answer: nothing depends on a fixed rate. */
static void test_ticks_of_any_length_agree(void **state) {
    check_random random = {3};
    touch_effect e = open_relaxation();
    shcdi_touch t = touch_plane(0.001);
    double now = 0.0;
    (void)state;
    for (int i = 0; i < 2000; i++) {
        t.dt_s = check_uniform(&random, 1e-5, 0.1);
        now += t.dt_s;
        const double expected = ramp_response(now, 1e9);
        assert_near(touch_apply(&e, &t, now).normal_force_n, expected, 1e-9 * expected);
    }
}

static void test_leaving_fast_loses_contact_instead_of_being_held(void **state) {
    touch_effect e = open_relaxation();
    shcdi_touch t = touch_plane(0.001);
    double last = 1.0;
    (void)state;
    for (int i = 0; i < 5000; i++) {
        (void)touch_apply(&e, &t, 2.0);
    }
    for (int i = 20; i >= 0; i--) {
        const double force = touch_apply(&e, &t, 0.1 * i).normal_force_n;
        assert_true(force >= 0.0);
        last = force;
    }
    assert_true(last == 0.0);
}

/* Beside a linear spring of stiffness k the hand's work against the held force, with the k dx^2/2
 * of a held spring, covers what is stored, in every tick. */
static void test_no_energy_comes_out_of_a_random_walk(void **state) {
    const double k = 500.0;
    check_random random = {4};
    (void)state;
    for (size_t walk = 0; walk < check_scaled(50); walk++) {
        touch_effect e = open_relaxation();
        shcdi_touch t = touch_plane(0.0);
        double x = 0.0, force = 0.0, given = 0.0, slack = 0.0;
        t.dt_s = 0.01;
        for (int i = 0; i < 500; i++) {
            const double next = fabs(x + 1e-3 * check_normal(&random)); /* deep by x > 0 */
            given += force * (next - x);
            slack += 0.5 * k * (next - x) * (next - x);
            x = next;
            shcdi_response r;
            memset(&r, 0, sizeof r);
            r.normal_force_n = k * x;
            r.stored_j = 0.5 * k * x * x;
            e.active.effect->apply(e.active.constants, &t, e.memory, &r);
            force = r.normal_force_n;
            assert_true(r.stored_j >= 0.0);
            assert_true(given + slack >= r.stored_j - 1e-15);
        }
    }
}

static void test_shares_of_one_or_more_are_refused(void **state) {
    const shcd_parameter_value values[] = {{"g_1", 0.5}, {"g_2", 0.3}, {"g_3", 0.2}};
    const char *const words[] = {"'relaxation'", "g_1 + g_2 + g_3", "below 1", NULL};
    (void)state;
    touch_expect_refusal("relaxation", values, 3, words);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ramp_and_hold_is_the_analytic_convolution),
        cmocka_unit_test(test_step_relaxes_to_the_remaining_share),
        cmocka_unit_test(test_ticks_of_any_length_agree),
        cmocka_unit_test(test_leaving_fast_loses_contact_instead_of_being_held),
        cmocka_unit_test(test_no_energy_comes_out_of_a_random_walk),
        cmocka_unit_test(test_shares_of_one_or_more_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
