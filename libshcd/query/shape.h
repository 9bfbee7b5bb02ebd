/* SPDX-License-Identifier: BSD-3-Clause */
/* The block behind shcd_shape. No pointers: it may be moved or copied by memcpy. */
#ifndef SHCDI_QUERY_SHAPE_H
#define SHCDI_QUERY_SHAPE_H

#include "model/model.h"
#include "shcd/shape.h"

struct shcd_shape {
    uint64_t size; /**< of the whole block */
    uint64_t n_sets, n_refreshes;
    double displacement[4];    /**< B_k(current - rest) */
    double tree[4];            /**< B_k(what the node positions were evaluated from - rest) */
    double stale[4];           /**< B_k(current - what the node positions were evaluated from) */
    double path[4];            /**< sum of B_k over all changes: certificates compare two values */
    double evaluation_error_m; /**< rounding of an evaluated S */
    size_t tree_at, packed_at, position_at; /**< offsets in value[] */
    double value[]; /**< current coefficients, those of the tree, packed, positions */
};

#endif
