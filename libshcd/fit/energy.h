/* SPDX-License-Identifier: BSD-3-Clause */
/* The energy that a fold-free and area-balanced map of a mesh onto the unit sphere minimises. */
#ifndef SHCD_FIT_ENERGY_H
#define SHCD_FIT_ENERGY_H

#include "shcd/vec.h"

/** A spherical triangle counts as unfolded if det(u1,u2,u3) exceeds this. The triple product of
 * unit vectors has a rounding error below 16 ulp of 1 in any order of evaluation, so that whoever
 *  recomputes the determinant sees the same sign. */
#define SHCDI_DET_MIN 1e-14

typedef struct shcdi_energy {
    size_t n_vertices, n_triangles;
    const uint32_t *triangles; /**< borrowed */
    double *area;              /**< floored mesh areas, scaled to the sum 4 pi */
    double *cotangent;         /**< 3 per triangle, at the corner opposite edge k */
    double *vertex_area;       /**< a third of the areas around each vertex, over 4 pi */
    uint64_t n_floored;        /**< triangles whose area or shape was replaced */
    double area_weight;        /**< lambda; may be changed between descents */
} shcdi_energy;

/** Allocates and fills the energy of a mesh; positions are already centred and of size ~1. */
shcd_status shcdi_energy_init(shcdi_energy *energy, const shcd_vec3 *positions, size_t n_vertices,
                              const uint32_t *triangles, size_t n_triangles);
void shcdi_energy_release(shcdi_energy *energy);

/** The energy of the map u, and its gradient in R^3 per vertex if that is not NULL. With eps = 0 a
 *  folded triangle makes it infinite. */
double shcdi_energy_value(const shcdi_energy *energy, const shcd_vec3 *u, double eps,
                          shcd_vec3 *gradient);

/** Stiffness of each triangle edge (3 per triangle, edge k opposite corner k) under the energy at a
 *  feasible map: the weights of a Laplacian that approximates its Hessian. */
void shcdi_energy_stiffness(const shcdi_energy *energy, const shcd_vec3 *u, double *weights);

/** Weights of the mesh's own cotangent Laplacian, clamped to stay positive and bounded. */
void shcdi_energy_cotangent_weights(const shcdi_energy *energy, double *weights);

/** Folded triangles of the map, and the smallest det/(2 A). */
uint64_t shcdi_energy_count_folds(const shcdi_energy *energy, const shcd_vec3 *u,
                                  double *min_ratio);

/** How many times the map covers the sphere, counted with sign: the sum of the solid angles over
 *  4 pi. An unfolded map that covers it once is one to one. */
double shcdi_energy_coverage(const shcdi_energy *energy, const shcd_vec3 *u);

#endif
