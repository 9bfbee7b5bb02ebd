/* SPDX-License-Identifier: BSD-3-Clause */
/* stiffness: its three laws against closed forms computed with libm, alone and above a compliance,
 * and which parameters go together. */
#include "support/touch.h"

/* Forces come from the root a of a cubic, known to 1 ulp of a plus the rounding of the cubic: a
 * few units of 2^-53 in the depth equation, three times that in F = const a^3. */
#define ROUNDING (64.0 * 0x1p-53)

static double press(const touch_effect *e, const shcdi_touch *t, double depth_m, double w,
                    double *stored_j) {
    return e->active.effect->press(e->active.constants, t, depth_m, w, stored_j);
}

static double log_uniform(check_random *random, double low, double high) {
    return low * pow(high / low, check_uniform(random, 0.0, 1.0));
}

/* ---- linear --------------------------------------------------------------------------------- */

static void test_linear_rigid_body_is_the_product_to_the_bit(void **state) {
    check_random random = {1};
    const shcdi_touch t = touch_plane(0.001);
    (void)state;
    for (size_t i = 0; i < check_scaled(1000); i++) {
        const double k = log_uniform(&random, 1e-3, 1e5), depth = log_uniform(&random, 1e-9, 0.1);
        const shcd_parameter_value value = {"k_n_per_m", k};
        const touch_effect e = touch_open("stiffness", &value, 1);
        double stored;
        assert_true(press(&e, &t, depth, 0.0, &stored) == k * depth);
        assert_near(stored, 0.5 * k * depth * depth, ROUNDING * stored);
    }
}

static void test_linear_above_a_compliance_adds_compliances(void **state) {
    const shcd_parameter_value value = {"k_n_per_m", 400.0};
    const touch_effect e = touch_open("stiffness", &value, 1);
    const shcdi_touch t = touch_plane(0.001);
    double stored;
    (void)state;
    assert_near(press(&e, &t, 0.003, 0.01, &stored), 0.003 / (0.01 + 1.0 / 400.0), 1e-15);
}

/* ---- Hertz ---------------------------------------------------------------------------------- */

typedef struct hertz_case {
    double young, nu, radius, e_star;
    touch_effect effect;
} hertz_case;

static hertz_case open_hertz(double young, double nu, double radius) {
    const shcd_parameter_value values[] = {
        {"youngs_modulus_pa", young}, {"poisson_ratio", nu}, {"tool_radius_m", radius}};
    hertz_case c = {young, nu, radius, young / (1.0 - nu * nu), {{0}, {0}}};
    c.effect = touch_open("stiffness", values, 3);
    return c;
}

static hertz_case random_hertz(check_random *random) {
    return open_hertz(log_uniform(random, 1.0, 1e12), check_uniform(random, 0.0, 0.5),
                      log_uniform(random, 1e-5, 1.0));
}

static void test_hertz_is_the_closed_form(void **state) {
    check_random random = {2};
    const shcdi_touch t = touch_plane(0.001);
    (void)state;
    for (size_t i = 0; i < check_scaled(1000); i++) {
        const hertz_case c = random_hertz(&random);
        const double depth = log_uniform(&random, 1e-9, 0.1);
        const double force = 4.0 / 3.0 * c.e_star * sqrt(c.radius) * pow(depth, 1.5);
        double stored;
        assert_near(press(&c.effect, &t, depth, 0.0, &stored), force, ROUNDING * force);
        assert_near(stored, 0.4 * force * depth, ROUNDING * stored);
    }
}

/* Liver, 5 mm: the figures of a hand calculation. */
static void test_hertz_liver_under_a_5_mm_ball(void **state) {
    const hertz_case c = open_hertz(5400.0, 0.5, 0.005);
    const shcdi_touch t = touch_plane(0.001);
    double stored;
    (void)state;
    assert_near(press(&c.effect, &t, 0.005, 0.0, &stored), 0.24, 0.001);
    assert_near(press(&c.effect, &t, 0.010, 0.0, &stored), 0.679, 0.001);
}

static void test_hertz_takes_the_radius_of_the_tool(void **state) {
    const shcd_parameter_value value = {"youngs_modulus_pa", 5000.0};
    const touch_effect e = touch_open("stiffness", &value, 1);
    shcdi_touch t = touch_plane(0.001);
    double stored;
    (void)state;
    t.tool_radius_m = 0.004;
    const double of_the_tool = press(&e, &t, 0.002, 0.0, &stored);
    t.tool_radius_m = 0.0; /* sharp: 1 mm */
    assert_near(press(&e, &t, 0.002, 0.0, &stored), 0.5 * of_the_tool, ROUNDING * of_the_tool);
}

