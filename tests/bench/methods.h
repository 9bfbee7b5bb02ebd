/* SPDX-License-Identifier: BSD-3-Clause */
/* libshcd's ways to answer, as methods of the benchmark. */
#ifndef SHCD_BENCH_METHODS_H
#define SHCD_BENCH_METHODS_H

#include "bench.h"
#include "shcd/map.h"
#include "shcd/query.h"

/** The body and what the methods need of it. */
typedef struct methods_body {
    const shcd_model *model;
    const shcd_model *moved; /**< made anew from the deformed coefficients: the reference */
    const shcd_map *map;
    const double *moved_coefficients;  /**< of `moved`: 2 % of the diagonal away from rest */
    const double *almost_coefficients; /**< 0.1 % before that */
    double diagonal_m;
} methods_body;

/** Nothing at all: what is measured for it is the harness itself. Always the first method. */
void methods_add_nothing(bench_list *list);
/** exact, fast, map, track, and the surface's point and Jacobian. */
void methods_add_tiers(bench_list *list, const methods_body *body);

/** Certificates, and the deformed shape. */
void methods_add_shapes(bench_list *list, const methods_body *body);
/** Changes of shape, along a path of n points that must outlive the list. */
void methods_add_updates(bench_list *list, const methods_body *body, const double *path, size_t n);

/** The proven interval of the unsigned distance, and the sign where it is certain. */
void methods_explain(const shcd_proximity *near, bench_answer *answer);

#endif
