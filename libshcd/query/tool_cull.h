/* SPDX-License-Identifier: BSD-3-Clause */
/* A cheap proof that a convex tool does not touch a body: against convex sets that hold the body
 * for certain, without a look at its patches. */
#ifndef SHCDI_QUERY_TOOL_CULL_H
#define SHCDI_QUERY_TOOL_CULL_H

#include "query/tool_foot.h"
#include "shcd/tool.h"

/** A convex set that holds the current body: the degree-1 part of S, inflated. Depends on the shape
 *  only: made once a tick, used for every tool. */
typedef struct shcdi_cull_body {
    shcd_vec3 centre_m;  /**< of the enclosing ball */
    double radius_m;     /**< of the enclosing ball */
    shcd_vec3 middle_m;  /**< of the ellipsoid */
    shcd_vec3 column[3]; /**< the ellipsoid is middle + sum_i w_i column_i, |w| <= 1 */
    double offset_m;     /**< and every point of the body lies within this of it */
} shcdi_cull_body;

/** RT safe. */
void shcdi_cull_body_of(const shcdi_view *view, shcdi_cull_body *body);

/** Tries the ball, then the inflated ellipsoid by libccd's GJK.
 *  @param[out] lower_m  certified lower bound of the gap between tool and body; may be negative
 *  @return 1 if the gap is proven to be above margin_m, else 0 (which proves nothing; a shell too).
 *  RT safe: libccd takes at most 32 steps and allocates nothing. */
int shcdi_tool_cull(const shcdi_cull_body *body, const shcdi_placed_tool *placed, double margin_m,
                    double *lower_m);

/** The answer where a gap above reach_m is as good as any: proven by the above, without a look at
 *  the patches, at the price of one evaluation. Fills a zeroed result: lower_m > reach_m, and gap_m
 *  and upper_m of some pair of points on the near sides. @return 1; 0, and *out untouched, where
 *  that much is not proven. RT safe. */
int shcdi_tool_beyond(const shcdi_view *view, const shcdi_placed_tool *placed, double reach_m,
                      shcd_tool_proximity *out);

#endif
