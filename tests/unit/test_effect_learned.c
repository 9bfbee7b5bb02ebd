/* SPDX-License-Identifier: BSD-3-Clause */
/* learned: the force on a tool is minus the gradient of the energy over the tool's position, on a
 * curved body and for tools with a radius; under a compliance; refused where it has no data. */
#include "shcd/query.h"
#include "support/network.h"
#include "support/scene_fixture.h"
#include "support/touch.h"

#include <string.h>

static double numbers[NETWORK_NUMBERS];

/* An ellipsoid of about the size of the network, which it carries. */
static shcd_model *body(const shcd_learned *learned) {
    double coefficients[12];
    const double eigenvalues[NETWORK_MODES] = {0.0, 800.0};
    const double modes_coefficients[NETWORK_MODES * 4] = {20.0, 0.0, 0.0, 0.0, 0.0, 20.0};
    const shcd_modes modes = {
        NETWORK_MODES, eigenvalues, modes_coefficients, 0.03, 0.0, 5e-4, 0, 0};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    bodies_ellipsoid_coefficients(0.06, 0.05, 0.04, coefficients);
    def.degree = 1;
    def.coefficients = coefficients;
    def.modes = &modes;
    def.learned = learned;
    assert_int_equal(shcd_model_create(&def, NULL, &model, NULL), SHCD_OK);
    return model;
}

/* The contact of a ball with its centre there; energy of the network. */
static double contact(const shcd_model *model, shcd_vec3 centre, double radius, shcdi_touch *t) {
    shcd_proximity found;
    shcd_learned_output out;
    assert_int_equal(shcd_closest(model, centre, NULL, &found), SHCD_OK);
    *t = touch_plane(radius - found.distance_m);
    t->model = model;
    t->tool_radius_m = radius;
    t->normal = found.normal;
    t->foot_m = found.point_m;
    t->parameter = found.parameter;
    assert_int_equal(
        shcd_learned_evaluate(shcd_model_learned(model), found.point_m, t->depth_m, &out), SHCD_OK);
    return out.energy_j;
}

static shcd_vec3 force_of(touch_effect *e, const shcdi_touch *t, double *stored_j) {
    const double normal =
        e->active.effect->press(e->active.constants, t, t->depth_m, 0.0, stored_j);
    const shcdi_response r = touch_apply(e, t, normal);
    return shcd_mul_add(r.other_force_n, r.normal_force_n, t->normal);
}

static void test_force_is_minus_the_gradient_over_the_tool(void **state) {
    const shcd_learned learned = network_by_hand(numbers);
    const shcd_parameter_value scale = {.name = "scale", .value = 1.5};
    shcd_model *model = body(&learned);
    touch_effect e = touch_open("learned", &scale, 1);
    check_random random = {31};
    const double h = 2e-6;
    double across = 0.0;
    (void)state;
    for (size_t i = 0; i < 20 + check_scaled(180); i++) {
        const shcd_vec3 w = bodies_random_direction(&random);
        const double radius = i % 2 == 0 ? 0.0 : 0.006;
        const double depth = check_uniform(&random, 0.001, 0.009);
        shcd_vec3 x, n;
        shcdi_touch t;
        double stored_j;
        assert_int_equal(shcd_model_surface(model, -1, w, &x, &n, NULL), SHCD_OK);
        const shcd_vec3 c = shcd_mul_add(x, radius - depth, n);
        const double energy = contact(model, c, radius, &t);
        const shcd_vec3 force = force_of(&e, &t, &stored_j);
        /* the foot of the query and that of its parameter agree to some 1e-13 of the diagonal */
        assert_near(stored_j, 1.5 * energy, 1e-11 * energy);
        const shcd_vec3 tangent = shcd_sub(force, shcd_scale(shcd_dot(force, t.normal), t.normal));
        across = fmax(across, shcd_norm(tangent));
        for (int axis = 0; axis < 3; axis++) {
            const shcd_vec3 u = {axis == 0, axis == 1, axis == 2};
            double slope[2];
            for (int k = 0; k < 2; k++) {
                const double step = h * (k + 1);
                shcdi_touch moved;
                slope[k] = 1.5 *
                           (contact(model, shcd_mul_add(c, step, u), radius, &moved) -
                            contact(model, shcd_mul_add(c, -step, u), radius, &moved)) /
                           (2.0 * step);
            }
            /* a central difference errs by a third of its change when the step is doubled; the
             * depth is certified to 1e-9 of the diagonal, so the energies to F 1.8e-10 m; at the
             * border of a kernel's blend the second derivative jumps: test_learned.c */
            const double bound = fabs(slope[1] - slope[0]) + 2e-10 * shcd_norm(force) / h +
                                 0.5 * h * 30.0 / (0.02 * 0.02) * energy;
            assert_near(shcd_dot(force, u), -slope[0], bound);
        }
    }
    assert_true(across > 0.01); /* [N]: there was something to see along the surface */
    shcd_model_free(model);
}

