/* SPDX-License-Identifier: BSD-3-Clause */
/* What a model holds. Immutable after creation. */
#ifndef SHCDI_MODEL_MODEL_H
#define SHCDI_MODEL_MODEL_H

#include "model/cost.h"
#include "model/distance_map.h"
#include "model/ellipsoid.h"
#include "model/index.h"
#include "model/learned.h"
#include "model/modes.h"
#include "model/surface.h"
#include "model/tree.h"
#include "shcd/model.h"

struct shcd_model {
    shcd_allocator allocator;
    int degree;
    double *coefficients; /**< public order */
    double *recurrence;
    double *packed;
    double *enclosure; /**< degree + 1 certified offsets */
    shcdi_series series;
    shcdi_tree tree;   /**< while the model is made; empty (no leaves) afterwards */
    shcdi_index index; /**< what queries search */
    shcdi_map map;
    shcdi_ellipsoid ellipsoid; /**< degree 1: the surface; else half axes of 0 */
    double m[3];               /**< suprema of |S'|, |S''|, |S'''| over the sphere */
    double evaluation_error_m; /**< bound of the rounding error of an evaluated S */
    double spread_m;           /**< smallest |S(a) - S(b)| / angle(a, b) of pairs of samples */
    shcdi_cost cost;
    shcdi_modes modes;
    shcdi_learned learned;
    shcd_model_info info;
};

/** Largest size of a coefficient [m]. */
#define SHCDI_COEFFICIENT_MAX 1e11

/** shcd_model_surface() of any series. RT safe. */
shcd_status shcdi_surface_values(const shcdi_series *series, int degree, shcd_vec3 parameter,
                                 shcd_vec3 *point, shcd_vec3 *normal, double *jacobian);

/** Bound of the rounding error of an evaluated S, in the coefficients' unit. */
double shcdi_evaluation_error(const double *coefficients, int degree);

/** A model of the series alone: tree, index, bounds, box, ball and volume; no kernel, enclosure or
 *  map. It keeps its tree.
 *  Errors are worded as by shcd_model_create(). */
shcd_status shcdi_model_create_plain(int degree, const double *coefficients, int simd,
                                     const shcd_allocator *allocator, shcd_model **model,
                                     shcd_error *error);

/** Fields of info that follow from the tree: box, ball, volume, area. */
void shcdi_shape_measure(shcd_model *model);
/** Kernel centre and margin. Needs 4 n_vertices doubles of scratch. @return SHCD_OK or
 *  SHCD_ERR_MEMORY. */
shcd_status shcdi_shape_kernel(shcd_model *model);
/** Whether two leaf triangles cross. */
int shcdi_is_embedded(const shcdi_tree *tree);

#endif
