/* SPDX-License-Identifier: BSD-3-Clause */
/* Soft bodies: several contacts at once, every kind of tool, energy to the bit of its balance, the
 * drive, switching, and snapshots. On spheres, by the addition theorem
 * sum_m Y_lm(a) Y_lm(b) = (2l+1)/(4 pi) P_l(a.b). */
#include "support/soft.h"

#include "response/soft.h"

#include <gsl/gsl_sf_legendre.h>

#define RADIUS_M 0.05
#define DEGREE 8
#define N_HARMONICS ((DEGREE + 1) * (DEGREE + 1))

static shcd_model *sphere;

static int make_sphere(void **state) {
    (void)state;
    sphere = soft_sphere(RADIUS_M, DEGREE);
    return 0;
}

static int free_sphere(void **state) {
    (void)state;
    shcd_model_free(sphere);
    return 0;
}

static shcd_parameter_value value_of(const char *name, double value) {
    const shcd_parameter_value v = {.name = name, .value = value};
    return v;
}

static void open_tools(fixture *f, const shcd_effect_def *effects, size_t n_effects,
                       const shcd_tool_def *tools, size_t n_tools) {
    const shcd_body_def body =
        fixture_body("organ", sphere, fixture_pose(0.0, 0.0, 0.0), effects, n_effects);
    fixture_open(f, &body, 1, tools, n_tools);
}

/* The membrane of the default parameters, and the modes' constants. */
static shcdi_membrane default_membrane(void) {
    double wave[8];
    const shcd_effect_info *info = &shcdi_effect_wave.info;
    for (size_t i = 0; i < info->n_parameters; i++) {
        wave[i] = info->parameters[i].default_value;
    }
    return shcdi_membrane_of(wave);
}

/* Static deflection along n_i at a for a unit force along -n_j at b. */
static double static_compliance(shcd_vec3 a, shcd_vec3 b, size_t n_modes) {
    const shcdi_membrane m = default_membrane();
    const double cosine = shcd_dot(a, b);
    double sum = 0.0;
    for (int l = 0; (size_t)((l + 1) * (l + 1)) <= n_modes; l++) {
        const double eigenvalue = l * (l + 1) / (RADIUS_M * RADIUS_M);
        const double patch = exp(-m.patch_m * m.patch_m * eigenvalue);
        const double p = gsl_sf_legendre_Pl(l, fmax(-1.0, fmin(1.0, cosine)));
        sum += patch * (2 * l + 1) / (4.0 * SOFT_PI * RADIUS_M * RADIUS_M) * p /
               (m.thickness_m * m.shear_pa * eigenvalue + m.foundation_pa_per_m);
    }
    sum *= cosine;
    if (cosine > 1.0 - 1e-12) {
        sum += shcdi_residual_compliance(&m, 4.0 * SOFT_PI * RADIUS_M * RADIUS_M, n_modes);
    }
    return sum;
}

/* ---- several contacts ----------------------------------------------------------------------- */

/* Three balls pressed in by different depths and held until the membrane is still: their forces
 * solve W f = d with W from the addition theorem. Tolerance: the depths are small, but the body
 * turns into another shape by them: second order in depth/radius, 1 %. */
