/* SPDX-License-Identifier: BSD-3-Clause */
/* A soft body in the daemon's tick, on a virtual clock: what viewers are shown of it and how often,
 * what its effects cost and hold, and switching them by command. */
#include "commands.h"
#include "deform.h"
#include "shared.h"

#include "support/network.h"
#include "support/soft.h"

#define RADIUS_M 0.05
#define DEGREE 6
#define COUNT (3 * SHCD_COUNT(DEGREE))
#define MS ((int64_t)1000000)

static daemon_config config;
static shared *s;
static tick_core core;
static tick_record record;
static int64_t now_ns;
static int64_t next_seq;

/* A ball of 5 cm with a learned response whose dents swell and shift the whole of it. */
static shcd_model *trained_ball(void) {
    static double numbers[NETWORK_NUMBERS];
    const shcd_learned learned = network_by_hand(numbers);
    const double eigenvalues[NETWORK_MODES] = {0.0, 800.0};
    const double rows[NETWORK_MODES * 4] = {20.0, 0.0, 0.0, 0.0, 0.0, 0.0, 20.0};
    const shcd_modes modes = {NETWORK_MODES, eigenvalues, rows, 0.03, 0.0, 5e-4, 0, 0};
    double coefficients[12];
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    bodies_ellipsoid_coefficients(RADIUS_M, RADIUS_M, RADIUS_M, coefficients);
    def.degree = 1;
    def.coefficients = coefficients;
    def.modes = &modes;
    def.learned = &learned;
    return shcd_model_create(&def, NULL, &model, NULL) == SHCD_OK ? model : NULL;
}

static int set_up(void **state) {
    static const shcd_parameter_value modes = {.name = "modes", .value = 49.0};
    const shcd_effect_def effects[3] = {
        {"stiffness", NULL, 0}, {"wave", &modes, 1}, {"damping", NULL, 0}};
    static const shcd_effect_def trained = {"learned", NULL, 0};
    shcd_body_def bodies[3];
    shcd_tool_def tool = fixture_tool("ball", 0.003);
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    shcd_error error = {SHCD_OK, ""};
    char text[CONFIG_ERROR_SIZE];
    (void)state;
    if (!config_built_in(&config, text, sizeof text)) {
        return -1;
    }
    config_free(&config);
    config.rate_hz = 1000.0;
    config.device = &device_profiles[0];
    config.reserve_j = device_reserve_j(config.device, config.rate_hz);
    config.models[0] = soft_sphere(RADIUS_M, DEGREE);
    config.models[1] = fixture_ellipsoid(0.01, 0.02, 0.03);
    config.models[2] = trained_ball();
    config.n_models = 3;
    bodies[0] = fixture_body("organ", config.models[0], fixture_pose(0.0, 0.0, 0.0), effects, 3);
    bodies[1] = fixture_body("stone", config.models[1], fixture_pose(1.0, 0.0, 0.0), effects, 1);
    bodies[2] =
        fixture_body("trained", config.models[2], fixture_pose(-1.0, 0.0, 0.0), &trained, 1);
    for (size_t b = 0; b < 3; b++) {
        config.body_in_world[b] = bodies[b].body_in_world;
    }
    def.bodies = bodies;
    def.n_bodies = 3;
    def.tools = &tool;
    def.n_tools = 1;
    if (shcd_scene_create(&def, NULL, &config.scene, &error) != SHCD_OK) {
        print_error("%s\n", error.message);
        return -1;
    }
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    config_free(&config);
    return 0;
}

static int begin(void **state) {
    (void)state;
    s = shared_create(&config);
    now_ns = 1000 * MS;
    next_seq = 1;
    if (s == NULL || !tick_init(&core, &config, s->poses, &s->commands, &s->applied)) {
        return -1;
    }
    core.deforms = &s->deforms;
    return 0;
}

static int end(void **state) {
    (void)state;
    tick_free(&core);
    shared_free(s);
    return 0;
}

