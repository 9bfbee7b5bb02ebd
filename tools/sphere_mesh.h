/* SPDX-License-Identifier: BSD-3-Clause */
/* Triangulation of the unit sphere: an icosahedron, each triangle split in four n times. */
#ifndef SHCD_TOOLS_SPHERE_MESH_H
#define SHCD_TOOLS_SPHERE_MESH_H

#include "shcd/base.h"

#include <stdbool.h>

#define SPHERE_MESH_LEVEL_MAX 9

typedef struct sphere_mesh {
    size_t n_vertices;
    size_t n_triangles;
    shcd_vec3 *vertices;      /**< unit vectors */
    uint32_t (*triangles)[3]; /**< counter-clockwise seen from outside */
} sphere_mesh;

/** False: no memory. */
bool sphere_mesh_create(int level, sphere_mesh *mesh);
void sphere_mesh_free(sphere_mesh *mesh);

#endif
