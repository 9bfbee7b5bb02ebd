/* SPDX-License-Identifier: BSD-3-Clause */
#include "velocity.h"

#include "shcd/vec.h"

void velocity_set(velocity_filter *filter, int64_t utime, shcd_vec3 position_m,
                  shcd_vec3 velocity_m_per_s) {
    filter->any = true;
    filter->utime = utime;
    filter->position_m = position_m;
    filter->velocity_m_per_s = velocity_m_per_s;
}

shcd_vec3 velocity_update(velocity_filter *filter, int64_t utime, shcd_vec3 position_m) {
    const int64_t dt_us = filter->any ? utime - filter->utime : -1;
    if (dt_us < 0 || dt_us > VELOCITY_DT_MAX_US) {
        velocity_set(filter, utime, position_m, shcd_vec3_make(0.0, 0.0, 0.0));
    } else if (dt_us >= VELOCITY_DT_MIN_US) {
        const double dt_s = 1e-6 * (double)dt_us;
        const shcd_vec3 raw = shcd_scale(1.0 / dt_s, shcd_sub(position_m, filter->position_m));
        const shcd_vec3 v = filter->velocity_m_per_s;
        velocity_set(filter, utime, position_m,
                     shcd_mul_add(v, dt_s / (VELOCITY_TAU_S + dt_s), shcd_sub(raw, v)));
    }
    return filter->velocity_m_per_s;
}

/* angle axis of the rotation that leads from a to b, the shorter way round; outer frame */
static shcd_vec3 rotation_between(shcd_quat a, shcd_quat b) {
    const shcd_vec3 u = {a.x, a.y, a.z};
    const shcd_vec3 v = {b.x, b.y, b.z};
    /* b conj(a) */
    const double w = b.w * a.w + shcd_dot(u, v);
    const shcd_vec3 s = shcd_sub(shcd_mul_add(shcd_scale(a.w, v), -b.w, u), shcd_cross(v, u));
    const double sine = shcd_norm(s);
    if (!(sine > 0.0)) {
        return s;
    }
    return shcd_scale((w < 0.0 ? -2.0 : 2.0) * atan2(sine, fabs(w)) / sine, s);
}

shcd_vec3 velocity_turn(turn_filter *filter, int64_t utime, shcd_quat orientation) {
    const int64_t dt_us = filter->any ? utime - filter->utime : -1;
    const shcd_vec3 none = {0.0, 0.0, 0.0};
    if (dt_us < 0 || dt_us > VELOCITY_DT_MAX_US) {
        *filter = (turn_filter){true, utime, orientation, none};
    } else if (dt_us >= VELOCITY_DT_MIN_US) {
        const double dt_s = 1e-6 * (double)dt_us;
        const shcd_vec3 raw =
            shcd_scale(1.0 / dt_s, rotation_between(filter->orientation, orientation));
        const shcd_vec3 v = filter->angular_velocity_rad_per_s;
        *filter = (turn_filter){true, utime, orientation,
                                shcd_mul_add(v, dt_s / (VELOCITY_TAU_S + dt_s), shcd_sub(raw, v))};
    }
    return filter->angular_velocity_rad_per_s;
}
