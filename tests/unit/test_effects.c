/* SPDX-License-Identifier: BSD-3-Clause */
/* What holds for every effect of the table: without it a scene is the same as with it in vain, to
 * the bit; nothing makes its force infinite; switching it makes no jump.
 *
 * `wave`, `pulse` and `learned` belong to bodies whose model carries their data, and have tests of
 * their own. */
#include "support/scene_fixture.h"

#define N_TOOLS 4
#define COUNT(array) (sizeof(array) / sizeof(array)[0])

/* Stress over strain, for the tabulated law of stiffness. */
static const double rows[] = {0.05, 300.0, 0.2, 2000.0, 0.5, 20000.0};

/* An effect of single contacts, with the parameters that make it nothing, and sets at the ends of
 * its ranges: as many as fit together. */
typedef struct subject {
    const char *name;
    shcd_parameter_value neutral[3];
    shcd_parameter_value extreme[5][7];
} subject;

static const subject subjects[] = {
    {"texture",
     {{"amplitude_m", 0.0}},
     {{{"amplitude_m", 0.01}, {"wavelength_m", 0.04}},
      {{"amplitude_m", 2.5e-5}, {"wavelength_m", 1e-4}, {"pattern", 1.0}},
      {{"amplitude_m", 0.01}, {"wavelength_m", 1.0}}}},
    {"stiffness",
     {{"k_n_per_m", 0.0}},
     {{{"k_n_per_m", 1e5}},
      {{"youngs_modulus_pa", 1e12}, {"poisson_ratio", 0.5}, {"tool_radius_m", 1.0}},
      {{"youngs_modulus_pa", 1e-300}, {"poisson_ratio", 0.0}, {"tool_radius_m", 1e-300}},
      {{"stress_strain", 0.0, rows, 3}, {"thickness_m", 1e-5}, {"contact_radius_m", 1.0}},
      {{"stress_strain", 0.0, rows, 3}, {"thickness_m", 10.0}, {"contact_radius_m", 1e-300}}}},
    {"damping",
     {{"ratio", 0.0}},
     {{{"ratio", 1.0}, {"reference_speed_m_per_s", 1e-3}},
      {{"ratio", 1.0}, {"reference_speed_m_per_s", 100.0}}}},
    {"relaxation",
     {{"g_1", 0.0}, {"g_2", 0.0}, {"g_3", 0.0}},
     {{{"g_1", 0.99}, {"g_2", 0.0}, {"tau_1_s", 1e-3}},
      {{"g_1", 0.3}, {"g_2", 0.3}, {"g_3", 0.3}, {"tau_1_s", 1e-3}, {"tau_3_s", 1e4}}}},
    {"friction",
     {{"static_ratio", 0.0}, {"kinetic_ratio", 0.0}},
     {{{"static_ratio", 10.0},
       {"kinetic_ratio", 10.0},
       {"stiffness_n_per_m", 1e5},
       {"slip_length_m", 1.0},
       {"rest_time_s", 100.0}},
      {{"static_ratio", 10.0},
       {"kinetic_ratio", 0.0},
       {"stiffness_n_per_m", 1.0},
       {"slip_length_m", 1e-6},
       {"rest_time_s", 1e-3}}}},
    {"viscosity",
     {{"damping_n_s_per_m", 0.0}},
     {{{"damping_n_s_per_m", 100.0}, {"length_m", 1e-300}},
      {{"viscosity_pa_s", 1e4}, {"length_m", 1.0}}}},
};
#define N_SUBJECTS COUNT(subjects)

static size_t count_of(const shcd_parameter_value *values, size_t capacity) {
    size_t n = 0;
    while (n < capacity && values[n].name != NULL) {
        n++;
    }
    return n;
}

static shcd_model *body_model;
static shcd_tool_geometry *box, *shell;

static int make_world(void **state) {
    shcd_vec3 points[120], normals[120];
    check_random random = {11};
    (void)state;
    for (size_t i = 0; i < COUNT(points); i++) {
        normals[i] = shcd_scale(-1.0, fixture_random_direction(&random));
        points[i] = shcd_scale(-0.008, normals[i]);
    }
    body_model = fixture_ellipsoid(0.08, 0.06, 0.05);
    box = fixture_box(0.006, 0.004, 0.003, 0.001);
    shell = fixture_shell(points, normals, COUNT(points));
    return 0;
}

