/* SPDX-License-Identifier: BSD-3-Clause */
/* Closest points by brute force, through the public API only: every point of a dense tessellation,
 * the best few well separated ones polished. What it finds is an upper bound of the true distance.
 */
#ifndef SHCD_TESTS_BRUTE_H
#define SHCD_TESTS_BRUTE_H

#include "shcd/shcd.h"

#include <stddef.h>

typedef struct brute brute;

/** Samples the surface on a cube-sphere grid of 6 n^2 directions and triangulates it. NULL if out
 * of memory. */
brute *brute_create(const shcd_model *model, size_t n);
/** The same of the current shape of a deforming body, which is evaluated while b is in use. */
brute *brute_create_shape(const shcd_model *model, const shcd_shape *shape, size_t n);
void brute_free(brute *b);

/** Smallest distance found, and its parameter. */
double brute_distance(const brute *b, shcd_vec3 p, shcd_vec3 *parameter);

/** Winding number of the tessellation around p (solid angles by arctangent, summed). */
double brute_winding(const brute *b, shcd_vec3 p);

/** Largest distance of sampled surface points between the grid points from their flat triangles:
 * where |d| is larger, the tessellation's winding number is that of the surface. */
double brute_deviation(const brute *b);

#endif
