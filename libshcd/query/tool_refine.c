/* SPDX-License-Identifier: BSD-3-Clause */
/* Feet, and what is below the leaves, in the search for the distance between the core K of a tool
 * and the surface.
 *
 * Patches below the leaves: Taylor bounds of tool_foot.c about the patch's centre. Corners are on
 * the parameter sphere only: a patch costs one jet. Ends: around a local minimum w* of f = d_K^2/2
 * with the minorant's gradient g (length G), lowest eigenvalue k > 0 and third-derivative bound F3,
 * all of which hold up to the angle s_max, f(w) - f(w*) >= s (-G + k s/2 - F3 s^2/6) >= s (-G + k
 * s/6) >= -3 G^2/(2 k) for s <= min(s_max, 2 k/F3): a patch in that ball cannot be nearer by more
 * than that. */
#include "query/tool_refine.h"

#include "query/patch.h"

#include <string.h>

#define NEWTON_STEPS_MAX 24
#define SPLIT_LEVELS_MAX 20 /* a leaf's edge halves to 1e-6 of itself */
#define BALL_TRIALS 6

/* ---- feet ---- */

/* All of the leaf's bounds hold within its reach of its centre, so about w up to what is left. */
static void add_ball(shcdi_tool_search *s, const shcdi_tool_foot *foot) {
    shcdi_view_leaf leaf;
    shcdi_view_leaf_at(s->view, shcdi_view_leaf_of(s->view, foot->w), &leaf);
    const shcd_vec3 off = shcd_sub(foot->w, leaf.centre);
    const double chord = shcd_norm(off);
    /* 2 asin(c/2) <= c + 0.143 c^3 for c <= sqrt(2) */
    double angle = leaf.reach - chord * (1.0 + 0.143 * chord * chord);
    const double m[3] = {leaf.m1, leaf.m2, leaf.m3};
    shcdi_tool_ball best = {foot->w, 0.0, 0.0};
    for (int trial = 0; trial < BALL_TRIALS && angle > 0.0; trial++, angle *= 0.4) {
        shcdi_quadratic q;
        double third;
        shcdi_tool_model(s->placed, foot, angle, m, &q, &third);
        const double radius = shcdi_min(angle, q.low > 0.0 ? 2.0 * q.low / third : 0.0);
        /* chord >= angle (1 - angle^2/24) */
        const double reach = radius * (1.0 - radius * radius / 24.0) * (1.0 - 1e-12);
        if (reach * reach > best.chord2 && reach > 0.0) {
            const double g2 = q.g_high * q.g_high + q.g_low * q.g_low;
            const double f = q.base - 1.5 * g2 / q.low;
            best.chord2 = reach * reach;
            best.lower = f > 0.0 ? sqrt(2.0 * f) : 0.0;
        }
        if (radius >= 0.4 * angle) {
            break;
        }
    }
    if (best.chord2 > 0.0 && s->n_balls < SHCDI_TOOL_BALLS_MAX) {
        s->balls[s->n_balls++] = best;
    }
}

static int is_known(const shcdi_tool_search *s, shcd_vec3 w) {
    for (size_t i = 0; i < s->n_balls; i++) {
        const shcd_vec3 d = shcd_sub(w, s->balls[i].w);
        if (shcd_dot(d, d) < 1e-18) {
            return 1;
        }
    }
    return 0;
}

static void note_foot(shcdi_tool_search *s, const shcdi_tool_foot *foot) {
    const double d = shcdi_max(0.0, foot->core.distance);
    if (!s->has_best || d < s->upper) {
        s->best = *foot;
        s->upper = d;
        s->has_best = 1;
    }
    s->enters = s->enters || d <= s->tolerance;
}

static void polish(shcdi_tool_search *s, shcdi_tool_foot *foot) {
    uint32_t steps = 0;
    const int done = shcdi_tool_newton(s->view, s->placed, NEWTON_STEPS_MAX, foot, &steps,
                                       &s->budget->n_evaluations);
    s->budget->n_newton += steps;
    const double before = s->has_best ? s->upper : HUGE_VAL;
    note_foot(s, foot);
    if (s->upper < before) {
        s->not_stationary = !done;
    }
    if (!s->enters && !is_known(s, foot->w)) {
        add_ball(s, foot);
    }
}

void shcdi_tool_polish_from(shcdi_tool_search *s, shcd_vec3 w) {
    shcdi_tool_foot foot;
    shcdi_tool_foot_at(s->view, s->placed, w, &foot);
    s->budget->n_evaluations++;
    polish(s, &foot);
}

static int inside_ball(const shcdi_tool_search *s, const shcd_vec3 w[3], double *lower) {
    for (size_t i = 0; i < s->n_balls; i++) {
        const shcdi_tool_ball *b = &s->balls[i];
        if (shcdi_patch_in_cap(w, b->w, b->chord2)) {
            *lower = b->lower;
            return 1;
        }
    }
    return 0;
}

