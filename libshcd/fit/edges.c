/* SPDX-License-Identifier: BSD-3-Clause */
/* Sorted by a total order, so that the result does not depend on the C library's qsort. */
#include "edges.h"

#include <stdlib.h>

static int compare(const void *pa, const void *pb) {
    const shcdi_edge *a = pa, *b = pb;
    if (a->low != b->low) {
        return a->low < b->low ? -1 : 1;
    }
    if (a->high != b->high) {
        return a->high < b->high ? -1 : 1;
    }
    return a->corner < b->corner ? -1 : a->corner > b->corner;
}

shcdi_edge *shcdi_edges_sorted(const uint32_t *triangles, size_t n_triangles) {
    shcdi_edge *edges = malloc(3 * n_triangles * sizeof *edges);
    if (edges == NULL) {
        return NULL;
    }
    for (size_t corner = 0; corner < 3 * n_triangles; ++corner) {
        const size_t t = corner / 3, k = corner % 3;
        const uint32_t i = triangles[3 * t + (k + 1) % 3], j = triangles[3 * t + (k + 2) % 3];
        edges[corner].low = i < j ? i : j;
        edges[corner].high = i < j ? j : i;
        edges[corner].corner = corner;
    }
    qsort(edges, 3 * n_triangles, sizeof *edges, compare);
    return edges;
}
