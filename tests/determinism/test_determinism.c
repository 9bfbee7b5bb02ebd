/* SPDX-License-Identifier: BSD-3-Clause */
/* The session replayed from a snapshot, by two threads at once, and against the committed hashes.
 */
#include "realtime/sanitized.h"
#include "session.h"
#include "support/check.h"

#include <pthread.h>
#include <string.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#define N_THREADS 2
/* Under a sanitizer a part is enough: the plain build decides on all. */
#define N_PARTS (IS_SANITIZED ? (size_t)2 : SESSION_MARKS - 1)
#define N_TICKS (N_PARTS * SESSION_PART)

static session shared;
static uint64_t committed[SESSION_MARKS];

static void test_session_meets_all_it_is_meant_to(void **state) {
    uint64_t marks[SESSION_MARKS];
    session_tally tally = {0};
    (void)state;
    LEAVE_TO_THE_PLAIN_BUILD();
    assert_int_equal(session_marks(&shared, marks, &tally), 0);
    assert_int_equal(session_compare(marks, committed), 0);
    for (size_t t = 0; t < SESSION_TOOLS; t++) {
        size_t n = 0;
        for (size_t b = 0; b < SESSION_BODIES; b++) {
            assert_in_range(tally.n_contact[t][b], SESSION_TICKS / 20, SESSION_TICKS / 2);
            n += tally.n_contact[t][b];
        }
        assert_in_range(n, SESSION_TICKS / 3, SESSION_TICKS * 3 / 4);
    }
    assert_true(tally.n_inactive > 100);
    assert_true(tally.n_bad > 50);
    assert_true(tally.n_truncated > 0);
    assert_true(tally.n_unsure > 0);
    assert_true(tally.deepest_m > 0.05); /* past the middle */
}

/* A snapshot is a copy of bytes: taken to another place in memory it goes on as the original does.
 */
static void test_session_from_a_snapshot_gives_the_same_bits(void **state) {
    const size_t middle = N_TICKS / 2 + 137;
    const size_t size = shcd_state_size(shared.scene);
    uint64_t hash = SESSION_HASH_START;
    uint64_t after, replayed;
    shcd_state *original = session_state(&shared);
    shcd_state *copy = session_state(&shared);
    (void)state;
    assert_non_null(original);
    assert_non_null(copy);
    assert_int_equal(session_run(&shared, original, 0, middle, &hash, NULL, NULL), 0);
    memcpy(copy, original, size);
    after = replayed = hash;
    assert_int_equal(session_run(&shared, original, middle, N_TICKS, &after, NULL, NULL), 0);
    assert_int_equal(session_run(&shared, copy, middle, N_TICKS, &replayed, NULL, NULL), 0);
    assert_true(after == replayed);
    assert_true(after == committed[N_PARTS - 1]);
    assert_memory_equal(original, copy, size);
    free(original);
    free(copy);
}

/* Two scenes of the same definition: a snapshot of one goes on in the other. */
static void test_session_goes_on_in_an_equal_scene(void **state) {
    const size_t middle = IS_SANITIZED ? SESSION_PART : 3 * SESSION_PART;
    uint64_t hash = SESSION_HASH_START;
    session other;
    shcd_state *moved = session_state(&shared);
    (void)state;
    assert_non_null(moved);
    assert_int_equal(session_open(&other), 0);
    assert_int_equal(session_run(&shared, moved, 0, middle, &hash, NULL, NULL), 0);
    assert_int_equal(session_run(&other, moved, middle, 2 * middle, &hash, NULL, NULL), 0);
    assert_true(hash == committed[2 * middle / SESSION_PART - 1]);
    free(moved);
    session_close(&other);
}

/* Into *hash that of all outputs; NULL: a tick was refused, or no memory. */
static void *run_thread(void *hash) {
    uint64_t *all = hash;
    shcd_state *own = session_state(&shared);
    *all = SESSION_HASH_START;
    const int failed = own == NULL || session_run(&shared, own, 0, N_TICKS, all, NULL, NULL) != 0;
    free(own);
    return failed ? NULL : hash;
}

static void test_threads_that_share_a_scene_give_the_same_bits(void **state) {
    uint64_t hashes[N_THREADS];
    pthread_t threads[N_THREADS];
    void *results[N_THREADS] = {NULL};
    (void)state;
    for (size_t i = 0; i < N_THREADS; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, run_thread, &hashes[i]), 0);
    }
    /* all have ended before one may fail: the scene is freed then */
    for (size_t i = 0; i < N_THREADS; i++) {
        assert_int_equal(pthread_join(threads[i], &results[i]), 0);
    }
    for (size_t i = 0; i < N_THREADS; i++) {
        assert_ptr_equal(results[i], &hashes[i]);
        assert_true(hashes[i] == committed[N_PARTS - 1]);
    }
}

/* The daemon's loop flushes denormal numbers to zero; a replay without that meets the same bits. */
static void test_flushing_denormals_to_zero_changes_nothing(void **state) {
    (void)state;
    LEAVE_TO_THE_PLAIN_BUILD();
#if defined(__SSE2__)
    uint64_t marks[SESSION_MARKS];
    const unsigned int before = _mm_getcsr();
    _mm_setcsr(before | 0x8040u);
    const int failed = session_marks(&shared, marks, NULL);
    _mm_setcsr(before);
    assert_int_equal(failed, 0);
    assert_int_equal(session_compare(marks, committed), 0);
#else
    print_message("skipped: no SSE2 here, and the daemon flushes nothing\n");
    skip();
#endif
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_session_meets_all_it_is_meant_to),
        cmocka_unit_test(test_session_from_a_snapshot_gives_the_same_bits),
        cmocka_unit_test(test_session_goes_on_in_an_equal_scene),
        cmocka_unit_test(test_threads_that_share_a_scene_give_the_same_bits),
        cmocka_unit_test(test_flushing_denormals_to_zero_changes_nothing),
    };
    if (argc != 2 || session_read(argv[1], committed) != 0 || session_open(&shared) != 0) {
        fprintf(stderr, "usage: test_determinism COMMITTED_HASHES\n");
        return 2;
    }
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    session_close(&shared);
    return failed;
}
