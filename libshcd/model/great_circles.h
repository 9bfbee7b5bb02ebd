/* SPDX-License-Identifier: BSD-3-Clause */
/* The first three derivatives of a surface along every great circle through a point, for all nodes
 * of a ring of equal theta at once. Scratch of model creation. */
#ifndef SHCDI_MODEL_GREAT_CIRCLES_H
#define SHCDI_MODEL_GREAT_CIRCLES_H

#include "base/internal.h"

/** With alpha the angle from e_theta towards e_phi of the great circle's tangent,
 *    S'   = U cos(alpha) + V sin(alpha)
 *    S''  = Z + X cos(2 alpha) + Y sin(2 alpha)
 *    S''' = P cos(alpha) + Q sin(alpha) + C cos(3 alpha) + D sin(3 alpha);
 *  these nine vectors are the columns, each with its three coordinates. */
#define SHCDI_CIRCLE_U 0
#define SHCDI_CIRCLE_V 3
#define SHCDI_CIRCLE_Z 6
#define SHCDI_CIRCLE_X 9
#define SHCDI_CIRCLE_Y 12
#define SHCDI_CIRCLE_P 15
#define SHCDI_CIRCLE_Q 18
#define SHCDI_CIRCLE_C 21
#define SHCDI_CIRCLE_D 24
#define SHCDI_CIRCLE_COLUMNS 27

/** Nodes that are computed together: neighbours on a quarter of the ring. */
#define SHCDI_CIRCLE_LANES 8
/** Images of a quarter: phi, pi - phi, pi + phi, 2 pi - phi. */
#define SHCDI_CIRCLE_IMAGES 4

typedef double shcdi_circle_values[SHCDI_CIRCLE_COLUMNS][SHCDI_CIRCLE_LANES];

typedef struct shcdi_great_circles {
    int degree;
    size_t n_phi;    /**< nodes of a ring, a multiple of 4: phi_k = 2 pi k/n_phi */
    size_t n_blocks; /**< of SHCDI_CIRCLE_LANES nodes, to cover 0 .. n_phi/4 */
    double *series, *recurrence, *wave, *fourier;
} shcdi_great_circles;

/** Scratch of shcdi_great_circles_init(), in doubles. */
size_t shcdi_great_circles_size(int degree, size_t n_phi);

/** Prepares the series of 3 (degree+1)^2 coefficients in the public order; keeps `memory`. */
void shcdi_great_circles_init(shcdi_great_circles *g, int degree, const double *coefficients,
                              size_t n_phi, double *memory);

/** Goes to the ring at theta, 0 < theta < pi. */
void shcdi_great_circles_ring(shcdi_great_circles *g, double theta);

/** Columns at the four images of nodes block LANES .. block LANES + LANES - 1 of the ring. */
void shcdi_great_circles_block(const shcdi_great_circles *g, size_t block,
                               shcdi_circle_values image[SHCDI_CIRCLE_IMAGES]);

#endif