static int free_world(void **state) {
    (void)state;
    shcd_tool_geometry_free(shell);
    shcd_tool_geometry_free(box);
    shcd_model_free(body_model);
    return 0;
}

/* The ellipsoid with these effects, turned and moved, and a tool of each kind. */
static void open_all(fixture *f, const shcd_effect_def *effects, size_t n_effects) {
    check_random random = {12};
    const shcd_body_def body =
        fixture_body("body", body_model, fixture_random_pose(&random, 0.1), effects, n_effects);
    const shcd_tool_def tools[N_TOOLS] = {fixture_tool("tip", 0.0), fixture_tool("ball", 0.004),
                                          fixture_tool_of("box", SHCD_TOOL_BOX, box),
                                          fixture_tool_of("shell", SHCD_TOOL_SHELL, shell)};
    fixture_open(f, &body, 1, tools, N_TOOLS);
}

/* Each tool goes its own way over the ellipsoid and in and out of it, turning, and sometimes
 * elsewhere at once. */
typedef struct walk {
    check_random random;
    shcd_vec3 u[N_TOOLS];
    double phase;
    shcd_pose body;
} walk;

static walk begin_walk(void) {
    walk w = {.random = {13}};
    check_random pose = {12};
    w.body = fixture_random_pose(&pose, 0.1);
    for (size_t t = 0; t < N_TOOLS; t++) {
        w.u[t] = fixture_random_direction(&w.random);
    }
    return w;
}

static void go_on(walk *w, fixture *f) {
    check_random *r = &w->random;
    w->phase += 0.02;
    for (size_t t = 0; t < N_TOOLS; t++) {
        shcd_tool_input *in = &f->in[t];
        const double jump = check_uniform(r, 0.0, 1.0) < 0.01 ? 0.5 : 0.004;
        const double in_and_out = 1.03 + 0.2 * sin(w->phase + (double)t);
        w->u[t] = shcd_unit(shcd_mul_add(w->u[t], jump, fixture_random_direction(r)));
        const shcd_vec3 p = {0.08 * in_and_out * w->u[t].x, 0.06 * in_and_out * w->u[t].y,
                             0.05 * in_and_out * w->u[t].z};
        const shcd_vec3 turn = shcd_scale(0.01, fixture_random_direction(r));
        shcd_quat q = in->tool_in_world.orientation;
        q.x += turn.x;
        q.y += turn.y;
        q.z += turn.z;
        const double n = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
        in->tool_in_world.orientation.w = q.w / n;
        in->tool_in_world.orientation.x = q.x / n;
        in->tool_in_world.orientation.y = q.y / n;
        in->tool_in_world.orientation.z = q.z / n;
        in->tool_in_world.position_m = shcd_transform(w->body, p);
        in->velocity_m_per_s = shcd_scale(check_uniform(r, 0.0, 0.5), fixture_random_direction(r));
        in->angular_velocity_rad_per_s =
            shcd_scale(check_uniform(r, 0.0, 5.0), fixture_random_direction(r));
    }
}

static void copy_inputs(const fixture *from, fixture *to) {
    memcpy(to->in, from->in, sizeof to->in);
}

/* Equal bits, -0.0 counting as +0.0. */
static void assert_same_bits(const shcd_tool_output *a, const shcd_tool_output *b) {
    const double x[] = {a->wrench.force_n.x,
                        a->wrench.force_n.y,
                        a->wrench.force_n.z,
                        a->wrench.torque_n_m.x,
                        a->wrench.torque_n_m.y,
                        a->wrench.torque_n_m.z,
                        a->proxy_m.x,
                        a->proxy_m.y,
                        a->proxy_m.z,
                        a->normal.x,
                        a->normal.y,
                        a->normal.z,
                        a->penetration_m,
                        a->distance_m};
    const double y[] = {b->wrench.force_n.x,
                        b->wrench.force_n.y,
                        b->wrench.force_n.z,
                        b->wrench.torque_n_m.x,
                        b->wrench.torque_n_m.y,
                        b->wrench.torque_n_m.z,
                        b->proxy_m.x,
                        b->proxy_m.y,
                        b->proxy_m.z,
                        b->normal.x,
                        b->normal.y,
                        b->normal.z,
                        b->penetration_m,
                        b->distance_m};
    for (size_t i = 0; i < COUNT(x); i++) {
        const double p = x[i] + 0.0;
        const double q = y[i] + 0.0;
        assert_memory_equal(&p, &q, sizeof p);
    }
    assert_int_equal(a->flags, b->flags);
    assert_int_equal(a->body, b->body);
    assert_int_equal(a->n_contacts, b->n_contacts);
    assert_int_equal(a->n_evaluations, b->n_evaluations);
}

