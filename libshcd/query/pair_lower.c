/* SPDX-License-Identifier: BSD-3-Clause */
/* Certified lower bound of the distance between two surfaces, by branch and bound over pairs.
 *
 * A pair of patches P of A and Q of B is dropped when a lower bound of its distance reaches upper -
 * tolerance. In the order of their cost:
 *
 *   balls      |c_P - c_Q| - r_P - r_Q, of groups of 16 blocks, of blocks, and of leaves;
 *   separator  |S_b - z| - |S_a - z| >= lo(Q) - hi(P) (pair_separator.c);
 *   triangles  min_i n.b_i - max_i n.a_i - eps_P - eps_Q for a unit vector n: what a plane between
 *              the two flat triangles proves. Whatever n is used, the bound holds; n comes from the
 *              Frank-Wolfe iteration for the point of the Minkowski difference nearest to zero.
 *
 * Pairs of leaves that remain are split, the patch of the larger deviation in four, until their
 * deviations are below the tolerance. A pair of triangles that is closer than the best pair by more
 * than its deviations holds a better pair: Newton's method finds one, the search ends and starts
 * again with a new separator.
 */
#include "query/pair.h"

#include <string.h>

#define GROUP 16
#define CACHE 16
#define FRANK_WOLFE_MAX 12
#define SPLIT_LEVELS_MAX 24

/* One leaf, as needed at once. */
typedef struct leaf_bound {
    shcd_vec3 x[3], w[3];
    shcd_vec3 centre;
    double radius, deviation, m1, m2;
    double apart; /* separator's bound */
    int is_refined;
} leaf_bound;

typedef struct block_bound {
    size_t block;
    int is_filled;
    double apart; /* separator's bound of all leaves */
    leaf_bound leaf[SHCDI_BLOCK_LEAVES];
} block_bound;

typedef struct lower_search {
    shcdi_pair_search *s;
    block_bound block[2][CACHE];
} lower_search;

typedef struct ball {
    shcd_vec3 centre;
    double radius;
} ball;

typedef struct patch_pair {
    shcdi_pair_patch patch[2];
    int level;
} patch_pair;

static double ball_gap(const ball *a, const ball *b) {
    return shcd_norm(shcd_sub(a->centre, b->centre)) - a->radius - b->radius;
}

static ball block_ball(const shcdi_pair_search *s, int which, size_t block) {
    const shcdi_pair_body *body = &s->body[which];
    ball of;
    of.radius = shcdi_view_block_ball(&body->view, block, &of.centre);
    of.centre = shcd_transform(body->pose, of.centre);
    return of;
}

static size_t group_end(const shcdi_pair_search *s, int which, size_t group) {
    const size_t n = shcdi_view_block_count(&s->body[which].view), end = (group + 1) * GROUP;
    return end < n ? end : n;
}

static size_t group_count(const shcdi_pair_search *s, int which) {
    return (shcdi_view_block_count(&s->body[which].view) + GROUP - 1) / GROUP;
}

/* The separator's bound for a pair, from the bounds of either alone. */
static double separated(const shcdi_pair_search *s, double a, double b) {
    return s->separator.inner == 0 ? b - a : a - b;
}

/* Of the bounds of two patches of one body, that of both together. */
static double apart_both(const shcdi_pair_search *s, int which, double a, double b) {
    return which == s->separator.inner ? shcdi_max(a, b) : shcdi_min(a, b);
}

/* About the mean of the centres. */
static ball group_ball(shcdi_pair_search *s, int which, size_t group) {
    const size_t first = group * GROUP, end = group_end(s, which, group);
    ball of = {{0.0, 0.0, 0.0}, 0.0}, block[GROUP];
    for (size_t i = first; i < end; i++) {
        block[i - first] = block_ball(s, which, i);
        of.centre = shcd_add(of.centre, block[i - first].centre);
    }
    of.centre = shcd_scale(1.0 / (double)(end - first), of.centre);
    for (size_t i = 0; i < end - first; i++) {
        of.radius =
            shcdi_max(of.radius, shcd_norm(shcd_sub(block[i].centre, of.centre)) + block[i].radius);
    }
    s->n_patches++;
    return of;
}

