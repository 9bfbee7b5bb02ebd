/* SPDX-License-Identifier: BSD-3-Clause */
/* One mode over a tick, against the closed forms in extended precision, and what rounding does to
 * its energy over a million ticks. */
#include "response/soft.h"

#include "support/check.h"

/* q, q' at the end of a tick from the start, under a held acceleration, in 64-bit mantissas. */
static void exact(long double w, long double zeta, long double t, long double f, long double *q,
                  long double *v) {
    const long double b = zeta * w;
    const long double square = w * w * (1.0L - zeta) * (1.0L + zeta);
    long double c, s, forced;
    if (square > 0.0L) {
        const long double d = sqrtl(square);
        c = expl(-b * t) * cosl(d * t);
        s = expl(-b * t) * sinl(d * t) / d;
    } else if (square < 0.0L) {
        const long double h = sqrtl(-square);
        c = 0.5L * (expl((h - b) * t) + expl((-h - b) * t));
        s = 0.5L * (expl((h - b) * t) - expl((-h - b) * t)) / h;
    } else {
        c = expl(-b * t);
        s = t * expl(-b * t);
    }
    forced = (1.0L - c - b * s) / (w * w);
    if (w * t < 0.1L && b * t < 0.1L) { /* where that cancels: powers of t */
        long double before = 0.0L, term = 0.5L * t * t;
        forced = term;
        for (int n = 1; n < 24; n++) {
            const long double next =
                -(2.0L * b * t * (n + 1) * term + w * w * t * t * before) / ((n + 1) * (n + 2));
            before = term;
            term = next;
            forced += term;
        }
    }
    const long double q0 = *q;
    *q = (c + b * s) * q0 + s * *v + forced * f;
    *v = -w * w * s * q0 + (c - b * s) * *v + s * f;
}

/* From and to (q, q') as the tick keeps them. */
static void enter(const shcdi_mode *mode, double q, double v, double *x, double *y) {
    *x = q / mode->q_of_x;
    *y = mode->is_turn ? v + mode->decay_per_s * q : v;
}

static void leave(const shcdi_mode *mode, double x, double y, double *q, double *v) {
    *q = x * mode->q_of_x;
    *v = mode->is_turn ? y - mode->decay_per_s * *q : y;
}

static double energy(const shcdi_mode *mode, double x, double y) {
    double q, v;
    leave(mode, x, y, &q, &v);
    return 0.5 * (v * v + mode->omega_rad_per_s * mode->omega_rad_per_s * q * q);
}

static void test_a_tick_is_the_closed_form(void **state) {
    const double ratios[] = {0.0,        1e-6, 0.2,        0.7, 0.9, 0.95,
                             1.0 - 1e-9, 1.0,  1.0 + 1e-9, 1.5, 10.0};
    check_random random = {1};
    (void)state;
    for (size_t i = 0; i < check_scaled(100000); i++) {
        const double zeta = ratios[i % (sizeof ratios / sizeof ratios[0])];
        const double w = pow(10.0, check_uniform(&random, 0.0, 6.0));
        const double dt_s = pow(10.0, check_uniform(&random, -4.0, -1.7));
        const double q0 = check_normal(&random), v0 = w * check_normal(&random);
        const double f = w * w * check_normal(&random);
        shcdi_mode mode;
        shcdi_propagator p;
        double x, y, q, v;
        long double q_exact = q0, v_exact = v0;
        shcdi_mode_set(w, zeta, &mode);
        shcdi_propagator_set(&mode, dt_s, &p);
        enter(&mode, q0, v0, &x, &y);
        shcdi_propagate(&mode, &p, &x, &y);
        x += p.forced_x * f;
        y += p.forced_y * f;
        leave(&mode, x, y, &q, &v);
        exact(w, zeta, dt_s, f, &q_exact, &v_exact);
        /* the phase w T is rounded to a part in 2^53, and near critical damping the closed form
         * itself loses the digits of 1 - zeta, which the tick keeps */
        const double size = fabs(q0) + fabs(v0) / w + fabs(f) / (w * w);
        const double tolerance = size * (1e-13 + 4e-16 * w * dt_s);
        assert_near(q, (double)q_exact, tolerance);
        assert_near(v, (double)v_exact, w * tolerance);
    }
}

