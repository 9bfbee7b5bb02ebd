/* SPDX-License-Identifier: BSD-3-Clause */
/* What the border lets in: every reason for a rejection on raw bytes, the sequence rules, the
 * velocity filter's closed form, and the way through real LCM in memory. */
#include "messages.h"
#include "transport.h"

#include "shcdmsg_loop_status_t.h"
#include "shcdmsg_tool_force_t.h"
#include "shcdmsg_tool_pose_t.h"

#include "support/check.h"

#include <float.h>
#include <string.h>

#define MS ((int64_t)1000000)

static daemon_config config;
static tool_track tracks[SHCD_TOOLS_MAX];
static rx_counters counters;
static size_t tool;
static tool_sample sample;

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

static int forget(void **state) {
    (void)state;
    memset(tracks, 0, sizeof tracks);
    memset(&counters, 0, sizeof counters);
    memset(&sample, 0, sizeof sample);
    tool = 99;
    return 0;
}

static shcdmsg_tool_pose_t pose(int64_t seq) {
    shcdmsg_tool_pose_t m = {0};
    m.utime = 1000 * seq;
    m.seq = seq;
    m.flags = SHCDMSG_TOOL_POSE_T_FORCE_ENABLE;
    return m;
}

static reject_reason offer_at(const shcdmsg_tool_pose_t *m, int64_t now_ns) {
    unsigned char bytes[256];
    const int size = shcdmsg_tool_pose_t_encode(bytes, 0, sizeof bytes, m);
    assert_true(size > 0);
    return messages_pose(bytes, (uint32_t)size, &config, now_ns, tracks, &counters, &tool, &sample);
}

static reject_reason offer(const shcdmsg_tool_pose_t *m) {
    return offer_at(m, m->seq * MS);
}

static int64_t counted(reject_reason reason) {
    return atomic_load(&counters.reject[reason]);
}

static void test_pose_good_message_arrives_unchanged(void **state) {
    (void)state;
    shcdmsg_tool_pose_t m = pose(5);
    m.tool_id = 1;
    m.flags |= SHCDMSG_TOOL_POSE_T_HAS_VEL;
    m.pos[0] = 0.1;
    m.pos[1] = -100.0;
    m.pos[2] = 1.0 / 3.0;
    m.vel[2] = 100.0;
    assert_int_equal(offer(&m), REJECT_NONE);
    assert_int_equal(tool, 1);
    assert_true(sample.valid && sample.force_enable);
    assert_true(sample.tool_in_world.position_m.x == 0.1);
    assert_true(sample.tool_in_world.position_m.y == -100.0);
    assert_true(sample.tool_in_world.position_m.z == 1.0 / 3.0);
    assert_true(sample.tool_in_world.orientation.w == 1.0);
    assert_true(sample.velocity_m_per_s.z == 100.0);
    assert_int_equal(sample.seq, 5);
    assert_int_equal(sample.utime, 5000);
    assert_int_equal(sample.recv_ns, 5 * MS);
    assert_int_equal(atomic_load(&counters.ok), 1);
}

static void test_pose_wrong_size_is_rejected(void **state) {
    (void)state;
    unsigned char bytes[256] = {0};
    const shcdmsg_tool_pose_t m = pose(1);
    const uint32_t size = (uint32_t)shcdmsg_tool_pose_t_encode(bytes, 0, sizeof bytes, &m);
    const uint32_t sizes[] = {0, 1, 8, size - 1, size + 1, 256, UINT32_MAX};
    const size_t n = sizeof sizes / sizeof sizes[0];
    for (size_t i = 0; i < n; i++) {
        assert_int_equal(
            messages_pose(bytes, sizes[i], &config, 0, tracks, &counters, &tool, &sample),
            REJECT_SIZE);
    }
    assert_int_equal(counted(REJECT_SIZE), n);
    assert_int_equal(tool, 99);
}

static void test_pose_other_fingerprint_is_rejected(void **state) {
    (void)state;
    unsigned char bytes[256] = {0};
    const shcdmsg_tool_pose_t m = pose(1);
    const uint32_t size = (uint32_t)shcdmsg_tool_pose_t_encode(bytes, 0, sizeof bytes, &m);
    bytes[3] ^= 1;
    assert_int_equal(messages_pose(bytes, size, &config, 0, tracks, &counters, &tool, &sample),
                     REJECT_TYPE);
    assert_int_equal(counted(REJECT_TYPE), 1);
}

static void test_pose_not_finite_is_rejected_in_every_field(void **state) {
    (void)state;
    const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    for (size_t k = 0; k < 3; k++) {
        for (size_t i = 0; i < 10; i++) {
            shcdmsg_tool_pose_t m = pose(1);
            double *field = i < 3 ? &m.pos[i] : i < 7 ? &m.quat[i - 3] : &m.vel[i - 7];
            *field = bad[k];
            assert_int_equal(offer(&m), REJECT_NOT_FINITE);
        }
    }
    assert_int_equal(counted(REJECT_NOT_FINITE), 30);
}

