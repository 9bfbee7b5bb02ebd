/* SPDX-License-Identifier: BSD-3-Clause */
/* damping: its factor, its bounds and the bounce that follows, against closed forms on a sphere,
 * where depth is R - |p|. */
#include "support/scene_fixture.h"

#define RADIUS_M 0.05

/* The contract of shcd_closest: the distance is known to 1e-9 of the diagonal (here 2 sqrt(3) R).
 */
#define DEPTH_TOLERANCE_M (1e-9 * 3.4641016151377544 * RADIUS_M)

static shcd_model *sphere;

static int make_sphere(void **state) {
    (void)state;
    sphere = fixture_sphere(RADIUS_M);
    return 0;
}

static int free_sphere(void **state) {
    (void)state;
    shcd_model_free(sphere);
    return 0;
}

/* A point tool and one body with up to two effects. */
static void open_with(fixture *f, const shcd_effect_def *effects, size_t n_effects) {
    const shcd_body_def body =
        fixture_body("ball", sphere, fixture_pose(0.0, 0.0, 0.0), effects, n_effects);
    const shcd_tool_def tool = fixture_tool("tip", 0.0);
    fixture_open(f, &body, 1, &tool, 1);
}

/* Radial force [N] at a depth on the x axis, outward positive, with the depth changing at a rate.
 */
static double radial_force(fixture *f, double depth_m, double rate_m_per_s) {
    return fixture_move(f, shcd_vec3_make(RADIUS_M - depth_m, 0.0, 0.0),
                        shcd_vec3_make(-rate_m_per_s, 0.0, 0.0))
        ->wrench.force_n.x;
}

/* 400 N/m and damping of the given ratio at 0.2 m/s. */
static void open_damped(fixture *f, double ratio) {
    const shcd_parameter_value k = {"k_n_per_m", 400.0};
    const shcd_parameter_value damping[2] = {{"ratio", ratio}, {"reference_speed_m_per_s", 0.2}};
    const shcd_effect_def effects[2] = {{"stiffness", &k, 1}, {"damping", damping, 2}};
    open_with(f, effects, 2);
}

static void test_damping_scales_the_elastic_force(void **state) {
    check_random random = {2};
    (void)state;
    for (size_t i = 0; i < check_scaled(200); i++) {
        const double ratio = check_uniform(&random, 0.0, 1.0);
        const double depth = check_uniform(&random, 0.0, 0.02);
        const double rate = check_uniform(&random, -2.0, 2.0);
        const double factor = 1.0 + 1.5 * ratio / 0.2 * rate;
        const double bounded = factor > 0.0 ? factor : 0.0;
        fixture f;
        open_damped(&f, ratio);
        assert_near(radial_force(&f, depth, rate), 400.0 * depth * bounded,
                    400.0 * bounded * DEPTH_TOLERANCE_M + 1e-13 /* rounding of some 10 N */);
        fixture_close(&f);
    }
}

static void test_damping_resists_going_in_more_than_going_out(void **state) {
    fixture f;
    double in;
    double still;
    double out;
    (void)state;
    open_damped(&f, 0.3);
    in = radial_force(&f, 0.003, 0.1);
    still = radial_force(&f, 0.003, 0.0);
    out = radial_force(&f, 0.003, -0.1);
    assert_true(in > still && still > out && out > 0.0);
    fixture_close(&f);
}

static void test_damping_never_pulls_a_leaving_tool(void **state) {
    fixture f;
    (void)state;
    open_damped(&f, 1.0);
    /* the factor reaches zero at rate = -v_ref / (1.5 ratio) */
    assert_true(radial_force(&f, 0.003, -0.1332) > 0.0);
    assert_true(radial_force(&f, 0.003, -0.1334) == 0.0);
    assert_true(radial_force(&f, 0.003, -50.0) == 0.0);
    fixture_close(&f);
}

static void test_damping_counts_at_most_ten_reference_speeds(void **state) {
    fixture f;
    double bound;
    (void)state;
    open_damped(&f, 0.5);
    bound = radial_force(&f, 0.003, 2.0);
    assert_near(bound, 400.0 * 0.003 * (1.0 + 15.0 * 0.5), 400.0 * 8.5 * DEPTH_TOLERANCE_M);
    assert_true(radial_force(&f, 0.003, 3.0) == bound);
    assert_true(radial_force(&f, 0.003, 1e9) == bound);
    fixture_close(&f);
}

static void test_damping_ignores_sliding(void **state) {
    fixture f;
    double still;
    (void)state;
    open_damped(&f, 0.3);
    still = radial_force(&f, 0.003, 0.0);
    fixture_move(&f, shcd_vec3_make(RADIUS_M - 0.003, 0.0, 0.0), shcd_vec3_make(0.0, 0.4, -0.3));
    /* the normal may lean by the foot's error, about 1e-9 of the diagonal over R */
    assert_near(f.out[0].wrench.force_n.x, still, 1e-7 * still);
    fixture_close(&f);
}

static void test_damping_alone_gives_no_force(void **state) {
    const shcd_effect_def effect = {"damping", NULL, 0};
    fixture f;
    (void)state;
    open_with(&f, &effect, 1);
    assert_true(radial_force(&f, 0.003, 0.5) == 0.0);
    assert_true((f.out[0].flags & SHCD_TOOL_OUTPUT_CONTACT) != 0);
    fixture_close(&f);
}

/* e of b - log(1 + b) = -e b - log(1 - e b), by bisection: see effects/damping.c. */
static double restitution(double b) {
    const double in = b - log1p(b);
    double low = 0.0;
    double high = 1.0;
    for (int i = 0; i < 100; i++) {
        const double e = 0.5 * (low + high);
        if (-e * b - log1p(-e * b) < in) {
            low = e;
        } else {
            high = e;
        }
    }
    return low;
}

/* A free mass thrown at the sphere comes back with the speed that the energy balance gives. The
 * midpoint rule with step h has relative error of order (omega h)^2 per radian of omega t; the
 * contact lasts pi radians. */
static void test_damping_bounce_has_the_restitution_of_the_energy_balance(void **state) {
    const double mass = 0.01;
    const double h = 1e-5;
    const double omega = sqrt(400.0 / mass);
    const double tolerance = 3.15 * omega * h * omega * h;
    (void)state;
    for (int i = 1; i <= 3; i++) {
        const double speed = 0.1 * i;
        double x = -1e-9; /* depth, just outside */
        double v = speed;
        fixture f;
        open_damped(&f, 0.3);
        do {
            const double a = -radial_force(&f, x, v) / mass;
            const double x_mid = x + 0.5 * h * v;
            const double v_mid = v + 0.5 * h * a;
            x += h * v_mid;
            v -= h * radial_force(&f, x_mid, v_mid) / mass;
        } while (x > 0.0);
        assert_near(-v / speed, restitution(1.5 * 0.3 * speed / 0.2), tolerance);
        fixture_close(&f);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_damping_scales_the_elastic_force),
        cmocka_unit_test(test_damping_resists_going_in_more_than_going_out),
        cmocka_unit_test(test_damping_never_pulls_a_leaving_tool),
        cmocka_unit_test(test_damping_counts_at_most_ten_reference_speeds),
        cmocka_unit_test(test_damping_ignores_sliding),
        cmocka_unit_test(test_damping_alone_gives_no_force),
        cmocka_unit_test(test_damping_bounce_has_the_restitution_of_the_energy_balance),
    };
    return cmocka_run_group_tests(tests, make_sphere, free_sphere);
}
