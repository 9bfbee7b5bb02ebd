/* SPDX-License-Identifier: BSD-3-Clause */
/* The state and the tick.
 *
 * Bodies are visited in the order of their certified lower bounds, those in contact first, and the
 * visit ends when the next bound proves that no body further on touches the tool or is nearer than
 * the nearest so far: a far body costs one square root. Forces are then summed in the order of the
 * scene, so that their sum does not depend on the order of the visit. */
#include "response/accuracy.h"
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
    const shcdi_tool *tool;
    shcd_pose pose; /* world */
    shcd_vec3 velocity_m_per_s, angular_velocity_rad_per_s;
    double dt_s;
    shcdi_contact *contacts; /* of this tool, one for each body */
    unsigned char *memory;   /* of this tool's effects */
    unsigned char *shells;   /* of this tool's shell, for the first body */
    size_t n_tools_left;     /* this one included */
    double *left_ns;         /* of each body's budget */
    bool is_visited[SHCD_BODIES_MAX];
    bool was_touching[SHCD_BODIES_MAX];
    shcdi_gap gaps[SHCD_BODIES_MAX]; /* of the visited bodies */
} visit;

static shcd_quat unit_quaternion(shcd_quat q) {
    const double n = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    q.w /= n;
    q.x /= n;
    q.y /= n;
    q.z /= n;
    return q;
}

/* Of a point or sphere only the centre counts. */
static shcd_pose pose_in_body(const visit *v, size_t b) {
    const shcd_pose body = v->scene->bodies[b].body_in_world;
    const shcd_quat p = shcd_conjugate(body.orientation);
    const shcd_quat q = v->pose.orientation;
    shcd_pose pose = {shcd_transform_inverse(body, v->pose.position_m), {1.0, 0.0, 0.0, 0.0}};
    if (v->tool->geometry != NULL) {
        pose.orientation.w = p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z;
        pose.orientation.x = p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y;
        pose.orientation.y = p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x;
        pose.orientation.z = p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w;
        pose.orientation = unit_quaternion(pose.orientation);
    }
    return pose;
}

static unsigned char *shell_memory(const visit *v, size_t b) {
    const shcdi_shell *shell = &v->tool->shell;
    return v->shells + b * shell->body_bytes + shell->n_slots * v->scene->bodies[b].memory_offset;
}

