/* SPDX-License-Identifier: BSD-3-Clause */
/* Elementary functions for the tick: made of sums and products only, so that they give the same
 * bits with every compiler, C library and processor. */
#ifndef SHCDI_BASE_ELEMENTARY_H
#define SHCDI_BASE_ELEMENTARY_H

/** Sine and cosine, |x| <= 1e6 (0 and 1 beyond, or for NaN); error below 3e-16. RT safe. */
void shcdi_sincos(double x, double *sine, double *cosine);

/** sin and tan(x/2) for x within a quarter of a turn about 0, |x| <= pi/4 (1 + 1e-9); error below 2
 *  units of the last place. RT safe. */
double shcdi_sine_small(double x);
double shcdi_half_tangent(double x);

/** x = n_quarters pi/2 + rest, |rest| <= pi/4 (1 + 1e-9), |x| <= 1e6; n_quarters modulo 4. RT
 *  safe. */
double shcdi_quarters(double x, int *n_quarters);

/** e^x for x <= 1; 0 below -700 or for NaN; e above 1. Relative error below 5e-16. RT safe. */
double shcdi_exp(double x);

/** ln x for normal x > 0; error below 3e-16 of max(1, |ln x|). RT safe. */
double shcdi_log(double x);

/** (e^x - 1)/x, |x| <= 1; 1 at 0; relative error below 4e-16. RT safe. */
double shcdi_expm1_ratio(double x);

#endif
