/* SPDX-License-Identifier: BSD-3-Clause */
/* Fixed sets of queries without a clock, for callgrind to count their instructions. */
#ifndef SHCD_BENCH_COUNTED_H
#define SHCD_BENCH_COUNTED_H

#include "run.h"

/** 1 if this build can talk to callgrind (valgrind's header was there). */
int counted_is_possible(void);

/** Each method answers the first n random points, then the first n of the path. Under
 *  `valgrind --tool=callgrind --instr-atstart=no` each set becomes a profile of its own, with the
 *  trigger "METHOD WORKLOAD N". */
void counted_all(const bench_list *list, const run_points *points, size_t n);

#endif
