/* SPDX-License-Identifier: BSD-3-Clause */
/* The state and the tick.
 *
 * A tick: the gains of the effects move on; soft bodies go on freely to its end; each tool is
 * looked at (visit.c) and the contacts with rigid bodies are answered (respond.c); the contacts
 * with soft bodies are solved together, and answered. */
#include "response/accuracy.h"
#include "response/learned_dent.h"
#include "response/respond.h"

#include <string.h>

#define DT_MAX_S 0.1
#define RAMP_MAX_S 60.0
#define STATE_ALIGNMENT 16

/* ---- state ---------------------------------------------------------------------------------- */

size_t shcd_state_size(const shcd_scene *scene) {
    return scene != NULL ? scene->state_size : 0;
}

shcdi_contact *shcdi_contacts_of(const shcd_scene *scene, shcd_state *state, size_t tool) {
    return state->contacts + tool * scene->n_bodies;
}

unsigned char *shcdi_effect_memory(const shcd_scene *scene, shcd_state *state, size_t tool,
                                   size_t body) {
    return (unsigned char *)(state->contacts + scene->n_tools * scene->n_bodies) +
           tool * SHCDI_WALLS_MAX * scene->tool_memory_bytes + scene->bodies[body].memory_offset;
}

unsigned char *shcdi_shell_memory(const shcd_scene *scene, shcd_state *state, size_t tool,
                                  size_t body) {
    const shcdi_tool *t = &scene->tools[tool];
    return (unsigned char *)state + t->state_offset + body * t->shell.body_bytes +
           t->shell.n_slots * scene->bodies[body].memory_offset;
}

shcdi_gain *shcdi_gains_of(const shcd_scene *scene, shcd_state *state) {
    return (shcdi_gain *)(void *)((unsigned char *)state + scene->gains_offset);
}

const shcd_shape *shcdi_shape_of(const shcdi_body *body, const shcd_state *state) {
    return body->soft == NULL
               ? NULL
               : shcdi_soft_shape(body->soft, (const unsigned char *)state + body->soft_offset);
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
    for (size_t e = 0; e < scene->n_effects; e++) {
        const shcdi_gain on = {1.0, 1.0, 0.0};
        shcdi_gains_of(scene, made)[e] = on;
    }
    for (size_t b = 0; b < scene->n_bodies; b++) {
        const shcdi_body *body = &scene->bodies[b];
        if (body->soft != NULL) {
            shcdi_soft_init(body->soft, (unsigned char *)made + body->soft_offset);
        }
    }
    *state = made;
    return SHCD_OK;
}

static bool belongs(const shcd_scene *scene, const shcd_state *state) {
    return scene != NULL && state != NULL && state->fingerprint == scene->fingerprint &&
           state->size == scene->state_size;
}

shcd_status shcd_state_switch(const shcd_scene *scene, shcd_state *state, size_t effect, int is_on,
                              double ramp_s) {
    if (!belongs(scene, state) || effect >= scene->n_effects || !(ramp_s >= 0.0) ||
        !(ramp_s <= RAMP_MAX_S)) {
        return SHCD_ERR_ARGUMENT;
    }
    shcdi_gain *gain = &shcdi_gains_of(scene, state)[effect];
    gain->target = is_on ? 1.0 : 0.0;
    gain->rate_per_s = ramp_s > 0.0 ? fabs(gain->target - gain->now) / ramp_s : 0.0;
    if (ramp_s == 0.0) {
        gain->now = gain->target;
    }
    return SHCD_OK;
}

shcd_status shcd_state_coefficients(const shcd_scene *scene, const shcd_state *state, size_t body,
                                    double *coefficients, size_t count) {
    if (!belongs(scene, state) || body >= scene->n_bodies || coefficients == NULL ||
        count != 3 * (size_t)scene->bodies[body].n_harmonics) {
        return SHCD_ERR_ARGUMENT;
    }
    const shcdi_body *b = &scene->bodies[body];
    const shcdi_gain *gains =
        (const shcdi_gain *)(const void *)((const unsigned char *)state + scene->gains_offset);
    if (b->soft == NULL) {
        shcdi_learned_dent(scene, state, body, gains + b->first_effect, coefficients);
        return SHCD_OK;
    }
    shcdi_soft_coefficients(b->soft, (const unsigned char *)state + b->soft_offset,
                            shcdi_soft_gain_of(b->soft, gains + b->first_effect).shown,
                            coefficients);
    return SHCD_OK;
}

