/* SPDX-License-Identifier: BSD-3-Clause */
/* Octree of sampled distances that is fine where the distance is hard to interpolate: Frisken,
 * Perry, Rockwood, Jones, Adaptively sampled distance fields, SIGGRAPH (2000). */
#ifndef SHCD_TOOLS_COST_ADF_H
#define SHCD_TOOLS_COST_ADF_H

#include "cost_grid.h"

/** Levels below the root; the finest cell is 1/512 of the box. */
#define COST_ADF_DEPTH 9

typedef struct cost_adf {
    shcd_vec3 origin;
    double side_m; /**< of the root cell, a cube */
    size_t n_nodes;
    int32_t *node; /**< >= 0: index of the first of eight children; < 0: ~index of a leaf */
    size_t n_leaves;
    float (*leaf)[8]; /**< distances at the corners [m] */
} cost_adf;

/** Splits cells until the interpolated distance is within `tolerance_m` of the exact one at the
 *  middles of the cell's edges and sides and in its centre. */
enum cost_build cost_adf_build(const cost_source *source, double tolerance_m, cost_adf *adf);
void cost_adf_free(cost_adf *adf);
size_t cost_adf_bytes(const cost_adf *adf);

/** As cost_grid_query(). */
void cost_adf_query(const cost_adf *adf, shcd_vec3 point, double *distance_m, shcd_vec3 *gradient);

#endif
