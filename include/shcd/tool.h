/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  Tools other than points and spheres against a body, motions within a tick, and body against
 *  body.
 *
 *  A tool geometry is constant after creation and may be shared between threads. All queries are
 *  functions of their arguments: RT safe, and thread safe for distinct outputs.
 */
#ifndef SHCD_TOOL_H
#define SHCD_TOOL_H

#include "shcd/shape.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Shape of a tool, in the tool's own frame. */
typedef enum shcd_tool_kind {
    SHCD_TOOL_POINT = 0,  /**< the origin */
    SHCD_TOOL_SPHERE = 1, /**< radius_m about the origin */
    SHCD_TOOL_CAPSULE =
        2,              /**< radius_m about the segment (0, 0, -half_length_m .. half_length_m) */
    SHCD_TOOL_BOX = 3,  /**< |x|, |y|, |z| <= half_extents_m, rounded outward by radius_m >= 0 */
    SHCD_TOOL_HULL = 4, /**< convex hull of points, rounded outward by radius_m >= 0 */
    SHCD_TOOL_SHELL = 5 /**< point shell: points with inward normals, nested, coarse first */
} shcd_tool_kind;

/** Most points of a hull: its support function visits them all. */
#define SHCD_HULL_POINTS_MAX 256
/** Most points of a shell. */
#define SHCD_SHELL_POINTS_MAX 65536

/** Definition of a tool's geometry. Start from SHCD_TOOL_GEOMETRY_DEF_INIT; fields that the kind
 *  does not name are ignored. Lengths are 0 to 1e6 m: a capsule of no radius is a segment, a box
 *  may be a plate, a stick or a point. */
typedef struct shcd_tool_geometry_def {
    size_t struct_size;
    int32_t kind;      /**< a shcd_tool_kind */
    int32_t reserved0; /**< zero */
    double radius_m;
    double half_length_m;
    shcd_vec3 half_extents_m;
    const shcd_vec3 *points;  /**< hull, shell [m]; copied */
    const shcd_vec3 *normals; /**< shell: unit, into the tool, one for each point; copied */
    size_t n_points;
} shcd_tool_geometry_def;
#define SHCD_TOOL_GEOMETRY_DEF_INIT SHCD_SIZED_INIT(shcd_tool_geometry_def)

/** A tool's geometry. Constant, shared by threads. */
typedef struct shcd_tool_geometry shcd_tool_geometry;

/** Checks a definition and builds the geometry. Of a hull's 4 to SHCD_HULL_POINTS_MAX points those
 *  are dropped that are not outside of the hull of the others by more than 1e-9 of its extent. A
 *  shell's 1 to SHCD_SHELL_POINTS_MAX points are put into nested order: each next point is the one
 *  farthest from all before it (n^2/2 distances: 0.1 s for 10 000 points, seconds for the most).
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE, SHCD_ERR_GEOMETRY (a hull without
 *  volume), SHCD_ERR_MEMORY. Not RT safe. */
SHCD_API SHCD_NODISCARD shcd_status
shcd_tool_geometry_create(const shcd_tool_geometry_def *definition, const shcd_allocator *allocator,
                          shcd_tool_geometry **geometry, shcd_error *error);
/** Accepts NULL. Not RT safe. */
SHCD_API void shcd_tool_geometry_free(shcd_tool_geometry *geometry);

/** Result of a query of a tool against a body. Body frame. Frozen layout.
 *
 *  The tool's core is what is left of it without its rounding radius_m: a point, a segment, a box
 *  or a hull. The gap is the smallest signed distance of a point of the core from the body, less
 *  that radius. Separated, it is the distance between tool and body. Overlapping, it is negative,
 *  and minus it is the depth of the tool's deepest point below the surface (of a rounded tool:
 *  where the rounding does not reach past the middle of the body), never a Minkowski depth. */
typedef struct shcd_tool_proximity {
    double gap_m;   /**< min over the core of the body's signed distance, - radius_m */
    double lower_m; /**< certified: lower_m <= true gap <= upper_m; -inf where nothing is known */
    double upper_m;
    shcd_vec3 tool_point_m; /**< point of the tool where that is attained */
    shcd_vec3 point_m;      /**< closest point of the surface to it */
    shcd_vec3 normal;       /**< outward unit normal of the body there */
    shcd_vec3 parameter;    /**< its parameter w */
    uint32_t flags;         /**< shcd_proximity_flag */
    uint32_t n_evaluations;
    uint32_t n_patches;
    uint32_t n_newton;
    uint64_t reserved[4]; /**< zero */
} shcd_tool_proximity;

/** Gap between a convex tool and a body's current surface, with a proven interval.
 *
 *  Where the surface keeps clear of the core: min over w of d_K(S(w)), d_K the signed distance to
 *  the core (convex, 1-Lipschitz), by branch and bound over the patches of the body, see
 *  libshcd/query/tool_search.c. It ends by itself but where feet form a curve: a long tool along a
 *  body of revolution, say.
 *  Where the core is inside or cuts the surface: upper_m comes from the deepest point found by
 *  descent, lower_m from a covering of the core with point queries (tool_depth.c): tens of them
 *  for a capsule or a corner that dips in, as many as the caps allow for faces parallel to the
 *  surface. Where the caps end it, the interval is wide on its lower side and TRUNCATED is set.
 * That tool and body overlap is proven by upper_m < 0 all the same, that they do not by lower_m >
 * 0. Points and spheres: shcd_shape_closest() less the radius.
 *
 *  @param[in] shape         NULL: the rest shape
 *  @param[in] tool_in_body  pose of the tool's frame in the body frame, quaternion unit within 1e-6
 *  @param[in] options       NULL: the defaults. tolerance: upper_m - lower_m allowed, relative to
 *                           max(diagonal, gap); 0: 1e-6. tier exact, or fast: no search below the
 *                           leaves and no covering, so an honest but wider interval; map: as fast
 *  @param[out] out          untouched on failure
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE, SHCD_ERR_UNSUPPORTED (a shell has no
 *  inside). A cap that is reached is SHCD_OK with SHCD_PROXIMITY_TRUNCATED. RT safe: caps as of
 *  shcd_closest(), kept but for what was begun below them (a Newton run, a point query's bounds); a
 *  tick sets them lower. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_tool_closest(
    const shcd_model *model, const shcd_shape *shape, const shcd_tool_geometry *tool,
    shcd_pose tool_in_body, const shcd_query_options *options, shcd_tool_proximity *out);

#ifdef __cplusplus
}
#endif
#endif
