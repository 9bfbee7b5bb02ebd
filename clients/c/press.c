/* SPDX-License-Identifier: BSD-3-Clause */
/* A complete client of shcdd: a tool approaches a body, presses, slides, holds and leaves.
 *
 * Once a period, on an absolute clock, it says where the tool is (SHCD_TOOL); between two poses it
 * takes whatever forces have come in (SHCD_FORCE). UDP may lose messages, so nothing waits for an
 * answer: each one names the pose it belongs to (tool_seq, and tool_utime as proof that the pose
 * was ours). Latency is the age of that pose on our own clock; the clocks of the two sides are
 * never compared. The daemon knows the body, the client does not: it asks where the surface is
 * below both ends of its path. The segment from a point to its closest surface point runs along
 * the normal there, so that is the way to press and to leave. */
#define _POSIX_C_SOURCE 200809L
#include "shcdmsg_loop_status_t.h"
#include "shcdmsg_tool_force_t.h"
#include "shcdmsg_tool_pose_t.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/select.h>
#include <time.h>

static double tool = 0, from[3] = {-0.015, 0, 0.06}, to[3] = {0.015, 0, 0.06}, depth = 0.003;
static double radius = 0, speed = 0.02, hold_s = 1, stay_s = 0, rate_hz = 1000;
static const struct option {
    const char *name, *help;
    int n_values;
    double *value, min, max;
} options[] = {
    {"--tool", "id of the tool in the scene", 1, &tool, 0, 255},
    {"--radius", "its radius in the scene, 0 for a point [m]", 1, &radius, 0, 1},
    {"--from", "x,y,z to start at, outside the body, world [m]", 3, from, -10, 10},
    {"--to", "x,y,z to end at, likewise", 3, to, -10, 10},
    {"--depth", "how deep to press at both ends of the slide [m]", 1, &depth, 0, 1},
    {"--speed", "mean speed of each leg [m/s]", 1, &speed, 1e-4, 1},
    {"--hold", "how long to hold still before leaving [s]", 1, &hold_s, 0, 3600},
    {"--stay", "how long to stay after that, to see a soft body ring [s]", 1, &stay_s, 0, 3600},
    {"--rate", "poses in a second [Hz]", 1, &rate_hz, 10, 10000},
    {"--csv", "file for all answers", 0, NULL, 0, 0}};

enum { SENT = 4096, TRIPS = 1000000, OPTIONS = sizeof options / sizeof *options };
static lcm_t *lcm;
static double stored_j; /* by springs and bodies, from the last status message */
static FILE *csv;       /* in memory: no disk access while the loop runs */
static const char *csv_path;
static int64_t seq, deadline_ns;         /* last pose sent, next point of the time grid */
static shcdmsg_tool_pose_t sent[SENT];   /* the last ones, at seq modulo SENT */
static shcdmsg_tool_force_t first, last; /* answers */
static uint32_t trips[TRIPS]; /* how many poses were answered after so many microseconds */
static int64_t n_late, n_answered, n_limited;
static double peak_n, peak_m, contact_s;

static int64_t now_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void die(int status, const char *text, const char *what) {
    fprintf(stderr, "press: %s%s\n", text, what);
    exit(status);
}

static void on_force(const lcm_recv_buf_t *buffer, const char *channel,
                     const shcdmsg_tool_force_t *m, void *user) {
    (void)buffer, (void)channel, (void)user;
    if (m->tool_id != (int)tool || m->tool_seq < 1 || m->tool_seq > seq ||
        m->tool_seq <= seq - SENT || m->tool_seq < last.tool_seq ||
        m->tool_utime != sent[m->tool_seq % SENT].utime) {
        return; /* for another tool or client, or overtaken by a newer answer */
    }
    const int64_t trip_us = now_ns() / 1000 - m->tool_utime;
    if (m->tool_seq > last.tool_seq) { /* else the daemon had no newer pose for this tick */
        n_answered++;
        trips[trip_us < TRIPS ? trip_us : TRIPS - 1]++;
    }
    if (last.tool_seq == 0) {
        first = last = *m;
    }
    contact_s += m->penetration > 0.0 ? 1e-6 * (double)(m->utime - last.utime) : 0.0;
    n_limited += (m->flags & (SHCDMSG_TOOL_FORCE_T_LIMITED | SHCDMSG_TOOL_FORCE_T_SLEW)) != 0;
    peak_n = fmax(peak_n, sqrt(dot(m->force, m->force)));
    peak_m = fmax(peak_m, m->penetration);
    last = *m;
    /* distance: signed, from the surface to the middle of the tool */
    const double *p = sent[m->tool_seq % SENT].pos, *f = m->force;
    fprintf(csv, "%.6f,%" PRId64 ",%" PRId64 ",%.9g,%.9g,%.9g,%.12g,%.12g,%.12g,%.12g,%.12g",
            1e-6 * (double)(m->utime - first.utime), m->tick, m->tool_seq, p[0], p[1], p[2], f[0],
            f[1], f[2], m->penetration, dot(p, m->normal) - dot(m->proxy, m->normal));
    fprintf(csv, ",%.6f,%d,%.12g,%.12g\n", 1e-6 * (double)trip_us, m->flags, m->displacement,
            stored_j);
}

