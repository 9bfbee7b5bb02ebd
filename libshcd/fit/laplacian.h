/* SPDX-License-Identifier: BSD-3-Clause */
/* Weighted graph Laplacian plus mass on the edges of a mesh, factorised by CHOLMOD. */
#ifndef SHCD_FIT_LAPLACIAN_H
#define SHCD_FIT_LAPLACIAN_H

#include "shcd/base.h"

typedef struct shcdi_laplacian shcdi_laplacian;

/** Finds the sparsity pattern and orders it once. @return SHCD_OK, SHCD_ERR_MEMORY,
 * SHCD_ERR_ARGUMENT (more edges than CHOLMOD's int can index) */
shcd_status shcdi_laplacian_create(size_t n_vertices, const uint32_t *triangles, size_t n_triangles,
                                   shcdi_laplacian **laplacian);
void shcdi_laplacian_free(shcdi_laplacian *laplacian);

/** Factorises sum over edges w (x_i - x_j)^2 + sum m_i x_i^2.
 *  @param[in] weights  > 0, 3 per triangle, edge k opposite corner k; an edge gets both shares
 *  @param[in] mass     n_vertices values > 0
 *  @return SHCD_OK, SHCD_ERR_MEMORY, SHCD_ERR_CONVERGENCE (not positive definite in double) */
shcd_status shcdi_laplacian_factorise(shcdi_laplacian *laplacian, const double *weights,
                                      const double *mass);

/** Solves for the three coordinates of a vector per vertex. */
shcd_status shcdi_laplacian_solve(shcdi_laplacian *laplacian, const shcd_vec3 *right_hand_side,
                                  shcd_vec3 *solution);

#endif
