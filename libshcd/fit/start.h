/* SPDX-License-Identifier: BSD-3-Clause */
/* First maps of a mesh onto the sphere, from which folds are then removed. */
#ifndef SHCD_FIT_START_H
#define SHCD_FIT_START_H

#include "energy.h"
#include "laplacian.h"

/** Kinds of starts, tried in this order. */
typedef enum shcdi_start {
    SHCDI_START_RADIAL = 0,   /**< radial projection from the area centroid */
    SHCDI_START_CYLINDER = 1, /**< harmonic latitude and its conjugate between two far vertices */
    SHCDI_START_SMOOTHED = 2, /**< radial projection after the surface was smoothed */
    SHCDI_START_COUNT = 3
} shcdi_start;

/** Fills u with unit vectors.
 *  @param[in] positions  centred and scaled, as given to shcdi_energy_init()
 *  @return SHCD_OK, SHCD_ERR_MEMORY, SHCD_ERR_CONVERGENCE */
shcd_status shcdi_start_make(shcdi_start kind, const shcdi_energy *energy,
                             shcdi_laplacian *laplacian, const shcd_vec3 *positions, shcd_vec3 *u);

#endif
