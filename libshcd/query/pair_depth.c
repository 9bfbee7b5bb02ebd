/* SPDX-License-Identifier: BSD-3-Clause */
/* How deep two overlapping bodies are in each other.
 *
 * The deepest point of one surface inside the other body is the least signed distance over that
 * surface. Its gradient in space is the other body's normal n at the closest point, so along the
 * surface it is S'.n; steps follow it with the length of Barzilai and Borwein (Two-point step size
 * gradient methods, IMA J. Numer. Anal. 8, 1988), halved until the point is deeper. Starts are the
 * best pair and the deepest of a sample of each surface: a local method, and said to be one. What
 * is proven is each point's own depth.
 */
#include "query/pair.h"

#define SAMPLES_MAX 64
#define STEPS_MAX 24
#define HALVINGS_MAX 8

typedef struct dive {
    int which; /* the surface that is inside the other body */
    shcd_vec3 w;
    shcdi_pair_end end;
    shcd_proximity got;
} dive;

shcd_status shcdi_pair_query(shcdi_pair_search *s, int which, shcd_vec3 p, int tier,
                             shcd_proximity *got) {
    const shcdi_pair_body *body = &s->body[which];
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    options.tier = tier;
    const uint32_t used = s->n_evaluations;
    options.evaluations_max = used < s->evaluations_max ? s->evaluations_max - used : 1;
    const shcd_status status = shcd_shape_closest(
        body->model, body->shape, shcd_transform_inverse(body->pose, p), &options, got);
    if (status != SHCD_OK) {
        return status;
    }
    s->n_evaluations += got->n_evaluations;
    s->n_patches += got->n_patches;
    s->n_newton += got->n_newton;
    got->point_m = shcd_transform(body->pose, got->point_m);
    got->normal = shcd_rotate(body->pose.orientation, got->normal);
    return SHCD_OK;
}

static shcd_status dive_at(shcdi_pair_search *s, int which, shcd_vec3 w, int tier, dive *d) {
    d->which = which;
    d->w = w;
    shcdi_pair_end_at(s, which, w, &d->end);
    return shcdi_pair_query(s, 1 - which, d->end.jet.s, tier, &d->got);
}

/* Gradient of the signed distance along the surface, in the parameter's tangent plane. */
static shcd_vec3 gradient(const dive *d) {
    const shcdi_jet *j = &d->end.jet;
    const shcd_vec3 n = d->got.normal;
    return shcd_mul_add(shcd_scale(shcd_dot(j->s1, n), j->t1), shcd_dot(j->s2, n), j->t2);
}

static shcd_status descend(shcdi_pair_search *s, dive *d) {
    const shcdi_jet *j = &d->end.jet;
    const double size2 = shcd_dot(j->s1, j->s1) + shcd_dot(j->s2, j->s2);
    /* a first step as if the surface had its own size as radius of curvature */
    double rate = size2 > 0.0 ? 1.0 / sqrt(size2) : 0.0;
    for (int step = 0; step < STEPS_MAX; step++) {
        const shcd_vec3 g = gradient(d);
        const double length = shcd_norm(g);
        double t = rate * length > 0.3 ? 0.3 / length : rate;
        int deeper = 0;
        dive next = *d;
        for (int i = 0; i < HALVINGS_MAX && !deeper; i++) {
            if (!(t * length > 1e-12) || s->n_evaluations >= s->evaluations_max) {
                return SHCD_OK;
            }
            const shcd_vec3 w = shcd_unit(shcd_mul_add(d->w, -t, g));
            const shcd_status status = dive_at(s, d->which, w, SHCD_TIER_EXACT, &next);
            if (status != SHCD_OK) {
                return status;
            }
            deeper = next.got.distance_m < d->got.distance_m;
            t *= 0.5;
        }
        if (!deeper) {
            return SHCD_OK;
        }
        const shcd_vec3 dw = shcd_sub(next.w, d->w), dg = shcd_sub(gradient(&next), g);
        const double curvature = shcd_dot(dw, dg), fell = d->got.distance_m - next.got.distance_m;
        rate = curvature > 0.0 ? shcd_dot(dw, dw) / curvature : 2.0 * rate;
        *d = next;
        if (fell < 1e-3 * s->tolerance) {
            return SHCD_OK;
        }
    }
    return SHCD_OK;
}

/* The deepest of a sample of one surface; unchanged if it is not below `best`. */
static shcd_status sample(shcdi_pair_search *s, int which, dive *best) {
    const shcdi_pair_body *body = &s->body[which], *other = &s->body[1 - which];
    const size_t n = shcdi_view_block_count(&body->view);
    const size_t stride = (n + SAMPLES_MAX - 1) / SAMPLES_MAX;
    for (size_t block = 0; block < n; block += stride) {
        shcdi_view_leaf leaf;
        shcdi_view_leaf_at(&body->view, SHCDI_BLOCK_LEAVES * block, &leaf);
        const shcd_vec3 p = shcdi_pair_point(s, which, leaf.centre);
        if (shcd_norm(shcd_sub(p, other->centre)) >= other->view.radius_m ||
            shcdi_pair_exhausted(s)) {
            continue;
        }
        dive d;
        const shcd_status status = dive_at(s, which, leaf.centre, SHCD_TIER_FAST, &d);
        if (status != SHCD_OK) {
            return status;
        }
        if (d.got.distance_m < best->got.distance_m) {
            *best = d;
        }
    }
    return SHCD_OK;
}

shcd_status shcdi_pair_depth(shcdi_pair_search *s, double *deepest, int *which,
                             shcd_proximity *where, shcd_vec3 *w) {
    *deepest = HUGE_VAL;
    for (int of = 0; of < 2; of++) {
        dive d;
        shcd_status status = dive_at(s, of, s->best[of].w, SHCD_TIER_EXACT, &d);
        if (status == SHCD_OK) {
            status = sample(s, of, &d);
        }
        if (status == SHCD_OK) {
            status = descend(s, &d);
        }
        if (status != SHCD_OK) {
            return status;
        }
        if (d.got.upper_m < 0.0 && d.got.upper_m < *deepest) {
            *deepest = d.got.upper_m;
            *which = of;
            *where = d.got;
            *w = d.w;
        }
    }
    return SHCD_OK;
}
