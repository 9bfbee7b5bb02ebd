/* SPDX-License-Identifier: BSD-3-Clause */
/* Storage of a triangle mesh, and the cleaning that comes before any question about its topology:
 * indices in range, positions finite, one vertex for each position, nothing left over.
 *
 * Vertices merge only if their coordinates are equal. A distance for merging would depend on the
 * unit of the file, and would collapse small bodies. */
#include "mesh.h"

#include "fail.h"

#include "shcd/vec.h"

#include <stdlib.h>
#include <string.h>

#define UNUSED UINT32_MAX

typedef struct placed_vertex {
    double position[3];
    uint32_t index;
} placed_vertex;

/* What cleaning works on; every array is owned and released by cleaning_free(). */
typedef struct cleaning {
    placed_vertex *placed;    /* the used vertices, sorted by position */
    uint32_t *representative; /* lowest vertex at the same position, or UNUSED */
    uint32_t *new_index;      /* of a representative in the clean mesh, or UNUSED */
    uint32_t *source;         /* number in the caller's list of each triangle that is kept */
} cleaning;

static void cleaning_free(cleaning *work) {
    free(work->placed);
    free(work->representative);
    free(work->new_index);
    free(work->source);
}

static int cleaning_allocate(cleaning *work, size_t n_vertices, size_t n_triangles) {
    work->placed = malloc(n_vertices * sizeof *work->placed);
    work->representative = malloc(n_vertices * sizeof *work->representative);
    work->new_index = malloc(n_vertices * sizeof *work->new_index);
    work->source = malloc(n_triangles * sizeof *work->source);
    return work->placed != NULL && work->representative != NULL && work->new_index != NULL &&
           work->source != NULL;
}

static shcd_status check_sizes(const char *name, size_t n_vertices, size_t n_triangles,
                               shcd_error *error) {
    if (n_vertices == 0 || n_triangles == 0) {
        return shcdi_fit_fail(error, SHCD_ERR_GEOMETRY,
                              "%s: the mesh is empty (%zu vertices, %zu triangles)", name,
                              n_vertices, n_triangles);
    }
    if (n_vertices >= UNUSED || n_triangles > SHCDI_TRIANGLES_MAX) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                              "%s: %zu vertices and %zu triangles are too many (at most %lu and "
                              "%lu)",
                              name, n_vertices, n_triangles, (unsigned long)UNUSED - 1,
                              (unsigned long)SHCDI_TRIANGLES_MAX);
    }
    return SHCD_OK;
}

/* Triangle by triangle, so that a vertex which nobody uses may hold anything. */
static shcd_status check_values(const char *name, const double *vertices, size_t n_vertices,
                                const uint32_t *triangles, size_t n_triangles, shcd_error *error) {
    for (size_t c = 0; c < 3 * n_triangles; ++c) {
        if (triangles[c] >= n_vertices) {
            return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                                  "%s: triangle %zu refers to vertex %lu, but there are only %zu",
                                  name, c / 3, (unsigned long)triangles[c], n_vertices);
        }
    }
    for (size_t c = 0; c < 3 * n_triangles; ++c) {
        const double *p = &vertices[3 * (size_t)triangles[c]];
        if (!shcd_vec3_is_finite(shcd_vec3_make(p[0], p[1], p[2]))) {
            return shcdi_fit_fail(
                error, SHCD_ERR_NOT_FINITE,
                "%s: vertex %lu (%.9g, %.9g, %.9g) is not finite; triangle %zu uses it", name,
                (unsigned long)triangles[c], p[0], p[1], p[2], c / 3);
        }
    }
    return SHCD_OK;
}

static int same_position(const placed_vertex *a, const placed_vertex *b) {
    return a->position[0] == b->position[0] && a->position[1] == b->position[1] &&
           a->position[2] == b->position[2];
}

static int compare_placed(const void *left, const void *right) {
    const placed_vertex *a = left, *b = right;
    for (int k = 0; k < 3; ++k) {
        if (a->position[k] != b->position[k]) {
            return a->position[k] < b->position[k] ? -1 : 1;
        }
    }
    return a->index < b->index ? -1 : a->index > b->index;
}