/* Ticks with the ball's centre at a height over some x. */
static const tool_result *hold_at(double x_m, double z_m, int n) {
    for (int i = 0; i < n; i++) {
        tool_sample *sample = mailbox_back(&s->poses[0]);
        memset(sample, 0, sizeof *sample);
        sample->seq = next_seq;
        sample->utime = 1000 * next_seq++;
        sample->recv_ns = now_ns;
        sample->tool_in_world = fixture_pose(x_m, 0.0, z_m);
        sample->valid = true;
        sample->force_enable = true;
        mailbox_publish(&s->poses[0]);
        now_ns += core.period_ns;
        tick_run(&core, now_ns, 0, false, &record);
    }
    return &record.tools[0];
}

/* Over the organ's middle. */
static const tool_result *hold(double z_m, int n) {
    return hold_at(0.0, z_m, n);
}

static void test_viewers_see_the_dent_sixty_times_a_second(void **state) {
    double last[COUNT];
    int n_shapes = 0;
    int64_t last_tick = 0;
    (void)state;
    assert_int_equal(s->deforms.n_bodies, 3);
    assert_true(s->deforms.is_soft[0] && !s->deforms.is_soft[1] && s->deforms.is_soft[2]);
    memcpy(last, shcd_model_coefficients(config.models[0]), sizeof last);
    for (int i = 0; i < 600; i++) {
        bool fresh;
        const tool_result *r = hold(RADIUS_M + 0.001, 1);
        const deform_snapshot *shape = mailbox_front(&s->deforms.box[0], &fresh);
        if (fresh) {
            assert_int_equal(shape->tick, core.tick);
            assert_true(n_shapes == 0 || shape->tick - last_tick >= 17);
            assert_true(shape->tick - last_tick <= 18 || n_shapes == 0);
            last_tick = shape->tick;
            n_shapes++;
            memcpy(last, shape->coefficients, sizeof last);
        }
        assert_true(i < 300 || r->displacement_m > 2e-4);
    }
    assert_in_range(n_shapes, 33, 36);
    /* the dent: the body has been pushed down, and is smaller */
    const shcd_model *model = config.models[0];
    shcd_shape *shape;
    void *memory = aligned_alloc(64, (shcd_shape_size(model) + 63) / 64 * 64);
    assert_int_equal(shcd_shape_init(model, memory, shcd_shape_size(model), &shape), SHCD_OK);
    const double rest = deform_volume(model, shape, shcd_model_coefficients(model));
    const double now = deform_volume(model, shape, last);
    print_message("volume %.9g m^3 at rest, %.9g with the dent\n", rest, now);
    assert_near(rest, 4.0 / 3.0 * SOFT_PI * RADIUS_M * RADIUS_M * RADIUS_M, 1e-16);
    assert_true(now < rest - 1e-8);
    free(memory);
}

/* Random surfaces against the sum over a fine tessellation's tetrahedra, which errs by the square
 * of its spacing: the difference of two levels bounds it. */
static double tessellated(const shcd_model *model, int n) {
    double sum = 0.0;
    for (int face = 0; face < 6; face++) {
        for (int i = 0; i < n; i++) {
            for (int k = 0; k < n; k++) {
                shcd_vec3 p[4];
                for (int c = 0; c < 4; c++) {
                    const double a = tan(0.25 * SOFT_PI * (2.0 * (i + (c & 1)) / n - 1.0));
                    const double b = tan(0.25 * SOFT_PI * (2.0 * (k + (c >> 1)) / n - 1.0));
                    const double sign = face % 2 == 0 ? 1.0 : -1.0;
                    const shcd_vec3 w = face / 2 == 0   ? shcd_vec3_make(sign, sign * a, b)
                                        : face / 2 == 1 ? shcd_vec3_make(b, sign, sign * a)
                                                        : shcd_vec3_make(sign * a, b, sign);
                    assert_int_equal(shcd_model_surface(model, -1, w, &p[c], NULL, NULL), SHCD_OK);
                }
                sum +=
                    shcd_dot(p[0], shcd_cross(p[1], p[2])) + shcd_dot(p[1], shcd_cross(p[3], p[2]));
            }
        }
    }
    return sum / 6.0;
}

