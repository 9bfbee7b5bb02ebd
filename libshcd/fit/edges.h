/* SPDX-License-Identifier: BSD-3-Clause */
/* The undirected edges of a triangle list, sorted, so that the two sides of an edge are adjacent.
 */
#ifndef SHCD_FIT_EDGES_H
#define SHCD_FIT_EDGES_H

#include <stddef.h>
#include <stdint.h>

/** One side of an edge: corner 3 t + k stands for the edge of triangle t opposite its corner k. */
typedef struct shcdi_edge {
    uint32_t low, high; /**< vertices, low < high */
    size_t corner;
} shcdi_edge;

/** 3 n_triangles sides by (low, high, corner); release with free(). NULL: out of memory. */
shcdi_edge *shcdi_edges_sorted(const uint32_t *triangles, size_t n_triangles);

static inline int shcdi_edge_is_same(const shcdi_edge *a, const shcdi_edge *b) {
    return a->low == b->low && a->high == b->high;
}

#endif
