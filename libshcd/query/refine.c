/* SPDX-License-Identifier: BSD-3-Clause */
/* Feet, the balls around them, and bounds below the leaves. f(w) = |S(w) - p|^2/2; s is the angle
 * along a great circle from an evaluated w0 with gradient g, Hessian H, r = S - p, |r| = d.
 *
 * Ball. Lower bounds k - F s of f''(s) along every great circle from w0 are
 *
 *   A: the lowest eigenvalue of H, and 3 m12 + (d + m1 s) m3, a bound of |3 S'.S'' + r.S'''|,
 *      m12 that of |S'.S''|;
 *
 *   B: sigma^2 + the lowest eigenvalue of r.S'', and m1 m2 + d m3: |S'|^2 >= sigma^2, and r.S''
 *      changes by at most d m3 s through S'' and m1 s m2 through r;
 *
 *   C: sigma^2 - d m2, and m1 m2.
 *
 * A is right at the foot, B and C do not pay for the change of |S'|^2. The larger of A and X = B or
 * C changes over at t = (k_A - k_X)/(F_A - F_X); integrated twice, with e = max(0, s - t),
 *
 *   f(s) >= f0 - |g| s + c(s) s^2,  c(s) = k_A/2 - F_A s/6 + (F_A - F_X) e^3/(6 s^2).     (1)
 *
 * The bound of f'' falls with s, so c does, and where c >= k_A/20 at some s, f >= f0 - |g| s +
 * k_A s^2/20 at all smaller ones: at least f0 - 5 |g|^2/k_A, and at least f0 from s = 20 |g|/k_A
 * on.
 *
 * Near the foot the quadratic form itself is better than (1): with h = -H^-1 g the Newton step,
 * t = |s - h|, q(s) = f0 + g.h/2 + (s - h).H.(s - h)/2 and |s|^3 <= 4 |h|^3 + 4 t^3,
 *
 *   f >= q - F s^3/6 >= f0 + g.h/2 - 2 F |h|^3/3 + k t^2/2 - 2 F t^3/3                     (2)
 *
 * with A's k and F, where the last two terms are positive for t <= 3 k/(4 F). Both together hold f
 * from below over (1)'s ball if (2) reaches to where (1) has passed f0.
 *
 * Patch about its centre, of angle R: f >= f0 + min over the square of (g.s + s.H.s/2) - F R^3/6.
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

static double third_bound(const shcdi_leaf_bounds *b, double distance, double angle) {
    return 3.0 * b->product + (distance + b->m1 * angle) * b->m3;
}

/* Largest of a few radii up to `room` for which (1) holds with its share. */
static double reach_of(double room, double k_a, double f_a, double k_x, double f_x) {
    static const double trial[] = {1.0, 0.85, 0.72, 0.61, 0.52, 0.44, 0.37, 0.31, 0.26};
    /* with A alone: k/2 - F s/6 = share k */
    const double alone = (0.5 - SHCDI_BALL_SHARE) * 6.0 * k_a;
    if (alone >= f_a * room) {
        return room;
    }
    const double least = alone / f_a;
    const double bend = f_a - f_x, turn = bend > 0.0 ? (k_a - k_x) / bend : room;
    for (size_t i = 0; i < sizeof trial / sizeof trial[0] && trial[i] * room > least; i++) {
        const double s = trial[i] * room, e = shcdi_max(0.0, s - shcdi_max(0.0, turn));
        if (0.5 * k_a - f_a * s / 6.0 + bend * e * e * e / (6.0 * s * s) >=
            SHCDI_BALL_SHARE * k_a) {
            return s;
        }
    }
    return least;
}

/* Radius of the ball: with A and the better of B and C; 0 if f is not convex at the foot. */
static double radius_of(const shcdi_foot *foot, const shcdi_leaf_bounds *b, double room) {
    const double a11 = shcd_dot(foot->r, foot->jet.s11), a12 = shcd_dot(foot->r, foot->jet.s12),
                 a22 = shcd_dot(foot->r, foot->jet.s22);
    const double half = 0.5 * (a11 - a22), d = foot->distance;
    const double bend = 0.5 * (a11 + a22) - sqrt(half * half + a12 * a12);
    const double least2 = b->sigma * b->sigma, third = third_bound(b, d, room);
    if (!(foot->low > 0.0)) {
        return 0.0;
    }
    const double with_b =
        reach_of(room, foot->low, third, least2 + bend, b->m1 * b->m2 + d * b->m3);
    const double with_c = reach_of(room, foot->low, third, least2 - d * b->m2, b->m1 * b->m2);
    return shcdi_max(with_b, with_c) * (1.0 - 1e-12);
}

double shcdi_ball_about(const shcdi_foot *foot, const shcdi_leaf_bounds *bounds, double room,
                        shcdi_ball_bound *ball) {
    const double radius = room > 0.0 ? radius_of(foot, bounds, room) : 0.0;
    if (!(radius > 0.0)) {
        return 0.0;
    }
    const double g2 = foot->g1 * foot->g1 + foot->g2 * foot->g2, g = sqrt(g2);
    double f = foot->f - g2 / (4.0 * SHCDI_BALL_SHARE * foot->low);
    if (shcdi_is_definite(foot)) {
        double h1, h2;
        const double third = third_bound(bounds, foot->distance, room);
        const double h = shcdi_newton_step(foot, &h1, &h2);
        const double quadratic =
            foot->f + 0.5 * (foot->g1 * h1 + foot->g2 * h2) - third * h * h * h * (2.0 / 3.0);
        /* t <= 3 k/(4 F) covers s <= 3 k/(4 F) - h */
        const double passed = g / (SHCDI_BALL_SHARE * foot->low);
        if (0.75 * foot->low >= third * (h + shcdi_min(radius, passed))) {
            f = shcdi_max(f, quadratic);
        }
    }
    ball->w = foot->w;
    /* chord of an angle a: 2 sin(a/2) >= a (1 - a^2/24) */
    const double chord = radius * (1.0 - radius * radius / 24.0) * (1.0 - 1e-14);
    ball->chord2 = chord * chord;
    ball->lower = sqrt(shcdi_max(0.0, 2.0 * f));
    return radius;
}

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
    double h1, h2, gain = 0.0;
    if (shcdi_is_definite(foot)) {
        (void)shcdi_newton_step(foot, &h1, &h2);
        gain = -(foot->g1 * h1 + foot->g2 * h2);
    }
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
    const double third = third_bound(bounds, foot.distance, angle);
    const double f = shcdi_foot_lower(&foot, angle, third);
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
