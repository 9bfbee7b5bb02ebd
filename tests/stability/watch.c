/* SPDX-License-Identifier: BSD-3-Clause */
#include "watch.h"

#include "shcd/vec.h"

/* The way along each axis, and from where. */
typedef struct course {
    shcd_vec3 first, last, way;
} course;

static void follow(course *c, shcd_vec3 p) {
    const shcd_vec3 d = shcd_sub(p, c->last);
    c->way = shcd_add(c->way, shcd_vec3_make(fabs(d.x), fabs(d.y), fabs(d.z)));
    c->last = p;
}

/* What of it was there and back, largest of the axes. */
static double back_and_forth(const course *c) {
    const shcd_vec3 net = shcd_sub(c->last, c->first);
    return fmax(c->way.x - fabs(net.x), fmax(c->way.y - fabs(net.y), c->way.z - fabs(net.z)));
}

watch watch_hold(rig *r) {
    watch w = {0.0, 0.0, 0.0, 0};
    const int quarter = (int)(r->config.rate_hz / 4.0);
    const shcd_vec3 target = r->hand.target_m;
    bool touching = false;
    for (int part = 0; part < 12; part++) {
        const shcd_vec3 p = r->hand.position_m;
        course c = {p, p, {0.0, 0.0, 0.0}};
        for (int i = 0; i < quarter; i++) {
            rig_tick(r, target);
            follow(&c, r->hand.position_m);
            w.n_changes += part >= 8 && touching != (rig_depth(r) > 0.0);
            w.deepest_m = fmax(w.deepest_m, rig_depth(r));
            touching = rig_depth(r) > 0.0;
        }
        const double way = back_and_forth(&c);
        w.second_m = part == 4 || (part > 4 && part < 8 && way < w.second_m) ? way : w.second_m;
        w.third_m = part == 8 || (part > 8 && way < w.third_m) ? way : w.third_m;
    }
    return w;
}

bool watch_is_oscillating(const watch *w, double encoder_m) {
    const double floor_m = encoder_m > 0.0 ? WATCH_ENCODER_STEPS * encoder_m : WATCH_FLOOR_M;
    return w->third_m > floor_m && (w->third_m > 0.9 * w->second_m || w->n_changes > 0);
}
