/* SPDX-License-Identifier: BSD-3-Clause */
/* Depth of a convex core K below the surface: min over K of the body's signed distance sd.
 *
 * Upper end: any point of K. sd's gradient is the outward normal n at the foot, so from the deepest
 * point known the search goes to the point of K farthest along -n, and between the two where the
 * slope changes its sign.
 * Lower end: a covering of K by boxes in the tool's frame. Over a box with centre c and half
 * diagonal h, from one query at a point q of K with foot s,
 *     sd(x) >= sd(q) - |x - q|                 (1-Lipschitz),
 *     sd(x) >= -|x - s|                        (s is on the surface).
 * The second is split along the normal n and across it: |x - s|^2 = a^2 + b^2, a = n.(x - s)
 * bounded by the box and, from below, by all of K; b by the box. So it is exact at K's deepest
 * vertex up to second order, sqrt(a^2 + b^2). Boxes are halved, deepest bound first, until the
 * bounds meet or the budget is spent; what is not looked at keeps its bound. A box farther from K
 * than its half diagonal is empty. */
#include "query/tool_search.h"

#define BOXES_MAX 96
#define DESCENT_STEPS_MAX 6
#define LINE_STEPS_MAX 4

typedef struct open_box {
    shcd_vec3 centre, half; /* tool frame */
    double lower;
} open_box;

typedef struct depth_search {
    const shcd_shape *shape;
    const shcdi_view *view;
    const shcdi_placed_tool *placed;
    shcdi_budget *budget;
    double tolerance;
    double lower; /* of the boxes that were dropped */
    shcdi_core_depth *out;
    open_box box[BOXES_MAX];
    size_t n;
} depth_search;

/* One query may take this share of what is left: on a body's axis of symmetry the feet are a
 * circle, and the query would take all. Cut short, its interval still counts. */
static uint32_t share(uint32_t left) {
    return left / 8 > 64 ? left / 8 : left;
}

/* sd at a point of K, tool frame; 0 where the budget is spent. */
static int sample(depth_search *d, shcd_vec3 x, shcd_proximity *near) {
    shcdi_budget *b = d->budget;
    if (shcdi_is_spent(b)) {
        return 0;
    }
    /* at its own, tighter tolerance: hardly dearer, and the sign is sure nearer to the surface */
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    options.patches_max = b->patches_max - b->n_patches;
    options.evaluations_max = share(b->evaluations_max - b->n_evaluations);
    const shcd_vec3 p = shcdi_to_body(d->placed, x);
    if (shcd_shape_closest(d->view->model, d->shape, p, &options, near) != SHCD_OK) {
        return 0;
    }
    b->n_patches += near->n_patches;
    b->n_evaluations += near->n_evaluations;
    b->n_newton += near->n_newton;
    near->lower_m -= d->placed->slack_m;
    near->upper_m += d->placed->slack_m;
    if (!d->out->has_foot || near->upper_m < d->out->upper) {
        d->out->upper = near->upper_m;
        d->out->point_m = p;
        d->out->near = *near;
        d->out->has_foot = 1;
    }
    return 1;
}

/* slope of sd at a sample along a direction of the tool's frame */
static double slope(const depth_search *d, const shcd_proximity *near, shcd_vec3 along) {
    return shcd_dot(near->normal, shcdi_turn_to_body(d->placed, along));
}

/* From x, where sd falls towards v, to the lowest point between them, by halving. */
static shcd_vec3 descend_line(depth_search *d, shcd_vec3 x, shcd_vec3 v, shcd_proximity *near) {
    const shcd_vec3 along = shcd_sub(v, x);
    double from = 0.0, to = 1.0, t = 1.0;
    shcd_vec3 best = x;
    double least = near->upper_m;
    for (int i = 0; i < LINE_STEPS_MAX; i++) {
        shcd_proximity at;
        const shcd_vec3 y = shcd_mul_add(x, t, along);
        if (!sample(d, y, &at)) {
            break;
        }
        const double rise = slope(d, &at, along);
        if (at.upper_m < least) {
            least = at.upper_m;
            best = y;
            *near = at;
        }
        if (t == 1.0 && rise <= 0.0) {
            break;
        }
        from = rise <= 0.0 ? t : from;
        to = rise <= 0.0 ? to : t;
        t = 0.5 * (from + to);
    }
    return best;
}

static void descend(depth_search *d, shcd_vec3 x, shcd_proximity near) {
    for (int step = 0; step < DESCENT_STEPS_MAX; step++) {
        const shcd_vec3 down = shcd_scale(-1.0, shcdi_turn_to_tool(d->placed, near.normal));
        const shcd_vec3 v = shcdi_core_support(d->placed->tool, down);
        const double before = near.upper_m;
        /* sd falls at most at unit rate, so what the farthest point promises bounds what is left */
        if (!(shcd_dot(down, shcd_sub(v, x)) > d->tolerance)) {
            return;
        }
        x = descend_line(d, x, v, &near);
        if (!(near.upper_m < before - d->tolerance)) {
            return;
        }
    }
}

static void drop_box(depth_search *d, double lower) {
    d->lower = shcdi_min(d->lower, lower);
}

/* What one query says about all of K: tool frame. */
typedef struct witness {
    shcd_vec3 q, s, n;
    double sd;    /**< certified lower end at q */
    double along; /**< min over K of n.(x - s) */
} witness;

