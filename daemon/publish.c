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
#define DEFORM_SLOT_NS 4000000 /* bodies are sent in turn, one in each of these */
#define DEFORM_DEGREE_MAX 69   /* the highest whose message stays below MESSAGE_BYTES_MAX */
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
    void *shapes[SHCD_BODIES_MAX]; /* to compute volumes with */
    double rest_volume_m3[SHCD_BODIES_MAX];
    shcdmsg_effect_cost_t effects[LOOP_EFFECTS_MAX];
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
    m.displacement = r->displacement_m;
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

static void fill_effects(publisher *p, const loop_stats *st, shcdmsg_loop_status_t *m) {
    const shcd_scene *scene = p->s->config->scene;
    m->n_effects = (int32_t)st->n_effects;
    m->effects = p->effects;
    for (size_t e = 0; e < st->n_effects; e++) {
        const effect_time *t = &st->effects[e];
        shcdmsg_effect_cost_t *out = &p->effects[e];
        out->body_id = (int32_t)shcd_scene_effect_body(scene, e);
        out->active = t->is_active ? 1 : 0;
        snprintf((char *)out->name, sizeof out->name, "%s", shcd_scene_effect_name(scene, e));
        out->mean_us = t->n > 0 ? (float)(1e-3 * t->sum_ns / (double)t->n) : 0.0f;
        out->max_us = (float)(1e-3 * t->max_ns);
        out->energy_j = t->energy_j;
        out->stored_j = t->stored_j;
        out->driven_j = t->driven_j;
    }
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
    m.given_j = st->energy.given_j;
    m.taken_j = st->energy.taken_j;
    m.output_chain_j = st->energy.output_chain_j;
    m.stored_j = st->energy.stored_j;
    m.driven_j = st->energy.driven_j;
    m.reserve_left_j = st->energy.reserve_left_j;
    m.passivity_ticks = st->energy.passivity_ticks;
    fill_effects(p, st, &m);
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

/* The newest coefficients of a body; NULL if it has none that a viewer does not know. */
static const double *newest_shape(publisher *p, size_t body) {
    deform_boxes *boxes = &p->s->deforms;
    const int64_t since_ns = p->utime_ns - p->deform_sent_ns[body];
    bool fresh;
    if (!boxes->is_soft[body]) {
        return p->deform_sent_ns[body] == 0 || since_ns >= DEFORM_RIGID_NS
                   ? shcd_model_coefficients(p->s->config->models[body])
                   : NULL;
    }
    const deform_snapshot *s = mailbox_front(&boxes->box[body], &fresh);
    return fresh ? s->coefficients : NULL;
}

static void fill_volumes(publisher *p, size_t body, const double *coefficients,
                         shcdmsg_deform_state_t *m) {
    const shcd_model *model = p->s->config->models[body];
    void *shape_memory = p->shapes[body];
    shcd_shape *shape;
    if (shcd_shape_init(model, shape_memory, shcd_shape_size(model), &shape) != SHCD_OK) {
        return; /* cannot be: publisher_start() made it of that size */
    }
    if (p->rest_volume_m3[body] == 0.0) {
        p->rest_volume_m3[body] = deform_volume(model, shape, shcd_model_coefficients(model));
    }
    m->rest_volume = p->rest_volume_m3[body];
    m->volume = p->s->deforms.is_soft[body] ? deform_volume(model, shape, coefficients)
                                            : p->rest_volume_m3[body];
}

static void publish_shape(publisher *p, size_t body, const double *source) {
    const daemon_config *config = p->s->config;
    shcdmsg_deform_state_t m = {0};
    const shcd_pose pose = config->body_in_world[body];
    m.utime = p->utime_ns / 1000;
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
    fill_volumes(p, body, source, &m);
    send_bytes(p, p->t->deform, shcdmsg_deform_state_t_encode(p->bytes, 0, MESSAGE_BYTES_MAX, &m));
}

/* The next body that has something to show, if the last message is not too near. */
static void publish_deform(publisher *p) {
    const size_t n_bodies = p->s->deforms.n_bodies;
    if (p->utime_ns < p->deform_due_ns) {
        return;
    }
    for (size_t n = 0; n < n_bodies; n++) {
        const size_t body = p->deform_body;
        const double *coefficients = newest_shape(p, body);
        p->deform_body = (body + 1) % n_bodies;
        if (coefficients != NULL) {
            p->deform_due_ns = p->utime_ns + DEFORM_SLOT_NS;
            p->deform_sent_ns[body] = p->utime_ns;
            publish_shape(p, body, coefficients);
            return;
        }
    }
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

static void release(publisher *p) {
    for (size_t b = 0; b < SHCD_BODIES_MAX; b++) {
        free(p->shapes[b]);
    }
    free(p);
}

publisher *publisher_start(const transport *t, shared *s) {
    publisher *p = calloc(1, sizeof *p);
    if (p == NULL) {
        return NULL;
    }
    p->s = s;
    p->t = t;
    p->table.scene = s->config->scene;
    for (size_t b = 0; b < s->deforms.n_bodies; b++) {
        const size_t bytes = EXCHANGE_STRIDE(shcd_shape_size(s->config->models[b]));
        p->shapes[b] = aligned_alloc(EXCHANGE_LINE, bytes);
        if (p->shapes[b] == NULL) {
            release(p);
            return NULL;
        }
    }
    if (pthread_create(&p->thread, NULL, run_publisher, p) != 0) {
        release(p);
        return NULL;
    }
    return p;
}

void publisher_stop(publisher *p) {
    if (p != NULL) {
        atomic_store_explicit(&p->s->stop_publish, true, memory_order_release);
        shared_wake(p->s);
        pthread_join(p->thread, NULL);
        release(p);
    }
}
