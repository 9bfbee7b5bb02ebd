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
 *  1. in contact: follow the proxy with Newton. If p is behind it, (p - S).n < 0, that is the
 *     contact, however deep, even when p has left the body through the far side: it has to come
 *     back the way it went in.
 *  2. else (outside, just separated, or only the rim of a sphere in contact): the certified closest
 *     point. For a sphere whose centre is outside this is the deepest contact wherever it is, so
 *     that a groove's other wall is felt.
 *  3. it says contact, but its foot does not continue the last one: a fast tool was just outside
 *     and is now past the medial axis. If following the last foot succeeds, that is the entry side.
 *
 * What continues. With s = (p - S).n and k a principal curvature (positive where convex),
 * differentiating (p - S).S_w = 0 gives (1 + s k) dS = dp tangentially. As long as 1 + s k >= 1/2,
 * which inside means: up to half of the way to the focal point, the foot moves at most twice as far
 * as the tool. A foot that moves farther than that and a bounded slip, or that faces another way,
 * has jumped to another minimum, because the last one ended: p passed a focal point of the surface
 * (on a sphere the centre). A frictionless proxy then slides downhill, and fast, to the next
 * minimum; here with a bound on its speed and turn, so that the force turns instead of jumping. One
 * step of the slide is the foot of a point q between S and p: shallow enough, q has a foot near S,
 * displaced towards p. While sliding, the depth is still r - (p - S).n.
 *
 * Limits: a tool that is outside at both ends of a tick has no contact, whatever it went through in
 * between; a body has one contact per tool. */
#include "response/scene_private.h"

#include "shcd/query.h"

/* Feet agree to Newton's stationarity, far better than this share of the diagonal; the finest
 * detail of a surface, a wavelength of the highest degree, is four orders larger. */
#define FOOT_TOLERANCE 1e-6

/* Speed [m/s] at which a proxy that has lost its minimum slides on, beyond twice the tool's own:
 * as fast as a hand, but 0.5 mm in a tick of 1 ms, a tenth of the radius of an organ's ridges. */
#define SLIP_SPEED 0.5

/* Cosine of the largest turn of the normal in a tick: 26 degrees, or a change of the force by 0.45
 * of itself. It slows a slide over a sharp ridge down. */
#define TURN_COSINE 0.9

/* Speed [m/s] beyond which a motion is not a hand's but a jump (a client that starts again
 * elsewhere, a device that was reset): nothing is continued, the certified closest point decides
 * anew. Hands reach about 5 m/s. A client may be slower than the tick, or stall: the time is
 * counted from the last tick in which the tool moved, up to STILL_MAX_S, after which a daemon lets
 * go anyway. */
#define JUMP_SPEED 10.0
#define STILL_MAX_S 0.05

/* Shares of the way from the proxy to the tool that are tried for one step of a slide. */
static const double slide_shares[] = {0.5, 0.125, 0.03125, 0.0078125};
#define N_SHARES (sizeof slide_shares / sizeof slide_shares[0])

/* Caps of one query in a tick, so that a tick's time has a bound. Inside an uneven body of degree
 * 15 half of the queries need 300 bounds and 30 evaluations; an evaluation takes about 1 us there
 * and grows with the number of harmonics, so that its cap falls with it; a bound takes 10 to 30 ns.
 * On top comes room for one pass over all leaves, by which the winding number tells the side of a
 * point whose closest point is not settled. At a cap (near the centre of a nearly round body, for a
 * tool that was not followed there) the answer is flagged and its interval is still true. */
#define TICK_PATCHES_MAX 4096u
#define TICK_EVALUATIONS_MAX 400u
#define TICK_EVALUATIONS_MIN 24u
#define TICK_EVALUATIONS_HARMONICS 256u /* (15 + 1)^2 */

/* Rounding of a distance computed from coordinates of size a: a few units in the last place. */
#define DISTANCE_ROUNDING (16.0 * 0x1p-53)

double shcdi_contact_lower_bound(const shcdi_body *body, const shcdi_contact *contact,
                                 shcd_vec3 p) {
    const shcd_vec3 c = body->ball_centre_m;
    const double size = shcd_norm(p) + shcd_norm(c) + body->ball_radius_m;
    const double ball = shcd_norm(shcd_sub(p, c)) - body->ball_radius_m - DISTANCE_ROUNDING * size;
    double last;
    if (!contact->is_known) {
        return ball;
    }
    /* signed distance changes at most as fast as the point moves */
    last = contact->lower_m - shcd_norm(shcd_sub(p, contact->tool_m)) -
           DISTANCE_ROUNDING * (shcd_norm(p) + shcd_norm(contact->tool_m));
    return shcdi_max(ball, last);
}

/* What one update works on. */
typedef struct update {
    const shcdi_body *body;
    const shcdi_contact *last;
    shcd_vec3 p;
    double reach_m; /* how far a foot that continues the last one may be from it */
} update;

/* Whether a foot continues the last one, or has jumped. */
static bool is_continued_by(const update *u, const shcd_proximity *found) {
    return shcd_norm(shcd_sub(found->point_m, u->last->foot_m)) <= u->reach_m &&
           shcd_dot(u->last->normal, found->normal) >= TURN_COSINE;
}

static void count(shcdi_gap *out, const shcd_proximity *found) {
    out->n_evaluations += found->n_evaluations;
    out->n_patches += found->n_patches;
}

