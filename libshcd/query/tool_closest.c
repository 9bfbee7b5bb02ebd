/* SPDX-License-Identifier: BSD-3-Clause */
/* Gap between a convex tool and a body.
 *
 * With K the tool's core and r its rounding, gap = min over K of the body's signed distance, - r.
 * Where the surface keeps off K that is the distance between K and the surface (tool_search.c),
 * certified, with the sign of any point of K: the whole core is on one side. Where it is the
 * inside, or the surface enters K, the depth of K is searched for (tool_depth.c). */
#include "query/internal.h"
#include "query/tool_cull.h"
#include "query/tool_search.h"

#include <string.h>

#define TOLERANCE_DEFAULT 1e-6
#define POINT_TOLERANCE 1e-9 /* that of a point query by default */
#define SIGN_GAP 2e-9        /* of the diagonal: thinner sheets are not told apart (closest.c) */

typedef struct query {
    const shcd_model *model;
    const shcd_shape *shape;
    const shcdi_placed_tool *placed;
    const shcdi_view *view;
    shcdi_budget budget;
    double allowed, tolerance;
    int is_exact;
    shcd_tool_proximity *out;
} query;

/* The tool's point that belongs to a core point: r further along, towards the body. */
static void fill(query *q, shcd_vec3 core_point, shcd_vec3 surface_point, shcd_vec3 normal,
                 shcd_vec3 parameter) {
    shcd_tool_proximity *out = q->out;
    out->tool_point_m = shcd_mul_add(core_point, -q->placed->tool->radius_m, normal);
    out->point_m = surface_point;
    out->normal = normal;
    out->parameter = parameter;
}

static void finish(query *q, double gap, double lower, double upper) {
    shcd_tool_proximity *out = q->out;
    const double r = q->placed->tool->radius_m;
    const double rounding = 4.5e-16 * (fabs(gap) + r);
    out->lower_m = lower - r - rounding;
    out->upper_m = upper - r + rounding;
    /* a point query's distance may lie off the truth by its own interval, and so outside of this */
    out->gap_m = shcdi_min(shcdi_max(gap - r, out->lower_m), out->upper_m);
    if (!(out->upper_m - out->lower_m <= q->allowed)) {
        out->flags |= SHCD_PROXIMITY_TRUNCATED;
    }
    out->n_evaluations = q->budget.n_evaluations;
    out->n_patches = q->budget.n_patches;
    out->n_newton = q->budget.n_newton;
}

/* Point cores: the body's own query, at its own default tolerance unless a tighter one is asked
 * for: a coarse one would save next to nothing and leave the sign open near the surface. */
static void closest_to_point(query *q, const shcd_query_options *options) {
    shcd_query_options own = *options;
    shcd_proximity near;
    own.struct_size = sizeof own;
    own.tier = q->is_exact ? SHCD_TIER_EXACT : SHCD_TIER_FAST;
    own.tolerance = options->tolerance < POINT_TOLERANCE ? options->tolerance : 0.0;
    const shcd_vec3 p = q->placed->position_m;
    if (shcd_shape_closest(q->model, q->shape, p, &own, &near) != SHCD_OK) {
        return;
    }
    q->budget.n_evaluations = near.n_evaluations;
    q->budget.n_patches = near.n_patches;
    q->budget.n_newton = near.n_newton;
    q->out->flags = near.flags & ~(uint32_t)SHCD_PROXIMITY_TRUNCATED; /* finish() tells */
    fill(q, p, near.point_m, near.normal, near.parameter);
    finish(q, near.distance_m, near.lower_m, near.upper_m);
}

/* What the distance between K and the surface says, where it is the gap. */
static void separated(query *q, const shcdi_core_distance *apart, shcd_vec3 core_point) {
    const shcdi_jet *j = &apart->foot.jet;
    const shcd_vec3 normal = shcd_unit(shcd_cross(j->s1, j->s2));
    const shcd_vec3 towards = shcd_unit(shcd_sub(j->s, core_point));
    fill(q, core_point, j->s, normal, apart->foot.w);
    q->out->tool_point_m = shcd_mul_add(core_point, q->placed->tool->radius_m, towards);
    finish(q, shcdi_max(0.0, apart->foot.core.distance), apart->lower, apart->upper);
}

