/* SPDX-License-Identifier: BSD-3-Clause */
/* f(w) = d_K(S(w))^2/2, the half squared distance from a point of the surface to the core K of a
 * tool, at one parameter: derivatives, lower bounds around it, and Newton's method. */
#ifndef SHCDI_QUERY_TOOL_FOOT_H
#define SHCDI_QUERY_TOOL_FOOT_H

#include "query/tool_core.h"
#include "query/view.h"

/** A tool at a pose, seen from the body. */
typedef struct shcdi_placed_tool {
    const shcd_tool_geometry *tool;
    shcd_vec3 position_m; /**< of the tool's origin, body frame */
    shcd_vec3 axis[3];    /**< the tool's axes, body frame */
    double slack_m;       /**< what rounding makes of a distance between a surface point and K */
} shcdi_placed_tool;

/** @return 0 if the pose is not finite, or its quaternion not unit within 1e-6. RT safe. */
int shcdi_place_tool(const shcdi_view *view, const shcd_tool_geometry *tool, shcd_pose tool_in_body,
                     shcdi_placed_tool *placed);

static inline shcd_vec3 shcdi_turn_to_tool(const shcdi_placed_tool *t, shcd_vec3 v) {
    return shcd_vec3_make(shcd_dot(t->axis[0], v), shcd_dot(t->axis[1], v),
                          shcd_dot(t->axis[2], v));
}
static inline shcd_vec3 shcdi_turn_to_body(const shcdi_placed_tool *t, shcd_vec3 v) {
    return shcd_mul_add(shcd_mul_add(shcd_scale(v.x, t->axis[0]), v.y, t->axis[1]), v.z,
                        t->axis[2]);
}
static inline shcd_vec3 shcdi_to_tool(const shcdi_placed_tool *t, shcd_vec3 x) {
    return shcdi_turn_to_tool(t, shcd_sub(x, t->position_m));
}
static inline shcd_vec3 shcdi_to_body(const shcdi_placed_tool *t, shcd_vec3 x) {
    return shcd_add(t->position_m, shcdi_turn_to_body(t, x));
}

/** f at one parameter. */
typedef struct shcdi_tool_foot {
    shcd_vec3 w;
    shcdi_jet jet;        /**< body frame */
    shcd_vec3 x;          /**< S, tool frame */
    shcdi_core_foot core; /**< tool frame */
    shcd_vec3 u;          /**< core.u, body frame */
    double f;             /**< 0 inside of K */
} shcdi_tool_foot;

/** A quadratic model base + g.s + s.H.s/2 in the jet's tangent frame, in its eigenbasis. */
typedef struct shcdi_quadratic {
    double base;
    double g_high, g_low; /**< gradient along the eigenvectors */
    double high, low;     /**< eigenvalues */
    double e1, e2;        /**< unit eigenvector of `high`; (-e2, e1) is that of `low` */
} shcdi_quadratic;

/** Evaluates f at a unit vector. RT safe. */
void shcdi_tool_foot_at(const shcdi_view *view, const shcdi_placed_tool *placed, shcd_vec3 w,
                        shcdi_tool_foot *foot);

/** Second-order model of a lower bound of f about the foot, outside of K: f(w) >= model
 *  - third s^3/6 at an angle s <= angle, m = suprema of |S'|, |S''|, |S'''| over that cap. */
void shcdi_tool_model(const shcdi_placed_tool *placed, const shcdi_tool_foot *foot, double angle,
                      const double m[3], shcdi_quadratic *model, double *third);

/** Certified lower bound of d_K(S(w)) over the cap of that angle; outside of K. RT safe. */
double shcdi_tool_foot_lower(const shcdi_placed_tool *placed, const shcdi_tool_foot *foot,
                             double angle, const double m[3]);

/** Newton steps with a line search that never accepts a larger f; ends at once where S(w) is in K.
 *  @return 1 if stationary to rounding, 0 if the cap of steps was reached. RT safe. */
int shcdi_tool_newton(const shcdi_view *view, const shcdi_placed_tool *placed, int steps_max,
                      shcdi_tool_foot *foot, uint32_t *n_steps, uint32_t *n_evaluations);

#endif