static void test_contacts_share_the_membrane(void **state) {
    const shcd_vec3 at[3] = {{0.0, 0.0, 1.0}, {0.6, 0.0, 0.8}, {0.0, -1.0, 0.0}};
    const double depth_m[3] = {2e-4, 1e-4, 3e-4};
    const shcd_parameter_value wave[2] = {value_of("modes", N_HARMONICS),
                                          value_of("damping_ratio", 1.0)};
    const shcd_effect_def effect = {"wave", wave, 2};
    const shcd_tool_def tools[3] = {fixture_tool("a", 0.003), fixture_tool("b", 0.003),
                                    fixture_tool("c", 0.003)};
    double w[3][3];
    fixture f;
    (void)state;
    open_tools(&f, &effect, 1, tools, 3);
    for (int n = 0; n < 3000; n++) {
        const double share = n < 300 ? n / 300.0 : 1.0;
        for (size_t i = 0; i < 3; i++) {
            f.in[i].tool_in_world.position_m =
                shcd_scale(RADIUS_M + 0.003 - share * depth_m[i], at[i]);
        }
        fixture_step(&f);
    }
    for (size_t i = 0; i < 3; i++) {
        double sum = 0.0;
        for (size_t j = 0; j < 3; j++) {
            w[i][j] = static_compliance(at[i], at[j], N_HARMONICS);
            sum += w[i][j] * shcd_norm(f.out[j].wrench.force_n);
        }
        print_message("contact %zu: %.4f N, depth %.3g m, W f = %.3g m\n", i,
                      shcd_norm(f.out[i].wrench.force_n), depth_m[i], sum);
        assert_near(sum, depth_m[i], 0.01 * depth_m[i]);
        /* along the normal, and symmetric W means nothing is lost between contacts */
        assert_near(shcd_dot(shcd_unit(f.out[i].wrench.force_n), at[i]), 1.0, 1e-3);
    }
    fixture_close(&f);
}

/* More contacts than are solved together: the rest is felt, flagged, and finite. */
static void test_more_contacts_than_are_solved_for(void **state) {
    static shcd_vec3 points[200], normals[200];
    check_random random = {3};
    (void)state;
    for (size_t i = 0; i < 200; i++) {
        normals[i] = fixture_random_direction(&random);
        points[i] = shcd_scale(0.02, normals[i]);
    }
    shcd_tool_geometry *geometry = fixture_shell(points, normals, 200);
    shcd_tool_def tool = fixture_tool_of("cloud", SHCD_TOOL_SHELL, geometry);
    const shcd_effect_def effects[2] = {{"wave", NULL, 0}, {"stiffness", NULL, 0}};
    fixture f;
    tool.evaluations_max = 4000;
    open_tools(&f, effects, 2, &tool, 1);
    for (int n = 0; n < 200; n++) {
        fixture_move(&f, shcd_vec3_make(0.0, 0.0, RADIUS_M + 0.02 - 1e-4 * n),
                     shcd_vec3_make(0.0, 0.0, -0.1));
        assert_true(shcd_vec3_is_finite(f.out[0].wrench.force_n));
        assert_true(shcd_vec3_is_finite(f.out[0].wrench.torque_n_m));
    }
    assert_true(f.out[0].n_contacts > SHCDI_PRESSES_MAX);
    assert_true((f.out[0].flags & SHCD_TOOL_OUTPUT_DEGRADED) != 0);
    assert_true(f.out[0].wrench.force_n.z > 0.0);
    fixture_close(&f);
    shcd_tool_geometry_free(geometry);
}

/* Every kind of tool dents the body, and when it has gone the body comes to rest in its rest shape,
 * to the bit. */
static void test_every_tool_leaves_the_body_as_it_was(void **state) {
    const double turn = sqrt(0.5);
    shcd_tool_geometry *capsule = fixture_capsule(0.003, 0.01);
    shcd_tool_geometry *box = fixture_box(0.004, 0.003, 0.002, 0.001);
    const shcd_tool_def tools[4] = {fixture_tool("point", 0.0), fixture_tool("ball", 0.004),
                                    fixture_tool_of("capsule", SHCD_TOOL_CAPSULE, capsule),
                                    fixture_tool_of("box", SHCD_TOOL_BOX, box)};
    const shcd_effect_def effects[2] = {{"wave", NULL, 0}, {"damping", NULL, 0}};
    (void)state;
    for (size_t t = 0; t < 4; t++) {
        fixture f;
        double c[3 * N_HARMONICS], largest = 0.0;
        open_tools(&f, effects, 2, &tools[t], 1);
        f.in[0].tool_in_world.orientation = (shcd_quat){turn, 0.0, turn, 0.0};
        for (int n = 0; n < 4000; n++) {
            const double z = n < 400 ? 0.067 - 5e-5 * n : n < 800 ? 0.047 : 0.09;
            fixture_move(&f, shcd_vec3_make(0.0, 0.0, z), shcd_vec3_make(0.0, 0.0, 0.0));
            largest = fmax(largest, f.out[0].displacement_m);
            assert_true(f.out[0].wrench.force_n.z >= 0.0);
        }
        print_message("%s: surface moved by up to %.2f mm\n", tools[t].name, 1e3 * largest);
        assert_true(largest > 1e-3);
        assert_no_force(&f.out[0]);
        assert_int_equal(shcd_state_coefficients(f.scene, f.state, 0, c, 3 * N_HARMONICS), SHCD_OK);
        assert_memory_equal(c, shcd_model_coefficients(sphere), sizeof c);
        fixture_close(&f);
    }
    shcd_tool_geometry_free(capsule);
    shcd_tool_geometry_free(box);
}

