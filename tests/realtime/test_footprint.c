/* SPDX-License-Identifier: BSD-3-Clause */
/* What the real-time functions take from the machine besides time: no memory from the allocator, no
 * page fault once warm, and a stated amount of stack.
 *
 * Linked statically with the allocation functions wrapped, so that a call from within the library
 * is seen. The work is the session of the determinism tests (several bodies and tools, all manners
 * of moving) and what calls.c does: every function that the headers call RT safe, tools of all
 * kinds, the worst places. */
#include "determinism/session.h"
#include "realtime/calls.h"
#include "realtime/sanitized.h"
#include "support/bodies.h"

#include <pthread.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>

/* A tick's deepest way is a search (21 KB) within which the side of a point is told by another one
 * (19 KB), below a tool's visit (17 KB); with a sweep in the place of the first search 3 KB less.
 * Half as much again stays free, of the 2 MB that the daemon's loop has. */
#define STACK_MAX ((size_t)112 << 10)
/* shcd/pair.h states about 150 KB; a twentieth more for the caller. No tick calls it. */
#define PAIR_STACK_MAX ((size_t)157500)
#define THREAD_STACK ((size_t)1 << 20)
#define PAINT 0xa5

static session scene;

/* ---- the allocator, watched ----------------------------------------------------------------- */

static long n_calls;

