/* SPDX-License-Identifier: BSD-3-Clause */
/* Distance to the core of a tool. For a box (segment, point) everything separates by coordinate:
 * d_K^2/2 = sum_i phi_i, phi_i = max(0, |x_i - m_i| - h_i)^2/2, convex, with second derivative 1 or
 * 0. For a hull the iteration of tool_gap.c proposes and the support function certifies. */
#include "query/tool_core.h"

#define ROUNDING                                                                                   \
    1e-14 /* of the tool's size: what rounding makes of a test whether planes touch                \
           */

static double excess(double x, double half) {
    return x > half ? x - half : x < -half ? x + half : 0.0;
}

static shcd_vec3 box_excess(const shcd_tool_geometry *tool, shcd_vec3 x) {
    const shcd_vec3 p = shcd_sub(x, tool->middle_m);
    return shcd_vec3_make(excess(p.x, tool->half_m.x), excess(p.y, tool->half_m.y),
                          excess(p.z, tool->half_m.z));
}

double shcdi_core_box_distance(const shcd_tool_geometry *tool, shcd_vec3 x) {
    return shcd_norm(box_excess(tool, x));
}

/* Inside a box the nearest side decides. */
static void box_inside(const shcd_tool_geometry *tool, shcd_vec3 x, shcdi_core_foot *foot) {
    const double p[3] = {x.x - tool->middle_m.x, x.y - tool->middle_m.y, x.z - tool->middle_m.z};
    const double h[3] = {tool->half_m.x, tool->half_m.y, tool->half_m.z};
    int axis = 0;
    double least = HUGE_VAL;
    for (int i = 0; i < 3; i++) {
        if (h[i] - fabs(p[i]) < least) {
            least = h[i] - fabs(p[i]);
            axis = i;
        }
    }
    const double sign = p[axis] < 0.0 ? -1.0 : 1.0;
    foot->u =
        shcd_vec3_make(axis == 0 ? sign : 0.0, axis == 1 ? sign : 0.0, axis == 2 ? sign : 0.0);
    foot->distance = foot->lower = -least;
    foot->point = shcd_mul_add(x, least, foot->u);
}

static void box_closest(const shcd_tool_geometry *tool, shcd_vec3 x, shcdi_core_foot *foot) {
    const shcd_vec3 r = box_excess(tool, x);
    foot->n_active = 0;
    foot->distance = foot->lower = shcd_norm(r);
    if (foot->distance > 0.0) {
        foot->point = shcd_sub(x, r);
        foot->u = shcd_scale(1.0 / foot->distance, r);
    } else {
        box_inside(tool, x, foot);
    }
}

static void hull_closest(const shcd_tool_geometry *tool, shcd_vec3 x, shcdi_core_foot *foot) {
    shcdi_core_gap gap;
    shcdi_core_gap_to(tool, &x, 1, 0.0, HUGE_VAL, &gap);
    foot->n_active = gap.n_active;
    for (int i = 0; i < gap.n_active; i++) {
        foot->active[i] = gap.active[i];
    }
    foot->distance = gap.upper;
    foot->lower = gap.lower;
    foot->point = gap.point;
    foot->u = gap.u;
    if (gap.lower > 0.0 && gap.upper - gap.lower <= ROUNDING * tool->bounding_m) {
        return;
    }
    /* inside, or so near that rounding of u = v/|v| spoils u.x - h(u): the largest facet excess is
     * a lower bound too, and inside the distance itself */
    foot->lower = gap.lower > 0.0 ? gap.lower : -HUGE_VAL;
    for (size_t i = 0; i < tool->n_faces; i++) {
        const double d = shcd_dot(tool->face[i].normal, x) - tool->face[i].offset_m;
        if (d > foot->lower) {
            foot->lower = d;
            foot->u = tool->face[i].normal;
        }
    }
    if (foot->lower > 0.0) {
        foot->distance = shcdi_max(foot->lower, shcd_norm(shcd_sub(x, foot->point)));
    } else { /* no plane has x outside */
        foot->distance = foot->lower;
        foot->point = shcd_mul_add(x, -foot->lower, foot->u);
    }
}

void shcdi_core_closest(const shcd_tool_geometry *tool, shcd_vec3 x, shcdi_core_foot *foot) {
    if (tool->kind == SHCD_TOOL_HULL) {
        hull_closest(tool, x, foot);
    } else {
        box_closest(tool, x, foot);
    }
}

/* The half-space u.y <= h(u) holds K: d_K >= max(0, u.x - h(u)), whose square half is its own
 * quadratic while x stays outside of the half-space, and lies above its tangent everywhere. */
