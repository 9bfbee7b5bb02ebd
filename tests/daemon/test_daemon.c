/* SPDX-License-Identifier: BSD-3-Clause */
/* The real daemon over real LCM: run it in a network namespace, `netns.sh test_daemon SHCDD`.
 * Nothing here depends on how fast the machine is: what is late is counted by the daemon, and the
 * checks allow for what it counted. */
#include "daemon_peer.h"

#include "config.h"

#include "support/check.h"

#include <float.h>
#include <signal.h>
#include <string.h>

#define CONTACT_ONLY SHCDMSG_TOOL_FORCE_T_CONTACT

static const char *shcdd;
static daemon_config config; /* the same built-in scene, to know what is right */
static peer p;

static int set_up(void **state) {
    (void)state;
    char error[CONFIG_ERROR_SIZE];
    if (!config_built_in(&config, error, sizeof error)) {
        fprintf(stderr, "%s\n", error);
        return -1;
    }
    if (!peer_start(&p, shcdd)) {
        fprintf(stderr, "shcdd does not answer\n");
        return -1;
    }
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    peer_close(&p);
    config_free(&config);
    return 0;
}

static double semi_axis_m(int axis) {
    /* degree 1: Y_11, Y_1-1, Y_10 are sqrt(3/(4 pi)) times x, y, z */
    static const int order[3] = {1, -1, 0};
    const double *c = shcd_model_coefficients(config.models[0]);
    return c[3 * SHCD_INDEX(1, order[axis]) + (size_t)axis] * sqrt(3.0 / (16.0 * atan(1.0)));
}

static double stiffness_n_per_m(void) {
    const shcd_effect_info *effect;
    for (size_t i = 0; (effect = shcd_effect_at(i)) != NULL; i++) {
        for (size_t k = 0; k < effect->n_parameters; k++) {
            if (strcmp(effect->name, "stiffness") == 0 &&
                strcmp(effect->parameters[k].name, "k_n_per_m") == 0) {
                return effect->parameters[k].default_value;
            }
        }
    }
    fail_msg("no effect stiffness with k_n_per_m");
    return 0.0;
}

static double pressed_m(void) {
    return semi_axis_m(0) - 0.5 / stiffness_n_per_m(); /* 0.5 N */
}

static double force_norm(const shcdmsg_tool_force_t *m) {
    return sqrt(m->force[0] * m->force[0] + m->force[1] * m->force[1] + m->force[2] * m->force[2]);
}

/* ---- tests ------------------------------------------------------------------------------------
 */