static void test_hertz_above_a_compliance_solves_the_depth(void **state) {
    check_random random = {3};
    const shcdi_touch t = touch_plane(0.001);
    (void)state;
    for (size_t i = 0; i < check_scaled(3000); i++) {
        const hertz_case c = random_hertz(&random);
        const double depth = log_uniform(&random, 1e-9, 1.0);
        const double w = log_uniform(&random, 1e-15, 1e6);
        double stored;
        const double f = press(&c.effect, &t, depth, w, &stored);
        const double own = pow(f / (4.0 / 3.0 * c.e_star * sqrt(c.radius)), 2.0 / 3.0);
        assert_near(own + w * f, depth, ROUNDING * depth);
        assert_near(stored, 0.4 * f * own, ROUNDING * stored);
    }
}

/* ---- Hertz with the wave --------------------------------------------------------------------- */

static hertz_case open_coupled(double young, double nu, double radius, double patch) {
    hertz_case c = open_hertz(young, nu, radius);
    c.effect.active.effect->couple(c.effect.active.constants, patch);
    return c;
}

/* A membrane that gives way as the half-space does under its patch, 1/(2 E* p), and the local law
 * on top of it are the half-space: Hertz again, as long as the contact is smaller than the patch,
 * and the flat punch beyond. */
static void test_coupled_law_on_the_static_membrane_is_hertz_again(void **state) {
    check_random random = {4};
    shcdi_touch t = touch_plane(0.001);
    (void)state;
    t.wave_share = 1.0;
    for (size_t i = 0; i < check_scaled(2000); i++) {
        const double patch = log_uniform(&random, 1e-3, 2e-2);
        const double radius = log_uniform(&random, 1e-3, 2e-2);
        const hertz_case c = open_coupled(5000.0, 0.45, radius, patch);
        const double depth = log_uniform(&random, 1e-6, 2e-2);
        const double w = 1.0 / (2.0 * c.e_star * patch);
        const double inside = 4.0 / 3.0 * c.e_star * sqrt(radius) * pow(depth, 1.5);
        const double beyond = 2.0 * c.e_star * patch * (depth - patch * patch / (3.0 * radius));
        const double expected = radius * depth < patch * patch ? inside : beyond;
        double stored;
        assert_near(press(&c.effect, &t, depth, w, &stored), expected, ROUNDING * expected);
    }
}

/* The local tangent compliance is what the smaller contact gives way beyond the patch. The slope
 * changes by its own size within no less than 1/30 of the depth (sooner where the law turns rigid),
 * so the central difference over h = 1e-5 depth errs by (30 h/depth)^2 = 1e-7 of it, and by
 * rounding over h, 1e-10. */
static void test_coupled_law_local_compliance_is_the_difference(void **state) {
    const double patch = 0.005, radius = 0.01;
    const hertz_case c = open_coupled(5000.0, 0.45, radius, patch);
    shcdi_touch t = touch_plane(0.001);
    (void)state;
    t.wave_share = 1.0;
    for (double depth = 2e-4; depth < 8.5e-4; depth += 5e-5) {
        const double w = 1e-3, h = 1e-5 * depth;
        double stored;
        const double f = press(&c.effect, &t, depth, w, &stored);
        const double slope = (press(&c.effect, &t, depth + h, w, &stored) -
                              press(&c.effect, &t, depth - h, w, &stored)) /
                             (2.0 * h);
        const double a = cbrt(3.0 * radius * f / (4.0 * c.e_star));
        const double local = 1.0 / (2.0 * c.e_star * a) - 1.0 / (2.0 * c.e_star * patch);
        assert_true(a < patch);
        assert_near(1.0 / slope - w, local, 1e-7 / slope);
    }
}

