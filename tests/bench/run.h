/* SPDX-License-Identifier: BSD-3-Clause */
/* The rounds in which all methods take turns, and what is concluded from them. */
#ifndef SHCD_BENCH_RUN_H
#define SHCD_BENCH_RUN_H

#include "methods.h"

typedef struct run_options {
    size_t n_points;      /**< of the random set and of the path */
    size_t n_cold;        /**< of them with cold caches */
    size_t n_checked;     /**< of them compared with all triangles */
    size_t n_repetitions; /**< each point is asked so often; its median time counts */
    size_t n_updates;     /**< repetitions of each change of shape */
    uint64_t seed;
} run_options;

/** Points that every method is asked, and what is known of them. */
typedef struct run_points {
    double *random, *path; /**< n_points each */
} run_points;

/** Of one method and workload. Times in ns, without the harness. */
typedef struct run_result {
    int32_t is_measured;
    int32_t reserved;
    double p50_ns, p99_ns;
    double chain_ns; /**< per query of a dependent chain, median over chains; with harness */
    double evaluations_mean, evaluations_p99;
    double patches_mean, patches_p99;
    double newton_mean, newton_p99;
    double global_share;    /**< of the queries: those that searched the whole surface */
    double truncated_share; /**< flagged SHCD_PROXIMITY_TRUNCATED */
    double unsure_share;    /**< sign not proven */
    double off_share;       /**< upper end farther than 1e-6 diag above the truth */
    size_t n_compared;      /**< with the exact tier of a model of the same surface */
    size_t n_checked;       /**< with all triangles */
    size_t n_wrong;         /**< claims that do not hold */
    double worst_m;         /**< by how much at most a claim misses, before the tolerance */
} run_result;

typedef struct run_update {
    double p50_ns, p90_ns;
} run_update;

typedef struct run_outcome {
    run_result *results; /**< [method * BENCH_N_WORKLOADS + workload] */
    run_update *updates;
    double core_ghz;     /**< median over the blocks */
    double core_low_ghz; /**< 5 % quantile */
    double harness_ns;   /**< of one stamped call, already subtracted from p50 and p99 */
} run_outcome;

void run_make_points(const methods_body *body, const run_options *options, run_points *points);
void run_free_points(run_points *points);

void run_all(const bench_list *list, const methods_body *body, const bench_mesh *mesh,
             const run_points *points, const run_options *options, run_outcome *outcome);
void run_free(run_outcome *outcome);

/** Short name of a workload. */
const char *run_workload_name(int workload);

#endif
