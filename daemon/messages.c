/* SPDX-License-Identifier: BSD-3-Clause */
#include "messages.h"

#include "shcd/vec.h"

#include "shcdmsg_loop_status_t.h"
#include "shcdmsg_tool_pose_t.h"

_Static_assert((int)REJECT_SIZE == SHCDMSG_LOOP_STATUS_T_REJECT_SIZE &&
                   (int)REJECT_TYPE == SHCDMSG_LOOP_STATUS_T_REJECT_TYPE &&
                   (int)REJECT_NOT_FINITE == SHCDMSG_LOOP_STATUS_T_REJECT_NOT_FINITE &&
                   (int)REJECT_RANGE == SHCDMSG_LOOP_STATUS_T_REJECT_RANGE &&
                   (int)REJECT_QUATERNION == SHCDMSG_LOOP_STATUS_T_REJECT_QUATERNION &&
                   (int)REJECT_TOOL_ID == SHCDMSG_LOOP_STATUS_T_REJECT_TOOL_ID &&
                   (int)REJECT_DUPLICATE == SHCDMSG_LOOP_STATUS_T_REJECT_DUPLICATE &&
                   (int)REJECT_OLD == SHCDMSG_LOOP_STATUS_T_REJECT_OLD &&
                   (int)REJECT_QUEUE == SHCDMSG_LOOP_STATUS_T_REJECT_QUEUE,
               "reasons are those of the wire");

/* Differences of two such values, of either sign, cannot overflow. */
#define INTEGER_MAX (((int64_t)1 << 62) - 1)
#define LOST_MAX 1000000

void messages_count_reject(rx_counters *counters, reject_reason reason) {
    atomic_fetch_add_explicit(&counters->reject[reason], 1, memory_order_relaxed);
}

static bool all_finite(const double *values, int n) {
    for (int i = 0; i < n; i++) {
        if (!(values[i] - values[i] == 0.0)) {
            return false;
        }
    }
    return true;
}

static bool all_within(const double *values, int n, double max) {
    for (int i = 0; i < n; i++) {
        if (!(fabs(values[i]) <= max)) {
            return false;
        }
    }
    return true;
}

static reject_reason check_values(const shcdmsg_tool_pose_t *m) {
    if (!all_finite(m->pos, 3) || !all_finite(m->quat, 4) || !all_finite(m->vel, 3)) {
        return REJECT_NOT_FINITE;
    }
    if (m->seq < 0 || m->seq > INTEGER_MAX || m->utime < -INTEGER_MAX || m->utime > INTEGER_MAX ||
        !all_within(m->pos, 3, MESSAGES_POSITION_MAX_M)) {
        return REJECT_RANGE;
    }
    if ((m->flags & SHCDMSG_TOOL_POSE_T_HAS_VEL) != 0 &&
        !all_within(m->vel, 3, MESSAGES_VELOCITY_MAX_M_PER_S)) {
        return REJECT_RANGE;
    }
    if ((m->flags & SHCDMSG_TOOL_POSE_T_HAS_QUAT) != 0) {
        /* the components first: a square of a huge one would overflow, and compare as infinite */
        const double *q = m->quat;
        const double n = all_within(q, 4, 2.0)
                             ? sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
                             : 0.0;
        if (!(fabs(n - 1.0) <= MESSAGES_QUATERNION_TOLERANCE)) {
            return REJECT_QUATERNION;
        }
    }
    return REJECT_NONE;
}

static bool find_tool(const daemon_config *config, int32_t id, size_t *tool) {
    const size_t n = shcd_scene_tool_count(config->scene);
    for (size_t i = 0; i < n; i++) {
        if (config->tool_ids[i] == id) {
            *tool = i;
            return true;
        }
    }
    return false;
}

static reject_reason check_sequence(const tool_track *track, int64_t seq, int64_t recv_ns) {
    const bool silent = !track->any || recv_ns - track->recv_ns > MESSAGES_RESTART_NS;
    if (seq > track->seq || silent) {
        return REJECT_NONE;
    }
    return seq == track->seq ? REJECT_DUPLICATE : REJECT_OLD;
}

