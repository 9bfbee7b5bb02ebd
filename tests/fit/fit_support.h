/* SPDX-License-Identifier: BSD-3-Clause */
/* Meshes made in code, the folders of real ones, and the independent check of a map: shared by the
 * tests of the fit. */
#ifndef SHCD_TESTS_FIT_SUPPORT_H
#define SHCD_TESTS_FIT_SUPPORT_H

#include "support/check.h"

#include "shcd/fit.h"

#include <string.h>

typedef struct soup {
    double *vertices; /* 3 each */
    uint32_t *triangles;
    size_t n_vertices, n_triangles;
} soup;

static inline soup soup_allocate(size_t n_vertices, size_t n_triangles) {
    soup s = {malloc(3 * n_vertices * sizeof(double)), malloc(3 * n_triangles * sizeof(uint32_t)),
              n_vertices, n_triangles};
    assert_non_null(s.vertices);
    assert_non_null(s.triangles);
    return s;
}

static inline void soup_free(soup *s) {
    free(s->vertices);
    free(s->triangles);
}

/* Rings of points around a polyline, closed by a point at either end: a sphere if the polyline is a
 * straight diameter, a tube with round ends otherwise. ring(t, radius, centre, frame) tells the
 * caller's shape; vertices are in the order first end, rings, last end. */
static inline soup soup_of_rings(size_t n_rings, size_t n_around) {
    soup s = soup_allocate(n_rings * n_around + 2, 2 * n_rings * n_around);
    const uint32_t last = (uint32_t)(n_rings * n_around + 1);
    uint32_t *t = s.triangles;
    for (size_t i = 0; i < n_around; ++i) {
        const uint32_t a = (uint32_t)(1 + i), b = (uint32_t)(1 + (i + 1) % n_around);
        const uint32_t shift = (uint32_t)((n_rings - 1) * n_around);
        const uint32_t ends[6] = {0, b, a, last, a + shift, b + shift};
        memcpy(t, ends, sizeof ends);
        t += 6;
        for (size_t r = 0; r + 1 < n_rings; ++r) {
            const uint32_t low = (uint32_t)(r * n_around), high = (uint32_t)((r + 1) * n_around);
            const uint32_t quad[6] = {a + low, b + low, b + high, a + low, b + high, a + high};
            memcpy(t, quad, sizeof quad);
            t += 6;
        }
    }
    return s;
}

/* Ellipsoid with the given half axes, vertices on it; the poles are on the z axis. */
static inline soup soup_ellipsoid(size_t n_rings, const double *half_axes) {
    const size_t n_around = 2 * n_rings;
    const double pi = 3.14159265358979324;
    soup s = soup_of_rings(n_rings, n_around);
    for (size_t i = 0; i < s.n_vertices; ++i) {
        const size_t ring = i == 0                  ? 0
                            : i == s.n_vertices - 1 ? n_rings + 1
                                                    : 1 + (i - 1) / n_around;
        const double theta = pi * (1.0 - (double)ring / (double)(n_rings + 1));
        const double phi = 2.0 * pi * (double)((i + n_around - 1) % n_around) / (double)n_around;
        const int is_end = i == 0 || i == s.n_vertices - 1;
        s.vertices[3 * i] = is_end ? 0.0 : half_axes[0] * sin(theta) * cos(phi);
        s.vertices[3 * i + 1] = is_end ? 0.0 : half_axes[1] * sin(theta) * sin(phi);
        s.vertices[3 * i + 2] = half_axes[2] * cos(theta);
    }
    return s;
}

/* A tube of radius `thickness` bent over `turns` of a circle of radius 1 in the xy plane, climbing
 * by `rise` per turn: its area centroid lies outside of it. */
static inline soup soup_tube(size_t n_rings, size_t n_around, double turns, double rise,
                             double thickness) {
    const double pi = 3.14159265358979324;
    soup s = soup_of_rings(n_rings, n_around);
    for (size_t i = 0; i < s.n_vertices; ++i) {
        const int first = i == 0, last = i == s.n_vertices - 1;
        const size_t ring = first ? 0 : last ? n_rings - 1 : (i - 1) / n_around;
        const double along = first  ? -0.5 / (double)n_rings
                             : last ? 1.0 + 0.5 / (double)n_rings
                                    : (double)ring / (double)(n_rings - 1);
        const double angle = 2.0 * pi * turns * along;
        const double around = 2.0 * pi * (double)((i + n_around - 1) % n_around) / (double)n_around;
        const double r = first || last ? 0.0 : thickness;
        const double reach = 1.0 - r * cos(around);
        s.vertices[3 * i] = reach * cos(angle);
        s.vertices[3 * i + 1] = reach * sin(angle);
        s.vertices[3 * i + 2] = rise * turns * along + r * sin(around);
    }
    return s;
}

