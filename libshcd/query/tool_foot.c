/* SPDX-License-Identifier: BSD-3-Clause */
/* The half squared distance f = d_K(S(w))^2/2 to the core of a tool, and its minimisation.
 *
 * d_K^2/2 is convex and C^1, piecewise C^2: grad = r = x - y (y the closest point of K), Hessian P
 * = the projection off the face, edge or nothing that y moves in. So along great circles f' = r.S',
 * f'' = r.S'' + |P S'|^2, and with a P that holds over a whole ball about x0 = S(c)
 * (shcdi_core_curvature) f(w) >= F(w) = |r0|^2/2 + r0.D + |P D|^2/2,   D = S(w) - x0, |F'''| = |(r0
 * + P D).S''' + 3 P S'.S''| <= (|r0| + m1 s) m3 + 3 m1 m2   at an angle <= s: a smooth minorant
 * that Taylor's theorem bounds, where f itself has kinks in its curvature. For small d_K the plane
 * u.x - h(u) <= d_K is the better minorant: its third derivative is at most m3, without the product
 * m1 m2. */
#include "query/tool_foot.h"

#define STEP_MAX 0.3
#define LINE_SEARCH_MAX 10
#define EIGENVALUE_FLOOR 1e-6
#define UNIT_TOLERANCE 1e-6
#define EPSILON 2.3e-16

int shcdi_place_tool(const shcdi_view *view, const shcd_tool_geometry *tool, shcd_pose tool_in_body,
                     shcdi_placed_tool *placed) {
    shcd_quat q = tool_in_body.orientation;
    const double n2 = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
    if (!(fabs(n2 - 1.0) <= 2.0 * UNIT_TOLERANCE) ||
        !shcd_vec3_is_finite(tool_in_body.position_m) ||
        !(shcd_norm(tool_in_body.position_m) < 1e150)) {
        return 0;
    }
    const double n = 1.0 / sqrt(n2);
    q.w *= n;
    q.x *= n;
    q.y *= n;
    q.z *= n;
    placed->tool = tool;
    placed->position_m = tool_in_body.position_m;
    placed->axis[0] = shcd_rotate(q, shcd_vec3_make(1.0, 0.0, 0.0));
    placed->axis[1] = shcd_rotate(q, shcd_vec3_make(0.0, 1.0, 0.0));
    placed->axis[2] = shcd_rotate(q, shcd_vec3_make(0.0, 0.0, 1.0));
    /* S is evaluated to its error; the axes are orthonormal to 12 roundings, which acts on vectors
     * from the tool's origin to the surface; the core's arithmetic adds 64 of the tool's size
     * (tool_core.c allows itself 1e-14 of it) */
    placed->slack_m = 2.0 * view->evaluation_error_m +
                      32.0 * EPSILON *
                          (shcd_norm(placed->position_m) + shcd_norm(view->model->info.centre_m) +
                           view->radius_m) +
                      64.0 * EPSILON * tool->bounding_m;
    return 1;
}

void shcdi_tool_foot_at(const shcdi_view *view, const shcdi_placed_tool *placed, shcd_vec3 w,
                        shcdi_tool_foot *foot) {
    foot->w = w;
    shcdi_view_jet(view, w, &foot->jet);
    foot->x = shcdi_to_tool(placed, foot->jet.s);
    shcdi_core_closest(placed->tool, foot->x, &foot->core);
    foot->u = shcdi_turn_to_body(placed, foot->core.u);
    foot->f = foot->core.distance > 0.0 ? 0.5 * foot->core.distance * foot->core.distance : 0.0;
}

/* Eigenbasis of a symmetric 2 x 2 matrix, of the two forms of the eigenvector the one without
 * cancellation. */
static void diagonalise(double g1, double g2, double h11, double h12, double h22,
                        shcdi_quadratic *q) {
    const double mean = 0.5 * (h11 + h22), half = 0.5 * (h11 - h22);
    const double root = sqrt(half * half + h12 * h12);
    const double a = half >= 0.0 ? half + root : h12;
    const double b = half >= 0.0 ? h12 : root - half;
    const double n = sqrt(a * a + b * b);
    q->high = mean + root;
    q->low = mean - root;
    q->e1 = n > 0.0 ? a / n : 1.0;
    q->e2 = n > 0.0 ? b / n : 0.0;
    q->g_high = g1 * q->e1 + g2 * q->e2;
    q->g_low = g2 * q->e1 - g1 * q->e2;
}

/* The quadratic of v.(S(w) - S(c)) + sum_k (q_k.(S(w) - S(c)))^2/2, v and q_k in the body frame. */
static void model_of(const shcdi_jet *j, shcd_vec3 v, const shcd_vec3 *q, int n,
                     shcdi_quadratic *model) {
    double h11 = shcd_dot(v, j->s11), h12 = shcd_dot(v, j->s12), h22 = shcd_dot(v, j->s22);
    for (int k = 0; k < n; k++) {
        const double a = shcd_dot(q[k], j->s1), b = shcd_dot(q[k], j->s2);
        h11 += a * a;
        h12 += a * b;
        h22 += b * b;
    }
    diagonalise(shcd_dot(v, j->s1), shcd_dot(v, j->s2), h11, h12, h22, model);
}