/* Sets `representative`; the sort leaves the lowest index first in each run of equal positions. */
static void merge_vertices(cleaning *work, const double *vertices, size_t n_vertices,
                           const uint32_t *triangles, size_t n_triangles,
                           shcd_mesh_report *report) {
    size_t n_used = 0;
    for (size_t v = 0; v < n_vertices; ++v) {
        work->representative[v] = UNUSED;
    }
    for (size_t c = 0; c < 3 * n_triangles; ++c) {
        const uint32_t v = triangles[c];
        if (work->representative[v] == UNUSED) {
            work->representative[v] = v;
            for (int k = 0; k < 3; ++k) {
                /* adding zero makes -0 and 0 the same bits */
                work->placed[n_used].position[k] = vertices[3 * (size_t)v + (size_t)k] + 0.0;
            }
            work->placed[n_used].index = v;
            ++n_used;
        }
    }
    qsort(work->placed, n_used, sizeof *work->placed, compare_placed);
    report->n_vertices_unused = n_vertices - n_used;
    for (size_t i = 1, first = 0; i < n_used; ++i) {
        if (same_position(&work->placed[first], &work->placed[i])) {
            work->representative[work->placed[i].index] = work->placed[first].index;
            ++report->n_vertices_merged;
        } else {
            first = i;
        }
    }
}

/* Fills the mesh, whose arrays have room for everything given. A triangle with two corners at one
 * vertex covers nothing: its two remaining sides coincide, so dropping it opens no edge. */
static void keep_what_counts(cleaning *work, const double *vertices, size_t n_vertices,
                             const uint32_t *triangles, size_t n_triangles, shcd_mesh *mesh,
                             shcd_mesh_report *report) {
    for (size_t v = 0; v < n_vertices; ++v) {
        work->new_index[v] = UNUSED;
    }
    for (size_t t = 0; t < n_triangles; ++t) {
        uint32_t *corner = &mesh->triangles[3 * mesh->n_triangles];
        for (int k = 0; k < 3; ++k) {
            corner[k] = work->representative[triangles[3 * t + (size_t)k]];
        }
        if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) {
            ++report->n_triangles_degenerate_dropped;
            continue;
        }
        for (int k = 0; k < 3; ++k) {
            work->new_index[corner[k]] = 0;
        }
        work->source[mesh->n_triangles] = (uint32_t)t;
        ++mesh->n_triangles;
    }
    for (size_t v = 0; v < n_vertices; ++v) {
        if (work->new_index[v] != UNUSED) {
            for (size_t k = 0; k < 3; ++k) {
                mesh->vertices[3 * mesh->n_vertices + k] = vertices[3 * v + k] + 0.0;
            }
            work->new_index[v] = (uint32_t)mesh->n_vertices;
            ++mesh->n_vertices;
        } else if (work->representative[v] == v) {
            ++report->n_vertices_unused; /* only dropped triangles used it */
        }
    }
    for (size_t c = 0; c < 3 * mesh->n_triangles; ++c) {
        mesh->triangles[c] = work->new_index[mesh->triangles[c]];
    }
}

static shcd_mesh *mesh_allocate(size_t n_vertices, size_t n_triangles) {
    shcd_mesh *mesh = calloc(1, sizeof *mesh);
    if (mesh == NULL) {
        return NULL;
    }
    mesh->vertices = malloc(n_vertices * 3 * sizeof *mesh->vertices);
    mesh->triangles = malloc(n_triangles * 3 * sizeof *mesh->triangles);
    if (mesh->vertices == NULL || mesh->triangles == NULL) {
        shcd_mesh_free(mesh);
        return NULL;
    }
    return mesh;
}

/* The caller may know an older, shorter report. */
static void give_report(const shcd_mesh_report *from, shcd_mesh_report *to) {
    if (to != NULL) {
        const size_t size = to->struct_size;
        memcpy(to, from, size < sizeof *from ? size : sizeof *from);
        to->struct_size = size;
    }
}