/* ---- one tool ------------------------------------------------------------------------------- */

static void add_counts(const shcdi_gap *gap, shcd_tool_output *out) {
    out->flags |= gap->flags;
    out->n_evaluations += gap->n_evaluations;
    out->n_patches += gap->n_patches;
    out->n_points_visited += gap->n_points_visited;
    out->n_points_left += gap->n_points_left;
    out->tier = shcdi_lower_tier(out->tier, gap->tier);
}

/* How far the foot is from where it was at rest; a shell has many. */
static double displacement_of(const shcdi_visit *v, size_t b) {
    const shcdi_body *body = &v->scene->bodies[b];
    const shcdi_contact *contact = &shcdi_contacts_of(v->scene, v->state, v->tool_index)[b];
    const shcd_model *model = body->model;
    if (body->soft == NULL || v->tool->kind == SHCD_TOOL_SHELL || !contact->is_known) {
        return 0.0;
    }
    return shcd_norm(
        shcd_sub(contact->proxy.foot_m,
                 shcdi_surface_point(&model->series, model->degree, contact->proxy.parameter)));
}

static void report(const shcdi_visit *v, shcd_tool_output *out) {
    const shcdi_contact *contacts = shcdi_contacts_of(v->scene, v->state, v->tool_index);
    for (size_t b = 0; b < v->scene->n_bodies; b++) {
        const shcdi_body *body = &v->scene->bodies[b];
        const shcdi_gap *gap = &v->gaps[b];
        if (!v->is_visited[b]) {
            continue;
        }
        add_counts(gap, out);
        if (gap->gap_m < out->distance_m) {
            out->distance_m = gap->gap_m;
            out->body = (int32_t)b;
            out->penetration_m = contacts[b].is_touching ? -gap->gap_m : 0.0;
            out->proxy_m = shcd_transform(body->body_in_world, gap->foot_m);
            out->normal = shcd_rotate(body->body_in_world.orientation, gap->normal);
            out->displacement_m = displacement_of(v, b);
        }
    }
}

/* ---- the tick ------------------------------------------------------------------------------- */

static bool is_usable(const shcd_tool_input *tool) {
    return shcdi_is_moderate(tool->tool_in_world.position_m) &&
           shcdi_is_rotation(tool->tool_in_world.orientation) &&
           shcdi_is_moderate(tool->velocity_m_per_s) &&
           shcdi_is_moderate(tool->angular_velocity_rad_per_s);
}

static void let_go(const shcd_scene *scene, shcd_state *state, size_t t) {
    const shcdi_tool *tool = &scene->tools[t];
    shcdi_contact *contacts = shcdi_contacts_of(scene, state, t);
    for (size_t b = 0; b < scene->n_bodies && tool->kind == SHCD_TOOL_SHELL; b++) {
        if (contacts[b].is_touching) {
            shcdi_shell_release(&tool->shell, shcdi_shell_memory(scene, state, t, b));
        }
    }
    memset(contacts, 0, scene->n_bodies * sizeof *contacts);
}

static bool is_valid_call(const shcd_scene *scene, const shcd_state *state, const shcd_input *input,
                          const shcd_output *output) {
    return belongs(scene, state) && input != NULL && output != NULL && input->tools != NULL &&
           input->n_tools == scene->n_tools && output->tools != NULL &&
           output->n_tools == scene->n_tools && input->dt_s > 0.0 && input->dt_s <= DT_MAX_S &&
           ((output->effects == NULL && output->effect_forces_n == NULL) ||
            output->n_effects == scene->n_effects);
}

static void move_gains(const shcd_scene *scene, shcd_state *state, double dt_s) {
    shcdi_gain *gains = shcdi_gains_of(scene, state);
    for (size_t e = 0; e < scene->n_effects; e++) {
        const double way = gains[e].target - gains[e].now;
        const double step = gains[e].rate_per_s * dt_s;
        gains[e].now =
            fabs(way) > step ? gains[e].now + (way > 0.0 ? step : -step) : gains[e].target;
    }
}

static void evolve(const shcd_scene *scene, shcd_state *state, const shcd_input *input,
                   shcd_output *output) {
    const bool is_timed = output->effects != NULL && input->clock_ns != NULL;
    for (size_t b = 0; b < scene->n_bodies; b++) {
        const shcdi_body *body = &scene->bodies[b];
        const shcdi_gain *gains = shcdi_gains_of(scene, state) + body->first_effect;
        if (body->soft == NULL) {
            continue;
        }
        const uint64_t start = is_timed ? input->clock_ns(input->clock_user) : 0;
        shcdi_soft_evolve(body->soft, (unsigned char *)state + body->soft_offset,
                          shcdi_soft_gain_of(body->soft, gains), input->dt_s);
        if (is_timed) {
            output->effects[body->first_effect + (size_t)body->soft->wave].time_ns +=
                (double)(input->clock_ns(input->clock_user) - start);
        }
    }
}