static void test_pose_out_of_range_is_rejected(void **state) {
    (void)state;
    shcdmsg_tool_pose_t m = pose(1);
    m.pos[1] = nextafter(100.0, 200.0);
    assert_int_equal(offer(&m), REJECT_RANGE);
    m = pose(1);
    m.vel[0] = -nextafter(100.0, 200.0);
    assert_int_equal(offer(&m), REJECT_NONE); /* not flagged: not read */
    m.seq = 2;
    m.flags |= SHCDMSG_TOOL_POSE_T_HAS_VEL;
    assert_int_equal(offer(&m), REJECT_RANGE);
    m = pose(3);
    m.pos[2] = DBL_MAX;
    assert_int_equal(offer(&m), REJECT_RANGE);
    m = pose(-1);
    assert_int_equal(offer_at(&m, 0), REJECT_RANGE);
    m = pose(4);
    m.utime = INT64_MIN;
    assert_int_equal(offer(&m), REJECT_RANGE);
    m.utime = INT64_MAX;
    assert_int_equal(offer(&m), REJECT_RANGE);
    m = pose(4);
    m.seq = INT64_MAX;
    assert_int_equal(offer_at(&m, 0), REJECT_RANGE);
    assert_int_equal(counted(REJECT_RANGE), 7);
}

static void test_pose_quaternion_must_have_norm_one(void **state) {
    (void)state;
    const double bad[] = {0.0, 0.9985, 1.0015, 1e200, DBL_MAX};
    shcdmsg_tool_pose_t m = pose(1);
    m.flags |= SHCDMSG_TOOL_POSE_T_HAS_QUAT;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        m.quat[0] = 0.6 * bad[i];
        m.quat[3] = 0.8 * bad[i];
        assert_int_equal(offer(&m), REJECT_QUATERNION);
    }
    m.quat[0] = 0.6 * 1.0009;
    m.quat[3] = 0.8 * 1.0009;
    assert_int_equal(offer(&m), REJECT_NONE);
    assert_near(sample.tool_in_world.orientation.w, 0.6, 4 * DBL_EPSILON);
    assert_near(sample.tool_in_world.orientation.z, 0.8, 4 * DBL_EPSILON);
    assert_int_equal(counted(REJECT_QUATERNION), 5);
}

static void test_pose_unknown_tool_is_rejected(void **state) {
    (void)state;
    const int32_t ids[] = {2, -1, INT32_MAX, INT32_MIN};
    for (size_t i = 0; i < 4; i++) {
        shcdmsg_tool_pose_t m = pose(1);
        m.tool_id = ids[i];
        assert_int_equal(offer(&m), REJECT_TOOL_ID);
    }
    assert_int_equal(counted(REJECT_TOOL_ID), 4);
}

static void test_pose_duplicates_and_old_ones_are_rejected(void **state) {
    (void)state;
    shcdmsg_tool_pose_t m = pose(10);
    assert_int_equal(offer_at(&m, 100 * MS), REJECT_NONE);
    assert_int_equal(offer_at(&m, 101 * MS), REJECT_DUPLICATE);
    m.seq = 9;
    assert_int_equal(offer_at(&m, 102 * MS), REJECT_OLD);
    m.tool_id = 1; /* each tool has its own sequence */
    assert_int_equal(offer_at(&m, 103 * MS), REJECT_NONE);
    assert_int_equal(counted(REJECT_DUPLICATE), 1);
    assert_int_equal(counted(REJECT_OLD), 1);
}

static void test_pose_restarted_client_is_heard_after_a_silence(void **state) {
    (void)state;
    shcdmsg_tool_pose_t m = pose(1000);
    assert_int_equal(offer_at(&m, 0), REJECT_NONE);
    m.seq = 0;
    assert_int_equal(offer_at(&m, MESSAGES_RESTART_NS), REJECT_OLD);
    assert_int_equal(offer_at(&m, MESSAGES_RESTART_NS + 1), REJECT_NONE);
    m.seq = 1;
    assert_int_equal(offer_at(&m, MESSAGES_RESTART_NS + 2), REJECT_NONE);
    assert_int_equal(atomic_load(&counters.lost), 0);
}

static void test_pose_gap_counts_lost_messages(void **state) {
    (void)state;
    const int64_t sequence[] = {3, 4, 7, 8, 20};
    for (size_t i = 0; i < 5; i++) {
        const shcdmsg_tool_pose_t m = pose(sequence[i]);
        assert_int_equal(offer(&m), REJECT_NONE);
    }
    assert_int_equal(atomic_load(&counters.lost), 2 + 11);
    assert_int_equal(atomic_load(&counters.ok), 5);
}

