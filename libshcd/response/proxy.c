/* SPDX-License-Identifier: BSD-3-Clause */
/* A proxy on the surface: how a foot follows a point of the tool from tick to tick, and when it
 * has jumped instead.
 *
 * What continues. With s = (p - S).n and k a principal curvature (positive where convex),
 * differentiating (p - S).S_w = 0 gives (1 + s k) dS = dp tangentially. As long as 1 + s k >= 1/2,
 * which inside means: up to half of the way to the focal point, the foot moves at most twice as far
 * as the tool point. A foot that moves farther than that and a bounded slip, or that faces another
 * way, has jumped to another minimum, because the last one ended: p passed a focal point of the
 * surface (on a sphere the centre). A frictionless proxy then slides downhill, and fast, to the
 * next minimum; here with a bound on its speed and turn, so that the force turns instead of
 * jumping. One step of the slide is the foot of a point q between S and p: shallow enough, q has a
 * foot near S, displaced towards p. While sliding, the depth is still r - (p - S).n. */
#include "response/proxy.h"

/* Feet agree to Newton's stationarity, far better than this share of the diagonal; the finest
 * detail of a surface, a wavelength of the highest degree, is four orders larger. */
#define FOOT_TOLERANCE 1e-6

/* Speed [m/s] at which a proxy that has lost its minimum slides on, beyond twice the tool's own:
 * as fast as a hand, but 0.5 mm in a tick of 1 ms, a tenth of the radius of an organ's ridges. */
#define SLIP_SPEED 0.5

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

shcd_status shcdi_closest_now(const shcdi_body *body, const shcd_shape *shape, shcd_vec3 p,
                              const shcd_query_options *options, shcd_proximity *found) {
    return shape == NULL ? shcd_closest(body->model, p, options, found)
                         : shcd_shape_closest(body->model, shape, p, options, found);
}

shcd_status shcdi_track_now(const shcdi_body *body, const shcd_shape *shape, shcd_vec3 p,
                            shcd_vec3 parameter, shcd_proximity *found) {
    return shape == NULL ? shcd_track(body->model, p, parameter, found)
                         : shcd_shape_track(body->model, shape, p, parameter, found);
}

shcdi_pursuit shcdi_pursue(const shcdi_body *body, const shcdi_proxy *last, shcd_vec3 p,
                           double surface_motion_m, double dt_s) {
    /* a surface that comes is a tool point that goes */
    const double motion = shcd_norm(shcd_sub(p, last->tool_m)) + surface_motion_m;
    const shcdi_pursuit u = {body, last, p, motion,
                             2.0 * motion + SLIP_SPEED * dt_s + FOOT_TOLERANCE * body->diagonal_m};
    return u;
}

bool shcdi_is_continued_by(const shcdi_pursuit *u, shcd_vec3 foot_m, shcd_vec3 normal) {
    return shcd_norm(shcd_sub(foot_m, u->last->foot_m)) <= u->reach_m &&
           shcd_dot(u->last->normal, normal) >= SHCDI_TURN_COSINE;
}

static bool follow_to(const shcdi_pursuit *u, shcd_vec3 target, shcd_proximity *found,
                      shcdi_gap *count) {
    if (shcdi_track_now(u->body, count->shape, target, u->last->parameter, found) != SHCD_OK) {
        return false;
    }
    shcdi_count(count, found);
    return (found->flags & SHCD_PROXIMITY_NOT_STATIONARY) == 0 &&
           shcdi_is_continued_by(u, found->point_m, found->normal);
}

bool shcdi_follow(const shcdi_pursuit *u, shcd_proximity *found, shcdi_gap *count) {
    return follow_to(u, u->p, found, count);
}

bool shcdi_keep_proxy(const shcdi_pursuit *u, shcd_proximity *found, shcdi_gap *count) {
    const shcd_vec3 way = shcd_sub(u->p, u->last->foot_m);
    if (follow_to(u, u->p, found, count)) {
        return found->distance_m < 0.0;
    }
    for (size_t i = 0; i < N_SHARES && shcd_dot(way, u->last->normal) < 0.0; i++) {
        if (follow_to(u, shcd_mul_add(u->last->foot_m, slide_shares[i], way), found, count)) {
            found->distance_m = shcd_dot(shcd_sub(u->p, found->point_m), found->normal);
            return found->distance_m < 0.0;
        }
    }
    return false;
}

bool shcdi_has_jumped(double motion_m, double dt_s, double *still_s) {
    const bool has_jumped = motion_m > JUMP_SPEED * (*still_s + dt_s);
    *still_s = motion_m > 0.0 ? 0.0 : shcdi_min(*still_s + dt_s, STILL_MAX_S);
    return has_jumped;
}

uint32_t shcdi_output_flags(uint32_t proximity_flags) {
    uint32_t flags = 0;
    if ((proximity_flags & SHCD_PROXIMITY_TRUNCATED) != 0) {
        flags |= SHCD_TOOL_OUTPUT_TRUNCATED;
    }
    if ((proximity_flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0) {
        flags |= SHCD_TOOL_OUTPUT_SIGN_UNSURE;
    }
    return flags;
}

shcd_vec3 shcdi_normal_at(const shcd_proximity *found, shcd_vec3 p) {
    /* where the surface is singular the direction to the foot serves */
    const shcd_vec3 away = shcd_unit(shcd_sub(p, found->point_m));
    if (shcd_dot(found->normal, found->normal) > 0.0) {
        return found->normal;
    }
    return found->distance_m < 0.0 ? shcd_scale(-1.0, away) : away;
}

double shcdi_sure_distance(const shcdi_body *body, uint32_t proximity_flags, double distance_m) {
    /* Nearer to the surface than its leaves, where the winding number cannot tell, the side seen at
     * the nearest foot known stands: a wrong one is worth a force of stiffness times that small
     * distance only, and a contact has to begin somewhere. */
    const bool is_guess =
        (proximity_flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0 && fabs(distance_m) > body->deviation_m;
    return is_guess ? fabs(distance_m) : distance_m;
}

void shcdi_set_caps(const shcdi_body *body, const shcdi_tool *tool, shcd_query_options *options) {
    const uint32_t by_degree =
        TICK_EVALUATIONS_MAX * TICK_EVALUATIONS_HARMONICS / body->n_harmonics;
    const uint32_t cap = by_degree > TICK_EVALUATIONS_MAX   ? TICK_EVALUATIONS_MAX
                         : by_degree < TICK_EVALUATIONS_MIN ? TICK_EVALUATIONS_MIN
                                                            : by_degree;
    options->patches_max = TICK_PATCHES_MAX + body->n_leaves;
    options->evaluations_max = tool->evaluations_max > 0 ? tool->evaluations_max : cap;
}