static void test_press_under_a_compliance_shares_the_depth(void **state) {
    const shcd_learned learned = network_by_hand(numbers);
    shcd_model *model = body(&learned);
    touch_effect e = touch_open("learned", NULL, 0);
    shcdi_touch t;
    (void)state;
    contact(model, shcd_vec3_make(0.0, 0.0, 0.032), 0.0, &t);
    for (int i = 0; i <= 6; i++) {
        const double w = i == 0 ? 0.0 : pow(10.0, i - 4);
        double stored_j;
        shcd_learned_output out;
        const double force = e.active.effect->press(e.active.constants, &t, 0.008, w, &stored_j);
        const double indentation = 0.008 - w * force;
        assert_int_equal(shcd_learned_evaluate(&learned, t.foot_m, indentation, &out), SHCD_OK);
        /* the root is found to 2^-50 of the depth; then a product of the stiffness, 1e3 at most */
        assert_near(force, out.force_n, 1e3 * 0.008 * 0x1p-48);
        assert_near(stored_j, out.energy_j, force * 0.008 * 0x1p-46);
    }
    shcd_model_free(model);
}

static void test_neutral_scale_gives_nothing(void **state) {
    const shcd_learned learned = network_by_hand(numbers);
    const shcd_parameter_value scale = {.name = "scale", .value = 0.0};
    shcd_model *model = body(&learned);
    touch_effect e = touch_open("learned", &scale, 1);
    shcdi_touch t;
    double stored_j;
    (void)state;
    contact(model, shcd_vec3_make(0.0, 0.02, 0.032), 0.0, &t);
    const shcd_vec3 force = force_of(&e, &t, &stored_j);
    assert_true(force.x == 0.0 && force.y == 0.0 && force.z == 0.0 && stored_j == 0.0);
    assert_true(touch_apply(&e, &t, 2.5).normal_force_n == 2.5);
    shcd_model_free(model);
}

static void test_outside_is_flagged_and_speeds_damp(void **state) {
    shcd_learned learned = network_by_hand(numbers);
    learned.damping_n_s_per_m2 = 50.0;
    shcd_model *model = body(&learned);
    touch_effect e = touch_open("learned", NULL, 0);
    const double *x = learned.centre_m;
    shcdi_touch t;
    shcd_proximity found;
    (void)state;
    /* the surface's point nearest to a centre is within the network's reach or flagged as outside
     */
    assert_int_equal(shcd_closest(model, shcd_vec3_make(x[0], x[1], x[2]), NULL, &found), SHCD_OK);
    contact(model, shcd_mul_add(found.point_m, -0.004, found.normal), 0.0, &t);
    t.depth_rate_m_per_s = 0.1;
    assert_near(touch_apply(&e, &t, 1.0).normal_force_n, 1.0 + 50.0 * t.depth_m * 0.1, 1e-15);
    t.depth_rate_m_per_s = -100.0; /* it does not pull */
    assert_true(touch_apply(&e, &t, 1.0).normal_force_n == 0.0);
    contact(model, shcd_mul_add(found.point_m, -0.0101, found.normal), 0.0, &t);
    assert_int_equal(touch_apply(&e, &t, 0.0).flags, SHCD_TOOL_OUTPUT_EXTRAPOLATED);
    shcd_model_free(model);
}

