/* SPDX-License-Identifier: BSD-3-Clause */
/* lfence on both sides of rdtsc: Intel and AMD document that it waits for all earlier instructions
 * and holds back all later ones. Elsewhere the call of clock_gettime() is all the fence there is;
 * what the processor overlaps across it is small beside its own cost. */
#include "cost_clock.h"

#include "cost_stats.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#if defined(__x86_64__)
#include <x86intrin.h>
#endif

#define CALIBRATION_S 0.1
#define N_EMPTY 4001

double cost_now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double cost_spent_s(void) {
    struct timespec spent;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &spent);
    return (double)spent.tv_sec + 1e-9 * (double)spent.tv_nsec;
}

static uint64_t read_system_clock(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

#if defined(__x86_64__)
static bool has_steady_counter(void) {
    FILE *file = fopen("/proc/cpuinfo", "r");
    char line[4096];
    bool steady = false;
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        if (strncmp(line, "flags", 5) == 0) {
            steady = strstr(line, " constant_tsc") != NULL && strstr(line, " nonstop_tsc") != NULL;
            break;
        }
    }
    if (file != NULL) {
        fclose(file);
    }
    return steady;
}

static uint64_t read_counter(void) {
    _mm_lfence();
    const uint64_t ticks = __rdtsc();
    _mm_lfence();
    return ticks;
}
#else
static bool has_steady_counter(void) {
    return false;
}

static uint64_t read_counter(void) {
    return read_system_clock();
}
#endif

uint64_t cost_clock_read(const cost_clock *clock) {
    return clock->uses_counter ? read_counter() : read_system_clock();
}

static void calibrate(cost_clock *clock) {
    const uint64_t system_start = read_system_clock();
    const uint64_t start = read_counter();
    const double end_s = cost_now_s() + CALIBRATION_S;
    while (cost_now_s() < end_s) {
    }
    const uint64_t system_end = read_system_clock();
    const uint64_t end = read_counter();
    clock->ns_per_tick = (double)(system_end - system_start) / (double)(end - start);
}

void cost_clock_begin(cost_clock *clock) {
    double empty[N_EMPTY];
    double step = 1e9;
    clock->uses_counter = has_steady_counter();
    clock->ns_per_tick = 1.0;
    if (clock->uses_counter) {
        calibrate(clock);
    }
    for (size_t i = 0; i < N_EMPTY; i++) {
        const uint64_t start = cost_clock_read(clock);
        const uint64_t end = cost_clock_read(clock);
        empty[i] = (double)(end - start);
        if (i > 0 && empty[i] != empty[i - 1]) {
            const double difference =
                empty[i] > empty[i - 1] ? empty[i] - empty[i - 1] : empty[i - 1] - empty[i];
            step = difference < step ? difference : step;
        }
    }
    clock->resolution_ns = clock->ns_per_tick * step;
    clock->overhead_ticks = cost_quantile(empty, N_EMPTY, 0.5);
}

double cost_clock_between(const cost_clock *clock, uint64_t start, uint64_t end) {
    return clock->ns_per_tick * ((double)(end - start) - clock->overhead_ticks);
}
