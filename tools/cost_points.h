/* SPDX-License-Identifier: BSD-3-Clause */
/* Where the cost of a body is measured: points near its surface, and what is true of them.
 *
 * random: a point of the surface, by area, and an offset along the normal: for one half of the
 *         points within +-1 % of the diagonal (the contact band), for the other within +-5 %.
 * path:   what a tool does: 0.1 % of the diagonal from one point to the next along the surface,
 *         going in and out between -2 % and +2 %.
 */
#ifndef SHCD_TOOLS_COST_POINTS_H
#define SHCD_TOOLS_COST_POINTS_H

#include "shcd/model.h"

#include <stdbool.h>

/** Of the body's diagonal. */
#define COST_CONTACT_BAND 0.01
#define COST_NEAR_BAND 0.05
#define COST_PATH_STEP 0.001
#define COST_PATH_DEPTH 0.02
/** Width of the interval in which the truth is certified to lie. */
#define COST_TRUTH 1e-9

/** Uniform random numbers; the same seed gives the same ones on every machine. */
typedef struct cost_random {
    uint64_t state;
} cost_random;

/** In [0, 1). */
double cost_random_next(cost_random *random);

/** Draws points of a surface by area. */
typedef struct cost_sampler cost_sampler;

/** NULL: no memory. */
cost_sampler *cost_sampler_create(const shcd_model *model);
void cost_sampler_free(cost_sampler *sampler);
/** Any output may be NULL. */
void cost_sampler_draw(const cost_sampler *sampler, cost_random *random, shcd_vec3 *point,
                       shcd_vec3 *normal);

/** Points and the truth about them. */
typedef struct cost_points {
    size_t n;
    shcd_vec3 *point;
    shcd_vec3 *before;  /**< where a tool would come from, one step of a path earlier */
    double *distance_m; /**< exact, of the whole series; NaN: not known, the point does not count */
    shcd_vec3 *normal;  /**< at the closest point */
    double *mesh_m;     /**< signed distance to the mesh, or NULL */
    size_t n_unknown;
} cost_points;

/** False: no memory. */
bool cost_points_random(const cost_sampler *sampler, double diagonal_m, size_t n,
                        cost_random *random, cost_points *points);
bool cost_points_path(const shcd_model *model, double diagonal_m, size_t n, cost_random *random,
                      cost_points *points);
void cost_points_free(cost_points *points);

/** Fills in the truth about points first .. first + n - 1. */
void cost_points_ask(const shcd_model *model, size_t first, size_t n, cost_points *points);

#endif
