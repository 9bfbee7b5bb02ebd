/* SPDX-License-Identifier: BSD-3-Clause */
/* What a body is compared with: its signed distance sampled in advance. */
#ifndef SHCD_TOOLS_COST_GRID_H
#define SHCD_TOOLS_COST_GRID_H

#include "shcd/model.h"

#include <stdbool.h>

/** What a field samples, and how far from the surface it will be asked. */
typedef struct cost_source {
    const shcd_model *model;
    shcd_vec3 low, high; /**< the box that is asked in [m] */
    double band_m;       /**< no point farther than this from the surface is asked */
    double deadline_s;   /**< of cost_spent_s(): give up then */
    void (*progress)(double fraction, void *user);
    void *user;
} cost_source;

/** Exact signed distance. */
double cost_source_ask(const cost_source *source, shcd_vec3 point);

/** Uniform grid of floats, trilinear between eight of them. */
typedef struct cost_grid {
    shcd_vec3 origin;
    double spacing_m;
    size_t n[3]; /**< nodes along x, y, z; x runs fastest */
    float *distance_m;
} cost_grid;

enum cost_build { COST_BUILT, COST_TOO_LONG, COST_NO_MEMORY };

/** `cells` along the longest side of the box. */
enum cost_build cost_grid_build(const cost_source *source, int cells, cost_grid *grid);
void cost_grid_free(cost_grid *grid);
size_t cost_grid_bytes(const cost_grid *grid);

/** Distance and gradient of the interpolant; points outside take the nearest cell's. */
void cost_grid_query(const cost_grid *grid, shcd_vec3 point, double *distance_m,
                     shcd_vec3 *gradient);

/** Trilinear interpolation of the corners of a cell; corner 4 k + 2 j + i lies at (i, j, k).
 *  `at` in [0, 1]^3; the gradient is per cell side. */
double cost_trilinear(const float corner[8], const double at[3], double gradient[3]);

#endif
