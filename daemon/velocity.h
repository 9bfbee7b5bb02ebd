/* SPDX-License-Identifier: BSD-3-Clause */
/* Tool velocity for clients that do not send one: differences of position over the client's own
 * time stamps, then a first-order low-pass.
 *
 *   raw = (p - p_last)/dt,   v += (raw - v) dt/(tau + dt),   tau = 5 ms
 *
 * (the backward Euler step of tau v' = raw - v: stable for every dt, and a constant raw velocity is
 * reached within 1 % after 4.6 tau). Two stamps closer than 0.1 ms would turn the position's noise
 * into speed: such a pose is left out and the next difference reaches over it. A gap of more than
 * 50 ms, or a stamp that goes back, says nothing about now: the filter starts again at zero.
 *
 * Angular velocity likewise, from the rotation between two orientations: raw = angle axis/dt. */
#ifndef SHCDD_VELOCITY_H
#define SHCDD_VELOCITY_H

#include "shcd/base.h"

#include <stdbool.h>
#include <stdint.h>

#define VELOCITY_TAU_S 0.005
#define VELOCITY_DT_MIN_US 100
#define VELOCITY_DT_MAX_US 50000

/** All zero: no position yet. */
typedef struct velocity_filter {
    bool any;
    int64_t utime;
    shcd_vec3 position_m;
    shcd_vec3 velocity_m_per_s;
} velocity_filter;

/** Takes a position and its stamp [us], |utime| <= 2^62; returns the estimate. */
shcd_vec3 velocity_update(velocity_filter *filter, int64_t utime, shcd_vec3 position_m);

/** All zero: no orientation yet. */
typedef struct turn_filter {
    bool any;
    int64_t utime;
    shcd_quat orientation;
    shcd_vec3 angular_velocity_rad_per_s;
} turn_filter;

/** Takes a unit quaternion and its stamp; returns the estimate, in the outer frame. */
shcd_vec3 velocity_turn(turn_filter *filter, int64_t utime, shcd_quat orientation);

/** Takes a velocity that the client knows; the filter goes on from it. */
void velocity_set(velocity_filter *filter, int64_t utime, shcd_vec3 position_m,
                  shcd_vec3 velocity_m_per_s);

#endif
