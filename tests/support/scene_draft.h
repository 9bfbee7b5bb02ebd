/* SPDX-License-Identifier: BSD-3-Clause */
/* A scene's definition, for tests that spoil one thing in it. */
#ifndef SHCD_TESTS_SCENE_DRAFT_H
#define SHCD_TESTS_SCENE_DRAFT_H

#include "support/scene_fixture.h"

/** The body of all drafts: made and freed as a group's fixture. */
static shcd_model *draft_model;

static inline int draft_model_make(void **state) {
    (void)state;
    draft_model = fixture_sphere(0.05);
    return 0;
}

static inline int draft_model_free(void **state) {
    (void)state;
    shcd_model_free(draft_model);
    return 0;
}

/** A definition that is right, with room to spoil it. */
typedef struct draft {
    shcd_scene_def scene;
    shcd_body_def bodies[2];
    shcd_tool_def tools[2];
    shcd_effect_def effects[2];
    shcd_parameter_value parameters[2];
} draft;

static inline void draft_make(draft *d) {
    const shcd_scene_def scene = SHCD_SCENE_DEF_INIT;
    memset(d, 0, sizeof *d);
    d->parameters[0].name = "k_n_per_m";
    d->parameters[0].value = 500.0;
    d->parameters[1].name = "ratio";
    d->parameters[1].value = 0.5;
    d->effects[0].name = "stiffness";
    d->effects[0].parameters = &d->parameters[0];
    d->effects[0].n_parameters = 1;
    d->effects[1].name = "damping";
    d->effects[1].parameters = &d->parameters[1];
    d->effects[1].n_parameters = 1;
    d->bodies[0] = fixture_body("left", draft_model, fixture_pose(-0.1, 0.0, 0.0), d->effects, 2);
    d->bodies[1] = fixture_body("right", draft_model, fixture_pose(0.1, 0.0, 0.0), d->effects, 1);
    d->tools[0] = fixture_tool("tip", 0.0);
    d->tools[1] = fixture_tool("ball", 0.004);
    d->scene = scene;
    d->scene.bodies = d->bodies;
    d->scene.n_bodies = 2;
    d->scene.tools = d->tools;
    d->scene.n_tools = 2;
}

static inline shcd_scene *draft_create(const draft *d) {
    shcd_scene *scene = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcd_scene_create(&d->scene, NULL, &scene, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return scene;
}

#endif
