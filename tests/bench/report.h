/* SPDX-License-Identifier: BSD-3-Clause */
/* What the reader sees: tables, the bars, and the same for programs. */
#ifndef SHCD_BENCH_REPORT_H
#define SHCD_BENCH_REPORT_H

#include "run.h"

#include <stdio.h>

/** One body's share of the report. */
typedef struct report_body {
    const char *path;
    shcd_model_info info;
    shcd_map_info map;
    const bench_list *list;
    const bench_mesh *mesh;
    const run_outcome *outcome;
    const run_options *options;
} report_body;

/** Name of a shcd_simd, as `bench_query --simd` takes it. */
const char *report_simd_name(int simd);
void report_tables(FILE *out, const report_body *body);
/** The goals and whether they are met here. */
void report_bars(FILE *out, const report_body *body);
/** One JSON object. */
void report_json(FILE *out, const report_body *body);

#endif
