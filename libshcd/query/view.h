/* SPDX-License-Identifier: BSD-3-Clause */
/* What a query sees: the current surface of a model, rest or deformed, with bounds that hold for
 * it. Queries never look at the model's tables directly, so that how those are stored and how they
 * follow a deformation is known in one place.
 *
 * The parameter sphere is cut into leaves, and 16 consecutive leaves make a block.
 *
 * How bounds follow. Let D = S - S_rest, E = S - S_tree with S_tree the surface that the node
 * positions of a block were evaluated from, and B_k the bounds of growth.c. Derivatives of S exceed
 * those of S_rest by at most B_k(D), and S'.S'' by B_1 M_2 + B_2 M_1 + B_1 B_2, M_k of the rest
 * shape. A leaf's flat triangle deviates from S_tree by at most its rest value plus
 * K_1 B_1(D_tree) + K_2 B_2(D_tree), since the bound of tree.c is linear in the derivatives'
 * bounds; and S_tree(w) from S(w) by at most B_0(E). Both are taken block by block, since blocks
 * may stem from different moments (shape.c). */
#ifndef SHCDI_QUERY_VIEW_H
#define SHCDI_QUERY_VIEW_H

#include "model/model.h"
#include "shcd/shape.h"

typedef struct shcdi_view {
    const shcd_model *model;
    const shcdi_index *index;
    shcdi_positions positions;
    shcdi_series series;       /**< current coefficients */
    double growth[4];          /**< what |S|, |S'|, |S''|, |S'''| may exceed those at rest by */
    const float *block_growth; /**< what the deviations of a block's leaves may exceed the tables
                                    by, scaled, n_balls of them; NULL: nothing */
    double deviation_growth_m; /**< the largest of these */
    double parting_m;          /**< what blocks may part by, positions being of different moments */
    double evaluation_error_m; /**< rounding of an evaluated S */
    double radius_m;           /**< certified, about model->info.centre_m */
    double diagonal_m;         /**< yardstick: that of the rest shape */
    int is_embedded;           /**< 1: no self-intersection is expected */
} shcdi_view;

/** Bounds that hold within `reach` of a leaf's centre, for the leaf and around it. */
typedef struct shcdi_leaf_bounds {
    double m1, m2, m3; /**< suprema of |S'|, |S''|, |S'''| along great circles [m/rad, ...] */
    double sigma;      /**< >= 0; infimum of |S'| along great circles */
    double product;    /**< supremum of |S'.S''| along great circles */
    double reach;      /**< angle */
} shcdi_leaf_bounds;

/** One leaf of the parameter sphere, as a patch of the current surface. */
typedef struct shcdi_view_leaf {
    shcd_vec3 w[3];     /**< corners on the parameter sphere, counter-clockwise from outside */
    shcd_vec3 x[3];     /**< corners of its flat triangle */
    double deviation_m; /**< |S(w) - that triangle| <= this for all w of the leaf */
    shcd_vec3 centre;   /**< unit vector */
    double angle;       /**< the leaf lies within this angle of centre */
    double m1, m2, m3, sigma, product, reach; /**< as in shcdi_leaf_bounds */
} shcdi_view_leaf;

/** Rest shape if shape is NULL. RT safe. */
void shcdi_view_of(const shcd_model *model, const shcd_shape *shape, shcdi_view *view);

size_t shcdi_view_block_count(const shcdi_view *view);

/** What the deviations of a block's leaves may exceed the tables by [m]. RT safe. */
static inline double shcdi_view_growth(const shcdi_view *view, size_t block) {
    return view->block_growth != NULL ? (double)view->block_growth[block] / view->index->scale
                                      : 0.0;
}

/** Radius of a ball that contains S(w) for all w of a block. RT safe. */
double shcdi_view_block_ball(const shcdi_view *view, size_t block, shcd_vec3 *centre);

/** Leaf 16 block + k is leaf k of that block. RT safe. */
void shcdi_view_leaf_at(const shcdi_view *view, size_t leaf, shcdi_view_leaf *out);

/** |S(w) - its flat triangle| over a leaf [m]. RT safe. */
double shcdi_view_deviation(const shcdi_view *view, size_t leaf);

/** Corners of a leaf's flat triangle. RT safe. */
void shcdi_view_triangle(const shcdi_view *view, size_t leaf, shcd_vec3 x[3]);

void shcdi_view_leaf_bounds(const shcdi_view *view, size_t leaf, shcdi_leaf_bounds *out);

/** Index of the leaf that holds a unit vector. RT safe. */
size_t shcdi_view_leaf_of(const shcdi_view *view, shcd_vec3 w);

static inline shcd_vec3 shcdi_view_corner(const shcdi_view *view, size_t leaf, int k) {
    return shcdi_index_direction(view->index, leaf, k);
}
static inline shcd_vec3 shcdi_view_point(const shcdi_view *view, shcd_vec3 w) {
    return shcdi_surface_point(&view->series, view->model->degree, w);
}
static inline void shcdi_view_jet(const shcdi_view *view, shcd_vec3 w, shcdi_jet *jet) {
    shcdi_surface_jet(&view->series, view->model->degree, w, jet);
}

#endif