static void fill_block(shcdi_pair_search *s, int which, size_t block, block_bound *out) {
    const shcdi_pair_body *body = &s->body[which];
    out->block = block;
    out->is_filled = 1;
    for (size_t k = 0; k < SHCDI_BLOCK_LEAVES; k++) {
        shcdi_view_leaf leaf;
        leaf_bound *l = &out->leaf[k];
        shcdi_view_leaf_at(&body->view, SHCDI_BLOCK_LEAVES * block + k, &leaf);
        shcd_vec3 centre = {0.0, 0.0, 0.0};
        for (int i = 0; i < 3; i++) {
            l->w[i] = leaf.w[i];
            l->x[i] = shcd_transform(body->pose, leaf.x[i]);
            centre = shcd_mul_add(centre, 1.0 / 3.0, l->x[i]);
        }
        double r2 = 0.0;
        for (int i = 0; i < 3; i++) {
            const shcd_vec3 d = shcd_sub(l->x[i], centre);
            r2 = shcdi_max(r2, shcd_dot(d, d));
        }
        l->centre = centre;
        l->deviation = leaf.deviation_m;
        l->radius = sqrt(r2) + leaf.deviation_m;
        l->m1 = leaf.m1;
        l->m2 = leaf.m2;
        l->is_refined = 0;
        l->apart = 0.0;
        if (s->separator.exists) {
            shcdi_image patch;
            memcpy(patch.w, l->w, sizeof l->w);
            memcpy(patch.x, l->x, sizeof l->x);
            l->apart = shcdi_separator_bound(&s->separator, which, &patch, l->deviation);
            out->apart = k == 0 ? l->apart : apart_both(s, which, out->apart, l->apart);
        }
    }
    s->n_patches += SHCDI_BLOCK_LEAVES;
}

static double corner_most(shcd_vec3 n, const shcd_vec3 x[3], int *at) {
    const double d[3] = {shcd_dot(n, x[0]), shcd_dot(n, x[1]), shcd_dot(n, x[2])};
    *at = d[0] >= d[1] ? (d[0] >= d[2] ? 0 : 2) : (d[1] >= d[2] ? 1 : 2);
    return d[*at];
}

/* Lower bound of the distance of two triangles, as good as `wanted` asks for; *found gets a
 * distance of two of their points, an upper bound. */
static double triangles_apart(const shcd_vec3 a[3], const shcd_vec3 b[3], double wanted,
                              double *found) {
    shcd_vec3 v = {0.0, 0.0, 0.0};
    double best = 0.0;
    for (int i = 0; i < 3; i++) {
        v = shcd_mul_add(v, 1.0 / 3.0, shcd_sub(b[i], a[i]));
    }
    for (int step = 0; step < FRANK_WOLFE_MAX; step++) {
        const double length = shcd_norm(v);
        *found = length;
        if (!(length > wanted)) {
            return best;
        }
        int of_a, of_b;
        const shcd_vec3 n = shcd_scale(1.0 / length, v), back = shcd_scale(-1.0, n);
        const double far_a = corner_most(n, a, &of_a), near_b = -corner_most(back, b, &of_b);
        best = shcdi_max(best, near_b - far_a);
        if (best >= wanted) {
            return best;
        }
        const shcd_vec3 d = shcd_sub(shcd_sub(b[of_b], a[of_a]), v);
        const double dd = shcd_dot(d, d), along = -shcd_dot(v, d);
        if (!(along > 0.0)) {
            return best;
        }
        v = shcd_mul_add(v, along < dd ? along / dd : 1.0, d);
    }
    return best;
}

static shcd_vec3 middle(const shcd_vec3 w[3]) {
    return shcd_unit(shcd_add(w[0], shcd_add(w[1], w[2])));
}

/* Newton from the centres of two patches; 1 if a better pair was found. */
static int try_pair(shcdi_pair_search *s, const shcd_vec3 wa[3], const shcd_vec3 wb[3]) {
    shcdi_pair_end end[2];
    const double before = s->upper;
    shcdi_pair_end_at(s, 0, middle(wa), &end[0]);
    shcdi_pair_end_at(s, 1, middle(wb), &end[1]);
    shcdi_pair_polish(s, end);
    s->improved |= s->upper < before - 0.1 * s->tolerance;
    return s->improved;
}

