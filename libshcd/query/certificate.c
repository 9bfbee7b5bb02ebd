/* SPDX-License-Identifier: BSD-3-Clause */
/* Certificates that last from one query to the next.
 *
 * A search measured how far its point p0 may move, with the surface at rest, until a foot outside a
 * cap W about its own foot S0 can be nearer than S0 (margin.c), and by what it is farther until
 * then. A surface within b of the one then (b = B_0, growth.c, summed over the changes since) takes
 * b off that. Inside W a Newton step or two lead from the last foot to a foot w of S and p; W lies
 * within its radius + angle(w0, w) of it, and the way from w to any point of W stays in W, since
 * caps are convex. So if the ball about w (ball.c, with the derivatives' bounds that hold in W
 * and with f'' evaluated *here and now*) reaches that far, f is known from below in all of W, and
 * both together are a lower bound of the distance.
 *
 * A margin between the foot and other feet would not do instead: where p passes a focal point the
 * foot's own basin splits, without any other foot coming near. Here the Hessian at w tells.
 *
 * A certificate costs a wider scan. Where it is used less than USES_LEAST times before it breaks (a
 * fast point, a place near the medial axis) the next searches make none, twice as many each time
 * this happens again; where that can be foreseen, none is made at all. */
#include "query/internal.h"

#include "query/ellipsoid.h"
#include "query/margin.h"
#include "query/patch.h"
#include "query/shape.h"

#include <string.h>

/* Steps of the point that a certificate should last. */
#define STEPS_AHEAD 16.0
/* [of the diagonal] */
#define MARGIN_LEAST 5e-4
#define MARGIN_MOST 0.015
#define USES_LEAST 1
#define LEVEL_MAX 3
#define NEWTON_STEPS_MAX 8

typedef struct lasting {
    /* of the search */
    shcd_vec3 w0, p0;
    double cap;   /* radius of W [rad] */
    double rho;   /* margin [m] */
    double path0; /* the shape's B_0 summed up then */
    /* of the last query: foot, tangent frame, derivatives */
    shcd_vec3 w, p, t1, s1, s2;
    double h11, h12, h22;
    double path;
    shcd_vec3 s0;  /* of the search */
    double near;   /* no point outside W counts as nearer to s0 [m] */
    uint64_t leaf; /* + 1; 0: nothing known. Its bounds hold in W */
    int64_t sign;  /* of the last query, 0: not sure */
    uint64_t n_sets;
    uint16_t uses;  /* of this certificate */
    uint16_t level; /* of patience: how often in a row it was used too little */
    uint16_t skip;  /* so many searches make none */
    uint16_t spare_half;
} lasting;

_Static_assert(sizeof(lasting) == sizeof(shcd_certificate), "one is copied into the other");

static void remember_foot(lasting *c, const shcdi_search *s, double path) {
    const shcdi_foot *foot = &s->best;
    c->w = shcdi_flushed3(foot->w);
    c->p = s->p;
    c->t1 = shcdi_flushed3(foot->jet.t1);
    c->s1 = shcdi_flushed3(foot->jet.s1);
    c->s2 = shcdi_flushed3(foot->jet.s2);
    c->h11 = foot->h11;
    c->h12 = shcdi_flushed(foot->h12);
    c->h22 = foot->h22;
    c->path = path;
}

