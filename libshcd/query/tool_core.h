/* SPDX-License-Identifier: BSD-3-Clause */
/* Distance from a point to the core K of a convex tool, with what a search needs to bound it in a
 * neighbourhood. All in the tool's frame.
 *
 * The signed distance d_K (negative inside) is convex and 1-Lipschitz, so for any unit u
 *     d_K(x) >= u.x - h(u),  h(u) = max over K of u.y
 * everywhere: whatever iteration proposed u, the bound is certified. */
#ifndef SHCDI_QUERY_TOOL_CORE_H
#define SHCDI_QUERY_TOOL_CORE_H

#include "query/tool_geometry.h"

/** Closest point of the core. */
typedef struct shcdi_core_foot {
    double distance; /**< signed; outside |x - point|, an upper bound up to rounding */
    double lower;    /**< u.x - h(u): certified */
    shcd_vec3 point; /**< of K; inside, on its border */
    shcd_vec3 u;     /**< unit gradient of d_K; zero where there is none */
    int n_active;    /**< hull, outside: number of its vertices whose hull holds `point`, 1 .. 3 */
    int active[3];
} shcdi_core_foot;

/** A quadratic lower model of d_K^2/2 about x0:
 *  d_K(x)^2/2 >= |r|^2/2 + r.(x - x0) + sum_k (q_k.(x - x0))^2/2  for |x - x0| <= rho. */
typedef struct shcdi_core_curvature {
    shcd_vec3 r; /**< x0 - its closest point, or an understatement of it */
    int n;
    shcd_vec3 q[3]; /**< orthonormal */
} shcdi_core_curvature;

/** Whether the tool has a core at all. */
static inline int shcdi_core_exists(const shcd_tool_geometry *tool) {
    return tool->kind != SHCD_TOOL_SHELL;
}

/** Farthest point of K in a direction that need not be unit. RT safe. */
shcd_vec3 shcdi_core_support(const shcd_tool_geometry *tool, shcd_vec3 direction);

/** Signed distance to K and the closest point. RT safe: a hull takes at most 32 passes over its
 *  points. */
void shcdi_core_closest(const shcd_tool_geometry *tool, shcd_vec3 x, shcdi_core_foot *foot);

/** Distance from x to a box that holds K, at most d_K(x). RT safe. */
double shcdi_core_box_distance(const shcd_tool_geometry *tool, shcd_vec3 x);

/** The model about x0, foot = shcdi_core_closest(x0) outside, within rho. RT safe. */
void shcdi_core_curvature_of(const shcd_tool_geometry *tool, shcd_vec3 x0,
                             const shcdi_core_foot *foot, double rho, shcdi_core_curvature *out);

/** Distance between K and the convex hull of 1 to 3 points. */
typedef struct shcdi_core_gap {
    double lower;     /**< certified */
    double upper;     /**< of a point of the hull of the points; 0 where they intersect */
    double weight[3]; /**< barycentric coordinates of that point */
    shcd_vec3 u;      /**< unit direction of `lower`, from K to the points; zero if it is 0 */
    int n_active;
    int active[3];
    shcd_vec3 point; /**< of K */
} shcdi_core_gap;

/** Stops when upper - lower <= tolerance, or lower >= enough. RT safe: at most 32 support points.
 */
void shcdi_core_gap_to(const shcd_tool_geometry *tool, const shcd_vec3 *x, int n, double tolerance,
                       double enough, shcdi_core_gap *gap);

#endif
