/* SPDX-License-Identifier: BSD-3-Clause */
/* Inside or outside: whether the surface turns around p.
 *
 * At a regular global foot of an embedded surface p - S is parallel to the normal, and its
 * direction decides. Where it is not parallel (a singular point) or the surface may cut itself,
 * there is more:
 *
 *   Continuity. While p and S move along straight ways by no more than `moved` in all, and p is
 *   farther than that from S at the end, the distance stays above 0, and the number of turns stays
 *   what it was.
 *
 *   The leaf tessellation (winding.c), where p is farther from each leaf's triangle than the leaf
 *   deviates from it.
 *
 *   A point q farther away from the foot, if p lies in the ball about q that is proven to be free
 *   of S: both are on the same side, and q may be far enough for the tessellation.
 *
 * Otherwise the foot's side is a guess, and said to be one. */
#include "query/search.h"
#include "query/winding.h"

double shcdi_search_lower(const shcdi_search *s) {
    const double bound = shcdi_max(s->lower, s->leaves_lower);
    return shcdi_max(0.0, shcdi_min(bound, s->best.distance) - s->slack);
}

/* No room for another sheet of the surface between the foot and p. A coarse tolerance leaves room:
 * a thin body's far side is as good a foot then, and p - S points the wrong way there. */
static int is_narrow(const shcdi_search *s) {
    const double gap = s->best.distance + s->slack - shcdi_search_lower(s);
    return gap <= shcdi_max(SHCDI_SIGN_GAP * s->view->diagonal_m, 4.0 * s->slack);
}

static int is_outside_ball(const shcdi_search *s) {
    return shcd_norm(shcd_sub(s->p, s->view->model->info.centre_m)) - s->view->radius_m > s->slack;
}

/* Whether p is farther from the leaves' triangles than these deviate from the surface, all of them
 * or each by itself (strips between blocks, winding.c: a point X between T_1 and T_2, which are
 * within e_1, e_2 of S. Were p = S + a (T_1 - S) + b (T_2 - S) on the way from S to X, a + b <= 1,
 * then |p - T_1| <= (1 - a) e_1 + b e_2 and |p - T_2| <= a e_1 + (1 - b) e_2, of which one is no
 * more than its e). */
static int is_clear(const shcdi_search *s) {
    return s->leaves_lower > s->slack || shcdi_search_lower(s) > shcdi_tessellation_error(s->view);
}

/* -1, 1, or 0: not decided. */
static int side_by_winding(const shcdi_search *at, shcdi_search *budget) {
    const uint32_t n_blocks = (uint32_t)shcdi_view_block_count(at->view);
    int winding;
    if (!is_clear(at) || budget->n_patches + n_blocks > budget->patches_max ||
        !shcdi_winding(at->view, at->p, &winding, &budget->n_patches)) {
        return 0;
    }
    return winding > 0 ? -1 : 1;
}

/* Way of q from the foot, in deviations of the leaf there: the tessellation is nearer to q than the
 * surface by up to one, and has to be farther than one. */
#define STEP_AWAY 2.5
/* Where q is not settled by then it is near the medial axis, or positions are very stale. */
#define AFAR_PATCHES 256
#define AFAR_EVALUATIONS 32

static uint32_t least_of(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

static int side_from_afar(shcdi_search *s) {
    shcdi_view_leaf leaf;
    shcdi_search other;
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    const double d = s->best.distance;
    if (!(d > 0.0) || s->n_patches >= s->patches_max || s->n_evaluations >= s->evaluations_max) {
        return 0;
    }
    shcdi_view_leaf_at(s->view, s->best_leaf, &leaf);
    const double way = STEP_AWAY * leaf.deviation_m;
    const shcd_vec3 q = shcd_mul_add(s->best.jet.s, -way / d, s->best.r);
    options.patches_max = least_of(s->patches_max - s->n_patches, AFAR_PATCHES);
    options.evaluations_max = least_of(s->evaluations_max - s->n_evaluations, AFAR_EVALUATIONS);
    if (!(way > d)) {
        return 0;
    }
    shcdi_search_exactly(&other, s->view, q, &options);
    s->n_evaluations += other.n_evaluations;
    s->n_patches += other.n_patches;
    s->n_newton += other.n_newton;
    return shcdi_search_lower(&other) > shcd_norm(shcd_sub(q, s->p)) * (1.0 + 1e-15)
               ? side_by_winding(&other, s)
               : 0;
}

double shcdi_search_sign(shcdi_search *s, shcd_vec3 normal, int *is_sure) {
    const double lower = shcdi_search_lower(s);
    const double along = -shcd_dot(normal, s->best.r);
    const double guess = along < 0.0 ? -1.0 : 1.0;
    *is_sure = 1;
    if (is_outside_ball(s)) {
        return 1.0;
    }
    if (s->view->is_embedded && is_narrow(s) && lower > 0.0 &&
        fabs(along) > 0.9 * s->best.distance) {
        return guess;
    }
    if (s->last_sign != 0 && lower > s->moved_m) {
        return s->last_sign;
    }
    if (s->is_exact && lower > 0.0) {
        int side = side_by_winding(s, s);
        side = side != 0 ? side : side_from_afar(s);
        if (side != 0) {
            return side;
        }
    }
    *is_sure = 0;
    return guess;
}

int shcdi_search_needs_finer(const shcdi_search *s) {
    return s->is_exact && !s->truncated && s->view->is_embedded && !is_narrow(s) &&
           !is_outside_ball(s);
}
