/* SPDX-License-Identifier: BSD-3-Clause */
/* Time stamps that the processor does not move, and what is needed to read them as nanoseconds. */
#define _POSIX_C_SOURCE 200809L
#include "clock.h"

#include <stdlib.h>
#include <time.h>

#define SWEEP_BYTES (6u << 20)
#define LINE_BYTES 64u
#define CHAIN 10000

static double tick_ns = 1.0;

static uint64_t wall_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

#if !defined(__x86_64__)
uint64_t clock_stamp(void) {
    return wall_ns();
}
#endif

double clock_tick_ns(void) {
    return tick_ns;
}

/* 50 ms of both clocks: their reading takes well below 1 us, so this is good to 1e-4. */
void clock_open(void) {
    const uint64_t wall_start = wall_ns(), start = clock_stamp();
    uint64_t wall_end = wall_start;
    while (wall_end - wall_start < 50000000u) {
        wall_end = wall_ns();
    }
    tick_ns = (double)(wall_end - wall_start) / (double)(clock_stamp() - start);
}

double clock_core_ghz(void) {
#if defined(__x86_64__)
    uint64_t x = 3;
    const uint64_t start = clock_stamp();
    for (int i = 0; i < CHAIN / 10; i++) {
        /* ten by hand, or the loop's own instructions could matter */
        __asm__ volatile(
            "imul %0, %0\n\timul %0, %0\n\timul %0, %0\n\timul %0, %0\n\timul %0, %0"
            "\n\timul %0, %0\n\timul %0, %0\n\timul %0, %0\n\timul %0, %0\n\timul %0, %0"
            : "+r"(x));
    }
    return 3.0 * CHAIN / ((double)(clock_stamp() - start) * tick_ns);
#else
    return 0.0;
#endif
}

void clock_sweep(void) {
    static volatile unsigned char buffer[SWEEP_BYTES];
    for (size_t i = 0; i < SWEEP_BYTES; i += LINE_BYTES) {
        buffer[i] = (unsigned char)(buffer[i] + 1u);
    }
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double clock_quantile(double *values, size_t n, double q) {
    qsort(values, n, sizeof *values, compare);
    const double rank = q * (double)(n - 1);
    return values[(size_t)(rank + 0.5)];
}