static void test_a_short_tick_does_not_cancel(void **state) {
    (void)state;
    for (double w = 1e-3; w < 1e4; w *= 3.0) {
        for (double zeta = 0.0; zeta < 2.0; zeta += 0.3) {
            shcdi_mode mode;
            shcdi_propagator p;
            long double q = 0.0L, v = 0.0L;
            shcdi_mode_set(w, zeta, &mode);
            shcdi_propagator_set(&mode, 1e-4, &p);
            exact(w, zeta, 1e-4L, 1.0L, &q, &v);
            assert_near(p.forced_q_s2, (double)q, 1e-15 * (double)q);
        }
    }
}

static void test_without_a_spring_it_glides(void **state) {
    shcdi_mode mode;
    shcdi_propagator p;
    double x = 2.0, y = 3.0;
    (void)state;
    shcdi_mode_set(0.0, 0.3, &mode);
    shcdi_propagator_set(&mode, 0.001, &p);
    shcdi_propagate(&mode, &p, &x, &y);
    assert_near(x, 2.003, 1e-15);
    assert_near(y, 3.0, 0.0);
    assert_near(p.forced_q_s2, 0.5e-6, 1e-21);
    assert_near(p.forced_y, 0.001, 1e-18);
}

/* The three shears have the determinant 1 to the bit of their rounding errors, which are random: a
 * walk of 3e6 steps of 1e-16, standard deviation 2e-13; the promise is five of these. */
static void test_undamped_motion_keeps_its_energy(void **state) {
    const double turns[] = {1e-3, 0.1, 0.7, 1.5, 2.0, 3.1, 40.0, 5e4};
    (void)state;
    for (size_t i = 0; i < sizeof turns / sizeof turns[0]; i++) {
        shcdi_mode mode;
        shcdi_propagator p;
        double x, y, worst = 0.0;
        shcdi_mode_set(turns[i] / 0.001, 0.0, &mode);
        shcdi_propagator_set(&mode, 0.001, &p);
        enter(&mode, 0.7, 0.3 * turns[i] / 0.001, &x, &y);
        const double start = energy(&mode, x, y);
        for (int n = 0; n < 1000000; n++) {
            shcdi_propagate(&mode, &p, &x, &y);
            if (n % 64 == 0) {
                worst = fmax(worst, fabs(energy(&mode, x, y) / start - 1.0));
            }
        }
        print_message("angle %g: energy within %.2g over 1e6 ticks\n", turns[i], worst);
        assert_true(worst <= 1e-12);
    }
}

static void test_damped_motion_never_gains(void **state) {
    const double ratios[] = {1e-9, 1e-6, 1e-3, 0.05, 0.5, 0.9, 0.99, 1.0, 3.0};
    check_random random = {5};
    (void)state;
    for (size_t i = 0; i < sizeof ratios / sizeof ratios[0]; i++) {
        for (size_t k = 0; k < check_scaled(200); k++) {
            shcdi_mode mode;
            shcdi_propagator p;
            double x, y;
            const double w = pow(10.0, check_uniform(&random, 0.0, 5.0));
            shcdi_mode_set(w, ratios[i], &mode);
            shcdi_propagator_set(&mode, 0.001, &p);
            enter(&mode, check_normal(&random), w * check_normal(&random), &x, &y);
            double before = energy(&mode, x, y);
            for (int n = 0; n < 300 && before > 1e-250; n++) {
                shcdi_propagate(&mode, &p, &x, &y);
                const double now = energy(&mode, x, y);
                assert_true(now <= before * (1.0 + 4.0 * 0x1p-52));
                before = now;
            }
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_tick_is_the_closed_form),
        cmocka_unit_test(test_a_short_tick_does_not_cancel),
        cmocka_unit_test(test_without_a_spring_it_glides),
        cmocka_unit_test(test_undamped_motion_keeps_its_energy),
        cmocka_unit_test(test_damped_motion_never_gains),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
