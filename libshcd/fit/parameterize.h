/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef SHCD_FIT_PARAMETERIZE_H
#define SHCD_FIT_PARAMETERIZE_H

#include "progress.h"
#include "shcd/vec.h"

/** Unit vectors for the vertices, no spherical triangle folded. Fills the parameterization's part
 *  of the report, on failure too.
 *  @param[in]  area_weight  lambda > 0 of the energy
 *  @param[out] u            one per vertex; unspecified on failure */
shcd_status shcdi_parameterize(const shcd_mesh *mesh, double area_weight,
                               const shcdi_progress *progress, shcd_vec3 *u,
                               shcd_fit_report *report, shcd_error *error);

#endif
