/* SPDX-License-Identifier: BSD-3-Clause */
/* Meshes small enough to check by hand, given to shcd_mesh_create(). A refusal is compared as a
 * whole: the reason, the place and the numbers are what the user gets. */
#ifndef SHCD_TESTS_MESH_SUPPORT_H
#define SHCD_TESTS_MESH_SUPPORT_H

#include "support/check.h"

#include "shcd/fit.h"

#include <float.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

/* Corner at the origin, legs along the axes: volume 1/6, area 3/2 + sqrt(3)/2, diagonal sqrt(3). */
static const double tetra_vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static const uint32_t tetra_triangles[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};

/* Unit cube, vertex number = x + 2 y + 4 z. */
static const double cube_vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0,
                                       0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
static const uint32_t cube_triangles[] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                          2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};

static inline shcd_mesh *accept(const double *vertices, size_t n_vertices,
                                const uint32_t *triangles, size_t n_triangles,
                                shcd_mesh_report *report) {
    shcd_mesh *mesh = NULL;
    shcd_error error = {SHCD_OK, ""};
    memset(report, 0, sizeof *report);
    report->struct_size = sizeof *report;
    if (shcd_mesh_create(vertices, n_vertices, triangles, n_triangles, &mesh, report, &error) !=
        SHCD_OK) {
        fail_msg("refused: %s", error.message);
    }
    assert_non_null(mesh);
    assert_int_equal(report->n_vertices, shcd_mesh_vertex_count(mesh));
    assert_int_equal(report->n_triangles, shcd_mesh_triangle_count(mesh));
    assert_int_equal(report->n_vertices_read,
                     report->n_vertices + report->n_vertices_merged + report->n_vertices_unused);
    assert_int_equal(report->n_triangles_read,
                     report->n_triangles + report->n_triangles_degenerate_dropped);
    return mesh;
}

static inline void refuse(const double *vertices, size_t n_vertices, const uint32_t *triangles,
                          size_t n_triangles, shcd_status status, const char *message) {
    shcd_mesh *const untouched = (shcd_mesh *)(uintptr_t)16;
    shcd_mesh *mesh = untouched;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status got =
        shcd_mesh_create(vertices, n_vertices, triangles, n_triangles, &mesh, NULL, &error);
    assert_string_equal(error.message, message);
    assert_int_equal(got, status);
    assert_int_equal(error.status, status);
    assert_ptr_equal(mesh, untouched);
}

/* Volume from the mesh as it is now: six times it is an integer for the cube, so exact. */
static inline double volume_of(const shcd_mesh *mesh) {
    const double *v = shcd_mesh_vertices(mesh);
    const uint32_t *t = shcd_mesh_triangles(mesh);
    double six_volumes = 0.0;
    for (size_t i = 0; i < shcd_mesh_triangle_count(mesh); ++i, t += 3) {
        const double *a = v + 3 * (size_t)t[0], *b = v + 3 * (size_t)t[1],
                     *c = v + 3 * (size_t)t[2];
        six_volumes += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                       a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    return six_volumes / 6.0;
}

#endif
