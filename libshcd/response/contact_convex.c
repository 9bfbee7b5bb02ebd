/* SPDX-License-Identifier: BSD-3-Clause */
/* The contact of a capsule, box or hull with one body: the rules of contact.c, with the *core
 * point* in the place of a sphere's centre.
 *
 * A convex tool is a core with a ball of radius r around each of its points. shcd_tool_closest()
 * finds the gap, min over the core of the signed distance less r, with the tool point q where it is
 * attained and the body's normal n at its foot; c = q + r n is the core point there. While the core
 * is outside, that is certified, and the contact is the deepest wherever it is.
 *
 * Once the core is in, per tick:
 *  1. the last core point, fixed in the tool, is followed from its old foot (proxy.c). If it is
 *     behind its proxy, it slides along the core to where it is deepest near there (sink.c).
 *  2. the query, with a small cap, looks for a deeper point elsewhere. What it finds, sunk as far
 * as that is the true depth and not that of a side behind the medial axis, is taken where it lies
 * along the tool and not through the body: where its normal is within 26 degrees of the proxy's
 * (another corner on the same side), or it lies in front of the proxy's tangent plane (another
 * wall).
 *  3. is there no proxy any more, the query decides, as it does when the core goes in; then, as for
 *     a sphere, a foot that continues the last one is the side on which the tool came.
 *
 * Guaranteed: separated, the gap lies in the query's proven interval, and no force acts. Within the
 * core's depth the contact is a local minimum of the proxy's signed distance: continuous where that
 * moves continuously. Not guaranteed: that it is the deepest of all, nor continuity where it jumps
 * along the tool to a deeper one: the force is continuous in size if the jump comes as soon as the
 * other point is deeper, its direction changes by less than 26 degrees on one side and by more onto
 * another wall, its torque by the lever. A tool outside at both ends of a tick has no contact. */
#include "response/accuracy.h"
#include "response/sink.h"

#include <string.h>

/* Caps of the query that looks for a deeper point than the one in contact: about one descent. */
#define LOOK_EVALUATIONS 32u
#define LOOK_PATCHES 1024u

/* A contact gives way to another point only if that is deeper by this share of the diagonal, so
 * that two equally deep ones do not alternate. */
#define DEEPER 1e-6

static shcdi_answer read_answer(const shcdi_body *body, const shcdi_tool *tool,
                                const shcd_tool_proximity *found) {
    shcdi_answer a;
    memset(&a, 0, sizeof a);
    a.foot.distance_m = shcdi_sure_distance(body, found->flags, found->gap_m + tool->radius_m);
    a.foot.point_m = found->point_m;
    a.foot.normal = found->normal;
    a.foot.parameter = found->parameter;
    a.foot.normal = shcdi_normal_at(&a.foot, found->tool_point_m);
    a.core_m = shcd_mul_add(found->tool_point_m, tool->radius_m, a.foot.normal);
    return a;
}

static void settle(const shcdi_tool *tool, shcd_pose tool_in_body, const shcdi_answer *a,
                   double lower_m, shcdi_contact *contact, shcdi_gap *out) {
    out->gap_m = a->foot.distance_m - tool->radius_m;
    out->foot_m = a->foot.point_m;
    out->normal = shcdi_normal_at(&a->foot, a->core_m);
    out->tool_point_m = shcd_mul_add(a->core_m, -tool->radius_m, out->normal);
    contact->proxy.tool_m = a->core_m;
    contact->proxy.foot_m = a->foot.point_m;
    contact->proxy.normal = out->normal;
    contact->proxy.parameter = a->foot.parameter;
    contact->ball = shcdi_ball_pose(tool, tool_in_body);
    contact->core_m = shcd_transform_inverse(tool_in_body, a->core_m);
    contact->lower_m = lower_m + tool->ball_radius_m;
    contact->surface_way_m = shcdi_surface_way(out->shape);
    contact->is_known = 1;
    contact->is_touching = out->gap_m < 0.0;
    contact->is_behind = a->foot.distance_m < 0.0;
}

/* A convex tool during a tick. */
typedef struct sight {
    const shcdi_body *body;
    const shcdi_tool *tool;
    shcd_pose pose;
    double dt_s;
    const shcdi_contact *last;
    shcdi_gap *out;
} sight;

static double surface_motion(const sight *s) {
    return shcdi_surface_way(s->out->shape) - s->last->surface_way_m;
}

/* Sinks what a query found. The foot only follows, so that past the medial axis the result would
 * belong to a side on which the tool is not: it has to be the true signed distance there. */
static void sink_found(const sight *s, shcdi_answer *a) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcdi_answer deeper = *a;
    shcd_proximity exact;
    shcdi_sink(s->body, s->tool, s->pose, NULL, &deeper, s->out);
    if (!(deeper.foot.distance_m < a->foot.distance_m)) {
        return;
    }
    shcdi_set_caps(s->body, s->tool, &options);
    shcdi_limit(&s->body->accuracy, s->out->allowance_ns, &options);
    if (shcdi_closest_now(s->body, s->out->shape, deeper.core_m, &options, &exact) == SHCD_OK) {
        shcdi_count(s->out, &exact);
        if (fabs(exact.distance_m - deeper.foot.distance_m) <= DEEPER * s->body->diagonal_m) {
            *a = deeper;
        }
    }
}

