/* SPDX-License-Identifier: BSD-3-Clause */
/* texture: the relief where it is felt, its work against the energy of the spring that it presses,
 * around closed paths and piece by piece, and its quiet beginning. */
#include "support/scene_fixture.h"
#include "support/touch.h"

#define RADIUS 0.05
#define K 500.0
#define AMPLITUDE 1e-4
#define WAVELENGTH 0.004
#define WAVE_NUMBER (2.0 * 3.14159265358979324 / WAVELENGTH)

static void open_relief(fixture *f, const shcd_model *model, const shcd_tool_def *tool,
                        double pattern) {
    const shcd_parameter_value k = {"k_n_per_m", K};
    const shcd_parameter_value relief[] = {
        {"amplitude_m", AMPLITUDE}, {"wavelength_m", WAVELENGTH}, {"pattern", pattern}};
    const shcd_effect_def effects[] = {{"stiffness", &k, 1}, {"texture", relief, 3}};
    const shcd_body_def body = fixture_body("body", model, fixture_pose(0.0, 0.0, 0.0), effects, 2);
    fixture_open(f, &body, 1, tool, 1);
}

/* The force at p, and the energy that the spring holds. */
static shcd_vec3 force_at(fixture *f, shcd_vec3 p, double *energy_j) {
    shcd_effect_output effects[2];
    const shcd_input input = {FIXTURE_TICK_S, f->in, 1};
    shcd_output output = {f->out, 1, effects, 2};
    f->in[0].tool_in_world.position_m = p;
    assert_int_equal(shcd_step(f->scene, f->state, &input, &output), SHCD_OK);
    assert_true(fixture_in_contact(&f->out[0]));
    *energy_j = effects[0].stored_j + effects[1].stored_j;
    return f->out[0].wrench.force_n;
}

static double relief_at(shcd_vec3 foot, int pattern) {
    const double x = sin(WAVE_NUMBER * foot.x);
    return pattern == 1
               ? AMPLITUDE * x
               : AMPLITUDE / 3.0 * (x + sin(WAVE_NUMBER * foot.y) + sin(WAVE_NUMBER * foot.z));
}

/* On a sphere foot and depth are known; below the fade the relief acts along the normal by its
 * height alone. The foot is within 1e-9 of the diagonal across the line of sight: what it does to
 * sin kx is k times that. */
static void test_relief_presses_by_its_height_at_the_foot(void **state) {
    shcd_model *sphere = fixture_sphere(RADIUS);
    const shcd_tool_def tool = fixture_tool("ball", 0.006);
    check_random random = {1};
    (void)state;
    for (int pattern = 0; pattern < 2; pattern++) {
        fixture f;
        open_relief(&f, sphere, &tool, pattern);
        for (size_t i = 0; i < check_scaled(200); i++) {
            const shcd_vec3 n = fixture_random_direction(&random);
            const double depth = check_uniform(&random, 4e-4, 3e-3);
            double energy;
            const shcd_vec3 force = force_at(&f, shcd_scale(RADIUS + 0.006 - depth, n), &energy);
            const double pressed = depth + relief_at(shcd_scale(RADIUS, n), pattern);
            const double tolerance = 1e-9 * 3.5 * RADIUS * (1.0 + AMPLITUDE * WAVE_NUMBER);
            assert_near(shcd_dot(force, n), K * pressed, K * tolerance);
            assert_near(energy, 0.5 * K * pressed * pressed, K * pressed * tolerance);
        }
        fixture_close(&f);
    }
    shcd_model_free(sphere);
}

/* A frictionless relief does not turn a ball. */
static void test_relief_gives_a_ball_no_torque(void **state) {
    shcd_model *sphere = fixture_sphere(RADIUS);
    const shcd_tool_def tool = fixture_tool("ball", 0.006);
    fixture f;
    double energy;
    (void)state;
    open_relief(&f, sphere, &tool, 0);
    (void)force_at(&f, shcd_vec3_make(0.03, 0.03, 0.034), &energy);
    assert_true(shcd_norm(f.out[0].wrench.torque_n_m) == 0.0);
    fixture_close(&f);
    shcd_model_free(sphere);
}

/* The midpoint rule over a piece of length h errs by h^3/24 times the third derivative of
 * U = K/2 D^2, D = depth + w relief, and by h^2/8 times a jump of the second, U3 = K (D D3 + 3 D1
 * D2). Below the fade D <= 4 mm: K (D A q^3 + 3 1.2 A q^2). Within it D <= 4 A, and over the
 * relief's A w1 <= 1/(2 A), w2 <= 2/(3 A^2), w3 = 4/(9 A^3): D2 <= 0.9/A, D3 <= 0.8/A^2, K (3.2
 * + 4.3)/A. w2 jumps where the fade ends, by K D w2 A <= 8/3 K. */
#define STEP 2e-6
#define THIRD                                                                                      \
    (K * (4e-3 * AMPLITUDE * WAVE_NUMBER * WAVE_NUMBER * WAVE_NUMBER +                             \
          3.6 * AMPLITUDE * WAVE_NUMBER * WAVE_NUMBER + 8.0 / AMPLITUDE))
#define PIECE_J(h) (THIRD * (h) * (h) * (h) / 24.0 + 8.0 / 3.0 * K * (h) * (h) / 8.0)
/* the query's own tolerance, 1e-9 of the diagonal 0.224 m, at both ends */
#define QUERY_J (2.0 * K * 3.1e-3 * 1e-9 * 0.224 * (1.0 + AMPLITUDE * WAVE_NUMBER))

