/* SPDX-License-Identifier: BSD-3-Clause */
#include "shared.h"

#include <stdlib.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

/* Takes `size` bytes off the block. */
static void *carve(unsigned char **memory, size_t size) {
    void *p = *memory;
    *memory += size;
    return p;
}

shared *shared_create(const daemon_config *config) {
    const size_t samples = SHCD_TOOLS_MAX * MAILBOX_BYTES(sizeof(tool_sample));
    const size_t stats = MAILBOX_BYTES(sizeof(loop_stats));
    const size_t forces = RING_BYTES(sizeof(tick_record), SHARED_FORCES);
    const size_t applied = RING_BYTES(sizeof(tick_applied), 2 * SHARED_COMMANDS);
    const size_t inbound = RING_BYTES(sizeof(shcdmsg_command_t), SHARED_COMMANDS);
    const size_t commands = RING_BYTES(sizeof(tick_command), SHARED_COMMANDS);
    const size_t total = samples + stats + forces + applied + inbound + commands;

    shared *s = aligned_alloc(EXCHANGE_LINE, EXCHANGE_STRIDE(sizeof *s));
    unsigned char *memory = aligned_alloc(EXCHANGE_LINE, total);
    const int wake_fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (s == NULL || memory == NULL || wake_fd < 0) {
        free(s);
        free(memory);
        if (wake_fd >= 0) {
            close(wake_fd);
        }
        return NULL;
    }
    memset(s, 0, sizeof *s);
    if (!deform_create(config, &s->deforms)) {
        close(wake_fd);
        free(memory);
        free(s);
        return NULL;
    }
    memset(memory, 0, total);
    s->config = config;
    s->wake_fd = wake_fd;
    s->memory = memory;
    for (size_t i = 0; i < SHCD_TOOLS_MAX; i++) {
        mailbox_init(&s->poses[i], carve(&memory, MAILBOX_BYTES(sizeof(tool_sample))),
                     sizeof(tool_sample));
    }
    mailbox_init(&s->stats, carve(&memory, stats), sizeof(loop_stats));
    ring_init(&s->forces, carve(&memory, forces), sizeof(tick_record), SHARED_FORCES);
    ring_init(&s->applied, carve(&memory, applied), sizeof(tick_applied), 2 * SHARED_COMMANDS);
    ring_init(&s->inbound, carve(&memory, inbound), sizeof(shcdmsg_command_t), SHARED_COMMANDS);
    ring_init(&s->commands, carve(&memory, commands), sizeof(tick_command), SHARED_COMMANDS);
    return s;
}

void shared_free(shared *s) {
    if (s != NULL) {
        close(s->wake_fd);
        deform_free(&s->deforms);
        free(s->memory);
        free(s);
    }
}

void shared_wake(shared *s) {
    const uint64_t one = 1;
    /* it fails only if the counter is full, and then the publisher is awake anyway */
    const ssize_t n = write(s->wake_fd, &one, sizeof one);
    (void)n;
}

int64_t shared_now_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}
