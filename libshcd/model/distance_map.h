/* SPDX-License-Identifier: BSD-3-Clause */
/* The distance map: for true directions from a centre, the sorted crossings of the ray with the
 * surface. */
#ifndef SHCDI_MODEL_DISTANCE_MAP_H
#define SHCDI_MODEL_DISTANCE_MAP_H

#include "base/internal.h"

/** One crossing of a node's ray. */
typedef struct shcdi_crossing {
    float radius;       /**< from the centre [m] */
    float slope[3];     /**< gradient of the radius over unit directions, tangential [m/rad] */
    float parameter[3]; /**< w */
} shcdi_crossing;

#define SHCDI_MAP_CROSSINGS_MAX 16
/** A ray whose crossings could not be told apart, or with the wrong parity. */
#define SHCDI_MAP_UNSURE 255

/** Nodes: lattice points of the octahedron |i| + |j| + |k| = resolution. */
typedef struct shcdi_map {
    int resolution;
    shcd_vec3 centre;
    int centre_inside; /**< parity of the crossings seen from the centre */
    uint32_t *first;   /**< of each cell of the unfolded octahedron: its first crossing */
    uint8_t *count;    /**< crossings of each cell, or SHCDI_MAP_UNSURE */
    size_t n_crossings;
    shcdi_crossing *crossing;
    int crossings_max;
    double one_crossing_share;
    double linear_error_m, hermite_error_m; /**< measured */
} shcdi_map;

/** Interpolated crossings along one direction. */
typedef struct shcdi_map_ray {
    int count; /**< of crossings, or -1: the nodes around disagree */
    double radius[SHCDI_MAP_CROSSINGS_MAX];
    size_t nearest_cell; /**< node with the largest weight */
} shcdi_map_ray;

struct shcd_model;

/** Builds model->map; needs the tree, the kernel and the series. @return SHCD_OK, SHCD_ERR_MEMORY.
 */
shcd_status shcdi_map_create(struct shcd_model *model);
void shcdi_map_free(shcdi_map *map, const shcd_allocator *allocator);
size_t shcdi_map_bytes(const shcdi_map *map);

/** Looks a direction up (need not be a unit vector, not zero). RT safe. */
void shcdi_map_look_up(const shcdi_map *map, shcd_vec3 direction, int hermite, shcdi_map_ray *ray);

#endif
