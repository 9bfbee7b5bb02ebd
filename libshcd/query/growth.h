/* SPDX-License-Identifier: BSD-3-Clause */
/* How much a change of the coefficients can change the surface and its derivatives. */
#ifndef SHCDI_QUERY_GROWTH_H
#define SHCDI_QUERY_GROWTH_H

#include "base/internal.h"

/** B_0..B_3 of the difference of two sets of coefficients, 3 (degree+1)^2 values each, rounded up.
 *  RT safe: O((degree+1)^2). */
void shcdi_growth(int degree, const double *a, const double *b, double growth[4]);

#endif