static void test_pose_random_bytes_of_the_right_size_do_no_harm(void **state) {
    (void)state;
    check_random r = {7};
    unsigned char good[256], bytes[256];
    const shcdmsg_tool_pose_t m = pose(1);
    const size_t size = (size_t)shcdmsg_tool_pose_t_encode(good, 0, sizeof good, &m);
    int64_t now_ns = 0;
    for (size_t i = 0; i < check_scaled(200000); i++) {
        memcpy(bytes, good, size);
        /* the fingerprint is kept in most of them, or nothing else would be reached */
        for (size_t k = check_random_bits(&r) % 8 == 0 ? 0 : 8; k < size; k++) {
            bytes[k] =
                check_random_bits(&r) % 4 == 0 ? (unsigned char)check_random_bits(&r) : good[k];
        }
        now_ns += MS;
        if (messages_pose(bytes, (uint32_t)size, &config, now_ns, tracks, &counters, &tool,
                          &sample) == REJECT_NONE) {
            assert_true(tool < 2);
            const shcd_vec3 p = sample.tool_in_world.position_m, v = sample.velocity_m_per_s;
            assert_true(fabs(p.x) <= 100.0 && fabs(p.y) <= 100.0 && fabs(p.z) <= 100.0);
            assert_true(v.x - v.x == 0.0 && v.y - v.y == 0.0 && v.z - v.z == 0.0);
        }
    }
}

static void test_velocity_constant_speed_converges_geometrically(void **state) {
    (void)state;
    /* error after n steps of dt: (tau/(tau + dt))^n, here (5/6)^n */
    velocity_filter f = {0};
    for (int n = 0; n <= 40; n++) {
        const shcd_vec3 p = {0.2e-3 * n, 0.0, -0.1e-3 * n};
        const shcd_vec3 v = velocity_update(&f, 1000 * n, p);
        const double factor = 1.0 - pow(5.0 / 6.0, n);
        assert_near(v.x, 0.2 * factor, 1e-14); /* 40 steps of a few ulp of 0.2 */
        assert_near(v.z, -0.1 * factor, 1e-14);
    }
}

static void test_velocity_odd_times_are_harmless(void **state) {
    (void)state;
    velocity_filter f = {0};
    const shcd_vec3 zero = {0.0, 0.0, 0.0}, p1 = {1e-3, 0.0, 0.0}, p2 = {2e-3, 0.0, 0.0};
    velocity_update(&f, 0, zero);
    assert_near(velocity_update(&f, 1000, p1).x, 1.0 / 6.0, 1e-15);
    /* too close: ignored, and the next difference reaches back over it: (2 - 1) mm in 1 ms */
    assert_near(velocity_update(&f, 1050, p2).x, 1.0 / 6.0, 1e-15);
    assert_near(velocity_update(&f, 2000, p2).x, 1.0 / 6.0 + 5.0 / 36.0, 1e-15);
    assert_true(velocity_update(&f, 2000 + VELOCITY_DT_MAX_US + 1, zero).x == 0.0); /* gap */
    velocity_update(&f, 60000, p1);
    assert_true(velocity_update(&f, 50000, p2).x == 0.0); /* clock set back */
    velocity_set(&f, 51000, p2, p1);
    assert_true(velocity_update(&f, 51000, zero).x == 1e-3);
}

/* Turning at a constant rate about a fixed axis of the world, through more than a full turn, where
 * the quaternion changes its sign: the same geometric approach as in a straight line. */
static void test_velocity_constant_turn_converges_geometrically(void **state) {
    const shcd_vec3 axis = {2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0};
    turn_filter f = {0};
    (void)state;
    for (int n = 0; n <= 100; n++) {
        const double half_angle = 0.5 * 0.2 * n + 0.3; /* 0.2 rad a ms: 200 rad/s */
        const double s = (n % 2 == 0 ? 1.0 : -1.0);    /* q and -q are the same turn */
        const shcd_quat q = {s * cos(half_angle), s * sin(half_angle) * axis.x,
                             s * sin(half_angle) * axis.y, s * sin(half_angle) * axis.z};
        const shcd_vec3 v = velocity_turn(&f, 1000 * n, q);
        const double expected = 200.0 * (1.0 - pow(5.0 / 6.0, n));
        /* products of components to an ulp of 1, divided by sin 0.1 and by 1 ms, summed by the
         * filter to six times that at most */
        assert_near(v.x, expected * axis.x, 1e-10);
        assert_near(v.y, expected * axis.y, 1e-10);
        assert_near(v.z, expected * axis.z, 1e-10);
    }
    /* a gap says nothing about now */
    const shcd_quat q = {1.0, 0.0, 0.0, 0.0};
    const shcd_vec3 v = velocity_turn(&f, 100000 + VELOCITY_DT_MAX_US + 1, q);
    assert_true(v.x == 0.0 && v.y == 0.0 && v.z == 0.0);
}

