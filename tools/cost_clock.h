/* SPDX-License-Identifier: BSD-3-Clause */
/* A clock that can time one query: some tens of nanoseconds, between two fences.
 *
 * The time-stamp counter where it runs at a constant rate and never stops (Linux says so in
 * /proc/cpuinfo), else CLOCK_MONOTONIC. What two reads with nothing between them differ by is
 * measured first and taken off every time. */
#ifndef SHCD_TOOLS_COST_CLOCK_H
#define SHCD_TOOLS_COST_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

typedef struct cost_clock {
    bool uses_counter;
    double ns_per_tick;    /**< of what cost_clock_read() returns */
    double resolution_ns;  /**< smallest step of the clock that was seen */
    double overhead_ticks; /**< median difference of two reads with nothing between them */
} cost_clock;

/** Takes about 0.1 s: the counter's rate is measured against CLOCK_MONOTONIC. */
void cost_clock_begin(cost_clock *clock);

/** Everything before the call has been executed, nothing after it has been started. */
uint64_t cost_clock_read(const cost_clock *clock);

/** Nanoseconds between two reads without the overhead; may be a little below 0. */
double cost_clock_between(const cost_clock *clock, uint64_t start, uint64_t end);

/** CLOCK_MONOTONIC in seconds. */
double cost_now_s(void);

/** Processor time of this process in seconds: for budgets, so that what is measured does not depend
 *  on what else runs. */
double cost_spent_s(void);

#endif
