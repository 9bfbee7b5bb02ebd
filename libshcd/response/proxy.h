/* SPDX-License-Identifier: BSD-3-Clause */
/* A proxy on the surface, and when a foot continues it. The rules: contact.c. */
#ifndef SHCDI_PROXY_H
#define SHCDI_PROXY_H

#include "response/scene_private.h"

#include "shcd/query.h"

/** Cosine of the largest turn of the normal in a tick: 26 degrees, or a change of the force by 0.45
 *  of itself. It slows a slide over a sharp ridge down. */
#define SHCDI_TURN_COSINE 0.9

/** A proxy and where its tool point is now. */
typedef struct shcdi_pursuit {
    const shcdi_body *body;
    const shcdi_proxy *last;
    shcd_vec3 p;     /**< the tool point, body frame */
    double motion_m; /**< of the tool point, and of the surface towards it, at most */
    double reach_m;  /**< how far a foot that continues the last one may be from it */
} shcdi_pursuit;

/** Sets the reach for a tool point that has come to p, dt_s after the last tick, over a surface
 * that has moved by no more than surface_motion_m. */
shcdi_pursuit shcdi_pursue(const shcdi_body *body, const shcdi_proxy *last, shcd_vec3 p,
                           double surface_motion_m, double dt_s);

/** Whether a foot continues the last one, or has jumped. */
bool shcdi_is_continued_by(const shcdi_pursuit *u, shcd_vec3 foot_m, shcd_vec3 normal);

/** Follows the last foot to that of p. @return whether it was found and continues. */
bool shcdi_follow(const shcdi_pursuit *u, shcd_proximity *found, shcdi_gap *count);

/** Follows the last foot to that of p, or by a step of a slide towards p where it has none.
 *  @return whether there is a proxy and p is behind it, distance_m < 0 */
bool shcdi_keep_proxy(const shcdi_pursuit *u, shcd_proximity *found, shcdi_gap *count);

/** Ends what a jump ends and counts the time without motion. `motion_m` of the tool since the last
 *  query. @return whether the tool has jumped */
bool shcdi_has_jumped(double motion_m, double dt_s, double *still_s);

/** Adds what a query cost. */
static inline void shcdi_count(shcdi_gap *count, const shcd_proximity *found) {
    count->n_evaluations += found->n_evaluations;
    count->n_patches += found->n_patches;
}

/** The flags of an output for those of a query. */
uint32_t shcdi_output_flags(uint32_t proximity_flags);

/** Normal for the force, also where the surface is singular and has none. */
shcd_vec3 shcdi_normal_at(const shcd_proximity *found, shcd_vec3 p);

/** No force on a guess: where the side is unknown, and not merely because the point is nearer to
 *  the surface than its leaves, it counts as outside. @return the distance to use */
double shcdi_sure_distance(const shcdi_body *body, uint32_t proximity_flags, double distance_m);

/** Finds the walls that a point or ball touches whose contact has been settled, contact_sides.c.
 *  @param[in] u  from before that */
void shcdi_sides_update(const shcdi_body *body, const shcdi_tool *tool, const shcdi_pursuit *u,
                        double dt_s, shcdi_contact *contact, shcdi_gap *out);

/** Lets go of all walls of a contact. */
void shcdi_sides_release(shcdi_contact *contact);

/** shcd_closest() or shcd_shape_closest(), as there is a shape or not. */
shcd_status shcdi_closest_now(const shcdi_body *body, const shcd_shape *shape, shcd_vec3 p,
                              const shcd_query_options *options, shcd_proximity *found);

/** shcd_track() or shcd_shape_track(), likewise. */
shcd_status shcdi_track_now(const shcdi_body *body, const shcd_shape *shape, shcd_vec3 p,
                            shcd_vec3 parameter, shcd_proximity *found);

/** Caps of one query of a tool in a tick. */
void shcdi_set_caps(const shcdi_body *body, const shcdi_tool *tool, shcd_query_options *options);

#endif
