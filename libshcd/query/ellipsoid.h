/* SPDX-License-Identifier: BSD-3-Clause */
/* Distance from a point to an ellipsoid: the surface of a body of degree 1, in closed form up to
 * one root of a secular equation. */
#ifndef SHCDI_QUERY_ELLIPSOID_H
#define SHCDI_QUERY_ELLIPSOID_H

#include "query/view.h"
#include "shcd/query.h"

/** S(w) = centre + sum_i half_i (w.turn_i) axis_i. */
typedef struct shcdi_ellipsoid {
    shcd_vec3 centre_m;
    double half_m[3];  /**< half axes, longest first, all > 0 */
    shcd_vec3 axis[3]; /**< orthonormal, body frame */
    shcd_vec3 turn[3]; /**< orthonormal, parameter sphere */
    double error_m;    /**< bound of what rounding made of S by writing it so */
} shcdi_ellipsoid;

/** Point of an ellipsoid closest to a given one. */
typedef struct shcdi_ellipsoid_foot {
    double distance_m; /**< signed, negative inside */
    double lower_m;    /**< of the unsigned distance: certified for this ellipsoid */
    double upper_m;
    shcd_vec3 point_m, normal, parameter;
    int n_steps;
} shcdi_ellipsoid_foot;

/** @return 1; 0 if the view's degree is not 1, or the surface is flat or inside out. RT safe. */
int shcdi_ellipsoid_of(const shcdi_view *view, shcdi_ellipsoid *ellipsoid);

/** Closest point. |p - centre| / half_m[0] must be below 1e100. RT safe: at most 128 steps, 2 to 5
 * as a rule. Accuracy: distance_m to 1e-12 of max(diagonal, |distance_m|), for half axes up to 1e4
 *  apart. */
void shcdi_ellipsoid_foot_at(const shcdi_ellipsoid *ellipsoid, shcd_vec3 p,
                             shcdi_ellipsoid_foot *foot);

/** The exact tier of a body of degree 1; fills a zeroed result, with the certified interval, and
 *  flags what is not sure. @return 1; 0 if it is not one (shcdi_ellipsoid_of). RT safe. */
int shcdi_ellipsoid_closest(const shcdi_view *view, shcd_vec3 p, shcd_proximity *out);

#endif
