/* SPDX-License-Identifier: BSD-3-Clause */
/* The walls that a ball touches: contact_sides.c finds and follows them, walls.c shares the ball's
 * depth among them. */
#ifndef SHCDI_WALLS_H
#define SHCDI_WALLS_H

#include "response/scene_private.h"

/** How far what one wall moves the ball by moves it out of the other, and the rate of that by the
 *  cosine between their normals: the cosine, or nothing beyond 90 degrees, and smooth between. */
double shcdi_wall_coupling(const shcdi_wall *a, const shcdi_wall *b, double *rate);

/** Those that are touched, as bits. */
unsigned shcdi_walls_touched(const shcdi_wall wall[]);

/** How the walls of a set share the way out of all of them.
 *  @param[out] m  what each moves the ball by, along its normal
 *  @return the length of the whole way [m] */
double shcdi_walls_solve(const shcdi_wall wall[], unsigned set, double m[SHCDI_WALLS_MAX]);

/** Sets pressed_m and the shares of a contact from the depths of its walls. */
void shcdi_walls_share(shcdi_contact *contact);

/** Lets a contact whose walls are stiffer than one yield, after the slopes. */
void shcdi_walls_yield(double dt_s, shcdi_contact *contact);

/** Sets the slopes of a rigid body's walls, after the shares, for a ball about p. */
void shcdi_walls_tilt(const shcd_model *model, shcd_vec3 p, shcdi_contact *contact);

#endif