static shcd_quat unit_quaternion(const double q[4]) {
    const double n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const shcd_quat r = {q[0] / n, q[1] / n, q[2] / n, q[3] / n};
    return r;
}

static void accept(const shcdmsg_tool_pose_t *m, int64_t recv_ns, tool_track *track,
                   rx_counters *counters, tool_sample *sample) {
    const shcd_quat identity = {1.0, 0.0, 0.0, 0.0};
    const shcd_vec3 position = shcd_vec3_make(m->pos[0], m->pos[1], m->pos[2]);

    if (track->any && m->seq > track->seq + 1) {
        /* a gap that no loss explains is a client that starts again; the counter must not wrap */
        const int64_t gap = m->seq - track->seq - 1;
        atomic_fetch_add_explicit(&counters->lost, gap < LOST_MAX ? gap : LOST_MAX,
                                  memory_order_relaxed);
    }
    track->any = true;
    track->seq = m->seq;
    track->recv_ns = recv_ns;

    sample->seq = m->seq;
    sample->utime = m->utime;
    sample->recv_ns = recv_ns;
    sample->tool_in_world.position_m = position;
    sample->tool_in_world.orientation =
        (m->flags & SHCDMSG_TOOL_POSE_T_HAS_QUAT) != 0 ? unit_quaternion(m->quat) : identity;
    if ((m->flags & SHCDMSG_TOOL_POSE_T_HAS_VEL) != 0) {
        sample->velocity_m_per_s = shcd_vec3_make(m->vel[0], m->vel[1], m->vel[2]);
        velocity_set(&track->velocity, m->utime, position, sample->velocity_m_per_s);
    } else {
        sample->velocity_m_per_s = velocity_update(&track->velocity, m->utime, position);
    }
    sample->angular_velocity_rad_per_s =
        velocity_turn(&track->turn, m->utime, sample->tool_in_world.orientation);
    sample->valid = true;
    sample->force_enable = (m->flags & SHCDMSG_TOOL_POSE_T_FORCE_ENABLE) != 0;
    atomic_fetch_add_explicit(&counters->ok, 1, memory_order_relaxed);
}

reject_reason messages_pose(const void *bytes, uint32_t size, const daemon_config *config,
                            int64_t recv_ns, tool_track tracks[], rx_counters *counters,
                            size_t *tool, tool_sample *sample) {
    shcdmsg_tool_pose_t m = {0};
    reject_reason reason = REJECT_NONE;
    size_t index = 0;
    /* the decoder accepts trailing bytes, and a damaged packet can claim a size of 2^32 - 1 */
    if (size != (uint32_t)shcdmsg_tool_pose_t_encoded_size(&m)) {
        reason = REJECT_SIZE;
    } else if (shcdmsg_tool_pose_t_decode(bytes, 0, (int)size, &m) != (int)size) {
        reason = REJECT_TYPE;
    } else {
        reason = check_values(&m);
    }
    if (reason == REJECT_NONE && !find_tool(config, m.tool_id, &index)) {
        reason = REJECT_TOOL_ID;
    }
    if (reason == REJECT_NONE) {
        reason = check_sequence(&tracks[index], m.seq, recv_ns);
    }
    if (reason != REJECT_NONE) {
        messages_count_reject(counters, reason);
        return reason;
    }
    accept(&m, recv_ns, &tracks[index], counters, sample);
    *tool = index;
    return REJECT_NONE;
}

reject_reason messages_command(const void *bytes, uint32_t size, rx_counters *counters,
                               shcdmsg_command_t *command) {
    shcdmsg_command_t m = {0};
    reject_reason reason = REJECT_NONE;
    if (size != (uint32_t)shcdmsg_command_t_encoded_size(&m)) {
        reason = REJECT_SIZE;
    } else if (shcdmsg_command_t_decode(bytes, 0, (int)size, &m) != (int)size) {
        reason = REJECT_TYPE;
    }
    if (reason != REJECT_NONE) {
        messages_count_reject(counters, reason);
        return reason;
    }
    *command = m;
    return REJECT_NONE;
}
