/* SPDX-License-Identifier: BSD-3-Clause */
/* Gradients on the body's surface of functions given by their modes' amplitudes, at the nodes of a
 * Gauss-Legendre x uniform grid, and the adjoint of that map. */
#ifndef SHCD_FIT_MEMBRANE_GRID_H
#define SHCD_FIT_MEMBRANE_GRID_H

#include "shcd/model.h"

typedef struct shcdi_membrane_grid shcdi_membrane_grid;

/** @param[in]  modes        of the model, borrowed; the first n_modes of them
 *  @param[in]  n_latitudes    above the model's degree; n_longitudes is twice that
 *  @return SHCD_OK, SHCD_ERR_GEOMETRY (the surface is singular at a node), SHCD_ERR_MEMORY. */
shcd_status shcdi_membrane_grid_create(const shcd_model *model, const shcd_modes *modes,
                                       size_t n_modes, size_t n_latitudes,
                                       shcdi_membrane_grid **grid);
/** Accepts NULL. */
void shcdi_membrane_grid_free(shcdi_membrane_grid *grid);

/** Nodes of the grid, and their share of the surface's area [m^2]. */
size_t shcdi_membrane_grid_size(const shcdi_membrane_grid *grid);
const double *shcdi_membrane_grid_area(const shcdi_membrane_grid *grid);

/** Gradients of u = sum_k q_k phi_k in an orthonormal frame of the surface at each node.
 *  @param[in]  q   amplitudes [m^2]
 *  @param[out] gx  one for each node, dimensionless; gy likewise */
void shcdi_membrane_grid_gradient(shcdi_membrane_grid *grid, const double *q, double *gx,
                                  double *gy);
/** The adjoint: out_k += sum over the nodes of sx (grad phi_k)_x + sy (grad phi_k)_y, sx and sy
 *  with the node's area in them. */
void shcdi_membrane_grid_gather(shcdi_membrane_grid *grid, const double *sx, const double *sy,
                                double *out);

/** The adjoint of shcdi_membrane_grid_values(): out_k += sum over the nodes of s phi_k. */
void shcdi_membrane_grid_gather_values(shcdi_membrane_grid *grid, const double *s, double *out);

/** Values u = sum_k q_k phi_k at the nodes [m]. */
void shcdi_membrane_grid_values(shcdi_membrane_grid *grid, const double *q, double *u);

#endif
