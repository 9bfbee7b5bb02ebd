/* SPDX-License-Identifier: BSD-3-Clause */
/* The contact of one tool (a point, or a sphere about its centre p) with one body.
 *
 * Outside, the certified closest point decides: contact is d - r < 0. Inside it may not: past the
 * medial axis the closest point lies on the far side, and a spring to it would throw the tool out
 * there. So a tool whose centre has gone in keeps a *proxy*: a foot S that follows the last one, a
 * local minimum of |S - p|, and its depth is r - (p - S).n (the god-object of Zilles and Salisbury,
 * IROS 1995, on a smooth frictionless surface).
 *
 * Per tick, then:
 *  1. in contact: follow the proxy with Newton (proxy.c). If p is behind it, (p - S).n < 0, that is
 *     the contact, however deep, even when p has left the body through the far side: it has to come
 *     back the way it went in.
 *  2. else (outside, just separated, or only the rim of a sphere in contact): the certified closest
 *     point. For a sphere whose centre is outside this is the deepest contact wherever it is, so
 *     that a groove's other wall is felt.
 *  3. it says contact, but its foot does not continue the last one: a fast tool was just outside
 *     and is now past the medial axis. If following the last foot succeeds, that is the entry side.
 *
 * The certified query carries a certificate from tick to tick (shcd_closest_next()), which is void
 * or valid, never wrong: what a proxy does in between does not matter to it.
 *
 * Limits: a tool that is outside at both ends of a tick has no contact, whatever it went through in
 * between; a body has one contact per tool. */
#include "response/accuracy.h"
#include "response/proxy.h"

/* Rounding of a distance computed from coordinates of size a: a few units in the last place. */
#define DISTANCE_ROUNDING (16.0 * 0x1p-53)

/* |sin(angle/2)| between two unit quaternions: the vector part of conj(a) b. */
static double half_angle_sine(shcd_quat a, shcd_quat b) {
    const shcd_vec3 u = {a.x, a.y, a.z};
    const shcd_vec3 v = {b.x, b.y, b.z};
    return shcd_norm(shcd_sub(shcd_mul_add(shcd_scale(a.w, v), -b.w, u), shcd_cross(u, v)));
}

double shcdi_motion_bound(const shcdi_tool *tool, const shcd_pose *before, const shcd_pose *now) {
    /* |R x - R0 x| = 2 sin(angle/2) |x| at most, for x from the centre */
    const double centre = shcd_norm(shcd_sub(now->position_m, before->position_m));
    const double rounding =
        DISTANCE_ROUNDING * (shcd_norm(now->position_m) + shcd_norm(before->position_m));
    if (tool->geometry == NULL) {
        return centre + rounding; /* a point or sphere: turning moves nothing */
    }
    return centre + rounding +
           tool->ball_radius_m * (2.0 * half_angle_sine(before->orientation, now->orientation) +
                                  2.0 * DISTANCE_ROUNDING);
}

shcd_pose shcdi_ball_pose(const shcdi_tool *tool, shcd_pose tool_in_body) {
    shcd_pose ball = tool_in_body;
    if (tool->geometry != NULL) {
        ball.position_m = shcd_transform(tool_in_body, tool->ball_centre_m);
    }
    return ball;
}

double shcdi_contact_lower_bound(const shcdi_body *body, const shcdi_tool *tool,
                                 const shcdi_contact *contact, const shcd_pose *ball) {
    const shcd_vec3 p = ball->position_m;
    const shcd_vec3 c = body->ball_centre_m;
    const double size = shcd_norm(p) + shcd_norm(c) + body->ball_radius_m + tool->ball_radius_m;
    const double apart = shcd_norm(shcd_sub(p, c)) - body->ball_radius_m - DISTANCE_ROUNDING * size;
    double last;
    if (!contact->is_known) {
        return apart - tool->ball_radius_m;
    }
    /* signed distance changes at most as fast as the farthest point moves */
    last = contact->lower_m - shcdi_motion_bound(tool, &contact->ball, ball);
    return shcdi_max(apart, last) - tool->ball_radius_m;
}

static void settle(double radius_m, const shcd_pose *ball, const shcd_proximity *found,
                   double lower_m, shcdi_contact *contact, shcdi_gap *out) {
    const shcd_vec3 p = ball->position_m;
    out->gap_m = found->distance_m - radius_m;
    out->foot_m = found->point_m;
    out->normal = shcdi_normal_at(found, p);
    contact->proxy.tool_m = p;
    contact->proxy.foot_m = found->point_m;
    contact->proxy.normal = out->normal;
    contact->proxy.parameter = found->parameter;
    contact->ball = *ball;
    contact->lower_m = lower_m;
    contact->is_known = 1;
    contact->is_touching = out->gap_m < 0.0;
}

void shcdi_contact_update(const shcdi_body *body, const shcdi_tool *tool, const shcd_pose *ball,
                          double dt_s, shcdi_contact *contact, shcdi_gap *out) {
    const shcd_vec3 p = ball->position_m;
    const shcdi_pursuit u = shcdi_pursue(body, &contact->proxy, p, dt_s);
    shcd_proximity followed;
    shcd_proximity closest;
    shcdi_gap_begin(out);
    if (shcdi_has_jumped(shcd_norm(shcd_sub(p, contact->proxy.tool_m)), dt_s, &contact->still_s)) {
        contact->is_known = 0;
        contact->is_touching = 0;
    }
    if (contact->is_touching && shcdi_keep_proxy(&u, &followed, out)) {
        settle(tool->radius_m, ball, &followed, -HUGE_VAL, contact, out);
        return;
    }
    if (shcdi_ask(body, tool, p, contact, &closest, out) != SHCD_OK) {
        /* cannot happen for a finite point; if it does, the bound is all that is known */
        contact->is_known = 0;
        contact->is_touching = 0;
        out->gap_m = shcdi_max(shcdi_contact_lower_bound(body, tool, contact, ball), 0.0);
        out->flags = SHCD_TOOL_OUTPUT_TRUNCATED;
        return;
    }
    closest.distance_m = shcdi_sure_distance(body, closest.flags, closest.distance_m);
    if (contact->is_known && !contact->is_touching && closest.distance_m < 0.0 &&
        !shcdi_is_continued_by(&u, closest.point_m, closest.normal) &&
        shcdi_follow(&u, &followed, out) && followed.distance_m < 0.0) {
        settle(tool->radius_m, ball, &followed, -HUGE_VAL, contact, out);
        return;
    }
    settle(tool->radius_m, ball, &closest, closest.lower_m, contact, out);
}
