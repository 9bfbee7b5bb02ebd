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
