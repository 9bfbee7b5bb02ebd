/* SPDX-License-Identifier: BSD-3-Clause */
/* Certified closest point by branch and bound.
 *
 * f(w) = |S(w) - p|^2/2 on the sphere; U is the distance of the best foot known, tol the gap
 * allowed.
 *
 * Tree. |S(w) - p| >= |p - c| - r over a node with ball (c, r), and >= d(p, flat leaf triangle) -
 * eps over a leaf (eps: tree.c). What is below U - tol is kept: the survivors.
 *
 * Patches, below the leaves. Three lower bounds over a patch with corners w_i, centre c and angle
 * R: (a) flat: d(p, triangle of S(w_i)) - eps, with the leaf's M1, M2; (b) Taylor at c: f(w) >= f +
 * min over the square of (g.s + s.H.s/2) - F3 R^3/6, where |f'''| = |3 S'.S'' + (S - p).S'''| <= F3
 * = 3 M1 M2 + (|S(c) - p| + M1 R) M3; (c) convexity balls: at a local minimum w* with gradient g
 * and lowest eigenvalue k > 0, Taylor gives f(w) - f(w*) >= s (-|g| + k s/2 - F3 s^2/6) >= -|g| s +
 * k s^2/6 >= -3 |g|^2/(2 k) for all s <= 2 k/F3: a patch inside that ball cannot beat w* by more.
 * (b) converges with R^3 where (a) does with R^2, and (c) ends the search around each minimum.
 * Where a patch is convex (k - F3 R > 0 at c) but not eliminated, Newton finds its minimum: a
 * better U or a new ball. Otherwise it is split in four.
 *
 * All bounds hold for exact arithmetic; `slack` covers rounding: the evaluation error of S, twice,
 * and 16 roundings of numbers as large as |p| + |c| + r.
 */
#include "query/foot.h"
#include "query/internal.h"
#include "query/patch.h"
#include "query/winding.h"

#include <string.h>

#define SURVIVORS_MAX 256
#define BALLS_MAX 12
#define NEWTON_STEPS_MAX 24
#define FAST_STARTS 4
#define SIGN_GAP 2e-9       /* of the diagonal: thinner sheets are not told apart */
#define SPLIT_LEVELS_MAX 28 /* a leaf's edge halves to 1e-10 of itself */

typedef struct survivor {
    uint32_t leaf;
    double lower, flat;
} survivor;

typedef struct convexity_ball {
    shcd_vec3 w;
    double chord2;
    double lower;
} convexity_ball;

typedef struct search {
    const shcd_model *model;
    shcd_vec3 p;
    double tolerance, slack;
    double upper; /* distance of the best foot; before there is one, of the best leaf's far side */
    double lower; /* of everything that was dropped */
    double
        leaves_lower; /* of all leaves, by their flat bounds alone: holds where refinement stops */
    shcdi_foot best;
    size_t nearest_leaf;
    double nearest_b[3];
    survivor survivors[SURVIVORS_MAX];
    size_t n_survivors;
    int overflow; /* survivors were lost: traverse again */
    convexity_ball balls[BALLS_MAX];
    size_t n_balls;
    uint32_t n_evaluations, n_patches, n_newton;
    uint32_t patches_max, evaluations_max;
    int is_exact, truncated, not_stationary;
} search;

static void drop(search *s, double lower) {
    s->lower = shcdi_min(s->lower, lower);
}

static int is_exhausted(search *s) {
    if (s->n_patches >= s->patches_max || s->n_evaluations >= s->evaluations_max) {
        s->truncated = 1;
    }
    return s->truncated;
}

/* ---- feet and balls ---- */

/* Third-derivative bound of f over a cap of the given angle about a foot. */
static double third_bound(const shcdi_leaf *leaf, double distance, double angle) {
    const double m1 = (double)leaf->m1, m2 = (double)leaf->m2, m3 = (double)leaf->m3;
    return 3.0 * m1 * m2 + (distance + m1 * angle) * m3;
}

static int is_known(const search *s, shcd_vec3 w) {
    for (size_t i = 0; i < s->n_balls; i++) {
        const shcd_vec3 d = shcd_sub(w, s->balls[i].w);
        if (shcd_dot(d, d) < 1e-18) {
            return 1;
        }
    }
    return 0;
}

