/* SPDX-License-Identifier: BSD-3-Clause */
/* What device profiles promise, and what a scene may ask of them. */
#include "daemon/scene_support.h"
#include "passivity.h"

/* The least damping at the limit is the profile's, at any rate; what the device renders caps it. */
static void test_stiffness_max_is_damping_over_half_a_tick_and_delay(void **state) {
    const device_profile d = {"test", 5.0, 0.1, 500.0, 1e9, 3.0, 1e-3, 2.0, 20.0, 0.045};
    const double rates[] = {100.0, 250.0, 1000.0, 4000.0};
    (void)state;
    for (size_t i = 0; i < 4; i++) {
        const double k = device_stiffness_max(&d, rates[i]);
        assert_near(k * (0.5 / rates[i] + d.delay_s), d.damping_n_s_per_m, 1e-15);
        device_profile soft = d;
        soft.stiffness_max_n_per_m = 0.5 * k;
        assert_near(device_stiffness_max(&soft, rates[i]), 0.5 * k, 0.0);
    }
}

static void test_generic_renders_its_stiffness_at_1000_hz(void **state) {
    const device_profile *d = &device_profiles[0];
    (void)state;
    assert_near(device_stiffness_max(d, 1000.0), d->stiffness_max_n_per_m, 1e-9);
    assert_near(device_stiffness_max(d, 4000.0), d->stiffness_max_n_per_m, 0.0);
    assert_near(device_stiffness_max(d, 100.0), 500.0, 1e-9);
}

static void test_delays_are_rounded_up_to_ticks(void **state) {
    device_profile d = device_profiles[0];
    (void)state;
    for (double rate = CONFIG_RATE_MIN_HZ; rate <= CONFIG_RATE_MAX_HZ; rate += 50.0) {
        const int n = device_delays(&d, rate);
        assert_true(n >= 0 && n <= PASSIVITY_DELAYS_MAX);
        assert_true((double)n >= d.delay_s * rate - 1e-6 && (double)n < d.delay_s * rate + 1.0);
    }
    assert_int_equal(device_delays(&d, 1000.0), 1);
    assert_int_equal(device_delays(&d, 4000.0), 4);
    d.delay_s = 0.0;
    assert_int_equal(device_delays(&d, 1000.0), 0);
}

/* A mass that is slowed down by a held drag on its velocity of some ticks ago: the fastest that it
 * goes in the second half of many ticks, over that in the first. */
static double growth(double c_t_over_m, int late) {
    double v[16], most[2] = {0.0, 0.0};
    const int n = 40000;
    for (int i = 0; i <= late; i++) {
        v[i] = 1.0;
    }
    for (int i = late; i < n; i++) {
        const double next = v[i % 16] - c_t_over_m * v[(i - late) % 16];
        v[(i + 1) % 16] = next;
        double *sum = &most[i >= n / 2];
        *sum = fmax(*sum, fabs(next));
    }
    return most[1] / most[0];
}

/* At the limit it goes on for ever; a per mille beside it, it dies out or grows. */
static void test_drag_max_is_where_a_late_drag_begins_to_grow(void **state) {
    const double rates[] = {100.0, 900.0, 1000.0, 2000.0, 3000.0, 4000.0};
    (void)state;
    for (size_t i = 0; i < 6; i++) {
        for (int prompt = 0; prompt < 2; prompt++) {
            device_profile d = device_profiles[0];
            d.delay_s = prompt ? 0.0 : d.delay_s;
            const int late = device_delays(&d, rates[i]);
            const double a = device_drag_max(&d, rates[i]) / (d.mass_kg * rates[i]);
            assert_true(late != 0 || fabs(a - 2.0) < 1e-15);
            assert_true(late != 1 || fabs(a - 1.0) < 1e-15);
            assert_true(growth(0.999 * a, late) < 0.1);
            assert_true(growth(1.001 * a, late) > 10.0);
        }
    }
}

