/* SPDX-License-Identifier: BSD-3-Clause */
/* Query points near a body, and the body's surface as triangles. */
#ifndef SHCD_BENCH_POINTS_H
#define SHCD_BENCH_POINTS_H

#include "bench.h"
#include "shcd/query.h"

/** malloc() that stops the program instead of failing. */
void *points_memory(size_t size);

/** splitmix64: the same numbers on every platform. */
uint64_t points_bits(uint64_t *state);
double points_uniform(uint64_t *state, double low, double high);

/** n points whose distance along the normal from a random point of the surface (uniform by area) is
 *  uniform within 5 % of the diagonal. 3 n values. */
void points_random(const shcd_model *model, uint64_t seed, size_t n, double *points);

/** n points of a smooth way within about 5 % of the diagonal from the surface; each step is 0.1 %
 *  of the diagonal long. */
void points_path(const shcd_model *model, uint64_t seed, size_t n, double *points);

/** Icosphere of 20 * 4^level triangles on the surface, and the same vertices on that of `moved`,
 *  of the same degree. Freed by points_mesh_free(); stops if out of memory. */
void points_mesh(const shcd_model *model, const shcd_model *moved, int level, bench_mesh *mesh);
void points_mesh_free(bench_mesh *mesh);

/** Unsigned distance from a point to the triangles, all of them tried. `vertices_m` is one of the
 *  two sets of the mesh. */
double points_mesh_distance(const bench_mesh *mesh, const double *vertices_m,
                            const double point[3]);
/** Winding number of the triangles about a point, by solid angles. */
double points_mesh_winding(const bench_mesh *mesh, const double *vertices_m, const double point[3]);

#endif
