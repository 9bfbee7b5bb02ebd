/* SPDX-License-Identifier: BSD-3-Clause */
/* The matrix of every phase has the pattern of the mesh's edges, so that it is ordered and analysed
 * once and only factorised again when the weights change.
 *
 * The simplicial factorisation is used throughout: the supernodal one is faster on large meshes but
 * takes its sums from whatever BLAS is installed, and the same mesh must give the same bits. */
#include "laplacian.h"

#include "edges.h"
#include "shcd/vec.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include <cholmod.h>

struct shcdi_laplacian {
    cholmod_common common;
    cholmod_sparse *matrix; /* lower triangle by columns; the first entry of a column is diagonal */
    cholmod_factor *factor;
    cholmod_dense *right_hand_side, *solution, *work_y, *work_e; /* kept between solves */
    size_t n_vertices, n_triangles;
    const uint32_t *triangles; /* borrowed */
    int *slot;                 /* position of triangle edge k in matrix->x */
};

/* Columns of the lower triangle from the sorted edges; notes where each triangle edge went. */
static void fill_pattern(shcdi_laplacian *laplacian, const shcdi_edge *edges) {
    int *column = laplacian->matrix->p, *row = laplacian->matrix->i;
    const size_t n_edges = 3 * laplacian->n_triangles;
    int n = 0;
    size_t e = 0;
    for (size_t v = 0; v < laplacian->n_vertices; ++v) {
        column[v] = n;
        row[n++] = (int)v;
        for (; e < n_edges && edges[e].low == v; ++e) {
            if (e == 0 || !shcdi_edge_is_same(&edges[e], &edges[e - 1])) {
                row[n++] = (int)edges[e].high;
            }
            laplacian->slot[edges[e].corner] = n - 1;
        }
    }
    column[laplacian->n_vertices] = n;
}

static shcd_status analyse(shcdi_laplacian *laplacian) {
    shcdi_edge *edges = shcdi_edges_sorted(laplacian->triangles, laplacian->n_triangles);
    laplacian->slot = malloc(3 * laplacian->n_triangles * sizeof *laplacian->slot);
    if (edges == NULL || laplacian->slot == NULL) {
        free(edges);
        return SHCD_ERR_MEMORY;
    }
    size_t n_unique = 0;
    for (size_t e = 0; e < 3 * laplacian->n_triangles; ++e) {
        n_unique += e == 0 || !shcdi_edge_is_same(&edges[e], &edges[e - 1]);
    }
    const size_t n = laplacian->n_vertices;
    laplacian->matrix =
        cholmod_allocate_sparse(n, n, n + n_unique, 1, 1, -1, CHOLMOD_REAL, &laplacian->common);
    laplacian->right_hand_side = cholmod_allocate_dense(n, 3, n, CHOLMOD_REAL, &laplacian->common);
    if (laplacian->matrix != NULL && laplacian->right_hand_side != NULL) {
        fill_pattern(laplacian, edges);
        laplacian->factor = cholmod_analyze(laplacian->matrix, &laplacian->common);
    }
    free(edges);
    return laplacian->factor != NULL ? SHCD_OK : SHCD_ERR_MEMORY;
}

shcd_status shcdi_laplacian_create(size_t n_vertices, const uint32_t *triangles, size_t n_triangles,
                                   shcdi_laplacian **laplacian) {
    if (n_triangles > (size_t)INT_MAX / 8) {
        return SHCD_ERR_ARGUMENT;
    }
    shcdi_laplacian *created = calloc(1, sizeof *created);
    if (created == NULL) {
        return SHCD_ERR_MEMORY;
    }
    created->n_vertices = n_vertices;
    created->triangles = triangles;
    created->n_triangles = n_triangles;
    cholmod_start(&created->common);
    created->common.print = 0;
    created->common.supernodal = CHOLMOD_SIMPLICIAL;
    created->common.final_ll = 1;
    created->common.nmethods = 1;
    created->common.method[0].ordering = CHOLMOD_AMD;
    created->common.postorder = 1;
    const shcd_status status = analyse(created);
    if (status != SHCD_OK) {
        shcdi_laplacian_free(created);
        return status;
    }
    *laplacian = created;
    return SHCD_OK;
}

void shcdi_laplacian_free(shcdi_laplacian *laplacian) {
    if (laplacian == NULL) {
        return;
    }
    cholmod_common *common = &laplacian->common;
    cholmod_free_sparse(&laplacian->matrix, common);
    cholmod_free_factor(&laplacian->factor, common);
    cholmod_free_dense(&laplacian->right_hand_side, common);
    cholmod_free_dense(&laplacian->solution, common);
    cholmod_free_dense(&laplacian->work_y, common);
    cholmod_free_dense(&laplacian->work_e, common);
    cholmod_finish(common);
    free(laplacian->slot);
    free(laplacian);
}

shcd_status shcdi_laplacian_factorise(shcdi_laplacian *laplacian, const double *weights,
                                      const double *mass) {
    double *x = laplacian->matrix->x;
    const int *column = laplacian->matrix->p;
    memset(x, 0, (size_t)column[laplacian->n_vertices] * sizeof *x);
    for (size_t v = 0; v < laplacian->n_vertices; ++v) {
        x[column[v]] = mass[v];
    }
    for (size_t corner = 0; corner < 3 * laplacian->n_triangles; ++corner) {
        const uint32_t *triangle = laplacian->triangles + 3 * (corner / 3);
        const size_t k = corner % 3;
        x[laplacian->slot[corner]] -= weights[corner];
        x[column[triangle[(k + 1) % 3]]] += weights[corner];
        x[column[triangle[(k + 2) % 3]]] += weights[corner];
    }
    if (!cholmod_factorize(laplacian->matrix, laplacian->factor, &laplacian->common)) {
        return SHCD_ERR_MEMORY;
    }
    return laplacian->factor->minor == laplacian->n_vertices ? SHCD_OK : SHCD_ERR_CONVERGENCE;
}

shcd_status shcdi_laplacian_solve(shcdi_laplacian *laplacian, const shcd_vec3 *right_hand_side,
                                  shcd_vec3 *solution) {
    const size_t n = laplacian->n_vertices;
    double *b = laplacian->right_hand_side->x;
    for (size_t v = 0; v < n; ++v) {
        b[v] = right_hand_side[v].x;
        b[n + v] = right_hand_side[v].y;
        b[2 * n + v] = right_hand_side[v].z;
    }
    if (!cholmod_solve2(CHOLMOD_A, laplacian->factor, laplacian->right_hand_side, NULL,
                        &laplacian->solution, NULL, &laplacian->work_y, &laplacian->work_e,
                        &laplacian->common)) {
        return SHCD_ERR_MEMORY;
    }
    const double *x = laplacian->solution->x;
    for (size_t v = 0; v < n; ++v) {
        solution[v] = shcd_vec3_make(x[v], x[n + v], x[2 * n + v]);
    }
    return SHCD_OK;
}
