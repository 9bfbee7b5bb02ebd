/* SPDX-License-Identifier: BSD-3-Clause */
/* The soft body in the tick, on spheres, where everything has a closed form. */
#include "support/soft.h"

#define RADIUS_M 0.05 /* of a liver-like sphere */
#define E_PA 5000.0
#define NU 0.45
#define E_STAR_PA (E_PA / (1.0 - NU * NU))

static shcd_model *sphere;

static int make_sphere(void **state) {
    (void)state;
    sphere = soft_sphere(RADIUS_M, 15);
    return 0;
}

static int free_sphere(void **state) {
    (void)state;
    shcd_model_free(sphere);
    return 0;
}

static void set(shcd_parameter_value *values, size_t *n, const char *name, double value) {
    memset(&values[*n], 0, sizeof values[*n]);
    values[*n].name = name;
    values[(*n)++].value = value;
}

/* One tool on the sphere, with `wave` and, if k > 0, a spring in series. */
static void open_soft(fixture *f, const shcd_parameter_value *wave, size_t n_wave, double k,
                      double tool_radius_m) {
    shcd_parameter_value stiff = {.name = "k_n_per_m", .value = k};
    const shcd_effect_def effects[2] = {{"wave", wave, n_wave}, {"stiffness", &stiff, 1}};
    const shcd_body_def body =
        fixture_body("organ", sphere, fixture_pose(0.0, 0.0, 0.0), effects, k > 0.0 ? 2 : 1);
    const shcd_tool_def tool = fixture_tool("ball", tool_radius_m);
    fixture_open(f, &body, 1, &tool, 1);
}

/* Presses along z to a depth below the rest surface, and waits. @return the force */
static double press(fixture *f, double depth_m, double radius_m, int ticks) {
    const shcd_vec3 none = {0.0, 0.0, 0.0};
    for (int n = 0; n < 200; n++) {
        const double share = (n + 1) / 200.0;
        fixture_move(f, shcd_vec3_make(0.0, 0.0, RADIUS_M + radius_m - share * depth_m), none);
    }
    for (int n = 0; n < ticks; n++) {
        fixture_move(f, shcd_vec3_make(0.0, 0.0, RADIUS_M + radius_m - depth_m), none);
    }
    return f->out[0].wrench.force_n.z;
}

/* Static stiffness of the membrane as a half-space: 2 E* a within 3 %, whatever the number of modes
 * (within 1 %). The depth is small, so that the foot's movement over the surface is none. */
static void test_static_stiffness_is_that_of_the_half_space(void **state) {
    const double patches[] = {0.003, 0.005, 0.008};
    const double modes[] = {36.0, 64.0, 100.0, 256.0};
    (void)state;
    for (size_t p = 0; p < 3; p++) {
        double first = 0.0;
        for (size_t m = 0; m < 4; m++) {
            shcd_parameter_value values[8];
            size_t n = 0;
            fixture f;
            set(values, &n, "modes", modes[m]);
            set(values, &n, "patch_radius_m", patches[p]);
            set(values, &n, "damping_ratio", 1.0);
            open_soft(&f, values, n, 0.0, 0.003);
            const double depth_m = 1e-4;
            const double k = press(&f, depth_m, 0.003, 2000) / depth_m;
            first = m == 0 ? k : first;
            print_message("a = %g m, %g modes: %.2f N/m, half-space %.2f N/m\n", patches[p],
                          modes[m], k, 2.0 * E_STAR_PA * patches[p]);
            assert_near(k, 2.0 * E_STAR_PA * patches[p], 0.03 * 2.0 * E_STAR_PA * patches[p]);
            assert_near(k, first, 0.01 * first);
            fixture_close(&f);
        }
    }
}

/* After contact has ended, the modes go on at their own frequencies, w_l^2 = (G l(l+1)/R^2 + G/s^2)
 * /rho with the support length s: on a sphere each coefficient of the surface is a mode of its own,
 * and q(t+T) + q(t-T) = 2 cos(w_l T) q(t). */
static void test_a_struck_body_rings_at_its_frequencies(void **state) {
    enum { DEGREES = 5 };
    const double g_pa = E_PA / (2.0 * (1.0 + NU));
    shcd_parameter_value values[8];
    size_t n = 0;
    fixture f;
    double rest[3 * SHCD_COUNT(15)], now[3 * SHCD_COUNT(15)], before[2][SHCD_COUNT(DEGREES - 1)];
    double most[DEGREES] = {0.0};
    (void)state;
    set(values, &n, "modes", (double)SHCD_COUNT(DEGREES - 1));
    set(values, &n, "damping_ratio", 0.0);
    set(values, &n, "thickness_m", 0.01);
    open_soft(&f, values, n, 100.0, 0.003);
    assert_int_equal(shcd_state_coefficients(f.scene, f.state, 0, rest, 3 * SHCD_COUNT(15)),
                     SHCD_OK);
    press(&f, 0.003, 0.003, 50);
    for (int i = 0; i < 2000; i++) {
        fixture_move(&f, shcd_vec3_make(0.0, 0.0, 1.0), shcd_vec3_make(0.0, 0.0, 0.0));
        assert_int_equal(shcd_state_coefficients(f.scene, f.state, 0, now, 3 * SHCD_COUNT(15)),
                         SHCD_OK);
        for (int l = 0; l < DEGREES; l++) {
            const double w =
                sqrt((g_pa * l * (l + 1) / (RADIUS_M * RADIUS_M) + g_pa / (0.02 * 0.02)) / 1060.0);
            const size_t k = SHCD_INDEX(l, 0); /* pressed at the pole */
            const double q = now[3 * k + 2] - rest[3 * k + 2];
            if (i >= 2) {
                assert_near(q + before[0][k] - 2.0 * cos(w * FIXTURE_TICK_S) * before[1][k], 0.0,
                            1e-13 * RADIUS_M);
            }
            most[l] = fmax(most[l], fabs(q));
            before[0][k] = before[1][k];
            before[1][k] = q;
        }
    }
    for (int l = 0; l < DEGREES; l++) {
        print_message("l = %d: amplitude %.3g m\n", l, most[l]);
        assert_true(most[l] > 1e-6);
    }
    fixture_close(&f);
}