/* Two scenes along the same walk give the same bits. */
static void compare_along_a_walk(const shcd_effect_def *a, size_t n_a, const shcd_effect_def *b,
                                 size_t n_b) {
    walk w = begin_walk();
    fixture fa, fb;
    size_t n_contacts[N_TOOLS] = {0};
    open_all(&fa, a, n_a);
    open_all(&fb, b, n_b);
    for (size_t i = 0; i < 400; i++) {
        go_on(&w, &fa);
        copy_inputs(&fa, &fb);
        fixture_step(&fa);
        fixture_step(&fb);
        for (size_t t = 0; t < N_TOOLS; t++) {
            assert_same_bits(&fa.out[t], &fb.out[t]);
            n_contacts[t] += (fa.out[t].flags & SHCD_TOOL_OUTPUT_CONTACT) != 0;
        }
    }
    for (size_t t = 0; t < N_TOOLS; t++) {
        assert_true(n_contacts[t] > 80 && n_contacts[t] < 380);
    }
    fixture_close(&fa);
    fixture_close(&fb);
}

/* ---- the table ------------------------------------------------------------------------------ */

/* No effect escapes these tests by being new. */
static void test_every_effect_of_a_contact_is_a_subject(void **state) {
    static const char *const others[] = {"wave", "pulse", "learned"};
    (void)state;
    for (size_t e = 0; shcd_effect_at(e) != NULL; e++) {
        int is_known = 0;
        for (size_t i = 0; i < N_SUBJECTS; i++) {
            is_known |= strcmp(subjects[i].name, shcd_effect_at(e)->name) == 0;
        }
        for (size_t i = 0; i < COUNT(others); i++) {
            is_known |= strcmp(others[i], shcd_effect_at(e)->name) == 0;
        }
        if (!is_known) {
            fail_msg("effect '%s' is not tested here", shcd_effect_at(e)->name);
        }
    }
}

/* ---- in vain, or not at all -------------------------------------------------------------------
 */

/* Beside all other effects with their defaults, and alone. */
static void test_neutral_equals_absent_bit_for_bit(void **state) {
    (void)state;
    for (size_t s = 0; s < N_SUBJECTS; s++) {
        shcd_effect_def with[N_SUBJECTS], without[N_SUBJECTS];
        size_t n = 0;
        for (size_t i = 0; i < N_SUBJECTS; i++) {
            const shcd_effect_def in_full = {subjects[i].name, NULL, 0};
            const shcd_effect_def in_vain = {subjects[i].name, subjects[i].neutral,
                                             count_of(subjects[i].neutral, 3)};
            with[i] = i == s ? in_vain : in_full;
            if (i != s) {
                without[n++] = in_full;
            }
        }
        compare_along_a_walk(with, N_SUBJECTS, without, n);
        compare_along_a_walk(&with[s], 1, NULL, 0);
    }
}

/* Likewise switched off at once. */
static void test_switched_off_equals_absent_bit_for_bit(void **state) {
    (void)state;
    for (size_t s = 0; s < N_SUBJECTS; s++) {
        shcd_effect_def with[N_SUBJECTS], without[N_SUBJECTS];
        walk w = begin_walk();
        fixture fa, fb;
        size_t n = 0;
        for (size_t i = 0; i < N_SUBJECTS; i++) {
            const shcd_effect_def in_full = {subjects[i].name, NULL, 0};
            with[i] = in_full;
            if (i != s) {
                without[n++] = in_full;
            }
        }
        open_all(&fa, with, N_SUBJECTS);
        open_all(&fb, without, n);
        assert_string_equal(shcd_scene_effect_name(fa.scene, s), subjects[s].name);
        assert_int_equal(shcd_state_switch(fa.scene, fa.state, s, 0, 0.0), SHCD_OK);
        for (size_t i = 0; i < 200; i++) {
            go_on(&w, &fa);
            copy_inputs(&fa, &fb);
            fixture_step(&fa);
            fixture_step(&fb);
            for (size_t t = 0; t < N_TOOLS; t++) {
                assert_same_bits(&fa.out[t], &fb.out[t]);
            }
        }
        fixture_close(&fa);
        fixture_close(&fb);
    }
}

