/* SPDX-License-Identifier: BSD-3-Clause */
/* Geometry of triangles and of patches of the parameter sphere. */
#ifndef SHCDI_QUERY_PATCH_H
#define SHCDI_QUERY_PATCH_H

#include "base/internal.h"

/** Distance from a point to a triangle, rounded down (of a sliver by up to its height); b gets the
 *  barycentric coordinates of the closest point. RT safe. */
double shcdi_triangle_distance(shcd_vec3 p, const shcd_vec3 x[3], double b[3]);

/** Corners of the four patches that midpoints cut a patch into. RT safe. */
void shcdi_split(const shcd_vec3 w[3], shcd_vec3 child[4][3]);

/** Centre direction of a patch, and an angle within which all of it lies of that. RT safe. */
shcd_vec3 shcdi_cap_of(const shcd_vec3 w[3], double *angle);

/** Whether a patch lies in the cap about a direction; chord2 is the squared chord of its angle. RT
 *  safe. */
static inline int shcdi_patch_in_cap(const shcd_vec3 w[3], shcd_vec3 centre, double chord2) {
    int inside = 1;
    for (int k = 0; k < 3 && inside; k++) {
        const shcd_vec3 d = shcd_sub(w[k], centre);
        inside = shcd_dot(d, d) <= chord2;
    }
    return inside;
}

/** Leaf of a tree of this level that holds a direction. RT safe. */
size_t shcdi_leaf_of(int level, shcd_vec3 w);

/** Upper bound of the angle of a chord between unit vectors. RT safe. */
static inline double shcdi_angle_upper(double chord) {
    /* 2 asin(c/2) <= c (1 + c^2/12) for c <= sqrt(2): asin y <= y + y^3 (pi/2 - 1) on [0, 1], and
     * (pi/2 - 1)/4 = 0.143 covers it */
    return chord * (1.0 + 0.143 * chord * chord) * (1.0 + 1e-15);
}

#endif