static witness witness_of(const depth_search *d, shcd_vec3 q, const shcd_proximity *near) {
    witness w;
    w.q = q;
    /* the query's own point may be extrapolated within its tolerance: here one of S is needed */
    w.s = shcdi_to_tool(d->placed, shcdi_view_point(d->view, near->parameter));
    d->budget->n_evaluations++;
    w.n = shcdi_turn_to_tool(d->placed, near->normal);
    w.sd = near->lower_m;
    const shcd_vec3 deepest = shcdi_core_support(d->placed->tool, shcd_scale(-1.0, w.n));
    w.along = shcd_dot(w.n, shcd_sub(deepest, w.s));
    return w;
}

/* half-width of a box along a direction */
static double width(const open_box *box, shcd_vec3 n) {
    return fabs(n.x) * box->half.x + fabs(n.y) * box->half.y + fabs(n.z) * box->half.z;
}

static double bound_from(const depth_search *d, const open_box *box, const witness *w) {
    const double size = shcd_norm(box->half);
    const double lipschitz = w->sd - shcd_norm(shcd_sub(box->centre, w->q)) - size;
    const shcd_vec3 off = shcd_sub(box->centre, w->s);
    const double middle = shcd_dot(w->n, off), reach = width(box, w->n);
    const double low = shcdi_max(middle - reach, w->along), high = middle + reach;
    const double a = shcdi_max(-low, high);
    const double b = shcd_norm(shcd_mul_add(off, -middle, w->n)) + size;
    /* corner by corner, without the split: tighter where the box is long and the split is not */
    const double c = shcd_norm(shcd_vec3_make(fabs(off.x) + box->half.x, fabs(off.y) + box->half.y,
                                              fabs(off.z) + box->half.z));
    const double far = shcdi_min(sqrt(a * a + b * b) * (1.0 + 1e-14), c);
    return shcdi_max(lipschitz, -far) - d->placed->slack_m;
}

static void push(depth_search *d, const open_box *box) {
    if (box->lower >= d->out->upper - d->tolerance || d->n == BOXES_MAX) {
        drop_box(d, box->lower);
    } else {
        d->box[d->n++] = *box;
    }
}

static void push_halves(depth_search *d, const open_box *box, const witness *w) {
    const shcd_vec3 h = box->half;
    const int axis = h.x >= h.y && h.x >= h.z ? 0 : h.y >= h.z ? 1 : 2;
    shcd_vec3 half = h, shift = {0.0, 0.0, 0.0};
    if (axis == 0) {
        half.x *= 0.5;
        shift.x = half.x;
    } else if (axis == 1) {
        half.y *= 0.5;
        shift.y = half.y;
    } else {
        half.z *= 0.5;
        shift.z = half.z;
    }
    for (int side = -1; side <= 1; side += 2) {
        open_box child = {shcd_mul_add(box->centre, side, shift), half, box->lower};
        child.lower = shcdi_max(child.lower, bound_from(d, &child, w));
        push(d, &child);
    }
}

/* A point of K in or near the box; 0 if none of K is in it. */
static int point_of_box(const depth_search *d, const open_box *box, shcd_vec3 *q) {
    *q = box->centre;
    if (d->placed->tool->kind != SHCD_TOOL_HULL) {
        return 1;
    }
    shcdi_core_foot foot;
    shcdi_core_closest(d->placed->tool, box->centre, &foot);
    if (foot.lower > shcd_norm(box->half) * (1.0 + 1e-12) + d->placed->slack_m) {
        return 0;
    }
    if (foot.distance > 0.0) {
        *q = foot.point;
    }
    return 1;
}

static void cover(depth_search *d) {
    while (d->n > 0) {
        size_t deepest = 0;
        for (size_t i = 1; i < d->n; i++) {
            deepest = d->box[i].lower < d->box[deepest].lower ? i : deepest;
        }
        open_box box = d->box[deepest];
        d->box[deepest] = d->box[--d->n];
        shcd_vec3 q;
        shcd_proximity near;
        if (box.lower >= d->out->upper - d->tolerance) {
            drop_box(d, box.lower);
        } else if (point_of_box(d, &box, &q)) {
            if (!sample(d, q, &near)) {
                drop_box(d, box.lower);
                continue;
            }
            const witness w = witness_of(d, q, &near);
            box.lower = shcdi_max(box.lower, bound_from(d, &box, &w));
            if (box.half.x == 0.0 && box.half.y == 0.0 && box.half.z == 0.0) {
                drop_box(d, box.lower);
            } else {
                push_halves(d, &box, &w);
            }
        }
    }
}

void shcdi_search_depth(const shcdi_view *view, const shcd_shape *shape,
                        const shcdi_placed_tool *placed, shcd_vec3 start, double tolerance,
                        int is_exact, shcdi_budget *budget, shcdi_core_depth *out) {
    const shcd_tool_geometry *tool = placed->tool;
    depth_search d;
    shcd_proximity near;
    const shcd_vec3 x = shcdi_to_tool(placed, start);
    d.view = view;
    d.shape = shape;
    d.placed = placed;
    d.budget = budget;
    d.tolerance = tolerance;
    d.lower = HUGE_VAL;
    d.out = out;
    d.n = 0;
    out->lower = -HUGE_VAL;
    out->upper = HUGE_VAL;
    out->has_foot = 0;
    if (!sample(&d, x, &near)) {
        return;
    }
    open_box root = {tool->middle_m, tool->half_m, -HUGE_VAL};
    const witness first = witness_of(&d, x, &near);
    root.lower = bound_from(&d, &root, &first);
    descend(&d, x, near);
    if (is_exact) {
        push(&d, &root);
        cover(&d);
    } else {
        drop_box(&d, root.lower);
    }
    out->lower = shcdi_min(d.lower, out->upper);
}