static void test_coupled_law_is_continuous_where_it_becomes_rigid(void **state) {
    const double patch = 0.005, radius = 0.01, w = 0.01;
    const hertz_case c = open_coupled(5000.0, 0.45, radius, patch);
    const double f = 4.0 * c.e_star * patch * patch * patch / (3.0 * radius);
    const double edge = patch * patch / (3.0 * radius) + w * f;
    shcdi_touch t = touch_plane(0.001);
    double stored_below, stored_above;
    (void)state;
    t.wave_share = 1.0;
    const double below = press(&c.effect, &t, edge * (1.0 - 1e-12), w, &stored_below);
    const double above = press(&c.effect, &t, edge * (1.0 + 1e-12), w, &stored_above);
    /* the slope is at most 1/W: 2e-12 edge/W */
    assert_near(below, f, 2e-12 * edge / w);
    assert_near(above, f, 2e-12 * edge / w);
    assert_near(stored_below, stored_above, 2e-12 * edge * f + ROUNDING * stored_above);
    assert_near(press(&c.effect, &t, 2.0 * edge, w, &stored_above), f + edge / w,
                ROUNDING * edge / w);
}

/* The wave's share turns one law into the other without a jump, and a body that it does not move at
 * all is a half-space. */
static void test_coupled_law_follows_the_share_of_the_wave(void **state) {
    const hertz_case c = open_coupled(5000.0, 0.45, 0.01, 0.005);
    const hertz_case alone = open_hertz(5000.0, 0.45, 0.01);
    shcdi_touch t = touch_plane(0.001);
    double stored, last;
    (void)state;
    t.wave_share = 0.0;
    last = press(&c.effect, &t, 0.003, 1e-4, &stored);
    assert_true(last == press(&alone.effect, &t, 0.003, 1e-4, &stored));
    t.wave_share = 1.0;
    assert_true(press(&c.effect, &t, 0.003, 0.0, &stored) ==
                press(&alone.effect, &t, 0.003, 0.0, &stored));
    for (int i = 0; i <= 1000; i++) {
        t.wave_share = 0.001 * i;
        const double f = press(&c.effect, &t, 0.003, 1e-4, &stored);
        assert_true(f >= last); /* less gives way locally */
        /* dF/ds = (d indentation/ds)/(W + 1/k) <= 2 a^3/(3 R p)/W with a <= p, or, beyond, that of
         * p^2/(3 R s^2): 3.4 N at most; a thousandth of it a step */
        assert_true(f - last <= 0.001 * 2.0 * 25e-6 / (3.0 * 0.01) / 1e-4 * 1e2);
        last = f;
    }
}

/* The energy of the law is the integral of its force over its own indentation: Simpson's rule over
 * steps of which the indentation is smooth, a^2 - and a^3 - polynomials. */
static void test_hertz_energy_is_the_integral_of_the_force(void **state) {
    const double radius = 0.01, patch = 0.005;
    const hertz_case laws[2] = {open_hertz(5000.0, 0.45, radius),
                                open_coupled(5000.0, 0.45, radius, patch)};
    shcdi_touch t = touch_plane(0.001);
    (void)state;
    t.wave_share = 1.0;
    for (int l = 0; l < 2; l++) {
        const double top = 4e-3, w = l == 0 ? 0.0 : 0.01;
        double stored, energy = 0.0, last_f = 0.0, last_own = 0.0;
        for (int i = 1; i <= 20000; i++) {
            const double depth = top * i / 20000.0;
            const double f = press(&laws[l].effect, &t, depth, w, &stored);
            const double own = depth - w * f;
            energy += 0.5 * (f + last_f) * (own - last_own);
            last_f = f;
            last_own = own;
        }
        /* trapezoids of a curve F(own) with bounded second derivative: 20000^-2 of the whole, and
         * 20000^(-5/2) at the origin where it is own^(3/2) */
        assert_near(energy, stored, 1e-7 * stored);
    }
}

static void test_hertz_is_finite_at_the_ends_of_all_ranges(void **state) {
    const double moduli[] = {1e-300, 1.0, 1e12}, radii[] = {1e-9, 1.0};
    const double depths[] = {1e-300, 1e-6, 1e9}, compliances[] = {0.0, 1e-30, 1.0, 1e12};
    const double patches[] = {0.0, 1e-5, 1.0}, shares[] = {0.0, 1e-200, 1e-6, 1.0};
    (void)state;
    for (size_t i = 0; i < 3 * 2 * 3 * 4 * 3 * 4; i++) {
        size_t k = i;
        const hertz_case c = open_coupled(moduli[k % 3], 0.5, radii[k / 3 % 2], patches[k / 6 % 3]);
        shcdi_touch t = touch_plane(0.001);
        double stored = -1.0;
        k /= 18;
        t.wave_share = shares[k % 4];
        const double f = press(&c.effect, &t, depths[k / 4 % 3], compliances[k / 12], &stored);
        assert_true(f - f == 0.0 && f >= 0.0);
        assert_true(stored - stored == 0.0 && stored >= 0.0);
    }
}

