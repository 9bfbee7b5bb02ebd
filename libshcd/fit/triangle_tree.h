/* SPDX-License-Identifier: BSD-3-Clause */
/* Bounding-box tree over triangles: exact distance to them, and first hit of a ray. */
#ifndef SHCD_FIT_TRIANGLE_TREE_H
#define SHCD_FIT_TRIANGLE_TREE_H

#include "shcd/vec.h"

typedef struct shcdi_triangle_tree shcdi_triangle_tree;

/** Positions and triangles are borrowed. @return SHCD_OK, SHCD_ERR_MEMORY */
shcd_status shcdi_triangle_tree_create(const shcd_vec3 *positions, const uint32_t *triangles,
                                       size_t n_triangles, shcdi_triangle_tree **tree);
void shcdi_triangle_tree_free(shcdi_triangle_tree *tree);

/** Distance from p to the nearest triangle. */
double shcdi_triangle_tree_distance(const shcdi_triangle_tree *tree, shcd_vec3 p);

/** Length of the ray from p along the unit vector d to its first hit; +inf: none. Triangles that
 *  share a vertex with triangle `own` are passed over. *hit is the triangle, if there is one. */
double shcdi_triangle_tree_ray(const shcdi_triangle_tree *tree, shcd_vec3 p, shcd_vec3 d,
                               uint32_t own, uint32_t *hit);

#endif
