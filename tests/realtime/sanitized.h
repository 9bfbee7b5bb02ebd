/* SPDX-License-Identifier: BSD-3-Clause */
/* Sanitizers enlarge frames, fault in shadow memory, make system calls of their own and do not work
 * under a tracer. */
#ifndef SHCD_TESTS_SANITIZED_H
#define SHCD_TESTS_SANITIZED_H

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define IS_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define IS_SANITIZED 1
#endif
#endif
#ifndef IS_SANITIZED
#define IS_SANITIZED 0
#endif

/** Begins a cmocka test that is about a result, not about how it is come by: the plain build
 * decides on it, and a sanitizer, ten times as slow, has seen all of its code in other tests. ctest
 * -V shows it as skipped. */
#define LEAVE_TO_THE_PLAIN_BUILD()                                                                 \
    do {                                                                                           \
        if (IS_SANITIZED) {                                                                        \
            skip();                                                                                \
        }                                                                                          \
    } while (0)

#endif
