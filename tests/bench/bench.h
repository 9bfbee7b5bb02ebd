/* SPDX-License-Identifier: BSD-3-Clause */
/* What the parts of the benchmark share: a method is a table of function pointers, so that methods
 * written in C++ (bench_peers.cpp) run in the same process and the same rounds as those of libshcd.
 */
#ifndef SHCD_BENCH_H
#define SHCD_BENCH_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** What the points of one run look like. */
typedef enum bench_workload {
    BENCH_RANDOM = 0,      /**< independent points near the surface */
    BENCH_PATH = 1,        /**< a tool's way: steps of 0.1 % of the diagonal */
    BENCH_COLD_RANDOM = 2, /**< caches swept before each query */
    BENCH_COLD_PATH = 3,
    BENCH_N_WORKLOADS = 4
} bench_workload;
#define BENCH_BIT(workload) (1u << (workload))
#define BENCH_EVERYWHERE 0xfu
#define BENCH_ON_PATHS (BENCH_BIT(BENCH_PATH) | BENCH_BIT(BENCH_COLD_PATH))

/** What a method claims of the unsigned distance of its last query, and what that cost. */
typedef struct bench_answer {
    double
        lower_m; /**< the true distance is claimed to lie in [lower, upper], before tolerance_m */
    double upper_m;
    int32_t sign;           /**< +1 outside, -1 inside, 0 not claimed */
    uint32_t flags;         /**< shcd_proximity_flag */
    uint32_t n_evaluations; /**< 0 where a method does not count */
    uint32_t n_patches;
    uint32_t n_newton;
    int32_t is_global; /**< 1: the whole surface was searched; 0: followed from the last query */
} bench_answer;

/** One way to answer a query. `self` is freed by `release`. */
typedef struct bench_method {
    const char *name; /**< short, without spaces: the key in the JSON output */
    const char *what; /**< a line for the reader */
    void *self;
    uint32_t workloads; /**< BENCH_BIT of those that make sense */
    int32_t is_peer;    /**< 1: not libshcd */
    int32_t is_moved;   /**< 1: asks the deformed surface */
    int32_t reserved;
    double tolerance_m; /**< by how much a true claim may miss the reference */
    double bytes;       /**< that this method holds in memory; 0: not stated here */
    /** Before the first query of a sequence, not timed; may be NULL. */
    void (*start)(void *self, const double point[3]);
    /** Timed. Returns a finite number that depends on the answer. */
    double (*query)(void *self, const double point[3]);
    /** What the last query found, not timed. NULL: nothing to compare (then tolerance_m is 0). */
    void (*explain)(void *self, bench_answer *answer);
    void (*release)(void *self); /**< may be NULL */
} bench_method;

/** A change of the whole shape, after which queries must be right again. */
typedef struct bench_update {
    const char *name;
    const char *what;
    void *self;
    int32_t is_peer;
    int32_t reserved;
    void (*prepare)(void *self, size_t k); /**< k-th shape at hand, not timed */
    double (*apply)(void *self);           /**< timed; as bench_method::query */
    void (*release)(void *self);           /**< may be NULL */
} bench_update;

/** The surface as triangles, for methods that need them. */
typedef struct bench_mesh {
    size_t n_vertices, n_triangles;
    double *vertices_m; /**< 3 each */
    double *moved_m;    /**< the same vertices on the deformed surface */
    uint32_t *triangles;
    double deviation_m; /**< proven: between surface and triangles, both ways */
    double moved_deviation_m;
    double diagonal_m;
} bench_mesh;

typedef struct bench_list {
    bench_method *methods;
    size_t n_methods, methods_max;
    bench_update *updates;
    size_t n_updates, updates_max;
} bench_list;

/** Appends; the lists are large enough (bench_query.c), else the program stops. */
void bench_add_method(bench_list *list, const bench_method *method);
void bench_add_update(bench_list *list, const bench_update *update);

/** The peers of bench_peers.cpp. Returns 0, or 1 after a message on standard error. */
int bench_add_peers(bench_list *list, const bench_mesh *mesh);
/** Names and versions, one line. */
const char *bench_peers_versions(void);

#ifdef __cplusplus
}
#endif
#endif
