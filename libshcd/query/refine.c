/* SPDX-License-Identifier: BSD-3-Clause */
/* Feet, and bounds below the leaves. f(w) = |S(w) - p|^2/2; s is the angle along a great circle
 * from an evaluated w0 with gradient g, Hessian H, r = S - p.
 *
 * Patch about its centre, of angle R: f >= f0 + min over the disc of (g.s + s.H.s/2) - (k/2 - c(R))
 * R^2: what (1) of ball.c takes off k/2 s^2 along any great circle, which grows with s.
 */
#include "query/patch.h"
#include "query/search.h"

#define NEWTON_STEPS_MAX 24

static int is_exhausted(shcdi_search *s) {
    if (s->n_patches >= s->patches_max || s->n_evaluations >= s->evaluations_max) {
        s->truncated = 1;
    }
    return s->truncated;
}

/* ---- balls ---- */

double shcdi_room(const shcdi_view *view, size_t leaf, shcd_vec3 w, double reach) {
    shcd_vec3 c = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; k++) {
        c = shcd_add(c, shcdi_view_corner(view, leaf, k));
    }
    return reach - shcdi_angle_upper(shcd_norm(shcd_sub(shcd_unit(c), w)));
}

static int in_ball(const shcdi_search *s, const shcd_vec3 w[3], double *lower) {
    for (size_t i = 0; i < s->n_balls; i++) {
        const shcdi_ball_bound *b = &s->balls[i];
        if (shcdi_patch_in_cap(w, b->w, b->chord2)) {
            *lower = shcdi_max(*lower, b->lower);
            return 1;
        }
    }
    return 0;
}

int shcdi_search_in_ball(const shcdi_search *s, size_t leaf, double *lower) {
    const shcd_vec3 w[3] = {shcdi_view_corner(s->view, leaf, 0),
                            shcdi_view_corner(s->view, leaf, 1),
                            shcdi_view_corner(s->view, leaf, 2)};
    return in_ball(s, w, lower);
}

/* ---- feet ---- */

static int is_known(const shcdi_search *s, shcd_vec3 w) {
    for (size_t i = 0; i < s->n_balls; i++) {
        const shcd_vec3 d = shcd_sub(w, s->balls[i].w);
        if (shcd_dot(d, d) < 1e-18) {
            return 1;
        }
    }
    return 0;
}

static int run_newton(shcdi_search *s, const shcdi_leaf_bounds *bounds, shcdi_foot *foot) {
    const uint32_t used = s->n_evaluations, max = s->evaluations_max;
    const int steps = used + NEWTON_STEPS_MAX <= max ? NEWTON_STEPS_MAX : (int)(used < max);
    return shcdi_newton(s->view, s->p, steps, bounds, s->tolerance, foot, &s->n_newton,
                        &s->n_evaluations);
}

/* What finishing the foot will make of its distance: of two feet in one basin the better one is not
 * always the nearer one before that. */
static double expected_distance(const shcdi_foot *foot) {
    const double gain =
        foot->is_definite ? -(foot->g1 * foot->step1 + foot->g2 * foot->step2) : 0.0;
    return sqrt(shcdi_max(0.0, 2.0 * foot->f - gain));
}

/* Newton from a foot already evaluated. */
static void polish(shcdi_search *s, shcdi_foot *foot, size_t leaf) {
    shcdi_leaf_bounds bounds;
    shcdi_view_leaf_bounds(s->view, leaf, &bounds);
    int done = run_newton(s, &bounds, foot);
    double room = shcdi_room(s->view, leaf, foot->w, bounds.reach);
    if (!(room > 0.5 * bounds.reach)) {
        /* it has left the leaf: what was near enough by the old leaf's bounds may not be here */
        leaf = shcdi_view_leaf_of(s->view, foot->w);
        shcdi_view_leaf_bounds(s->view, leaf, &bounds);
        done = run_newton(s, &bounds, foot) && done;
        room = shcdi_room(s->view, leaf, foot->w, bounds.reach);
    }
    s->upper = shcdi_min(s->upper, foot->distance);
    const double expected = expected_distance(foot);
    if (expected < s->expected) {
        s->expected = expected;
        s->best = *foot;
        s->best_bounds = bounds;
        s->best_room = room;
        s->best_leaf = leaf;
        s->not_stationary = !done;
    }
    if (s->n_balls < SHCDI_BALLS_MAX && !is_known(s, foot->w) &&
        shcdi_ball_about(foot, &bounds, room, &s->balls[s->n_balls]) > 0.0) {
        s->n_balls++;
    }
}

