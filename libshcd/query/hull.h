/* SPDX-License-Identifier: BSD-3-Clause */
/* Convex hull of a few hundred points. Not RT safe. */
#ifndef SHCDI_QUERY_HULL_H
#define SHCDI_QUERY_HULL_H

#include "query/tool_geometry.h"

/** A hull of n points has at most 2 n - 4 triangles; while one is changed, the old and the new. */
#define SHCDI_HULL_TRIANGLES_MAX (4 * SHCD_HULL_POINTS_MAX)

typedef struct shcdi_hull_triangle {
    int v[3]; /**< counter-clockwise seen from outside */
    shcd_vec3 normal;
    double offset;
} shcdi_hull_triangle;

typedef struct shcdi_hull {
    size_t n;
    shcdi_hull_triangle triangle[SHCDI_HULL_TRIANGLES_MAX];
    double tolerance; /**< points are left out if they are not farther outside than this */
} shcdi_hull;

/** @return 1; 0 if the points have no volume: they lie within 1e-6 of their extent of a plane. */
int shcdi_hull_of(const shcd_vec3 *point, size_t n, shcdi_hull *hull);

#endif