static void on_status(const lcm_recv_buf_t *buffer, const char *channel,
                      const shcdmsg_loop_status_t *m, void *user) {
    (void)buffer, (void)channel, (void)user;
    stored_j = m->stored_j;
}

/* Sends a pose, then takes forces until the next point of the time grid, and any still waiting. */
static void tick(const double position[3], const double velocity[3]) {
    shcdmsg_tool_pose_t *pose = &sent[++seq % SENT];
    *pose = (shcdmsg_tool_pose_t){.utime = now_ns() / 1000, .seq = seq, .tool_id = (int)tool};
    pose->flags = SHCDMSG_TOOL_POSE_T_HAS_VEL | SHCDMSG_TOOL_POSE_T_FORCE_ENABLE;
    memcpy(pose->pos, position, sizeof pose->pos);
    memcpy(pose->vel, velocity, sizeof pose->vel);
    shcdmsg_tool_pose_t_publish(lcm, "SHCD_TOOL", pose);

    const int64_t period_ns = (int64_t)(1e9 / rate_hz);
    const int64_t missed = (now_ns() - deadline_ns) / period_ns; /* skip them, do not catch up */
    n_late += missed;
    deadline_ns += (missed + 1) * period_ns;
    for (;;) {
        const int64_t left_ns = deadline_ns - now_ns();
        const struct timespec timeout = {0, left_ns > 0 ? (long)left_ns : 0};
        fd_set set;
        FD_ZERO(&set);
        FD_SET(lcm_get_fileno(lcm), &set);
        if (pselect(lcm_get_fileno(lcm) + 1, &set, NULL, NULL, &timeout, NULL) <= 0) {
            return;
        }
        lcm_handle(lcm);
    }
}

