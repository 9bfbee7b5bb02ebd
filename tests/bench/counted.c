/* SPDX-License-Identifier: BSD-3-Clause */
/* Fixed sets of queries without a clock: the number of instructions does not depend on how busy the
 * machine is. Only the sets themselves are instrumented, or loading a body would take minutes. */
#include "counted.h"

#include <stdio.h>

#if defined(__has_include)
#if __has_include(<valgrind/callgrind.h>)
#include <valgrind/callgrind.h>
#endif
#endif

#ifdef CALLGRIND_DUMP_STATS_AT

int counted_is_possible(void) {
    return 1;
}

static void count(const bench_method *method, const double *points, int workload, size_t n) {
    volatile double sink = 0.0;
    char name[96];
    snprintf(name, sizeof name, "%s %s %zu", method->name, run_workload_name(workload), n);
    if (method->start != NULL) {
        method->start(method->self, points);
    }
    CALLGRIND_START_INSTRUMENTATION;
    CALLGRIND_ZERO_STATS;
    for (size_t i = 0; i < n; i++) {
        sink = method->query(method->self, points + 3 * i);
    }
    CALLGRIND_DUMP_STATS_AT(name);
    CALLGRIND_STOP_INSTRUMENTATION;
    (void)sink;
}

void counted_all(const bench_list *list, const run_points *points, size_t n) {
    const double *sets[2] = {points->random, points->path};
    for (int w = 0; w < 2; w++) {
        for (size_t m = 0; m < list->n_methods; m++) {
            if (list->methods[m].workloads & BENCH_BIT(w)) {
                count(&list->methods[m], sets[w], w, n);
            }
        }
    }
}

#else

int counted_is_possible(void) {
    return 0;
}

void counted_all(const bench_list *list, const run_points *points, size_t n) {
    (void)list;
    (void)points;
    (void)n;
}

#endif