static void test_order_in_the_definition_does_not_matter(void **state) {
    shcd_effect_def one[N_SUBJECTS], other[N_SUBJECTS];
    (void)state;
    for (size_t i = 0; i < N_SUBJECTS; i++) {
        const shcd_effect_def effect = {subjects[i].name, NULL, 0};
        one[i] = effect;
        other[(5 * i + 3) % N_SUBJECTS] = effect;
    }
    compare_along_a_walk(one, N_SUBJECTS, other, N_SUBJECTS);
}

static void test_body_without_effects_is_touched_without_force(void **state) {
    walk w = begin_walk();
    fixture f;
    size_t n_contacts = 0;
    (void)state;
    open_all(&f, NULL, 0);
    for (size_t i = 0; i < 200; i++) {
        go_on(&w, &f);
        fixture_step(&f);
        for (size_t t = 0; t < N_TOOLS; t++) {
            assert_no_force(&f.out[t]);
            n_contacts += fixture_in_contact(&f.out[t]) != 0;
        }
    }
    assert_true(n_contacts > 200);
    fixture_close(&f);
}

/* ---- nothing infinite --------------------------------------------------------------------------
 */

static void check_finite(const fixture *f) {
    for (size_t t = 0; t < N_TOOLS; t++) {
        assert_true(shcd_vec3_is_finite(f->out[t].wrench.force_n));
        assert_true(shcd_vec3_is_finite(f->out[t].wrench.torque_n_m));
    }
}

/* At the ends of the ranges, beside the defaults of all others, for wild velocities and ticks. */
static void step_wildly(const shcd_effect_def *effects, size_t n) {
    const double speeds[] = {0.0, -0.0, 1e-300, 1.0, -1.0, 1e9, -1e9};
    const double ticks[] = {1e-300, 1e-6, 0.001, 0.1};
    walk w = begin_walk();
    fixture f;
    open_all(&f, effects, n);
    for (size_t i = 0; i < 280; i++) {
        go_on(&w, &f);
        for (size_t t = 0; t < N_TOOLS; t++) {
            f.in[t].velocity_m_per_s =
                shcd_scale(speeds[(i + t) % COUNT(speeds)], fixture_random_direction(&w.random));
            f.in[t].angular_velocity_rad_per_s = shcd_scale(speeds[(i + 2 * t) % COUNT(speeds)],
                                                            fixture_random_direction(&w.random));
        }
        const shcd_input input = {ticks[i / 7 % COUNT(ticks)], f.in, N_TOOLS};
        shcd_output output = {f.out, N_TOOLS};
        assert_int_equal(shcd_step(f.scene, f.state, &input, &output), SHCD_OK);
        check_finite(&f);
    }
    fixture_close(&f);
}

static void test_force_is_finite_at_the_ends_of_all_ranges(void **state) {
    (void)state;
    for (size_t s = 0; s < N_SUBJECTS; s++) {
        for (size_t v = 0; v < COUNT(subjects[s].extreme); v++) {
            shcd_effect_def effects[N_SUBJECTS];
            const size_t n = count_of(subjects[s].extreme[v], 7);
            for (size_t i = 0; n > 0 && i < N_SUBJECTS; i++) {
                const shcd_effect_def in_full = {subjects[i].name, NULL, 0};
                const shcd_effect_def extreme = {subjects[i].name, subjects[s].extreme[v], n};
                effects[i] = i == s ? extreme : in_full;
            }
            if (n > 0) {
                step_wildly(effects, N_SUBJECTS);
            }
        }
    }
}

