/* SPDX-License-Identifier: BSD-3-Clause */
/* A surface of degree 1 as what it is: an ellipsoid with half axes. */
#ifndef SHCDI_MODEL_ELLIPSOID_H
#define SHCDI_MODEL_ELLIPSOID_H

#include "base/internal.h"

/** S(w) = centre + sum_i half_i (w.turn_i) axis_i, within error_m for every unit w. Doubles only,
 * so that it may lie in a shape's block. */
typedef struct shcdi_ellipsoid {
    shcd_vec3 centre_m;
    double half_m[3];  /**< half axes, longest first; 0 if this is no ellipsoid to calculate with */
    shcd_vec3 axis[3]; /**< body frame */
    shcd_vec3 turn[3]; /**< parameter sphere */
    double error_m;    /**< |S(w) - the above, axes and turns made orthonormal| <= this */
    double skew;       /**< the axes are this near to orthonormal ones, in the spectral norm */
} shcdi_ellipsoid;

/** From the coefficients of degrees 0 and 1. half_m are 0 unless the surface is the right side out
 *  and thick enough for that to be certain. RT safe: at most 16 sweeps of Jacobi's method, 3 to 5
 * as a rule. */
void shcdi_ellipsoid_make(const double coefficients[12], shcdi_ellipsoid *ellipsoid);

/** Whether it is one to calculate with. */
static inline int shcdi_is_ellipsoid(const shcdi_ellipsoid *e) {
    return e->half_m[2] > 0.0;
}

#endif