static void model_within(const shcdi_placed_tool *placed, const shcdi_tool_foot *foot, double rho,
                         shcdi_quadratic *model) {
    shcdi_core_curvature p;
    shcdi_core_curvature_of(placed->tool, foot->x, &foot->core, rho, &p);
    for (int k = 0; k < p.n; k++) {
        p.q[k] = shcdi_turn_to_body(placed, p.q[k]);
    }
    model_of(&foot->jet, shcdi_turn_to_body(placed, p.r), p.q, p.n, model);
    model->base = 0.5 * shcd_dot(p.r, p.r);
}

void shcdi_tool_model(const shcdi_placed_tool *placed, const shcdi_tool_foot *foot, double angle,
                      const double m[3], shcdi_quadratic *model, double *third) {
    model_within(placed, foot, m[0] * angle, model);
    *third = 3.0 * m[0] * m[1] + (foot->core.distance + m[0] * angle) * m[2];
}

/* min over |s| <= radius of g s + h s^2/2 */
static double parabola_lower(double g, double h, double radius) {
    const double a = fabs(g);
    if (h > 0.0 && a < h * radius) {
        return -a * a / (2.0 * h);
    }
    return -a * radius + 0.5 * h * radius * radius;
}

/* The disc lies in the square along the eigenvectors, where the quadratic separates. */
static double quadratic_lower(const shcdi_quadratic *q, double angle) {
    return q->base + parabola_lower(q->g_high, q->high, angle) +
           parabola_lower(q->g_low, q->low, angle);
}

double shcdi_tool_foot_lower(const shcdi_placed_tool *placed, const shcdi_tool_foot *foot,
                             double angle, const double m[3]) {
    const double cube = angle * angle * angle / 6.0;
    shcdi_quadratic model;
    double third;
    /* |D| <= m1 angle, and d_K is 1-Lipschitz */
    double lower = foot->core.lower - m[0] * angle;
    model_of(&foot->jet, foot->u, NULL, 0, &model);
    model.base = foot->core.lower;
    lower = shcdi_max(lower, quadratic_lower(&model, angle) - m[2] * cube);
    shcdi_tool_model(placed, foot, angle, m, &model, &third);
    const double f = quadratic_lower(&model, angle) - third * cube;
    return f > 0.0 ? shcdi_max(lower, sqrt(2.0 * f)) : lower;
}

/* Newton step in the tangent frame, eigenvalues by absolute value and kept off zero. */
static double newton_step(const shcdi_tool_foot *foot, const shcdi_quadratic *q, double *s1,
                          double *s2) {
    const shcdi_jet *j = &foot->jet;
    const double floor_value =
        EIGENVALUE_FLOOR * (shcd_dot(j->s1, j->s1) + shcd_dot(j->s2, j->s2)) + 1e-300;
    const double a = -q->g_high / shcdi_max(fabs(q->high), floor_value);
    const double b = -q->g_low / shcdi_max(fabs(q->low), floor_value);
    *s1 = a * q->e1 - b * q->e2;
    *s2 = a * q->e2 + b * q->e1;
    return sqrt(a * a + b * b);
}

static shcd_vec3 move(const shcdi_tool_foot *foot, double s1, double s2) {
    return shcd_unit(shcd_mul_add(shcd_mul_add(foot->w, s1, foot->jet.t1), s2, foot->jet.t2));
}

int shcdi_tool_newton(const shcdi_view *view, const shcdi_placed_tool *placed, int steps_max,
                      shcdi_tool_foot *foot, uint32_t *n_steps, uint32_t *n_evaluations) {
    for (int step = 0; step < steps_max; step++) {
        if (!(foot->core.distance > 0.0)) {
            return 1;
        }
        shcdi_quadratic q;
        double s1, s2;
        model_within(placed, foot, 0.0, &q);
        const double length = newton_step(foot, &q, &s1, &s2);
        const double g2 = q.g_high * q.g_high + q.g_low * q.g_low;
        const double noise = foot->core.distance * placed->slack_m;
        if (!(length > 1e-15)) {
            return 1;
        }
        /* the step promises less than rounding makes of f: it is taken once, if the gradient says
         * that it is good, since that fixes the foot to twice as many digits as f does */
        const int is_last = 0.5 * (fabs(q.g_high * (s1 * q.e1 + s2 * q.e2)) +
                                   fabs(q.g_low * (s2 * q.e1 - s1 * q.e2))) <=
                            noise;
        double t = length > STEP_MAX ? STEP_MAX / length : 1.0;
        int accepted = 0;
        for (int i = 0; i < LINE_SEARCH_MAX && !accepted; i++, t *= 0.35) {
            shcdi_tool_foot next;
            shcdi_tool_foot_at(view, placed, move(foot, t * s1, t * s2), &next);
            ++*n_evaluations;
            const double a = next.core.distance * shcd_dot(next.u, next.jet.s1);
            const double b = next.core.distance * shcd_dot(next.u, next.jet.s2);
            accepted = next.f < foot->f || (next.f <= foot->f + noise && a * a + b * b < 0.25 * g2);
            if (accepted) {
                *foot = next;
            } else if (is_last) {
                return 1;
            }
        }
        ++*n_steps;
        if (!accepted) {
            return 0;
        }
        if (is_last) {
            return 1;
        }
    }
    return 0;
}