void shcdi_search_polish_from(shcdi_search *s, shcd_vec3 w, size_t leaf) {
    shcdi_foot foot;
    shcdi_foot_at(s->view, s->p, w, &foot);
    s->n_evaluations++;
    polish(s, &foot, leaf);
}

/* ---- below the leaves ---- */

typedef struct open_patch {
    shcd_vec3 w[3];
    double lower; /* known of it already */
    int level;
} open_patch;

/* 1 if the patch is settled, 0 if it must be split; *lower is then its bound. */
static int examine(shcdi_search *s, size_t leaf, const shcdi_leaf_bounds *bounds,
                   const shcd_vec3 w[3], double *lower) {
    if (in_ball(s, w, lower) || is_exhausted(s)) {
        shcdi_search_drop(s, *lower);
        return 1;
    }
    double angle;
    shcdi_foot foot;
    shcdi_foot_at(s->view, s->p, shcdi_cap_of(w, &angle), &foot);
    s->n_evaluations++;
    s->n_patches++;
    const double third = shcdi_third_bound(bounds, foot.distance, angle);
    const shcdi_curve curve = shcdi_curve_of(&foot, bounds);
    const double loss = angle * angle * (0.5 * curve.k - shcdi_curve_mean(&curve, angle));
    const double f = shcdi_foot_lower(&foot, angle, loss);
    *lower = shcdi_max(*lower, f > 0.0 ? sqrt(2.0 * f) : 0.0);
    if (*lower >= s->upper - s->tolerance) {
        shcdi_search_drop(s, *lower);
        return 1;
    }
    if (s->bounds_only) {
        return 0;
    }
    /* convex, and its minimum not far outside: |g|/k bounds the way there */
    const double k = foot.low - third * angle;
    const double g2 = foot.g1 * foot.g1 + foot.g2 * foot.g2;
    const int holds_minimum = k > 0.0 && g2 < 4.0 * k * k * angle * angle;
    if (foot.distance < s->upper || (holds_minimum && s->n_balls < SHCDI_BALLS_MAX)) {
        polish(s, &foot, leaf);
        if (in_ball(s, w, lower)) {
            shcdi_search_drop(s, *lower);
            return 1;
        }
    }
    return 0;
}

void shcdi_search_settle_leaf(shcdi_search *s, size_t leaf, double lower) {
    shcdi_leaf_bounds bounds;
    open_patch stack[3 * SHCDI_SPLIT_LEVELS_MAX + 4];
    shcdi_view_leaf_bounds(s->view, leaf, &bounds);
    for (int k = 0; k < 3; k++) {
        stack[0].w[k] = shcdi_view_corner(s->view, leaf, k);
    }
    stack[0].lower = lower;
    stack[0].level = 0;
    size_t n = 1;
    while (n > 0) {
        const open_patch top = stack[--n];
        double bound = top.lower;
        if (bound >= s->upper - s->tolerance || s->truncated) {
            shcdi_search_drop(s, bound);
            continue;
        }
        if (examine(s, leaf, &bounds, top.w, &bound)) {
            continue;
        }
        if (top.level == s->levels_max) {
            shcdi_search_drop(s, bound);
            continue;
        }
        shcd_vec3 child[4][3];
        shcdi_split(top.w, child);
        for (int k = 0; k < 4; k++) {
            for (int i = 0; i < 3; i++) {
                stack[n].w[i] = child[k][i];
            }
            stack[n].lower = bound;
            stack[n++].level = top.level + 1;
        }
    }
}
