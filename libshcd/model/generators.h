/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives along great circles as spherical-harmonics series of their own. */
#ifndef SHCDI_MODEL_GENERATORS_H
#define SHCDI_MODEL_GENERATORS_H

#include "base/internal.h"

/** One coordinate's coefficients (stride 1) -> those of D_axis f, axis 0..2 = x, y, z, where
 *  (D_a f)(w) = d/dt f(R_a(t) w) at t = 0, R_a(t) the rotation by t about a.
 *  work: 4 (degree+1)^2 doubles. in and out may be the same array. */
void shcdi_generator(int degree, int axis, const double *in, double *out, double *work);

#endif
