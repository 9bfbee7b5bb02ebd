/* SPDX-License-Identifier: BSD-3-Clause */
/* Mailbox and ring: their logic in one thread, then two threads at full speed with a checksum in
 * every record, where a torn or doubled value would show. */
#include "exchange.h"

#include "support/check.h"

#include <pthread.h>
#include <sched.h>
#include <time.h>

#define WORDS 61 /* not a multiple of a cache line */

typedef struct record {
    uint64_t number;
    uint64_t words[WORDS];
    uint64_t checksum;
} record;

static void fill(record *r, uint64_t number) {
    check_random random = {number};
    r->number = number;
    r->checksum = number;
    for (size_t i = 0; i < WORDS; i++) {
        r->words[i] = check_random_bits(&random);
        r->checksum += r->words[i];
    }
}

static bool is_whole(const record *r) {
    uint64_t sum = r->number;
    for (size_t i = 0; i < WORDS; i++) {
        sum += r->words[i];
    }
    return sum == r->checksum;
}

/* On a busy machine a thread that waits may not run for milliseconds: the stress ends after so many
 * records, or after this time. */
#define STRESS_S 3

static bool is_over(const struct timespec *begin) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec - begin->tv_sec > STRESS_S;
}

static _Alignas(EXCHANGE_LINE) unsigned char memory[RING_BYTES(sizeof(record), 8)];

static void put(mailbox *m, int value) {
    *(int *)mailbox_back(m) = value;
    mailbox_publish(m);
}

static int get(mailbox *m, bool *fresh) {
    return *(const int *)mailbox_front(m, fresh);
}

static void test_mailbox_read_before_write_is_zero_and_not_fresh(void **state) {
    (void)state;
    mailbox m;
    bool fresh = true;
    mailbox_init(&m, memory, sizeof(int));
    assert_int_equal(get(&m, &fresh), 0);
    assert_false(fresh);
}

static void test_mailbox_read_gives_latest_once_fresh(void **state) {
    (void)state;
    mailbox m;
    bool fresh;
    mailbox_init(&m, memory, sizeof(int));
    put(&m, 1);
    put(&m, 2);
    put(&m, 3);
    assert_int_equal(get(&m, &fresh), 3);
    assert_true(fresh);
    assert_int_equal(get(&m, &fresh), 3);
    assert_false(fresh);
    put(&m, 4);
    assert_int_equal(get(&m, &fresh), 4);
    assert_true(fresh);
}

static void test_mailbox_front_is_untouched_by_later_writes(void **state) {
    (void)state;
    mailbox m;
    bool fresh;
    mailbox_init(&m, memory, sizeof(int));
    put(&m, 1);
    const int *front = mailbox_front(&m, &fresh);
    for (int i = 2; i < 12; i++) {
        assert_ptr_not_equal(mailbox_back(&m), front);
        put(&m, i);
        assert_int_equal(*front, 1);
    }
}

static void test_ring_full_refuses_and_order_is_kept(void **state) {
    (void)state;
    ring r;
    int next_in = 0, next_out = 0;
    ring_init(&r, memory, sizeof(int), 4);
    assert_null(ring_peek(&r));
    for (int round = 0; round < 100; round++) {
        int *slot;
        while ((slot = ring_reserve(&r)) != NULL) {
            *slot = next_in++;
            ring_commit(&r);
        }
        assert_int_equal(next_in - next_out, 4);
        for (int i = 0; i <= round % 4; i++) {
            assert_int_equal(*(const int *)ring_peek(&r), next_out++);
            ring_release(&r);
        }
    }
}

static void test_ring_reserve_without_commit_hands_nothing_over(void **state) {
    (void)state;
    ring r;
    ring_init(&r, memory, sizeof(int), 4);
    assert_non_null(ring_reserve(&r));
    assert_null(ring_peek(&r));
}

typedef struct stress {
    mailbox mail;
    ring queue;
    _Atomic bool stop;
} stress;

static void *write_mail(void *argument) {
    stress *s = argument;
    for (uint64_t n = 1; !atomic_load(&s->stop); n++) {
        fill(mailbox_back(&s->mail), n);
        mailbox_publish(&s->mail);
    }
    return NULL;
}

static void test_mailbox_two_threads_never_tears(void **state) {
    (void)state;
    static stress s;
    pthread_t writer;
    struct timespec begin;
    const size_t wanted = check_scaled(300000);
    uint64_t last = 0;
    size_t seen = 0, torn = 0, backwards = 0;
    mailbox_init(&s.mail, memory, sizeof(record));
    atomic_init(&s.stop, false);
    clock_gettime(CLOCK_MONOTONIC, &begin);
    assert_int_equal(pthread_create(&writer, NULL, write_mail, &s), 0);
    while (seen < wanted && !is_over(&begin)) {
        bool fresh;
        const record *r = mailbox_front(&s.mail, &fresh);
        if (!fresh) {
            sched_yield();
            continue;
        }
        torn += !is_whole(r);
        backwards += r->number <= last;
        last = r->number;
        seen++;
    }
    atomic_store(&s.stop, true);
    pthread_join(writer, NULL);
    print_message("%zu values read of %llu written\n", seen, (unsigned long long)last);
    assert_true(seen > 0);
    assert_int_equal(torn, 0);
    assert_int_equal(backwards, 0);
}

static void *write_queue(void *argument) {
    stress *s = argument;
    for (uint64_t n = 0; !atomic_load(&s->stop);) {
        record *slot = ring_reserve(&s->queue);
        if (slot == NULL) {
            sched_yield();
            continue;
        }
        fill(slot, n++);
        ring_commit(&s->queue);
    }
    return NULL;
}

static void test_ring_two_threads_pass_each_record_once_and_whole(void **state) {
    (void)state;
    static stress s;
    pthread_t writer;
    struct timespec begin;
    const size_t wanted = check_scaled(600000);
    uint64_t seen = 0;
    size_t wrong = 0;
    ring_init(&s.queue, memory, sizeof(record), 8);
    atomic_init(&s.stop, false);
    clock_gettime(CLOCK_MONOTONIC, &begin);
    assert_int_equal(pthread_create(&writer, NULL, write_queue, &s), 0);
    while (seen < wanted && !is_over(&begin)) {
        const record *r = ring_peek(&s.queue);
        if (r == NULL) {
            sched_yield();
            continue;
        }
        wrong += !is_whole(r) || r->number != seen;
        seen++;
        ring_release(&s.queue);
    }
    atomic_store(&s.stop, true);
    pthread_join(writer, NULL);
    print_message("%llu records passed on\n", (unsigned long long)seen);
    assert_true(seen > 0);
    assert_int_equal(wrong, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mailbox_read_before_write_is_zero_and_not_fresh),
        cmocka_unit_test(test_mailbox_read_gives_latest_once_fresh),
        cmocka_unit_test(test_mailbox_front_is_untouched_by_later_writes),
        cmocka_unit_test(test_ring_full_refuses_and_order_is_kept),
        cmocka_unit_test(test_ring_reserve_without_commit_hands_nothing_over),
        cmocka_unit_test(test_mailbox_two_threads_never_tears),
        cmocka_unit_test(test_ring_two_threads_pass_each_record_once_and_whole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
