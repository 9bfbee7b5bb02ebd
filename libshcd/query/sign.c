/* SPDX-License-Identifier: BSD-3-Clause */
/* Inside or outside.
 *
 * At a regular global foot of an embedded surface p - S is parallel to the normal, and its
 * direction decides. Where it is not parallel (a singular point), the surface may cut itself, or
 * the foot may not be the global one, the leaf tessellation's winding number decides if p is
 * farther from S than the tessellation is. Otherwise the foot's side is a guess, and said to be
 * one. */
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

double shcdi_search_sign(shcdi_search *s, shcd_vec3 normal, int *is_sure) {
    const double lower = shcdi_search_lower(s);
    const double along = -shcd_dot(normal, s->best.r);
    const double guess = along < 0.0 ? -1.0 : 1.0;
    const uint32_t n_blocks = (uint32_t)shcdi_view_block_count(s->view);
    *is_sure = 1;
    if (is_outside_ball(s)) {
        return 1.0;
    }
    if (s->view->is_embedded && is_narrow(s) && lower > 0.0 &&
        fabs(along) > 0.9 * s->best.distance) {
        return guess;
    }
    if (s->known_sign != 0) {
        return s->known_sign;
    }
    if (s->is_exact && lower > shcdi_tessellation_error(s->view) &&
        s->n_patches + n_blocks <= s->patches_max) {
        s->n_patches += n_blocks;
        return shcdi_winding(s->view, s->p) > 0 ? -1.0 : 1.0;
    }
    *is_sure = 0;
    return guess;
}

int shcdi_search_needs_finer(const shcdi_search *s) {
    return s->is_exact && !s->truncated && s->view->is_embedded && !is_narrow(s) &&
           !is_outside_ball(s);
}