static inline shcd_mesh *mesh_of(const soup *s) {
    shcd_mesh *mesh = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcd_mesh_create(s->vertices, s->n_vertices, s->triangles, s->n_triangles, &mesh, NULL,
                         &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return mesh;
}

/* A mesh's arrays, copied so that they can be changed. */
static inline soup soup_of_mesh(const shcd_mesh *mesh) {
    soup s = soup_allocate(shcd_mesh_vertex_count(mesh), shcd_mesh_triangle_count(mesh));
    memcpy(s.vertices, shcd_mesh_vertices(mesh), 3 * s.n_vertices * sizeof *s.vertices);
    memcpy(s.triangles, shcd_mesh_triangles(mesh), 3 * s.n_triangles * sizeof *s.triangles);
    return s;
}

/* Gives `count` triangles an extra corner at the given place of their first edge: each becomes two,
 * and a triangle without area fills the gap to the neighbour. */
static inline soup soup_with_slivers(const soup *from, size_t count, double place) {
    soup s = soup_allocate(from->n_vertices + count, from->n_triangles + 2 * count);
    memcpy(s.vertices, from->vertices, 3 * from->n_vertices * sizeof *s.vertices);
    memcpy(s.triangles, from->triangles, 3 * from->n_triangles * sizeof *s.triangles);
    for (size_t k = 0; k < count; ++k) {
        uint32_t *t = s.triangles + 3 * (k * (from->n_triangles / count));
        const uint32_t a = t[0], b = t[1], c = t[2], m = (uint32_t)(from->n_vertices + k);
        for (int i = 0; i < 3; ++i) {
            s.vertices[3 * m + (uint32_t)i] = (1.0 - place) * s.vertices[3 * a + (uint32_t)i] +
                                              place * s.vertices[3 * b + (uint32_t)i];
        }
        const uint32_t kept[3] = {a, m, c}, added[6] = {m, b, c, a, b, m};
        memcpy(t, kept, sizeof kept);
        memcpy(s.triangles + 3 * (from->n_triangles + 2 * k), added, sizeof added);
    }
    return s;
}

static inline const char *meshes_folder(void) {
    const char *folder = getenv("SHCD_MESHES");
    if (folder != NULL && folder[0] != '\0') {
        return folder;
    }
#ifdef SHCD_MESHES_OPTIONAL
    skip();
#endif
    fail_msg("SHCD_MESHES does not name the folder of the test meshes");
    return NULL;
}

static inline shcd_mesh *mesh_named(const char *folder, const char *name, double unit_m) {
    char path[1024];
    shcd_mesh *mesh = NULL;
    shcd_error error = {SHCD_OK, ""};
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    if (shcd_mesh_import(path, unit_m, &mesh, NULL, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return mesh;
}

/* det(a, b, c) in long double, by cofactors: not the library's formula. The rounding of unit
 * vectors to double moves it by at most 4e-16. */
static inline long double independent_det(const double *a, const double *b, const double *c) {
    long double m[3][3];
    for (int k = 0; k < 3; ++k) {
        m[0][k] = (long double)a[k];
        m[1][k] = (long double)b[k];
        m[2][k] = (long double)c[k];
    }
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) +
           m[0][1] * (m[1][2] * m[2][0] - m[1][0] * m[2][2]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

static inline double inner(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Unit vectors, no folded triangle, and the solid angles sum to one sphere: then each point of the
 * sphere is met exactly once. (Unfolded alone is not enough: a map may cover the sphere twice.) */
static inline void check_one_to_one(const shcd_mesh *mesh, const double *directions,
                                    const char *name) {
    const size_t n = shcd_mesh_vertex_count(mesh), m = shcd_mesh_triangle_count(mesh);
    const uint32_t *triangles = shcd_mesh_triangles(mesh);
    size_t n_folded = 0;
    double covered = 0.0;
    for (size_t i = 0; i < n; ++i) {
        assert_near(inner(directions + 3 * i, directions + 3 * i), 1.0, 1e-15);
    }
    for (size_t t = 0; t < m; ++t) {
        const double *a = directions + 3 * (size_t)triangles[3 * t];
        const double *b = directions + 3 * (size_t)triangles[3 * t + 1];
        const double *c = directions + 3 * (size_t)triangles[3 * t + 2];
        const long double det = independent_det(a, b, c);
        n_folded += !(det > 0.0L);
        covered += 2.0 * atan2((double)det, 1.0 + inner(a, b) + inner(b, c) + inner(c, a));
    }
    if (n_folded > 0) {
        fail_msg("%s: %zu of %zu spherical triangles are folded", name, n_folded, m);
    }
    /* m angles, each off by a few ulp of the determinant over the triangle's size: far below 1e-6
     */
    assert_near(covered / 12.566370614359172954, 1.0, 1e-6);
}

#endif