static void add_ball(search *s, const shcdi_foot *foot) {
    const shcdi_tree *tree = &s->model->tree;
    const size_t index = shcdi_leaf_of(tree, foot->w);
    const shcdi_leaf *leaf = &tree->leaf[index];
    shcdi_patch patch;
    shcdi_patch_of_leaf(tree, index, &patch);
    double angle;
    const shcd_vec3 to_centre = shcd_sub(shcdi_patch_centre(&patch, &angle), foot->w);
    const double room = (double)leaf->reach - shcdi_angle_upper(shcd_norm(to_centre));
    if (!(foot->low > 0.0) || !(room > 0.0) || s->n_balls == BALLS_MAX || is_known(s, foot->w)) {
        return;
    }
    const double third = third_bound(leaf, foot->distance, room);
    const double radius = third > 0.0 ? shcdi_min(room, 2.0 * foot->low / third) : room;
    const double g2 = foot->g1 * foot->g1 + foot->g2 * foot->g2;
    const double f = foot->f - 1.5 * g2 / foot->low;
    convexity_ball *b = &s->balls[s->n_balls++];
    b->w = foot->w;
    /* chord of an angle a: 2 sin(a/2) >= a (1 - a^2/24) */
    const double chord = radius * (1.0 - radius * radius / 24.0) * (1.0 - 1e-14);
    b->chord2 = chord * chord;
    b->lower = sqrt(shcdi_max(0.0, 2.0 * f));
}

/* Newton from a foot already evaluated; a local minimum becomes the best foot or at least a ball.
 */
static void polish(search *s, shcdi_foot *foot) {
    const uint32_t used = s->n_evaluations, max = s->evaluations_max;
    const int steps = used + NEWTON_STEPS_MAX <= max ? NEWTON_STEPS_MAX : (int)(used < max);
    const int done = shcdi_newton(s->model, s->p, steps, foot, &s->n_newton, &s->n_evaluations);
    if (foot->distance < s->upper) {
        s->upper = foot->distance;
        s->best = *foot;
        s->not_stationary = !done;
    }
    add_ball(s, foot);
}

static void polish_from(search *s, shcd_vec3 w) {
    shcdi_foot foot;
    shcdi_foot_at(s->model, s->p, w, &foot);
    s->n_evaluations++;
    polish(s, &foot);
}

static int inside_ball(const search *s, const shcdi_patch *patch, double *lower) {
    for (size_t i = 0; i < s->n_balls; i++) {
        const convexity_ball *b = &s->balls[i];
        int inside = 1;
        for (int k = 0; k < 3 && inside; k++) {
            const shcd_vec3 d = shcd_sub(patch->w[k], b->w);
            inside = shcd_dot(d, d) <= b->chord2;
        }
        if (inside) {
            *lower = b->lower;
            return 1;
        }
    }
    return 0;
}

/* ---- below the leaves ---- */

typedef struct open_patch {
    shcdi_patch patch;
    double lower; /* known of it already */
    int level;
} open_patch;

/* 1 if the patch is settled, 0 if it must be split; *lower is then its bound. */
static int examine(search *s, const shcdi_leaf *leaf, const shcdi_patch *patch, double *lower) {
    double b[3], from_ball;
    s->n_patches++;
    const double flat = shcdi_triangle_distance(s->p, patch->x, b) -
                        shcdi_patch_deviation(patch->w[0], patch->w[1], patch->w[2],
                                              (double)leaf->m1, (double)leaf->m2);
    *lower = shcdi_max(*lower, flat);
    if (*lower >= s->upper - s->tolerance) {
        drop(s, *lower);
        return 1;
    }
    if (inside_ball(s, patch, &from_ball)) {
        drop(s, from_ball);
        return 1;
    }
    if (is_exhausted(s)) {
        drop(s, *lower);
        return 1;
    }
    double angle;
    shcdi_foot foot;
    shcdi_foot_at(s->model, s->p, shcdi_patch_centre(patch, &angle), &foot);
    s->n_evaluations++;
    const double third = third_bound(leaf, foot.distance, angle);
    const double f = shcdi_foot_lower(&foot, angle, third);
    *lower = shcdi_max(*lower, f > 0.0 ? sqrt(2.0 * f) : 0.0);
    if (*lower >= s->upper - s->tolerance) {
        drop(s, *lower);
        return 1;
    }
    /* convex, and its minimum not far outside: |g|/k bounds the way there */
    const double k = foot.low - third * angle;
    const double g2 = foot.g1 * foot.g1 + foot.g2 * foot.g2;
    const int holds_minimum = k > 0.0 && g2 < 4.0 * k * k * angle * angle;
    if (foot.distance < s->upper || (holds_minimum && s->n_balls < BALLS_MAX)) {
        polish(s, &foot);
        if (inside_ball(s, patch, &from_ball)) {
            drop(s, from_ball);
            return 1;
        }
    }
    return 0;
}

