/* SPDX-License-Identifier: BSD-3-Clause */
/* The publish thread: sleeps on the eventfd, turns what the loop left in the rings into messages
 * and sends them. It encodes into a buffer of its own, since the generated publish functions
 * allocate. It also owns the memory of commands, see commands.h. */
#include "commands.h"
#include "transport.h"

#include "shcd/vec.h"
#include "shcdmsg_deform_state_t.h"
#include "shcdmsg_loop_status_t.h"
#include "shcdmsg_tool_force_t.h"

#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#define MESSAGE_BYTES_MAX 60000
/* Bodies are sent in turn, one in each of these slots, and each at most every 100 ms. */
#define DEFORM_SLOT_NS 10000000
#define DEFORM_BODY_NS 100000000
#define DEFORM_DEGREE_MAX 69 /* the highest whose message stays below MESSAGE_BYTES_MAX */
#define DEFORM_COUNT_MAX (3 * (DEFORM_DEGREE_MAX + 1) * (DEFORM_DEGREE_MAX + 1))

_Static_assert(sizeof(((shcdmsg_loop_status_t *)0)->rx_reject) / sizeof(int64_t) == REJECT_COUNT,
               "every reason has its place in the message");

struct publisher {
    shared *s;
    const transport *t;
    pthread_t thread;
    command_table table;
    int64_t tick, utime_ns; /* of the last record */
    int64_t dropped;        /* messages that the network refused */
    size_t deform_body;     /* the next one */
    int64_t deform_due_ns;
    int64_t deform_sent_ns[SHCD_BODIES_MAX];
    float coefficients[DEFORM_COUNT_MAX];
    unsigned char bytes[MESSAGE_BYTES_MAX];
};

static void send_bytes(publisher *p, const char *channel, int size) {
    if (size < 0 || lcm_publish(p->t->publish, channel, p->bytes, (unsigned)size) != 0) {
        p->dropped++;
    }
}