static shcd_status clean_and_check(const char *name, const double *vertices, size_t n_vertices,
                                   const uint32_t *triangles, size_t n_triangles, shcd_mesh *mesh,
                                   shcd_mesh_report *report, shcd_error *error) {
    cleaning work = {NULL, NULL, NULL, NULL};
    shcd_status status = SHCD_OK;
    if (!cleaning_allocate(&work, n_vertices, n_triangles)) {
        status = shcdi_fit_fail(error, SHCD_ERR_MEMORY, "%s: out of memory", name);
        goto cleanup;
    }
    report->n_vertices_read = n_vertices;
    report->n_triangles_read = n_triangles;
    merge_vertices(&work, vertices, n_vertices, triangles, n_triangles, report);
    keep_what_counts(&work, vertices, n_vertices, triangles, n_triangles, mesh, report);
    report->n_vertices = mesh->n_vertices;
    report->n_triangles = mesh->n_triangles;
    if (mesh->n_triangles == 0) {
        status = shcdi_fit_fail(error, SHCD_ERR_GEOMETRY,
                                "%s: the mesh is empty: all %zu triangles are degenerate (two "
                                "corners at one place)",
                                name, n_triangles);
        goto cleanup;
    }
    status = shcdi_mesh_check(name, mesh, work.source, report, error);
cleanup:
    cleaning_free(&work);
    return status;
}

shcd_status shcdi_mesh_make(const char *name, const double *vertices_m, size_t n_vertices,
                            const uint32_t *triangles, size_t n_triangles, shcd_mesh **mesh,
                            shcd_mesh_report *report, shcd_error *error) {
    shcd_mesh_report found = {0};
    shcd_mesh *made = NULL;
    shcd_status status = check_sizes(name, n_vertices, n_triangles, error);
    if (status == SHCD_OK) {
        status = check_values(name, vertices_m, n_vertices, triangles, n_triangles, error);
    }
    if (status != SHCD_OK) {
        return status;
    }
    found.struct_size = sizeof found;
    made = mesh_allocate(n_vertices, n_triangles);
    if (made == NULL) {
        return shcdi_fit_fail(error, SHCD_ERR_MEMORY, "%s: out of memory", name);
    }
    status =
        clean_and_check(name, vertices_m, n_vertices, triangles, n_triangles, made, &found, error);
    if (status != SHCD_OK) {
        shcd_mesh_free(made);
        return status;
    }
    give_report(&found, report);
    *mesh = made;
    return SHCD_OK;
}

shcd_status shcd_mesh_create(const double *vertices_m, size_t n_vertices, const uint32_t *triangles,
                             size_t n_triangles, shcd_mesh **mesh, shcd_mesh_report *report,
                             shcd_error *error) {
    if (mesh == NULL || (vertices_m == NULL && n_vertices > 0) ||
        (triangles == NULL && n_triangles > 0) ||
        (report != NULL && report->struct_size < sizeof report->struct_size)) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                              "mesh_create: a null pointer, or a report without struct_size");
    }
    return shcdi_mesh_make("mesh_create", vertices_m, n_vertices, triangles, n_triangles, mesh,
                           report, error);
}

void shcd_mesh_free(shcd_mesh *mesh) {
    if (mesh != NULL) {
        free(mesh->vertices);
        free(mesh->triangles);
        free(mesh);
    }
}

size_t shcd_mesh_vertex_count(const shcd_mesh *mesh) {
    return mesh != NULL ? mesh->n_vertices : 0;
}

size_t shcd_mesh_triangle_count(const shcd_mesh *mesh) {
    return mesh != NULL ? mesh->n_triangles : 0;
}

const double *shcd_mesh_vertices(const shcd_mesh *mesh) {
    return mesh != NULL ? mesh->vertices : NULL;
}

const uint32_t *shcd_mesh_triangles(const shcd_mesh *mesh) {
    return mesh != NULL ? mesh->triangles : NULL;
}
