/* SPDX-License-Identifier: BSD-3-Clause */
/* Whether all methods tell the truth about the points they are timed on, and what each costs. */
#ifndef SHCD_BENCH_COMPARE_H
#define SHCD_BENCH_COMPARE_H

#include "run.h"

/** Fills the counts and comparisons of `results`, not the times. */
void compare_all(const bench_list *list, const methods_body *body, const bench_mesh *mesh,
                 const run_points *points, const run_options *options, run_result *results);

#endif
