/* SPDX-License-Identifier: BSD-3-Clause */
/* The other side of shcdd for tests: starts the real program, speaks LCM with it, and keeps what it
 * says. Whatever happens, no process outlives the test: the child dies with its parent and has a
 * duration. */
#ifndef SHCD_TESTS_DAEMON_PEER_H
#define SHCD_TESTS_DAEMON_PEER_H

#include "shcdmsg_command_ack_t.h"
#include "shcdmsg_command_t.h"
#include "shcdmsg_deform_state_t.h"
#include "shcdmsg_loop_status_t.h"
#include "shcdmsg_tool_force_t.h"
#include "shcdmsg_tool_pose_t.h"

#include <lcm/lcm.h>

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#define PEER_FORCES_MAX 20000
#define PEER_TOOLS_MAX 16
#define PEER_COEFFICIENTS_MAX 64

typedef struct peer {
    lcm_t *lcm;
    lcm_subscription_t *subscriptions[4];
    pid_t pid; /* of shcdd; 0: none */
    int64_t seq;
    /* log of one tool's forces; stops when full */
    int32_t watched_tool;
    size_t n_forces;
    shcdmsg_tool_force_t forces[PEER_FORCES_MAX];
    shcdmsg_tool_force_t last[PEER_TOOLS_MAX]; /* by id */
    int64_t n_status, n_deform, n_acks;
    shcdmsg_loop_status_t status;
    shcdmsg_command_ack_t ack;
    shcdmsg_deform_state_t deform; /* coeff is not kept, see next line */
    float coefficients[PEER_COEFFICIENTS_MAX];
} peer;

int64_t peer_now_us(void);

/** Runs a program to its end, quietly. @return its exit status, or -1. */
int peer_run(const char *path, char *const argv[], char *stderr_text, size_t stderr_size);

/** Opens LCM and starts shcdd with the built-in scene; pings until tool 0 is answered. */
bool peer_start(peer *p, const char *path);
/** The same with a scene file. */
bool peer_start_scene(peer *p, const char *path, const char *scene);
/** Ends shcdd by a signal and waits. @return its exit status, or -1. */
int peer_stop(peer *p, int signal);
/** Ends shcdd in any case and closes LCM. */
void peer_close(peer *p);

/** Receives until the time is up. */
void peer_listen(peer *p, int64_t until_us);

/** The next pose of tool 0, not yet sent. */
shcdmsg_tool_pose_t peer_pose(peer *p, double x, double y, double z);
void peer_send(peer *p, const shcdmsg_tool_pose_t *m);

/** Sends `n` poses of tool 0 at rest, 1 kHz, and listens; slots that are missed are left out.
 *  @return the number sent. */
int peer_hold(peer *p, double x, double y, double z, int n);
/** The same with any tool and pose; `utime` and `seq` are filled in. */
int peer_hold_pose(peer *p, const shcdmsg_tool_pose_t *pose, int n);

/** Sends one pose of tool 0 and waits for its answer. @return the round trip in us, or -1 if there
 * is none within `timeout_us`. */
int64_t peer_ping(peer *p, double x, double y, double z, int64_t timeout_us);

/** Listens until a status newer than now has come. @return false after 2 s. */
bool peer_next_status(peer *p);

/** Sends a command every 100 ms until its answer comes. @return false after 2 s. */
bool peer_command(peer *p, shcdmsg_command_t *command);

#endif
