/* SPDX-License-Identifier: BSD-3-Clause */
/* The tick on a virtual clock: what is published when, against the model called directly. */
#include "commands.h"
#include "shared.h"

#include "shcd/vec.h"
#include "shcdmsg_command_ack_t.h"
#include "shcdmsg_command_t.h"

#include "count_allocations.h"
#include "support/check.h"

#include <string.h>

#define MS ((int64_t)1000000)

/* ---- a daemon without threads -----------------------------------------------------------------
 */

static daemon_config config;
static shared *s;
static tick_core core;
static tick_record record;
static int64_t now_ns;
static int64_t next_seq;

static int set_up(void **state) {
    (void)state;
    char error[CONFIG_ERROR_SIZE];
    if (!config_built_in(&config, error, sizeof error)) {
        fprintf(stderr, "%s\n", error);
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
    return s != NULL && tick_init(&core, &config, s->poses, &s->commands, &s->applied) ? 0 : -1;
}

static int end(void **state) {
    (void)state;
    tick_free(&core);
    shared_free(s);
    return 0;
}

static const shcd_quat no_turn = {1.0, 0.0, 0.0, 0.0};

static tool_sample at(double x_m) {
    const tool_sample r = {.seq = next_seq,
                           .utime = 1000 * next_seq,
                           .recv_ns = now_ns,
                           .tool_in_world = {{x_m, 0.0, 0.0}, no_turn},
                           .valid = true,
                           .force_enable = true};
    next_seq++;
    return r;
}

static void send(size_t tool, const tool_sample *sample) {
    *(tool_sample *)mailbox_back(&s->poses[tool]) = *sample;
    mailbox_publish(&s->poses[tool]);
}

/* Advances the clock by a period, then ticks. */
static const tool_result *tick(void) {
    now_ns += core.period_ns;
    tick_run(&core, now_ns, 0, false, &record);
    return &record.tools[0];
}

/* Ticks with a new pose each time; returns the result of tool 0. */
static const tool_result *hold(double x_m, int n) {
    const tool_result *r = NULL;
    for (int i = 0; i < n; i++) {
        const tool_sample sample = at(x_m);
        send(0, &sample);
        r = tick();
    }
    return r;
}

/* The model's own answer for a tool at rest, by a state of the test's. */
static shcd_tool_output model_answer(double x_m) {
    _Alignas(64) static unsigned char memory[1 << 20];
    shcd_tool_input in[2] = {
        {.tool_in_world = {{x_m, 0.0, 0.0}, no_turn}, .flags = SHCD_TOOL_INPUT_ACTIVE},
        {.tool_in_world = {{0.0, 0.0, 0.0}, no_turn}}};
    shcd_tool_output out[2];
    shcd_state *own = NULL;
    const shcd_input input = {0.001, in, 2};
    shcd_output output = {out, 2};
    assert_true(shcd_state_size(config.scene) <= sizeof memory);
    assert_int_equal(shcd_state_init(config.scene, memory, sizeof memory, &own), SHCD_OK);
    for (int i = 0; i < 400; i++) { /* let a moving proxy come to rest */
        assert_int_equal(shcd_step(config.scene, own, &input, &output), SHCD_OK);
    }
    return out[0];
}

static double semi_axis_x_m(void) {
    /* S(1, 0, 0) of a degree-1 body: Y_11 = sqrt(3/(4 pi)) x */
    return shcd_model_coefficients(config.models[0])[3 * SHCD_INDEX(1, 1)] *
           sqrt(3.0 / (16.0 * atan(1.0)));
}

static double inside_m(void) {
    return semi_axis_x_m() - 0.002;
}

static bool same(shcd_vec3 a, shcd_vec3 b) {
    return memcmp(&a, &b, sizeof a) == 0;
}

/* ---- tests ------------------------------------------------------------------------------------
 */

static void test_tick_without_pose_is_inactive_and_sent_rarely(void **state) {
    (void)state;
    int due = 0;
    for (int i = 0; i < 1000; i++) {
        const tool_result *r = tick();
        assert_int_equal(r->seq, -1);
        assert_int_equal(r->age_ns, -1);
        assert_int_equal(r->body, -1);
        assert_true((r->flags & TICK_INACTIVE) != 0);
        assert_true(shcd_norm(r->wrench.force_n) == 0.0);
        due += r->due;
    }
    assert_int_equal(due, 10); /* every 100 ms of 1 s */
}

static void test_tick_held_tool_gives_the_model_force_bit_for_bit(void **state) {
    (void)state;
    const shcd_tool_output model = model_answer(inside_m());
    const tool_result *r = hold(inside_m(), 1000);
    assert_true(shcd_norm(model.wrench.force_n) > 0.1);
    assert_true(same(r->wrench.force_n, model.wrench.force_n));
    assert_true(same(r->wrench.torque_n_m, model.wrench.torque_n_m));
    assert_true(same(r->proxy_m, model.proxy_m));
    assert_true(r->penetration_m == model.penetration_m);
    assert_near(r->penetration_m, 0.002, 1e-12);
    assert_int_equal(r->flags, TICK_CONTACT);
    assert_int_equal(r->body, 0);
    assert_int_equal(r->seq, 1000);
    assert_int_equal(r->utime, 1000000);
    assert_true(r->due);
}

static void test_tick_first_pose_inside_starts_softly(void **state) {
    (void)state;
    const double full_n = model_answer(inside_m()).wrench.force_n.x;
    for (int k = 1; k <= 200; k++) {
        const tool_result *r = hold(inside_m(), 1);
        assert_at_most(r->wrench.force_n.x, full_n * k / 200.0 * (1.0 + 1e-9));
        assert_int_equal((r->flags & SAFETY_RAMP) != 0, k < 200);
    }
}

static void test_tick_deep_pose_is_clamped_to_the_device(void **state) {
    (void)state;
    const tool_result *r = hold(semi_axis_x_m() - 0.03, 400);
    assert_true((r->flags & SAFETY_LIMITED) != 0);
    assert_near(r->wrench.force_n.x, config.device->force_max_n, 1e-12);
    assert_near(shcd_norm(r->wrench.force_n), config.device->force_max_n, 1e-12);
}

static void test_watchdog_timeline_of_a_silent_client(void **state) {
    (void)state;
    tool_sample sample;
    hold(inside_m(), 300);
    const double full_n = record.tools[0].wrench.force_n.x;
    sample = at(inside_m());
    sample.velocity_m_per_s.x = -0.01;
    send(0, &sample); /* the last one: arrives now, age 1 ms at the next tick */
    for (int age_ms = 1; age_ms <= 700; age_ms++) {
        const tool_result *r = tick();
        const double f = r->wrench.force_n.x;
        assert_int_equal(r->age_ns, age_ms * MS);
        assert_int_equal((r->flags & TICK_STALE) != 0, age_ms > 20 && age_ms <= 500);
        assert_int_equal((r->flags & TICK_INACTIVE) != 0, age_ms > 500);
        assert_true(core.inputs[0].velocity_m_per_s.x == (age_ms <= 20 ? -0.01 : 0.0));
        if (age_ms > 20 && age_ms <= 50) { /* pose held, at rest: the force of a tool at rest */
            assert_near(f, full_n, 1e-12);
        } else if (age_ms > 50 && age_ms < 100) {
            assert_near(f, full_n * (1.0 - (age_ms - 50) / 50.0), 1e-9);
        } else if (age_ms >= 100) {
            assert_true(f == 0.0);
        }
        assert_int_equal((r->flags & TICK_CONTACT) != 0, age_ms <= 500);
    }
    const tool_result *r = hold(inside_m(), 1); /* back: softly */
    assert_true(r->wrench.force_n.x > 0.0);
    assert_at_most(r->wrench.force_n.x, full_n / 200.0 * (1.0 + 1e-9));
    r = hold(inside_m(), 300);
    assert_near(r->wrench.force_n.x, full_n, 0.0);
}

static void test_force_enable_off_lets_the_force_slew_to_zero(void **state) {
    (void)state;
    hold(inside_m(), 300);
    double last_n = record.tools[0].wrench.force_n.x;
    const double step_n = config.device->slew_max_n_per_s * 0.001;
    for (int k = 0; k < 20; k++) {
        tool_sample sample = at(inside_m());
        sample.force_enable = false;
        send(0, &sample);
        const tool_result *r = tick();
        assert_true((r->flags & TICK_DISABLED) != 0);
        assert_near(r->wrench.force_n.x, fmax(last_n - step_n, 0.0), 1e-12);
        last_n = r->wrench.force_n.x;
    }
    assert_true(last_n == 0.0);
    assert_true((hold(inside_m(), 1)->flags & SAFETY_RAMP) != 0);
}

static void test_stop_ramps_to_a_final_zero_within_50_ms(void **state) {
    (void)state;
    hold(inside_m(), 300);
    int ticks = 0;
    for (bool final = false; !final; ticks++) {
        now_ns += core.period_ns;
        final = tick_run(&core, now_ns, 0, true, &record);
        for (size_t i = 0; i < core.n_tools; i++) {
            assert_int_equal((record.tools[i].flags & TICK_FINAL) != 0, final);
            assert_true(!final || record.tools[i].due);
        }
        assert_true(ticks < 60);
    }
    assert_int_equal(ticks, 50);
    assert_true(shcd_norm(record.tools[0].wrench.force_n) == 0.0);
}

static void test_long_gap_degrades_and_recovers(void **state) {
    (void)state;
    hold(inside_m(), 300);
    const double full_n = record.tools[0].wrench.force_n.x;
    for (int gap = 20; gap <= 21; gap++) {
        now_ns += (gap + 1) * core.period_ns;
        const tool_sample sample = at(inside_m());
        send(0, &sample);
        tick_run(&core, now_ns, gap, false, &record);
        assert_int_equal((record.tools[0].flags & TICK_DEGRADED) != 0, gap > 20);
        assert_true((record.tools[0].flags & TICK_LATE) != 0);
    }
    const tool_result *r = hold(inside_m(), 60);
    assert_true(r->wrench.force_n.x == 0.0);
    r = hold(inside_m(), 439); /* 499 ms after the gap */
    assert_true((r->flags & TICK_DEGRADED) != 0);
    r = hold(inside_m(), 1);
    assert_true((r->flags & TICK_DEGRADED) == 0 && (r->flags & SAFETY_RAMP) != 0);
    r = hold(inside_m(), 300);
    assert_near(r->wrench.force_n.x, full_n, 0.0);
}

static shcdmsg_command_t command(int32_t op, int64_t id) {
    shcdmsg_command_t c = {0};
    c.client_id = 77;
    c.cmd_id = id;
    c.op = op;
    return c;
}

static bool take_confirmation(command_table *table, shcdmsg_command_ack_t *ack) {
    const tick_applied *applied = ring_peek(&s->applied);
    if (applied == NULL) {
        return false;
    }
    const bool send_it = commands_confirm(table, applied, ack);
    ring_release(&s->applied);
    return send_it;
}

static void test_zero_force_command_holds_until_enabled_again(void **state) {
    (void)state;
    static command_table table;
    shcdmsg_command_ack_t ack;
    memset(&table, 0, sizeof table);
    const shcdmsg_command_t c = command(SHCDMSG_COMMAND_T_ZERO_FORCE, 1);
    hold(inside_m(), 300);
    assert_false(commands_take(&table, &c, &s->commands, &ack));
    hold(inside_m(), 1);
    assert_true(take_confirmation(&table, &ack));
    assert_int_equal(ack.status, SHCDMSG_COMMAND_ACK_T_OK);
    assert_int_equal(ack.applied_tick, core.tick);
    const tool_result *r = hold(inside_m(), 49);
    assert_true(r->wrench.force_n.x == 0.0 && (r->flags & TICK_DISABLED) != 0);
    assert_true(hold(inside_m(), 1000)->wrench.force_n.x == 0.0);
    tool_sample off = at(inside_m());
    off.force_enable = false;
    send(0, &off);
    tick();
    assert_true(hold(inside_m(), 300)->wrench.force_n.x > 0.1);
}

static void test_reset_command_fades_clears_and_starts_softly(void **state) {
    (void)state;
    static command_table table;
    shcdmsg_command_ack_t ack;
    memset(&table, 0, sizeof table);
    const shcdmsg_command_t zero = command(SHCDMSG_COMMAND_T_ZERO_FORCE, 1);
    const shcdmsg_command_t reset = command(SHCDMSG_COMMAND_T_RESET, 2);
    hold(inside_m(), 300);
    const double full_n = record.tools[0].wrench.force_n.x;
    commands_take(&table, &zero, &s->commands, &ack);
    commands_take(&table, &reset, &s->commands, &ack);
    const int64_t before = core.tick;
    hold(inside_m(), 50);
    assert_true(take_confirmation(&table, &ack)); /* of zero force */
    assert_int_equal(ack.cmd_id, 1);
    assert_false(take_confirmation(&table, &ack));
    hold(inside_m(), 1);
    assert_true(take_confirmation(&table, &ack)); /* of the reset, once the force was zero */
    assert_int_equal(ack.cmd_id, 2);
    assert_int_equal(ack.applied_tick, before + 51);
    assert_true(record.tools[0].wrench.force_n.x > 0.0);
    assert_at_most(record.tools[0].wrench.force_n.x, full_n / 200.0 * (1.0 + 1e-9));
    assert_near(hold(inside_m(), 300)->wrench.force_n.x, full_n, 0.0);
}

static void test_commands_repeated_run_once_and_get_the_same_answer(void **state) {
    (void)state;
    static command_table table;
    shcdmsg_command_ack_t ack, again;
    memset(&table, 0, sizeof table);
    const shcdmsg_command_t c = command(SHCDMSG_COMMAND_T_ZERO_FORCE, 9);
    assert_false(commands_take(&table, &c, &s->commands, &ack));
    assert_false(commands_take(&table, &c, &s->commands, &ack)); /* still pending */
    tick();
    assert_true(take_confirmation(&table, &ack));
    assert_false(take_confirmation(&table, &again)); /* it ran once */
    assert_true(commands_take(&table, &c, &s->commands, &again));
    assert_memory_equal(&again, &ack, sizeof ack);
    assert_null(ring_peek(&s->commands));
}

static void test_commands_refusals_say_why(void **state) {
    (void)state;
    static command_table table;
    shcdmsg_command_ack_t ack;
    memset(&table, 0, sizeof table);
    shcdmsg_command_t c = command(42, 1);
    assert_true(commands_take(&table, &c, &s->commands, &ack));
    assert_int_equal(ack.status, SHCDMSG_COMMAND_ACK_T_NOT_SUPPORTED);
    assert_int_equal(ack.applied_tick, -1);
    assert_non_null(strstr((const char *)ack.text, "42"));
    const int32_t counts[] = {-1, 17, INT32_MAX, INT32_MIN};
    for (int i = 0; i < 4; i++) {
        c = command(SHCDMSG_COMMAND_T_RESET, 2 + i);
        c.n_val = counts[i];
        assert_true(commands_take(&table, &c, &s->commands, &ack));
        assert_int_equal(ack.status, SHCDMSG_COMMAND_ACK_T_BAD_ARG);
    }
    c = command(SHCDMSG_COMMAND_T_RESET, 10);
    c.n_val = 3;
    c.val[2] = (double)NAN;
    assert_true(commands_take(&table, &c, &s->commands, &ack));
    assert_int_equal(ack.status, SHCDMSG_COMMAND_ACK_T_BAD_ARG);
    assert_null(ring_peek(&s->commands));
}

static void test_commands_flood_answers_busy_and_forgets_nothing_pending(void **state) {
    (void)state;
    static command_table table;
    shcdmsg_command_ack_t ack;
    memset(&table, 0, sizeof table);
    shcdmsg_command_t waiting = command(SHCDMSG_COMMAND_T_ZERO_FORCE, -1);
    assert_false(commands_take(&table, &waiting, &s->commands, &ack));
    for (int i = 0; i < 3 * COMMANDS_REMEMBERED; i++) {
        const shcdmsg_command_t c = command(42, -2 - i);
        assert_true(commands_take(&table, &c, &s->commands, &ack));
    }
    tick();
    assert_true(take_confirmation(&table, &ack));
    assert_int_equal(ack.cmd_id, -1);

    int passed_on = 0, busy = 0, confirmed = 0;
    for (int64_t id = 0; id < 1000; id++) {
        const shcdmsg_command_t c = command(SHCDMSG_COMMAND_T_ZERO_FORCE, id);
        if (commands_take(&table, &c, &s->commands, &ack)) {
            assert_int_equal(ack.status, SHCDMSG_COMMAND_ACK_T_BUSY);
            busy++;
        } else {
            passed_on++;
        }
        if (id % 100 == 99) {
            tick();
            tick();
            while (take_confirmation(&table, &ack)) {
                confirmed++;
            }
        }
    }
    assert_int_equal(passed_on + busy, 1000);
    assert_int_equal(confirmed, passed_on);
    assert_int_equal(passed_on, 160); /* 16 in the queue, emptied ten times */
}

static void test_tick_same_input_same_bits(void **state) {
    (void)state;
    static tick_record first[500];
    check_random r = {11};
    double path[500];
    for (int i = 0; i < 500; i++) {
        path[i] = semi_axis_x_m() + check_uniform(&r, -0.004, 0.002);
    }
    for (int run = 0; run < 2; run++) {
        assert_int_equal(end(NULL), 0);
        assert_int_equal(begin(NULL), 0);
        memset(&record, 0, sizeof record);
        for (int i = 0; i < 500; i++) {
            hold(path[i], 1);
            if (run == 0) {
                first[i] = record;
            } else {
                assert_memory_equal(&first[i].tools[0].wrench, &record.tools[0].wrench,
                                    sizeof(shcd_wrench));
            }
        }
    }
}

static void test_tick_never_allocates(void **state) {
    (void)state;
#ifdef COUNTS_ALLOCATIONS
    command_table table = {0};
    shcdmsg_command_ack_t ack;
    const shcdmsg_command_t c = command(SHCDMSG_COMMAND_T_RESET, 1);
    void *volatile probe = malloc(1); /* proves that the count sees calls */
    const long at_start = n_allocations;
    assert_true(at_start > 0);
    commands_take(&table, &c, &s->commands, &ack);
    for (int i = 0; i < 500; i++) {
        const tool_sample sample = at(semi_axis_x_m() - 1e-5 * i);
        send(0, &sample);
        send(1, &sample);
        tick();
    }
    assert_int_equal(n_allocations, at_start);
    free(probe);
#else
    print_message("not counted: a sanitizer owns malloc in this build\n");
    skip();
#endif
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, begin, end)

int main(void) {
    const struct CMUnitTest tests[] = {
        TEST(test_tick_without_pose_is_inactive_and_sent_rarely),
        TEST(test_tick_held_tool_gives_the_model_force_bit_for_bit),
        TEST(test_tick_first_pose_inside_starts_softly),
        TEST(test_tick_deep_pose_is_clamped_to_the_device),
        TEST(test_watchdog_timeline_of_a_silent_client),
        TEST(test_force_enable_off_lets_the_force_slew_to_zero),
        TEST(test_stop_ramps_to_a_final_zero_within_50_ms),
        TEST(test_long_gap_degrades_and_recovers),
        TEST(test_zero_force_command_holds_until_enabled_again),
        TEST(test_reset_command_fades_clears_and_starts_softly),
        TEST(test_commands_repeated_run_once_and_get_the_same_answer),
        TEST(test_commands_refusals_say_why),
        TEST(test_commands_flood_answers_busy_and_forgets_nothing_pending),
        TEST(test_tick_same_input_same_bits),
        TEST(test_tick_never_allocates),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