/* ---- energy --------------------------------------------------------------------------------- */

/* One tick with the effects' accounts. */
static const shcd_effect_output *step_booked(fixture *f, double dt_s, shcd_effect_output *effects) {
    const shcd_input input = {
        .dt_s = dt_s, .tools = f->in, .n_tools = shcd_scene_tool_count(f->scene)};
    shcd_output output = {.tools = f->out,
                          .n_tools = input.n_tools,
                          .effects = effects,
                          .n_effects = shcd_scene_effect_count(f->scene)};
    assert_int_equal(shcd_step(f->scene, f->state, &input, &output), SHCD_OK);
    return effects;
}

/* Height of the surface at the pole: of Y_lm there only m = 0 is not zero. */
static double pole_height(const fixture *f) {
    double c[3 * N_HARMONICS], sum = 0.0;
    assert_int_equal(shcd_state_coefficients(f->scene, f->state, 0, c, 3 * N_HARMONICS), SHCD_OK);
    for (int l = 0; l <= DEGREE; l++) {
        sum += c[3 * SHCD_INDEX(l, 0) + 2] * sqrt((2 * l + 1) / (4.0 * SOFT_PI));
    }
    return sum;
}

/* Without damping the modes gain in a tick what the held force does along the way of the surface:
 * E(n+1) - E(n) = -F (u(n+1) - u(n)), exactly. Rounding: of the heights, 1e-16 of the radius times
 * the force, and of the energies. */
static void test_the_modes_gain_what_the_force_does(void **state) {
    const shcd_parameter_value wave[2] = {value_of("modes", N_HARMONICS),
                                          value_of("damping_ratio", 0.0)};
    const shcd_effect_def effect = {"wave", wave, 2};
    const shcd_tool_def tool = fixture_tool("ball", 0.003);
    const shcdi_membrane m = default_membrane();
    const double residual =
        shcdi_residual_compliance(&m, 4.0 * SOFT_PI * RADIUS_M * RADIUS_M, N_HARMONICS);
    const double ticks[] = {1e-4, 1e-3, 0.02};
    check_random random = {11};
    shcd_effect_output out[1];
    (void)state;
    for (size_t t = 0; t < 3; t++) {
        fixture f;
        double height = RADIUS_M, before_j = 0.0, largest_j = 0.0, worst_j = 0.0;
        open_tools(&f, &effect, 1, &tool, 1);
        for (size_t n = 0; n < check_scaled(4000); n++) {
            f.in[0].tool_in_world.position_m.z =
                RADIUS_M + 0.003 + check_uniform(&random, -0.003, 0.002);
            step_booked(&f, ticks[t], out);
            const double force = f.out[0].wrench.force_n.z, now = pole_height(&f);
            const double modes_j = out[0].stored_j - 0.5 * residual * force * force;
            const double work_j = -force * (now - height);
            worst_j = fmax(worst_j, fabs(modes_j - before_j - work_j));
            largest_j = fmax(largest_j, modes_j);
            before_j = modes_j;
            height = now;
        }
        print_message("T = %g s: balance within %.2g J of up to %.2g J\n", ticks[t], worst_j,
                      largest_j);
        assert_true(worst_j <= 1e-12 * largest_j + 1e-16);
        fixture_close(&f);
    }
}

/* The drive's work is all that an untouched body holds: without damping to rounding, with damping
 * never less than it holds. */
