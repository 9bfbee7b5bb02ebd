/* SPDX-License-Identifier: BSD-3-Clause */
/* The block behind shcd_shape. No pointers: it may be moved or copied by memcpy. */
#ifndef SHCDI_QUERY_SHAPE_H
#define SHCDI_QUERY_SHAPE_H

#include "model/model.h"
#include "shcd/shape.h"

/** What the positions of one sector's blocks stem from. */
typedef struct shcdi_sector {
    double path_m; /**< the shape's path[0] when its positions were evaluated, or less */
    double tree_m; /**< what its leaves deviated by more than at rest then */
} shcdi_sector;

struct shcd_shape {
    uint64_t size; /**< of the whole block */
    uint64_t n_sets, n_refreshes, n_blocks_evaluated;
    double displacement[4]; /**< B_k(current - rest) */
    double tree_m;   /**< what the leaves deviated by more than at rest at the last refresh */
    double stale[4]; /**< B_k(current - what all node positions were evaluated from) */
    double path[4];  /**< sum of B_k over all changes: certificates compare two values */
    double evaluation_error_m; /**< rounding of an evaluated S */
    double inflation_m;        /**< largest bound of current - evaluated, over the blocks */
    double growth_m;           /**< largest of the blocks' growths */
    uint32_t is_uniform;       /**< 1: all positions stem from the tree's coefficients */
    uint32_t next_sector;      /**< the one that was evaluated longest ago */
    shcdi_sector sector[SHCDI_SECTORS_MAX];            /**< valid unless uniform */
    size_t tree_at, packed_at, growth_at, position_at; /**< offsets in value[] */
    double value[]; /**< current coefficients, those of the tree, packed, growths, positions; of
                         degree 1, its ellipsoid */
};

/** The half axes of a shape of degree 1. RT safe. */
const shcdi_ellipsoid *shcdi_shape_ellipsoid(const shcd_model *model, const shcd_shape *shape);

/** What the deviations of the blocks' leaves may exceed the tables by, scaled (view.h). */
static inline float *shcdi_shape_growths(const shcd_shape *shape) {
    union {
        const double *given;
        float *floats;
    } at = {shape->value + shape->growth_at};
    return at.floats;
}

#endif