static void test_volume_is_that_inside(void **state) {
    check_random random = {21};
    (void)state;
    for (int n = 0; n < 3; n++) {
        double c[COUNT];
        shcd_model_def def = SHCD_MODEL_DEF_INIT;
        shcd_model *model = NULL;
        shcd_shape *shape;
        memcpy(c, shcd_model_coefficients(config.models[0]), sizeof c);
        for (size_t i = 3; i < COUNT; i++) {
            c[i] += 2e-4 * check_normal(&random);
        }
        def.degree = DEGREE;
        def.coefficients = c;
        assert_int_equal(shcd_model_create(&def, NULL, &model, NULL), SHCD_OK);
        void *memory = aligned_alloc(64, (shcd_shape_size(model) + 63) / 64 * 64);
        assert_int_equal(shcd_shape_init(model, memory, shcd_shape_size(model), &shape), SHCD_OK);
        const double exact = deform_volume(model, shape, c);
        const double coarse = tessellated(model, 40), fine = tessellated(model, 80);
        print_message("volume %.12g, tessellated %.12g, %.12g\n", exact, coarse, fine);
        assert_near(exact, fine + (fine - coarse) / 3.0, 0.05 * fabs(fine - coarse));
        free(memory);
        shcd_model_free(model);
    }
}

/* A trained body: viewers see its dent, and the message says where it was not trained. */
static void test_a_trained_body_dents_and_says_where_it_guesses(void **state) {
    const double *rest = shcd_model_coefficients(config.models[2]);
    bool fresh;
    (void)state;
    hold_at(-1.0, RADIUS_M + 0.004, 50);
    const deform_snapshot *shape = mailbox_front(&s->deforms.box[2], &fresh);
    assert_true(fresh);
    assert_memory_equal(shape->coefficients, rest, 12 * sizeof *rest);
    const tool_result *r = hold_at(-1.0, RADIUS_M - 0.001, 50);
    shape = mailbox_front(&s->deforms.box[2], &fresh);
    assert_true(fresh);
    assert_true((r->flags & TICK_CONTACT) != 0);
    /* which way is up to this network; by the network's formula: test_effect_learned.c */
    assert_true(fabs(shape->coefficients[2] - rest[2]) > 1e-6);
    const shcd_learned *l = shcd_model_learned(config.models[2]);
    shcd_learned_output out;
    assert_int_equal(shcd_learned_evaluate(l, shcd_vec3_make(0.0, 0.0, RADIUS_M), 0.004, &out),
                     SHCD_OK);
    assert_int_equal((r->flags & TICK_EXTRAPOLATED) != 0, out.flags != 0);
    r = hold_at(-1.0, RADIUS_M + 0.003 - l->depth_max_m - 0.001, 200); /* too deep */
    assert_true((r->flags & TICK_EXTRAPOLATED) != 0);
    r = hold_at(-1.0, RADIUS_M + 0.01, 200);
    assert_int_equal(r->flags & TICK_EXTRAPOLATED, 0);
}

static void test_effects_are_timed_and_hold_energy(void **state) {
    (void)state;
    hold(RADIUS_M + 0.001, 500);
    assert_int_equal(core.n_effects, 5);
    const tick_energy energy = tick_energy_of(&core);
    print_message("stored %.3g J; wave %.2f us a tick\n", energy.stored_j,
                  1e-3 * core.effect_times[1].sum_ns / 500.0);
    assert_true(energy.stored_j > 0.0);
    for (size_t e = 0; e < 3; e++) {
        assert_int_equal(core.effect_times[e].n, 500);
        assert_true(core.effect_times[e].is_active);
        /* the contacts' law is solved for together with the membrane, on the wave's account */
        assert_true(e == 0 || core.effect_times[e].sum_ns > 0.0);
        assert_true(core.effect_times[e].max_ns * 500.0 >= core.effect_times[e].sum_ns);
    }
    assert_false(core.effect_times[3].is_active); /* of the body that nobody touches */
    hold(0.2, 3000);
    assert_true(tick_energy_of(&core).stored_j < 1e-9 * energy.stored_j);
}

static shcdmsg_command_t set_effect(int64_t id, int32_t body, const char *name, double on,
                                    double ramp_s) {
    shcdmsg_command_t c = {.client_id = 5, .cmd_id = id, .op = SHCDMSG_COMMAND_T_SET_EFFECT};
    c.object_id = body;
    (void)snprintf((char *)c.name, sizeof c.name, "%s", name);
    c.n_val = 2;
    c.val[0] = on;
    c.val[1] = ramp_s;
    return c;
}