static void test_pulse_pays_for_what_moves(void **state) {
    const double ratios[] = {0.0, 0.3};
    (void)state;
    for (size_t d = 0; d < 2; d++) {
        for (int mode = 0; mode < 3; mode++) {
            const shcd_parameter_value wave[2] = {value_of("modes", N_HARMONICS),
                                                  value_of("damping_ratio", ratios[d])};
            const shcd_parameter_value pulse[1] = {value_of("mode", mode)};
            const shcd_effect_def effects[2] = {{"wave", wave, 2}, {"pulse", pulse, 1}};
            const shcd_tool_def tool = fixture_tool("ball", 0.003);
            shcd_effect_output out[2];
            double largest_j = 0.0, highest_m = 0.0;
            fixture f;
            open_tools(&f, effects, 2, &tool, 1);
            f.in[0].tool_in_world.position_m.z = 1.0;
            for (size_t n = 0; n < 3000; n++) {
                step_booked(&f, FIXTURE_TICK_S, out);
                largest_j = fmax(largest_j, out[0].stored_j);
                highest_m = fmax(highest_m, fabs(pole_height(&f) - RADIUS_M));
                assert_true(out[1].work_j >= out[0].stored_j - 1e-12 * largest_j);
                if (ratios[d] == 0.0) {
                    assert_near(out[1].work_j, out[0].stored_j, 1e-11 * largest_j);
                }
            }
            print_message("mode %d, damping %g: up to %.3g J, pole moved by %.2f mm\n", mode,
                          ratios[d], largest_j, 1e3 * highest_m);
            assert_true(largest_j > 0.0);
            fixture_close(&f);
        }
    }
}

/* A heart that beats under a tool that is held still is felt once in a period. */
static void test_pulse_is_felt(void **state) {
    const shcd_parameter_value pulse[1] = {value_of("frequency_hz", 2.0)};
    const shcd_effect_def effects[3] = {
        {"wave", NULL, 0}, {"pulse", pulse, 1}, {"stiffness", NULL, 0}};
    const shcd_parameter_value wave[1] = {value_of("modes", N_HARMONICS)};
    shcd_effect_def all[3] = {effects[0], effects[1], effects[2]};
    const shcd_tool_def tool = fixture_tool("ball", 0.003);
    double low = HUGE_VAL, high = 0.0, last = 0.0;
    int n_beats = 0;
    fixture f;
    (void)state;
    all[0].parameters = wave;
    all[0].n_parameters = 1;
    open_tools(&f, all, 3, &tool, 1);
    for (int n = 0; n < 5000; n++) {
        const double force =
            fixture_move(&f, shcd_vec3_make(0.0, 0.0, RADIUS_M + 0.002), shcd_vec3_make(0, 0, 0))
                ->wrench.force_n.z;
        if (n >= 1000) {
            low = fmin(low, force);
            high = fmax(high, force);
        }
        if (n >= 1500) {
            const double middle = 0.5 * (low + high);
            n_beats += last < middle && force >= middle;
        }
        last = force;
    }
    print_message("force between %.4f and %.4f N, %d beats in 3.5 s\n", low, high, n_beats);
    assert_true(high > 1.5 * low);
    assert_int_equal(n_beats, 7);
    fixture_close(&f);
}

/* ---- switching, snapshots ------------------------------------------------------------------- */

/* Whatever is switched while a tool presses, the force goes over without a jump: in a tick by no
 * more than a ramp's step of the whole, and what it moves the surface by. */
