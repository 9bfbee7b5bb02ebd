/* SPDX-License-Identifier: BSD-3-Clause */
/* The walls that a ball touches: contact_sides.c finds and follows them, walls.c shares the ball's
 * depth among them. */
#ifndef SHCDI_WALLS_H
#define SHCDI_WALLS_H

#include "response/scene_private.h"

/** What decides how contacts share their depths d: m >= 0, A m >= d, m_i (A m - d)_i = 0. */
typedef struct shcdi_wall_system {
    size_t n;
    double depth_m[SHCDI_WALLS_MAX];
    double at[SHCDI_WALLS_MAX][SHCDI_WALLS_MAX]; /**< A, symmetric */
} shcdi_wall_system;

/** The solution with the largest m . d, which is returned; 0: m is zero. RT safe. */
double shcdi_walls_solve(const shcdi_wall_system *system, double m[SHCDI_WALLS_MAX]);

/** How far what one wall moves the ball by moves it out of the other, and the rate of that by the
 *  cosine between their normals: the cosine, or nothing beyond 90 degrees, and smooth between. */
double shcdi_wall_coupling(const shcdi_wall *a, const shcdi_wall *b, double *rate);

/** Those that are touched, as bits. */
unsigned shcdi_walls_touched(const shcdi_wall wall[]);

/** The couplings and depths of the walls of a set; the others have no depth. */
shcdi_wall_system shcdi_walls_couple(const shcdi_wall wall[], unsigned set);

/** sum_j a'_ij m_j n_j over the walls j that are pressed beside i: what turning normal i by H u
 *  changes the way out by, u this vector. Zero for a wall that is alone. */
shcd_vec3 shcdi_wall_lean(const shcdi_wall wall[], size_t i);

/** Sets pressed_m and the shares of a contact from the depths of its walls. */
void shcdi_walls_share(shcdi_contact *contact);

/** What the tool's output says of a contact that gets this share of its law. */
static inline uint32_t shcdi_walls_flag(double share) {
    return share < 0.99 ? (uint32_t)SHCD_TOOL_OUTPUT_YIELDING : 0u;
}

/** Lets a contact whose walls are stiffer than one yield, after the slopes. */
void shcdi_walls_yield(double dt_s, shcdi_contact *contact);

/** Sets the slopes of a rigid body's walls, after the shares, for a ball about p. */
void shcdi_walls_tilt(const shcd_model *model, shcd_vec3 p, shcdi_contact *contact);

#endif