#define NOTHING "bodies: []\n" SCENE_TOOLS

static double reserve_of(const char *text) {
    daemon_config config = scene_load_good(text);
    const double reserve_j = config.reserve_j;
    config_free(&config);
    return reserve_j;
}

static void test_scene_states_the_reserve(void **state) {
    const device_profile *d = &device_profiles[0];
    (void)state;
    assert_near(reserve_of(NOTHING), device_reserve_j(d, 1000.0), 0.0);
    assert_near(reserve_of(NOTHING), 0.048, 1e-15);
    assert_near(reserve_of("passivity: {}\nrate_hz: 500\n" NOTHING), device_reserve_j(d, 500.0),
                0.0);
    assert_near(reserve_of("passivity: {reserve_j: 0.1}\n" NOTHING), 0.1, 0.0);
    assert_true(reserve_of("passivity: off\n" NOTHING) == HUGE_VAL);
    /* a longer delay: each tick of it may hold a full wrench */
    assert_near(reserve_of("delay_s: 0.001\n" NOTHING), 0.048, 1e-15);
    assert_near(reserve_of("delay_s: 0.002\n" NOTHING), 0.072, 1e-15);
    assert_near(reserve_of("delay_s: 0.008\n" NOTHING), 0.216, 1e-15);
}

static void write_wall(char *text, size_t size, double rate_hz, double k) {
    (void)snprintf(text, size,
                   "rate_hz: %.17g\n" SCENE_EGG
                   "    effects:\n      stiffness: {k_n_per_m: %.17g}\n" SCENE_TOOLS,
                   rate_hz, k);
}

/* At the limit a scene loads, beyond it is refused, at every rate. */
static void test_scene_beyond_the_region_is_refused(void **state) {
    (void)state;
    check_random r = {1};
    for (int i = 0; i < 40; i++) {
        char text[1024];
        const double rate = check_uniform(&r, CONFIG_RATE_MIN_HZ, CONFIG_RATE_MAX_HZ);
        const double k = device_stiffness_max(&device_profiles[0], rate);
        write_wall(text, sizeof text, rate, k);
        daemon_config config = scene_load_good(text);
        config_free(&config);
        write_wall(text, sizeof text, rate, k * (1.0 + 1e-6));
        scene_expect_text_refused(text, "6:30: bodies[0].effects.stiffness.k_n_per_m: ");
    }
}

static void test_document_states_every_profile(void **state) {
    (void)state;
    for (const device_profile *p = device_profiles; p->name != NULL; p++) {
        char row[256], line[1024];
        bool found = false;
        FILE *file = fopen(DOCUMENT, "r");
        assert_non_null(file);
        (void)snprintf(row, sizeof row,
                       "| `%s` | %g N s/m | %g ms | %g m/s, %g rad/s | %g J | %g kg |", p->name,
                       p->damping_n_s_per_m, 1e3 * p->delay_s, p->speed_max_m_per_s,
                       p->turn_max_rad_per_s, device_reserve_j(p, 1000.0), p->mass_kg);
        while (!found && fgets(line, sizeof line, file) != NULL) {
            line[strcspn(line, "\n")] = '\0';
            found = strcmp(line, row) == 0;
        }
        assert_int_equal(fclose(file), 0);
        if (!found) {
            fail_msg("docs/scene-file.md lacks this row:\n%s", row);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stiffness_max_is_damping_over_half_a_tick_and_delay),
        cmocka_unit_test(test_generic_renders_its_stiffness_at_1000_hz),
        cmocka_unit_test(test_delays_are_rounded_up_to_ticks),
        cmocka_unit_test(test_drag_max_is_where_a_late_drag_begins_to_grow),
        cmocka_unit_test(test_scene_states_the_reserve),
        cmocka_unit_test(test_scene_beyond_the_region_is_refused),
        cmocka_unit_test(test_document_states_every_profile),
    };
    return cmocka_run_group_tests(tests, scene_folder_make, scene_folder_remove);
}
