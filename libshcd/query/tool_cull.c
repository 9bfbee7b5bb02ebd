/* SPDX-License-Identifier: BSD-3-Clause */
/* Proof that a convex tool does not touch a body, or stays beyond a reach of it.
 *
 * The body lies in two convex sets: its enclosing ball, and the ellipsoid of the current series'
 * degree-1 part S_1 inflated by e + B: |S_rest - S_1,rest| <= e (the certified enclosure offset),
 * and with D = S - S_rest, |D - D_1| <= B_0(D) = B (its bound is a sum over degrees of which D -
 * D_1 has all but two). A convex set that holds the surface holds the inside too.
 *
 * libccd's GJK proposes: it only says that it found no intersection, which it also does at its cap
 * or where its simplex degenerates. So the last direction u it asked for is kept, and the gap
 *     min over the tool of u.x - max over the set of u.x
 * along it is computed here: positive means apart, whatever led to u. Input is finite by then (NaN
 * would send libccd astray). */
#include "query/tool_cull.h"

#include <ccd/ccd.h>

#define STEPS_MAX 32

/* One side of the pair; both note the last direction. */
typedef struct side {
    const shcdi_cull_body *body;
    const shcdi_placed_tool *placed;
    shcd_vec3 *last;
} side;

void shcdi_cull_body_of(const shcdi_view *view, shcdi_cull_body *body) {
    shcd_vec3 s[3];
    double enclosure = 0.0;
    for (int i = 0; i < 3; i++) {
        s[i] = shcdi_surface_point(&view->series, 1, shcd_vec3_make(i == 0, i == 1, i == 2));
    }
    const shcd_vec3 far = shcdi_surface_point(&view->series, 1, shcd_vec3_make(-1.0, 0.0, 0.0));
    body->middle_m = shcd_scale(0.5, shcd_add(s[0], far));
    for (int i = 0; i < 3; i++) {
        body->column[i] = shcd_sub(s[i], body->middle_m);
    }
    if (shcd_model_enclosure_offset(view->model, 1, &enclosure) != SHCD_OK) {
        enclosure = HUGE_VAL;
    }
    /* each column may be off by two evaluations' rounding, the middle by one */
    body->offset_m = enclosure + view->growth[0] + 8.0 * view->evaluation_error_m;
    body->centre_m = view->model->info.centre_m;
    body->radius_m = view->radius_m;
}

/* A^T u of the ellipsoid */
static shcd_vec3 pull_back(const shcdi_cull_body *b, shcd_vec3 u) {
    return shcd_vec3_make(shcd_dot(b->column[0], u), shcd_dot(b->column[1], u),
                          shcd_dot(b->column[2], u));
}

static shcd_vec3 body_support(const shcdi_cull_body *b, shcd_vec3 u) {
    const shcd_vec3 w = shcd_unit(pull_back(b, u));
    shcd_vec3 x = shcd_mul_add(b->middle_m, b->offset_m, u);
    x = shcd_mul_add(x, w.x, b->column[0]);
    x = shcd_mul_add(x, w.y, b->column[1]);
    return shcd_mul_add(x, w.z, b->column[2]);
}

static shcd_vec3 tool_support(const shcdi_placed_tool *t, shcd_vec3 u) {
    const shcd_vec3 x = shcdi_core_support(t->tool, shcdi_turn_to_tool(t, u));
    return shcd_mul_add(shcdi_to_body(t, x), t->tool->radius_m, u);
}

static shcd_vec3 read_direction(const ccd_vec3_t *d) {
    return shcd_unit(shcd_vec3_make(d->v[0], d->v[1], d->v[2]));
}

static void support_body(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *out) {
    const side *s = object;
    const shcd_vec3 u = read_direction(direction);
    const shcd_vec3 x = body_support(s->body, u);
    *s->last = u;
    ccdVec3Set(out, x.x, x.y, x.z);
}

static void support_tool(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *out) {
    const side *s = object;
    const shcd_vec3 x = tool_support(s->placed, read_direction(direction));
    ccdVec3Set(out, x.x, x.y, x.z);
}