/* All at their ends at once. */
static void test_force_is_finite_with_all_at_their_ends(void **state) {
    (void)state;
    for (size_t v = 0; v < 2; v++) {
        shcd_effect_def effects[N_SUBJECTS];
        for (size_t i = 0; i < N_SUBJECTS; i++) {
            const shcd_effect_def extreme = {subjects[i].name, subjects[i].extreme[v],
                                             count_of(subjects[i].extreme[v], 7)};
            effects[i] = extreme;
        }
        step_wildly(effects, N_SUBJECTS);
    }
}

/* ---- switching ---------------------------------------------------------------------------------
 */

/* A ball held still in a body (its velocity is only told), after a slide that winds friction's
 * spring up and 3 s in which relaxation settles: what is left of its change, 0.3 e^-3 of 1 s, is
 * below 2e-5 of the force a tick. */
static double hold(fixture *f, size_t n_ticks, double *largest_change) {
    shcd_vec3 last = f->out[0].wrench.force_n;
    *largest_change = 0.0;
    for (size_t i = 0; i < n_ticks; i++) {
        fixture_step(f);
        *largest_change =
            fmax(*largest_change, shcd_norm(shcd_sub(f->out[0].wrench.force_n, last)));
        last = f->out[0].wrench.force_n;
    }
    return shcd_norm(last);
}

static void test_switching_is_as_smooth_as_its_ramp(void **state) {
    (void)state;
    for (size_t s = 0; s < N_SUBJECTS; s++) {
        const int is_stiffness = strcmp(subjects[s].name, "stiffness") == 0;
        const shcd_effect_def effects[2] = {{"stiffness", NULL, 0}, {subjects[s].name, NULL, 0}};
        const shcd_body_def body = fixture_body("body", body_model, fixture_pose(0.0, 0.0, 0.0),
                                                effects, is_stiffness ? 1 : 2);
        const shcd_tool_def tool = fixture_tool("ball", 0.004);
        const size_t index = strcmp(subjects[s].name, "texture") == 0 || is_stiffness ? 0 : 1;
        fixture f;
        double change, drift;
        fixture_open(&f, &body, 1, &tool, 1);
        assert_string_equal(shcd_scene_effect_name(f.scene, index), subjects[s].name);
        for (int i = 0; i < 100; i++) {
            (void)fixture_move(&f, shcd_vec3_make(2e-5 * i, 0.001, 0.05), /* 4 mm deep */
                               shcd_vec3_make(0.02, 0.0, -0.01));
        }
        (void)hold(&f, 3000, &change);
        const double on = hold(&f, 1, &drift);
        const shcd_vec3 force_on = f.out[0].wrench.force_n;
        for (int k = 0; k < 4; k++) { /* off, on, off, on */
            assert_int_equal(shcd_state_switch(f.scene, f.state, index, k % 2, 0.1), SHCD_OK);
            (void)hold(&f, 101, &change);
            const double apart =
                shcd_norm(shcd_sub(f.out[0].wrench.force_n, force_on)) + 4000.0 * drift;
            if (k == 0) {
                assert_true(apart > 1e-4 * on); /* it did something */
            }
            /* the ball's relief tilts a force that it changes, too: k A times its slope 2 pi A/l */
            const double product = index == 0 && !is_stiffness ? 300.0 * 1e-4 * 0.158 : 0.0;
            assert_at_most(change, (k % 2 == 0 ? apart : on) / 100.0 + 2.0 * product / 100.0 +
                                       2.0 * drift + 1e-12 * on);
        }
        fixture_close(&f);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_effect_of_a_contact_is_a_subject),
        cmocka_unit_test(test_neutral_equals_absent_bit_for_bit),
        cmocka_unit_test(test_switched_off_equals_absent_bit_for_bit),
        cmocka_unit_test(test_order_in_the_definition_does_not_matter),
        cmocka_unit_test(test_body_without_effects_is_touched_without_force),
        cmocka_unit_test(test_force_is_finite_at_the_ends_of_all_ranges),
        cmocka_unit_test(test_force_is_finite_with_all_at_their_ends),
        cmocka_unit_test(test_switching_is_as_smooth_as_its_ramp),
    };
    return cmocka_run_group_tests(tests, make_world, free_world);
}
