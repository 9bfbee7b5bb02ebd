/* SPDX-License-Identifier: BSD-3-Clause */
/* The state and the tick.
 *
 * Bodies are visited in the order of their certified lower bounds, those in contact first, and the
 * visit ends when the next bound proves that no body further on touches the tool or is nearer than
 * the nearest so far: a far body costs one square root. Forces are then summed in the order of the
 * scene, so that their sum does not depend on the order of the visit. */
#include "response/scene_private.h"

#include <string.h>

#define DT_MAX_S 0.1
#define STATE_ALIGNMENT 16

/* ---- state ---------------------------------------------------------------------------------- */

size_t shcd_state_size(const shcd_scene *scene) {
    return scene != NULL ? scene->state_size : 0;
}

shcd_status shcd_state_init(const shcd_scene *scene, void *memory, size_t size,
                            shcd_state **state) {
    if (scene == NULL || memory == NULL || state == NULL || size < scene->state_size ||
        (uintptr_t)memory % STATE_ALIGNMENT != 0) {
        return SHCD_ERR_ARGUMENT;
    }
    shcd_state *made = memory;
    memset(made, 0, scene->state_size);
    made->fingerprint = scene->fingerprint;
    made->size = scene->state_size;
    *state = made;
    return SHCD_OK;
}

static unsigned char *effect_memory(const shcd_scene *scene, shcd_state *state, size_t tool) {
    return (unsigned char *)(state->contacts + scene->n_tools * scene->n_bodies) +
           tool * scene->tool_memory_bytes;
}

/* ---- one tool ------------------------------------------------------------------------------- */

/* A tool during a tick. */
typedef struct visit {
    const shcd_scene *scene;
    shcd_vec3 centre_m; /* world */
    double radius_m;
    double dt_s;
    shcdi_contact *contacts; /* of this tool, one for each body */
    unsigned char *memory;   /* of this tool's effects */
    bool is_visited[SHCD_BODIES_MAX];
    bool was_touching[SHCD_BODIES_MAX];
    shcdi_gap gaps[SHCD_BODIES_MAX]; /* of the visited bodies */
} visit;

static void look_at(visit *v, size_t b, double *nearest_m) {
    const shcdi_body *body = &v->scene->bodies[b];
    v->was_touching[b] = v->contacts[b].is_touching != 0;
    v->is_visited[b] = true;
    shcdi_contact_update(body, v->radius_m,
                         shcd_transform_inverse(body->body_in_world, v->centre_m), v->dt_s,
                         &v->contacts[b], &v->gaps[b]);
    *nearest_m = shcdi_min(*nearest_m, v->gaps[b].gap_m);
}

static void find_contacts(visit *v) {
    double bounds[SHCD_BODIES_MAX];
    double nearest_m = HUGE_VAL;
    const size_t n = v->scene->n_bodies;
    for (size_t b = 0; b < n; b++) {
        const shcdi_body *body = &v->scene->bodies[b];
        if (v->contacts[b].is_touching) {
            look_at(v, b, &nearest_m);
            continue;
        }
        bounds[b] =
            shcdi_contact_lower_bound(body, &v->contacts[b],
                                      shcd_transform_inverse(body->body_in_world, v->centre_m)) -
            v->radius_m;
    }
    for (size_t k = 0; k < n; k++) {
        size_t next = n;
        for (size_t b = 0; b < n; b++) {
            if (!v->is_visited[b] && (next == n || bounds[b] < bounds[next])) {
                next = b;
            }
        }
        if (next == n || bounds[next] >= shcdi_max(nearest_m, 0.0)) {
            break;
        }
        look_at(v, next, &nearest_m);
    }
}

/* Force of one contact: what the body's effects make of it, along the normal. It passes through the
 * tool's centre, as every frictionless force on a sphere does, so it has no torque. */
