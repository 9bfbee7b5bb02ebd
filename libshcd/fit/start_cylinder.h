/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef SHCD_FIT_START_CYLINDER_H
#define SHCD_FIT_START_CYLINDER_H

#include "energy.h"
#include "laplacian.h"

/** The start of kind SHCDI_START_CYLINDER. */
shcd_status shcdi_start_cylinder(const shcdi_energy *energy, shcdi_laplacian *laplacian,
                                 const shcd_vec3 *positions, shcd_vec3 *u);

#endif
