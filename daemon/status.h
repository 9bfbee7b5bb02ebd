/* SPDX-License-Identifier: BSD-3-Clause */
/* Histograms of times with bins that grow with the value, and the counters of the loop.
 *
 * A value v >= 8 ns falls into one of 8 equal parts of its octave [2^k, 2^(k+1)), a smaller one has
 * a bin of its own: 1/8 relative width at a fixed cost, from 1 ns to 4.3 s. Percentiles are upper
 * edges of bins, so they err on the cautious side by at most 12.5 %. */
#ifndef SHCDD_STATUS_H
#define SHCDD_STATUS_H

#include <stddef.h>
#include <stdint.h>

#define HISTOGRAM_OCTAVES 32
#define HISTOGRAM_PARTS 8 /* bins in an octave */
#define HISTOGRAM_BINS ((HISTOGRAM_OCTAVES - 2) * HISTOGRAM_PARTS)

typedef struct histogram {
    int64_t n;
    int64_t max_ns;
    int64_t bins[HISTOGRAM_BINS];
} histogram;

/** Counts a value; negative ones count as 0, those of 2^32 ns and more in the last bin. */
void histogram_add(histogram *h, int64_t value_ns);

/** Smallest bin edge that at least the share q (0 .. 1] of the values do not exceed, and never more
 *  than the maximum; 0 without values. */
int64_t histogram_quantile_ns(const histogram *h, double q);

/** Sums into octaves: octave k counts [2^k, 2^(k+1)) ns; octave 0 holds 0 as well. */
void histogram_octaves(const histogram *h, int64_t octaves[HISTOGRAM_OCTAVES]);

typedef enum loop_state { LOOP_RUNNING = 1, LOOP_DEGRADED = 2, LOOP_STOPPING = 3 } loop_state;

/** What the loop knows about itself; owned by it, handed out by copy. */
typedef struct loop_stats {
    int64_t utime_ns;
    int64_t tick;
    double actual_rate_hz;
    int32_t state; /* a loop_state */
    int32_t rt_flags;
    int64_t missed_ticks;
    int64_t missed_events;
    int64_t self_overruns;
    int64_t tx_dropped;
    histogram wake;
    histogram compute;
} loop_stats;

#endif
