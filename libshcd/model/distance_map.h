/* SPDX-License-Identifier: BSD-3-Clause */
/* The distance map: for true directions from a centre, the sorted crossings of the ray with the
 * surface. Public face: shcd/map.h. */
#ifndef SHCDI_MODEL_DISTANCE_MAP_H
#define SHCDI_MODEL_DISTANCE_MAP_H

#include "model/map_grid.h"

/** One crossing of a node's ray. */
typedef struct shcdi_crossing {
    float radius;       /**< from the centre [m] */
    float slope[3];     /**< gradient of the radius over unit directions, tangential [m/rad] */
    float parameter[3]; /**< w */
} shcdi_crossing;

#define SHCDI_MAP_CROSSINGS_MAX SHCD_MAP_CROSSINGS_MAX
/** A ray whose crossings could not be told apart, or with the wrong parity. */
#define SHCDI_MAP_UNSURE 255
/** Error bound of a Hermite look-up over that of a linear one in the same cell (map_bound.c). */
#define SHCDI_MAP_HERMITE_RATIO 1.41

typedef struct shcdi_map {
    int grid; /**< a shcd_map_grid */
    int resolution;
    shcd_vec3 centre;
    int centre_inside; /**< parity of the crossings seen from the centre */
    size_t n_slots, n_cells;
    uint32_t *first; /**< of each slot of the grid: its first crossing */
    uint8_t *count;  /**< crossings of each slot, or SHCDI_MAP_UNSURE */
    size_t n_crossings;
    shcdi_crossing *crossing;
    float *bound;              /**< of each cell, linear look-up [m]; +inf: none; NULL: no bounds */
    shcdi_crossing *reference; /**< of each slot, NULL: no reference surface; parameter unused */
    int crossings_max;
    double one_crossing_share, equal_count_share, bounded_share;
    double bound_m;       /**< largest of the finite ones */
    double star_margin_m; /**< proven lower bound of (S - centre) . n, or 0 */
    size_t n_measured, n_miscounted;
    double linear_error_m, hermite_error_m; /**< measured, largest */
    double linear_rms_m, hermite_rms_m;
    size_t n_steps; /**< of Newton's method, spent on building */
} shcdi_map;

/** Interpolated crossings along one direction. */
typedef struct shcdi_map_ray {
    int count; /**< of crossings, or -1: the nodes around disagree */
    double radius[SHCDI_MAP_CROSSINGS_MAX];
    size_t nearest_cell; /**< slot of the node with the largest weight */
    shcdi_stencil at;
} shcdi_map_ray;

/** What a map is to be. */
typedef struct shcdi_map_settings {
    int grid, resolution;
    shcd_vec3 centre;
    int splits; /**< how often a cell is split for its bound; -1: no bounds */
} shcdi_map_settings;

struct shcd_model;

/** Fills a zeroed map; needs the model's tree, kernel and series. On failure the map holds what
 *  shcdi_map_free() releases. @return SHCD_OK, SHCD_ERR_MEMORY. */
shcd_status shcdi_map_build(const struct shcd_model *model, const shcdi_map_settings *settings,
                            const shcd_allocator *allocator, shcdi_map *map);
/** Builds model->map: the default options. */
shcd_status shcdi_map_create(struct shcd_model *model);
void shcdi_map_free(shcdi_map *map, const shcd_allocator *allocator);
size_t shcdi_map_bytes(const shcdi_map *map);
/** Of these: the parameters stored with the crossings, seeds of Newton's method. */
size_t shcdi_map_seed_bytes(const shcdi_map *map);

#define SHCDI_MAP_SPLITS_MAX 2

/** Bounds of all cells and their shares. @return SHCD_OK, SHCD_ERR_MEMORY. */
shcd_status shcdi_map_bound(const struct shcd_model *model, int splits,
                            const shcd_allocator *allocator, shcdi_map *map);

/** Proven lower bound of (S(w) - centre) . n(w) over the whole surface, or 0 if none was found.
 *  Above 0 the radial projection is one-to-one: see map_star.c. */
double shcdi_star_margin(const struct shcd_model *model, shcd_vec3 centre);

/** Looks a direction up (need not be a unit vector, not zero). RT safe. */
void shcdi_map_look_up(const shcdi_map *map, shcd_vec3 direction, int hermite, shcdi_map_ray *ray);

/** Replaces the crossings of a look-up with count -1 by those of the nearest node, 0 of them if it
 * is unsure. RT safe. */
void shcdi_map_take_nearest(const shcdi_map *map, shcdi_map_ray *ray);

/** Slope and parameter of crossing k < ray->count, both interpolated linearly; `unit` is the unit
 *  direction that was looked up. RT safe. */
void shcdi_map_detail(const shcdi_map *map, const shcdi_map_ray *ray, int k, shcd_vec3 unit,
                      shcd_vec3 *slope, shcd_vec3 *parameter);

/** Interpolated radius of the reference surface. RT safe. */
double shcdi_map_reference(const shcdi_map *map, const shcdi_stencil *at, int hermite);

/** Proven error of the radii of a look-up, or +inf. RT safe. */
double shcdi_map_bound_at(const shcdi_map *map, const shcdi_stencil *at, int hermite);

/** As stored at a node with this radius and unit normal (either orientation). */
shcdi_crossing shcdi_map_crossing(shcd_vec3 direction, double radius, shcd_vec3 normal,
                                  shcd_vec3 parameter);

static inline shcd_vec3 shcdi_from_floats(const float v[3]) {
    return shcd_vec3_make((double)v[0], (double)v[1], (double)v[2]);
}

#endif
