/* SPDX-License-Identifier: BSD-3-Clause */
/* Certified suprema of |S'|, |S''|, |S'''| along great circles, over the sphere and over caps.
 * Scratch of model creation. */
#ifndef SHCDI_MODEL_BOUNDS_H
#define SHCDI_MODEL_BOUNDS_H

#include "base/internal.h"

/** Of the three orders, then of |S'.S''|. */
#define SHCDI_SUPREMA 4

typedef struct shcdi_bounds {
    int degree;
    size_t n_theta, n_phi;
    double covering;           /**< every direction lies within this angle of a node */
    double sup[SHCDI_SUPREMA]; /**< over the whole sphere */
    double *ring;              /**< cos and sin of theta of each ring */
    float *sample; /**< n_theta n_phi nodes: the suprema there of the three orders and the product,
                        rounded up, and the infimum of the first, rounded down */
    float *group;  /**< of groups of neighbours on a ring, likewise; behind the samples */
} shcdi_bounds;

/** Samples the derivatives of a series; 3 (degree+1)^2 coefficients in the public order.
 *  @return SHCD_OK or SHCD_ERR_MEMORY. */
shcd_status shcdi_bounds_create(int degree, const double *coefficients,
                                const shcd_allocator *allocator, shcdi_bounds *bounds);
void shcdi_bounds_free(shcdi_bounds *bounds, const shcd_allocator *allocator);

/** Suprema over all points of the cap and all great circles through them; into *least, if not NULL,
 *  the infimum of |S'| over them, >= 0. */
void shcdi_bounds_cap(const shcdi_bounds *bounds, shcd_vec3 centre, double angle,
                      double sup[SHCDI_SUPREMA], double *least);

/** Covering angle of a grid theta_j = (j + 1/2) pi/n, phi_k = pi k/n. */
double shcdi_grid_covering(size_t n_theta);

#endif
