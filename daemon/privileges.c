/* SPDX-License-Identifier: BSD-3-Clause */
#include "privileges.h"

#include "shcdmsg_loop_status_t.h"

#include <malloc.h>
#include <sched.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

/* The thread's calls never go deeper than this. */
#define PREFAULT_BYTES ((size_t)256 << 10)

int32_t privileges_lock_memory(void) {
#if defined(M_TRIM_THRESHOLD) && defined(M_MMAP_MAX)
    mallopt(M_TRIM_THRESHOLD, -1);
    mallopt(M_MMAP_MAX, 0);
#endif
    return mlockall(MCL_CURRENT) == 0 ? SHCDMSG_LOOP_STATUS_T_RT_MLOCK : 0;
}

static bool set_affinity(pthread_attr_t *attributes, int cpu) {
    cpu_set_t set;
    if (cpu < 0 || cpu >= CPU_SETSIZE) {
        return false;
    }
    CPU_ZERO(&set);
    CPU_SET((size_t)cpu, &set);
    return pthread_attr_setaffinity_np(attributes, sizeof set, &set) == 0;
}

static int try_start(const privileges_request *request, bool fifo, bool bound, void *(*run)(void *),
                     void *argument, pthread_t *thread) {
    pthread_attr_t attributes;
    struct sched_param parameter = {0};
    int result = pthread_attr_init(&attributes);
    if (result != 0) {
        return result;
    }
    result = pthread_attr_setstack(&attributes, request->stack, PRIVILEGES_STACK_BYTES);
    if (result == 0 && fifo) {
        parameter.sched_priority = request->priority;
        result = pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
        result = result != 0 ? result : pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
        result = result != 0 ? result : pthread_attr_setschedparam(&attributes, &parameter);
    }
    if (result == 0 && bound && !set_affinity(&attributes, request->cpu)) {
        result = -1;
    }
    if (result == 0) {
        result = pthread_create(thread, &attributes, run, argument);
    }
    pthread_attr_destroy(&attributes);
    return result;
}

int privileges_start_thread(const privileges_request *request, void *(*run)(void *), void *argument,
                            pthread_t *thread, int32_t *granted) {
    const bool wants_cpu = request->cpu != PRIVILEGES_CPU_ANY;
    int result = -1;
    /* most wanted first: with both, without the CPU, without FIFO, plain */
    for (int i = 0; i < 4 && result != 0; i++) {
        const bool fifo = i < 2;
        const bool bound = i % 2 == 0 && wants_cpu;
        if (i % 2 == 0 && !wants_cpu) {
            continue; /* the same as the next one */
        }
        result = try_start(request, fifo, bound, run, argument, thread);
        *granted = (fifo ? SHCDMSG_LOOP_STATUS_T_RT_FIFO : 0) |
                   (bound ? SHCDMSG_LOOP_STATUS_T_RT_AFFINITY : 0);
    }
    return result;
}

static void touch_stack(void) {
    volatile unsigned char bytes[PREFAULT_BYTES];
    for (size_t i = 0; i < sizeof bytes; i += 1024) {
        bytes[i] = 0;
    }
}

int32_t privileges_enter_thread(void) {
    int32_t flags = 0;
    if (prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL) == 0) {
        flags |= SHCDMSG_LOOP_STATUS_T_RT_TIMER_SLACK;
    }
#if defined(__SSE2__)
    _mm_setcsr(_mm_getcsr() | 0x8040u); /* flush to zero, denormals are zero */
    flags |= SHCDMSG_LOOP_STATUS_T_RT_FLUSH;
#endif
    touch_stack();
    return flags | SHCDMSG_LOOP_STATUS_T_RT_PREFAULT;
}
