/* SPDX-License-Identifier: BSD-3-Clause */
/* The squared distance f(w) = |S(w) - p|^2 / 2 at one parameter, and Newton's method on it. */
#ifndef SHCDI_QUERY_FOOT_H
#define SHCDI_QUERY_FOOT_H

#include "query/view.h"

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
void shcdi_foot_at(const shcdi_view *view, shcd_vec3 p, shcd_vec3 w, shcdi_foot *foot);

/** Full Newton steps with the absolute values of the eigenvalues, and a line search that never
 *  accepts a larger f; from *foot (already evaluated) on.
 *  @param[in]     bounds     NULL: down to rounding; else stop where the next step would change the
 *                            distance, and what can be proven of it (refine.c), by less than a
 *                            quarter of the tolerance [m]
 *  @param[in,out] n_steps, n_evaluations  counters
 *  @return 1 if stationary, 0 if the cap of steps was reached or no step lowers f. RT safe. */
int shcdi_newton(const shcdi_view *view, shcd_vec3 p, int steps_max,
                 const shcdi_leaf_bounds *bounds, double tolerance, shcdi_foot *foot,
                 uint32_t *n_steps, uint32_t *n_evaluations);

/** Takes one more Newton step d along the Taylor expansion about the foot instead of evaluating the
 *  surface again: S there is right within m3 |d|^3/6, m3 a bound of |S'''|, which is returned [m],
 * and its first derivatives within m3 |d|^2/2. RT safe. */
double shcdi_foot_finish(shcdi_foot *foot, shcd_vec3 p, double m3);

/** Eigenvalues below this share of |S_1|^2 + |S_2|^2 count as that share in a Newton step. */
#define SHCDI_EIGENVALUE_FLOOR 1e-6

/** Share of the lowest eigenvalue that a ball's bound of f'' keeps (refine.c). */
#define SHCDI_BALL_SHARE 0.05

/** Whether the Newton step solves H s = -g: no eigenvalue was replaced. RT safe. */
static inline int shcdi_is_definite(const shcdi_foot *foot) {
    const shcdi_jet *j = &foot->jet;
    return foot->low >
           SHCDI_EIGENVALUE_FLOOR * (shcd_dot(j->s1, j->s1) + shcd_dot(j->s2, j->s2)) + 1e-300;
}

/** Length of the Newton step from a foot, and its components in the tangent frame. RT safe. */
double shcdi_newton_step(const shcdi_foot *foot, double *s1, double *s2);

/** Outward unit normal at the foot; zero where the surface is singular. RT safe. */
static inline shcd_vec3 shcdi_foot_normal(const shcdi_foot *foot) {
    return shcdi_flushed3(shcd_unit(shcd_cross(foot->jet.s1, foot->jet.s2)));
}

/** Certified lower bound of f over the cap of angle `radius` about the foot, from the third
 *  derivative: |f'''| <= third along great circles there. */
double shcdi_foot_lower(const shcdi_foot *foot, double radius, double third);

#endif