/* K is in the body or cuts its surface, or that is not known: min over K of the signed distance,
 * known to be at most upper. */
static void overlapping(query *q, const shcdi_core_distance *apart, shcd_vec3 core_point,
                        double upper) {
    shcdi_core_depth depth;
    shcdi_search_depth(q->view, q->shape, q->placed, core_point, q->tolerance, q->is_exact,
                       &q->budget, &depth);
    if (!depth.has_foot || !(depth.upper <= upper + q->allowed)) {
        separated(q, apart, core_point);
        finish(q, shcdi_min(shcdi_max(0.0, apart->foot.core.distance), upper), depth.lower, upper);
        return;
    }
    const shcd_proximity *near = &depth.near;
    q->out->flags |= near->flags & (SHCD_PROXIMITY_SIGN_UNSURE | SHCD_PROXIMITY_NOT_STATIONARY);
    fill(q, depth.point_m, near->point_m, near->normal, near->parameter);
    upper = shcdi_min(depth.upper, upper);
    finish(q, shcdi_min(near->distance_m, upper), shcdi_min(depth.lower, upper), upper);
}

/* Side of the body that a core clear of its surface is on: +1 outside, -1 inside, 0 unknown. The
 * core is connected, so any of its points will do. Where no other sheet can lie between the foot
 * and that point (the interval is narrow), the normal tells; else the body's own query. */
static int side_of(query *q, const shcdi_core_distance *apart, shcd_vec3 core_point) {
    const shcd_model_info *info = &q->model->info;
    const shcd_vec3 off = shcd_sub(core_point, info->centre_m);
    if (apart->is_outside || shcd_norm(off) > q->view->radius_m + q->placed->slack_m) {
        return 1;
    }
    const shcdi_jet *j = &apart->foot.jet;
    const shcd_vec3 normal = shcd_unit(shcd_cross(j->s1, j->s2));
    const double along = shcd_dot(normal, shcd_sub(core_point, j->s));
    const double narrow = shcdi_max(SIGN_GAP * info->diagonal_m, 4.0 * q->placed->slack_m);
    if (q->view->is_embedded && apart->upper - apart->lower <= narrow &&
        fabs(along) > 0.9 * apart->upper) {
        return along < 0.0 ? -1 : 1;
    }
    if (shcdi_is_spent(&q->budget)) {
        return 0;
    }
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity near;
    options.patches_max = (q->budget.patches_max - q->budget.n_patches + 1) / 2;
    options.evaluations_max = (q->budget.evaluations_max - q->budget.n_evaluations + 1) / 2;
    if (shcd_shape_closest(q->model, q->shape, core_point, &options, &near) != SHCD_OK) {
        return 0;
    }
    q->budget.n_patches += near.n_patches;
    q->budget.n_evaluations += near.n_evaluations;
    q->budget.n_newton += near.n_newton;
    return near.lower_m > 0.0 ? 1 : near.upper_m < 0.0 ? -1 : 0;
}

static void closest_to_core(query *q, const shcd_vec3 *seed) {
    shcdi_core_distance apart;
    shcdi_search_core(q->view, q->placed, q->tolerance,
                      q->is_exact ? SHCDI_EFFORT_OUTSIDE : SHCDI_EFFORT_LEAVES, seed, &q->budget,
                      &apart);
    shcd_vec3 core_point = shcdi_to_body(q->placed, apart.foot.core.point);
    int side = apart.lower > 0.0 ? side_of(q, &apart, core_point) : 0;
    if (apart.is_coarse && side >= 0) { /* it is not inside after all */
        const shcd_vec3 from = apart.foot.w;
        shcdi_search_core(q->view, q->placed, q->tolerance, SHCDI_EFFORT_EXACT, &from, &q->budget,
                          &apart);
        core_point = shcdi_to_body(q->placed, apart.foot.core.point);
    }
    if (apart.not_stationary) {
        q->out->flags |= SHCD_PROXIMITY_NOT_STATIONARY;
    }
    if (!(apart.lower > 0.0)) {
        overlapping(q, &apart, core_point, apart.upper);
        return;
    }
    if (side > 0) {
        separated(q, &apart, core_point);
    } else {
        q->out->flags |= side == 0 ? SHCD_PROXIMITY_SIGN_UNSURE : 0u;
        overlapping(q, &apart, core_point, side < 0 ? -apart.lower : apart.upper);
    }
}

