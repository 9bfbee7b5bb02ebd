/* SPDX-License-Identifier: BSD-3-Clause */
/* Tools that are outside a thin body at both ends of a tick, and went through it in between: the
 * tick holds them where they went in. */
#include "support/scene_fixture.h"

#define HALF_M 0.001 /* of the plate's thickness */

static shcd_model *plate;

static int make_plate(void **state) {
    (void)state;
    plate = fixture_ellipsoid(0.03, 0.03, HALF_M);
    return 0;
}

static int free_plate(void **state) {
    (void)state;
    shcd_model_free(plate);
    return 0;
}

/* Falls onto the plate at a speed, from a start phase; ticks until it is below by 4 mm and more. */
static const shcd_tool_output *fall(fixture *f, double radius_m, double speed_m_per_s, double phase,
                                    double slope) {
    const double step_m = speed_m_per_s * FIXTURE_TICK_S;
    double z = HALF_M + radius_m + 0.001 + step_m * (1.0 + phase);
    const shcd_tool_output *out;
    fixture_open_one(f, plate, fixture_pose(0.0, 0.0, 0.0), radius_m);
    do {
        out = fixture_move(f, shcd_vec3_make(slope * z, 0.0, z),
                           shcd_vec3_make(-slope * speed_m_per_s, 0.0, -speed_m_per_s));
        z -= step_m;
    } while (z + step_m > -0.004);
    return out;
}

/* Up to 10 m/s, from where on a motion counts as a jump. */
static void test_nothing_is_tunnelled_in_the_tick(void **state) {
    const double radii_m[] = {0.0, 0.0005}, speeds[] = {1.5, 3.0, 5.0, 8.0}, slopes[] = {0.0, 0.5};
    size_t n = 0;
    (void)state;
    for (size_t r = 0; r < 2; r++) {
        for (size_t s = 0; s < 4; s++) {
            for (size_t k = 0; k < 2; k++) {
                for (int phase = 0; phase < 40; phase++) {
                    fixture f;
                    const shcd_tool_output *out =
                        fall(&f, radii_m[r], speeds[s], phase / 40.0, slopes[k]);
                    const shcd_vec3 p = f.in[0].tool_in_world.position_m;
                    if (!fixture_in_contact(out)) {
                        fail_msg("radius %g, speed %g, slope %g, phase %d", radii_m[r], speeds[s],
                                 slopes[k], phase);
                    }
                    assert_true(out->wrench.force_n.z > 0.0);
                    /* its depth is below the upper side, whose sag is small here */
                    assert_near(out->penetration_m, HALF_M + radii_m[r] - p.z, 2e-4);
                    fixture_close(&f);
                    n++;
                }
            }
        }
    }
    print_message("%zu falls, every one caught\n", n);
}

/* It comes back the way it went, and is free again; beside the plate nothing is felt; and a tool
 * that moves slowly outside pays for no sweep. */
static void test_what_is_caught_is_let_go_where_it_went_in(void **state) {
    fixture f;
    const shcd_vec3 up = {0.0, 0.0, 3.0};
    (void)state;
    fall(&f, 0.0005, 3.0, 0.3, 0.0);
    for (double z = -0.004; z < 0.006; z += 0.003) {
        const shcd_tool_output *out = fixture_move(&f, shcd_vec3_make(0.0, 0.0, z), up);
        assert_true(fixture_in_contact(out) == (z < HALF_M + 0.0005));
    }
    assert_no_force(&f.out[0]);
    fixture_close(&f);
}

static void test_a_way_past_the_body_is_no_contact(void **state) {
    fixture f;
    (void)state;
    fixture_open_one(&f, plate, fixture_pose(0.0, 0.0, 0.0), 0.0005);
    for (int i = 0; i < 20; i++) {
        const shcd_vec3 p = {0.0308, 0.0, i % 2 == 0 ? 0.003 : -0.003};
        assert_false(fixture_in_contact(fixture_move(&f, p, shcd_vec3_make(0.0, 0.0, 0.0))));
    }
    fixture_close(&f);
}

static void test_a_slow_tool_pays_for_no_sweep(void **state) {
    uint32_t largest = 0;
    fixture f;
    (void)state;
    fixture_open_one(&f, plate, fixture_pose(0.0, 0.0, 0.0), 0.0005);
    for (int i = 0; i < 1000; i++) {
        const shcd_vec3 p = {-0.01 + 2e-5 * i, 0.0, HALF_M + 0.00052};
        fixture_move(&f, p, shcd_vec3_make(0.02, 0.0, 0.0));
        assert_false(fixture_in_contact(&f.out[0]));
        largest = i > 0 && f.out[0].n_evaluations > largest ? f.out[0].n_evaluations : largest;
    }
    print_message("at most %u evaluations a tick\n", largest);
    assert_true(largest <= 8);
    fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nothing_is_tunnelled_in_the_tick),
        cmocka_unit_test(test_what_is_caught_is_let_go_where_it_went_in),
        cmocka_unit_test(test_a_way_past_the_body_is_no_contact),
        cmocka_unit_test(test_a_slow_tool_pays_for_no_sweep),
    };
    return cmocka_run_group_tests(tests, make_plate, free_plate);
}