static void refine_leaf(search *s, size_t index, double lower) {
    const shcdi_leaf *leaf = &s->model->tree.leaf[index];
    open_patch stack[3 * SPLIT_LEVELS_MAX + 4];
    shcdi_patch_of_leaf(&s->model->tree, index, &stack[0].patch);
    stack[0].lower = lower;
    stack[0].level = 0;
    size_t n = 1;
    while (n > 0) {
        const open_patch top = stack[--n];
        double bound = top.lower;
        if (bound >= s->upper - s->tolerance || s->truncated) {
            drop(s, bound);
            continue;
        }
        if (examine(s, leaf, &top.patch, &bound)) {
            continue;
        }
        if (top.level == SPLIT_LEVELS_MAX) {
            drop(s, bound);
            continue;
        }
        shcdi_patch child[4];
        shcdi_patch_split(s->model, &top.patch, child);
        s->n_evaluations += 3;
        for (int k = 0; k < 4; k++) {
            stack[n].patch = child[k];
            stack[n].lower = bound;
            stack[n++].level = top.level + 1;
        }
    }
}

/* ---- the tree ---- */

typedef struct open_node {
    double lower;
    uint32_t node;
    int level;
} open_node;

typedef struct node_stack {
    open_node node[8 + 3 * (SHCDI_TREE_LEVEL_MAX + 2)];
    size_t n;
} node_stack;

static double ball_lower(search *s, int level, uint32_t node) {
    const shcdi_ball *b = &s->model->tree.ball[shcdi_tree_level_start(level) + node];
    s->n_patches++;
    return shcd_norm(shcd_sub(s->p, b->centre)) - b->radius;
}

/* Pushes siblings so that the nearest comes off first. */
static void push_siblings(search *s, node_stack *stack, int level, uint32_t first, uint32_t count) {
    const size_t base = stack->n;
    for (uint32_t i = 0; i < count; i++) {
        open_node o = {ball_lower(s, level, first + i), first + i, level};
        size_t at = stack->n++;
        while (at > base && stack->node[at - 1].lower < o.lower) {
            stack->node[at] = stack->node[at - 1];
            at--;
        }
        stack->node[at] = o;
    }
}

/* First pass over a leaf: bounds only. */
static void note_leaf(search *s, uint32_t index) {
    const shcdi_tree *tree = &s->model->tree;
    const shcdi_leaf *leaf = &tree->leaf[index];
    const shcd_vec3 x[3] = {tree->position[leaf->vertex[0]], tree->position[leaf->vertex[1]],
                            tree->position[leaf->vertex[2]]};
    double b[3];
    const double flat = shcdi_triangle_distance(s->p, x, b);
    const double lower = flat - (double)leaf->deviation;
    s->n_patches++;
    s->leaves_lower = shcdi_min(s->leaves_lower, lower);
    if (flat + (double)leaf->deviation < s->upper) {
        s->upper = flat + (double)leaf->deviation;
        s->nearest_leaf = index;
        memcpy(s->nearest_b, b, sizeof b);
    }
    if (lower >= s->upper - s->tolerance) {
        drop(s, lower);
    } else if (s->n_survivors < SURVIVORS_MAX) {
        s->survivors[s->n_survivors++] = (survivor){index, lower, flat};
    } else {
        s->overflow = 1;
        drop(s, lower);
    }
}

