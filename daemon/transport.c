/* SPDX-License-Identifier: BSD-3-Clause */
#include "transport.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#define HANDLE_TIMEOUT_MS 100
/* A full queue drops the newest message, so it must never fill: the handlers are quick and the
 * thread does nothing else, but it may lose the processor for a while. */
#define QUEUE_CAPACITY 4096

struct receiver {
    shared *s;
    const transport *t;
    pthread_t thread;
    bool runs;
    lcm_subscription_t *poses;
    lcm_subscription_t *commands;
    tool_track tracks[SHCD_TOOLS_MAX];
};

bool transport_prefix_is_valid(const char *prefix) {
    const size_t n = strlen(prefix);
    if (n == 0 || n > TRANSPORT_PREFIX_MAX) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        const char c = prefix[i];
        const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
        if (!letter && !(c >= '0' && c <= '9') && c != '_') {
            return false; /* LCM reads a channel as a regular expression */
        }
    }
    return true;
}

/* liblcm explains a missing route in a dozen lines, with an address that is garbage; ours is one.
 * No other thread runs yet. Returns what restore_stderr() needs. */
static int silence_stderr(void) {
    const int saved = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
    const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
    fflush(stderr);
    if (saved >= 0 && null >= 0) {
        dup2(null, STDERR_FILENO);
    }
    if (null >= 0) {
        close(null);
    }
    return saved;
}

static void restore_stderr(int saved) {
    fflush(stderr);
    if (saved >= 0) {
        dup2(saved, STDERR_FILENO);
        close(saved);
    }
}

bool transport_open(transport *t, const char *url, const char *prefix, char *error,
                    size_t error_size) {
    memset(t, 0, sizeof *t);
    snprintf(t->tool, sizeof t->tool, "%s_TOOL", prefix);
    snprintf(t->force, sizeof t->force, "%s_FORCE", prefix);
    snprintf(t->status, sizeof t->status, "%s_STATUS", prefix);
    snprintf(t->deform, sizeof t->deform, "%s_DEFORM", prefix);
    snprintf(t->command, sizeof t->command, "%s_COMMAND", prefix);
    snprintf(t->ack, sizeof t->ack, "%s_ACK", prefix);

    const int saved = silence_stderr();
    t->receive = lcm_create(url);
    t->publish = t->receive != NULL ? lcm_create(url) : NULL;
    restore_stderr(saved);
    if (t->publish == NULL) {
        const char *other = getenv("LCM_DEFAULT_URL");
        transport_close(t);
        snprintf(error, error_size,
                 "cannot open LCM (%s); without a multicast route, as root: "
                 "ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo",
                 url != NULL ? url : (other != NULL ? other : "default URL"));
        return false;
    }
    return true;
}

void transport_close(transport *t) {
    if (t->receive != NULL) {
        lcm_destroy(t->receive);
    }
    if (t->publish != NULL) {
        lcm_destroy(t->publish);
    }
    t->receive = NULL;
    t->publish = NULL;
}

static void on_pose(const lcm_recv_buf_t *buffer, const char *channel, void *user) {
    receiver *r = user;
    tool_sample sample;
    size_t tool;
    (void)channel;
    if (messages_pose(buffer->data, buffer->data_size, r->s->config, shared_now_ns(), r->tracks,
                      &r->s->counters, &tool, &sample) == REJECT_NONE) {
        mailbox *m = &r->s->poses[tool];
        *(tool_sample *)mailbox_back(m) = sample;
        mailbox_publish(m);
    }
}

static void on_command(const lcm_recv_buf_t *buffer, const char *channel, void *user) {
    receiver *r = user;
    shcdmsg_command_t command;
    (void)channel;
    if (messages_command(buffer->data, buffer->data_size, &r->s->counters, &command) !=
        REJECT_NONE) {
        return;
    }
    shcdmsg_command_t *slot = ring_reserve(&r->s->inbound);
    if (slot == NULL) {
        messages_count_reject(&r->s->counters, REJECT_QUEUE);
        return;
    }
    *slot = command;
    ring_commit(&r->s->inbound);
    shared_wake(r->s);
}

static void *run_receiver(void *argument) {
    receiver *r = argument;
    while (!atomic_load_explicit(&r->s->stop_receive, memory_order_acquire)) {
        if (lcm_handle_timeout(r->t->receive, HANDLE_TIMEOUT_MS) < 0) {
            /* an error that lasts must not keep a CPU busy */
            const struct timespec pause = {0, 10000000};
            nanosleep(&pause, NULL);
        }
    }
    return NULL;
}

receiver *receiver_create(const transport *t, shared *s) {
    receiver *r = calloc(1, sizeof *r);
    if (r == NULL) {
        return NULL;
    }
    r->s = s;
    r->t = t;
    r->poses = lcm_subscribe(t->receive, t->tool, on_pose, r);
    r->commands = lcm_subscribe(t->receive, t->command, on_command, r);
    if (r->poses == NULL || r->commands == NULL ||
        lcm_subscription_set_queue_capacity(r->poses, QUEUE_CAPACITY) != 0) {
        receiver_free(r);
        return NULL;
    }
    return r;
}

bool receiver_start(receiver *r) {
    r->runs = pthread_create(&r->thread, NULL, run_receiver, r) == 0;
    return r->runs;
}

void receiver_free(receiver *r) {
    if (r == NULL) {
        return;
    }
    if (r->runs) {
        atomic_store_explicit(&r->s->stop_receive, true, memory_order_release);
        pthread_join(r->thread, NULL);
    }
    if (r->poses != NULL) {
        lcm_unsubscribe(r->t->receive, r->poses);
    }
    if (r->commands != NULL) {
        lcm_unsubscribe(r->t->receive, r->commands);
    }
    free(r);
}
