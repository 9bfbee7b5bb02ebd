/* SPDX-License-Identifier: BSD-3-Clause */
/* Signed distance to a closed triangle mesh: the truth that a body was fitted to. */
#ifndef SHCD_TOOLS_COST_MESH_H
#define SHCD_TOOLS_COST_MESH_H

#include "cost_points.h"

typedef struct cost_mesh cost_mesh;

/** Reads and checks a mesh file as `shcd fit` does. NULL: reported; always so in a build without
 *  libshcd-fit. */
cost_mesh *cost_mesh_read(const char *path, double unit_m);

/** NULL: no memory. The arrays are copied: 3 coordinates a vertex, 3 indices a triangle. */
cost_mesh *cost_mesh_create(const double *vertices_m, size_t n_vertices, const uint32_t *triangles,
                            size_t n_triangles);
void cost_mesh_free(cost_mesh *mesh);

double cost_mesh_diagonal(const cost_mesh *mesh);

/** Negative inside. */
double cost_mesh_distance(const cost_mesh *mesh, shcd_vec3 point);

/** A point of the mesh, by area. */
shcd_vec3 cost_mesh_draw(const cost_mesh *mesh, cost_random *random);

#endif
