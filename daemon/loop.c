/* SPDX-License-Identifier: BSD-3-Clause */
#include "loop.h"

#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <time.h>

#define STATUS_NS 100000000
#define PAGE_BYTES ((size_t)4096)

struct loop {
    shared *s;
    pthread_t thread;
    tick_core core;
    loop_stats stats;
    tick_record scratch; /* filled when the ring is full */
    int64_t status_due_ns, status_ns, status_tick;
    void *stack;
};

int64_t loop_missed(int64_t due_ns, int64_t now_ns, int64_t period_ns) {
    return now_ns > due_ns ? (now_ns - due_ns) / period_ns : 0;
}

loop *loop_create(shared *s) {
    loop *l = aligned_alloc(EXCHANGE_LINE, EXCHANGE_STRIDE(sizeof *l));
    if (l == NULL) {
        return NULL;
    }
    memset(l, 0, sizeof *l);
    l->s = s;
    l->stack = aligned_alloc(PAGE_BYTES, PRIVILEGES_STACK_BYTES);
    if (l->stack == NULL || !tick_init(&l->core, s->config, s->poses, &s->commands, &s->applied)) {
        loop_free(l);
        return NULL;
    }
    memset(l->stack, 0, PRIVILEGES_STACK_BYTES);
    l->core.deforms = &s->deforms;
    return l;
}

void loop_free(loop *l) {
    if (l != NULL) {
        tick_free(&l->core);
        free(l->stack);
        free(l);
    }
}

static void sleep_until(int64_t time_ns) {
    const struct timespec t = {(time_t)(time_ns / 1000000000), (long)(time_ns % 1000000000)};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL) == EINTR) {
    }
}

static int64_t cpu_now_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static void hand_out_stats(loop *l, int64_t now_ns, bool stopping) {
    if (now_ns < l->status_due_ns && !stopping) {
        return;
    }
    loop_stats *st = &l->stats;
    st->utime_ns = now_ns;
    st->tick = l->core.tick;
    st->state = stopping ? LOOP_STOPPING : l->core.degraded ? LOOP_DEGRADED : LOOP_RUNNING;
    st->rt_flags = atomic_load_explicit(&l->s->rt_flags, memory_order_relaxed);
    st->energy = tick_energy_of(&l->core);
    st->n_effects =
        l->core.n_effects < LOOP_EFFECTS_MAX ? l->core.n_effects : (size_t)LOOP_EFFECTS_MAX;
    memcpy(st->effects, l->core.effect_times, st->n_effects * sizeof st->effects[0]);
    if (now_ns > l->status_ns) {
        st->actual_rate_hz =
            (double)(st->tick - l->status_tick) * 1e9 / (double)(now_ns - l->status_ns);
    }
    l->status_ns = now_ns;
    l->status_tick = st->tick;
    l->status_due_ns = now_ns + STATUS_NS;
    memcpy(mailbox_back(&l->s->stats), st, sizeof *st);
    mailbox_publish(&l->s->stats);
}

/* One grid point; returns true after the last one. */
static bool run_tick(loop *l, int64_t now_ns, int64_t missed) {
    shared *s = l->s;
    const bool stop = atomic_load_explicit(&s->stop_loop, memory_order_acquire);
    tick_record *slot = ring_reserve(&s->forces);
    tick_record *record = slot != NULL ? slot : &l->scratch;

    const int64_t cpu_ns = cpu_now_ns();
    const bool final = tick_run(&l->core, now_ns, missed, stop, record);
    const int64_t compute_ns = cpu_now_ns() - cpu_ns;

    record->compute_us = (float)(1e-3 * (double)compute_ns);
    histogram_add(&l->stats.compute, compute_ns);
    if (compute_ns > l->core.period_ns) {
        l->stats.self_overruns++;
    }
    if (slot != NULL) {
        ring_commit(&s->forces);
    } else {
        l->stats.tx_dropped++;
    }
    hand_out_stats(l, now_ns, stop);
    atomic_store_explicit(&s->ticks, l->core.tick, memory_order_relaxed);
    shared_wake(s);
    /* the last record must not get lost: if the ring was full, the next tick tries again */
    return final && slot != NULL;
}

static void *run_loop(void *argument) {
    loop *l = argument;
    shared *s = l->s;
    const int64_t period_ns = l->core.period_ns;
    const int32_t flags = privileges_enter_thread();
    atomic_fetch_or_explicit(&s->rt_flags, flags, memory_order_relaxed);
    atomic_store_explicit(&s->loop_ready, true, memory_order_release);

    int64_t due_ns = shared_now_ns() + period_ns;
    l->status_ns = due_ns;
    l->status_due_ns = due_ns + STATUS_NS;
    for (bool last = false; !last;) {
        sleep_until(due_ns);
        const int64_t now_ns = shared_now_ns();
        const int64_t missed = loop_missed(due_ns, now_ns, period_ns);
        histogram_add(&l->stats.wake, now_ns - due_ns);
        l->stats.missed_ticks += missed;
        l->stats.missed_events += missed > 0;
        last = run_tick(l, now_ns, missed);
        due_ns += (missed + 1) * period_ns;
    }
    atomic_store_explicit(&s->loop_done, true, memory_order_release);
    shared_wake(s);
    return NULL;
}

int loop_start(loop *l, int priority, int cpu) {
    const privileges_request request = {priority, cpu, l->stack};
    int32_t granted = 0;
    const int result = privileges_start_thread(&request, run_loop, l, &l->thread, &granted);
    if (result != 0) {
        return result;
    }
    atomic_fetch_or_explicit(&l->s->rt_flags, granted, memory_order_relaxed);
    while (!atomic_load_explicit(&l->s->loop_ready, memory_order_acquire)) {
        const struct timespec pause = {0, 1000000};
        nanosleep(&pause, NULL);
    }
    return 0;
}

bool loop_join(loop *l, int timeout_s) {
    struct timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_sec += timeout_s;
    return pthread_timedjoin_np(l->thread, NULL, &until) == 0;
}
