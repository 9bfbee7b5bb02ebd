/* SPDX-License-Identifier: BSD-3-Clause */
/* Winding number of the leaf tessellation. */
#ifndef SHCDI_QUERY_WINDING_H
#define SHCDI_QUERY_WINDING_H

#include "query/view.h"

/** Winding number of the leaf triangles around p: 0 outside, 1 inside an embedded surface. Right
 * where p is farther from them than their nodes were moved by storage. RT safe: one step a leaf. */
int shcdi_winding(const shcdi_view *view, shcd_vec3 p);

/** Largest distance of the surface from the leaf triangles that are stored [m]. RT safe. */
double shcdi_tessellation_error(const shcdi_view *view);

#endif
