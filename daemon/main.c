/* SPDX-License-Identifier: BSD-3-Clause */
/* shcdd: life and death of the daemon.
 *
 * The order of the start matters: scene and all memory first, then the LCM threads (they inherit
 * the mask that leaves signals to this thread, and normal scheduling), then the lock on memory,
 * last the loop. The end goes the other way: the loop lets the forces ramp to zero and hands over
 * a last record, the publisher sends it, and only then does anything close. */
#include "config.h"
#include "loop.h"
#include "notify.h"
#include "options.h"
#include "shared.h"
#include "transport.h"

#include "shcdmsg_loop_status_t.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/signalfd.h>
#include <unistd.h>

#define POLL_MS 100
#define LOOP_END_TIMEOUT_S 2

typedef struct daemon_parts {
    daemon_config config;
    bool configured;
    transport net;
    shared *s;
    receiver *rx;
    publisher *tx;
    loop *l;
    bool loop_runs;
    int signal_fd;
} daemon_parts;

/* Blocks the signals that end the daemon, for all threads to come, and reads them from a file. */
static int open_signals(void) {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGHUP);
    signal(SIGPIPE, SIG_IGN);
    if (pthread_sigmask(SIG_BLOCK, &set, NULL) != 0) {
        return -1;
    }
    return signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
}

static bool fail(const char *what) {
    fprintf(stderr, "shcdd: %s\n", what);
    return false;
}

static bool check_privileges(const options *o, int32_t flags) {
    if (!o->require_rt) {
        return true;
    }
    if ((flags & SHCDMSG_LOOP_STATUS_T_RT_FIFO) == 0) {
        return fail("--require-rt: SCHED_FIFO refused; run as root, or raise 'ulimit -r'");
    }
    if ((flags & SHCDMSG_LOOP_STATUS_T_RT_MLOCK) == 0) {
        return fail("--require-rt: mlockall refused; run as root, or raise 'ulimit -l'");
    }
    if (o->cpu != PRIVILEGES_CPU_ANY && (flags & SHCDMSG_LOOP_STATUS_T_RT_AFFINITY) == 0) {
        return fail("--require-rt: cannot bind the loop to the CPU given by --cpu");
    }
    return true;
}

static bool start(const options *o, daemon_parts *d) {
    char error[CONFIG_ERROR_SIZE];
    d->signal_fd = open_signals();
    if (d->signal_fd < 0) {
        return fail("cannot open a signalfd");
    }
    d->configured = o->scene != NULL ? config_load(o->scene, &d->config, error, sizeof error)
                                     : config_built_in(&d->config, error, sizeof error);
    if (!d->configured) {
        return fail(error);
    }
    d->s = shared_create(&d->config);
    d->l = d->s != NULL ? loop_create(d->s) : NULL;
    if (d->l == NULL) {
        return fail("out of memory");
    }
    if (!transport_open(&d->net, o->url, o->prefix, error, sizeof error)) {
        return fail(error);
    }
    d->rx = receiver_create(&d->net, d->s);
    d->tx = d->rx != NULL && receiver_start(d->rx) ? publisher_start(&d->net, d->s) : NULL;
    if (d->tx == NULL) {
        return fail("cannot subscribe to LCM or start its threads");
    }
    atomic_fetch_or(&d->s->rt_flags, privileges_lock_memory());
    const int result = loop_start(d->l, o->priority, o->cpu);
    if (result != 0) {
        fprintf(stderr, "shcdd: cannot start the loop thread: %s\n", strerror(result));
        return false;
    }
    d->loop_runs = true;
    return check_privileges(o, atomic_load(&d->s->rt_flags));
}

static const char *granted(int32_t flags, int32_t bit) {
    return (flags & bit) != 0 ? "yes" : "no";
}

static void print_start(const options *o, const daemon_parts *d) {
    const int32_t flags = atomic_load(&d->s->rt_flags);
    char cpu[32] = "any";
    if (o->cpu != PRIVILEGES_CPU_ANY) {
        snprintf(cpu, sizeof cpu, "%d %s", o->cpu,
                 granted(flags, SHCDMSG_LOOP_STATUS_T_RT_AFFINITY));
    }
    fprintf(stderr,
            "shcdd: %g Hz, %zu bodies, %zu tools, device %s, channels %s_*; fifo %d %s, mlock %s, "
            "cpu %s, timer slack %s\n",
            d->config.rate_hz, shcd_scene_body_count(d->config.scene),
            shcd_scene_tool_count(d->config.scene), d->config.device->name, o->prefix, o->priority,
            granted(flags, SHCDMSG_LOOP_STATUS_T_RT_FIFO),
            granted(flags, SHCDMSG_LOOP_STATUS_T_RT_MLOCK), cpu,
            granted(flags, SHCDMSG_LOOP_STATUS_T_RT_TIMER_SLACK));
}

/* Until a signal or the end of the duration. The watchdog of the service manager is fed only while
 * the loop ticks. */
static void serve(const options *o, const daemon_parts *d) {
    const int64_t begin_ns = shared_now_ns();
    int64_t ticks = 0;
    struct pollfd signals = {d->signal_fd, POLLIN, 0};
    for (;;) {
        int wait_ms = POLL_MS;
        if (o->duration_s > 0.0) {
            const double left_s = o->duration_s - 1e-9 * (double)(shared_now_ns() - begin_ns);
            if (left_s <= 0.0) {
                return;
            }
            wait_ms = left_s < 1e-3 * POLL_MS ? (int)(1e3 * left_s) + 1 : POLL_MS;
        }
        if (poll(&signals, 1, wait_ms) > 0) {
            return;
        }
        const int64_t now_ticks = atomic_load(&d->s->ticks);
        if (now_ticks != ticks) {
            notify("WATCHDOG=1");
        }
        ticks = now_ticks;
    }
}

/* Ends what was started; false if the loop does not answer. */
static bool stop(daemon_parts *d) {
    if (d->loop_runs) {
        atomic_store(&d->s->stop_loop, true);
        if (!loop_join(d->l, LOOP_END_TIMEOUT_S)) {
            return false;
        }
    }
    receiver_free(d->rx);
    publisher_stop(d->tx);
    transport_close(&d->net);
    loop_free(d->l);
    shared_free(d->s);
    if (d->configured) {
        config_free(&d->config);
    }
    if (d->signal_fd >= 0) {
        close(d->signal_fd);
    }
    return true;
}

int main(int argc, char **argv) {
    options o;
    switch (options_parse(argc, argv, &o)) {
    case OPTIONS_DONE:
        return 0;
    case OPTIONS_BAD:
        fputs("Try 'shcdd --help'.\n", stderr);
        return 2;
    case OPTIONS_RUN:
        break;
    }
    daemon_parts d = {.signal_fd = -1};
    const bool started = start(&o, &d);
    if (started) {
        if (!o.quiet) {
            print_start(&o, &d);
        }
        notify("READY=1");
        serve(&o, &d);
        notify("STOPPING=1");
    }
    if (!stop(&d)) {
        /* its thread still uses the memory: leave without touching anything */
        fputs("shcdd: the loop does not end; the last forces may not be zero\n", stderr);
        _exit(1);
    }
    return started ? 0 : 1;
}