/* |c - centre| - radius - size is at most the gap: a tolerance relative to it is at most the one
 * asked for. */
static void set_tolerance(query *q, const shcd_query_options *options) {
    const shcd_model_info *info = &q->model->info;
    const double relative = options->tolerance > 0.0 ? options->tolerance : TOLERANCE_DEFAULT;
    const double away = shcd_norm(shcd_sub(q->placed->position_m, info->centre_m)) -
                        q->view->radius_m - q->placed->tool->bounding_m;
    q->allowed = relative * shcdi_max(q->view->diagonal_m, away);
    q->tolerance = shcdi_max(q->allowed - 4.0 * q->placed->slack_m, 0.25 * q->allowed);
}

shcd_status shcdi_tool_closest_from(const shcd_model *model, const shcd_shape *shape,
                                    const shcd_tool_geometry *tool, shcd_pose tool_in_body,
                                    const shcd_vec3 *seed, double reach_m,
                                    const shcd_query_options *options, shcd_tool_proximity *out) {
    shcd_query_options read;
    shcdi_view view;
    shcdi_placed_tool placed;
    if (model == NULL || tool == NULL || out == NULL || !shcdi_query_options(options, &read)) {
        return SHCD_ERR_ARGUMENT;
    }
    if (!shcdi_core_exists(tool)) {
        return SHCD_ERR_UNSUPPORTED;
    }
    const shcd_quat o = tool_in_body.orientation;
    if (!shcd_vec3_is_finite(tool_in_body.position_m) ||
        !(shcd_norm(tool_in_body.position_m) < 1e150) || !shcdi_is_finite(o.w + o.x + o.y + o.z)) {
        return SHCD_ERR_NOT_FINITE;
    }
    shcdi_view_of(model, shape, &view);
    if (!shcdi_place_tool(&view, tool, tool_in_body, &placed)) {
        return SHCD_ERR_ARGUMENT;
    }
    query q;
    memset(&q, 0, sizeof q);
    memset(out, 0, sizeof *out);
    q.model = model;
    q.shape = shape;
    q.placed = &placed;
    q.view = &view;
    q.budget.patches_max = read.patches_max != 0 ? read.patches_max : SHCD_QUERY_PATCHES_DEFAULT;
    q.budget.evaluations_max =
        read.evaluations_max != 0 ? read.evaluations_max : SHCD_QUERY_EVALUATIONS_DEFAULT;
    q.is_exact = read.tier == SHCD_TIER_EXACT;
    q.out = out;
    set_tolerance(&q, &read);
    if (tool->kind == SHCD_TOOL_POINT || tool->kind == SHCD_TOOL_SPHERE) {
        closest_to_point(&q, &read);
    } else if (reach_m < HUGE_VAL && shcdi_tool_beyond(&view, &placed, reach_m, out)) {
        out->flags |= out->upper_m - out->lower_m <= q.allowed ? 0u : SHCD_PROXIMITY_TRUNCATED;
    } else {
        closest_to_core(&q, seed);
    }
    return SHCD_OK;
}

shcd_status shcd_tool_closest(const shcd_model *model, const shcd_shape *shape,
                              const shcd_tool_geometry *tool, shcd_pose tool_in_body,
                              const shcd_query_options *options, shcd_tool_proximity *out) {
    return shcdi_tool_closest_from(model, shape, tool, tool_in_body, NULL, HUGE_VAL, options, out);
}
