/* SPDX-License-Identifier: BSD-3-Clause */
/* The deepest point of a convex core K: a local minimum over K of the body's signed distance, by
 * projected gradient steps
 *
 *     c' = P(c - t n(c)),
 *
 * P the projection onto K, n the outward normal at the foot of c, which is the gradient of signed
 * distance. The step is that of Barzilai and Borwein (Two-Point Step Size Gradient Methods, IMA J.
 * Numer. Anal. 8(1), 1988), t = |dc|^2/(dc.dn), the body's radius of curvature along the last step;
 * it is taken back where the distance does not fall or the foot does not follow. Over a body that
 * is convex there, signed distance is convex, and the minimum that of all of K. A point that is off
 * by e along K is less deep by e^2/(2 radius of curvature) only. */
#include "response/sink.h"

#include "query/tool_core.h"

#define STEPS_MAX 10
/* Shares of the body's diagonal: the first step's radius of curvature, the largest, and the way
 * below which a step is not worth its foot. */
#define FIRST 0.25
#define LONGEST 10.0
#define STILL 1e-7
#define BACK 0.25

static shcd_vec3 project(const shcd_tool_geometry *tool, shcd_vec3 x) {
    shcdi_core_foot foot;
    shcdi_core_closest(tool, x, &foot);
    return foot.distance > 0.0 ? foot.point : x;
}

/* The foot of p near the last one. @return whether it is a step down */
static bool falls(const shcdi_body *body, shcd_vec3 p, const shcd_vec3 *normal,
                  const shcdi_answer *from, shcd_proximity *found, shcdi_gap *count) {
    if (shcdi_track_now(body, count->shape, p, from->foot.parameter, found) != SHCD_OK) {
        return false;
    }
    shcdi_count(count, found);
    return (found->flags & SHCD_PROXIMITY_NOT_STATIONARY) == 0 &&
           found->distance_m < from->foot.distance_m &&
           shcd_dot(found->normal, from->foot.normal) >= SHCDI_TURN_COSINE &&
           (normal == NULL || shcd_dot(found->normal, *normal) >= SHCDI_TURN_COSINE);
}

void shcdi_sink(const shcdi_body *body, const shcdi_tool *tool, shcd_pose tool_in_body,
                const shcd_vec3 *normal, shcdi_answer *a, shcdi_gap *count) {
    double t = FIRST * body->diagonal_m;
    shcd_vec3 c = shcd_transform_inverse(tool_in_body, a->core_m);
    for (int step = 0; step < STEPS_MAX; step++) {
        const shcd_vec3 down =
            shcd_rotate(shcd_conjugate(tool_in_body.orientation), a->foot.normal);
        const shcd_vec3 next = project(tool->geometry, shcd_mul_add(c, -t, down));
        const shcd_vec3 p = shcd_transform(tool_in_body, next);
        const shcd_vec3 way = shcd_sub(p, a->core_m);
        shcd_proximity found;
        if (!(shcd_norm(way) > STILL * body->diagonal_m)) {
            return;
        }
        if (!falls(body, p, normal, a, &found, count)) {
            t *= BACK;
            continue;
        }
        const double bend = shcd_dot(way, shcd_sub(found.normal, a->foot.normal));
        t = bend > 0.0 ? shcd_dot(way, way) / bend : 2.0 * t;
        t = shcdi_min(t, LONGEST * body->diagonal_m);
        c = next;
        a->core_m = p;
        a->foot = found;
    }
}
