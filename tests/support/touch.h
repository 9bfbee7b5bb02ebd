/* SPDX-License-Identifier: BSD-3-Clause */
/* One effect and one contact, without a scene: for tests of an effect's formula. */
#ifndef SHCD_TESTS_TOUCH_H
#define SHCD_TESTS_TOUCH_H

#include "response/effects.h"
#include "shcd/vec.h"
#include "support/check.h"

#include <string.h>

/** An effect with its constants and the memory of a contact. */
typedef struct touch_effect {
    shcdi_active_effect active;
    double memory[32];
} touch_effect;

static inline touch_effect touch_open(const char *name, const shcd_parameter_value *values,
                                      size_t n_values) {
    const shcd_effect_def def = {name, values, n_values};
    shcdi_active_effect active[SHCDI_EFFECTS_MAX];
    touch_effect e;
    size_t n, bytes;
    shcd_error error = {SHCD_OK, ""};
    if (shcdi_effects_resolve("body", &def, 1, active, &n, &bytes, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    assert_int_equal(n, 1);
    assert_true(bytes <= sizeof e.memory);
    memset(&e, 0, sizeof e);
    e.active = active[0];
    return e;
}

/** The values are refused with a message that holds all of `words`, ended by NULL. */
static inline void touch_expect_refusal(const char *name, const shcd_parameter_value *values,
                                        size_t n_values, const char *const *words) {
    const shcd_effect_def def = {name, values, n_values};
    shcdi_active_effect active[SHCDI_EFFECTS_MAX];
    size_t n = 77, bytes = 77;
    shcd_error error = {SHCD_OK, ""};
    assert_int_not_equal(shcdi_effects_resolve("body", &def, 1, active, &n, &bytes, &error),
                         SHCD_OK);
    assert_true(n == 77 && bytes == 77);
    for (; *words != NULL; words++) {
        if (strstr(error.message, *words) == NULL) {
            fail_msg("'%s' does not hold '%s'", error.message, *words);
        }
    }
}

/** A tool above the plane z = 0 of a body, moving with its frame, deep by `depth_m`. */
static inline shcdi_touch touch_plane(double depth_m) {
    shcdi_touch t;
    memset(&t, 0, sizeof t);
    t.depth_m = depth_m;
    t.foot_depth_m = t.depth_m;
    t.along_part = t.along_weight = 1.0;
    t.dt_s = 0.001;
    t.normal = shcd_vec3_make(0.0, 0.0, 1.0);
    t.parameter = t.normal;
    t.tool_in_body.orientation.w = 1.0;
    return t;
}

/** Puts the tool, its contact point and the foot at (x, y). */
static inline void touch_place(shcdi_touch *t, double x, double y) {
    t->tool_in_body.position_m = shcd_vec3_make(x, y, -t->depth_m);
    t->tool_point_m = t->tool_in_body.position_m;
    t->foot_m = shcd_vec3_make(x, y, 0.0);
}

/** What apply() makes of a normal force. */
static inline shcdi_response touch_apply(touch_effect *e, const shcdi_touch *t, double normal_n) {
    shcdi_response r;
    memset(&r, 0, sizeof r);
    r.depth_m = t->depth_m;
    r.normal_force_n = normal_n;
    e->active.effect->apply(e->active.constants, t, e->memory, &r);
    return r;
}

#endif
