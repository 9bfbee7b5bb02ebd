/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  The distance map as an object of its own: for true directions from a centre, the sorted
 * crossings of the ray with the surface, interpolated between the nodes of a grid.
 *
 *  A model holds one with the default options, which serves SHCD_TIER_MAP. Others are made to
 * compare grids and resolutions, to choose the centre, or for the reference distance D = r_ref -
 * r_body of SPHARM literature. What a map is good for and what not: docs/distance-map.md. In short,
 * depth along a ray is not distance.
 *
 *  A map is immutable after creation and may be shared between threads. Its model must outlive it.
 */
#ifndef SHCD_MAP_H
#define SHCD_MAP_H

#include "shcd/query.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A distance map. Constant, shared by threads. */
typedef struct shcd_map shcd_map;

/** Where the directions of a map are sampled. */
typedef enum shcd_map_grid {
    /** Lattice points of the octahedron |i| + |j| + |k| = resolution: 4 n^2 + 2 nodes, 8 n^2
     *  triangles, no poles and no seam. */
    SHCD_MAP_OCTAHEDRAL = 0,
    /** theta_j = pi j/n (from +z), phi_k = pi k/n: 2 n (n + 1) samples, 2 n^2 cells. Linear
     *  interpolation only. Kept for comparison: a look-up costs more, and nodes crowd at the poles.
     */
    SHCD_MAP_LATITUDE_LONGITUDE = 1
} shcd_map_grid;

/** What happens between them. */
typedef enum shcd_map_interpolation {
    SHCD_MAP_LINEAR =
        0, /**< barycentric in a triangle, bilinear between four samples; continuous */
    SHCD_MAP_HERMITE = 1 /**< cubic with slopes, C1 everywhere; octahedral grid only */
} shcd_map_interpolation;

/** What D = r_ref - r_body is measured from. */
typedef enum shcd_map_reference {
    SHCD_MAP_REFERENCE_NONE = 0,
    /** The model's certified enclosing ball; needs the centre inside. D > 0. */
    SHCD_MAP_REFERENCE_BALL = 1,
    /** The series truncated at reference_degree. It does not enclose the body, so D takes both
     *  signs; with reference_enclosing it is scaled about the centre until it provably does. */
    SHCD_MAP_REFERENCE_LOW_DEGREE = 2,
    /** |x/a|, |y/b|, |z/c| with (x'^(2/e2) + y'^(2/e2))^(e2/e1) + z'^(2/e1) = 1 about the centre of
     *  the model's bounding box, a, b, c half its sides. It touches the box and need not enclose.
     */
    SHCD_MAP_REFERENCE_SUPERQUADRIC = 3
} shcd_map_reference;

/** Options of shcd_map_create(). Start from SHCD_MAP_OPTIONS_INIT; zero fields mean the defaults.
 */
typedef struct shcd_map_options {
    size_t struct_size;
    int32_t grid;             /**< a shcd_map_grid */
    int32_t resolution;       /**< n above, 2 .. SHCD_MAP_RESOLUTION_MAX; 0: 32 octahedral, 45
                                   latitude-longitude (about as many nodes) */
    int32_t has_centre;       /**< 1: centre_m is given; 0: the model's star_centre_m */
    int32_t without_bounds;   /**< 1: skip the bounded error (faster) */
    int32_t reference;        /**< a shcd_map_reference */
    int32_t reference_degree; /**< low degree: 1 .. model degree; 0: 3, or the model's if lower */
    int32_t reference_enclosing; /**< low degree: 1: scaled so that it encloses the body */
    int32_t reserved0;           /**< zero */
    shcd_vec3 centre_m;          /**< [m] */
    double superquadric_e1;      /**< 0.1 .. 2 (convex); 0: 1 */
    double superquadric_e2;
} shcd_map_options;
#define SHCD_MAP_OPTIONS_INIT SHCD_SIZED_INIT(shcd_map_options)
#define SHCD_MAP_RESOLUTION_MAX 512

/** Most crossings of one ray that a map keeps. */
#define SHCD_MAP_CROSSINGS_MAX 16

/** What a map is. Set struct_size (SHCD_MAP_INFO_INIT), then call shcd_map_describe(). */
typedef struct shcd_map_info {
    size_t struct_size;
    int32_t grid;
    int32_t resolution;
    uint64_t n_nodes; /**< samples; those at a pole of the latitude-longitude grid counted each */
    uint64_t n_cells; /**< triangles or quadrilaterals */
    uint64_t bytes;   /**< memory that the map holds */
    shcd_vec3 centre_m;
    int32_t centre_inside;     /**< by the parity of the crossings */
    int32_t crossings_max;     /**< most crossings of one node's ray */
    double one_crossing_share; /**< of the nodes: those whose ray crosses the surface once */
    double equal_count_share;  /**< of the cells: those whose nodes have equal counts */
    /** Of the cells: those for which the count of crossings over the whole cell and the error of
     *  their radii are proven. Cells near a grazing ray have no bound. */
    double bounded_share;
    double linear_bound_m;  /**< largest proven error of the linear look-up in those cells [m] */
    double hermite_bound_m; /**< the same of the Hermite look-up; 0 where there is none [m] */
    uint64_t n_measured;    /**< crossings compared with the surface, at directions off the nodes,
                                 where the look-up and the ray agree in their count */
    uint64_t n_miscounted;  /**< such directions where they do not agree though the nodes do */
    double linear_error_max_m, linear_error_rms_m;   /**< measured there [m] */
    double hermite_error_max_m, hermite_error_rms_m; /**< 0 on the latitude-longitude grid */
    int32_t reference;
    int32_t reference_degree;
    /** Factor of the low-degree reference about the centre: 1, or what makes it enclose. */
    double reference_scale;
    /** Proven lower bound of (x - centre) . n over the reference surface [m]: above 0 every ray
     *  meets it once. */
    double reference_margin_m;
    /** Proven lower bound of (S - centre) . n over the body, or 0 if none was found: above 0 every
     *  ray meets the body once. */
    double star_margin_m;
} shcd_map_info;
#define SHCD_MAP_INFO_INIT SHCD_SIZED_INIT(shcd_map_info)