/* Along a straight piece the work is the change of the energy. @return that work */
static double piece(fixture *f, shcd_vec3 from, shcd_vec3 to) {
    const shcd_vec3 dx = shcd_sub(to, from);
    double before, after, unused;
    (void)force_at(f, from, &before);
    const double given = -shcd_dot(force_at(f, shcd_mul_add(from, 0.5, dx), &unused), dx);
    (void)force_at(f, to, &after);
    assert_near(given, after - before, PIECE_J(shcd_norm(dx)) + QUERY_J);
    return given;
}

/* Somewhere at a depth of about `depth` under the direction u of the ellipsoid. */
static shcd_vec3 under(shcd_vec3 u, double radius, double depth) {
    const shcd_vec3 s = {0.08 * u.x, 0.06 * u.y, 0.05 * u.z};
    const shcd_vec3 n = shcd_unit(shcd_vec3_make(u.x / 0.08, u.y / 0.06, u.z / 0.05));
    return shcd_mul_add(s, radius - depth, n);
}

/* A closed loop of short pieces over an ellipsoid, deep and shallow, with a ball that is a fifth of
 * the smallest radius of curvature, and with a point. Without the pull-back of the gradient
 * a piece would be off by 2e-8 J. */
static void test_closed_loops_take_and_give_nothing(void **state) {
    shcd_model *body = fixture_ellipsoid(0.08, 0.06, 0.05);
    (void)state;
    for (int k = 0; k < 2; k++) {
        const double radius = k == 0 ? 0.006 : 0.0;
        const shcd_tool_def tool = fixture_tool("tool", radius);
        for (int pattern = 0; pattern < 2; pattern++) {
            fixture f;
            double sum = 0.0, size = 0.0;
            const int n = 2000;
            const double span = n * STEP / (2.0 * 3.14159265358979324) / 0.08;
            open_relief(&f, body, &tool, pattern);
            shcd_vec3 last = under(shcd_unit(shcd_vec3_make(0.5 + span, 0.4, 0.7)), radius, 5e-4);
            for (int i = 1; i <= n; i++) {
                const double a = 2.0 * 3.14159265358979324 * i / n;
                const shcd_vec3 u =
                    shcd_unit(shcd_vec3_make(0.5 + span * cos(a), 0.4 + span * sin(a), 0.7));
                const shcd_vec3 next = under(u, radius, 5e-4 - 4.5e-4 * sin(a));
                const double given = piece(&f, last, next);
                sum += given;
                size += fabs(given);
                last = next;
            }
            assert_true(size > 5e-5);
            assert_near(sum, 0.0, n * (PIECE_J(2.0 * STEP) + QUERY_J)); /* none is twice as long */
            fixture_close(&f);
        }
    }
    shcd_model_free(body);
}

static void test_shell_point_pieces_are_conservative(void **state) {
    shcd_model *body = fixture_ellipsoid(0.08, 0.06, 0.05);
    const shcd_vec3 origin = {0.0, 0.0, 0.0}, into = {0.0, 0.0, 1.0};
    shcd_tool_geometry *shell = fixture_shell(&origin, &into, 1);
    const shcd_tool_def tool = fixture_tool_of("shell", SHCD_TOOL_SHELL, shell);
    fixture f;
    check_random random = {2};
    (void)state;
    open_relief(&f, body, &tool, 0);
    for (size_t i = 0; i < check_scaled(100); i++) {
        const shcd_vec3 p =
            under(fixture_random_direction(&random), 0.0, check_uniform(&random, 1e-4, 2e-3));
        (void)piece(&f, p, shcd_mul_add(p, STEP, fixture_random_direction(&random)));
    }
    fixture_close(&f);
    shcd_tool_geometry_free(shell);
    shcd_model_free(body);
}

/* From the first touch on the force grows no faster than 1.5^2 times the spring alone, and the
 * pressed depth rises with the depth. */
static void test_first_touch_does_not_jump(void **state) {
    shcd_model *sphere = fixture_sphere(RADIUS);
    const shcd_tool_def tool = fixture_tool("tip", 0.0);
    check_random random = {3};
    (void)state;
    for (size_t i = 0; i < check_scaled(50); i++) {
        const shcd_vec3 n = fixture_random_direction(&random);
        fixture f;
        double last = 0.0, energy;
        open_relief(&f, sphere, &tool, 0);
        for (double depth = 1e-6; depth < 6e-4; depth += 1e-6) {
            const shcd_vec3 force = force_at(&f, shcd_scale(RADIUS - depth, n), &energy);
            assert_at_most(shcd_dot(force, n), K * 2.25 * depth + K * 1e-9);
            assert_true(energy > last);
            last = energy;
        }
        fixture_close(&f);
    }
    shcd_model_free(sphere);
}

static void test_spikes_and_unknown_patterns_are_refused(void **state) {
    const shcd_parameter_value spikes[] = {{"amplitude_m", 0.002}, {"wavelength_m", 0.004}};
    const shcd_parameter_value pattern = {"pattern", 0.5};
    const char *const of_spikes[] = {"'texture'", "amplitude_m", "quarter", "wavelength_m", NULL};
    const char *const of_pattern[] = {"'texture'", "'pattern'", "0.5", NULL};
    (void)state;
    touch_expect_refusal("texture", spikes, 2, of_spikes);
    touch_expect_refusal("texture", &pattern, 1, of_pattern);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_relief_presses_by_its_height_at_the_foot),
        cmocka_unit_test(test_relief_gives_a_ball_no_torque),
        cmocka_unit_test(test_closed_loops_take_and_give_nothing),
        cmocka_unit_test(test_shell_point_pieces_are_conservative),
        cmocka_unit_test(test_first_touch_does_not_jump),
        cmocka_unit_test(test_spikes_and_unknown_patterns_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
