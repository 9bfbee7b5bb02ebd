/* SPDX-License-Identifier: BSD-3-Clause */
/* Counts every call of the allocator in the program that includes this, shared libraries included,
 * by standing in for malloc. Only with glibc, and where no sanitizer does so already: then
 * COUNTS_ALLOCATIONS is defined. Include it in one file. */
#ifndef SHCD_TESTS_COUNT_ALLOCATIONS_H
#define SHCD_TESTS_COUNT_ALLOCATIONS_H

#include <stddef.h>
#include <stdlib.h>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define COUNTS_ALLOCATIONS 1
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t n, size_t size);
extern void *__libc_realloc(void *p, size_t size);
extern void __libc_free(void *p);
#define VISIBLE __attribute__((visibility("default")))
void *malloc(size_t size);
void *calloc(size_t n, size_t size);
void *realloc(void *p, size_t size);
void free(void *p);
static long n_allocations;
VISIBLE void *malloc(size_t size) {
    n_allocations++;
    return __libc_malloc(size);
}
VISIBLE void *calloc(size_t n, size_t size) {
    n_allocations++;
    return __libc_calloc(n, size);
}
VISIBLE void *realloc(void *p, size_t size) {
    n_allocations++;
    return __libc_realloc(p, size);
}
VISIBLE void free(void *p) {
    n_allocations += p != NULL;
    __libc_free(p);
}
#endif

#endif