static void traverse(search *s, void (*visit)(search *, uint32_t)) {
    node_stack stack;
    stack.n = 0;
    push_siblings(s, &stack, 0, 0, 8);
    while (stack.n > 0) {
        const open_node top = stack.node[--stack.n];
        if (top.lower >= s->upper - s->tolerance || s->n_patches >= s->patches_max) {
            is_exhausted(s);
            drop(s, top.lower);
        } else if (top.level == s->model->tree.level) {
            visit(s, top.node);
        } else {
            push_siblings(s, &stack, top.level + 1, 4 * top.node, 4);
        }
    }
}

/* Second pass over the whole tree, where survivors were lost or bounds are too coarse. */
static void settle_leaf(search *s, uint32_t index) {
    refine_leaf(s, index, 0.0);
}

static void settle_survivors(search *s) {
    for (size_t i = 0; i < s->n_survivors; i++) {
        refine_leaf(s, s->survivors[i].leaf, s->survivors[i].lower);
    }
}

/* Fast tier: Newton also from the next nearest leaves outside the balls found, a few of them; what
 * is left only lowers the bound. */
static void settle_fast(search *s) {
    for (int round = 1; round < FAST_STARTS; round++) {
        size_t next = s->n_survivors;
        for (size_t i = 0; i < s->n_survivors; i++) {
            shcdi_patch patch;
            double unused;
            shcdi_patch_of_leaf(&s->model->tree, s->survivors[i].leaf, &patch);
            if (s->survivors[i].lower < s->upper - s->tolerance &&
                !inside_ball(s, &patch, &unused) &&
                (next == s->n_survivors || s->survivors[i].flat < s->survivors[next].flat)) {
                next = i;
            }
        }
        if (next == s->n_survivors) {
            break;
        }
        shcdi_patch patch;
        double unused;
        shcdi_patch_of_leaf(&s->model->tree, s->survivors[next].leaf, &patch);
        polish_from(s, shcdi_patch_centre(&patch, &unused));
        drop(s, s->survivors[next].lower);
        s->survivors[next] = s->survivors[--s->n_survivors];
    }
    for (size_t i = 0; i < s->n_survivors; i++) {
        shcdi_patch patch;
        double lower = s->survivors[i].lower, from_ball;
        shcdi_patch_of_leaf(&s->model->tree, s->survivors[i].leaf, &patch);
        drop(s, inside_ball(s, &patch, &from_ball) ? shcdi_max(lower, from_ball) : lower);
    }
}

/* ---- sign and result ---- */

static double proven_lower(const search *s) {
    const double bound = shcdi_max(s->lower, s->leaves_lower);
    return shcdi_max(0.0, shcdi_min(bound, s->best.distance) - s->slack);
}

/* No room for another sheet of the surface between the foot and p. A coarse tolerance leaves room:
 * a thin body's far side is as good a foot then, and p - S points the wrong way there. */
static int is_narrow(const search *s) {
    const double gap = s->best.distance + s->slack - proven_lower(s);
    return gap <= shcdi_max(SIGN_GAP * s->model->info.diagonal_m, 4.0 * s->slack);
}

static int is_outside_ball(const search *s) {
    return shcd_norm(shcd_sub(s->p, s->model->info.centre_m)) - s->model->info.radius_m > s->slack;
}

/* -1 inside, +1 outside. At a regular global foot of an embedded surface p - S is parallel to the
 * normal, and its direction decides. Where it is not parallel (a singular point), the surface cuts
 * itself, or the foot may not be the global one, the leaf tessellation's winding number decides if
 * p is farther from S than the tessellation is. Otherwise the foot's side is a guess, and said to
 * be one. */
