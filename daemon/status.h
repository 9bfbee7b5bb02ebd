/* SPDX-License-Identifier: BSD-3-Clause */
/* Histograms of times with bins that grow with the value, and the counters of the loop.
 *
 * A value v >= 8 ns falls into one of 8 equal parts of its octave [2^k, 2^(k+1)), a smaller one has
 * a bin of its own: 1/8 relative width at a fixed cost, from 1 ns to 4.3 s. Percentiles are upper
 * edges of bins, so they err on the cautious side by at most 12.5 %. */
#ifndef SHCDD_STATUS_H
#define SHCDD_STATUS_H

#include <stdbool.h>
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

/** The energy of all tools together, from the start of the loop [J]. */
typedef struct tick_energy {
    double given_j, taken_j; /* against the published forces */
    double output_chain_j;
    double stored_j;       /* now */
    double driven_j;       /* brought in by what drives a body */
    double reserve_left_j; /* of the tool with the least; -1: no controller */
    int64_t passivity_ticks;
} tick_energy;

/** What an effect has cost, from the start of the loop, in time and in energy. */
typedef struct effect_time {
    double sum_ns, max_ns;
    double energy_j; /* that its force took up from the hands */
    double stored_j; /* now */
    double driven_j;
    int64_t n;
    bool is_active; /* it acted in the last tick */
} effect_time;

#define LOOP_EFFECTS_MAX 256 /* that a status message describes */

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
    tick_energy energy;
    size_t n_effects;
    effect_time effects[LOOP_EFFECTS_MAX];
    histogram wake;
    histogram compute;
} loop_stats;

#endif
