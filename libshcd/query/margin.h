/* SPDX-License-Identifier: BSD-3-Clause */
/* How far a point may move before a foot elsewhere can be nearer (margin.c). */
#ifndef SHCDI_QUERY_MARGIN_H
#define SHCDI_QUERY_MARGIN_H

#include "query/search.h"

typedef struct shcdi_margin {
    double rho_m;  /**< the point may move so far; 0: nothing is known */
    double near_m; /**< no point outside the cap counts as nearer to S0 than this */
} shcdi_margin;

/** Margin of everything outside a cap about an evaluated foot.
 *  @param[in,out] s       the search that found the foot; its scan goes on
 *  @param[in]     bounds  hold within `room` of the foot
 *  @param[in]     wanted  no more than this is looked for [m]
 *  @param[in]     least   less than this is not looked for, and 0 returned [m]
 *  @param[out]    cap     the cap's angle, less than room
 *  RT safe: each block and leaf that is looked at counts as a patch, at most s->patches_max. */
shcdi_margin shcdi_margin_outside(shcdi_search *s, const shcdi_foot *foot,
                                  const shcdi_leaf_bounds *bounds, double room, double wanted,
                                  double least, double *cap);

/** What |S - p| exceeds |S0 - p| by at least outside the cap, `apart` = |S0 - p| and p within
 *  `moved` <= rho_m of where the margin was measured. */
static inline double shcdi_margin_gap(shcdi_margin margin, double apart, double moved) {
    return 2.0 * margin.near_m * (margin.rho_m - moved) / (margin.near_m + 2.0 * apart);
}

#endif
