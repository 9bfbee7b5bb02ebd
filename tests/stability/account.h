/* SPDX-License-Identifier: BSD-3-Clause */
/* The account of one tool on closed paths: what the tick reports of its effects, booked by the
 * ledger in every tick. */
#ifndef SHCD_TESTS_ACCOUNT_H
#define SHCD_TESTS_ACCOUNT_H

#include "paths.h"

#include "shcd/shcd.h"
#include "support/soft.h"

#include <float.h>
#include <stdbool.h>
#include <string.h>

#define TICKS 300
#define RADIUS_M 0.003
#define K_N_PER_M 700.0
#define DEPTH_M 0.005
#define EFFECTS_MAX 12
/* As in test_ledger.c: a depth to 1e-9 of the diagonal, and the rounding of the sums. A soft body's
 * modes move with millinewton seconds and hold their energy to 4 ulp a tick. */
#define TOLERANCE_J (K_N_PER_M * DEPTH_M * 1e-9 * 0.2 * 2.0 + TICKS * 8.0 * DBL_EPSILON)

typedef struct account {
    fixture f;
    shcd_ledger ledger;
    shcd_effect_output effects[EFFECTS_MAX];
    shcd_vec3 forces_n[EFFECTS_MAX];
    double entry_j[EFFECTS_MAX];
    size_t n_effects;
    double stiffness_n_per_m;
    const char *elastic;    /* the effect whose force that is */
    double damping_s_per_m; /* of `damping`: its slope over the elastic force; 0: without */
    double drag_n_s_per_m;  /* of `viscosity` */
    double driven_j;
    double least_j;
    double stored_most_j;
    uint32_t most_contacts; /* of a tick */
} account;

/* One body, or a second one with the same effects beside it. */
static inline void account_open(account *a, const shcd_model *model, const shcd_vec3 *other_at_m,
                                const shcd_effect_def *effects, size_t n,
                                double stiffness_n_per_m) {
    const shcd_vec3 at = other_at_m != NULL ? *other_at_m : shcd_vec3_make(0.0, 0.0, 0.0);
    const shcd_body_def bodies[2] = {
        fixture_body("body", model, fixture_pose(0, 0, 0), effects, n),
        fixture_body("other", model, fixture_pose(at.x, at.y, at.z), effects, n)};
    const shcd_tool_def tool = fixture_tool("tool", RADIUS_M);
    memset(a, 0, sizeof *a);
    fixture_open(&a->f, bodies, other_at_m != NULL ? 2 : 1, &tool, 1);
    a->n_effects = shcd_scene_effect_count(a->f.scene);
    assert_int_equal(a->n_effects, other_at_m != NULL ? 2 * n : n);
    a->stiffness_n_per_m = stiffness_n_per_m;
    a->elastic = "stiffness";
}

static inline void account_reset(account *a) {
    memset(&a->ledger, 0, sizeof a->ledger);
    memset(a->forces_n, 0, sizeof a->forces_n);
    memset(a->entry_j, 0, sizeof a->entry_j);
    assert_int_equal(
        shcd_state_init(a->f.scene, a->f.memory, shcd_state_size(a->f.scene), &a->f.state),
        SHCD_OK);
    a->least_j = HUGE_VAL;
    a->most_contacts = 0;
    a->stored_most_j = a->driven_j = 0.0;
}

static inline void account_tick(account *a, shcd_vec3 p) {
    const shcd_pose pose = {p, {1.0, 0.0, 0.0, 0.0}};
    (void)shcd_ledger_move(&a->ledger, &pose, FIXTURE_TICK_S);
    shcd_ledger_share(&a->ledger, a->forces_n, a->n_effects, a->entry_j);
    a->f.in[0].tool_in_world = pose;
    a->f.in[0].velocity_m_per_s = shcd_scale(1.0 / FIXTURE_TICK_S, a->ledger.moved_m);
    const shcd_input input = {.dt_s = FIXTURE_TICK_S, .tools = a->f.in, .n_tools = 1};
    shcd_output output = {.tools = a->f.out,
                          .n_tools = 1,
                          .effects = a->effects,
                          .n_effects = a->n_effects,
                          .effect_forces_n = a->forces_n};
    assert_int_equal(shcd_step(a->f.scene, a->f.state, &input, &output), SHCD_OK);
    double stored_j = 0.0, driven_j = 0.0, elastic_n = 0.0;
    for (size_t e = 0; e < a->n_effects; e++) {
        const char *name = shcd_scene_effect_name(a->f.scene, e);
        elastic_n += strcmp(name, a->elastic) == 0 ? shcd_norm(a->forces_n[e]) : 0.0;
        stored_j += a->effects[e].stored_j;
        driven_j += a->effects[e].work_j;
    }
    const shcd_ledger_input held = {.published = a->f.out[0].wrench,
                                    .model = a->f.out[0].wrench,
                                    .velocity_m_per_s = a->f.in[0].velocity_m_per_s,
                                    .stored_j = stored_j,
                                    .driven_j = driven_j - a->driven_j,
                                    .stiffness_n_per_m = a->stiffness_n_per_m,
                                    .damping_n_s_per_m =
                                        a->damping_s_per_m * elastic_n + a->drag_n_s_per_m};
    assert_int_equal(shcd_ledger_hold(&a->ledger, &held), SHCD_OK);
    assert_true(stored_j >= 0.0);
    a->driven_j = driven_j;
    a->most_contacts =
        a->f.out[0].n_contacts > a->most_contacts ? a->f.out[0].n_contacts : a->most_contacts;
    a->stored_most_j = fmax(a->stored_most_j, stored_j);
    a->least_j = fmin(a->least_j, shcd_ledger_margin(&a->ledger));
}

#endif