static void look_at(visit *v, size_t b, double *nearest_m) {
    const shcdi_body *body = &v->scene->bodies[b];
    const shcd_pose pose = pose_in_body(v, b);
    v->was_touching[b] = v->contacts[b].is_touching != 0;
    v->is_visited[b] = true;
    v->gaps[b].allowance_ns = shcdi_allowance(v->left_ns[b], v->n_tools_left);
    if (v->tool->geometry == NULL) {
        shcdi_contact_update(body, v->tool, &pose, v->dt_s, &v->contacts[b], &v->gaps[b]);
    } else if (v->tool->kind == SHCD_TOOL_SHELL) {
        shcdi_shell_update(body, v->tool, pose, v->dt_s, &v->contacts[b], shell_memory(v, b),
                           &v->gaps[b]);
    } else {
        shcdi_convex_update(body, v->tool, pose, v->dt_s, &v->contacts[b], &v->gaps[b]);
    }
    v->left_ns[b] =
        shcdi_max(0.0, v->left_ns[b] - shcdi_spent(&body->accuracy, v->gaps[b].n_evaluations,
                                                   v->gaps[b].n_patches));
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
        const shcd_pose ball = shcdi_ball_pose(v->tool, pose_in_body(v, b));
        bounds[b] = shcdi_contact_lower_bound(body, v->tool, &v->contacts[b], &ball);
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

/* What one contact of the tool is to the body's effects. World frame. */
typedef struct touch_point {
    double depth_m;
    double share; /* of the body's response */
    shcd_vec3 normal;
    shcd_vec3 from_origin_m; /* from the tool's origin; zero for point and sphere */
    unsigned char *memory;   /* of the effects, for this contact */
    bool is_new;
} touch_point;

/* Adds what the body's effects make of one contact, along the normal. On a point or a sphere about
 * the origin it passes through that, as every frictionless force does, so it has no torque. */
static void respond(const visit *v, const shcdi_body *body, const touch_point *at,
                    shcd_wrench *sum) {
    const shcd_vec3 velocity =
        shcd_add(v->velocity_m_per_s, shcd_cross(v->angular_velocity_rad_per_s, at->from_origin_m));
    const shcdi_touch touch = {at->depth_m, -shcd_dot(velocity, at->normal)};
    shcdi_response response = {0.0};
    if (at->is_new) {
        memset(at->memory, 0, body->memory_bytes);
    }
    for (size_t e = 0; e < body->n_effects; e++) {
        const shcdi_active_effect *active = &body->effects[e];
        active->effect->apply(active->constants, &touch, at->memory + active->state_offset,
                              &response);
    }
    const shcd_vec3 force = shcd_scale(at->share * response.normal_force_n, at->normal);
    sum->force_n = shcd_add(sum->force_n, force);
    sum->torque_n_m = shcd_add(sum->torque_n_m, shcd_cross(at->from_origin_m, force));
}

static void respond_shell(visit *v, size_t b, shcd_tool_output *out) {
    const shcdi_body *body = &v->scene->bodies[b];
    const shcdi_shell *shell = &v->tool->shell;
    unsigned char *memory = shell_memory(v, b);
    uint32_t n;
    const shcdi_slot *slot = shcdi_shell_contacts(shell, memory, &n);
    const shcd_quat turn = body->body_in_world.orientation;
    for (uint32_t i = 0; i < n; i++) {
        const touch_point at = {slot[i].depth_m,
                                slot[i].weight * shell->point_share,
                                shcd_rotate(turn, slot[i].proxy.normal),
                                shcd_rotate(v->pose.orientation, shell->point[slot[i].point]),
                                memory + shell->body_bytes + i * body->memory_bytes,
                                slot[i].is_new != 0};
        respond(v, body, &at, &out->wrench);
    }
    out->n_contacts += n;
}

static void respond_single(visit *v, size_t b, shcd_tool_output *out) {
    const shcdi_body *body = &v->scene->bodies[b];
    const shcdi_gap *gap = &v->gaps[b];
    touch_point at = {-gap->gap_m,
                      1.0,
                      shcd_rotate(body->body_in_world.orientation, gap->normal),
                      {0.0, 0.0, 0.0},
                      v->memory + body->memory_offset,
                      !v->was_touching[b]};
    if (v->tool->geometry != NULL) {
        at.from_origin_m =
            shcd_sub(shcd_transform(body->body_in_world, gap->tool_point_m), v->pose.position_m);
    }
    respond(v, body, &at, &out->wrench);
    out->n_contacts++;
}

static void add_counts(const shcdi_gap *gap, shcd_tool_output *out) {
    out->flags |= gap->flags;
    out->n_evaluations += gap->n_evaluations;
    out->n_patches += gap->n_patches;
    out->n_points_visited += gap->n_points_visited;
    out->n_points_left += gap->n_points_left;
    out->tier = shcdi_lower_tier(out->tier, gap->tier);
}

static void step_tool(visit *v, shcd_tool_output *out) {
    find_contacts(v);
    for (size_t b = 0; b < v->scene->n_bodies; b++) {
        const shcdi_body *body = &v->scene->bodies[b];
        const shcdi_gap *gap = &v->gaps[b];
        if (!v->is_visited[b]) {
            continue;
        }
        add_counts(gap, out);
        if (v->contacts[b].is_touching) {
            out->flags |= SHCD_TOOL_OUTPUT_CONTACT;
            if (v->tool->kind == SHCD_TOOL_SHELL) {
                respond_shell(v, b, out);
            } else {
                respond_single(v, b, out);
            }
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
           shcdi_is_moderate(tool->velocity_m_per_s) &&
           shcdi_is_moderate(tool->angular_velocity_rad_per_s);
}

static void let_go(const shcd_scene *scene, shcd_state *state, size_t t) {
    const shcdi_tool *tool = &scene->tools[t];
    shcdi_contact *contacts = state->contacts + t * scene->n_bodies;
    for (size_t b = 0; b < scene->n_bodies && tool->kind == SHCD_TOOL_SHELL; b++) {
        if (contacts[b].is_touching) {
            shcdi_shell_release(&tool->shell,
                                (unsigned char *)state + tool->state_offset +
                                    b * tool->shell.body_bytes +
                                    tool->shell.n_slots * scene->bodies[b].memory_offset);
        }
    }
    memset(contacts, 0, scene->n_bodies * sizeof *contacts);
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
    double left_ns[SHCD_BODIES_MAX];
    size_t n_tools_left = 0;
    for (size_t b = 0; b < scene->n_bodies; b++) {
        left_ns[b] = 1e3 * scene->bodies[b].accuracy.budget_us;
    }
    for (size_t t = 0; t < scene->n_tools; t++) {
        n_tools_left += (input->tools[t].flags & SHCD_TOOL_INPUT_ACTIVE) != 0;
    }
    for (size_t t = 0; t < scene->n_tools; t++) {
        const shcd_tool_input *tool = &input->tools[t];
        const shcd_tool_output nothing = {.distance_m = HUGE_VAL, .body = -1};
        shcd_tool_output out = nothing;
        if ((tool->flags & SHCD_TOOL_INPUT_ACTIVE) == 0) {
            let_go(scene, state, t);
        } else if (!is_usable(tool)) {
            /* the contacts stay: one bad sample must not let the tool out on the far side */
            out.flags = SHCD_TOOL_OUTPUT_BAD_INPUT;
        } else {
            visit v;
            v.scene = scene;
            v.tool = &scene->tools[t];
            v.pose.position_m = tool->tool_in_world.position_m;
            v.pose.orientation = unit_quaternion(tool->tool_in_world.orientation);
            v.velocity_m_per_s = tool->velocity_m_per_s;
            v.angular_velocity_rad_per_s = tool->angular_velocity_rad_per_s;
            v.dt_s = input->dt_s;
            v.n_tools_left = n_tools_left;
            v.left_ns = left_ns;
            v.contacts = state->contacts + t * scene->n_bodies;
            v.memory = effect_memory(scene, state, t);
            v.shells = (unsigned char *)state + v.tool->state_offset;
            memset(v.is_visited, 0, sizeof v.is_visited);
            step_tool(&v, &out);
        }
        n_tools_left -= (tool->flags & SHCD_TOOL_INPUT_ACTIVE) != 0;
        output->tools[t] = out;
    }
    state->tick++;
    state->time_s += input->dt_s;
    return SHCD_OK;
}