/* Follows the last foot to that of a target. @return whether it was found and continues. */
static bool follow(const update *u, shcd_vec3 target, shcd_proximity *found, shcdi_gap *out) {
    if (shcd_track(u->body->model, target, u->last->parameter, found) != SHCD_OK) {
        return false;
    }
    count(out, found);
    return (found->flags & SHCD_PROXIMITY_NOT_STATIONARY) == 0 && is_continued_by(u, found);
}

/* Rule 1. @return whether there is a proxy and p is behind it. */
static bool keep_proxy(const update *u, shcd_proximity *found, shcdi_gap *out) {
    const shcd_vec3 way = shcd_sub(u->p, u->last->foot_m);
    if (follow(u, u->p, found, out)) {
        return found->distance_m < 0.0;
    }
    for (size_t i = 0; i < N_SHARES && shcd_dot(way, u->last->normal) < 0.0; i++) {
        if (follow(u, shcd_mul_add(u->last->foot_m, slide_shares[i], way), found, out)) {
            found->distance_m = shcd_dot(shcd_sub(u->p, found->point_m), found->normal);
            return found->distance_m < 0.0;
        }
    }
    return false;
}

/* Where the surface is singular it has no normal; the direction to the foot serves. */
static shcd_vec3 normal_at(const shcd_proximity *found, shcd_vec3 p) {
    const shcd_vec3 away = shcd_unit(shcd_sub(p, found->point_m));
    if (shcd_dot(found->normal, found->normal) > 0.0) {
        return found->normal;
    }
    return found->distance_m < 0.0 ? shcd_scale(-1.0, away) : away;
}

static void settle(double radius_m, shcd_vec3 p, const shcd_proximity *found, double lower_m,
                   shcdi_contact *contact, shcdi_gap *out) {
    out->gap_m = found->distance_m - radius_m;
    out->foot_m = found->point_m;
    out->normal = normal_at(found, p);
    contact->tool_m = p;
    contact->foot_m = found->point_m;
    contact->normal = out->normal;
    contact->parameter = found->parameter;
    contact->lower_m = lower_m;
    contact->is_known = 1;
    contact->is_touching = out->gap_m < 0.0;
}

static uint32_t tool_flags(uint32_t proximity_flags) {
    uint32_t flags = 0;
    if ((proximity_flags & SHCD_PROXIMITY_TRUNCATED) != 0) {
        flags |= SHCD_TOOL_OUTPUT_TRUNCATED;
    }
    if ((proximity_flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0) {
        flags |= SHCD_TOOL_OUTPUT_SIGN_UNSURE;
    }
    return flags;
}

static uint32_t evaluations_max(const shcdi_body *body) {
    const uint32_t n = TICK_EVALUATIONS_MAX * TICK_EVALUATIONS_HARMONICS / body->n_harmonics;
    return n > TICK_EVALUATIONS_MAX   ? TICK_EVALUATIONS_MAX
           : n < TICK_EVALUATIONS_MIN ? TICK_EVALUATIONS_MIN
                                      : n;
}

void shcdi_contact_update(const shcdi_body *body, double radius_m, shcd_vec3 p, double dt_s,
                          shcdi_contact *contact, shcdi_gap *out) {
    const shcdi_gap nothing = {0};
    const double motion = shcd_norm(shcd_sub(p, contact->tool_m));
    const update u = {body, contact, p,
                      2.0 * motion + SLIP_SPEED * dt_s + FOOT_TOLERANCE * body->diagonal_m};
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity followed;
    shcd_proximity closest;
    *out = nothing;
    if (motion > JUMP_SPEED * (contact->still_s + dt_s)) {
        contact->is_known = 0;
        contact->is_touching = 0;
    }
    contact->still_s = motion > 0.0 ? 0.0 : shcdi_min(contact->still_s + dt_s, STILL_MAX_S);
    if (contact->is_touching && keep_proxy(&u, &followed, out)) {
        settle(radius_m, p, &followed, -HUGE_VAL, contact, out);
        return;
    }
    options.patches_max = TICK_PATCHES_MAX + body->n_leaves;
    options.evaluations_max = evaluations_max(body);
    if (shcd_closest(body->model, p, &options, &closest) != SHCD_OK) {
        /* cannot happen for a finite point; if it does, the bound is all that is known */
        contact->is_known = 0;
        contact->is_touching = 0;
        out->gap_m = shcdi_contact_lower_bound(body, contact, p) - radius_m;
        out->gap_m = shcdi_max(out->gap_m, 0.0);
        out->flags = SHCD_TOOL_OUTPUT_TRUNCATED;
        return;
    }
    count(out, &closest);
    out->flags = tool_flags(closest.flags);
    if ((closest.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0 &&
        fabs(closest.distance_m) > body->deviation_m) {
        /* No force on a guess; but nearer to the surface than its leaves, where the winding number
         * cannot tell, the side seen at the nearest foot known stands: a wrong one is worth a force
         * of stiffness times that small distance only, and a contact has to begin somewhere. */
        closest.distance_m = fabs(closest.distance_m);
    }
    if (contact->is_known && !contact->is_touching && closest.distance_m < 0.0 &&
        !is_continued_by(&u, &closest) && follow(&u, p, &followed, out) &&
        followed.distance_m < 0.0) {
        settle(radius_m, p, &followed, -HUGE_VAL, contact, out);
        return;
    }
    settle(radius_m, p, &closest, closest.lower_m, contact, out);
}
