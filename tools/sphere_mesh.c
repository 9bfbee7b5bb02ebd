/* SPDX-License-Identifier: BSD-3-Clause */
/* Splitting by an edge table, without a search for shared vertices. Edge e = (a, b) gets the
 * midpoint vertex V + e and the halves 2e = (a, mid), 2e + 1 = (mid, b); triangle t adds three
 * inner edges 2E + 3t + k. Its corner k keeps two halves, the one on edge k and the one on edge
 * k - 1, where edge k of a triangle runs between its corners k and k + 1, in either direction. */
#include "sphere_mesh.h"

#include "shcd/vec.h"

#include <stdlib.h>
#include <string.h>

typedef struct mesh_edges {
    size_t n;
    uint32_t (*ends)[2];
    uint32_t (*of_triangle)[3];
} mesh_edges;

static void release(sphere_mesh *mesh, mesh_edges *edges) {
    sphere_mesh_free(mesh);
    free(edges->ends);
    free(edges->of_triangle);
    memset(edges, 0, sizeof *edges);
}

static bool reserve(sphere_mesh *mesh, mesh_edges *edges, size_t n_vertices, size_t n_edges,
                    size_t n_triangles) {
    mesh->n_vertices = n_vertices;
    mesh->n_triangles = n_triangles;
    edges->n = n_edges;
    mesh->vertices = malloc(n_vertices * sizeof *mesh->vertices);
    mesh->triangles = malloc(n_triangles * sizeof *mesh->triangles);
    edges->ends = malloc(n_edges * sizeof *edges->ends);
    edges->of_triangle = malloc(n_triangles * sizeof *edges->of_triangle);
    return mesh->vertices != NULL && mesh->triangles != NULL && edges->ends != NULL &&
           edges->of_triangle != NULL;
}

/* Index of the edge a-b among the first n, which is made if it is not there yet. */
static uint32_t find_edge(mesh_edges *edges, size_t *n, uint32_t a, uint32_t b) {
    for (size_t e = 0; e < *n; e++) {
        if ((edges->ends[e][0] == a && edges->ends[e][1] == b) ||
            (edges->ends[e][0] == b && edges->ends[e][1] == a)) {
            return (uint32_t)e;
        }
    }
    edges->ends[*n][0] = a;
    edges->ends[*n][1] = b;
    return (uint32_t)(*n)++;
}

static bool make_icosahedron(sphere_mesh *mesh, mesh_edges *edges) {
    static const uint32_t triangles[20][3] = {
        {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
        {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
        {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    if (!reserve(mesh, edges, 12, 30, 20)) {
        return false;
    }
    /* corners of three golden rectangles */
    const double g = 0.5 * (1.0 + sqrt(5.0));
    for (int i = 0; i < 4; i++) {
        const double s = i % 2 == 0 ? -1.0 : 1.0;
        const double t = i < 2 ? g : -g;
        mesh->vertices[i] = shcd_unit(shcd_vec3_make(s, t, 0.0));
        mesh->vertices[4 + i] = shcd_unit(shcd_vec3_make(0.0, s, t));
        mesh->vertices[8 + i] = shcd_unit(shcd_vec3_make(t, 0.0, s));
    }
    memcpy(mesh->triangles, triangles, sizeof triangles);
    size_t n_edges = 0;
    for (size_t t = 0; t < 20; t++) {
        for (size_t k = 0; k < 3; k++) {
            edges->of_triangle[t][k] =
                find_edge(edges, &n_edges, triangles[t][k], triangles[t][(k + 1) % 3]);
        }
    }
    return n_edges == 30;
}

/* The half of edge e that ends at vertex a. */
static uint32_t half_at(const mesh_edges *edges, uint32_t e, uint32_t a) {
    return 2 * e + (edges->ends[e][0] == a ? 0u : 1u);
}

static void split_triangle(const sphere_mesh *old, const mesh_edges *old_edges, size_t t,
                           sphere_mesh *mesh, mesh_edges *edges) {
    const uint32_t n_old = (uint32_t)old->n_vertices;
    const uint32_t inner = (uint32_t)(2 * old_edges->n + 3 * t);
    const uint32_t *corner = old->triangles[t];
    const uint32_t *edge = old_edges->of_triangle[t];
    for (size_t k = 0; k < 3; k++) {
        const size_t before = (k + 2) % 3;
        const uint32_t middle = n_old + edge[k];
        const uint32_t middle_before = n_old + edge[before];
        uint32_t *child = mesh->triangles[4 * t + k];
        uint32_t *child_edge = edges->of_triangle[4 * t + k];
        /* the corner's own triangle, cut off by inner edge k */
        child[0] = corner[k];
        child[1] = middle;
        child[2] = middle_before;
        child_edge[0] = half_at(old_edges, edge[k], corner[k]);
        child_edge[1] = inner + (uint32_t)k;
        child_edge[2] = half_at(old_edges, edge[before], corner[k]);
        edges->ends[inner + k][0] = middle;
        edges->ends[inner + k][1] = middle_before;
        /* the triangle in the middle: from midpoint k to midpoint k + 1 along inner edge k + 1 */
        mesh->triangles[4 * t + 3][k] = middle;
        edges->of_triangle[4 * t + 3][k] = inner + (uint32_t)((k + 1) % 3);
    }
}

static bool split(sphere_mesh *mesh, mesh_edges *edges) {
    sphere_mesh old = *mesh;
    mesh_edges old_edges = *edges;
    const bool reserved = reserve(mesh, edges, old.n_vertices + old_edges.n,
                                  2 * old_edges.n + 3 * old.n_triangles, 4 * old.n_triangles);
    if (reserved) {
        memcpy(mesh->vertices, old.vertices, old.n_vertices * sizeof *old.vertices);
        for (size_t e = 0; e < old_edges.n; e++) {
            const uint32_t *ends = old_edges.ends[e];
            const uint32_t middle = (uint32_t)(old.n_vertices + e);
            mesh->vertices[middle] =
                shcd_unit(shcd_add(old.vertices[ends[0]], old.vertices[ends[1]]));
            edges->ends[2 * e][0] = ends[0];
            edges->ends[2 * e][1] = middle;
            edges->ends[2 * e + 1][0] = middle;
            edges->ends[2 * e + 1][1] = ends[1];
        }
        for (size_t t = 0; t < old.n_triangles; t++) {
            split_triangle(&old, &old_edges, t, mesh, edges);
        }
    }
    release(&old, &old_edges);
    return reserved;
}

bool sphere_mesh_create(int level, sphere_mesh *mesh) {
    mesh_edges edges = {0, NULL, NULL};
    memset(mesh, 0, sizeof *mesh);
    bool good = make_icosahedron(mesh, &edges);
    for (int i = 0; good && i < level; i++) {
        good = split(mesh, &edges);
    }
    free(edges.ends);
    free(edges.of_triangle);
    if (!good) {
        sphere_mesh_free(mesh);
    }
    return good;
}

void sphere_mesh_free(sphere_mesh *mesh) {
    free(mesh->vertices);
    free(mesh->triangles);
    memset(mesh, 0, sizeof *mesh);
}
