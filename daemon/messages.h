/* SPDX-License-Identifier: BSD-3-Clause */
/* The border: bytes from the network become a checked tool_sample or command, or are rejected and
 * counted by reason. Nothing behind this file sees a number that is not finite or out of range. */
#ifndef SHCDD_MESSAGES_H
#define SHCDD_MESSAGES_H

#include "config.h"
#include "velocity.h"

#include "shcdmsg_command_t.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#define MESSAGES_POSITION_MAX_M 100.0
#define MESSAGES_VELOCITY_MAX_M_PER_S 100.0
#define MESSAGES_QUATERNION_TOLERANCE 1e-3
/* A sequence number that falls is a restarted client if its tool was silent for this long, and an
 * old message that arrived late otherwise. */
#define MESSAGES_RESTART_NS 100000000

/** Reasons, in the order of loop_status_t.rx_reject; negative: accepted. */
typedef enum reject_reason {
    REJECT_NONE = -1,
    REJECT_SIZE = 0,
    REJECT_TYPE = 1,
    REJECT_NOT_FINITE = 2,
    REJECT_RANGE = 3,
    REJECT_QUATERNION = 4,
    REJECT_TOOL_ID = 5,
    REJECT_DUPLICATE = 6,
    REJECT_OLD = 7,
    REJECT_QUEUE = 8,
    REJECT_COUNT = 10
} reject_reason;

/** Written by the receive thread, read by the publisher. */
typedef struct rx_counters {
    _Atomic int64_t ok;
    _Atomic int64_t lost;
    _Atomic int64_t reject[REJECT_COUNT];
} rx_counters;

/** A checked pose of one tool. */
typedef struct tool_sample {
    int64_t seq;
    int64_t utime; /* the client's, untouched */
    int64_t recv_ns;
    shcd_pose tool_in_world; /* orientation normalised */
    shcd_vec3 velocity_m_per_s;
    shcd_vec3 angular_velocity_rad_per_s; /* estimated; zero without orientations */
    bool valid;                           /* false: no message yet */
    bool force_enable;
} tool_sample;

/** What the receiver remembers of one tool. */
typedef struct tool_track {
    bool any;
    int64_t seq;
    int64_t recv_ns;
    velocity_filter velocity;
    turn_filter turn;
} tool_track;

/** Decodes and checks a tool_pose_t, then updates the tool's track and the counters.
 *  @param[out] tool    index of the tool in the scene
 *  @param[out] sample  @return REJECT_NONE, or why neither was written. */
reject_reason messages_pose(const void *bytes, uint32_t size, const daemon_config *config,
                            int64_t recv_ns, tool_track tracks[], rx_counters *counters,
                            size_t *tool, tool_sample *sample);

/** Decodes a command_t; its arguments are checked where its operation is known. */
reject_reason messages_command(const void *bytes, uint32_t size, rx_counters *counters,
                               shcdmsg_command_t *command);

void messages_count_reject(rx_counters *counters, reject_reason reason);

#endif
