/* SPDX-License-Identifier: BSD-3-Clause */
/* Crossings of a ray with a model's surface. Not for a tick. */
#ifndef SHCDI_MODEL_MAP_CAST_H
#define SHCDI_MODEL_MAP_CAST_H

#include "model/model.h"

typedef struct shcdi_hit {
    double radius; /**< from the ray's origin */
    shcd_vec3 w, normal;
} shcdi_hit;

/** Off-ray residual |e1 . x| + |e2 . x| [m] at which Newton's method stops. */
static inline double shcdi_ray_tolerance(const shcd_model *model) {
    return 1e-13 * model->info.diagonal_m + 4.0 * model->evaluation_error_m;
}

/** Newton for S(w) - origin parallel to d, from a start; 1 if it converges in front of the origin.
 *  Each step takes one of *steps_left; without any left it has not converged. */
int shcdi_ray_newton(const shcd_model *model, shcd_vec3 origin, shcd_vec3 d, shcd_vec3 start,
                     size_t *steps_left, shcdi_hit *hit);

/** All crossings of a ray, nearest first: Newton from every leaf whose ball it meets. Returns their
 *  number, which exceeds SHCDI_MAP_CROSSINGS_MAX if there are more than that or too many leaves, or
 *  if *steps_left, which many rays may share, has come to 0. */
int shcdi_cast_within(const shcd_model *model, shcd_vec3 origin, shcd_vec3 d, size_t *steps_left,
                      shcdi_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1]);

/** Of one ray, with as many steps as that may take. */
int shcdi_cast(const shcd_model *model, shcd_vec3 origin, shcd_vec3 d,
               shcdi_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1]);

#endif
