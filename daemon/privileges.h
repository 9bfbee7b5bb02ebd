/* SPDX-License-Identifier: BSD-3-Clause */
/* What the operating system may grant a real-time thread. Each step is tried on its own and
 * reported as a bit LOOP_STATUS_T_RT_*; whether a missing one matters is the caller's decision. */
#ifndef SHCDD_PRIVILEGES_H
#define SHCDD_PRIVILEGES_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define PRIVILEGES_STACK_BYTES ((size_t)2 << 20)
#define PRIVILEGES_CPU_ANY (-1)

/** Keeps freed memory in the process and locks what is mapped now. Only that: under MCL_FUTURE two
 *  forged fragments make liblcm reserve, and the kernel lock, 256 MiB. Call it last. */
int32_t privileges_lock_memory(void);

typedef struct privileges_request {
    int priority; /* of SCHED_FIFO, 1 .. 99 */
    int cpu;      /* PRIVILEGES_CPU_ANY, or the only one to run on */
    void *stack;  /* PRIVILEGES_STACK_BYTES, aligned to a page */
} privileges_request;

/** Starts a thread under SCHED_FIFO, or without if that is refused.
 *  @param[out] granted  RT_FIFO, RT_AFFINITY  @return 0 or an errno. */
int privileges_start_thread(const privileges_request *request, void *(*run)(void *), void *argument,
                            pthread_t *thread, int32_t *granted);

/** Called by that thread: timer slack, subnormals to zero, and touches its stack. */
int32_t privileges_enter_thread(void);

#endif
