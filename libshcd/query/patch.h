/* SPDX-License-Identifier: BSD-3-Clause */
/* A triangular patch of the parameter sphere, its flat image, and distances to it. */
#ifndef SHCDI_QUERY_PATCH_H
#define SHCDI_QUERY_PATCH_H

#include "model/model.h"

typedef struct shcdi_patch {
    shcd_vec3 w[3]; /**< corners on the parameter sphere */
    shcd_vec3 x[3]; /**< S there */
} shcdi_patch;

/** Distance from a point to a triangle, rounded down (of a sliver by up to its height); b gets the
 *  barycentric coordinates of the closest point. RT safe. */
double shcdi_triangle_distance(shcd_vec3 p, const shcd_vec3 x[3], double b[3]);

/** The leaf as a patch. RT safe. */
void shcdi_patch_of_leaf(const shcdi_tree *tree, size_t leaf, shcdi_patch *patch);

/** Four patches of one; three evaluations of S. RT safe. */
void shcdi_patch_split(const shcd_model *model, const shcdi_patch *patch, shcdi_patch child[4]);

/** Centre direction, and an angle within which all of the patch lies of it. RT safe. */
shcd_vec3 shcdi_patch_centre(const shcdi_patch *patch, double *angle);

/** Leaf that holds a direction. RT safe. */
size_t shcdi_leaf_of(const shcdi_tree *tree, shcd_vec3 w);

/** Upper bound of the angle of a chord between unit vectors. RT safe. */
static inline double shcdi_angle_upper(double chord) {
    /* 2 asin(c/2) <= c (1 + c^2/12) for c <= sqrt(2): asin y <= y + y^3 (pi/2 - 1) on [0, 1], and
     * (pi/2 - 1)/4 = 0.143 covers it */
    return chord * (1.0 + 0.143 * chord * chord) * (1.0 + 1e-15);
}

#endif
