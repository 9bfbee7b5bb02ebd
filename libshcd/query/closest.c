/* SPDX-License-Identifier: BSD-3-Clause */
/* Certified closest point by branch and bound.
 *
 * f(w) = |S(w) - p|^2/2 on the sphere; U is the distance of the best foot known, tol the gap
 * allowed. The scan (search.c) leaves the leaves whose flat bound is below U - tol: the survivors.
 * Newton from the nearest one gives U and a ball over which f is known (ball.c); it holds most
 * survivors, which lie around the foot. The exact tier settles the others one by one; the fast tier
 * runs Newton from a few of them and reports what it proved.
 *
 * All bounds hold for exact arithmetic; `slack` covers rounding: the evaluation error of S, twice,
 * and 16 roundings of numbers as large as |p| + |c| + r.
 */
#include "query/internal.h"
#include "query/patch.h"

#define FAST_STARTS 4

/* Leaves that are neither known to be too far nor in a ball. */
static void settle_survivors(shcdi_search *s) {
    shcdi_survivors it;
    size_t leaf;
    double lower;
    s->lower = s->beyond_lower;
    shcdi_survivors_begin(s, &it, s->upper - s->tolerance);
    while (shcdi_survivors_next(s, &it, &leaf, &lower)) {
        if (lower >= s->upper - s->tolerance || shcdi_search_in_ball(s, leaf, &lower)) {
            shcdi_search_drop(s, lower);
        } else {
            shcdi_search_settle_leaf(s, leaf, lower);
        }
    }
}

/* The nearest leaf that is still in question, or -1. */
static long next_survivor(shcdi_search *s) {
    shcdi_survivors it;
    long next = -1;
    size_t leaf;
    double lower, nearest = s->upper - s->tolerance;
    shcdi_survivors_begin(s, &it, nearest);
    while (shcdi_survivors_next(s, &it, &leaf, &lower)) {
        double unused = lower;
        if (lower < nearest && !shcdi_search_in_ball(s, leaf, &unused)) {
            nearest = lower;
            next = (long)leaf;
        }
    }
    return next;
}

/* Newton also from the next nearest leaves outside the balls found, a few of them; what is left
 * only lowers the bound. */
static void settle_fast(shcdi_search *s) {
    for (int round = 1; round < FAST_STARTS; round++) {
        const long leaf = next_survivor(s);
        const size_t n_balls = s->n_balls;
        if (leaf < 0) {
            break;
        }
        shcd_vec3 w[3];
        double angle, unused = 0.0;
        for (int k = 0; k < 3; k++) {
            w[k] = shcdi_view_corner(s->view, (size_t)leaf, k);
        }
        shcdi_search_polish_from(s, shcdi_cap_of(w, &angle), (size_t)leaf);
        if (s->n_balls == n_balls || !shcdi_search_in_ball(s, (size_t)leaf, &unused)) {
            break; /* it would be found again */
        }
    }
    shcdi_survivors it;
    size_t leaf;
    double lower;
    s->lower = s->beyond_lower;
    shcdi_survivors_begin(s, &it, s->upper - s->tolerance);
    while (shcdi_survivors_next(s, &it, &leaf, &lower)) {
        (void)shcdi_search_in_ball(s, leaf, &lower);
        shcdi_search_drop(s, lower);
    }
}

void shcdi_search_result(shcdi_search *s, double allowed, shcd_proximity *out) {
    if (s->best.is_definite && s->best.step <= s->best_room) {
        s->slack += shcdi_foot_finish(&s->best, s->p, s->best_bounds.m3);
    }
    const double distance = s->best.distance;
    const double upper = distance + s->slack;
    const double lower = shcdi_search_lower(s);
    const shcd_vec3 normal = shcdi_foot_normal(&s->best);
    int is_sure;
    const double sign = shcdi_search_sign(s, normal, &is_sure);
    out->point_m = shcdi_flushed3(s->best.jet.s);
    out->normal = normal;
    out->parameter = shcdi_flushed3(s->best.w);
    out->n_evaluations = s->n_evaluations;
    out->n_patches = s->n_patches;
    out->n_newton = s->n_newton;
    out->distance_m = sign * distance;
    out->lower_m = sign < 0.0 ? -upper : lower;
    out->upper_m = sign < 0.0 ? -lower : upper;
    if (!is_sure) {
        out->flags |= SHCD_PROXIMITY_SIGN_UNSURE;
        out->lower_m = -upper;
        out->upper_m = upper;
    }
    if (!(upper - lower <= allowed)) {
        out->flags |= SHCD_PROXIMITY_TRUNCATED;
    }
    if (s->not_stationary) {
        out->flags |= SHCD_PROXIMITY_NOT_STATIONARY;
    }
}

static void finish_exact(shcdi_search *s, double allowed, shcd_proximity *out) {
    settle_survivors(s);
    if (shcdi_search_needs_finer(s)) {
        s->tolerance = shcdi_min(s->tolerance, 0.4 * SHCDI_SIGN_GAP * s->view->diagonal_m);
        s->n_balls = 0;
        s->upper = s->expected = HUGE_VAL;
        shcdi_search_polish_from(s, s->best.w, s->best_leaf);
        shcdi_search_scan_to(s, s->upper - s->tolerance);
        settle_survivors(s);
    }
    s->evaluated = s->best;
    shcdi_search_result(s, allowed, out);
}

void shcdi_search_exactly(shcdi_search *s, const shcdi_view *view, shcd_vec3 p,
                          const shcd_query_options *options) {
    double unused;
    shcdi_search_begin(s, view, p, options, &unused);
    shcdi_search_scan(s);
    shcdi_search_polish_from(s, shcdi_search_start(s), s->nearest_leaf);
    settle_survivors(s);
}

void shcdi_query_certified(shcdi_search *s, const shcdi_view *view, shcd_vec3 p,
                           const shcd_query_options *options, shcd_proximity *out) {
    double allowed;
    shcdi_search_begin(s, view, p, options, &allowed);
    shcdi_search_scan(s);
    shcdi_search_polish_from(s, shcdi_search_start(s), s->nearest_leaf);
    if (s->is_exact) {
        finish_exact(s, allowed, out);
    } else {
        settle_fast(s);
        shcdi_search_result(s, allowed, out);
    }
}

void shcdi_query_certified_from(shcdi_search *s, const shcdi_view *view, shcd_vec3 p, shcd_vec3 w,
                                const shcd_query_options *options, int last_sign, double moved_m,
                                shcd_proximity *out) {
    double allowed;
    shcdi_search_begin(s, view, p, options, &allowed);
    s->last_sign = last_sign;
    s->moved_m = moved_m;
    shcdi_search_polish_from(s, w, shcdi_view_leaf_of(view, w));
    shcdi_search_scan_to(s, s->upper - s->tolerance);
    finish_exact(s, allowed, out);
}
