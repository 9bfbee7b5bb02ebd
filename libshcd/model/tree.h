/* SPDX-License-Identifier: BSD-3-Clause */
/* A fixed quadtree over the parameter sphere: the octahedron, every triangle split into four. The
 * node directions do not depend on the body; positions and bounds do. */
#ifndef SHCDI_MODEL_TREE_H
#define SHCDI_MODEL_TREE_H

#include "model/bounds.h"
#include "model/surface.h"

#define SHCDI_TREE_LEVEL_MAX 6

/** Bounds of one leaf triangle, rounded outward to float: m1..m3 bound the first three derivatives
 *  along great circles from above and sigma the first from below, at every parameter within the
 *  tree's reach of the leaf's centre. */
typedef struct shcdi_leaf {
    uint32_t vertex[3]; /**< counter-clockwise seen from outside the sphere */
    float deviation;    /**< |S(w) - flat triangle| over the leaf [m] */
    float m1, m2, m3;
    float sigma;
    float product; /**< bounds |S'.S''|, like m1..m3 */
} shcdi_leaf;

/** Ball that contains S(w) for all w of a node. */
typedef struct shcdi_ball {
    shcd_vec3 centre;
    double radius;
} shcdi_ball;

/** Node n of level k has children 4 n .. 4 n + 3 at level k + 1; level 0 is the octahedron. */
typedef struct shcdi_tree {
    int level;            /**< of the leaves */
    size_t n_vertices;    /**< 4^(level+1) + 2 */
    size_t n_leaves;      /**< 8 4^level */
    shcd_vec3 *direction; /**< n_vertices unit vectors */
    shcd_vec3 *position;  /**< S there */
    shcdi_leaf *leaf;     /**< n_leaves */
    shcdi_ball *ball;     /**< levels 0 .. level, one after the other */
    double deviation_max;
    double angle_max; /**< every leaf lies within this angle of its centre */
    double reach;     /**< SHCDI_TREE_REACH times that */
} shcdi_tree;

/** How far bounds of a leaf look beyond it: the leaves that compete with the closest point's own
 * lie around it, up to a leaf's diameter of sqrt(3) circumradii from a foot in its corner, and the
 * foot itself up to one from the centre. */
#define SHCDI_TREE_REACH 3.0

static inline size_t shcdi_tree_level_size(int level) {
    return (size_t)8 << (2 * level);
}
/** Index in `ball` of the first node of a level: 8 (4^level - 1)/3. */
static inline size_t shcdi_tree_level_start(int level) {
    return (shcdi_tree_level_size(level) - 8) / 3;
}
static inline size_t shcdi_tree_ball_count(int level) {
    return shcdi_tree_level_start(level + 1);
}

/** Cell of a lattice point |i| + |j| + |k| = n in the unfolded octahedron, (2 n + 1)^2 cells. RT
 * safe. */
size_t shcdi_lattice_cell(const int p[3], int n);

/** Level of the leaves that suits a degree. */
int shcdi_tree_level_for(int degree);

/** Directions and leaf triangles only. @return SHCD_OK or SHCD_ERR_MEMORY. */
shcd_status shcdi_tree_create(int level, const shcd_allocator *allocator, shcdi_tree *tree);
void shcdi_tree_free(shcdi_tree *tree, const shcd_allocator *allocator);

/** Positions, leaf bounds and balls for a body. `evaluation_error_m` bounds the rounding of S. */
void shcdi_tree_fill(shcdi_tree *tree, const shcdi_series *series, const shcdi_bounds *bounds,
                     double evaluation_error_m);

/** Deviation of S over a spherical triangle from the flat triangle of its corners' positions. */
double shcdi_patch_deviation(shcd_vec3 a, shcd_vec3 b, shcd_vec3 c, double m1, double m2);

#endif
