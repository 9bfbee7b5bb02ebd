/* SPDX-License-Identifier: BSD-3-Clause */
/* Distance from a point to an ellipsoid: the surface of a body of degree 1, in closed form up to
 * one root of a secular equation. */
#ifndef SHCDI_QUERY_ELLIPSOID_H
#define SHCDI_QUERY_ELLIPSOID_H

#include "query/shape.h"
#include "shcd/query.h"

/** Point of an ellipsoid closest to a given one. */
typedef struct shcdi_ellipsoid_foot {
    double distance_m; /**< signed, negative inside */
    double lower_m;    /**< of the unsigned distance: certified for the ellipsoid whose axes are the
                            nearest orthonormal ones, and the point within skew |p - centre| */
    double upper_m;
    int sign; /**< -1 inside, +1 outside, certified where lower_m > 0; 0 not known */
    shcd_vec3 point_m, normal, parameter;
    int n_steps;
} shcdi_ellipsoid_foot;

/** The ellipsoid of a body of degree 1, as it is now; NULL if it is of another degree, or is not
 * one to calculate with (flat, or inside out). shape may be NULL. RT safe. */
const shcdi_ellipsoid *shcdi_ellipsoid_of(const shcd_model *model, const shcd_shape *shape);

/** Closest point. |p - centre| / half_m[0] must be below 1e100. RT safe: at most 128 steps, 2 to 5
 *  as a rule. Accuracy: distance_m to 1e-12 of max(diagonal, |distance_m|), for half axes up to 1e4
 *  apart. */
void shcdi_ellipsoid_foot_at(const shcdi_ellipsoid *ellipsoid, shcd_vec3 p,
                             shcdi_ellipsoid_foot *foot);

/** The exact and fast tiers of a body of degree 1; fills a zeroed result.
 *  @return 1; 0, and *out untouched, where the closed form is not certified: the search is asked
 *  then. RT safe. */
int shcdi_ellipsoid_closest(const shcd_model *model, const shcd_shape *shape, shcd_vec3 p,
                            double tolerance, shcd_proximity *out);

#endif
