/* SPDX-License-Identifier: BSD-3-Clause */
/* What a tool's geometry holds, and distances to its core.
 *
 * A convex tool is a core, the set K of all points of a box, a segment, a point or a polytope, with
 * a ball of radius_m around each of them. The box of half extents `half_m` about `middle_m` *is*
 * the core of every kind but the hull (a segment is a box without width, a point a box without
 * extent) and contains the core of a hull. A shell has no core. Immutable after creation. */
#ifndef SHCDI_QUERY_TOOL_GEOMETRY_H
#define SHCDI_QUERY_TOOL_GEOMETRY_H

#include "base/internal.h"
#include "shcd/tool.h"

/** Half-space normal.x <= offset that holds a hull. */
typedef struct shcdi_hull_face {
    shcd_vec3 normal; /**< unit, outward */
    double offset_m;
} shcdi_hull_face;

struct shcd_tool_geometry {
    shcd_allocator allocator;
    int kind;          /**< a shcd_tool_kind */
    double radius_m;   /**< rounding of the core; 0 of a shell */
    double bounding_m; /**< no point of the tool, rounding included, is farther from its origin */
    shcd_vec3 middle_m, half_m;
    size_t n_points;    /**< hull: its vertices; shell: its points, nested; else 0 */
    shcd_vec3 *point_m; /**< tool frame */
    shcd_vec3 *normal;  /**< shell: unit, into the tool */
    double *covering_m; /**< shell: [n - 1]: no point is farther than this from the nearest of the
                             first n; falls to 0 at n_points */
    size_t n_faces;     /**< hull */
    shcdi_hull_face *face;
};

static inline int shcdi_tool_kind(const shcd_tool_geometry *tool) {
    return tool->kind;
}
static inline double shcdi_tool_radius(const shcd_tool_geometry *tool) {
    return tool->radius_m;
}
/** Radius of a ball about the tool frame's origin that holds the whole tool. */
static inline double shcdi_tool_bounding_radius(const shcd_tool_geometry *tool) {
    return tool->bounding_m;
}
static inline size_t shcdi_tool_point_count(const shcd_tool_geometry *tool) {
    return tool->n_points;
}
static inline const shcd_vec3 *shcdi_tool_points(const shcd_tool_geometry *tool) {
    return tool->point_m;
}
static inline const shcd_vec3 *shcdi_tool_normals(const shcd_tool_geometry *tool) {
    return tool->normal;
}
/** Shell: distance within which the first n points have every other point; n from 1. */
static inline double shcdi_tool_covering(const shcd_tool_geometry *tool, size_t n) {
    return n > 0 && n <= tool->n_points ? tool->covering_m[n - 1] : HUGE_VAL;
}

#endif