/* ---- tabulated ------------------------------------------------------------------------------ */

static const double rows[] = {0.1, 200.0, 0.2, 1000.0, 0.4, 1000.0, 0.5, 9000.0};
#define THICKNESS 0.02
#define CONTACT 0.004
static const double area = 3.14159265358979324 * CONTACT * CONTACT;

static touch_effect open_table(void) {
    const shcd_parameter_value values[] = {
        {"stress_strain", 0.0, rows, 4}, {"thickness_m", THICKNESS}, {"contact_radius_m", CONTACT}};
    return touch_open("stiffness", values, 3);
}

/* Force [N] of the table at an indentation, by looking the rows up. */
static double table_force(double own_m) {
    const double strain = own_m / THICKNESS;
    double x0 = 0.0, y0 = 0.0;
    size_t i = 0;
    while (i < 3 && strain > rows[2 * i]) {
        x0 = rows[2 * i];
        y0 = rows[2 * i + 1];
        i++;
    }
    return area * (y0 + (rows[2 * i + 1] - y0) * (strain - x0) / (rows[2 * i] - x0));
}

static void test_table_goes_through_its_rows_and_on_beyond_them(void **state) {
    const touch_effect e = open_table();
    const shcdi_touch t = touch_plane(0.001);
    double stored;
    (void)state;
    for (int i = 1; i <= 140; i++) {
        const double depth = 1e-4 * i, f = table_force(depth);
        assert_near(press(&e, &t, depth, 0.0, &stored), f, ROUNDING * area * 9000.0);
    }
    assert_near(press(&e, &t, 0.6 * THICKNESS, 0.0, &stored), area * 17000.0,
                ROUNDING * area * 17000.0);
}

static void test_table_above_a_compliance_solves_the_depth(void **state) {
    const touch_effect e = open_table();
    const shcdi_touch t = touch_plane(0.001);
    check_random random = {5};
    (void)state;
    for (size_t i = 0; i < check_scaled(1000); i++) {
        const double depth = check_uniform(&random, 0.0, 0.02);
        const double w = log_uniform(&random, 1e-6, 10.0);
        double stored;
        const double f = press(&e, &t, depth, w, &stored);
        /* the steepest row gives 200 N/m: rounding of the indentation as of a force */
        assert_near(f, table_force(depth - w * f), ROUNDING * area * 1e5);
    }
}

static void test_table_energy_is_the_integral_of_the_force(void **state) {
    const touch_effect e = open_table();
    const shcdi_touch t = touch_plane(0.001);
    double energy = 0.0, stored;
    (void)state;
    /* trapezoids whose ends hit the rows are exact */
    for (int i = 1; i <= 240; i++) {
        const double h = 5e-5;
        energy += 0.5 * h * (table_force(h * (i - 1)) + table_force(h * i));
        (void)press(&e, &t, h * i, 0.0, &stored);
        assert_near(stored, energy, 240.0 * ROUNDING * energy + 1e-300);
    }
}

static void test_table_may_name_the_origin(void **state) {
    const double with_origin[] = {0.0, 0.0, 0.5, 1000.0};
    const shcd_parameter_value values[] = {{"stress_strain", 0.0, with_origin, 2},
                                           {"contact_radius_m", CONTACT}};
    const touch_effect e = touch_open("stiffness", values, 2);
    const shcdi_touch t = touch_plane(0.001);
    double stored;
    (void)state;
    assert_near(press(&e, &t, 0.0025, 0.0, &stored), area * 500.0, ROUNDING * area * 500.0);
}

/* ---- which parameters go together ------------------------------------------------------------ */

static void test_two_laws_are_refused_by_name(void **state) {
    const shcd_parameter_value all[] = {
        {"k_n_per_m", 300.0}, {"youngs_modulus_pa", 5000.0}, {"stress_strain", 0.0, rows, 4}};
    (void)state;
    for (int a = 0; a < 3; a++) {
        for (int b = 0; b < 3; b++) {
            const shcd_parameter_value two[] = {all[a], all[b]};
            const char *const words[] = {"'body'", "'stiffness'", all[a].name, all[b].name, NULL};
            if (a != b) {
                touch_expect_refusal("stiffness", two, 2, words);
            }
        }
    }
}

