/* SPDX-License-Identifier: BSD-3-Clause */
/* One tool during a tick: which bodies it touches, and what that gives. */
#ifndef SHCDI_VISIT_H
#define SHCDI_VISIT_H

#include "response/scene_private.h"

typedef struct shcdi_visit {
    const shcd_scene *scene;
    shcd_state *state;
    const shcdi_tool *tool;
    size_t tool_index;
    shcd_pose pose; /**< world */
    shcd_vec3 velocity_m_per_s, angular_velocity_rad_per_s;
    const shcd_input *input;
    shcd_output *output;
    size_t n_tools_left; /**< this one included */
    double *left_ns;     /**< of each body's budget */
    bool is_visited[SHCD_BODIES_MAX];
    bool was_touching[SHCD_BODIES_MAX];
    shcdi_gap gaps[SHCD_BODIES_MAX]; /**< of the visited bodies */
} shcdi_visit;

/** Finds the contacts of the tool with all bodies; gaps and counts of the visited ones. */
void shcdi_visit_bodies(shcdi_visit *v);

/** Lets the effects of rigid bodies act on the tool, and notes the contacts with soft ones, for
 *  shcdi_respond_soft(). */
void shcdi_visit_respond(shcdi_visit *v);

/** Where an array of the state lies. */
shcdi_contact *shcdi_contacts_of(const shcd_scene *scene, shcd_state *state, size_t tool);
/** Of wall 0, or of a tool that is no ball; that of wall k lies k tool_memory_bytes behind it. */
unsigned char *shcdi_effect_memory(const shcd_scene *scene, shcd_state *state, size_t tool,
                                   size_t body);
/** Of a shell: body_bytes, then the effects' memory of its contacts. */
unsigned char *shcdi_shell_memory(const shcd_scene *scene, shcd_state *state, size_t tool,
                                  size_t body);
shcdi_gain *shcdi_gains_of(const shcd_scene *scene, shcd_state *state);

/** The current shape of a body; NULL: rigid. */
const shcd_shape *shcdi_shape_of(const shcdi_body *body, const shcd_state *state);

#endif