static void first_direction(const void *object1, const void *object2, ccd_vec3_t *out) {
    const side *s = object1;
    const shcd_vec3 towards = shcd_sub(s->placed->position_m, s->body->middle_m);
    (void)object2;
    if (shcd_dot(towards, towards) > 0.0) {
        ccdVec3Set(out, towards.x, towards.y, towards.z);
    } else {
        ccdVec3Set(out, 1.0, 0.0, 0.0);
    }
}

/* u points from the body to the tool. */
static double gap_along(const shcdi_cull_body *body, const shcdi_placed_tool *placed, shcd_vec3 u) {
    const shcd_vec3 x = tool_support(placed, shcd_scale(-1.0, u));
    const shcd_vec3 y = body_support(body, u);
    return shcd_dot(u, shcd_sub(x, y)) - placed->slack_m;
}

/* Also the direction from the body to the tool that says most of what is known. */
static int cull(const shcdi_cull_body *body, const shcdi_placed_tool *placed, double margin_m,
                double *lower_m, shcd_vec3 *direction) {
    *lower_m = -HUGE_VAL;
    if (!shcdi_core_exists(placed->tool)) {
        return 0;
    }
    const double to_centre =
        shcdi_core_box_distance(placed->tool, shcdi_to_tool(placed, body->centre_m));
    *lower_m = to_centre - placed->tool->radius_m - body->radius_m - placed->slack_m;
    *direction = shcd_unit(shcd_sub(placed->position_m, body->middle_m));
    if (*lower_m > margin_m) {
        return 1;
    }
    if (!shcdi_is_finite(body->offset_m)) {
        return 0;
    }
    shcdi_cull_body grown = *body; /* so that GJK does not end before there is that much between */
    grown.offset_m += shcdi_max(0.0, margin_m);
    shcd_vec3 last = {0.0, 0.0, 0.0};
    const side pair = {&grown, placed, &last};
    ccd_t ccd;
    CCD_INIT(&ccd);
    ccd.first_dir = first_direction;
    ccd.support1 = support_body;
    ccd.support2 = support_tool;
    ccd.max_iterations = STEPS_MAX;
    if (!ccdGJKIntersect(&pair, &pair, &ccd)) {
        const double gap = gap_along(body, placed, last);
        *direction = last;
        *lower_m = shcdi_max(*lower_m, gap);
    }
    return *lower_m > margin_m;
}

int shcdi_tool_cull(const shcdi_cull_body *body, const shcdi_placed_tool *placed, double margin_m,
                    double *lower_m) {
    shcd_vec3 unused;
    return cull(body, placed, margin_m, lower_m, &unused);
}

/* The pair: the point of the surface with the parameter of the ellipsoid's farthest point along
 * that direction, and the tool's closest to it. */
int shcdi_tool_beyond(const shcdi_view *view, const shcdi_placed_tool *placed, double reach_m,
                      shcd_tool_proximity *out) {
    shcdi_cull_body body;
    shcd_vec3 u;
    double lower;
    shcdi_cull_body_of(view, &body);
    if (!cull(&body, placed, reach_m, &lower, &u)) {
        return 0;
    }
    shcdi_tool_foot foot;
    const shcd_vec3 w = shcd_unit(pull_back(&body, u));
    shcdi_tool_foot_at(view, placed, shcd_dot(w, w) > 0.0 ? w : shcd_vec3_make(0.0, 0.0, 1.0),
                       &foot);
    const double r = placed->tool->radius_m;
    const shcd_vec3 core_point = shcdi_to_body(placed, foot.core.point);
    out->lower_m = lower;
    out->gap_m = shcdi_max(lower, foot.core.distance - r);
    out->upper_m = out->gap_m + placed->slack_m;
    out->tool_point_m = shcd_mul_add(core_point, r, shcd_unit(shcd_sub(foot.jet.s, core_point)));
    out->point_m = foot.jet.s;
    out->normal = shcd_unit(shcd_cross(foot.jet.s1, foot.jet.s2));
    out->parameter = foot.w;
    out->n_evaluations = 1;
    return 1;
}
