/* SPDX-License-Identifier: BSD-3-Clause */
/* A mesh about its own centre, and points spread over its faces. */
#ifndef SHCD_FIT_SAMPLES_H
#define SHCD_FIT_SAMPLES_H

#include "shcd/fit.h"
#include "shcd/vec.h"

/** The mesh relative to the centre of its bounding box: a body far from the origin then loses
 *  nothing but what its own coordinates have lost. */
typedef struct shcdi_body {
    size_t n_vertices, n_triangles;
    const uint32_t *triangles; /**< borrowed */
    shcd_vec3 *positions_m;    /**< less the centre */
    double *share;             /**< of each triangle in the area, sum 1 */
    shcd_vec3 centre_m;
    double diagonal_m, area_m2;
} shcdi_body;

shcd_status shcdi_body_init(shcdi_body *body, const shcd_mesh *mesh);
void shcdi_body_release(shcdi_body *body);

typedef struct shcdi_samples {
    size_t n;
    shcd_vec3 *points_m;   /**< on the faces, less the centre */
    shcd_vec3 *directions; /**< their unit vectors under the map; NULL if there was no map */
    double *weights;       /**< share of the mesh area that a sample stands for, sum 1 */
    uint32_t *faces;       /**< triangle of each sample */
} shcdi_samples;

/** At least n_wanted samples, at least one on each face; by area of the mesh, and if there is a map
 * u half of them by area on the sphere. The same call gives the same samples.
 *  @param[in] u  directions of the vertices, or NULL */
shcd_status shcdi_samples_make(shcdi_samples *samples, const shcdi_body *body, const shcd_vec3 *u,
                               uint64_t n_wanted);
void shcdi_samples_release(shcdi_samples *samples);

/** Share of a spherical triangle in the sphere. */
double shcdi_sphere_share(shcd_vec3 a, shcd_vec3 b, shcd_vec3 c);

#endif
