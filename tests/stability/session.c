/* SPDX-License-Identifier: BSD-3-Clause */
#include "session.h"

#include "shcd/vec.h"
#include "support/check.h"

#define PI 3.14159265358979324
#define APPROACH_S 0.2
#define LIFT_M 0.002

session session_make(session_kind kind, const rig_setup *setup, shcd_vec3 w, shcd_vec3 along,
                     double force_n) {
    const shcd_vec3 u = shcd_unit(w);
    const session s = {.kind = kind,
                       .w = u,
                       .along = shcd_unit(shcd_mul_add(along, -shcd_dot(along, u), u)),
                       .angle_rad = 0.4,
                       .target_depth_m = force_n / setup->hand.grip_n_per_m +
                                         force_n / rig_static_stiffness(setup),
                       .tap_hz = 3.0,
                       .slide_hz = 0.5,
                       .duration_s = kind == SESSION_PRESS ? 0.5 : 2.5};
    return s;
}

static shcd_vec3 place(const rig_setup *setup, shcd_vec3 w, double depth_m) {
    shcd_vec3 point, normal;
    if (shcd_model_surface(setup->model, -1, w, &point, &normal, NULL) != SHCD_OK) {
        fail_msg("no surface at the parameter");
    }
    return shcd_mul_add(point, setup->radius_m - depth_m, normal);
}

/* In within the approach; the last tap stays in. */
static shcd_vec3 target_at(const rig_setup *setup, const session *s, double t) {
    const double in = t < APPROACH_S ? 0.5 - 0.5 * cos(PI * t / APPROACH_S) : 1.0;
    double depth = s->target_depth_m, angle = 0.0;
    if (s->kind == SESSION_TAP) {
        const double turns = s->tap_hz * (t - APPROACH_S);
        depth *= t < APPROACH_S || turns > floor(s->tap_hz * (s->duration_s - APPROACH_S))
                     ? 1.0
                     : 0.5 + 0.5 * cos(2.0 * PI * turns);
    } else if (s->kind == SESSION_SLIDE && t > APPROACH_S) {
        angle = s->angle_rad * sin(2.0 * PI * s->slide_hz * (t - APPROACH_S));
    }
    return place(setup, shcd_add(shcd_scale(cos(angle), s->w), shcd_scale(sin(angle), s->along)),
                 in * (depth + LIFT_M) - LIFT_M);
}

watch session_run(rig *r, const rig_setup *setup, const session *s) {
    rig_open(r, setup, target_at(setup, s, 0.0));
    const int n = (int)(s->duration_s * setup->hand.rate_hz);
    for (int i = 1; i <= n; i++) {
        rig_tick(r, target_at(setup, s, i / setup->hand.rate_hz));
    }
    return watch_hold(r);
}