/* Moves straight from a to b with a smooth start and end (minimum jerk); a = b holds still. */
static void move(const double a[3], const double b[3], double time_s) {
    const double ab[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double duration_s = fmax(time_s, sqrt(dot(ab, ab)) / speed) + 1e-3;
    const int64_t start_ns = deadline_ns;
    for (double s = 0.0, last_s = 0.0; last_s < 1.0;) {
        double p[3], v[3];
        for (int i = 0; i < 3; i++) {
            p[i] = a[i] + ab[i] * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
            v[i] = ab[i] * 30.0 * s * s * (1.0 - s) * (1.0 - s) / duration_s;
        }
        tick(p, v);
        last_s = s;
        s = fmin(1.0, 1e-9 * (double)(deadline_ns - start_ns) / duration_s);
    }
}

/* Rests at a point until the daemon has answered, then says where to be to press below it. Answers
 * without a body come from a daemon that takes the pose for stale, as after a stall. */
static void ask(const double point[3], double pressed[3]) {
    const int64_t asked = seq, give_up_ns = now_ns() + 10000000000;
    while (last.tool_seq <= asked || last.body_id < 0) {
        if (now_ns() > give_up_ns) {
            die(1,
                "no answer in 10 s: does shcdd run here, with this tool and a body in its scene?",
                "");
        }
        tick(point, (const double[3]){0});
    }
    if (last.penetration > 0.0) {
        die(1, "the path does not begin and end outside the body", "");
    }
    for (int i = 0; i < 3; i++) {
        pressed[i] = last.proxy[i] + (radius - depth) * last.normal[i];
    }
}

/* The time below which a part of the round trips was [ms]. */
static double percentile_ms(double part) {
    int us = 0;
    for (int64_t left = (int64_t)(part * (double)(n_answered - 1)); (left -= trips[us]) >= 0;) {
        us++;
    }
    return 1e-3 * us;
}

static void read_options(int argc, char **argv) {
    for (int i = 1; i < argc; i += 2) {
        const struct option *o = options, *past = options + OPTIONS;
        while (o < past && strcmp(argv[i], o->name) != 0) {
            o++;
        }
        if (strcmp(argv[i], "--help") == 0) {
            for (o = options; o < past; o++) {
                printf("%-8s %s\n", o->name, o->help);
            }
            exit(0);
        }
        if (o == past || i + 1 == argc) {
            die(2, "unknown option, or one without a value (see --help): ", argv[i]);
        }
        char *text = argv[i + 1];
        csv_path = o->n_values == 0 ? text : csv_path;
        for (int k = 0; k < o->n_values; k++, text++) {
            const char *start = text;
            o->value[k] = strtod(start, &text);
            if (text == start || *text != (k + 1 < o->n_values ? ',' : '\0') ||
                !(o->value[k] >= o->min && o->value[k] <= o->max)) {
                die(2, "not a value for this option, or out of range: ", argv[i + 1]);
            }
        }
    }
}

int main(int argc, char **argv) {
    double pressed_from[3], pressed_to[3];
    char *table = NULL;
    size_t table_size = 0;
    read_options(argc, argv);
    if ((lcm = lcm_create(NULL)) == NULL) {
        die(1, "no LCM: is there a multicast route on the loopback device?", "");
    }
    shcdmsg_tool_force_t_subscription_t *forces =
        shcdmsg_tool_force_t_subscribe(lcm, "SHCD_FORCE", on_force, NULL);
    shcdmsg_loop_status_t_subscription_t *statuses =
        shcdmsg_loop_status_t_subscribe(lcm, "SHCD_STATUS", on_status, NULL);
    /* a full queue drops the newest message: make it longer than any pause of this program */
    shcdmsg_tool_force_t_subscription_set_queue_capacity(forces, 10000);
    if ((csv = open_memstream(&table, &table_size)) == NULL) {
        die(1, "out of memory", "");
    }
    fputs("time_s,tick,seq,x_m,y_m,z_m,fx_n,fy_n,fz_n,penetration_m,distance_m,rtt_s,flags,"
          "displacement_m,stored_j\n",
          csv);

    const int64_t start_ns = deadline_ns = now_ns();
    ask(to, pressed_to);
    ask(from, pressed_from);
    while ((last.flags & SHCDMSG_TOOL_FORCE_T_RAMP) != 0) {
        tick(from, (const double[3]){0}); /* the soft start would take a part of the force */
    }
    move(from, pressed_from, 0);
    move(pressed_from, pressed_to, 0);
    move(pressed_to, pressed_to, hold_s);
    const shcdmsg_tool_force_t held = last;
    move(pressed_to, to, 0);
    if (stay_s > 0.0) {
        move(to, to, stay_s);
    }

    printf("poses       %" PRId64 " sent at %.1f Hz (%" PRId64 " late), %.2f %% answered\n", seq,
           1e9 * (double)seq / (double)(now_ns() - start_ns), n_late,
           100.0 * (double)n_answered / (double)(seq - first.tool_seq + 1));
    printf("daemon      %.1f ticks/s, %" PRId64 " of them with a limited force\n",
           1e6 * (double)(last.tick - first.tick) / (double)(last.utime - first.utime), n_limited);
    printf("round trip  p50 %.3f, p99 %.3f, p99.9 %.3f, max %.3f ms\n", percentile_ms(0.5),
           percentile_ms(0.99), percentile_ms(0.999), percentile_ms(1.0));
    printf("contact     %.3f s, at most %.4f N and %.4f mm deep\n", contact_s, peak_n,
           1e3 * peak_m);
    printf("held        %.9f N at a depth of %.9f mm\n", sqrt(dot(held.force, held.force)),
           1e3 * held.penetration);
    FILE *file = csv_path != NULL ? fopen(csv_path, "w") : stdout;
    if (fclose(csv) != 0 || file == NULL || (file != stdout && fputs(table, file) < 0) ||
        fclose(file) != 0) {
        die(1, "cannot write ", csv_path != NULL ? csv_path : "");
    }
    free(table);
    shcdmsg_loop_status_t_unsubscribe(lcm, statuses);
    shcdmsg_tool_force_t_unsubscribe(lcm, forces);
    lcm_destroy(lcm);
    return 0;
}
