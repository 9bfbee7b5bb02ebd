/* SPDX-License-Identifier: BSD-3-Clause */
/* The squared distance f(w) = |S(w) - p|^2 / 2 at one parameter, and Newton's method on it. */
#ifndef SHCDI_QUERY_FOOT_H
#define SHCDI_QUERY_FOOT_H

#include "model/model.h"

/** f and its derivatives along great circles: gradient (g1, g2), Hessian (h11, h12, h22) in the
 * jet's tangent frame, with eigenvalues low <= high. */
typedef struct shcdi_foot {
    shcd_vec3 w;
    shcdi_jet jet;
    shcd_vec3 r; /**< S - p */
    double f, distance;
    double g1, g2, h11, h12, h22;
    double low, high;
    double e1, e2; /**< unit eigenvector of `high`; (-e2, e1) is that of `low` */
} shcdi_foot;

/** Evaluates f at a unit vector. RT safe. */
void shcdi_foot_at(const shcd_model *model, shcd_vec3 p, shcd_vec3 w, shcdi_foot *foot);

/** Full Newton steps with the absolute values of the eigenvalues, and a line search that never
 *  accepts a larger f; from *foot (already evaluated) on.
 *  @param[in,out] n_steps, n_evaluations  counters
 *  @return 1 if stationary to rounding, 0 if the cap of steps was reached. RT safe. */
int shcdi_newton(const shcd_model *model, shcd_vec3 p, int steps_max, shcdi_foot *foot,
                 uint32_t *n_steps, uint32_t *n_evaluations);

/** Outward unit normal at the foot; zero where the surface is singular. RT safe. */
static inline shcd_vec3 shcdi_foot_normal(const shcdi_foot *foot) {
    return shcd_unit(shcd_cross(foot->jet.s1, foot->jet.s2));
}

/** Certified lower bound of f over the cap of angle `radius` about the foot, from the third
 *  derivative: |f'''| <= third along great circles there. */
double shcdi_foot_lower(const shcdi_foot *foot, double radius, double third);

#endif