static void remember_sign(lasting *c, const shcd_proximity *out) {
    c->sign = (out->flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0 ? 0
              : out->lower_m >= 0.0                          ? 1
              : out->upper_m <= 0.0                          ? -1
                                                             : 0;
}

static int is_direction(shcd_vec3 w) {
    return fabs(shcd_dot(w, w) - 1.0) < 1e-6;
}

/* Bytes that nobody made may claim margins that are none, and make the answer wrong; but they must
 * not lead out of tables or numbers: the foot has to be a place on the sphere, the sign a sign, and
 * the patience a number of bits. */
static int is_plausible(const lasting *c) {
    return is_direction(c->w) && c->level <= LEVEL_MAX && c->sign >= -1 && c->sign <= 1;
}

/* The foot moves by H^-1 J^T dp while the surface stands still. */
static shcd_vec3 predict(const lasting *c, shcd_vec3 p) {
    const shcd_vec3 moved = shcd_sub(p, c->p);
    const double a = shcd_dot(c->s1, moved), b = shcd_dot(c->s2, moved);
    const double determinant = c->h11 * c->h22 - c->h12 * c->h12;
    if (!(determinant > 0.0)) {
        return c->w;
    }
    const double x = (c->h22 * a - c->h12 * b) / determinant;
    const double y = (c->h11 * b - c->h12 * a) / determinant;
    if (!(x * x + y * y < 0.01)) {
        return c->w;
    }
    const shcd_vec3 t2 = shcd_cross(c->w, c->t1);
    const shcd_vec3 w = shcd_unit(shcd_mul_add(shcd_mul_add(c->w, x, c->t1), y, t2));
    return is_direction(w) ? w : c->w;
}

/* The frame was t1, w x t1 when the foot was evaluated; after it moved a little it still is nearly
 * one, which is all that a prediction needs. */

/* What the point and the surface moved since the last query. */
static double moved_since(const lasting *c, shcd_vec3 p, double path) {
    return shcd_norm(shcd_sub(p, c->p)) * (1.0 + 1e-15) + (path - c->path) * (1.0 + 1e-15);
}

static int continue_from(lasting *c, const shcd_shape *shape, shcdi_search *s, double allowed,
                         shcd_proximity *out) {
    const double path = shape != NULL ? shape->path[0] : 0.0;
    const size_t leaf = (size_t)c->leaf - 1;
    shcdi_leaf_bounds bounds;
    shcdi_foot foot;
    shcdi_ball_bound ball;
    const double moved = shcd_norm(shcd_sub(s->p, c->p0)) * (1.0 + 1e-15);
    if (!(moved < c->rho)) {
        return 0;
    }
    const shcdi_margin margin = {c->rho, c->near};
    const double apart = shcd_norm(shcd_sub(s->p, c->s0));
    const double beyond = apart + shcdi_margin_gap(margin, apart, moved) -
                          (path - c->path0) * (1.0 + 1e-15) - s->slack;
    shcdi_view_leaf_bounds(s->view, leaf, &bounds);
    shcdi_foot_at(s->view, s->p, predict(c, s->p), &foot);
    s->n_evaluations++;
    if (!(foot.distance - s->tolerance < beyond)) {
        return 0;
    }
    if (!shcdi_newton(s->view, s->p, NEWTON_STEPS_MAX, &bounds, s->tolerance, &foot, &s->n_newton,
                      &s->n_evaluations)) {
        return 0;
    }
    const double way = shcdi_angle_upper(shcd_norm(shcd_sub(foot.w, c->w0)));
    const double reach = c->cap + way;
    if (!(way < c->cap) ||
        !(shcdi_ball_about(&foot, &bounds, reach * (1.0 + 1e-9), &ball) >= reach)) {
        return 0;
    }
    s->best = foot;
    s->best_bounds = bounds;
    s->best_leaf = leaf;
    s->best_room = reach;
    s->upper = foot.distance;
    s->lower = shcdi_min(ball.lower, beyond);
    s->leaves_lower = 0.0;
    if (!(foot.distance - s->lower <= s->tolerance)) {
        return 0;
    }
    s->last_sign = (int)c->sign;
    s->moved_m = moved_since(c, s->p, path);
    shcdi_search_result(s, allowed, out);
    remember_foot(c, s, path);
    remember_sign(c, out);
    c->uses = (uint16_t)(c->uses < UINT16_MAX ? c->uses + 1 : c->uses);
    return 1;
}

/* A certificate of the search that was just made, if it will last. */
static void certify(lasting *c, shcdi_search *s, double step, size_t n_sets, double path) {
    const shcdi_foot *foot = &s->evaluated;
    const double diagonal = s->view->diagonal_m;
    const double wanted =
        shcdi_max(MARGIN_LEAST * diagonal, shcdi_min(STEPS_AHEAD * step, MARGIN_MOST * diagonal));
    double cap;
    if (!(s->best_room > 0.0 && foot->low > 0.0)) {
        return;
    }
    const shcdi_margin margin = shcdi_margin_outside(s, foot, &s->best_bounds, s->best_room, wanted,
                                                     USES_LEAST * step, &cap);
    if (margin.rho_m > 0.0) {
        c->w0 = shcdi_flushed3(foot->w);
        c->s0 = shcdi_flushed3(foot->jet.s);
        c->p0 = s->p;
        c->cap = cap;
        c->rho = margin.rho_m;
        c->near = margin.near_m;
        c->path0 = path;
        c->leaf = s->best_leaf + 1;
        c->n_sets = n_sets;
    }
}

static void search_anew(lasting *c, const shcdi_view *view, const shcd_shape *shape, shcd_vec3 p,
                        const shcd_query_options *options, shcdi_search *s, shcd_proximity *out) {
    const uint32_t before = s->n_evaluations, newton = s->n_newton;
    const double path = shape != NULL ? shape->path[0] : 0.0;
    /* on the first call nothing is known to move */
    const double step = shcd_dot(c->w, c->w) > 0.0 ? moved_since(c, p, path) : 0.0;
    uint16_t level = c->level, skip = c->skip;
    if (c->leaf != 0) {
        level = c->uses >= USES_LEAST ? 0 : (uint16_t)(level < LEVEL_MAX ? level + 1 : level);
        skip = (uint16_t)((1u << level) - 1u);
    } else if (skip > 0) {
        skip--;
    }
    if (shcd_dot(c->w, c->w) > 0.0) {
        shcdi_query_certified_from(s, view, p, predict(c, p), options,
                                   path >= c->path ? (int)c->sign : 0, moved_since(c, p, path),
                                   out);
    } else {
        shcdi_query_certified(s, view, p, options, out);
    }
    memset(c, 0, sizeof *c);
    c->level = level;
    c->skip = skip;
    remember_foot(c, s, path);
    remember_sign(c, out);
    if (skip == 0 &&
        (out->flags & (SHCD_PROXIMITY_TRUNCATED | SHCD_PROXIMITY_NOT_STATIONARY)) == 0) {
        certify(c, s, step, shape != NULL ? shape->n_sets : 0, path);
    }
    out->n_evaluations = s->n_evaluations + before;
    out->n_patches = s->n_patches;
    out->n_newton = s->n_newton + newton;
}

shcd_status shcd_closest_next(const shcd_model *model, const shcd_shape *shape, shcd_vec3 point,
                              const shcd_query_options *options, shcd_certificate *certificate,
                              shcd_proximity *out) {
    shcd_query_options read;
    if (model == NULL || certificate == NULL || out == NULL ||
        !shcdi_query_options(options, &read) || read.tier != SHCD_TIER_EXACT) {
        return SHCD_ERR_ARGUMENT;
    }
    if (!shcdi_is_point(point)) {
        return SHCD_ERR_NOT_FINITE;
    }
    memset(out, 0, sizeof *out);
    if (shcdi_ellipsoid_closest(model, shape, point, read.tolerance, out)) {
        memset(certificate, 0, sizeof *certificate); /* nothing to be kept: no answer is cheaper */
        return SHCD_OK;
    }
    shcdi_view view;
    shcdi_search s;
    lasting c;
    memcpy(&c, certificate, sizeof c);
    if (!is_plausible(&c)) {
        memset(&c, 0, sizeof c);
    }
    shcdi_view_of(model, shape, &view);
    double allowed;
    shcdi_search_prepare(&s, &view, point, &read, &allowed);
    const uint64_t n_leaves = SHCDI_BLOCK_LEAVES * shcdi_view_block_count(&view);
    const int usable = c.leaf != 0 && c.leaf <= n_leaves &&
                       (shape == NULL || (shape->n_sets >= c.n_sets && shape->path[0] >= c.path0));
    if (!usable || !continue_from(&c, shape, &s, allowed, out)) {
        memset(out, 0, sizeof *out);
        search_anew(&c, &view, shape, point, &read, &s, out);
    }
    memcpy(certificate, &c, sizeof c);
    return SHCD_OK;
}
