/* SPDX-License-Identifier: BSD-3-Clause */
/* Certified distance from the core K of a tool to the surface, by branch and bound.
 *
 * U is the distance of the best foot known, tol the gap allowed; what is proven to be at U - tol or
 * more is dropped, and the least bound of what was dropped is the answer's lower end.
 *
 * Blocks: d_K(centre) - radius >= the distance to a box that holds K, minus radius; then d_K
 * itself. Leaves: u.x - h(u) over the corners for one u, then the distance between K and the flat
 * triangle (both convex: tool_gap.c certifies it), minus the leaf's deviation. Below the leaves:
 * tool_refine.c. */
#include "query/tool_cull.h"
#include "query/tool_refine.h"

#define SURVIVORS_MAX 192
#define BLOCKS_MAX 192

/* ---- leaves and blocks ---- */

static void keep_candidate(shcdi_tool_search *s, shcdi_candidates *list, size_t index,
                           double lower) {
    if (lower >= shcdi_tool_threshold(s)) {
        shcdi_tool_drop(s, lower);
        return;
    }
    if (list->n == list->n_max) { /* those that the upper bound has overtaken since make room */
        size_t kept = 0;
        for (size_t i = 0; i < list->n; i++) {
            if (list->item[i].lower >= shcdi_tool_threshold(s)) {
                shcdi_tool_drop(s, list->item[i].lower);
            } else {
                list->item[kept++] = list->item[i];
            }
        }
        list->n = kept;
    }
    if (list->n < list->n_max) {
        list->item[list->n].index = (uint32_t)index;
        list->item[list->n++].lower = lower;
    } else {
        list->overflow = 1;
        shcdi_tool_drop(s, lower);
    }
}

/* Takes the candidate with the least bound; 0 if none is left below the threshold. */
static int take_nearest(shcdi_tool_search *s, shcdi_candidates *list, shcdi_candidate *taken) {
    size_t best = 0;
    for (size_t i = 1; i < list->n; i++) {
        best = list->item[i].lower < list->item[best].lower ? i : best;
    }
    if (list->n == 0) {
        return 0;
    }
    *taken = list->item[best];
    list->item[best] = list->item[--list->n];
    if (taken->lower >= shcdi_tool_threshold(s)) { /* so are all others */
        shcdi_tool_drop(s, taken->lower);
        list->n = 0;
        return 0;
    }
    return 1;
}

/* Bounds of one leaf; its far side bounds the distance from above. First by one plane: u.x - h(u)
 * over the corners, with the u of the block's middle; most leaves need no more. */
static double leaf_bound(shcdi_tool_search *s, size_t index, const shcdi_core_foot *block) {
    shcdi_view_leaf leaf;
    shcdi_core_gap gap;
    shcd_vec3 x[3];
    shcdi_view_leaf_at(s->view, index, &leaf);
    double least = HUGE_VAL;
    for (int k = 0; k < 3; k++) {
        x[k] = shcdi_to_tool(s->placed, leaf.x[k]);
        least = shcdi_min(least, shcd_dot(block->u, shcd_sub(x[k], block->point)));
    }
    s->budget->n_patches++;
    /* h(u) = u.(x0 - point) + u.point - (u.x0 - h(u)): what the foot's own interval leaves open */
    const double plane = least - (block->distance - block->lower) - leaf.deviation_m;
    if (plane >= shcdi_tool_threshold(s)) {
        return plane;
    }
    shcdi_core_gap_to(s->placed->tool, x, 3, 0.05 * leaf.deviation_m,
                      shcdi_tool_threshold(s) + leaf.deviation_m, &gap);
    if (gap.upper < s->nearest_flat) {
        shcd_vec3 w = {0.0, 0.0, 0.0};
        for (int k = 0; k < 3; k++) {
            w = shcd_mul_add(w, gap.weight[k], leaf.w[k]);
        }
        s->nearest_flat = gap.upper;
        s->nearest_w = shcd_unit(w);
        s->nearest_is_new = 1;
        if (!s->has_best) { /* later on U is what the best foot attains, nothing less */
            s->upper = shcdi_min(s->upper, gap.upper + leaf.deviation_m);
        }
    }
    return shcdi_max(plane, gap.lower - leaf.deviation_m);
}