static void copy_vec3(double out[3], shcd_vec3 v) {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

static void publish_force(publisher *p, const tick_record *record, const tool_result *r) {
    shcdmsg_tool_force_t m = {0};
    const int64_t age_us = r->age_ns / 1000;
    m.utime = record->utime_ns / 1000;
    m.tick = record->tick;
    m.tool_id = r->tool_id;
    m.flags = (int32_t)r->flags;
    m.tool_seq = r->seq;
    m.tool_utime = r->utime;
    m.recv_utime = r->recv_ns / 1000;
    m.age_us = r->age_ns < 0 ? -1 : age_us < INT32_MAX ? (int32_t)age_us : INT32_MAX;
    m.compute_us = record->compute_us;
    copy_vec3(m.force, r->wrench.force_n);
    copy_vec3(m.torque, r->wrench.torque_n_m);
    copy_vec3(m.proxy, r->proxy_m);
    m.penetration = r->penetration_m;
    m.body_id = r->body;
    copy_vec3(m.normal, r->normal);
    send_bytes(p, p->t->force, shcdmsg_tool_force_t_encode(p->bytes, 0, MESSAGE_BYTES_MAX, &m));
}

static void publish_forces(publisher *p) {
    const tick_record *record;
    while ((record = ring_peek(&p->s->forces)) != NULL) {
        p->tick = record->tick;
        p->utime_ns = record->utime_ns;
        for (size_t i = 0; i < record->n_tools; i++) {
            if (record->tools[i].due) {
                publish_force(p, record, &record->tools[i]);
            }
        }
        ring_release(&p->s->forces);
    }
}

static void fill_times(const histogram *h, double *p50, double *p99, double *p999, double *max) {
    *p50 = 1e-3 * (double)histogram_quantile_ns(h, 0.5);
    *p99 = 1e-3 * (double)histogram_quantile_ns(h, 0.99);
    *p999 = 1e-3 * (double)histogram_quantile_ns(h, 0.999);
    *max = 1e-3 * (double)h->max_ns;
}

static void publish_status(publisher *p) {
    bool fresh;
    const loop_stats *st = mailbox_front(&p->s->stats, &fresh);
    if (!fresh) {
        return;
    }
    const rx_counters *c = &p->s->counters;
    shcdmsg_loop_status_t m = {0};
    m.utime = st->utime_ns / 1000;
    m.tick = st->tick;
    m.nominal_rate_hz = p->s->config->rate_hz;
    m.actual_rate_hz = st->actual_rate_hz;
    m.state = st->state;
    m.rt_flags = st->rt_flags;
    m.missed_ticks = st->missed_ticks;
    m.missed_events = st->missed_events;
    m.self_overruns = st->self_overruns;
    m.rx_ok = atomic_load_explicit(&c->ok, memory_order_relaxed);
    m.rx_lost = atomic_load_explicit(&c->lost, memory_order_relaxed);
    for (size_t i = 0; i < REJECT_COUNT; i++) {
        m.rx_reject[i] = atomic_load_explicit(&c->reject[i], memory_order_relaxed);
        m.rx_bad += m.rx_reject[i];
    }
    m.tx_dropped = st->tx_dropped + p->dropped;
    fill_times(&st->wake, &m.wake_p50_us, &m.wake_p99_us, &m.wake_p999_us, &m.wake_max_us);
    fill_times(&st->compute, &m.compute_p50_us, &m.compute_p99_us, &m.compute_p999_us,
               &m.compute_max_us);
    histogram_octaves(&st->wake, m.wake_hist);
    histogram_octaves(&st->compute, m.compute_hist);
    send_bytes(p, p->t->status, shcdmsg_loop_status_t_encode(p->bytes, 0, MESSAGE_BYTES_MAX, &m));
}

static void publish_ack(publisher *p, shcdmsg_command_ack_t *ack) {
    ack->utime = shared_now_ns() / 1000;
    send_bytes(p, p->t->ack, shcdmsg_command_ack_t_encode(p->bytes, 0, MESSAGE_BYTES_MAX, ack));
}

static void serve_commands(publisher *p) {
    shcdmsg_command_ack_t ack;
    const tick_applied *applied;
    const shcdmsg_command_t *command;
    while ((applied = ring_peek(&p->s->applied)) != NULL) {
        if (commands_confirm(&p->table, applied, &ack)) {
            publish_ack(p, &ack);
        }
        ring_release(&p->s->applied);
    }
    while ((command = ring_peek(&p->s->inbound)) != NULL) {
        if (commands_take(&p->table, command, &p->s->commands, &ack)) {
            publish_ack(p, &ack);
        }
        ring_release(&p->s->inbound);
    }
}

/* The coefficients are those of the model: no effect deforms a body as yet. */
static void publish_deform(publisher *p) {
    const daemon_config *config = p->s->config;
    const size_t n_bodies = shcd_scene_body_count(config->scene);
    const int64_t now_ns = p->utime_ns;
    const size_t body = p->deform_body;
    if (n_bodies == 0 || now_ns < p->deform_due_ns ||
        (p->deform_sent_ns[body] != 0 && now_ns < p->deform_sent_ns[body] + DEFORM_BODY_NS)) {
        return;
    }
    p->deform_due_ns = now_ns + DEFORM_SLOT_NS;
    p->deform_sent_ns[body] = now_ns;
    p->deform_body = (body + 1) % n_bodies;

    shcdmsg_deform_state_t m = {0};
    const shcd_pose pose = config->body_in_world[body];
    const double *source = shcd_model_coefficients(config->models[body]);
    m.utime = now_ns / 1000;
    m.tick = p->tick;
    m.scene_rev = 1;
    m.body_id = (int32_t)body;
    snprintf((char *)m.name, sizeof m.name, "%s", shcd_scene_body_name(config->scene, body));
    copy_vec3(m.pos, pose.position_m);
    m.quat[0] = pose.orientation.w;
    m.quat[1] = pose.orientation.x;
    m.quat[2] = pose.orientation.y;
    m.quat[3] = pose.orientation.z;
    m.model_degree = shcd_model_degree(config->models[body]);
    m.degree = m.model_degree < DEFORM_DEGREE_MAX ? m.model_degree : DEFORM_DEGREE_MAX;
    m.n = (int32_t)(3 * SHCD_COUNT(m.degree));
    for (int32_t i = 0; i < m.n; i++) {
        p->coefficients[i] = (float)source[i];
    }
    m.coeff = p->coefficients;
    send_bytes(p, p->t->deform, shcdmsg_deform_state_t_encode(p->bytes, 0, MESSAGE_BYTES_MAX, &m));
}

static void *run_publisher(void *argument) {
    publisher *p = argument;
    struct pollfd wake = {p->s->wake_fd, POLLIN, 0};
    for (;;) {
        /* read before the work: what arrives meanwhile wakes the next round */
        const bool stop = atomic_load_explicit(&p->s->stop_publish, memory_order_acquire);
        publish_forces(p);
        serve_commands(p);
        publish_status(p);
        publish_deform(p);
        if (stop) {
            return NULL;
        }
        poll(&wake, 1, 100);
        uint64_t count;
        const ssize_t n = read(p->s->wake_fd, &count, sizeof count);
        (void)n; /* nothing to read after a time-out */
    }
}

publisher *publisher_start(const transport *t, shared *s) {
    publisher *p = calloc(1, sizeof *p);
    if (p == NULL) {
        return NULL;
    }
    p->s = s;
    p->t = t;
    if (pthread_create(&p->thread, NULL, run_publisher, p) != 0) {
        free(p);
        return NULL;
    }
    return p;
}

void publisher_stop(publisher *p) {
    if (p != NULL) {
        atomic_store_explicit(&p->s->stop_publish, true, memory_order_release);
        shared_wake(p->s);
        pthread_join(p->thread, NULL);
        free(p);
    }
}
