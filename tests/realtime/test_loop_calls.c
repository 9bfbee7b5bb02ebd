/* SPDX-License-Identifier: BSD-3-Clause */
/* System calls of the daemon's loop thread, of the real program, seen from outside: while a tool
 * comes, presses, falls silent and returns, and a command is carried out, the thread sleeps until
 * the next grid point, reads its own CPU clock and wakes the publisher. Nothing else: no lock that
 * has to wait (futex), no memory (brk, mmap), no file, no socket, no fault handler.
 *
 * The thread is known by what only it does: it sets its timer slack before its first tick. */
#include "daemon_peer.h"

#include "realtime/sanitized.h"
#include "support/check.h"

#include <signal.h>
#include <string.h>
#include <time.h>

#define LINE_BYTES 4096
#define NAMES_MAX 16

static peer p;
static const char *program;

typedef struct call_count {
    char name[32];
    long n;
} call_count;

typedef struct tally {
    call_count calls[NAMES_MAX];
    size_t n_names;
} tally;

/* ---- the trace: "TID name(arguments) = result", or "TID <... name resumed>..." ----------------
 */

/* The start of the text behind the thread's number, or NULL if it is another thread's line. */
static const char *line_of(const char *line, long tid) {
    char *rest;
    if (strtol(line, &rest, 10) != tid || rest == line) {
        return NULL;
    }
    return rest + strspn(rest, " ");
}

static long find_loop_thread(FILE *trace) {
    char line[LINE_BYTES];
    long found = -1;
    rewind(trace);
    while (fgets(line, sizeof line, trace) != NULL) {
        const long tid = strtol(line, NULL, 10);
        if (strstr(line, " prctl(PR_SET_TIMERSLACK, 1") != NULL) {
            assert_true(found < 0 || found == tid);
            found = tid;
        }
    }
    return found;
}

static void count_call(tally *t, const char *name, size_t length) {
    for (size_t i = 0; i < t->n_names; i++) {
        if (strlen(t->calls[i].name) == length && strncmp(t->calls[i].name, name, length) == 0) {
            t->calls[i].n++;
            return;
        }
    }
    assert_true(t->n_names < NAMES_MAX && length < sizeof t->calls[0].name);
    memcpy(t->calls[t->n_names].name, name, length);
    t->calls[t->n_names++].n = 1;
}

static void check_call(const char *text) {
    static const char *const allowed[] = {
        "clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, ", "clock_gettime(CLOCK_THREAD_CPUTIME_ID",
        "clock_gettime(CLOCK_MONOTONIC", /* where the kernel cannot answer it in user space */
        "restart_syscall("};             /* the sleep goes on after an interruption */
    for (size_t i = 0; i < sizeof allowed / sizeof allowed[0]; i++) {
        if (strncmp(text, allowed[i], strlen(allowed[i])) == 0) {
            return;
        }
    }
    if (strncmp(text, "write(", 6) == 0 && strstr(text, "[eventfd]>, ") != NULL) {
        return;
    }
    fail_msg("the loop thread called %s", text);
}

/* Calls from the first sleep to the last: the ticks, without the thread's start and end. */
static tally count_ticks(FILE *trace, long tid) {
    char line[LINE_BYTES];
    tally t = {{{"", 0}}, 0};
    long n_lines = 0, last = 0;
    for (int pass = 0; pass < 2; pass++) {
        long n = 0;
        int started = 0;
        rewind(trace);
        while (fgets(line, sizeof line, trace) != NULL) {
            const char *text = line_of(line, tid);
            if (text == NULL || strncmp(text, "<... ", 5) == 0) {
                continue;
            }
            n++;
            if (strncmp(text, "clock_nanosleep(", 16) == 0) {
                started = 1;
                n_lines = n;
            }
            if (pass == 1 && started && n <= last) {
                check_call(text);
                count_call(&t, text, strcspn(text, "("));
            }
        }
        last = n_lines;
    }
    return t;
}

static long calls(const tally *t, const char *name) {
    for (size_t i = 0; i < t->n_names; i++) {
        if (strcmp(t->calls[i].name, name) == 0) {
            return t->calls[i].n;
        }
    }
    return 0;
}

/* The tracer writes on for a moment after the daemon has gone. */
static FILE *open_trace(const char *path, long pid) {
    char line[LINE_BYTES], end[32];
    snprintf(end, sizeof end, "+++ exited with");
    for (int i = 0; i < 500; i++) {
        const struct timespec pause = {0, 10000000};
        FILE *trace = fopen(path, "r");
        while (trace != NULL && fgets(line, sizeof line, trace) != NULL) {
            if (strtol(line, NULL, 10) == pid && strstr(line, end) != NULL) {
                return trace;
            }
        }
        if (trace != NULL) {
            fclose(trace);
        }
        nanosleep(&pause, NULL);
    }
    return NULL;
}

/* ---- the run -------------------------------------------------------------------------------- */

static void press_and_leave(void) {
    shcdmsg_command_t reset = {0};
    double x = 0.3;
    while (x > 0.0 && (p.last[0].flags & SHCDMSG_TOOL_FORCE_T_CONTACT) == 0) {
        peer_hold(&p, x -= 0.005, 0.0, 0.0, 20);
    }
    assert_true((p.last[0].flags & SHCDMSG_TOOL_FORCE_T_CONTACT) != 0);
    peer_hold(&p, x - 0.01, 0.0, 0.0, 1000);
    reset.client_id = peer_now_us();
    reset.cmd_id = 1;
    reset.op = SHCDMSG_COMMAND_T_RESET;
    assert_true(peer_command(&p, &reset));
    peer_listen(&p, peer_now_us() + 700000); /* silent: hold, ramp, inactive */
    peer_hold(&p, x - 0.01, 0.0, 0.0, 500);
    peer_hold(&p, 0.3, 0.0, 0.0, 100);
}

static void test_loop_thread_sleeps_reads_its_clock_and_wakes_the_publisher(void **state) {
    (void)state;
    assert_true(peer_start(&p, program));
    const long pid = p.pid;
    press_and_leave();
    assert_int_equal(peer_stop(&p, SIGTERM), 0);
    FILE *trace = open_trace(getenv("SHCDD_TRACE"), pid);
    assert_non_null(trace);
    const long tid = find_loop_thread(trace);
    assert_true(tid > 0 && tid != pid);
    const tally t = count_ticks(trace, tid);
    fclose(trace);
    for (size_t i = 0; i < t.n_names; i++) {
        print_message("%s: %ld\n", t.calls[i].name, t.calls[i].n);
    }
    /* one of each a tick, and two readings of the CPU clock; under the tracer ticks are missed */
    const long ticks = calls(&t, "clock_nanosleep") - 1;
    assert_true(ticks > 500);
    assert_int_equal(calls(&t, "write"), ticks);
    assert_in_range(calls(&t, "clock_gettime"), 2 * ticks, 4 * ticks);
}

static int tear_down(void **state) {
    (void)state;
    peer_close(&p);
    return 0;
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_loop_thread_sleeps_reads_its_clock_and_wakes_the_publisher,
                                  tear_down),
    };
    if (argc != 2 || getenv("SHCDD_TRACE") == NULL) {
        fprintf(stderr, "usage: loop_calls.sh test_loop_calls SHCDD\n");
        return 2;
    }
    if (IS_SANITIZED) {
        fprintf(stderr, "test_loop_calls: skipped: a sanitizer makes system calls of its own\n");
        return 77;
    }
    program = argv[1];
    return cmocka_run_group_tests(tests, NULL, NULL);
}