static void begin_effects(const shcd_scene *scene, shcd_state *state, shcd_output *output) {
    for (size_t e = 0; output->effects != NULL && e < scene->n_effects; e++) {
        const shcd_effect_output nothing = {.gain = shcdi_gains_of(scene, state)[e].now};
        output->effects[e] = nothing;
    }
    if (output->effect_forces_n != NULL) {
        memset(output->effect_forces_n, 0,
               scene->n_tools * scene->n_effects * sizeof *output->effect_forces_n);
    }
}

static void respond_soft(const shcd_scene *scene, shcd_state *state, const shcd_input *input,
                         shcd_output *output) {
    for (size_t b = 0; b < scene->n_bodies; b++) {
        const shcdi_body *body = &scene->bodies[b];
        if (body->soft == NULL) {
            continue;
        }
        shcdi_respond_soft(scene, state, b, input, output);
        if (output->effects != NULL) {
            const shcdi_soft_state *soft =
                (const shcdi_soft_state *)(const void *)((const unsigned char *)state +
                                                         body->soft_offset);
            shcd_effect_output *first = output->effects + body->first_effect;
            first[body->soft->wave].stored_j += soft->stored_j;
            if (body->soft->pulse >= 0) {
                first[body->soft->pulse].work_j = soft->drive_work_j + soft->carried_work_j;
            }
        }
    }
}

static void step_tool(const shcd_scene *scene, shcd_state *state, size_t t, double left_ns[],
                      size_t n_tools_left, const shcd_input *input, shcd_output *output) {
    const shcd_tool_input *tool = &input->tools[t];
    shcdi_visit v;
    v.scene = scene;
    v.state = state;
    v.tool = &scene->tools[t];
    v.tool_index = t;
    v.pose.position_m = tool->tool_in_world.position_m;
    v.pose.orientation = shcdi_unit_quaternion(tool->tool_in_world.orientation);
    v.velocity_m_per_s = tool->velocity_m_per_s;
    v.angular_velocity_rad_per_s = tool->angular_velocity_rad_per_s;
    v.input = input;
    v.output = output;
    v.n_tools_left = n_tools_left;
    v.left_ns = left_ns;
    shcdi_visit_bodies(&v);
    report(&v, &output->tools[t]);
    shcdi_visit_respond(&v);
}

shcd_status shcd_step(const shcd_scene *scene, shcd_state *state, const shcd_input *input,
                      shcd_output *output) {
    if (!is_valid_call(scene, state, input, output)) {
        return SHCD_ERR_ARGUMENT;
    }
    double left_ns[SHCD_BODIES_MAX];
    size_t n_tools_left = 0;
    for (size_t b = 0; b < scene->n_bodies; b++) {
        left_ns[b] = 1e3 * scene->bodies[b].accuracy.budget_us;
    }
    for (size_t t = 0; t < scene->n_tools; t++) {
        n_tools_left += (input->tools[t].flags & SHCD_TOOL_INPUT_ACTIVE) != 0;
    }
    move_gains(scene, state, input->dt_s);
    begin_effects(scene, state, output);
    evolve(scene, state, input, output);
    for (size_t t = 0; t < scene->n_tools; t++) {
        const shcd_tool_output nothing = {.distance_m = HUGE_VAL, .body = -1};
        output->tools[t] = nothing;
        if ((input->tools[t].flags & SHCD_TOOL_INPUT_ACTIVE) == 0) {
            let_go(scene, state, t);
        } else if (!is_usable(&input->tools[t])) {
            /* the contacts stay: one bad sample must not let the tool out on the far side */
            output->tools[t].flags = SHCD_TOOL_OUTPUT_BAD_INPUT;
        } else {
            step_tool(scene, state, t, left_ns, n_tools_left, input, output);
        }
        n_tools_left -= (input->tools[t].flags & SHCD_TOOL_INPUT_ACTIVE) != 0;
    }
    respond_soft(scene, state, input, output);
    state->tick++;
    state->time_s += input->dt_s;
    return SHCD_OK;
}
