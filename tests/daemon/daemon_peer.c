/* SPDX-License-Identifier: BSD-3-Clause */
#include "daemon_peer.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define PERIOD_US 1000
#define DAEMON_DURATION "--duration=100" /* s; the end if everything else fails */

int64_t peer_now_us(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

/* ---- the process ---------------------------------------------------------------------------- */

static pid_t spawn(const char *path, char *const argv[], int stderr_fd) {
    const pid_t parent = getpid();
    const pid_t pid = fork();
    if (pid == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent) {
            _exit(126);
        }
        if (stderr_fd >= 0) {
            dup2(stderr_fd, STDERR_FILENO);
            dup2(stderr_fd, STDOUT_FILENO);
        }
        execv(path, argv);
        _exit(127);
    }
    return pid;
}

static int exit_status(pid_t pid) {
    int status;
    while (waitpid(pid, &status, 0) < 0) {
        if (errno != EINTR) {
            return -1;
        }
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

int peer_run(const char *path, char *const argv[], char *stderr_text, size_t stderr_size) {
    int ends[2];
    size_t n = 0;
    if (pipe2(ends, O_CLOEXEC) != 0) {
        return -1;
    }
    const pid_t pid = spawn(path, argv, ends[1]);
    close(ends[1]);
    for (;;) {
        char rest[256];
        const bool room = n + 1 < stderr_size;
        const ssize_t got =
            read(ends[0], room ? stderr_text + n : rest, room ? stderr_size - 1 - n : sizeof rest);
        if (got <= 0) {
            break;
        }
        n += room ? (size_t)got : 0;
    }
    stderr_text[n] = '\0';
    close(ends[0]);
    return pid > 0 ? exit_status(pid) : -1;
}

int peer_stop(peer *p, int signal) {
    if (p->pid <= 0) {
        return -1;
    }
    kill(p->pid, signal);
    const int status = exit_status(p->pid);
    p->pid = 0;
    return status;
}

void peer_close(peer *p) {
    peer_stop(p, SIGKILL);
    if (p->lcm != NULL) {
        lcm_destroy(p->lcm); /* and its subscriptions */
    }
    p->lcm = NULL;
}

/* ---- what it says --------------------------------------------------------------------------- */

/* Raw handlers: what the generated ones allocate to subscribe lives until they unsubscribe. */

static void on_force(const lcm_recv_buf_t *buffer, const char *channel, void *user) {
    peer *p = user;
    shcdmsg_tool_force_t m;
    (void)channel;
    if (shcdmsg_tool_force_t_decode(buffer->data, 0, (int)buffer->data_size, &m) < 0) {
        return;
    }
    if (m.tool_id >= 0 && m.tool_id < PEER_TOOLS_MAX) {
        p->last[m.tool_id] = m;
    }
    if (m.tool_id == p->watched_tool && p->n_forces < PEER_FORCES_MAX) {
        p->forces[p->n_forces++] = m;
    }
}

static void on_status(const lcm_recv_buf_t *buffer, const char *channel, void *user) {
    peer *p = user;
    shcdmsg_loop_status_t m;
    (void)channel;
    if (shcdmsg_loop_status_t_decode(buffer->data, 0, (int)buffer->data_size, &m) >= 0) {
        p->status = m;
        p->status.effects = NULL;
        p->n_status++;
        shcdmsg_loop_status_t_decode_cleanup(&m);
    }
}

static void on_deform(const lcm_recv_buf_t *buffer, const char *channel, void *user) {
    peer *p = user;
    shcdmsg_deform_state_t m;
    (void)channel;
    if (shcdmsg_deform_state_t_decode(buffer->data, 0, (int)buffer->data_size, &m) >= 0) {
        for (int32_t i = 0; i < m.n && i < PEER_COEFFICIENTS_MAX; i++) {
            p->coefficients[i] = m.coeff[i];
        }
        p->deform = m;
        p->deform.coeff = NULL;
        p->n_deform++;
        shcdmsg_deform_state_t_decode_cleanup(&m);
    }
}

static void on_ack(const lcm_recv_buf_t *buffer, const char *channel, void *user) {
    peer *p = user;
    shcdmsg_command_ack_t m;
    (void)channel;
    if (shcdmsg_command_ack_t_decode(buffer->data, 0, (int)buffer->data_size, &m) >= 0) {
        p->ack = m;
        p->n_acks++;
    }
}

static bool subscribe_all(peer *p) {
    static const struct {
        const char *channel;
        lcm_msg_handler_t handler;
    } table[4] = {{"SHCD_FORCE", on_force},
                  {"SHCD_STATUS", on_status},
                  {"SHCD_DEFORM", on_deform},
                  {"SHCD_ACK", on_ack}};
    for (int i = 0; i < 4; i++) {
        p->subscriptions[i] = lcm_subscribe(p->lcm, table[i].channel, table[i].handler, p);
        if (p->subscriptions[i] == NULL ||
            lcm_subscription_set_queue_capacity(p->subscriptions[i], PEER_FORCES_MAX) != 0) {
            return false;
        }
    }
    return true;
}

void peer_listen(peer *p, int64_t until_us) {
    for (;;) {
        const int64_t left_us = until_us - peer_now_us();
        struct pollfd ready = {lcm_get_fileno(p->lcm), POLLIN, 0};
        const struct timespec timeout = {left_us > 0 ? (time_t)(left_us / 1000000) : 0,
                                         left_us > 0 ? (long)(left_us % 1000000) * 1000 : 0};
        if (ppoll(&ready, 1, &timeout, NULL) > 0) {
            lcm_handle(p->lcm);
        } else if (left_us <= 0) {
            return;
        }
    }
}

bool peer_start(peer *p, const char *path) {
    return peer_start_scene(p, path, NULL);
}

bool peer_start_scene(peer *p, const char *path, const char *scene) {
    static char name[] = "shcdd", duration[] = DAEMON_DURATION, quiet[] = "--quiet";
    static char file[4096];
    char *const argv[] = {name, duration, quiet, scene != NULL ? file : NULL, NULL};
    snprintf(file, sizeof file, "%s", scene != NULL ? scene : "");
    memset(p, 0, sizeof *p);
    p->lcm = lcm_create(NULL);
    if (p->lcm == NULL || !subscribe_all(p)) {
        return false;
    }
    p->pid = spawn(path, argv, -1);
    p->last[0].tool_seq = -1;
    for (int i = 0; i < 1000 && p->last[0].tool_seq < 0; i++) { /* no discovery: ping */
        const shcdmsg_tool_pose_t m = peer_pose(p, 1.0, 0.0, 0.0);
        peer_send(p, &m);
        peer_listen(p, peer_now_us() + 10000);
    }
    return p->last[0].tool_seq >= 0;
}

/* ---- what it is told ------------------------------------------------------------------------ */

shcdmsg_tool_pose_t peer_pose(peer *p, double x, double y, double z) {
    shcdmsg_tool_pose_t m = {0};
    m.utime = peer_now_us();
    m.seq = p->seq++;
    m.flags = SHCDMSG_TOOL_POSE_T_FORCE_ENABLE;
    m.pos[0] = x;
    m.pos[1] = y;
    m.pos[2] = z;
    return m;
}

void peer_send(peer *p, const shcdmsg_tool_pose_t *m) {
    shcdmsg_tool_pose_t_publish(p->lcm, "SHCD_TOOL", m);
}

int peer_hold(peer *p, double x, double y, double z, int n) {
    const shcdmsg_tool_pose_t pose = {.flags = SHCDMSG_TOOL_POSE_T_FORCE_ENABLE, .pos = {x, y, z}};
    return peer_hold_pose(p, &pose, n);
}

int peer_hold_pose(peer *p, const shcdmsg_tool_pose_t *pose, int n) {
    int sent = 0;
    int64_t next_us = peer_now_us();
    for (int i = 0; i < n; i++) {
        peer_listen(p, next_us);
        const int64_t late_us = peer_now_us() - next_us;
        const int64_t skipped = late_us / PERIOD_US;
        i += (int)skipped;
        next_us += (skipped + 1) * PERIOD_US;
        shcdmsg_tool_pose_t m = *pose;
        m.utime = peer_now_us();
        m.seq = p->seq++;
        peer_send(p, &m);
        sent++;
    }
    peer_listen(p, next_us);
    return sent;
}

int64_t peer_ping(peer *p, double x, double y, double z, int64_t timeout_us) {
    const shcdmsg_tool_pose_t m = peer_pose(p, x, y, z);
    peer_send(p, &m);
    while (p->last[0].tool_seq != m.seq) {
        const int64_t now_us = peer_now_us();
        if (now_us - m.utime > timeout_us) {
            return -1;
        }
        peer_listen(p, now_us + 100);
    }
    return peer_now_us() - m.utime;
}

bool peer_next_status(peer *p) {
    const int64_t begin_us = peer_now_us();
    while (p->status.utime < begin_us && peer_now_us() < begin_us + 2000000) {
        peer_listen(p, peer_now_us() + 10000);
    }
    return p->status.utime >= begin_us;
}

bool peer_command(peer *p, shcdmsg_command_t *command) {
    const int64_t begin_us = peer_now_us();
    memset(&p->ack, 0, sizeof p->ack);
    while (peer_now_us() < begin_us + 2000000) {
        command->utime = peer_now_us();
        shcdmsg_command_t_publish(p->lcm, "SHCD_COMMAND", command);
        for (int i = 0; i < 10; i++) {
            peer_listen(p, peer_now_us() + 10000);
            if (p->ack.client_id == command->client_id && p->ack.cmd_id == command->cmd_id) {
                return true;
            }
        }
    }
    return false;
}
