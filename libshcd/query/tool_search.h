/* SPDX-License-Identifier: BSD-3-Clause */
/* The parts of a query of a convex tool: distance from its core to the surface, depth of its core
 * below the surface. Both share one budget. */
#ifndef SHCDI_QUERY_TOOL_SEARCH_H
#define SHCDI_QUERY_TOOL_SEARCH_H

#include "query/tool_foot.h"

/** What a query may spend, and has. */
typedef struct shcdi_budget {
    uint32_t patches_max, evaluations_max;
    uint32_t n_patches, n_evaluations, n_newton;
} shcdi_budget;

static inline int shcdi_is_spent(const shcdi_budget *b) {
    return b->n_patches >= b->patches_max || b->n_evaluations >= b->evaluations_max;
}

/** Distance from the core K to the surface: min over w of max(0, d_K(S(w))). */
typedef struct shcdi_core_distance {
    double lower, upper; /**< certified; both 0 where the surface is known to enter K */
    int enters;          /**< a surface point is in K, or within the tolerance of it */
    int is_coarse;       /**< K seems to be inside of the body, clear of its surface: not refined */
    int is_outside;      /**< K is outside of the body for certain */
    int not_stationary;
    shcdi_tool_foot foot; /**< of the best point found */
} shcdi_core_distance;

/** How far a search goes. */
typedef enum shcdi_effort {
    SHCDI_EFFORT_LEAVES = 0,  /**< Newton, and the leaves' own bounds */
    SHCDI_EFFORT_OUTSIDE = 1, /**< exact, but if K seems to be inside: there a depth is asked for */
    SHCDI_EFFORT_EXACT = 2    /**< exact to the tolerance unless the budget is spent */
} shcdi_effort;

/** By branch and bound. seed: NULL, or a parameter near the answer. RT safe. */
void shcdi_search_core(const shcdi_view *view, const shcdi_placed_tool *placed, double tolerance,
                       shcdi_effort effort, const shcd_vec3 *seed, shcdi_budget *budget,
                       shcdi_core_distance *out);

/** min over K of the body's signed distance. */
typedef struct shcdi_core_depth {
    double lower, upper; /**< certified */
    shcd_vec3 point_m;   /**< of K, where `near` was found; body frame */
    shcd_proximity near; /**< the body's signed distance there */
    int has_foot;        /**< 0: the budget did not allow one query */
} shcdi_core_depth;

/** By sampling and descent; is_exact: also by a covering of K, until the bounds meet within the
 *  tolerance or the budget is spent. start: a point of K, body frame. RT safe. */
void shcdi_search_depth(const shcdi_view *view, const shcd_shape *shape,
                        const shcdi_placed_tool *placed, shcd_vec3 start, double tolerance,
                        int is_exact, shcdi_budget *budget, shcdi_core_depth *out);

/** shcd_tool_closest() that first looks at a unit vector near the answer's parameter (that of the
 *  last tick); NULL: nowhere. The seed can cost time, never correctness.
 *  @param[in] reach_m  range of interest: where the gap of a convex tool is proven to be larger
 *                      (tool_cull.h), its interval may be wider than the tolerance, and is flagged;
 *                      HUGE_VAL: everything is of interest
 *  RT safe. */
shcd_status shcdi_tool_closest_from(const shcd_model *model, const shcd_shape *shape,
                                    const shcd_tool_geometry *tool, shcd_pose tool_in_body,
                                    const shcd_vec3 *seed, double reach_m,
                                    const shcd_query_options *options, shcd_tool_proximity *out);

#endif