static double sign_of(search *s, shcd_vec3 normal, int *is_sure) {
    const shcdi_tree *tree = &s->model->tree;
    const double lower = proven_lower(s);
    const double along = -shcd_dot(normal, s->best.r);
    const double guess = along < 0.0 ? -1.0 : 1.0;
    *is_sure = 1;
    if (is_outside_ball(s)) {
        return 1.0;
    }
    if (s->model->info.is_embedded && is_narrow(s) && lower > 0.0 &&
        fabs(along) > 0.9 * s->best.distance) {
        return guess;
    }
    if (s->is_exact && lower > tree->deviation_max &&
        s->n_patches + tree->n_leaves <= s->patches_max) {
        s->n_patches += (uint32_t)tree->n_leaves;
        return shcdi_winding(tree, s->p) > 0 ? -1.0 : 1.0;
    }
    *is_sure = 0;
    return guess;
}

/* A distance that is good enough for a coarse tolerance may still leave the sign open. */
static int needs_finer_search(const search *s) {
    return s->is_exact && !s->truncated && s->model->info.is_embedded && !is_narrow(s) &&
           !is_outside_ball(s) && proven_lower(s) <= s->model->tree.deviation_max;
}

static void fill_result(search *s, double allowed, shcd_proximity *out) {
    const double distance = s->best.distance;
    const double upper = distance + s->slack;
    const double lower = proven_lower(s);
    const shcd_vec3 normal = shcdi_foot_normal(&s->best);
    int is_sure;
    const double sign = sign_of(s, normal, &is_sure);
    out->point_m = s->best.jet.s;
    out->normal = normal;
    out->parameter = s->best.w;
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

static void search_begin(search *s, const shcd_model *model, shcd_vec3 p,
                         const shcd_query_options *options, double *allowed) {
    const shcd_model_info *info = &model->info;
    const double to_centre = shcd_norm(shcd_sub(p, info->centre_m));
    const double relative = options->tolerance > 0.0 ? options->tolerance : 1e-9;
    s->model = model;
    s->p = p;
    s->slack = 2.0 * model->evaluation_error_m +
               16.0 * 2.2e-16 * (shcd_norm(p) + shcd_norm(info->centre_m) + info->radius_m);
    /* |p - c| - r is at most the distance: a tolerance relative to it is at most the one asked for
     */
    *allowed = relative * shcdi_max(info->diagonal_m, to_centre - info->radius_m);
    s->tolerance = shcdi_max(*allowed - 2.5 * s->slack, 0.25 * *allowed);
    s->upper = HUGE_VAL;
    s->lower = HUGE_VAL;
    s->leaves_lower = HUGE_VAL;
    s->nearest_leaf = 0;
    s->n_survivors = s->n_balls = 0;
    s->is_exact = options->tier == SHCD_TIER_EXACT;
    s->overflow = s->truncated = s->not_stationary = 0;
    s->n_evaluations = s->n_patches = s->n_newton = 0;
    s->patches_max = options->patches_max != 0 ? options->patches_max : SHCD_QUERY_PATCHES_DEFAULT;
    s->evaluations_max =
        options->evaluations_max != 0 ? options->evaluations_max : SHCD_QUERY_EVALUATIONS_DEFAULT;
}

void shcdi_query_certified(const shcd_model *model, shcd_vec3 p, const shcd_query_options *options,
                           shcd_proximity *out) {
    search s;
    double allowed;
    search_begin(&s, model, p, options, &allowed);
    traverse(&s, note_leaf);
    s.leaves_lower = shcdi_min(s.leaves_lower, s.lower);
    shcdi_patch leaf;
    shcdi_patch_of_leaf(&model->tree, s.nearest_leaf, &leaf);
    shcd_vec3 start = {0.0, 0.0, 0.0};
    for (int i = 0; i < 3; i++) {
        start = shcd_mul_add(start, s.upper < HUGE_VAL ? s.nearest_b[i] : 1.0, leaf.w[i]);
    }
    s.upper = HUGE_VAL;
    polish_from(&s, shcd_unit(start));
    if (!s.is_exact) {
        settle_fast(&s);
    } else if (s.overflow) {
        s.lower = HUGE_VAL;
        traverse(&s, settle_leaf);
    } else {
        settle_survivors(&s);
    }
    if (needs_finer_search(&s)) {
        s.tolerance = shcdi_min(s.tolerance, 0.5 * SIGN_GAP * model->info.diagonal_m);
        s.lower = HUGE_VAL;
        traverse(&s, settle_leaf);
    }
    fill_result(&s, allowed, out);
}