/** Bits of the answer to a look-up. */
typedef enum shcd_map_flag {
    /** The nodes around disagree in their count of crossings: those of the nearest node are given.
     */
    SHCD_MAP_EDGE = 1u << 0,
    /** Nothing reliable is known along this ray (it grazes, or crosses too often): count is 0. */
    SHCD_MAP_UNSURE = 1u << 1,
    /** The count is proven, and bound_m is a proven bound of |radius - true radius| for each. */
    SHCD_MAP_BOUNDED = 1u << 2
} shcd_map_flag;

/** One crossing of a ray with the surface. Frozen layout. */
typedef struct shcd_map_crossing {
    double radius_m;             /**< from the centre */
    double reference_distance_m; /**< D = reference_m - radius_m; 0 without a reference */
    shcd_vec3 slope_m;   /**< gradient of the radius over unit directions, tangential [m/rad] */
    shcd_vec3 parameter; /**< w with S(w) near the crossing: a seed for shcd_track() */
} shcd_map_crossing;

/** Result of a look-up. Frozen layout. */
typedef struct shcd_map_ray {
    int32_t count;      /**< of crossings */
    uint32_t flags;     /**< shcd_map_flag */
    double bound_m;     /**< with SHCD_MAP_BOUNDED; else +inf */
    double reference_m; /**< r_ref, interpolated like the radii; 0 without a reference */
    shcd_map_crossing crossing[SHCD_MAP_CROSSINGS_MAX]; /**< nearest first; zero beyond count */
} shcd_map_ray;

/** Makes a map of a model.
 *
 *  @param[in]  model      must outlive the map
 *  @param[in]  options    NULL: the defaults
 *  @param[in]  allocator  NULL: malloc; copied into the map
 *  @param[out] map        untouched on failure; release with shcd_map_free()
 *  @param[out] error      may be NULL
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE, SHCD_ERR_MEMORY, SHCD_ERR_GEOMETRY: the
 *  reference surface is not met exactly once by every ray from the centre, or that could not be
 *  proven. Deterministic. About 50 us a node at degree 15; not RT safe. */
SHCD_API SHCD_NODISCARD shcd_status shcd_map_create(const shcd_model *model,
                                                    const shcd_map_options *options,
                                                    const shcd_allocator *allocator, shcd_map **map,
                                                    shcd_error *error);

/** Releases a map; NULL is allowed. */
SHCD_API void shcd_map_free(shcd_map *map);

/** Fills min(info->struct_size, library's size) bytes of info.
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (struct_size 0). RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_map_describe(const shcd_map *map,
                                                              shcd_map_info *info);

/** Crossings of the surface along one direction.
 *
 *  @param[in]  direction      finite, not zero; normalised first
 *  @param[in]  interpolation  a shcd_map_interpolation
 *  @param[out] ray            untouched on failure
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (Hermite on the latitude-longitude grid, too),
 *  SHCD_ERR_NOT_FINITE. RT safe: no loop longer than the count, no trigonometric call. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_map_look_up(const shcd_map *map,
                                                             shcd_vec3 direction, int interpolation,
                                                             shcd_map_ray *ray);

/** Depth of a point along its ray, as shcd_closest() with SHCD_TIER_MAP gives it.
 *
 *  Where the look-up is bounded, the surface embedded and the point farther from every crossing
 *  than the bound, the sign is certain and the interval one-sided; else SHCD_PROXIMITY_SIGN_UNSURE.
 *  @return as shcd_closest(). RT safe: one evaluation of the surface. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_map_query(const shcd_map *map, shcd_vec3 point,
                                                           int interpolation, shcd_proximity *out);

/** Radius of the reference surface along a direction, evaluated, not looked up.
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (no reference), SHCD_ERR_NOT_FINITE, SHCD_ERR_CONVERGENCE.
 *  Thread safe; not for a tick (capped, but slow, and it calls libm). */
SHCD_API SHCD_NODISCARD shcd_status shcd_map_reference_radius(const shcd_map *map,
                                                              shcd_vec3 direction,
                                                              double *radius_m);

#ifdef __cplusplus
}
#endif
#endif
