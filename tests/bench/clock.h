/* SPDX-License-Identifier: BSD-3-Clause */
/* Time stamps that the processor does not move, and what is needed to read them as nanoseconds. */
#ifndef SHCD_BENCH_CLOCK_H
#define SHCD_BENCH_CLOCK_H

#include <stddef.h>
#include <stdint.h>

#if defined(__x86_64__)
#include <x86intrin.h>
/* All earlier instructions are done before the stamp, and no later one starts before it. */
static inline uint64_t clock_stamp(void) {
    _mm_lfence();
    const uint64_t t = __rdtsc();
    _mm_lfence();
    return t;
}
#else
uint64_t clock_stamp(void);
#endif

/** Length of one tick of the stamp [ns]; measured once, by clock_open(). */
double clock_tick_ns(void);
void clock_open(void);

/** Frequency of the core at this moment [GHz], from a chain of integer multiplications, which takes
 *  3 cycles each on every x86-64 since 2008; 0 where that is not known. About 15 us. */
double clock_core_ghz(void);

/** Reads and writes 6 MiB, so that neither data nor code of a query is left in the caches next to
 *  the core. */
void clock_sweep(void);

/** The q-quantile (nearest rank) of n values, which are sorted by this. */
double clock_quantile(double *values, size_t n, double q);

#endif
