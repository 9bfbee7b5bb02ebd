/* SPDX-License-Identifier: BSD-3-Clause */
/* The checked mesh, and the two steps that make one: clean the arrays, then check the topology. */
#ifndef SHCD_FIT_MESH_H
#define SHCD_FIT_MESH_H

#include "shcd/fit.h"

struct shcd_mesh {
    double *vertices;    /* 3 per vertex [m] */
    uint32_t *triangles; /* 3 per triangle */
    size_t n_vertices, n_triangles;
};

/** Most triangles that a mesh may have: their corners are numbered with 32 bits. */
#define SHCDI_TRIANGLES_MAX (UINT32_MAX / 3)

/** shcd_mesh_create() with the text that starts every message (`name`: a function or a file). */
shcd_status shcdi_mesh_make(const char *name, const double *vertices_m, size_t n_vertices,
                            const uint32_t *triangles, size_t n_triangles, shcd_mesh **mesh,
                            shcd_mesh_report *report, shcd_error *error);

/** Refuses a mesh that is not one closed orientable surface of genus 0; turns triangles until all
 *  agree and their normals point outward. The vertices must be merged already.
 *  @param[in]     source  number of each triangle in the caller's list, for messages
 *  @param[in,out] report  the counts of turned and collinear triangles and the measures are set */
shcd_status shcdi_mesh_check(const char *name, shcd_mesh *mesh, const uint32_t *source,
                             shcd_mesh_report *report, shcd_error *error);

#endif