static void visit_leaves(shcdi_tool_search *s, size_t block, int is_second) {
    shcd_vec3 centre;
    shcdi_core_foot foot;
    (void)shcdi_view_block_ball(s->view, block, &centre);
    shcdi_core_closest(s->placed->tool, shcdi_to_tool(s->placed, centre), &foot);
    for (size_t k = 0; k < SHCDI_BLOCK_LEAVES && !s->enters; k++) {
        const size_t index = SHCDI_BLOCK_LEAVES * block + k;
        const double lower = leaf_bound(s, index, &foot);
        if (!is_second) {
            keep_candidate(s, &s->leaves, index, lower);
        } else if (lower >= shcdi_tool_threshold(s) || shcdi_is_spent(s->budget)) {
            shcdi_tool_drop(s, lower);
        } else {
            shcdi_tool_refine_leaf(s, index, lower);
        }
    }
}

/* d_K over a block: by the box around K, then, of a hull, by K itself. */
static double block_lower(shcdi_tool_search *s, size_t block) {
    shcd_vec3 centre;
    const double radius = shcdi_view_block_ball(s->view, block, &centre);
    const shcd_vec3 x = shcdi_to_tool(s->placed, centre);
    const double lower = shcdi_core_box_distance(s->placed->tool, x) - radius;
    if (s->placed->tool->kind != SHCD_TOOL_HULL || lower >= shcdi_tool_threshold(s)) {
        return lower;
    }
    shcdi_core_foot foot;
    shcdi_core_closest(s->placed->tool, x, &foot);
    return shcdi_max(lower, foot.lower - radius);
}

/* Of everything: by the convex sets that hold the body, and that K is then outside of. */
static double convex_lower(shcdi_tool_search *s) {
    shcdi_cull_body body;
    double gap;
    shcdi_cull_body_of(s->view, &body);
    s->is_outside = shcdi_tool_cull(&body, s->placed, 0.0, &gap);
    return (gap + s->placed->tool->radius_m) * (1.0 - 1e-15);
}

/* The block nearest to the tool's middle or, if the tool is long beside the body, to its box. */
static size_t nearest_block(const shcdi_tool_search *s, size_t n) {
    const shcdi_placed_tool *t = s->placed;
    const shcd_vec3 middle = shcdi_to_body(t, t->tool->middle_m);
    const int is_long = t->tool->bounding_m > 0.5 * s->view->radius_m;
    size_t first = 0;
    double least = HUGE_VAL;
    for (size_t i = 0; i < n; i++) {
        shcd_vec3 centre;
        (void)shcdi_view_block_ball(s->view, i, &centre);
        const shcd_vec3 d = shcd_sub(centre, middle);
        double key = shcd_dot(d, d);
        if (is_long) {
            key = shcdi_core_box_distance(t->tool, shcdi_to_tool(t, centre));
        }
        if (key < least) {
            least = key;
            first = i;
        }
    }
    return first;
}

/* Newton from the nearest leaf, unless that was done. */
static void polish_nearest(shcdi_tool_search *s) {
    if (!s->enters && s->nearest_is_new && (!s->has_best || s->nearest_flat < s->upper)) {
        s->nearest_is_new = 0;
        shcdi_tool_polish_from(s, s->nearest_w);
    }
}

/* The nearest block first: its leaves and Newton from there give an upper bound at once, so that
 * few other blocks are looked into. */
static void first_block(shcdi_tool_search *s, size_t n, size_t *first) {
    *first = nearest_block(s, n);
    s->budget->n_patches += (uint32_t)n;
    visit_leaves(s, *first, 0);
    polish_nearest(s);
}

/* A block is left out without a square root if even the ball around K is farther from it than U:
 * nothing in it is nearer than U, which the best foot drops anyway. */
static int is_far(const shcdi_tool_search *s, size_t block) {
    shcd_vec3 centre;
    const double radius = shcdi_view_block_ball(s->view, block, &centre);
    const shcd_vec3 d = shcd_sub(centre, s->placed->position_m);
    const double reach = radius + s->placed->tool->bounding_m + s->upper;
    return shcd_dot(d, d) * (1.0 - 1e-14) > reach * reach;
}

