/* SPDX-License-Identifier: BSD-3-Clause */
/* Least squares of a series in spherical harmonics against samples, for every degree at once. */
#ifndef SHCD_FIT_COEFFICIENTS_H
#define SHCD_FIT_COEFFICIENTS_H

#include "progress.h"
#include "samples.h"

typedef struct shcdi_least_squares shcdi_least_squares;

/** Accumulates and factorises the normal equations up to a degree.
 *  @return SHCD_OK, SHCD_ERR_MEMORY, SHCD_ERR_CANCELLED, SHCD_ERR_CONVERGENCE (ill-conditioned: too
 *  few samples for the degree, or a part of the sphere is all but empty) */
shcd_status shcdi_least_squares_create(int degree, const shcdi_samples *samples,
                                       const shcdi_progress *progress,
                                       shcdi_least_squares **least_squares);
void shcdi_least_squares_free(shcdi_least_squares *least_squares);

/** The minimiser among the series of any lower or equal degree: 3 (degree+1)^2 values [m]. */
void shcdi_least_squares_solve(const shcdi_least_squares *least_squares, int degree,
                               double *coefficients_m);

/** Weighted mean square of what that minimiser leaves [m^2]; never grows with the degree. */
double shcdi_least_squares_residual(const shcdi_least_squares *least_squares, int degree);

/** Reciprocal condition number of the normal matrix (an estimate, 1-norm). */
double shcdi_least_squares_rcond(const shcdi_least_squares *least_squares);

#endif