/* ---- in a scene ---- */

static shcd_status scene_of(const shcd_model *model, const char *second, shcd_scene **scene,
                            shcd_error *error) {
    shcd_effect_def effects[2] = {{.name = "learned"}, {.name = second}};
    shcd_body_def b = SHCD_BODY_DEF_INIT;
    shcd_tool_def tool = SHCD_TOOL_DEF_INIT;
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    b.name = "organ";
    b.model = model;
    b.effects = effects;
    b.n_effects = second != NULL ? 2 : 1;
    tool.name = "probe";
    tool.kind = SHCD_TOOL_SPHERE;
    tool.radius_m = 0.003;
    def.bodies = &b;
    def.n_bodies = 1;
    def.tools = &tool;
    def.n_tools = 1;
    return shcd_scene_create(&def, NULL, scene, error);
}

static void test_scene_without_a_network_is_refused(void **state) {
    const shcd_learned learned = network_by_hand(numbers);
    shcd_model *without = body(NULL), *with = body(&learned);
    shcd_scene *scene = NULL;
    shcd_error error;
    (void)state;
    assert_int_equal(scene_of(without, NULL, &scene, &error), SHCD_ERR_ARGUMENT);
    assert_non_null(strstr(error.message, "body 'organ': effect 'learned': its model has no"));
    assert_int_not_equal(scene_of(with, "wave", &scene, &error), SHCD_OK);
    assert_null(scene);
    shcd_model_free(without);
    shcd_model_free(with);
}

/* A state of the scene and its memory. */
typedef struct session {
    shcd_scene *scene;
    shcd_state *state;
    void *memory;
} session;

