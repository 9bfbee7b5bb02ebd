/* SPDX-License-Identifier: BSD-3-Clause */
/* A pair of bodies one of which is a ball, up to a share of the tolerance: one query of the other
 * body at its centre.
 *
 * Its surface lies within r = h_0 + error of its centre c (model/ellipsoid.h). Where c is proven to
 * be outside of the other body, by D > r, the ball of radius r about c does not meet the other
 * surface, so it lies outside as a whole, and nothing of the other body is in it: the bodies are
 * apart, by D - r or more. The pair of points is the other's foot, and the point of the ball
 * nearest to it. Everything else (overlap, a body around the other) is left to the search. */
#include "query/ellipsoid.h"
#include "query/pair.h"

/* of the tolerance: what the half axes may differ by */
#define ROUND_SHARE 0.25
/* where the distance of the centre is clear it takes a few */
#define CENTRE_EVALUATIONS 1000u

static const shcdi_ellipsoid *ball_of(const shcdi_pair_body *body, double allowed) {
    const shcdi_ellipsoid *e = shcdi_ellipsoid_of(body->model, body->shape);
    const int is_ball =
        e != NULL && e->half_m[0] - e->half_m[2] + 2.0 * e->error_m <= ROUND_SHARE * allowed;
    return is_ball ? e : NULL;
}

shcd_status shcdi_pair_ball(shcdi_pair_search *s, double allowed, double *lower) {
    *lower = 0.0;
    int which = 0;
    const shcdi_ellipsoid *e = ball_of(&s->body[0], allowed);
    if (e == NULL) {
        which = 1;
        e = ball_of(&s->body[1], allowed);
    }
    if (e == NULL) {
        return SHCD_OK;
    }
    const shcd_pose pose = s->body[which].pose;
    const shcd_vec3 centre = shcd_transform(pose, e->centre_m);
    const double radius = e->half_m[0] + e->error_m;
    shcd_proximity got;
    /* from the middle of a round body everything is equally near: that must not cost the search its
     * budget */
    const uint32_t all = s->evaluations_max;
    s->evaluations_max =
        all > s->n_evaluations + CENTRE_EVALUATIONS ? s->n_evaluations + CENTRE_EVALUATIONS : all;
    const shcd_status status = shcdi_pair_query(s, 1 - which, centre, SHCD_TIER_EXACT, &got);
    s->evaluations_max = all;
    if (status != SHCD_OK) {
        return status;
    }
    const double apart = got.lower_m - radius - s->slack;
    if (!(apart > 0.0) || (got.flags & SHCD_PROXIMITY_TRUNCATED) != 0) {
        return SHCD_OK;
    }
    const shcd_vec3 foot = shcd_transform_inverse(pose, got.point_m);
    shcdi_ellipsoid_foot on_ball;
    shcdi_ellipsoid_foot_at(e, foot, &on_ball);
    shcdi_pair_end_at(s, which, on_ball.parameter, &s->best[which]);
    shcdi_pair_end_at(s, 1 - which, got.parameter, &s->best[1 - which]);
    s->upper = shcd_norm(shcd_sub(s->best[1].jet.s, s->best[0].jet.s));
    *lower = shcdi_min(apart, s->upper);
    return SHCD_OK;
}