int shcdi_tool_in_ball(const shcdi_tool_search *s, size_t index, double *lower) {
    shcd_vec3 w[3];
    double from_ball;
    for (int k = 0; k < 3; k++) {
        w[k] = shcdi_view_corner(s->view, index, k);
    }
    if (!inside_ball(s, w, &from_ball)) {
        return 0;
    }
    *lower = shcdi_max(*lower, from_ball);
    return 1;
}

/* ---- below the leaves ---- */

typedef struct open_patch {
    shcd_vec3 w[3];
    double lower;
    int level;
} open_patch;

/* Angle within which the patch lies of the direction of its corners' sum. */
static shcd_vec3 patch_centre(const shcd_vec3 w[3], double *angle) {
    const shcd_vec3 c = shcd_unit(shcd_add(w[0], shcd_add(w[1], w[2])));
    double chord = 0.0;
    for (int k = 0; k < 3; k++) {
        chord = shcdi_max(chord, shcd_norm(shcd_sub(w[k], c)));
    }
    *angle = chord * (1.0 + 0.143 * chord * chord) * (1.0 + 1e-12) + 1e-15;
    return c;
}

/* 1 if the patch is settled, 0 if it must be split; *lower is then its bound. */
static int examine(shcdi_tool_search *s, const shcdi_view_leaf *leaf, const shcd_vec3 w[3],
                   double *lower) {
    double from_ball, angle;
    if (inside_ball(s, w, &from_ball)) {
        shcdi_tool_drop(s, shcdi_max(*lower, from_ball));
        return 1;
    }
    if (shcdi_is_spent(s->budget)) {
        shcdi_tool_drop(s, *lower);
        return 1;
    }
    const double m[3] = {leaf->m1, leaf->m2, leaf->m3};
    shcdi_tool_foot foot;
    shcdi_tool_foot_at(s->view, s->placed, patch_centre(w, &angle), &foot);
    s->budget->n_patches++;
    s->budget->n_evaluations++;
    if (!(foot.core.distance > s->tolerance)) {
        note_foot(s, &foot);
        return 1;
    }
    *lower = shcdi_max(*lower, shcdi_tool_foot_lower(s->placed, &foot, angle, m));
    if (*lower >= shcdi_tool_threshold(s)) {
        shcdi_tool_drop(s, *lower);
        return 1;
    }
    /* convex, and its minimum not far outside: |g|/k bounds the way there */
    shcdi_quadratic q;
    double third;
    shcdi_tool_model(s->placed, &foot, angle, m, &q, &third);
    const double k = q.low - third * angle;
    const double g2 = q.g_high * q.g_high + q.g_low * q.g_low;
    const int holds_minimum = k > 0.0 && g2 < 4.0 * k * k * angle * angle;
    if (foot.core.distance < s->upper || (holds_minimum && s->n_balls < SHCDI_TOOL_BALLS_MAX)) {
        polish(s, &foot);
        if (s->enters) {
            return 1;
        }
        if (*lower >= shcdi_tool_threshold(s) || inside_ball(s, w, &from_ball)) {
            shcdi_tool_drop(s, *lower >= shcdi_tool_threshold(s) ? *lower
                                                                 : shcdi_max(*lower, from_ball));
            return 1;
        }
    }
    return 0;
}

static void push_children(open_patch *stack, size_t *n, const open_patch *parent, double lower) {
    const shcd_vec3 *w = parent->w;
    const shcd_vec3 m[3] = {shcd_unit(shcd_add(w[0], w[1])), shcd_unit(shcd_add(w[1], w[2])),
                            shcd_unit(shcd_add(w[2], w[0]))};
    const shcd_vec3 child[4][3] = {
        {w[0], m[0], m[2]}, {m[0], w[1], m[1]}, {m[2], m[1], w[2]}, {m[0], m[1], m[2]}};
    for (int k = 0; k < 4; k++) {
        open_patch *o = &stack[(*n)++];
        memcpy(o->w, child[k], sizeof o->w);
        o->lower = lower;
        o->level = parent->level + 1;
    }
}

void shcdi_tool_refine_leaf(shcdi_tool_search *s, size_t index, double lower) {
    shcdi_view_leaf leaf;
    open_patch stack[3 * SPLIT_LEVELS_MAX + 4];
    size_t n = 1;
    shcdi_view_leaf_at(s->view, index, &leaf);
    memcpy(stack[0].w, leaf.w, sizeof leaf.w);
    stack[0].lower = lower;
    stack[0].level = 0;
    while (n > 0 && !s->enters) {
        const open_patch top = stack[--n];
        double bound = top.lower;
        if (bound >= shcdi_tool_threshold(s)) {
            shcdi_tool_drop(s, bound);
        } else if (!examine(s, &leaf, top.w, &bound)) {
            if (top.level == SPLIT_LEVELS_MAX) {
                shcdi_tool_drop(s, bound);
            } else {
                push_children(stack, &n, &top, bound);
            }
        }
    }
}