static void test_command_size_and_type_are_checked(void **state) {
    (void)state;
    unsigned char bytes[1024] = {0};
    shcdmsg_command_t out, m = {.client_id = 4, .cmd_id = 5, .op = 6};
    const uint32_t size = (uint32_t)shcdmsg_command_t_encode(bytes, 0, sizeof bytes, &m);
    assert_int_equal(messages_command(bytes, size - 1, &counters, &out), REJECT_SIZE);
    assert_int_equal(messages_command(bytes, size + 1, &counters, &out), REJECT_SIZE);
    assert_int_equal(messages_command(bytes, size, &counters, &out), REJECT_NONE);
    assert_int_equal(out.op, 6);
    bytes[0] ^= 0x80;
    assert_int_equal(messages_command(bytes, size, &counters, &out), REJECT_TYPE);
    assert_int_equal(counted(REJECT_SIZE), 2);
    assert_int_equal(counted(REJECT_TYPE), 1);
}

static void publish_pose(const transport *net, const shcdmsg_tool_pose_t *m, uint32_t cut) {
    unsigned char bytes[256];
    const int size = shcdmsg_tool_pose_t_encode(bytes, 0, sizeof bytes, m);
    assert_true(size > (int)cut);
    /* a memory queue lives in one context, so send in the one that receives */
    assert_int_equal(lcm_publish(net->receive, net->tool, bytes, (unsigned)size - cut), 0);
}

static void test_receiver_passes_good_messages_and_counts_bad_ones(void **state) {
    (void)state;
    transport net;
    char error[256];
    assert_true(transport_open(&net, "memq://", "T", error, sizeof error));
    shared *s = shared_create(&config);
    assert_non_null(s);
    receiver *r = receiver_create(&net, s);
    assert_non_null(r);

    shcdmsg_tool_pose_t m = pose(1);
    m.tool_id = 1;
    m.pos[0] = 0.25;
    publish_pose(&net, &m, 0);
    publish_pose(&net, &m, 1); /* truncated */
    m.pos[0] = (double)NAN;
    publish_pose(&net, &m, 0);
    m = pose(2);
    m.tool_id = 1;
    m.pos[0] = 0.5;
    publish_pose(&net, &m, 0);

    while (lcm_handle_timeout(net.receive, 0) > 0) {
    }
    bool fresh;
    const tool_sample *got = mailbox_front(&s->poses[1], &fresh);
    assert_true(fresh);
    assert_int_equal(got->seq, 2);
    assert_true(got->tool_in_world.position_m.x == 0.5);
    assert_int_equal(atomic_load(&s->counters.ok), 2);
    assert_int_equal(atomic_load(&s->counters.reject[REJECT_SIZE]), 1);
    assert_int_equal(atomic_load(&s->counters.reject[REJECT_NOT_FINITE]), 1);
    receiver_free(r);
    shared_free(s);
    transport_close(&net);
}

static void test_transport_unusable_url_gives_one_line(void **state) {
    (void)state;
    transport net;
    char error[256] = "";
    assert_false(transport_open(&net, "nonsense://", "T", error, sizeof error));
    assert_non_null(strstr(error, "nonsense://"));
    assert_null(strchr(error, '\n'));
    assert_true(transport_prefix_is_valid("Lab_2"));
    assert_false(transport_prefix_is_valid(""));
    assert_false(transport_prefix_is_valid("a.*"));
    assert_false(
        transport_prefix_is_valid("a_prefix_that_is_longer_than_what_fits_into_a_channel_name"));
}

#define TEST(name) cmocka_unit_test_setup(name, forget)

int main(void) {
    const struct CMUnitTest tests[] = {
        TEST(test_pose_good_message_arrives_unchanged),
        TEST(test_pose_wrong_size_is_rejected),
        TEST(test_pose_other_fingerprint_is_rejected),
        TEST(test_pose_not_finite_is_rejected_in_every_field),
        TEST(test_pose_out_of_range_is_rejected),
        TEST(test_pose_quaternion_must_have_norm_one),
        TEST(test_pose_unknown_tool_is_rejected),
        TEST(test_pose_duplicates_and_old_ones_are_rejected),
        TEST(test_pose_restarted_client_is_heard_after_a_silence),
        TEST(test_pose_gap_counts_lost_messages),
        TEST(test_pose_random_bytes_of_the_right_size_do_no_harm),
        TEST(test_velocity_constant_speed_converges_geometrically),
        TEST(test_velocity_odd_times_are_harmless),
        TEST(test_velocity_constant_turn_converges_geometrically),
        TEST(test_command_size_and_type_are_checked),
        TEST(test_receiver_passes_good_messages_and_counts_bad_ones),
        TEST(test_transport_unusable_url_gives_one_line),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
