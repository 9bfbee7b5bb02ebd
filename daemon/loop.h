/* SPDX-License-Identifier: BSD-3-Clause */
/* The real-time thread: waits for grid points of CLOCK_MONOTONIC, runs a tick at each, hands the
 * record on and counts. After the start it calls no allocator, no stdio, no lock and no LCM. */
#ifndef SHCDD_LOOP_H
#define SHCDD_LOOP_H

#include "privileges.h"
#include "shared.h"

typedef struct loop loop;

/** Allocates everything that the loop will need, its stack included. */
loop *loop_create(shared *s);
/** After loop_start() only once shared.loop_done is set and the thread was joined. */
void loop_free(loop *l);

/** Starts the thread and waits until it is about to tick. @return 0 or an errno. */
int loop_start(loop *l, int priority, int cpu);

/** Waits at most `timeout_s` for the thread, which ends after shared.stop_loop was set. */
bool loop_join(loop *l, int timeout_s);

/** Grid points from `due_ns` on that have passed at `now_ns` >= due_ns and lie a whole period or
 *  more back: the loop serves the last one that has passed and skips these. */
int64_t loop_missed(int64_t due_ns, int64_t now_ns, int64_t period_ns);

#endif
