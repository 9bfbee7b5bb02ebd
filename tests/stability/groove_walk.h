/* SPDX-License-Identifier: BSD-3-Clause */
/* A ball that is led through a groove, and the account of the hand that leads it. */
#ifndef SHCD_TESTS_GROOVE_WALK_H
#define SHCD_TESTS_GROOVE_WALK_H

#include "shcd/energy.h"
#include "support/scene_fixture.h"

#define GROOVE_EFFECTS_MAX 4

/** Where a ball that comes along x, by steps, touches first. */
static inline double groove_touched_at(fixture *f, double step_m) {
    for (double x = 0.06; x > 0.0; x -= step_m) {
        if (fixture_move(f, shcd_vec3_make(x, 0.0, 0.0), shcd_vec3_make(0.0, 0.0, 0.0))
                ->n_contacts > 0) {
            return x;
        }
    }
    fail_msg("the ball touches nothing");
    return 0.0;
}

/** One tick with the ball at p, booked. @return what the effects hold */
static inline double groove_book(fixture *f, shcd_ledger *ledger, shcd_vec3 p,
                                 double stiffness_n_per_m, double damping_n_s_per_m) {
    const shcd_pose pose = {p, {1.0, 0.0, 0.0, 0.0}};
    const size_t n_effects = shcd_scene_effect_count(f->scene);
    shcd_effect_output effects[GROOVE_EFFECTS_MAX];
    double stored_j = 0.0;
    (void)shcd_ledger_move(ledger, &pose, FIXTURE_TICK_S);
    f->in[0].tool_in_world = pose;
    f->in[0].velocity_m_per_s = shcd_scale(1.0 / FIXTURE_TICK_S, ledger->moved_m);
    const shcd_input input = {.dt_s = FIXTURE_TICK_S, .tools = f->in, .n_tools = 1};
    shcd_output output = {
        .tools = f->out, .n_tools = 1, .effects = effects, .n_effects = n_effects};
    assert_in_range(n_effects, 1, GROOVE_EFFECTS_MAX);
    assert_int_equal(shcd_step(f->scene, f->state, &input, &output), SHCD_OK);
    for (size_t e = 0; e < n_effects; e++) {
        stored_j += effects[e].stored_j;
    }
    const shcd_ledger_input held = {.published = f->out[0].wrench,
                                    .model = f->out[0].wrench,
                                    .velocity_m_per_s = f->in[0].velocity_m_per_s,
                                    .stored_j = stored_j,
                                    .stiffness_n_per_m = stiffness_n_per_m,
                                    .damping_n_s_per_m = damping_n_s_per_m};
    assert_int_equal(shcd_ledger_hold(ledger, &held), SHCD_OK);
    return stored_j;
}

#endif
