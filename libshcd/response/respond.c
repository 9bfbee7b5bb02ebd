/* SPDX-License-Identifier: BSD-3-Clause */
/* What the effects of a body make of its contacts.
 *
 * A contact with a rigid body is answered at once, tool by tool. One with a soft body is noted
 * first: how far a surface gives way under one contact depends on all of them, so their normal
 * forces are solved for together (soft_contact.c) when the last tool has been looked at, and what
 * remains of the effects acts on the result (respond_soft.c). */
#include "response/respond.h"
#include "response/chain.h"
#include "response/walls.h"

#include <string.h>

/* A contact of the tool, of which only the depth, the foot and the points are filled in. */
typedef struct found_contact {
    shcdi_touch touch;
    double share;        /* of the body's response */
    double energy_share; /* of the energy that it stores */
    shcd_vec3 slope;     /* the normal force acts along normal + slope */
    shcd_vec3 arm_m, other_arm_m;
    unsigned char *memory;
    bool is_new;
    bool is_wall;     /* shares one spring with the other walls of the tool */
    uint32_t wall;    /* which of them */
    bool is_reported; /* the tool's output describes it */
} found_contact;

static shcd_pose tool_in_body(const shcdi_visit *v, const shcdi_body *body) {
    const shcd_quat p = shcd_conjugate(body->body_in_world.orientation);
    const shcd_quat q = v->pose.orientation;
    const shcd_quat r = {p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z,
                         p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
                         p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x,
                         p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
    const shcd_pose pose = {shcd_transform_inverse(body->body_in_world, v->pose.position_m),
                            shcdi_unit_quaternion(r)};
    return pose;
}

/* The foot, its normal and the velocities, in the body frame. */
static void set_motion(const shcdi_visit *v, const shcdi_body *body, const shcdi_press *press,
                       found_contact *f) {
    const shcd_vec3 velocity =
        shcd_add(v->velocity_m_per_s, shcd_cross(v->angular_velocity_rad_per_s, f->other_arm_m));
    shcdi_touch *t = &f->touch;
    t->model = body->model;
    t->dt_s = v->input->dt_s;
    t->velocity_m_per_s = shcd_rotate(shcd_conjugate(body->body_in_world.orientation), velocity);
    if (press != NULL) {
        const double shown =
            shcdi_soft_gain_of(body->soft, shcdi_gains_of(v->scene, v->state) + body->first_effect)
                .shown;
        t->wave_share = shown * shown; /* of what the membrane gives way */
    }
    t->depth_rate_m_per_s = -shcd_dot(t->velocity_m_per_s, t->normal);
}

static void respond(shcdi_visit *v, size_t b, found_contact *f) {
    const shcdi_body *body = &v->scene->bodies[b];
    unsigned char *bytes = (unsigned char *)v->state;
    shcdi_response r = {.depth_m = f->touch.depth_m, .slope = f->slope};
    shcdi_press *press = body->soft != NULL ? shcdi_soft_note(body->soft, bytes + body->soft_offset,
                                                              f->touch.parameter)
                                            : NULL;
    set_motion(v, body, press, f);
    if (f->is_new) {
        memset(f->memory, 0, body->memory_bytes);
    }
    const shcdi_chain c = {v->scene,
                           body,
                           shcdi_gains_of(v->scene, v->state) + body->first_effect,
                           v->input,
                           v->output,
                           v->tool_index,
                           f->share,
                           f->energy_share,
                           &f->touch,
                           f->memory};
    shcdi_chain_act(&c, SHCDI_STAGE_BEND, &r);
    if (press != NULL) {
        press->touch = f->touch;
        press->response = r;
        press->arm_m = f->arm_m;
        press->other_arm_m = f->other_arm_m;
        press->share = f->share;
        press->memory_at = (uint64_t)(f->memory - bytes);
        press->tool = (uint32_t)v->tool_index;
        press->is_reported = f->is_reported;
        press->is_wall = f->is_wall;
        press->wall = f->wall;
        return;
    }
    r.flags |= body->soft != NULL ? (uint32_t)SHCD_TOOL_OUTPUT_DEGRADED : 0u;
    shcdi_chain_act(&c, SHCDI_STAGE_PRESS, &r);
    shcdi_chain_act(&c, SHCDI_STAGE_APPLY, &r);
    shcdi_chain_push(&c, &r, f->arm_m, f->other_arm_m);
}

static void respond_shell(shcdi_visit *v, size_t b) {
    const shcdi_body *body = &v->scene->bodies[b];
    const shcdi_shell *shell = &v->tool->shell;
    unsigned char *memory = shcdi_shell_memory(v->scene, v->state, v->tool_index, b);
    uint32_t n;
    const shcdi_slot *slot = shcdi_shell_contacts(shell, memory, &n);
    const shcd_pose pose = tool_in_body(v, body);
    for (uint32_t i = 0; i < n; i++) {
        const double share = slot[i].weight * shell->point_share;
        found_contact f = {.share = share, .energy_share = share};
        f.touch.along_part = f.touch.along_weight = 1.0;
        f.touch.tool_in_body = pose;
        f.touch.depth_m = slot[i].depth_m;
        f.touch.foot_depth_m = slot[i].depth_m;
        f.touch.normal = slot[i].proxy.normal;
        f.touch.foot_m = slot[i].proxy.foot_m;
        f.touch.parameter = slot[i].proxy.parameter;
        f.touch.tool_point_m = slot[i].proxy.tool_m;
        f.arm_m = shcd_rotate(v->pose.orientation, shell->point[slot[i].point]);
        f.other_arm_m = f.arm_m;
        f.memory = memory + shell->body_bytes + i * body->memory_bytes;
        f.is_new = slot[i].is_new != 0;
        respond(v, b, &f);
    }
    v->output->tools[v->tool_index].n_contacts += n;
}

/* A ball's contact with one wall. The normal force passes through the centre, to the bit. */
static found_contact ball_contact(const shcdi_visit *v, size_t b, shcd_vec3 centre_m,
                                  shcd_vec3 normal) {
    const shcdi_body *body = &v->scene->bodies[b];
    const shcd_vec3 down = shcd_scale(-v->tool->radius_m, normal);
    found_contact f = {.share = 1.0, .energy_share = 1.0};
    f.touch.along_part = f.touch.along_weight = 1.0;
    f.touch.normal = normal;
    f.touch.tool_radius_m = v->tool->radius_m;
    f.touch.tool_in_body = tool_in_body(v, body);
    f.touch.tool_point_m = shcd_add(centre_m, down);
    f.other_arm_m = shcd_rotate(body->body_in_world.orientation, down);
    return f;
}

/* The shares of two walls at a right angle add up to the root of 2; what acts along the surface
 * acts along the groove by all of it, and the device was promised one spring and one damper. */
static double part_along(const shcdi_contact *known) {
    double sum = 0.0;
    for (size_t k = 0; k < SHCDI_WALLS_MAX; k++) {
        sum += known->wall[k].is_touching != 0 ? known->wall[k].share : 0.0;
    }
    return 1.0 / shcdi_max(1.0, sum);
}

/* Of a rigid body the walls share one spring, walls.c; the law of a soft one is solved with the way
 * that its surface gives, and shared there. */
static found_contact wall_contact(const shcdi_visit *v, size_t b, const shcdi_contact *known,
                                  size_t k) {
    const shcdi_body *body = &v->scene->bodies[b];
    const shcdi_wall *wall = &known->wall[k];
    const bool is_soft = body->soft != NULL;
    found_contact f = ball_contact(v, b, known->proxy.tool_m, wall->normal);
    f.share = is_soft ? 1.0 - known->yielded : wall->share;
    f.energy_share = is_soft ? f.share : wall->energy_share;
    f.touch.depth_m = is_soft ? wall->depth_m : known->pressed_m;
    f.touch.foot_depth_m = wall->depth_m + wall->short_m;
    f.touch.along_part = is_soft ? 1.0 : part_along(known); /* of a soft one: divide_along() */
    f.touch.along_weight = f.share * f.touch.along_part;
    if (!is_soft) { /* else: soft_tilt.c */
        f.slope = wall->slope;
    }
    f.touch.foot_m = wall->foot_m;
    f.touch.parameter = wall->parameter;
    f.memory =
        shcdi_effect_memory(v->scene, v->state, v->tool_index, b) + k * v->scene->tool_memory_bytes;
    f.is_new = wall->is_new != 0;
    f.is_wall = true;
    f.wall = (uint32_t)k;
    f.is_reported = k == known->deepest && v->output->tools[v->tool_index].body == (int32_t)b;
    return f;
}

/* The laws' force on a wall, unbooked; its energy, and how much more or less force there is where
 * it is deeper or less deep by `way_m`. */
static shcd_vec3 law_at(const shcdi_visit *v, size_t b, const found_contact *f, double way_m,
                        double *energy_j, double *rise_n) {
    const shcdi_body *body = &v->scene->bodies[b];
    shcd_output unbooked = {.tools = NULL};
    const shcdi_chain c = {v->scene,
                           body,
                           shcdi_gains_of(v->scene, v->state) + body->first_effect,
                           v->input,
                           &unbooked,
                           v->tool_index,
                           f->share,
                           f->energy_share,
                           &f->touch,
                           f->memory};
    shcdi_response r = {.depth_m = f->touch.depth_m, .slope = f->slope};
    shcdi_chain_act(&c, SHCDI_STAGE_BEND, &r);
    shcdi_response deeper = r, shallower = r;
    deeper.depth_m += way_m;
    shallower.depth_m = shcdi_max(0.0, r.depth_m - way_m);
    shcdi_chain_act(&c, SHCDI_STAGE_PRESS, &r);
    shcdi_chain_act(&c, SHCDI_STAGE_PRESS, &deeper);
    shcdi_chain_act(&c, SHCDI_STAGE_PRESS, &shallower);
    *energy_j = f->energy_share * r.stored_j;
    *rise_n = shcdi_max(deeper.normal_force_n - r.normal_force_n,
                        r.normal_force_n - shallower.normal_force_n);
    return shcd_scale(f->share, shcd_mul_add(shcdi_chain_along(&c, &r), r.normal_force_n,
                                             shcd_add(f->touch.normal, r.slope)));
}

/* How many times as stiff as its law a relief may make a contact. */
#define BENT_STIFFER 4.0

/* An effect that bends the surface has its own slopes, which are springs, too, and which near a
 * focal point are no gradient. */
static bool is_bent(const shcdi_body *body) {
    bool is = false;
    for (size_t e = 0; e < body->n_effects; e++) {
        is |= body->effects[e].effect->bend != NULL;
    }
    return is;
}

/* Withholds from the walls of a rigid body what they have not been given, account.h. */
static void hold_account(const shcdi_visit *v, size_t b, shcdi_contact *known, found_contact f[],
                         size_t n) {
    const shcd_vec3 p = known->proxy.tool_m, moved_m = shcd_sub(p, known->held_at_m);
    const double way_m = shcd_norm(moved_m);
    shcd_vec3 force_n = {0.0, 0.0, 0.0};
    double energy_j = 0.0, most_n = 0.0;
    const shcdi_body *body = &v->scene->bodies[b];
    const bool has_bend = is_bent(body);
    const double gains =
        shcdi_gain_sum(body, shcdi_gains_of(v->scene, v->state) + body->first_effect);
    if (n < 2 && !known->account.is_open && !has_bend) {
        return; /* one wall's law has an energy */
    }
    for (size_t i = 0; i < n; i++) {
        double wall_j, rise_n;
        force_n = shcd_add(force_n, law_at(v, b, &f[i], way_m, &wall_j, &rise_n));
        energy_j += wall_j;
        most_n = shcdi_max(most_n, rise_n);
    }
    most_n *= 1.0 - known->yielded;
    if (has_bend) { /* as much stiffer as it has shown to be, up to a limit */
        const double kept = 1.0 - known->account.withheld;
        const double change_n = shcd_norm(shcd_sub(shcd_scale(kept, force_n), known->held_n));
        most_n = shcdi_max(most_n, shcdi_min(change_n, BENT_STIFFER * most_n));
    }
    const double slack_j = 0.5 * most_n * way_m;
    const double kept =
        shcdi_account_admit(&known->account, slack_j - shcd_dot(known->held_n, moved_m), energy_j,
                            gains, v->input->dt_s);
    known->held_at_m = p;
    known->held_n = shcd_scale(kept, force_n);
    for (size_t i = 0; i < n; i++) {
        f[i].share *= kept;
        f[i].energy_share *= kept;
        f[i].touch.along_weight *= kept;
    }
    v->output->tools[v->tool_index].flags |= shcdi_walls_flag((1.0 - known->yielded) * kept);
}

static void respond_walls(shcdi_visit *v, size_t b) {
    shcdi_contact *known = &shcdi_contacts_of(v->scene, v->state, v->tool_index)[b];
    const bool is_soft = v->scene->bodies[b].soft != NULL;
    found_contact f[SHCDI_WALLS_MAX];
    size_t n = 0;
    for (size_t k = 0; k < SHCDI_WALLS_MAX; k++) {
        const shcdi_wall *wall = &known->wall[k];
        if (wall->is_touching != 0 && (is_soft || wall->share > 0.0)) {
            f[n] = wall_contact(v, b, known, k);
            set_motion(v, &v->scene->bodies[b], NULL, &f[n++]);
        }
    }
    if (!is_soft) {
        hold_account(v, b, known, f, n);
    }
    for (size_t i = 0; i < n; i++) {
        respond(v, b, &f[i]);
    }
    v->output->tools[v->tool_index].n_contacts += (uint32_t)n;
}

static void respond_single(shcdi_visit *v, size_t b) {
    const shcdi_body *body = &v->scene->bodies[b];
    const shcdi_contact *known = &shcdi_contacts_of(v->scene, v->state, v->tool_index)[b];
    const shcdi_gap *gap = &v->gaps[b];
    found_contact f = ball_contact(v, b, known->proxy.tool_m, gap->normal);
    f.touch.depth_m = -gap->gap_m;
    f.touch.foot_depth_m = -gap->gap_m;
    f.touch.foot_m = gap->foot_m;
    f.touch.parameter = known->proxy.parameter;
    f.memory = shcdi_effect_memory(v->scene, v->state, v->tool_index, b);
    f.is_new = !v->was_touching[b];
    f.is_reported = v->output->tools[v->tool_index].body == (int32_t)b;
    if (v->tool->geometry != NULL) {
        f.touch.tool_point_m = gap->tool_point_m;
        f.arm_m =
            shcd_sub(shcd_transform(body->body_in_world, gap->tool_point_m), v->pose.position_m);
        f.other_arm_m = f.arm_m;
    }
    respond(v, b, &f);
    v->output->tools[v->tool_index].n_contacts++;
}

void shcdi_visit_respond(shcdi_visit *v) {
    const shcdi_contact *contacts = shcdi_contacts_of(v->scene, v->state, v->tool_index);
    for (size_t b = 0; b < v->scene->n_bodies; b++) {
        if (!v->is_visited[b] || !contacts[b].is_touching) {
            continue;
        }
        v->output->tools[v->tool_index].flags |= SHCD_TOOL_OUTPUT_CONTACT;
        if (v->tool->kind == SHCD_TOOL_SHELL) {
            respond_shell(v, b);
        } else if (v->tool->kind == SHCD_TOOL_SPHERE) {
            respond_walls(v, b);
        } else {
            respond_single(v, b);
        }
    }
}
