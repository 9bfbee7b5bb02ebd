/* SPDX-License-Identifier: BSD-3-Clause */
/* The effects, one by one, against their formulas on a sphere, where depth is R + r - |p| in closed
 * form, and what holds for every effect of the table. */
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

/* ---- the table ------------------------------------------------------------------------------ */

static void test_effect_at_describes_every_effect(void **state) {
    size_t n = 0;
    (void)state;
    for (; shcd_effect_at(n) != NULL; n++) {
        const shcd_effect_info *info = shcd_effect_at(n);
        assert_true(strlen(info->name) > 0);
        assert_true(strlen(info->description) > 0);
        assert_true(strlen(info->source) > 0);
        for (size_t k = 0; k < n; k++) {
            assert_string_not_equal(info->name, shcd_effect_at(k)->name);
        }
        for (size_t i = 0; i < info->n_parameters; i++) {
            const shcd_parameter_info *p = &info->parameters[i];
            assert_true(strlen(p->name) > 0);
            assert_true(strlen(p->unit) > 0);
            assert_true(strlen(p->description) > 0);
            assert_true(p->min_value <= p->default_value && p->default_value <= p->max_value);
            for (size_t k = 0; k < i; k++) {
                assert_string_not_equal(p->name, info->parameters[k].name);
            }
        }
    }
    assert_int_equal(n, 2);
    assert_string_equal(shcd_effect_at(0)->name, "stiffness");
    assert_string_equal(shcd_effect_at(1)->name, "damping");
    assert_null(shcd_effect_at(SIZE_MAX));
}

/* Whatever the effects, at the ends of their ranges and for the wildest input that is not refused,
 * the force is a finite number. */
static void test_every_effect_gives_finite_force_for_extreme_input(void **state) {
    const double speeds[] = {0.0, -0.0, 1e-300, 1.0, -1.0, 1e9, -1e9};
    const double depths[] = {1e-12, 1e-3, 0.02};
    shcd_effect_def effects[16];
    shcd_parameter_value values[16][8];
    size_t n = 0;
    (void)state;
    for (; shcd_effect_at(n) != NULL; n++) {
        effects[n].name = shcd_effect_at(n)->name;
        effects[n].parameters = values[n];
        effects[n].n_parameters = shcd_effect_at(n)->n_parameters;
    }
    for (int high = 0; high < 2; high++) {
        fixture f;
        for (size_t e = 0; e < n; e++) {
            for (size_t i = 0; i < effects[e].n_parameters; i++) {
                const shcd_parameter_info *p = &shcd_effect_at(e)->parameters[i];
                values[e][i].name = p->name;
                values[e][i].value = high ? p->max_value : p->min_value;
            }
        }
        open_with(&f, effects, n);
        for (size_t d = 0; d < sizeof depths / sizeof depths[0]; d++) {
            for (size_t s = 0; s < sizeof speeds / sizeof speeds[0]; s++) {
                radial_force(&f, depths[d], speeds[s]);
                assert_true(shcd_vec3_is_finite(f.out[0].wrench.force_n));
                assert_true(shcd_vec3_is_finite(f.out[0].wrench.torque_n_m));
                assert_true(f.out[0].wrench.force_n.x >= 0.0);
            }
        }
        fixture_close(&f);
    }
}

static void test_body_without_effects_is_touched_without_force(void **state) {
    fixture f;
    (void)state;
    open_with(&f, NULL, 0);
    assert_true(radial_force(&f, 0.002, 0.1) == 0.0);
    assert_true((f.out[0].flags & SHCD_TOOL_OUTPUT_CONTACT) != 0);
    assert_near(f.out[0].penetration_m, 0.002, DEPTH_TOLERANCE_M);
    fixture_close(&f);
}

/* ---- stiffness ------------------------------------------------------------------------------ */

static void test_stiffness_is_linear_in_depth(void **state) {
    check_random random = {1};
    (void)state;
    for (size_t i = 0; i < check_scaled(200); i++) {
        const double k = check_uniform(&random, 0.0, 5000.0);
        const double depth = check_uniform(&random, 0.0, 0.5 * RADIUS_M);
        const shcd_parameter_value value = {"k_n_per_m", k};
        const shcd_effect_def effect = {"stiffness", &value, 1};
        fixture f;
        open_with(&f, &effect, 1);
        assert_near(radial_force(&f, depth, check_uniform(&random, -1.0, 1.0)), k * depth,
                    k * DEPTH_TOLERANCE_M);
        fixture_close(&f);
    }
}

static void test_stiffness_defaults_to_300_newtons_per_metre(void **state) {
    const shcd_effect_def effect = {"stiffness", NULL, 0};
    fixture f;
    (void)state;
    open_with(&f, &effect, 1);
    assert_near(radial_force(&f, 0.004, 0.0), 1.2, 300.0 * DEPTH_TOLERANCE_M);
    fixture_close(&f);
}

/* ---- damping -------------------------------------------------------------------------------- */

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

/* ---- composition ---------------------------------------------------------------------------- */

