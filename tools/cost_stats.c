/* SPDX-License-Identifier: BSD-3-Clause */
/* Nearest rank, not interpolated: every quantile is a value that was really seen. */
#include "cost_stats.h"

#include <math.h>
#include <stdlib.h>

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a;
    const double y = *(const double *)b;
    return (x > y) - (x < y);
}

static double ranked(const double *sorted, size_t n, double share) {
    const double rank = ceil(share * (double)n);
    const size_t index = rank > 1.0 ? (size_t)rank - 1 : 0;
    return sorted[index < n ? index : n - 1];
}

double cost_quantile(double *values, size_t n, double share) {
    if (n == 0) {
        return 0.0;
    }
    qsort(values, n, sizeof *values, compare);
    return ranked(values, n, share);
}

cost_spread cost_spread_of(double *values, size_t n) {
    cost_spread spread = {0.0, 0.0, 0.0};
    if (n == 0) {
        return spread;
    }
    double squares = 0.0;
    qsort(values, n, sizeof *values, compare);
    for (size_t i = 0; i < n; i++) {
        squares += values[i] * values[i];
    }
    spread.max = values[n - 1];
    spread.p99 = ranked(values, n, 0.99);
    spread.rms = sqrt(squares / (double)n);
    return spread;
}
