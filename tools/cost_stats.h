/* SPDX-License-Identifier: BSD-3-Clause */
/* How a set of values is spread. */
#ifndef SHCD_TOOLS_COST_STATS_H
#define SHCD_TOOLS_COST_STATS_H

#include <stddef.h>

/** Of absolute values; all zero of none. */
typedef struct cost_spread {
    double max;
    double p99; /**< 99 % of the values are not larger */
    double rms;
} cost_spread;

/** The value that a share of the others does not exceed (nearest rank); sorts the values. 0 of
 *  none. */
double cost_quantile(double *values, size_t n, double share);

/** Sorts the values, which are not negative. */
cost_spread cost_spread_of(double *values, size_t n);

#endif