void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__real_realloc(void *p, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
void __real_free(void *p);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t n, size_t size);
void *__wrap_realloc(void *p, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
void __wrap_free(void *p);

void *__wrap_malloc(size_t size) {
    n_calls++;
    return __real_malloc(size);
}
void *__wrap_calloc(size_t n, size_t size) {
    n_calls++;
    return __real_calloc(n, size);
}
void *__wrap_realloc(void *p, size_t size) {
    n_calls++;
    return __real_realloc(p, size);
}
void *__wrap_aligned_alloc(size_t alignment, size_t size) {
    n_calls++;
    return __real_aligned_alloc(alignment, size);
}
void __wrap_free(void *p) {
    n_calls++;
    __real_free(p);
}

/* ---- the work ------------------------------------------------------------------------------- */

static int make_models(void **state) {
    (void)state;
    return calls_open() != 0 || session_open(&scene) != 0;
}

static int free_models(void **state) {
    (void)state;
    calls_close();
    session_close(&scene);
    return 0;
}

/* ---- tests ---------------------------------------------------------------------------------- */

static void test_rt_safe_functions_do_not_allocate(void **state) {
    (void)state;
    n_calls = 0;
    assert_int_equal(calls_queries(), 0);
    assert_int_equal(calls_step(), 0);
    assert_int_equal(calls_pair(), 0);
    assert_int_equal(n_calls, 0);
    shcd_model *made = bodies_create_ellipsoid(1.0, 2.0, 3.0); /* the watch is awake */
    shcd_model_free(made);
    assert_in_range(n_calls, 10, 1000);
}

static void test_step_does_not_allocate(void **state) {
    uint64_t hash = SESSION_HASH_START;
    shcd_state *memory = session_state(&scene);
    (void)state;
    assert_non_null(memory);
    n_calls = 0;
    assert_int_equal(session_run(&scene, memory, 0, check_scaled(SESSION_TICKS), &hash, NULL, NULL),
                     0);
    assert_int_equal(n_calls, 0);
    free(memory);
}

static long minor_faults(void) {
    struct rusage usage;
    assert_int_equal(getrusage(RUSAGE_THREAD, &usage), 0);
    return usage.ru_minflt + usage.ru_majflt;
}

/* The kernel may take a page away for its own reasons, so one quiet run of three is enough: a fault
 * that the code causes would come in each. */
static void test_warm_ticks_do_not_fault(void **state) {
    long least = -1;
    (void)state;
    if (IS_SANITIZED) {
        print_message("skipped: sanitizers fault pages in on their own\n");
        skip();
    }
    shcd_state *memory = session_state(&scene);
    assert_non_null(memory);
    const int is_locked = mlockall(MCL_CURRENT) == 0;
    uint64_t hash = SESSION_HASH_START;
    assert_int_equal(session_run(&scene, memory, 0, SESSION_TICKS, &hash, NULL, NULL), 0);
    for (int run = 0; run < 3 && least != 0; run++) {
        const long before = minor_faults();
        for (int half = 0; half < 2; half++) {
            assert_int_equal(session_run(&scene, memory, 0, SESSION_TICKS, &hash, NULL, NULL), 0);
        }
        const long faults = minor_faults() - before;
        print_message("%zu ticks, memory %slocked: %ld page faults\n", 2 * SESSION_TICKS,
                      is_locked ? "" : "not ", faults);
        least = least < 0 || faults < least ? faults : least;
    }
    if (is_locked) {
        munlockall();
    }
    free(memory);
    assert_int_equal(least, 0);
}

/* ---- stack ---------------------------------------------------------------------------------- */

typedef struct stack_job {
    int (*work)(void);
    unsigned char *lowest; /* of the thread's stack */
    unsigned char *top;    /* where the work began */
    size_t used;
    int failed;
} stack_job;

static shcd_state *stack_state;

static int run_session(void) {
    uint64_t hash = SESSION_HASH_START;
    return session_run(&scene, stack_state, 0, SESSION_TICKS / 5, &hash, NULL, NULL);
}

static void *measure(void *argument) {
    stack_job *job = argument;
    volatile unsigned char here = 0;
    job->top = (unsigned char *)(uintptr_t)&here;
    /* all below is paint already, but for what the start of the thread has used */
    memset(job->lowest, PAINT, THREAD_STACK / 2);
    job->failed = job->work();
    unsigned char *p = job->lowest;
    while (p < job->top && *p == PAINT) {
        p++;
    }
    job->used = (size_t)(job->top - p);
    return NULL;
}

static size_t stack_of(int (*work)(void)) {
    stack_job job = {work, NULL, NULL, 0, 0};
    pthread_attr_t attributes;
    pthread_t thread;
    void *memory = aligned_alloc(4096, THREAD_STACK);
    assert_non_null(memory);
    memset(memory, PAINT, THREAD_STACK);
    job.lowest = memory;
    assert_int_equal(pthread_attr_init(&attributes), 0);
    assert_int_equal(pthread_attr_setstack(&attributes, memory, THREAD_STACK), 0);
    assert_int_equal(pthread_create(&thread, &attributes, measure, &job), 0);
    assert_int_equal(pthread_join(thread, NULL), 0);
    pthread_attr_destroy(&attributes);
    free(memory);
    assert_int_equal(job.failed, 0);
    return job.used;
}

static int do_nothing(void) {
    return 0;
}

static void test_rt_safe_functions_stay_within_their_stack(void **state) {
    (void)state;
    if (IS_SANITIZED) {
        print_message("skipped: sanitizers enlarge the frames\n");
        skip();
    }
    stack_state = session_state(&scene);
    assert_non_null(stack_state);
    const size_t nothing = stack_of(do_nothing);
    const size_t session_step = stack_of(run_session), tools_step = stack_of(calls_step);
    const size_t step = session_step > tools_step ? session_step : tools_step;
    const size_t rest = stack_of(calls_queries);
    const size_t pair = stack_of(calls_pair);
    free(stack_state);
    print_message("stack: shcd_step %zu bytes, body against body %zu, the other functions %zu (an "
                  "empty one %zu)\n",
                  step, pair, rest, nothing);
    /* a call that used nothing would show a method that measures nothing */
    assert_in_range(step, 4096, STACK_MAX);
    assert_in_range(rest, 4096, STACK_MAX);
    assert_in_range(pair, 4096, PAIR_STACK_MAX);
    assert_in_range(nothing, 0, 2048);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rt_safe_functions_do_not_allocate),
        cmocka_unit_test(test_step_does_not_allocate),
        cmocka_unit_test(test_warm_ticks_do_not_fault),
        cmocka_unit_test(test_rt_safe_functions_stay_within_their_stack),
    };
    return cmocka_run_group_tests(tests, make_models, free_models);
}
