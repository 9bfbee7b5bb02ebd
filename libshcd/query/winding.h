/* SPDX-License-Identifier: BSD-3-Clause */
/* Winding number of the leaf tessellation. */
#ifndef SHCDI_QUERY_WINDING_H
#define SHCDI_QUERY_WINDING_H

#include "model/tree.h"

/** Winding number of the leaf triangles around p: 0 outside, 1 inside an embedded surface. Right
 * where p is not on a triangle. RT safe: n_leaves steps. */
int shcdi_winding(const shcdi_tree *tree, shcd_vec3 p);

#endif