static void flat_curvature(const shcdi_core_foot *foot, double rho, shcdi_core_curvature *out) {
    out->n = foot->lower >= rho;
    out->q[0] = foot->u;
    out->r = shcd_scale(shcdi_max(0.0, foot->lower), foot->u);
}

/* phi_i keeps its second derivative 1 over the ball if x_i - m_i keeps its side of the box; always,
 * if the box has no width there. By convexity alone phi_i lies above its tangent: 0. Coordinates
 * that lose it matter little while r has little of them; else the half-space is better. */
static void box_curvature(const shcd_tool_geometry *tool, shcd_vec3 x0, const shcdi_core_foot *foot,
                          double rho, shcdi_core_curvature *out) {
    const shcd_vec3 p = shcd_sub(x0, tool->middle_m);
    const double a[3] = {fabs(p.x), fabs(p.y), fabs(p.z)};
    const double h[3] = {tool->half_m.x, tool->half_m.y, tool->half_m.z};
    const double u[3] = {foot->u.x, foot->u.y, foot->u.z};
    double lost = 0.0;
    out->n = 0;
    out->r = shcd_sub(x0, foot->point);
    for (int i = 0; i < 3; i++) {
        if (h[i] == 0.0 || a[i] - rho >= h[i]) {
            out->q[out->n++] = shcd_vec3_make(i == 0, i == 1, i == 2);
        } else {
            lost += u[i] * u[i];
        }
    }
    if (lost > 0.5) {
        flat_curvature(foot, rho, out);
    }
}

/* Let a be the vertex (P = I) or a point of the edge along t (P = I - t t^T) that is closest. With
 * projected points x' = P x, d_K(x) >= d_{PK}(x'); and x' has a' as its closest point of PK if
 * (x' - a').(p' - a') <= 0 for all vertices p. It holds over the ball if it does at x0 with the
 * margin rho |p' - a'|. Then d_K(x) >= |P(x - a)|, whose square half is the model with that P. A
 * vertex that violates this by v |p' - a'| takes at most v from the distance: v is kept below
 * ROUNDING of the tool's size, so that vertices in one plane with the edge do not spoil it. */
static int is_in_cone(const shcd_tool_geometry *tool, shcd_vec3 x0, const shcdi_core_foot *foot,
                      double rho, shcdi_core_curvature *p) {
    const shcd_vec3 a = tool->point_m[foot->active[0]], r = shcd_sub(x0, a);
    const double margin = rho - ROUNDING * tool->bounding_m;
    double rp[3];
    p->r = shcd_vec3_make(0.0, 0.0, 0.0);
    for (int k = 0; k < p->n; k++) {
        rp[k] = shcd_dot(p->q[k], r);
        p->r = shcd_mul_add(p->r, rp[k], p->q[k]);
    }
    for (int i = 0; i < (int)tool->n_points; i++) {
        const shcd_vec3 e = shcd_sub(tool->point_m[i], a);
        double along = 0.0, length = 0.0;
        for (int k = 0; k < p->n; k++) {
            const double d = shcd_dot(p->q[k], e);
            along += rp[k] * d;
            length += d * d;
        }
        const int is_own = i == foot->active[0] || (foot->n_active > 1 && i == foot->active[1]);
        if (!is_own && along + margin * sqrt(length) > 0.0) {
            return 0;
        }
    }
    return 1;
}

static void hull_curvature(const shcd_tool_geometry *tool, shcd_vec3 x0,
                           const shcdi_core_foot *foot, double rho, shcdi_core_curvature *out) {
    if (foot->n_active == 1) {
        out->n = 3;
        for (int i = 0; i < 3; i++) {
            out->q[i] = shcd_vec3_make(i == 0, i == 1, i == 2);
        }
    } else if (foot->n_active == 2) {
        const shcd_vec3 t =
            shcd_unit(shcd_sub(tool->point_m[foot->active[1]], tool->point_m[foot->active[0]]));
        out->n = 2;
        shcdi_tangent_frame(t, &out->q[0], &out->q[1]);
    } else {
        flat_curvature(foot, rho, out);
        return;
    }
    if (!is_in_cone(tool, x0, foot, rho, out)) {
        flat_curvature(foot, rho, out);
    }
}

void shcdi_core_curvature_of(const shcd_tool_geometry *tool, shcd_vec3 x0,
                             const shcdi_core_foot *foot, double rho, shcdi_core_curvature *out) {
    if (tool->kind == SHCD_TOOL_HULL) {
        hull_curvature(tool, x0, foot, rho, out);
    } else {
        box_curvature(tool, x0, foot, rho, out);
    }
}
