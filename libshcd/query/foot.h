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
    double e1, e2;             /**< unit eigenvector of `high`; (-e2, e1) is that of `low` */
    double step1, step2, step; /**< Newton step in the tangent frame, and its length */
    int is_definite;           /**< 1: it solves H s = -g, no eigenvalue was replaced */
} shcdi_foot;

/** Evaluates f at a unit vector. RT safe. */
void shcdi_foot_at(const shcdi_view *view, shcd_vec3 p, shcd_vec3 w, shcdi_foot *foot);

/** Full Newton steps with the absolute values of the eigenvalues, and a line search that never
 *  accepts a larger f; from *foot (already evaluated) on.
 *  @param[in]     bounds     NULL: down to rounding; else stop where the next step would change the
 *                            distance, and what can be proven of it (ball.c), by less than a
 *                            quarter of the tolerance [m]
 *  @param[in,out] n_steps, n_evaluations  counters
 *  @return 1 if stationary, 0 if the cap of steps was reached or no step lowers f. RT safe. */
int shcdi_newton(const shcdi_view *view, shcd_vec3 p, int steps_max,
                 const shcdi_leaf_bounds *bounds, double tolerance, shcdi_foot *foot,
                 uint32_t *n_steps, uint32_t *n_evaluations);

/** Takes one more Newton step d along the Taylor expansion about the foot instead of evaluating the
 *  surface again: S there is right within m3 |d|^3/6, m3 a bound of |S'''|, which is returned [m],
 *  and its first derivatives within m3 |d|^2/2. Eigenvalues and step stay those of before. RT safe.
 */
double shcdi_foot_finish(shcdi_foot *foot, shcd_vec3 p, double m3);

/** Eigenvalues below this share of |S_1|^2 + |S_2|^2 count as that share in a Newton step. */
#define SHCDI_EIGENVALUE_FLOOR 1e-6

/** Share of the lowest eigenvalue that a ball's bound of f'' keeps (ball.c). */
#define SHCDI_BALL_SHARE 0.05

/** Outward unit normal at the foot; zero where the surface is singular. RT safe. */
static inline shcd_vec3 shcdi_foot_normal(const shcdi_foot *foot) {
    return shcdi_flushed3(shcd_unit(shcd_cross(foot->jet.s1, foot->jet.s2)));
}

/** Certified lower bound of f over the cap of angle `radius` about the foot, where it is below its
 *  expansion to second order by `loss` at most. */
double shcdi_foot_lower(const shcdi_foot *foot, double radius, double loss);

#endif