/* Blocks by their balls, then, nearest first, their leaves. */
static void first_pass(shcdi_tool_search *s) {
    shcdi_candidate item[BLOCKS_MAX], next;
    shcdi_candidates blocks = {item, 0, BLOCKS_MAX, 0};
    const size_t n = shcdi_view_block_count(s->view);
    size_t first;
    if (s->budget->n_patches + n >= s->budget->patches_max) {
        shcdi_tool_drop(s, convex_lower(s));
        return;
    }
    first_block(s, n, &first);
    for (size_t i = 0; i < n && !s->enters; i++) {
        if (i != first && !is_far(s, i)) {
            s->budget->n_patches++;
            keep_candidate(s, &blocks, i, block_lower(s, i));
        }
    }
    while (!s->enters && take_nearest(s, &blocks, &next)) {
        if (s->budget->n_patches >= s->budget->patches_max) {
            shcdi_tool_drop(s, next.lower);
        } else {
            visit_leaves(s, next.index, 0);
        }
    }
    s->leaves.overflow |= blocks.overflow;
}

/* Where candidates were lost: everything again, without keeping any. */
static void second_pass(shcdi_tool_search *s) {
    const size_t n = shcdi_view_block_count(s->view);
    s->lower = HUGE_VAL;
    for (size_t i = 0; i < n && !s->enters; i++) {
        if (is_far(s, i)) {
            continue;
        }
        const double lower = block_lower(s, i);
        s->budget->n_patches++;
        if (lower >= shcdi_tool_threshold(s) || shcdi_is_spent(s->budget)) {
            shcdi_tool_drop(s, lower);
        } else {
            visit_leaves(s, i, 1);
        }
    }
}

/* Of everything, by the leaves' own bounds and the balls found. */
static double leaves_lower(const shcdi_tool_search *s) {
    double lower = s->lower;
    for (size_t i = 0; i < s->leaves.n; i++) {
        double of_leaf = s->leaves.item[i].lower;
        if (of_leaf < lower) {
            (void)shcdi_tool_in_ball(s, s->leaves.item[i].index, &of_leaf);
        }
        lower = shcdi_min(lower, of_leaf);
    }
    return lower;
}

/* What the normal at the best foot says. */
static int seems_inside(const shcdi_tool_search *s) {
    const shcdi_jet *j = &s->best.jet;
    return shcd_dot(shcd_cross(j->s1, j->s2), s->best.u) > 0.0;
}

static void settle(shcdi_tool_search *s) {
    shcdi_candidate next;
    if (s->leaves.overflow) {
        second_pass(s);
        return;
    }
    while (!s->enters && take_nearest(s, &s->leaves, &next)) {
        shcdi_tool_refine_leaf(s, next.index, next.lower);
    }
}

void shcdi_search_core(const shcdi_view *view, const shcdi_placed_tool *placed, double tolerance,
                       shcdi_effort effort, const shcd_vec3 *seed, shcdi_budget *budget,
                       shcdi_core_distance *out) {
    shcdi_tool_search s;
    shcdi_candidate item[SURVIVORS_MAX];
    s.view = view;
    s.placed = placed;
    s.budget = budget;
    s.tolerance = tolerance;
    s.upper = s.lower = s.nearest_flat = HUGE_VAL;
    s.has_best = s.enters = s.not_stationary = s.nearest_is_new = s.is_outside = 0;
    s.n_balls = 0;
    s.nearest_w = shcd_vec3_make(0.0, 0.0, 1.0);
    s.leaves = (shcdi_candidates){item, 0, SURVIVORS_MAX, 0};
    if (seed != NULL) {
        shcdi_tool_polish_from(&s, *seed);
    }
    if (!s.enters) {
        first_pass(&s);
    }
    polish_nearest(&s);
    if (!s.has_best) { /* no budget for a single leaf */
        shcdi_tool_polish_from(&s, s.nearest_w);
    }
    const double coarse = leaves_lower(&s);
    out->is_coarse = effort == SHCDI_EFFORT_OUTSIDE && coarse > placed->slack_m && seems_inside(&s);
    if (!s.enters && (effort == SHCDI_EFFORT_LEAVES || out->is_coarse)) {
        s.lower = coarse;
    } else if (!s.enters) {
        settle(&s);
    }
    out->foot = s.best;
    out->enters = s.enters;
    out->is_outside = s.is_outside;
    out->not_stationary = s.not_stationary;
    out->upper = s.upper + placed->slack_m;
    out->lower = s.enters ? 0.0 : shcdi_min(shcdi_max(s.lower, coarse), s.upper) - placed->slack_m;
    out->lower = shcdi_max(0.0, out->lower);
}