/* Whatever the tissue and the tick, a scripted tool meets finite forces, and the body never holds
 * more energy than the tool has put in and than a held force can yield, K |dx|^2 for K the
 * stiffness to a motion within a tick: that of the membrane (shcd_scene_wave_stiffness()), or the
 * spring's, if less. It is twice a spring's K |dx|^2/2 because the force of a tick acts on the
 * modes from the tick's start, with its value at the end: a depth d gives them up to f d, and not f
 * d/2. */
static void test_no_stiffness_and_no_tick_blows_up(void **state) {
    check_random random = {7};
    (void)state;
    for (int e = 0; e <= 12; e += 2) {
        for (int t = 0; t < 5; t++) {
            const double ticks[] = {1e-4, 1e-3, 5e-3, 0.01, 0.02};
            const double zeta = (e + t) % 3 == 0 ? 0.0 : 0.2;
            shcd_parameter_value values[8];
            shcd_effect_output outputs[2];
            size_t n = 0;
            fixture f;
            double given_j = 0.0, z = RADIUS_M + 0.004, last_force = 0.0, stored_j = 0.0;
            double slack_j = 0.0, k_n_per_m, held_n_per_m;
            set(values, &n, "youngs_modulus_pa", pow(10.0, e));
            set(values, &n, "damping_ratio", zeta);
            open_soft(&f, values, n, e % 4 == 0 ? 0.0 : 1e4, 0.003);
            assert_int_equal(
                shcd_scene_wave_stiffness(f.scene, 0, ticks[t], &k_n_per_m, &held_n_per_m),
                SHCD_OK);
            k_n_per_m = e % 4 == 0 ? k_n_per_m : fmin(k_n_per_m, 1e4);
            for (size_t i = 0; i < check_scaled(1500); i++) {
                const double to = RADIUS_M + 0.003 + check_uniform(&random, -0.004, 0.001);
                /* the force of a tick is held against the way to the next */
                const double next = z + check_uniform(&random, 0.0, 0.5) * (to - z);
                given_j -= last_force * (next - z);
                slack_j += k_n_per_m * (next - z) * (next - z);
                z = next;
                f.in[0].tool_in_world.position_m = shcd_vec3_make(0.0, 0.0, z);
                const shcd_input input = {.dt_s = ticks[t], .tools = f.in, .n_tools = 1};
                shcd_output output = {.tools = f.out,
                                      .n_tools = 1,
                                      .effects = outputs,
                                      .n_effects = shcd_scene_effect_count(f.scene)};
                assert_int_equal(shcd_step(f.scene, f.state, &input, &output), SHCD_OK);
                assert_true(shcd_vec3_is_finite(f.out[0].wrench.force_n));
                assert_true(f.out[0].wrench.force_n.z >= -1e-9);
                last_force = f.out[0].wrench.force_n.z;
                stored_j = outputs[0].stored_j + (e % 4 == 0 ? 0.0 : outputs[1].stored_j);
                assert_true(stored_j >= 0.0);
                assert_true(stored_j <= given_j + slack_j * (1.0 + 1e-9));
            }
            print_message("E = 1e%d Pa, T = %g s: given %.3g J, stored %.3g J\n", e, ticks[t],
                          given_j, stored_j);
            fixture_close(&f);
        }
    }
}

static void test_refusals(void **state) {
    const struct {
        const char *name;
        double value;
        const char *message;
    } cases[] = {
        {"modes", 257.0, "'modes' is 257, its model has 256"},
        {"modes", 3.5, "must be whole"},
        {"support_length_m", 0.0, "needs anchors"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shcd_parameter_value value = {.name = cases[i].name, .value = cases[i].value};
        const shcd_effect_def wave = {"wave", &value, 1};
        const shcd_body_def body =
            fixture_body("organ", sphere, fixture_pose(0.0, 0.0, 0.0), &wave, 1);
        const shcd_tool_def tool = fixture_tool("tip", 0.0);
        shcd_scene_def def = SHCD_SCENE_DEF_INIT;
        shcd_scene *scene = NULL;
        shcd_error error = {SHCD_OK, ""};
        def.bodies = &body;
        def.n_bodies = 1;
        def.tools = &tool;
        def.n_tools = 1;
        assert_int_equal(shcd_scene_create(&def, NULL, &scene, &error), SHCD_ERR_ARGUMENT);
        assert_non_null(strstr(error.message, cases[i].message));
        assert_null(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_static_stiffness_is_that_of_the_half_space),
        cmocka_unit_test(test_a_struck_body_rings_at_its_frequencies),
        cmocka_unit_test(test_no_stiffness_and_no_tick_blows_up),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, make_sphere, free_sphere);
}