static shcd_vec3 respond(visit *v, size_t b, shcd_vec3 velocity) {
    const shcdi_body *body = &v->scene->bodies[b];
    const shcd_vec3 normal = shcd_rotate(body->body_in_world.orientation, v->gaps[b].normal);
    const shcdi_touch touch = {-v->gaps[b].gap_m, -shcd_dot(velocity, normal)};
    shcdi_response response = {0.0};
    unsigned char *memory = v->memory + body->memory_offset;
    if (!v->was_touching[b]) {
        memset(memory, 0, body->memory_bytes);
    }
    for (size_t e = 0; e < body->n_effects; e++) {
        const shcdi_active_effect *active = &body->effects[e];
        active->effect->apply(active->constants, &touch, memory + active->state_offset, &response);
    }
    return shcd_scale(response.normal_force_n, normal);
}

static void step_tool(visit *v, shcd_vec3 velocity, shcd_tool_output *out) {
    find_contacts(v);
    for (size_t b = 0; b < v->scene->n_bodies; b++) {
        const shcdi_body *body = &v->scene->bodies[b];
        const shcdi_gap *gap = &v->gaps[b];
        if (!v->is_visited[b]) {
            continue;
        }
        out->flags |= gap->flags;
        out->n_evaluations += gap->n_evaluations;
        out->n_patches += gap->n_patches;
        if (v->contacts[b].is_touching) {
            out->flags |= SHCD_TOOL_OUTPUT_CONTACT;
            out->wrench.force_n = shcd_add(out->wrench.force_n, respond(v, b, velocity));
        }
        if (gap->gap_m < out->distance_m) {
            out->distance_m = gap->gap_m;
            out->body = (int32_t)b;
            out->penetration_m = v->contacts[b].is_touching ? -gap->gap_m : 0.0;
            out->proxy_m = shcd_transform(body->body_in_world, gap->foot_m);
            out->normal = shcd_rotate(body->body_in_world.orientation, gap->normal);
        }
    }
}

/* ---- the tick ------------------------------------------------------------------------------- */

static bool is_usable(const shcd_tool_input *tool) {
    return shcdi_is_moderate(tool->tool_in_world.position_m) &&
           shcdi_is_rotation(tool->tool_in_world.orientation) &&
           shcdi_is_moderate(tool->velocity_m_per_s);
}

static bool is_valid_call(const shcd_scene *scene, const shcd_state *state, const shcd_input *input,
                          const shcd_output *output) {
    return scene != NULL && state != NULL && input != NULL && output != NULL &&
           state->fingerprint == scene->fingerprint && state->size == scene->state_size &&
           input->tools != NULL && input->n_tools == scene->n_tools && output->tools != NULL &&
           output->n_tools == scene->n_tools && input->dt_s > 0.0 && input->dt_s <= DT_MAX_S;
}

shcd_status shcd_step(const shcd_scene *scene, shcd_state *state, const shcd_input *input,
                      shcd_output *output) {
    if (!is_valid_call(scene, state, input, output)) {
        return SHCD_ERR_ARGUMENT;
    }
    for (size_t t = 0; t < scene->n_tools; t++) {
        const shcd_tool_input *tool = &input->tools[t];
        const shcd_tool_output nothing = {.distance_m = HUGE_VAL, .body = -1};
        shcdi_contact *contacts = state->contacts + t * scene->n_bodies;
        shcd_tool_output out = nothing;
        if ((tool->flags & SHCD_TOOL_INPUT_ACTIVE) == 0) {
            memset(contacts, 0, scene->n_bodies * sizeof *contacts);
        } else if (!is_usable(tool)) {
            /* the contacts stay: one bad sample must not let the tool out on the far side */
            out.flags = SHCD_TOOL_OUTPUT_BAD_INPUT;
        } else {
            visit v;
            v.scene = scene;
            v.centre_m = tool->tool_in_world.position_m;
            v.radius_m = scene->tools[t].radius_m;
            v.dt_s = input->dt_s;
            v.contacts = contacts;
            v.memory = effect_memory(scene, state, t);
            memset(v.is_visited, 0, sizeof v.is_visited);
            step_tool(&v, tool->velocity_m_per_s, &out);
        }
        output->tools[t] = out;
    }
    state->tick++;
    state->time_s += input->dt_s;
    return SHCD_OK;
}