static void test_parameters_of_another_law_are_refused(void **state) {
    const shcd_parameter_value values[][2] = {
        {{"k_n_per_m", 300.0}, {"poisson_ratio", 0.4}},
        {{"youngs_modulus_pa", 300.0}, {"thickness_m", 0.4}},
        {{"stress_strain", 0.0, rows, 4}, {"tool_radius_m", 0.01}}};
    const char *const owners[] = {"youngs_modulus_pa", "stress_strain", "youngs_modulus_pa"};
    (void)state;
    for (int i = 0; i < 3; i++) {
        const char *const words[] = {values[i][1].name, owners[i], "not given", NULL};
        touch_expect_refusal("stiffness", values[i], 2, words);
    }
}

static void test_zero_modulus_leaves_the_linear_law(void **state) {
    const shcd_parameter_value values[] = {{"k_n_per_m", 250.0}, {"youngs_modulus_pa", 0.0}};
    const touch_effect e = touch_open("stiffness", values, 2);
    const shcdi_touch t = touch_plane(0.001);
    double stored;
    (void)state;
    assert_true(press(&e, &t, 0.002, 0.0, &stored) == 250.0 * 0.002);
}

static void test_bad_tables_are_refused_with_their_row(void **state) {
    static const double falling[] = {0.1, 200.0, 0.2, 100.0}, standing[] = {0.1, 1.0, 0.1, 2.0},
                        early[] = {0.0, 5.0, 0.1, 6.0}, negative[] = {0.1, -1.0},
                        wild[] = {0.1, 1.0, 0.2, NAN};
    static const struct {
        const double *table;
        size_t n_rows;
        const char *words[4];
    } cases[] = {{falling, 2, {"stress_strain", "row 1", "not fall"}},
                 {standing, 2, {"row 1", "strain", "above"}},
                 {early, 2, {"row 0", "0 at strain 0"}},
                 {negative, 1, {"row 0", "stress_pa", "Pa"}},
                 {wild, 2, {"row 1", "stress_pa", "not finite"}},
                 {rows, 0, {"1 .. 16 rows", "0 are given"}},
                 {NULL, 3, {"1 .. 16 rows"}},
                 {rows, 17, {"1 .. 16 rows", "17"}}};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const shcd_parameter_value value = {"stress_strain", 0.0, cases[i].table, cases[i].n_rows};
        touch_expect_refusal("stiffness", &value, 1, cases[i].words);
    }
}

static void test_number_for_a_table_is_refused(void **state) {
    const shcd_parameter_value number = {"stress_strain", 3.0};
    const char *const words[] = {"stress_strain", "table", NULL};
    (void)state;
    touch_expect_refusal("stiffness", &number, 1, words);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_linear_rigid_body_is_the_product_to_the_bit),
        cmocka_unit_test(test_linear_above_a_compliance_adds_compliances),
        cmocka_unit_test(test_hertz_is_the_closed_form),
        cmocka_unit_test(test_hertz_liver_under_a_5_mm_ball),
        cmocka_unit_test(test_hertz_takes_the_radius_of_the_tool),
        cmocka_unit_test(test_hertz_above_a_compliance_solves_the_depth),
        cmocka_unit_test(test_coupled_law_on_the_static_membrane_is_hertz_again),
        cmocka_unit_test(test_coupled_law_local_compliance_is_the_difference),
        cmocka_unit_test(test_coupled_law_is_continuous_where_it_becomes_rigid),
        cmocka_unit_test(test_coupled_law_follows_the_share_of_the_wave),
        cmocka_unit_test(test_hertz_energy_is_the_integral_of_the_force),
        cmocka_unit_test(test_hertz_is_finite_at_the_ends_of_all_ranges),
        cmocka_unit_test(test_table_goes_through_its_rows_and_on_beyond_them),
        cmocka_unit_test(test_table_above_a_compliance_solves_the_depth),
        cmocka_unit_test(test_table_energy_is_the_integral_of_the_force),
        cmocka_unit_test(test_table_may_name_the_origin),
        cmocka_unit_test(test_two_laws_are_refused_by_name),
        cmocka_unit_test(test_parameters_of_another_law_are_refused),
        cmocka_unit_test(test_zero_modulus_leaves_the_linear_law),
        cmocka_unit_test(test_bad_tables_are_refused_with_their_row),
        cmocka_unit_test(test_number_for_a_table_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
