/* SPDX-License-Identifier: BSD-3-Clause */
/* Everything that two threads of the daemon touch, in one place:
 *
 *   receive --poses--> loop --forces, stats, applied--> publish
 *   receive --inbound--> publish --commands--> loop
 *
 * and the flags by which main ends them. Allocated once, before the loop starts. */
#ifndef SHCDD_SHARED_H
#define SHCDD_SHARED_H

#include "config.h"
#include "exchange.h"
#include "messages.h"
#include "status.h"
#include "tick.h"

#include <stdatomic.h>
#include <stdbool.h>

#define SHARED_FORCES 32   /* ticks that the publisher may be behind */
#define SHARED_COMMANDS 16 /* commands on their way */

typedef struct shared {
    const daemon_config *config;
    mailbox poses[SHCD_TOOLS_MAX]; /* tool_sample */
    ring forces;                   /* tick_record */
    ring applied;                  /* tick_applied */
    ring inbound;                  /* shcdmsg_command_t */
    ring commands;                 /* tick_command */
    mailbox stats;                 /* loop_stats */
    deform_boxes deforms;          /* loop -> publish: shapes of soft bodies */
    rx_counters counters;
    int wake_fd; /* eventfd: there is something to publish */
    _Atomic bool stop_loop;
    _Atomic bool stop_receive;
    _Atomic bool stop_publish;
    _Atomic bool loop_ready;  /* rt_flags is set, ticks are about to start */
    _Atomic bool loop_done;   /* the last record is in the ring */
    _Atomic int64_t ticks;    /* sign of life of the loop */
    _Atomic int32_t rt_flags; /* LOOP_STATUS_T_RT_*, added by whoever obtained it */
    void *memory;
} shared;

/** Zeroed and ready, or NULL without memory or without an eventfd. */
shared *shared_create(const daemon_config *config);
void shared_free(shared *s);

/** Wakes the publisher; never blocks. */
void shared_wake(shared *s);

/** CLOCK_MONOTONIC. */
int64_t shared_now_ns(void);

#endif
