/* SPDX-License-Identifier: BSD-3-Clause */
/* The matrices of a membrane on a body's surface in the basis of the harmonics. */
#ifndef SHCD_FIT_GALERKIN_H
#define SHCD_FIT_GALERKIN_H

#include "progress.h"

/** M_ij = int Y_i Y_j dA and K_ij = int (grad_S Y_i . grad_S Y_j + alpha Y_i Y_j) dA, both whole
 *  and symmetric, in the order of shcdi_galerkin_index(). */
typedef struct shcdi_galerkin {
    int degree;
    size_t n;                 /**< (degree+1)^2 */
    double *mass, *stiffness; /**< n x n */
    double area_m2, volume_m3;
    double *anchor_integral; /**< int alpha_j dA of each anchor */
} shcdi_galerkin;

/** Row of Y_lm: orders m = -degree .. degree in blocks, l running fastest. */
static inline size_t shcdi_galerkin_index(int degree, int l, int m) {
    size_t before = 0;
    for (int k = -degree; k < m; ++k) {
        before += (size_t)(degree + 1 - (k < 0 ? -k : k));
    }
    return before + (size_t)(l - (m < 0 ? -m : m));
}

/** @return SHCD_OK, SHCD_ERR_MEMORY. Release in any case. */
shcd_status shcdi_galerkin_init(shcdi_galerkin *g, int degree, size_t n_anchors);
void shcdi_galerkin_release(shcdi_galerkin *g);

/** Fills the matrices by quadrature over n_rings parallels.
 *  @return SHCD_OK, SHCD_ERR_GEOMETRY (the surface has no tangent plane at a node), _MEMORY,
 *  _CANCELLED, _ARGUMENT (n_rings <= 2 degree). */
shcd_status shcdi_galerkin_fill(shcdi_galerkin *g, const double *coefficients, size_t n_rings,
                                const shcd_anchor *anchors, size_t n_anchors,
                                const shcdi_progress *progress);

#endif