static void test_an_effect_is_switched_at_a_tick(void **state) {
    static command_table table;
    shcdmsg_command_ack_t ack;
    (void)state;
    memset(&table, 0, sizeof table);
    table.scene = config.scene;
    const double full_n = hold(RADIUS_M + 0.001, 600)->wrench.force_n.z;
    const shcdmsg_command_t off = set_effect(1, 0, "stiffness", 0.0, 0.1);
    assert_false(commands_take(&table, &off, &s->commands, &ack));
    const double next_n = hold(RADIUS_M + 0.001, 1)->wrench.force_n.z;
    const tick_applied *applied = ring_peek(&s->applied);
    assert_non_null(applied);
    assert_true(commands_confirm(&table, applied, &ack));
    ring_release(&s->applied);
    assert_int_equal(ack.status, SHCDMSG_COMMAND_ACK_T_OK);
    assert_int_equal(ack.applied_tick, core.tick);
    assert_true(next_n > 0.9 * full_n && next_n < full_n);
    assert_true(hold(RADIUS_M + 0.001, 150)->wrench.force_n.z == 0.0);
    const shcdmsg_command_t on = set_effect(2, 0, "stiffness", 1.0, 0.0);
    assert_false(commands_take(&table, &on, &s->commands, &ack));
    /* no ramp is shorter than 20 ticks, and no step above half of the slew limit's */
    const double step_n = 0.5 * config.device->slew_max_n_per_s * 1e-3;
    double last_n = 0.0;
    for (int i = 1; i <= 20; i++) {
        const double now_n = hold(RADIUS_M + 0.001, 1)->wrench.force_n.z;
        assert_near(core.effects[0].gain, i / 20.0, 1e-12);
        assert_true(fabs(now_n - last_n) <= step_n);
        last_n = now_n;
    }
    assert_near(hold(RADIUS_M + 0.001, 2000)->wrench.force_n.z, full_n, 1e-3 * full_n);
}

static void test_what_cannot_be_switched_is_refused(void **state) {
    static command_table table;
    const struct {
        shcdmsg_command_t command;
        const char *text;
    } cases[] = {
        {set_effect(1, 3, "wave", 0.0, 0.1), "object_id is 3, the scene has 3 bodies"},
        {set_effect(2, -1, "wave", 0.0, 0.1), "object_id is -1"},
        {set_effect(3, 1, "wave", 0.0, 0.1), "body 1 has no effect 'wave'"},
        {set_effect(4, 0, "wav", 0.0, 0.1), "no effect 'wav'"},
        {set_effect(5, 0, "wave", 0.5, 0.1), "val[0] must be 1 (on) or 0 (off)"},
        {set_effect(6, 0, "wave", 0.0, 61.0), "must be 0 to 60 s"},
        {set_effect(7, 0, "wave", 0.0, -1.0), "must be 0 to 60 s"},
    };
    (void)state;
    memset(&table, 0, sizeof table);
    table.scene = config.scene;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shcdmsg_command_ack_t ack;
        assert_true(commands_take(&table, &cases[i].command, &s->commands, &ack));
        assert_int_equal(ack.status, SHCDMSG_COMMAND_ACK_T_BAD_ARG);
        if (strstr((const char *)ack.text, cases[i].text) == NULL) {
            fail_msg("'%s' is not in '%s'", cases[i].text, (const char *)ack.text);
        }
        assert_null(ring_peek(&s->commands));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_viewers_see_the_dent_sixty_times_a_second, begin, end),
        cmocka_unit_test(test_volume_is_that_inside),
        cmocka_unit_test_setup_teardown(test_a_trained_body_dents_and_says_where_it_guesses, begin,
                                        end),
        cmocka_unit_test_setup_teardown(test_effects_are_timed_and_hold_energy, begin, end),
        cmocka_unit_test_setup_teardown(test_an_effect_is_switched_at_a_tick, begin, end),
        cmocka_unit_test_setup_teardown(test_what_cannot_be_switched_is_refused, begin, end),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
