/* SPDX-License-Identifier: BSD-3-Clause */
/* Winding number of the leaf tessellation. */
#ifndef SHCDI_QUERY_WINDING_H
#define SHCDI_QUERY_WINDING_H

#include "query/view.h"

/** Winding number of the surface around a point that is farther from it than
 *  shcdi_tessellation_error(): 0 outside, 1 inside an embedded surface.
 *  @param[in,out] n_patches  grows by the blocks looked at, 16 balls counting as one
 *  @return 1; 0: not decided. RT safe. */
int shcdi_winding(const shcdi_view *view, shcd_vec3 p, int *winding, uint32_t *n_patches);

/** Largest distance of the surface from the leaf triangles that are stored, and from what closes
 *  the gaps between blocks [m]. RT safe. */
double shcdi_tessellation_error(const shcdi_view *view);

#endif