/* Equal bits, -0.0 counting as +0.0. */
static void assert_same_bits(const shcd_tool_output *a, const shcd_tool_output *b) {
    const double x[] = {a->wrench.force_n.x,    a->wrench.force_n.y,    a->wrench.force_n.z,
                        a->wrench.torque_n_m.x, a->wrench.torque_n_m.y, a->wrench.torque_n_m.z,
                        a->proxy_m.x,           a->proxy_m.y,           a->proxy_m.z,
                        a->penetration_m,       a->distance_m};
    const double y[] = {b->wrench.force_n.x,    b->wrench.force_n.y,    b->wrench.force_n.z,
                        b->wrench.torque_n_m.x, b->wrench.torque_n_m.y, b->wrench.torque_n_m.z,
                        b->proxy_m.x,           b->proxy_m.y,           b->proxy_m.z,
                        b->penetration_m,       b->distance_m};
    for (size_t i = 0; i < sizeof x / sizeof x[0]; i++) {
        const double p = x[i] + 0.0;
        const double q = y[i] + 0.0;
        assert_memory_equal(&p, &q, sizeof p);
    }
    assert_int_equal(a->flags, b->flags);
}

/* Two scenes along the same random walk in and out of the sphere give the same bits. */
static void compare_along_a_walk(const shcd_effect_def *a, size_t n_a, const shcd_effect_def *b,
                                 size_t n_b) {
    check_random random = {3};
    fixture fa;
    fixture fb;
    size_t n_contacts = 0;
    open_with(&fa, a, n_a);
    open_with(&fb, b, n_b);
    for (size_t i = 0; i < 300; i++) {
        const shcd_vec3 p = shcd_scale(RADIUS_M * check_uniform(&random, 0.8, 1.1),
                                       fixture_random_direction(&random));
        const shcd_vec3 v =
            shcd_scale(check_uniform(&random, 0.0, 0.5), fixture_random_direction(&random));
        fixture_move(&fa, p, v);
        fixture_move(&fb, p, v);
        assert_same_bits(&fa.out[0], &fb.out[0]);
        n_contacts += (fa.out[0].flags & SHCD_TOOL_OUTPUT_CONTACT) != 0;
    }
    assert_true(n_contacts > 100);
    fixture_close(&fa);
    fixture_close(&fb);
}

static void test_neutral_damping_equals_no_damping_bit_for_bit(void **state) {
    const shcd_parameter_value k = {"k_n_per_m", 700.0};
    const shcd_parameter_value zero = {"ratio", 0.0};
    const shcd_effect_def effects[2] = {{"stiffness", &k, 1}, {"damping", &zero, 1}};
    (void)state;
    compare_along_a_walk(effects, 2, effects, 1);
}

static void test_neutral_stiffness_equals_no_stiffness_bit_for_bit(void **state) {
    const shcd_parameter_value zero = {"k_n_per_m", 0.0};
    const shcd_effect_def effects[2] = {{"stiffness", &zero, 1}, {"damping", NULL, 0}};
    (void)state;
    compare_along_a_walk(effects, 2, &effects[1], 1);
    compare_along_a_walk(effects, 1, NULL, 0);
}

static void test_order_in_the_definition_does_not_matter(void **state) {
    const shcd_parameter_value k = {"k_n_per_m", 700.0};
    const shcd_parameter_value damping[2] = {{"ratio", 0.6}, {"reference_speed_m_per_s", 0.05}};
    const shcd_parameter_value swapped[2] = {damping[1], damping[0]};
    const shcd_effect_def one[2] = {{"stiffness", &k, 1}, {"damping", damping, 2}};
    const shcd_effect_def other[2] = {{"damping", swapped, 2}, {"stiffness", &k, 1}};
    (void)state;
    compare_along_a_walk(one, 2, other, 2);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_effect_at_describes_every_effect),
        cmocka_unit_test(test_every_effect_gives_finite_force_for_extreme_input),
        cmocka_unit_test(test_body_without_effects_is_touched_without_force),
        cmocka_unit_test(test_stiffness_is_linear_in_depth),
        cmocka_unit_test(test_stiffness_defaults_to_300_newtons_per_metre),
        cmocka_unit_test(test_damping_scales_the_elastic_force),
        cmocka_unit_test(test_damping_resists_going_in_more_than_going_out),
        cmocka_unit_test(test_damping_never_pulls_a_leaving_tool),
        cmocka_unit_test(test_damping_counts_at_most_ten_reference_speeds),
        cmocka_unit_test(test_damping_ignores_sliding),
        cmocka_unit_test(test_damping_alone_gives_no_force),
        cmocka_unit_test(test_damping_bounce_has_the_restitution_of_the_energy_balance),
        cmocka_unit_test(test_neutral_damping_equals_no_damping_bit_for_bit),
        cmocka_unit_test(test_neutral_stiffness_equals_no_stiffness_bit_for_bit),
        cmocka_unit_test(test_order_in_the_definition_does_not_matter),
    };
    return cmocka_run_group_tests(tests, make_sphere, free_sphere);
}