static int compare(const void *a, const void *b) {
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

static void test_each_pose_is_answered(void **state) {
    (void)state;
    enum { n = 1000 };
    static int64_t round_trip_us[n];
    size_t answered = 0;
    p.n_forces = 0;
    for (int i = 0; i < n; i++) {
        const int64_t t = peer_ping(&p, 0.2, 0.0, 0.0, 100000);
        if (t >= 0) {
            assert_int_equal(p.last[0].tool_seq, p.seq - 1);
            assert_true(p.last[0].tool_utime > 0 && p.last[0].tool_utime <= peer_now_us());
            round_trip_us[answered++] = t;
        }
    }
    for (size_t i = 1; i < p.n_forces; i++) {
        assert_true(p.forces[i].tick > p.forces[i - 1].tick);
        assert_true(p.forces[i].utime > p.forces[i - 1].utime);
        assert_true(p.forces[i].tool_seq >= p.forces[i - 1].tool_seq);
    }
    qsort(round_trip_us, answered, sizeof round_trip_us[0], compare);
    assert_true(answered >= n * 99 / 100);
    print_message("answered %zu of %d, round trip p50/p99/max %lld/%lld/%lld us\n", answered, n,
                  (long long)round_trip_us[answered / 2],
                  (long long)round_trip_us[answered * 99 / 100],
                  (long long)round_trip_us[answered - 1]);
}

static void test_stream_of_poses_is_received(void **state) {
    (void)state;
    assert_true(peer_next_status(&p));
    const shcdmsg_loop_status_t before = p.status;
    const int sent = peer_hold(&p, 0.2, 0.0, 0.0, 2000);
    assert_true(peer_next_status(&p));
    const int64_t received = p.status.rx_ok - before.rx_ok;
    assert_true(received <= sent && (double)received >= 0.99 * sent);
    assert_int_equal(p.status.rx_bad, before.rx_bad);
    assert_true(p.status.rx_lost - before.rx_lost <= sent - received);
}

static void test_every_tick_is_published_once(void **state) {
    (void)state;
    peer_hold(&p, 0.2, 0.0, 0.0, 10);
    p.n_forces = 0;
    peer_hold(&p, 0.2, 0.0, 0.0, 1000);
    const int64_t ticks = p.forces[p.n_forces - 1].tick - p.forces[0].tick + 1;
    assert_true((double)p.n_forces >= 0.99 * (double)ticks);
    assert_true((int64_t)p.n_forces <= ticks);
}

static void test_held_tool_feels_stiffness_times_depth_on_every_axis(void **state) {
    (void)state;
    const double k = stiffness_n_per_m();
    for (int i = 0; i < 6; i++) {
        const int axis = i / 2;
        const double sign = i % 2 == 0 ? 1.0 : -1.0;
        const double depth_m = (0.3 + 0.1 * i) / k; /* 0.3 to 0.8 N */
        double x[3] = {0.0, 0.0, 0.0};
        x[axis] = sign * (semi_axis_m(axis) - depth_m);
        /* leave where it came in, and come from outside by a way round the body: a tool whose way
         * leads through it is held on the side where it went in */
        peer_hold(&p, 2.0 * p.last[0].proxy[0], 2.0 * p.last[0].proxy[1], 2.0 * p.last[0].proxy[2],
                  50);
        peer_hold(&p, 0.3, 0.3, 0.3, 50);
        peer_hold(&p, 2.0 * x[0], 2.0 * x[1], 2.0 * x[2], 50);
        for (int run = 0; run < 5; run++) { /* again if a tick or a pose was late just then */
            peer_hold(&p, x[0], x[1], x[2], 1000);
            if (p.last[0].flags == CONTACT_ONLY) {
                break;
            }
        }
        const shcdmsg_tool_force_t *m = &p.last[0];
        assert_int_equal(m->flags, CONTACT_ONLY);
        assert_int_equal(m->body_id, 0);
        /* the query's own promise: 1e-9 of the diagonal (0.22 m), times k */
        const double tolerance_m = 1e-9 * 0.25;
        assert_near(m->penetration, depth_m, tolerance_m);
        for (int j = 0; j < 3; j++) {
            assert_near(m->normal[j], j == axis ? sign : 0.0, 1e-6);
            assert_near(m->force[j], j == axis ? sign * k * depth_m : 0.0, 1e-6);
            assert_near(m->proxy[j], j == axis ? sign * semi_axis_m(axis) : 0.0, 1e-6);
        }
    }
}

static void test_outside_there_is_no_force(void **state) {
    (void)state;
    peer_hold(&p, semi_axis_m(0) + 0.01, 0.0, 0.0, 400);
    assert_true(force_norm(&p.last[0]) == 0.0);
    assert_true(p.last[0].penetration == 0.0);
    assert_true((p.last[0].flags & SHCDMSG_TOOL_FORCE_T_CONTACT) == 0);
}

static void test_silent_client_loses_its_force(void **state) {
    (void)state;
    peer_hold(&p, pressed_m(), 0.0, 0.0, 500);
    assert_true(force_norm(&p.last[0]) > 0.4);
    p.n_forces = 0;
    peer_listen(&p, peer_now_us() + 900000);
    bool seen_stale = false, seen_inactive = false;
    for (size_t i = 0; i < p.n_forces; i++) {
        const shcdmsg_tool_force_t *m = &p.forces[i];
        const bool stale = (m->flags & SHCDMSG_TOOL_FORCE_T_STALE) != 0;
        const bool inactive = (m->flags & SHCDMSG_TOOL_FORCE_T_INACTIVE) != 0;
        /* age_us is cut to whole microseconds, hence the gaps of one */
        assert_true(m->age_us < 20000 ? !stale : m->age_us <= 20000 || stale || inactive);
        assert_int_equal(inactive, m->age_us >= 500001 || (m->age_us == 500000 && inactive));
        /* 50 ms of ramp, and as much again for what missed ticks may delay it */
        assert_true(m->age_us < 150000 || force_norm(m) == 0.0);
        seen_stale = seen_stale || stale;
        seen_inactive = seen_inactive || inactive;
    }
    assert_true(seen_stale && seen_inactive);
    peer_hold(&p, pressed_m(), 0.0, 0.0, 1);
    assert_true(force_norm(&p.last[0]) < 0.1); /* soft start */
    peer_hold(&p, pressed_m(), 0.0, 0.0, 500);
    assert_true(force_norm(&p.last[0]) > 0.4);
}

static void send_raw(const shcdmsg_tool_pose_t *m, int change_of_size) {
    unsigned char bytes[256] = {0};
    const int size = shcdmsg_tool_pose_t_encode(bytes, 0, sizeof bytes, m);
    lcm_publish(p.lcm, "SHCD_TOOL", bytes, (unsigned)(size + change_of_size));
}

static void test_bad_messages_are_counted_and_harmless(void **state) {
    (void)state;
    enum { n_each = 50 };
    peer_hold(&p, pressed_m(), 0.0, 0.0, 500);
    assert_true(peer_next_status(&p));
    const shcdmsg_loop_status_t before = p.status;
    p.n_forces = 0;
    for (int i = 0; i < n_each; i++) {
        shcdmsg_tool_pose_t m = peer_pose(&p, (double)NAN, 0.0, 0.0);
        peer_send(&p, &m);
        m = peer_pose(&p, 0.0, 101.0, 0.0);
        peer_send(&p, &m);
        m = peer_pose(&p, 0.0, 0.0, 0.0);
        m.flags |= SHCDMSG_TOOL_POSE_T_HAS_QUAT;
        peer_send(&p, &m);
        m = peer_pose(&p, 0.0, 0.0, 0.0);
        m.tool_id = 250;
        peer_send(&p, &m);
        m = peer_pose(&p, 0.0, 0.0, 0.0);
        send_raw(&m, i % 2 == 0 ? 1 : -1);
        lcm_publish(p.lcm, "SHCD_TOOL", "", 0);
        peer_hold(&p, pressed_m(), 0.0, 0.0, 2);
    }
    assert_true(peer_next_status(&p));
    static const struct {
        int reason, factor;
    } expected[] = {{SHCDMSG_LOOP_STATUS_T_REJECT_NOT_FINITE, 1},
                    {SHCDMSG_LOOP_STATUS_T_REJECT_RANGE, 1},
                    {SHCDMSG_LOOP_STATUS_T_REJECT_QUATERNION, 1},
                    {SHCDMSG_LOOP_STATUS_T_REJECT_TOOL_ID, 1},
                    {SHCDMSG_LOOP_STATUS_T_REJECT_SIZE, 2}};
    for (size_t i = 0; i < sizeof expected / sizeof expected[0]; i++) {
        const int64_t n =
            p.status.rx_reject[expected[i].reason] - before.rx_reject[expected[i].reason];
        assert_true(n <= expected[i].factor * n_each); /* UDP may lose a few */
        assert_true(n >= expected[i].factor * n_each * 9 / 10);
    }
    assert_int_equal(p.status.rx_reject[SHCDMSG_LOOP_STATUS_T_REJECT_OLD],
                     before.rx_reject[SHCDMSG_LOOP_STATUS_T_REJECT_OLD]);
    assert_true(p.n_forces > 0);
    for (size_t i = 0; i < p.n_forces; i++) {
        assert_true(force_norm(&p.forces[i]) <= 0.5 + 1e-6); /* false for NaN */
    }
    assert_true(peer_hold(&p, pressed_m(), 0.0, 0.0, 500) > 0);
    assert_near(force_norm(&p.last[0]), 0.5, 1e-6);
}

static void test_commands_are_acknowledged(void **state) {
    (void)state;
    shcdmsg_command_t c = {0};
    c.client_id = peer_now_us();
    peer_hold(&p, pressed_m(), 0.0, 0.0, 500);

    c.op = SHCDMSG_COMMAND_T_ZERO_FORCE;
    c.cmd_id = 1;
    assert_true(peer_command(&p, &c));
    assert_int_equal(p.ack.status, SHCDMSG_COMMAND_ACK_T_OK);
    const int64_t applied = p.ack.applied_tick;
    assert_true(applied > 0 && applied <= p.last[0].tick);
    peer_hold(&p, pressed_m(), 0.0, 0.0, 500);
    assert_true(force_norm(&p.last[0]) == 0.0);
    assert_true((p.last[0].flags & SHCDMSG_TOOL_FORCE_T_DISABLED) != 0);

    assert_true(peer_command(&p, &c)); /* again: the same answer, nothing new is run */
    assert_int_equal(p.ack.applied_tick, applied);

    c.op = SHCDMSG_COMMAND_T_RESET;
    c.cmd_id = 2;
    assert_true(peer_command(&p, &c));
    assert_int_equal(p.ack.status, SHCDMSG_COMMAND_ACK_T_OK);
    assert_true(p.ack.applied_tick > applied);
    peer_hold(&p, pressed_m(), 0.0, 0.0, 500);
    assert_near(force_norm(&p.last[0]), 0.5, 1e-6);

    c.op = 999;
    c.cmd_id = 3;
    assert_true(peer_command(&p, &c));
    assert_int_equal(p.ack.status, SHCDMSG_COMMAND_ACK_T_NOT_SUPPORTED);
    assert_true(p.ack.text[0] != '\0' && p.ack.text[127] == '\0');
}

static void test_stalled_daemon_skips_ramps_down_and_recovers(void **state) {
    (void)state;
    peer_hold(&p, pressed_m(), 0.0, 0.0, 500);
    assert_true(peer_next_status(&p));
    const shcdmsg_loop_status_t before = p.status;
    p.n_forces = 0;
    kill(p.pid, SIGSTOP);
    peer_listen(&p, peer_now_us() + 100000);
    kill(p.pid, SIGCONT);
    peer_hold(&p, pressed_m(), 0.0, 0.0, 300);
    bool degraded = false;
    for (size_t i = 0; i < p.n_forces; i++) {
        const int32_t both = SHCDMSG_TOOL_FORCE_T_DEGRADED | SHCDMSG_TOOL_FORCE_T_LATE;
        degraded = degraded || (p.forces[i].flags & both) == both;
    }
    /* no burst: one tick serves all the grid points that were missed */
    const shcdmsg_tool_force_t *last = &p.forces[p.n_forces - 1];
    assert_true(1000 * (last->tick - p.forces[0].tick) <= last->utime - p.forces[0].utime + 1000);
    assert_true(degraded);
    assert_true(force_norm(&p.last[0]) == 0.0);
    peer_hold(&p, pressed_m(), 0.0, 0.0, 1000); /* 0.5 s without a gap, then a soft start */
    assert_true(peer_next_status(&p));
    assert_true(p.status.missed_ticks - before.missed_ticks >= 90);
    assert_true(p.status.missed_events > before.missed_events);
    /* the stop is nobody's CPU time: of the missed events it is the one without an overrun (there
     * may be overruns, for what a host takes within a tick looks like the tick's own time) */
    assert_true(p.status.self_overruns - before.self_overruns <
                p.status.missed_events - before.missed_events);
}

static int64_t sum(const int64_t *values, int n) {
    int64_t total = 0;
    for (int i = 0; i < n; i++) {
        total += values[i];
    }
    return total;
}

static void test_status_accounts_for_every_grid_point(void **state) {
    (void)state;
    assert_true(peer_next_status(&p));
    const shcdmsg_loop_status_t first = p.status;
    const int64_t n_status = p.n_status, n_deform = p.n_deform;
    const int64_t begin_us = peer_now_us();
    peer_hold(&p, pressed_m(), 0.0, 0.0, 2000);
    assert_true(peer_next_status(&p));
    const double elapsed_s = 1e-6 * (double)(p.status.utime - first.utime);
    const int64_t ticks = p.status.tick - first.tick;
    const int64_t missed = p.status.missed_ticks - first.missed_ticks;
    /* both ends lie less than a period after their grid points */
    assert_near((double)(ticks + missed), elapsed_s * config.rate_hz, 1.0);
    assert_near(p.status.nominal_rate_hz, config.rate_hz, 0.0);
    assert_int_equal(sum(p.status.wake_hist, 32), p.status.tick);
    assert_int_equal(sum(p.status.compute_hist, 32), p.status.tick);
    assert_true(p.status.wake_p50_us <= p.status.wake_p99_us);
    assert_true(p.status.wake_p99_us <= p.status.wake_p999_us);
    assert_true(p.status.wake_p999_us <= p.status.wake_max_us);
    assert_true(p.status.compute_p50_us > 0.0);
    assert_int_equal(p.status.n_effects, shcd_scene_effect_count(config.scene));
    assert_int_equal(p.status.rx_bad, sum(p.status.rx_reject, 10));
    /* 10 Hz at most, one more for each end of the interval */
    const double listened_s = 1e-6 * (double)(peer_now_us() - begin_us);
    assert_true((double)(p.n_status - n_status) <= 10.0 * listened_s + 2.0);
    assert_true((double)(p.n_deform - n_deform) <= 10.0 * listened_s + 2.0);
    assert_true(p.n_status - n_status >= 5 && p.n_deform - n_deform >= 5);
    print_message("wake p50/p99/max %.0f/%.0f/%.0f us, compute p50/p99 %.0f/%.0f us, "
                  "%lld of %lld ticks missed, rt_flags %d\n",
                  p.status.wake_p50_us, p.status.wake_p99_us, p.status.wake_max_us,
                  p.status.compute_p50_us, p.status.compute_p99_us,
                  (long long)p.status.missed_ticks, (long long)p.status.tick, p.status.rt_flags);
}

static void test_deform_shows_the_body(void **state) {
    (void)state;
    const double *c = shcd_model_coefficients(config.models[0]);
    assert_int_equal(p.deform.body_id, 0);
    assert_int_equal(p.deform.degree, 1);
    assert_int_equal(p.deform.model_degree, 1);
    assert_int_equal(p.deform.n, 12);
    assert_string_equal((const char *)p.deform.name, shcd_scene_body_name(config.scene, 0));
    assert_near(p.deform.quat[0], config.body_in_world[0].orientation.w, 0.0);
    for (int i = 0; i < 12; i++) {
        assert_true(p.coefficients[i] == (float)c[i]);
    }
}

static void test_sigterm_ends_with_a_published_zero(void **state) {
    (void)state;
    peer_hold(&p, pressed_m(), 0.0, 0.0, 500);
    assert_true(force_norm(&p.last[0]) > 0.4);
    p.n_forces = 0;
    const int64_t begin_us = peer_now_us();
    assert_int_equal(peer_stop(&p, SIGTERM), 0);
    const int64_t took_us = peer_now_us() - begin_us;
    peer_listen(&p, peer_now_us() + 200000); /* what is still queued here */
    assert_true(p.n_forces > 0);
    for (int i = 0; i < 2; i++) {
        assert_true((p.last[i].flags & SHCDMSG_TOOL_FORCE_T_FINAL) != 0);
        assert_true(force_norm(&p.last[i]) == 0.0);
    }
    /* ramping, not cutting: no step between two ticks above the ramp's */
    for (size_t i = 1; i < p.n_forces; i++) {
        const int64_t ticks = p.forces[i].tick - p.forces[i - 1].tick;
        const bool late = (p.forces[i].flags & SHCDMSG_TOOL_FORCE_T_LATE) != 0;
        assert_true(late || force_norm(&p.forces[i - 1]) - force_norm(&p.forces[i]) <=
                                0.5 / 50.0 * (double)ticks + 1e-6);
    }
    print_message("ended after %lld ms\n", (long long)(took_us / 1000));
}

static void test_bad_usage_and_failures_have_their_exit_status(void **state) {
    (void)state;
    static const struct {
        const char *argument;
        int status;
    } cases[] = {{"--nonsense", 2},
                 {"--duration=fast", 2},
                 {"--priority=100", 2},
                 {"--channel-prefix=", 2},
                 {"/nonexistent/scene.yaml", 1},
                 {"--lcm-url=nonsense://", 1},
                 {"--help", 0},
                 {"--version", 0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[8192], argument[64], name[] = "shcdd";
        snprintf(argument, sizeof argument, "%s", cases[i].argument);
        char *const argv[] = {name, argument, NULL};
        assert_int_equal(peer_run(shcdd, argv, text, sizeof text), cases[i].status);
        assert_true(strlen(text) > 0);
        if (cases[i].status == 1) { /* one line */
            assert_ptr_equal(strchr(text, '\n'), text + strlen(text) - 1);
        }
    }
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bad_usage_and_failures_have_their_exit_status),
        cmocka_unit_test(test_each_pose_is_answered),
        cmocka_unit_test(test_stream_of_poses_is_received),
        cmocka_unit_test(test_every_tick_is_published_once),
        cmocka_unit_test(test_held_tool_feels_stiffness_times_depth_on_every_axis),
        cmocka_unit_test(test_outside_there_is_no_force),
        cmocka_unit_test(test_silent_client_loses_its_force),
        cmocka_unit_test(test_bad_messages_are_counted_and_harmless),
        cmocka_unit_test(test_commands_are_acknowledged),
        cmocka_unit_test(test_stalled_daemon_skips_ramps_down_and_recovers),
        cmocka_unit_test(test_status_accounts_for_every_grid_point),
        cmocka_unit_test(test_deform_shows_the_body),
        cmocka_unit_test(test_sigterm_ends_with_a_published_zero),
    };
    if (argc != 2) {
        fprintf(stderr, "usage: test_daemon SHCDD\n");
        return 2;
    }
    shcdd = argv[1];
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