/* 1 if the pair is settled (or the search is to end), 0 if it must be split. */
static int examine(shcdi_pair_search *s, const patch_pair *p) {
    const double wanted = s->upper - s->tolerance;
    const shcdi_pair_patch *a = &p->patch[0], *b = &p->patch[1];
    const double deviation = a->deviation + b->deviation;
    double found = HUGE_VAL;
    s->n_patches++;
    double bound = triangles_apart(a->patch.x, b->patch.x, wanted + deviation, &found) - deviation;
    if (bound < wanted && s->separator.exists) {
        const shcdi_separator *separator = &s->separator;
        const double of[2] = {shcdi_separator_bound(separator, 0, &a->patch, a->deviation),
                              shcdi_separator_bound(separator, 1, &b->patch, b->deviation)};
        bound = shcdi_max(bound, of[1 - separator->inner] - of[separator->inner]);
    }
    if (bound >= wanted || p->level == SPLIT_LEVELS_MAX || shcdi_pair_exhausted(s)) {
        shcdi_pair_drop(s, bound);
        return 1;
    }
    return found + deviation < s->upper && try_pair(s, a->patch.w, b->patch.w);
}

static void settle_leaves(shcdi_pair_search *s, const leaf_bound *a, const leaf_bound *b) {
    const leaf_bound *leaf[2] = {a, b};
    patch_pair stack[3 * SPLIT_LEVELS_MAX + 4];
    for (int which = 0; which < 2; which++) {
        shcdi_view_leaf table;
        memcpy(table.w, leaf[which]->w, sizeof table.w);
        table.m1 = leaf[which]->m1;
        table.m2 = leaf[which]->m2;
        shcdi_pair_leaf(s, which, &table, &stack[0].patch[which]);
    }
    stack[0].level = 0;
    for (size_t n = 1; n > 0 && !s->improved;) {
        const patch_pair top = stack[--n];
        if (examine(s, &top)) {
            continue;
        }
        const int which = top.patch[1].deviation > top.patch[0].deviation;
        shcdi_pair_patch child[4];
        shcdi_pair_split(s, which, &top.patch[which], child);
        for (int k = 0; k < 4; k++) {
            stack[n].patch[1 - which] = top.patch[1 - which];
            stack[n].patch[which] = child[k];
            stack[n++].level = top.level + 1;
        }
    }
}

static void refine(shcdi_pair_search *s, int which, size_t leaf, leaf_bound *l) {
    if (!l->is_refined) {
        l->is_refined = 1;
        l->apart = shcdi_separator_refine(s, which, leaf, l->apart);
    }
}

static void visit_leaves(shcdi_pair_search *s, block_bound *a, size_t i, block_bound *b, size_t k) {
    leaf_bound *p = &a->leaf[i], *q = &b->leaf[k];
    const double wanted = s->upper - s->tolerance;
    double found;
    s->n_patches++;
    double bound = shcd_norm(shcd_sub(p->centre, q->centre)) - p->radius - q->radius;
    if (bound < wanted && s->separator.exists) {
        bound = shcdi_max(bound, separated(s, p->apart, q->apart));
    }
    if (bound < wanted) {
        const double deviation = p->deviation + q->deviation;
        bound =
            shcdi_max(bound, triangles_apart(p->x, q->x, wanted + deviation, &found) - deviation);
    }
    if (bound < wanted && s->separator.exists && !shcdi_pair_exhausted(s)) {
        refine(s, 0, SHCDI_BLOCK_LEAVES * a->block + i, p);
        refine(s, 1, SHCDI_BLOCK_LEAVES * b->block + k, q);
        bound = shcdi_max(bound, separated(s, p->apart, q->apart));
    }
    if (bound >= wanted || shcdi_pair_exhausted(s)) {
        shcdi_pair_drop(s, bound);
    } else {
        settle_leaves(s, p, q);
    }
}

typedef struct leaf_list {
    size_t n, leaf[SHCDI_BLOCK_LEAVES];
} leaf_list;

