/* SPDX-License-Identifier: BSD-3-Clause */
/* LCM: two contexts, since one that subscribes owns a thread and delivers our own publications back
 * to us: one only receives, one only publishes. Two threads of normal priority use them, so that
 * neither a system call nor an allocation of liblcm can delay a tick. */
#ifndef SHCDD_TRANSPORT_H
#define SHCDD_TRANSPORT_H

#include "shared.h"

#include <lcm/lcm.h>

#include <stdbool.h>

#define TRANSPORT_CHANNEL_MAX 64
#define TRANSPORT_PREFIX_MAX 48 /* bytes; letters, digits and _ */

/** Channel names, and the two contexts. */
typedef struct transport {
    lcm_t *receive;
    lcm_t *publish;
    char tool[TRANSPORT_CHANNEL_MAX];
    char force[TRANSPORT_CHANNEL_MAX];
    char status[TRANSPORT_CHANNEL_MAX];
    char deform[TRANSPORT_CHANNEL_MAX];
    char command[TRANSPORT_CHANNEL_MAX];
    char ack[TRANSPORT_CHANNEL_MAX];
} transport;

bool transport_prefix_is_valid(const char *prefix);

/** Opens both contexts. `url` NULL: LCM's default. On failure `error` says what to do. */
bool transport_open(transport *t, const char *url, const char *prefix, char *error,
                    size_t error_size);
void transport_close(transport *t);

typedef struct receiver receiver;

/** Subscribes: from here on lcm_handle(t->receive) delivers. @return NULL on failure. */
receiver *receiver_create(const transport *t, shared *s);
/** Starts the receive thread, which does nothing but that. */
bool receiver_start(receiver *r);
/** Ends the thread, if there is one (within 0.1 s), and unsubscribes; NULL is allowed. */
void receiver_free(receiver *r);

typedef struct publisher publisher;

/** Starts the publish thread. @return NULL on failure. */
publisher *publisher_start(const transport *t, shared *s);
/** Lets the thread send what is left, ends and frees it. */
void publisher_stop(publisher *p);

#endif
