/* SPDX-License-Identifier: BSD-3-Clause */
/* What the real-time functions take from the machine besides time: no memory from the allocator, no
 * page fault once warm, and a stated amount of stack.
 *
 * Linked statically with the allocation functions wrapped, so that a call from within the library
 * is seen. The work is the session of the determinism tests (several bodies and tools, all manners
 * of moving) and every other function that the headers call RT safe, in the worst places. */
#include "determinism/session.h"
#include "realtime/sanitized.h"
#include "shcd/map.h"
#include "support/bodies.h"

#include <pthread.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>

/* A tick's deepest way is a search (21 KB) within which the side of a point is told by another one
 * (19 KB), below a tool's visit (17 KB); with a sweep in the place of the first search 3 KB less.
 * Half as much again stays free, of the 2 MB that the daemon's loop has. */
#define STACK_MAX ((size_t)112 << 10)
#define THREAD_STACK ((size_t)1 << 20)
#define PAINT 0xa5

static session scene;
static shcd_model *sphere, *uneven;
static shcd_map *maps[2]; /* by grid */
static double harmonics[10 * SHCD_COUNT(SHCD_DEGREE_MAX)];

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
    check_random random = {3};
    (void)state;
    sphere = bodies_create_ellipsoid(1.0, 1.0, 1.0);
    uneven = bodies_create_random(&random, 15, 0.3);
    for (int32_t grid = 0; grid < 2; grid++) {
        shcd_map_options options = SHCD_MAP_OPTIONS_INIT;
        options.grid = grid;
        options.resolution = 12;
        if (shcd_map_create(uneven, &options, NULL, &maps[grid], NULL) != SHCD_OK) {
            return 1;
        }
    }
    return session_open(&scene);
}

static int free_models(void **state) {
    (void)state;
    shcd_map_free(maps[0]);
    shcd_map_free(maps[1]);
    shcd_model_free(sphere);
    shcd_model_free(uneven);
    session_close(&scene);
    return 0;
}

static int query_all(const shcd_model *model, shcd_vec3 p) {
    const double offset = 0.2;
    int failed = 0;
    for (int32_t tier = SHCD_TIER_EXACT; tier <= SHCD_TIER_MAP; tier++) {
        shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
        shcd_proximity found;
        options.tier = tier;
        for (options.map_hermite = 0; options.map_hermite < 2; options.map_hermite++) {
            options.tolerance = options.map_hermite != 0 ? 1e-15 : 0.0;
            failed |= shcd_closest(model, p, &options, &found) != SHCD_OK;
        }
        failed |= shcd_track(model, shcd_vec3_make(p.x, p.y + offset, p.z), found.parameter,
                             &found) != SHCD_OK;
    }
    return failed;
}

static int evaluate_all(const shcd_model *model, shcd_vec3 w) {
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    shcd_vec3 point, normal;
    double jacobian[9], offset;
    double *gradient = harmonics + SHCD_COUNT(SHCD_DEGREE_MAX), *hessian = gradient + 3 * 22801;
    int failed = shcd_model_surface(model, -1, w, &point, &normal, jacobian) != SHCD_OK;
    failed |= shcd_model_surface(model, 1, w, &point, NULL, NULL) != SHCD_OK;
    failed |= shcd_model_describe(model, &info) != SHCD_OK;
    failed |= shcd_model_enclosure_offset(model, 1, &offset) != SHCD_OK;
    failed |= shcd_harmonics(SHCD_DEGREE_MAX, w, harmonics, gradient, hessian) != SHCD_OK;
    return failed;
}

static int look_up_all(shcd_vec3 p) {
    int failed = 0;
    for (int grid = 0; grid < 2; grid++) {
        for (int how = SHCD_MAP_LINEAR; how <= SHCD_MAP_HERMITE - grid; how++) {
            const shcd_vec3 d = {p.x, p.y, p.z + 1e-3};
            shcd_map_info info = SHCD_MAP_INFO_INIT;
            shcd_map_ray ray;
            shcd_proximity found;
            failed |= shcd_map_look_up(maps[grid], d, how, &ray) != SHCD_OK;
            failed |= shcd_map_query(maps[grid], p, how, &found) != SHCD_OK;
            failed |= shcd_map_describe(maps[grid], &info) != SHCD_OK;
        }
    }
    return failed;
}

/* All RT safe functions once, points inside, outside, at centres, far away. */
static int use_everything(void) {
    static const shcd_vec3 points[] = {{0.0, 0.0, 0.0}, {0.3, 0.2, -0.1}, {1.5, -0.4, 0.6},
                                       {1e9, 1e9, 0.0}, {1e-9, 0.0, 0.0}, {0.0, 0.0, 1.0}};
    static double complex_pairs[2 * SHCD_COUNT(15)], back[SHCD_COUNT(15)];
    shcd_state *state = NULL;
    static _Alignas(16) unsigned char memory[1 << 18];
    int failed = shcd_state_size(scene.scene) > sizeof memory;
    failed |= shcd_state_init(scene.scene, memory, sizeof memory, &state) != SHCD_OK;
    failed |= shcd_scene_tool_count(scene.scene) != SESSION_TOOLS ||
              shcd_scene_body_count(scene.scene) != SESSION_BODIES ||
              shcd_scene_tool_name(scene.scene, 0) == NULL ||
              shcd_scene_body_name(scene.scene, 0) == NULL || shcd_effect_at(0) == NULL ||
              shcd_version() == 0 || shcd_status_string(SHCD_OK) == NULL;
    failed |= shcd_coefficients_to_complex(15, shcd_model_coefficients(uneven), 3, complex_pairs) !=
              SHCD_OK;
    failed |= shcd_coefficients_from_complex(shcd_model_degree(uneven), complex_pairs, back, 1) !=
              SHCD_OK;
    for (size_t i = 0; i < sizeof points / sizeof points[0]; i++) {
        failed |= query_all(sphere, points[i]) | query_all(uneven, points[i]);
        failed |= look_up_all(points[i]);
        failed |= evaluate_all(uneven, shcd_vec3_make(points[i].y, points[i].x, 1e-3));
    }
    return failed;
}

/* ---- tests ---------------------------------------------------------------------------------- */

static void test_rt_safe_functions_do_not_allocate(void **state) {
    (void)state;
    n_calls = 0;
    assert_int_equal(use_everything(), 0);
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
    const size_t step = stack_of(run_session);
    const size_t rest = stack_of(use_everything);
    free(stack_state);
    print_message("stack: shcd_step %zu bytes, the other functions %zu (an empty one %zu)\n", step,
                  rest, nothing);
    /* a call that used nothing would show a method that measures nothing */
    assert_in_range(step, 4096, STACK_MAX);
    assert_in_range(rest, 4096, STACK_MAX);
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