static session session_open(const shcd_model *model) {
    session s = {NULL, NULL, NULL};
    shcd_error error = {SHCD_OK, ""};
    if (scene_of(model, NULL, &s.scene, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    const size_t size = shcd_state_size(s.scene);
    s.memory = aligned_alloc(64, (size + 63) / 64 * 64);
    assert_int_equal(shcd_state_init(s.scene, s.memory, size, &s.state), SHCD_OK);
    return s;
}

static void session_close(session *s) {
    free(s->memory);
    shcd_scene_free(s->scene);
}

/* The ball of 3 mm goes down from 2 mm above the top of the body to 4 mm into it, at y. */
static shcd_tool_output session_press(const session *s, double y_m) {
    shcd_tool_input in;
    shcd_tool_output out;
    memset(&in, 0, sizeof in);
    in.flags = SHCD_TOOL_INPUT_ACTIVE;
    in.tool_in_world.orientation.w = 1.0;
    in.tool_in_world.position_m.y = y_m;
    shcd_input input;
    shcd_output output;
    memset(&input, 0, sizeof input);
    memset(&output, 0, sizeof output);
    input.dt_s = 0.001;
    input.tools = &in;
    input.n_tools = 1;
    output.tools = &out;
    output.n_tools = 1;
    for (int i = 0; i <= 60; i++) {
        in.tool_in_world.position_m.z = 0.045 - 1e-4 * i;
        assert_int_equal(shcd_step(s->scene, s->state, &input, &output), SHCD_OK);
    }
    return out;
}

static void test_step_gives_the_network_s_force(void **state) {
    const shcd_learned learned = network_by_hand(numbers);
    shcd_model *model = body(&learned);
    session s = session_open(model);
    (void)state;
    const shcd_tool_output out = session_press(&s, 0.0);
    shcd_learned_output expected;
    assert_int_equal(
        shcd_learned_evaluate(&learned, shcd_vec3_make(0.0, 0.0, 0.04), 0.004, &expected), SHCD_OK);
    /* the foot is found to the query's tolerance, 1e-9 of the diagonal */
    assert_near(out.wrench.force_n.z, expected.force_n, 1e-6 * expected.force_n);
    session_close(&s);
    shcd_model_free(model);
}

static void read_shape(const session *s, double coefficients[12]) {
    assert_int_equal(shcd_state_coefficients(s->scene, s->state, 0, coefficients, 12), SHCD_OK);
}

/* d(w) = -n sum_k q_k phi_k(w), in the coefficients of the surface; gone with the effect, and with
 * the tool. */
static void test_coefficients_show_the_dent(void **state) {
    const shcd_learned learned = network_by_hand(numbers);
    shcd_model *model = body(&learned);
    const double *rest = shcd_model_coefficients(model);
    const shcd_modes *modes = shcd_model_modes(model);
    session s = session_open(model);
    shcd_learned_output net;
    double y[4], phi[NETWORK_MODES] = {0.0, 0.0}, q[NETWORK_MODES], now[12];
    (void)state;
    assert_int_equal(shcd_scene_body_is_soft(s.scene, 0), 1);
    read_shape(&s, now);
    assert_memory_equal(now, rest, sizeof now);
    const shcd_tool_output out = session_press(&s, 0.012);
    const shcd_vec3 x = out.proxy_m;
    assert_int_equal(
        shcd_harmonics(1, shcd_vec3_make(x.x / 0.06, x.y / 0.05, x.z / 0.04), y, NULL, NULL),
        SHCD_OK);
    for (size_t i = 0; i < NETWORK_MODES * 4; i++) {
        phi[i / 4] += modes->coefficient_per_m[i] * y[i % 4];
    }
    assert_int_equal(shcd_learned_evaluate(&learned, x, out.penetration_m, &net), SHCD_OK);
    assert_int_equal(shcd_learned_dent(&learned, phi, net.force_n, out.penetration_m, q), SHCD_OK);
    read_shape(&s, now);
    const double n[3] = {out.normal.x, out.normal.y, out.normal.z};
    double largest = 0.0;
    for (size_t i = 0; i < 12; i++) {
        double sum = 0.0;
        for (size_t k = 0; k < NETWORK_MODES; k++) {
            sum += q[k] * modes->coefficient_per_m[4 * k + i / 3];
        }
        /* the depth of the message and that of the proxy: some roundings of 0.1 m, of 3 mm */
        assert_near(now[i] - rest[i], -n[i % 3] * sum, 1e-12 * fabs(sum) + 1e-16);
        largest = fmax(largest, fabs(sum));
    }
    print_message("dent: coefficients change by up to %.3g m\n", largest);
    assert_true(largest > 1e-6);
    assert_int_equal(shcd_state_switch(s.scene, s.state, 0, 0, 0.0), SHCD_OK);
    read_shape(&s, now);
    for (size_t i = 0; i < 12; i++) {
        assert_true(now[i] == rest[i]);
    }
    session_close(&s);
    shcd_model_free(model);
}

static void test_a_network_without_dents_shows_none(void **state) {
    shcd_learned learned = network_by_hand(numbers);
    learned.n_modes = 0;
    shcd_model *model = body(&learned);
    session s = session_open(model);
    double now[12];
    (void)state;
    assert_int_equal(shcd_scene_body_is_soft(s.scene, 0), 0);
    assert_true(session_press(&s, 0.0).wrench.force_n.z > 0.1);
    read_shape(&s, now);
    assert_memory_equal(now, shcd_model_coefficients(model), sizeof now);
    session_close(&s);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_force_is_minus_the_gradient_over_the_tool),
        cmocka_unit_test(test_press_under_a_compliance_shares_the_depth),
        cmocka_unit_test(test_neutral_scale_gives_nothing),
        cmocka_unit_test(test_outside_is_flagged_and_speeds_damp),
        cmocka_unit_test(test_scene_without_a_network_is_refused),
        cmocka_unit_test(test_step_gives_the_network_s_force),
        cmocka_unit_test(test_coefficients_show_the_dent),
        cmocka_unit_test(test_a_network_without_dents_shows_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
