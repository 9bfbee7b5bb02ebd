/* SPDX-License-Identifier: BSD-3-Clause */
/* The goals of the queries, as numbers that a run gives or does not give. */
#ifndef SHCD_BENCH_BARS_H
#define SHCD_BENCH_BARS_H

#include "report.h"

typedef struct bars_line {
    const char *name;
    const char *unit;
    double value;
    double limit;
    int32_t is_known; /**< 0: this run did not measure it */
    int32_t has_peer;
    double peer_value; /**< what Embree takes for the same, where there is such a thing */
} bars_line;

#define BARS_MAX 16
/** Returns how many lines were written. */
size_t bars_list(const report_body *body, bars_line *lines);

#endif
