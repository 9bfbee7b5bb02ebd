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
 *  4. it says that there is none, or one elsewhere, and the way from the last tick is longer than
 * both gaps: the tool may have gone through the body. A sweep tells, and the foot where it went in
 * is followed.
 *
 * The certified query carries a certificate from tick to tick (shcd_closest_next()), which is void
 * or valid, never wrong: what a proxy does in between does not matter to it.
 *
 * A ball outside touches up to three walls: contact_sides.c, walls.c. */
#include "response/accuracy.h"
#include "response/proxy.h"

#include "shcd/sweep.h"

/* Caps of the sweep of rule 4, which is rare: a way through a plate takes up to six steps, and 125
 * evaluations if it is not along a normal. */
#define SWEEP_STEPS_MAX 64u
#define SWEEP_EVALUATIONS_MAX 400u

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

double shcdi_contact_lower_bound(const shcdi_body *body, const shcd_shape *shape,
                                 const shcdi_tool *tool, const shcdi_contact *contact,
                                 const shcd_pose *ball) {
    const shcd_vec3 p = ball->position_m;
    const shcd_vec3 c = body->ball_centre_m;
    const double radius = body->ball_radius_m + (shape != NULL ? shape->displacement[0] : 0.0);
    const double size = shcd_norm(p) + shcd_norm(c) + radius + tool->ball_radius_m;
    const double apart = shcd_norm(shcd_sub(p, c)) - radius - DISTANCE_ROUNDING * size;
    double last;
    if (!contact->is_known) {
        return apart - tool->ball_radius_m;
    }
    /* signed distance changes at most as fast as the farthest point and the surface move */
    last = contact->lower_m - shcdi_motion_bound(tool, &contact->ball, ball) -
           (shcdi_surface_way(shape) - contact->surface_way_m);
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
    contact->last_m = p;
    contact->apart_m = shcdi_max(out->gap_m, 0.0);
    contact->surface_way_m = shcdi_surface_way(out->shape);
    contact->is_known = 1;
    contact->is_touching = out->gap_m < 0.0;
}

/* Whether a ball that was outside, and is again, went through the body in between: a straight way
 * that touches it is at least as long as both gaps together. If so, `entered` is the proxy where it
 * went in. A surface that moves by itself is taken where it is now. */
static bool has_gone_through(const shcdi_body *body, const shcdi_tool *tool,
                             const shcdi_contact *contact, shcd_vec3 p, double gap_m,
                             shcdi_proxy *entered, shcdi_gap *out) {
    const double way = shcd_norm(shcd_sub(p, contact->last_m));
    shcd_sweep_def motion = SHCD_SWEEP_DEF_INIT;
    shcd_sweep_result found;
    if (!contact->is_known || contact->is_touching || !(way > contact->apart_m + gap_m)) {
        return false;
    }
    motion.radius_m = tool->radius_m;
    motion.from.position_m = contact->last_m;
    motion.from.orientation.w = 1.0;
    motion.to.position_m = p;
    motion.to.orientation.w = 1.0;
    motion.shape = out->shape;
    motion.steps_max = SWEEP_STEPS_MAX;
    motion.evaluations_max = SWEEP_EVALUATIONS_MAX;
    if (shcd_sweep(body->model, &motion, NULL, 0, &found) != SHCD_OK) {
        return false;
    }
    out->n_evaluations += found.n_evaluations;
    out->n_patches += found.n_patches;
    entered->tool_m = found.tool_in_body.position_m;
    entered->foot_m = found.point_m;
    entered->normal = found.normal;
    entered->parameter = found.parameter;
    /* a start that cannot be told from contact is one: the tool was on the surface */
    return found.outcome == SHCD_SWEEP_CONTACT || found.outcome == SHCD_SWEEP_OVERLAP_AT_START;
}

void shcdi_contact_update(const shcdi_body *body, const shcdi_tool *tool, const shcd_pose *ball,
                          double dt_s, shcdi_contact *contact, shcdi_gap *out) {
    const shcd_vec3 p = ball->position_m;
    const shcdi_pursuit u = shcdi_pursue(
        body, &contact->proxy, p, shcdi_surface_way(out->shape) - contact->surface_way_m, dt_s);
    shcdi_proxy entered;
    shcd_proximity followed;
    shcd_proximity closest;
    shcdi_gap_begin(out);
    if (shcdi_has_jumped(shcd_norm(shcd_sub(p, contact->proxy.tool_m)), dt_s, &contact->still_s)) {
        const shcd_vec3 none = {0.0, 0.0, 0.0};
        contact->is_known = 0;
        contact->is_touching = 0;
        contact->held_n = none; /* no hand moved it there */
        contact->held_at_m = p;
        shcdi_sides_release(contact);
    }
    if (contact->is_touching && shcdi_keep_proxy(&u, &followed, out)) {
        settle(tool->radius_m, ball, &followed, -HUGE_VAL, contact, out);
        shcdi_sides_update(body, tool, &u, dt_s, contact, out);
        return;
    }
    if (shcdi_ask(body, tool, p, contact, &closest, out) != SHCD_OK) {
        /* cannot happen for a finite point; if it does, the bound is all that is known */
        contact->is_known = 0;
        contact->is_touching = 0;
        shcdi_sides_release(contact);
        out->gap_m =
            shcdi_max(shcdi_contact_lower_bound(body, out->shape, tool, contact, ball), 0.0);
        out->flags = SHCD_TOOL_OUTPUT_TRUNCATED;
        return;
    }
    closest.distance_m = shcdi_sure_distance(body, closest.flags, closest.distance_m);
    if (contact->is_known && !contact->is_touching && closest.distance_m < 0.0 &&
        !shcdi_is_continued_by(&u, closest.point_m, closest.normal) &&
        shcdi_follow(&u, &followed, out) && followed.distance_m < 0.0) {
        settle(tool->radius_m, ball, &followed, -HUGE_VAL, contact, out);
        shcdi_sides_update(body, tool, &u, dt_s, contact, out);
        return;
    }
    const double gap_m = closest.distance_m - tool->radius_m;
    const bool is_elsewhere =
        gap_m >= 0.0 || !shcdi_is_continued_by(&u, closest.point_m, closest.normal);
    if (is_elsewhere &&
        has_gone_through(body, tool, contact, p, shcdi_max(gap_m, 0.0), &entered, out)) {
        const shcdi_pursuit in = shcdi_pursue(body, &entered, p, 0.0, dt_s);
        if (shcdi_follow(&in, &followed, out) && followed.distance_m < tool->radius_m) {
            settle(tool->radius_m, ball, &followed, -HUGE_VAL, contact, out);
            shcdi_sides_update(body, tool, &u, dt_s, contact, out);
            return;
        }
    }
    settle(tool->radius_m, ball, &closest, closest.lower_m, contact, out);
    shcdi_sides_update(body, tool, &u, dt_s, contact, out);
}