static void test_switching_makes_no_jump(void **state) {
    const shcd_effect_def with_law[3] = {
        {"stiffness", NULL, 0}, {"wave", NULL, 0}, {"damping", NULL, 0}};
    const shcd_effect_def without_law[2] = {{"wave", NULL, 0}, {"damping", NULL, 0}};
    const shcd_tool_def tool = fixture_tool("ball", 0.003);
    (void)state;
    for (int law = 0; law < 2; law++) {
        for (size_t e = 0; e < (law ? 3u : 2u); e++) {
            fixture f;
            double last, largest = 0.0, whole = 0.0;
            open_tools(&f, law ? with_law : without_law, law ? 3 : 2, &tool, 1);
            for (int n = 0; n < 1000; n++) {
                fixture_move(&f, shcd_vec3_make(0.0, 0.0, RADIUS_M + 0.003 - 3e-6 * n),
                             shcd_vec3_make(0.0, 0.0, 0.0));
            }
            last = f.out[0].wrench.force_n.z;
            for (int n = 0; n < 2000; n++) {
                if (n % 500 == 0) {
                    assert_int_equal(shcd_state_switch(f.scene, f.state, e, n % 1000 != 0, 0.2),
                                     SHCD_OK);
                }
                fixture_step(&f);
                largest = fmax(largest, fabs(f.out[0].wrench.force_n.z - last));
                last = f.out[0].wrench.force_n.z;
                whole = fmax(whole, last);
            }
            print_message("law %d, effect %zu: steps of at most %.3g N, of %.3g N\n", law, e,
                          largest, whole);
            /* a ramp of 200 ticks; a membrane that rebounds may be ten times as fast */
            assert_true(largest <= whole / 20.0);
            fixture_close(&f);
        }
    }
}

static void test_a_snapshot_goes_on_with_the_same_bits(void **state) {
    const shcd_effect_def effects[3] = {
        {"wave", NULL, 0}, {"pulse", NULL, 0}, {"damping", NULL, 0}};
    const shcd_tool_def tool = fixture_tool("ball", 0.003);
    shcd_vec3 forces[200];
    fixture f;
    (void)state;
    open_tools(&f, effects, 3, &tool, 1);
    const size_t size = shcd_state_size(f.scene);
    void *copy = malloc(size);
    assert_non_null(copy);
    for (int run = 0; run < 2; run++) {
        for (int n = run * 300; n < 500; n++) {
            if (n == 300 && run == 0) {
                memcpy(copy, f.state, size);
            }
            fixture_move(&f,
                         shcd_vec3_make(0.0, 0.01 * sin(0.02 * n), 0.0525 - 0.002 * sin(0.01 * n)),
                         shcd_vec3_make(0.0, 0.1, 0.0));
            if (n >= 300 && run == 0) {
                forces[n - 300] = f.out[0].wrench.force_n;
            } else if (n >= 300) {
                assert_memory_equal(&forces[n - 300], &f.out[0].wrench.force_n, sizeof forces[0]);
            }
        }
        memcpy(f.state, copy, size);
    }
    free(copy);
    fixture_close(&f);
}

/* The same body, the tick's lengths mixed: a missed tick must not make the body do what the same
 * time in short ticks would not. */
static void test_the_length_of_a_tick_does_not_matter_statically(void **state) {
    const shcd_effect_def effects[2] = {{"wave", NULL, 0}, {"damping", NULL, 0}};
    const shcd_tool_def tool = fixture_tool("ball", 0.003);
    shcd_effect_output out[2];
    fixture f;
    (void)state;
    open_tools(&f, effects, 2, &tool, 1);
    f.in[0].tool_in_world.position_m.z = RADIUS_M + 0.001;
    for (int n = 0; n < 4000; n++) {
        step_booked(&f, FIXTURE_TICK_S, out);
    }
    const double held = f.out[0].wrench.force_n.z;
    assert_true(held > 0.0);
    for (int n = 0; n < 100; n++) {
        step_booked(&f, n % 3 == 0 ? 0.005 : 0.001, out);
        assert_near(f.out[0].wrench.force_n.z, held, 1e-6 * held);
    }
    fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_contacts_share_the_membrane),
        cmocka_unit_test(test_more_contacts_than_are_solved_for),
        cmocka_unit_test(test_every_tool_leaves_the_body_as_it_was),
        cmocka_unit_test(test_the_modes_gain_what_the_force_does),
        cmocka_unit_test(test_pulse_pays_for_what_moves),
        cmocka_unit_test(test_pulse_is_felt),
        cmocka_unit_test(test_switching_makes_no_jump),
        cmocka_unit_test(test_a_snapshot_goes_on_with_the_same_bits),
        cmocka_unit_test(test_the_length_of_a_tick_does_not_matter_statically),
    };
    return cmocka_run_group_tests(tests, make_sphere, free_sphere);
}