/* @return whether the query gave an answer; one inside is sunk */
static bool look(const sight *s, const shcd_query_options *options, shcdi_answer *a,
                 shcd_tool_proximity *found) {
    if (shcd_tool_closest(s->body->model, s->out->shape, s->tool->geometry, s->pose, options,
                          found) != SHCD_OK) {
        return false;
    }
    s->out->n_evaluations += found->n_evaluations;
    s->out->n_patches += found->n_patches;
    *a = read_answer(s->body, s->tool, found);
    /* where the surface cuts the core, a capped query may know no more than a point of both */
    if (a->foot.distance_m < 0.0 || (found->lower_m + s->tool->radius_m < 0.0 &&
                                     a->foot.distance_m <= DEEPER * s->body->diagonal_m)) {
        sink_found(s, a);
    }
    return true;
}

/* Follows the last core point. @return whether it is behind its proxy */
static bool keep(const sight *s, shcdi_answer *kept) {
    kept->core_m = shcd_transform(s->pose, s->last->core_m);
    const shcdi_pursuit u =
        shcdi_pursue(s->body, &s->last->proxy, kept->core_m, surface_motion(s), s->dt_s);
    return shcdi_keep_proxy(&u, &kept->foot, s->out);
}

/* Whether a deeper point has been reached along the tool. */
static bool is_along(const sight *s, const shcdi_answer *a, const shcdi_answer *kept) {
    const shcd_vec3 from = shcd_sub(a->core_m, kept->foot.point_m);
    return a->foot.distance_m < kept->foot.distance_m - DEEPER * s->body->diagonal_m &&
           (shcd_dot(a->foot.normal, kept->foot.normal) >= SHCDI_TURN_COSINE ||
            shcd_dot(from, kept->foot.normal) >= 0.0);
}

/* Rules 1 and 2. */
static bool stay(const sight *s, shcdi_answer *kept) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_tool_proximity found;
    shcdi_answer other;
    if (!keep(s, kept)) {
        return false;
    }
    shcdi_sink(s->body, s->tool, s->pose, &s->last->proxy.normal, kept, s->out);
    options.tier = SHCD_TIER_FAST;
    options.evaluations_max = LOOK_EVALUATIONS;
    options.patches_max = LOOK_PATCHES;
    shcdi_limit(&s->body->accuracy, s->out->allowance_ns, &options);
    if (look(s, &options, &other, &found) && is_along(s, &other, kept)) {
        *kept = other;
    }
    return true;
}

/* Rule 3, for a core that has just gone in: whether it came from where its foot was. */
static bool came_from(const sight *s, const shcdi_answer *a, shcdi_answer *kept) {
    const shcdi_pursuit u =
        shcdi_pursue(s->body, &s->last->proxy, a->core_m, surface_motion(s), s->dt_s);
    if (!s->last->is_known || s->last->is_behind || a->foot.distance_m >= 0.0 ||
        shcdi_is_continued_by(&u, a->foot.point_m, a->foot.normal)) {
        return false;
    }
    kept->core_m = shcd_transform(s->pose, s->last->core_m);
    const shcdi_pursuit old =
        shcdi_pursue(s->body, &s->last->proxy, kept->core_m, surface_motion(s), s->dt_s);
    return shcdi_follow(&old, &kept->foot, s->out) && kept->foot.distance_m < 0.0 &&
           !is_along(s, a, kept);
}

void shcdi_convex_update(const shcdi_body *body, const shcdi_tool *tool, shcd_pose tool_in_body,
                         double dt_s, shcdi_contact *contact, shcdi_gap *out) {
    const shcd_pose ball = shcdi_ball_pose(tool, tool_in_body);
    const sight s = {body, tool, tool_in_body, dt_s, contact, out};
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_tool_proximity found;
    shcdi_answer a, kept;
    shcdi_gap_begin(out);
    if (shcdi_has_jumped(shcd_norm(shcd_sub(ball.position_m, contact->ball.position_m)), dt_s,
                         &contact->still_s)) {
        contact->is_known = 0;
        contact->is_touching = 0;
        contact->is_behind = 0;
    }
    if (contact->is_behind && stay(&s, &kept)) {
        settle(tool, tool_in_body, &kept, -HUGE_VAL, contact, out);
        return;
    }
    /* track and map know nothing of convex tools: the fast tier stands in for them */
    const int tier = shcdi_plan(body, tool, false, out, &options) == SHCD_TIER_EXACT
                         ? SHCD_TIER_EXACT
                         : SHCD_TIER_FAST;
    options.tier = tier;
    if (!look(&s, &options, &a, &found)) {
        /* cannot happen for a finite pose; if it does, the bound is all that is known */
        contact->is_known = 0;
        contact->is_touching = 0;
        contact->is_behind = 0;
        out->gap_m =
            shcdi_max(shcdi_contact_lower_bound(body, out->shape, tool, contact, &ball), 0.0);
        out->flags = SHCD_TOOL_OUTPUT_TRUNCATED;
        return;
    }
    if (came_from(&s, &a, &kept)) {
        settle(tool, tool_in_body, &kept, -HUGE_VAL, contact, out);
        return;
    }
    out->flags |= shcdi_output_flags(found.flags);
    shcdi_answered_by(&body->accuracy, tier, out);
    settle(tool, tool_in_body, &a, found.lower_m, contact, out);
}
