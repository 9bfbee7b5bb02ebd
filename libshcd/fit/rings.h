/* SPDX-License-Identifier: BSD-3-Clause */
/* Quadrature over a body's surface, one parallel of a Gauss-Legendre x uniform grid at a time. */
#ifndef SHCD_FIT_RINGS_H
#define SHCD_FIT_RINGS_H

#include "shcd/model.h"
#include "shcd/vec.h"

/** A harmonic and its derivatives on the parallel, without their dependence on longitude phi:
 *    Y_lm             = value cos(m phi)      Y_l,-m             = value sin(m phi)
 *    dY_lm/dtheta     = slope cos(m phi)      dY_l,-m/dtheta     = slope sin(m phi)
 *    dY_lm/dphi/sine  = -turn sin(m phi)      dY_l,-m/dphi/sine  = turn cos(m phi)
 *  for m >= 0, at shcdi_ring_index(). */
typedef struct shcdi_ring_harmonics {
    double *value, *slope, *turn;
} shcdi_ring_harmonics;

/** One parallel. Nodes at phi_k = 2 pi k / n; derivatives along the unit vectors e_theta (to the
 *  south) and e_phi (to the east), e_theta x e_phi = w. */
typedef struct shcdi_ring {
    double z, sine;  /**< of the parameter w = (sine cos phi, sine sin phi, z) */
    double share_sr; /**< solid angle of each node: int f dw = sum share_sr f */
    shcdi_ring_harmonics harmonics;
    shcd_vec3 *point;                   /**< S [m], n of them */
    shcd_vec3 *along_theta, *along_phi; /**< dS/dtheta, dS/dphi/sine [m] */
} shcdi_ring;

/** What integrals over the surface need of a node. */
typedef struct shcdi_metric {
    shcd_vec3 area_vector; /**< S_theta x S_phi, outward: dA = |area_vector| dw [m^2] */
    double area;           /**< its length; 0: singular, and the rest is not set */
    double i11, i12, i22;  /**< inverse of the first fundamental form [1/m^2] */
} shcdi_metric;

typedef struct shcdi_rings shcdi_rings;

/** Index of (l, m), 0 <= m <= l, with l running fastest: orders m in blocks of their own. */
static inline size_t shcdi_ring_index(int degree, int l, int m) {
    const size_t before = (size_t)m * (size_t)(2 * degree + 3 - m) / 2;
    return before + (size_t)(l - m);
}

/** @param[in] coefficients  3 (degree+1)^2 in the public order, borrowed
 *  @param[in] n_rings       > 2 degree; each has 2 n_rings nodes
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_MEMORY. */
shcd_status shcdi_rings_create(int degree, const double *coefficients, size_t n_rings,
                               shcdi_rings **rings);
void shcdi_rings_free(shcdi_rings *rings);
size_t shcdi_rings_node_count(const shcdi_rings *rings);

/** Parallel j from the north, valid until the next call. @return NULL: j is out of range. */
const shcdi_ring *shcdi_rings_at(shcdi_rings *rings, size_t j);

/** Cosine and sine moments of a function on the nodes of a parallel: even[k] = sum_i f_i
 *  cos(k phi_i), odd[k] = sum_i f_i sin(k phi_i), k = 0 .. 2 degree. */
void shcdi_rings_moments(shcdi_rings *rings, const double *f, double *even, double *odd);

shcdi_metric shcdi_ring_metric(const shcdi_ring *ring, size_t k);

#endif