/* The leaves of a block that are not far from a ball of the other body. */
static void find_leaves(shcdi_pair_search *s, const block_bound *block, const ball *other,
                        leaf_list *found) {
    found->n = 0;
    for (size_t k = 0; k < SHCDI_BLOCK_LEAVES; k++) {
        const leaf_bound *l = &block->leaf[k];
        const double gap =
            shcd_norm(shcd_sub(l->centre, other->centre)) - l->radius - other->radius;
        if (gap >= s->upper - s->tolerance) {
            shcdi_pair_drop(s, gap);
        } else {
            found->leaf[found->n++] = k;
        }
    }
    s->n_patches += SHCDI_BLOCK_LEAVES;
}

static block_bound *block_of(lower_search *l, int which, size_t block) {
    block_bound *of = &l->block[which][block % CACHE];
    if (!of->is_filled || of->block != block) {
        fill_block(l->s, which, block, of);
    }
    return of;
}

static void visit_blocks(lower_search *l, const ball *of_a, size_t block_a, const ball *of_b,
                         size_t block_b) {
    shcdi_pair_search *s = l->s;
    block_bound *a = block_of(l, 0, block_a), *b = block_of(l, 1, block_b);
    leaf_list of[2];
    if (s->separator.exists) {
        const double bound = separated(s, a->apart, b->apart);
        if (bound >= s->upper - s->tolerance) {
            shcdi_pair_drop(s, bound);
            return;
        }
    }
    find_leaves(s, a, of_b, &of[0]);
    find_leaves(s, b, of_a, &of[1]);
    for (size_t i = 0; i < of[0].n; i++) {
        leaf_bound *p = &a->leaf[of[0].leaf[i]];
        if (s->separator.exists && separated(s, p->apart, b->apart) >= s->upper - s->tolerance) {
            shcdi_pair_drop(s, separated(s, p->apart, b->apart));
            continue;
        }
        for (size_t k = 0; k < of[1].n && !s->improved; k++) {
            visit_leaves(s, a, of[0].leaf[i], b, of[1].leaf[k]);
        }
    }
}

/* All blocks of a group of B against one block of A. */
static void visit_group(lower_search *l, size_t block_a, const ball *of_a, size_t group_b) {
    shcdi_pair_search *s = l->s;
    const size_t end = group_end(s, 1, group_b);
    for (size_t i = group_b * GROUP; i < end && !s->improved; i++) {
        const ball of_b = block_ball(s, 1, i);
        const double bound = ball_gap(of_a, &of_b);
        s->n_patches++;
        if (bound >= s->upper - s->tolerance || shcdi_pair_exhausted(s)) {
            shcdi_pair_drop(s, bound);
        } else {
            visit_blocks(l, of_a, block_a, &of_b, i);
        }
    }
}

void shcdi_pair_bound(shcdi_pair_search *s) {
    lower_search l;
    l.s = s;
    for (size_t i = 0; i < CACHE; i++) {
        l.block[0][i].is_filled = l.block[1][i].is_filled = 0;
    }
    s->lower = HUGE_VAL;
    s->improved = 0;
    const size_t n_a = group_count(s, 0), n_b = group_count(s, 1);
    for (size_t group_b = 0; group_b < n_b; group_b++) {
        const ball of_b = group_ball(s, 1, group_b);
        for (size_t group_a = 0; group_a < n_a; group_a++) {
            const ball of_a = group_ball(s, 0, group_a);
            const double bound = ball_gap(&of_a, &of_b);
            if (bound >= s->upper - s->tolerance || shcdi_pair_exhausted(s)) {
                shcdi_pair_drop(s, bound);
                continue;
            }
            const size_t end = group_end(s, 0, group_a);
            for (size_t i = group_a * GROUP; i < end && !s->improved; i++) {
                const ball block = block_ball(s, 0, i);
                const double one = ball_gap(&block, &of_b);
                s->n_patches++;
                if (one >= s->upper - s->tolerance || shcdi_pair_exhausted(s)) {
                    shcdi_pair_drop(s, one);
                } else {
                    visit_group(&l, i, &block, group_b);
                }
            }
            if (s->improved) {
                return;
            }
        }
    }
}
