/* SPDX-License-Identifier: BSD-3-Clause */
/* Counts allocations of a program that is linked with --wrap=malloc,--wrap=calloc,--wrap=realloc.
 */
#ifndef SHCD_TESTS_ALLOCATIONS_H
#define SHCD_TESTS_ALLOCATIONS_H

#include <stddef.h>

static size_t n_allocations;

void *__real_malloc(size_t size);
void *__wrap_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__wrap_calloc(size_t n, size_t size);
void *__real_realloc(void *old, size_t size);
void *__wrap_realloc(void *old, size_t size);

void *__wrap_malloc(size_t size) {
    n_allocations++;
    return __real_malloc(size);
}
void *__wrap_calloc(size_t n, size_t size) {
    n_allocations++;
    return __real_calloc(n, size);
}
void *__wrap_realloc(void *old, size_t size) {
    n_allocations++;
    return __real_realloc(old, size);
}

#endif
