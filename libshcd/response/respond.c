/* SPDX-License-Identifier: BSD-3-Clause */
/* What the effects of a body make of its contacts.
 *
 * A contact with a rigid body is answered at once, tool by tool. One with a soft body is noted
 * first: how far a surface gives way under one contact depends on all of them, so their normal
 * forces are solved for together (soft_contact.c) when the last tool has been looked at, and what
 * remains of the effects acts on the result.
 *
 * An effect whose gain is neither 0 nor 1 acts in that proportion: an elastic law scaled by g under
 * the compliance W is the law itself under g W, times g; any other is blended with its absence. */
#include "response/respond.h"

#include "response/walls.h"

#include <string.h>

typedef enum stage { STAGE_BEND, STAGE_PRESS, STAGE_APPLY } stage;

/* A contact while effects act on it. */
typedef struct contact {
    const shcd_scene *scene;
    const shcdi_body *body;
    const shcdi_gain *gains; /* of the body's effects */
    const shcd_input *input;
    shcd_output *output;
    size_t tool;
    double share, energy_share;
    const shcdi_touch *touch;
    unsigned char *memory;
} contact;

static bool has_effect(const contact *c) {
    return c->body->n_effects > 0;
}

static double since(const shcd_input *input, uint64_t before) {
    return (double)(input->clock_ns(input->clock_user) - before);
}

/* ---- one effect ----------------------------------------------------------------------------- */

static void call(const contact *c, const shcdi_active_effect *active, double gain, stage at,
                 shcdi_response *r) {
    unsigned char *memory = c->memory + active->state_offset;
    if (at == STAGE_BEND) {
        active->effect->bend(active->constants, c->touch, memory, r);
    } else if (at == STAGE_PRESS) {
        double stored_j = 0.0;
        r->normal_force_n +=
            gain * active->effect->press(active->constants, c->touch, r->depth_m, 0.0, &stored_j);
        r->stored_j += gain * stored_j;
    } else {
        active->effect->apply(active->constants, c->touch, memory, r);
    }
}

static bool has_stage(const shcdi_effect *effect, stage at) {
    return at == STAGE_BEND    ? effect->bend != NULL
           : at == STAGE_PRESS ? effect->press != NULL
                               : effect->apply != NULL;
}

static void blend(const shcdi_response *before, double gain, shcdi_response *r) {
    r->depth_m = before->depth_m + gain * (r->depth_m - before->depth_m);
    r->normal_force_n =
        before->normal_force_n + gain * (r->normal_force_n - before->normal_force_n);
    r->stored_j = before->stored_j + gain * (r->stored_j - before->stored_j);
    r->anchored_j = before->anchored_j + gain * (r->anchored_j - before->anchored_j);
    r->slope = shcd_mul_add(before->slope, gain, shcd_sub(r->slope, before->slope));
    r->other_force_n = shcd_mul_add(before->other_force_n, gain,
                                    shcd_sub(r->other_force_n, before->other_force_n));
}

static shcd_vec3 force_of(const contact *c, const shcdi_response *r) {
    return shcd_mul_add(r->other_force_n, r->normal_force_n, shcd_add(c->touch->normal, r->slope));
}

/* Books what an effect has changed. */
static void book(const contact *c, size_t e, const shcdi_response *before,
                 const shcdi_response *after) {
    const size_t i = c->body->first_effect + e;
    if (c->output->effects != NULL) {
        c->output->effects[i].stored_j += c->energy_share * (after->stored_j - before->stored_j) +
                                          c->share * (after->anchored_j - before->anchored_j);
    }
    if (c->output->effect_forces_n != NULL) {
        const shcd_vec3 change = shcd_sub(force_of(c, after), force_of(c, before));
        shcd_vec3 *sum = &c->output->effect_forces_n[c->tool * c->output->n_effects + i];
        *sum =
            shcd_mul_add(*sum, c->share, shcd_rotate(c->body->body_in_world.orientation, change));
    }
}

static void act(const contact *c, stage at, shcdi_response *r) {
    const bool is_booked = c->output->effects != NULL || c->output->effect_forces_n != NULL;
    const bool is_timed = c->output->effects != NULL && c->input->clock_ns != NULL;
    for (size_t e = 0; e < c->body->n_effects; e++) {
        const shcdi_active_effect *active = &c->body->effects[e];
        const double gain = c->gains[e].now;
        if (!has_stage(active->effect, at) || gain == 0.0) {
            continue;
        }
        const shcdi_response before = *r;
        const uint64_t start = is_timed ? c->input->clock_ns(c->input->clock_user) : 0;
        call(c, active, gain, at, r);
        if (gain < 1.0 && at != STAGE_PRESS) {
            blend(&before, gain, r);
        }
        if (is_timed) {
            c->output->effects[c->body->first_effect + e].time_ns += since(c->input, start);
        }
        if (is_booked) {
            book(c, e, &before, r);
        }
    }
}

/* ---- one contact ---------------------------------------------------------------------------- */

static void add_wrench(const contact *c, const shcdi_response *r, shcd_vec3 arm_m,
                       shcd_vec3 other_arm_m) {
    const shcd_quat turn = c->body->body_in_world.orientation;
    const shcd_vec3 along = shcd_rotate(
        turn, shcd_scale(c->share * r->normal_force_n, shcd_add(c->touch->normal, r->slope)));
    const shcd_vec3 other = shcd_rotate(turn, shcd_scale(c->share, r->other_force_n));
    shcd_tool_output *out = &c->output->tools[c->tool];
    out->wrench.force_n = shcd_add(out->wrench.force_n, shcd_add(along, other));
    out->wrench.torque_n_m = shcd_add(
        out->wrench.torque_n_m, shcd_add(shcd_cross(arm_m, along), shcd_cross(other_arm_m, other)));
    out->flags |= r->flags;
}

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
    const contact c = {v->scene,
                       body,
                       shcdi_gains_of(v->scene, v->state) + body->first_effect,
                       v->input,
                       v->output,
                       v->tool_index,
                       f->share,
                       f->energy_share,
                       &f->touch,
                       f->memory};
    if (has_effect(&c)) {
        act(&c, STAGE_BEND, &r);
    }
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
    act(&c, STAGE_PRESS, &r);
    act(&c, STAGE_APPLY, &r);
    add_wrench(&c, &r, f->arm_m, f->other_arm_m);
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
static void respond_walls(shcdi_visit *v, size_t b) {
    const shcdi_contact *known = &shcdi_contacts_of(v->scene, v->state, v->tool_index)[b];
    const shcdi_body *body = &v->scene->bodies[b];
    const shcd_vec3 none = {0.0, 0.0, 0.0};
    for (size_t k = 0; k < SHCDI_WALLS_MAX; k++) {
        const shcdi_wall *wall = &known->wall[k];
        const bool is_soft = body->soft != NULL;
        if (wall->is_touching == 0 || (!is_soft && wall->share == 0.0)) {
            continue;
        }
        found_contact f = ball_contact(v, b, known->proxy.tool_m, wall->normal);
        f.share = is_soft ? 1.0 - known->yielded : wall->share;
        f.energy_share = is_soft ? f.share : wall->energy_share;
        f.touch.depth_m = is_soft ? wall->depth_m : known->pressed_m;
        f.touch.foot_depth_m = wall->depth_m + wall->short_m;
        f.touch.along_part = is_soft ? 1.0 : part_along(known); /* of a soft one: divide_along() */
        f.touch.along_weight = f.share * f.touch.along_part;
        f.slope = is_soft ? none : wall->slope; /* of a soft one: soft_tilt.c */
        f.touch.foot_m = wall->foot_m;
        f.touch.parameter = wall->parameter;
        f.memory = shcdi_effect_memory(v->scene, v->state, v->tool_index, b) +
                   k * v->scene->tool_memory_bytes;
        f.is_new = wall->is_new != 0;
        f.is_wall = true;
        f.wall = (uint32_t)k;
        f.is_reported = k == known->deepest && v->output->tools[v->tool_index].body == (int32_t)b;
        respond(v, b, &f);
        v->output->tools[v->tool_index].n_contacts++;
    }
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

/* ---- soft bodies ---------------------------------------------------------------------------- */

/* The output was filled in against the surface before the contacts' forces moved it, and a long
 * tick moves it far: where the same point of the surface is at the tick's end counts. (The depth
 * that a contact is solved with may be less: a wall that fades in.) */
static void report_end(const shcd_scene *scene, shcd_state *state, size_t b, const shcdi_press *p,
                       shcd_vec3 moved_m, shcd_tool_output *out) {
    const shcdi_body *body = &scene->bodies[b];
    const shcdi_proxy *proxy = &shcdi_contacts_of(scene, state, p->tool)[b].proxy;
    const shcdi_series *series = &body->model->series;
    const shcd_vec3 rest = shcdi_surface_point(series, series->degree, proxy->parameter);
    const double depth_m = -out->distance_m + shcd_dot(moved_m, p->touch.normal);
    out->distance_m = -depth_m;
    out->penetration_m = shcdi_max(0.0, depth_m);
    out->displacement_m = shcd_norm(shcd_add(shcd_sub(proxy->foot_m, rest), moved_m));
    out->proxy_m = shcd_add(out->proxy_m, shcd_rotate(body->body_in_world.orientation, moved_m));
}

static void report_ends(const shcd_scene *scene, shcd_state *state, size_t b, double shown,
                        shcd_output *output) {
    const shcdi_soft *soft = scene->bodies[b].soft;
    unsigned char *memory = (unsigned char *)state + scene->bodies[b].soft_offset;
    const shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    for (uint32_t i = 0; i < p.head->n_presses; i++) {
        if (p.press[i].is_reported) {
            report_end(scene, state, b, &p.press[i], shcdi_soft_motion(soft, memory, i, shown),
                       &output->tools[p.press[i].tool]);
        }
    }
}

/* How much of its velocity a surface imparts to what rubs on it: that of a body which `pulse`
 * moves.
 *
 * Damping, friction and viscosity act on the tool and do not push the body in turn. Against a
 * surface that moves under the tool's own force that would yield energy wherever the surface lags
 * behind (a damper gives the tool c (v_s - v) v of which the body pays nothing), so there they act
 * against the rest shape, as dampers and anchors to the ground, which cannot. What a heartbeat
 * gives comes from outside in any case. */
static double carried_by(const shcdi_body *body, shcdi_soft_gain gain) {
    const int32_t pulse = body->soft->pulse;
    return pulse >= 0 && body->effects[pulse].constants[SHCDI_PULSE_AMPLITUDE] > 0.0
               ? gain.shown * gain.pulse
               : 0.0;
}

/* The walls of a tool share the springs and dampers along the surface as they share its normal
 * force: a wall that begins takes nothing at once. */
static void divide_along(shcdi_press *press, uint32_t n_presses) {
    for (uint32_t i = 0; i < n_presses; i++) {
        double sum = 0.0, count = 0.0;
        for (uint32_t j = 0; j < n_presses && press[i].is_wall; j++) {
            if (press[j].is_wall && press[j].tool == press[i].tool) {
                sum += press[j].response.normal_force_n;
                count += 1.0;
            }
        }
        if (count > 1.0) {
            shcdi_touch *t = &press[i].touch;
            t->along_part = sum > 0.0 ? press[i].response.normal_force_n / sum : 1.0 / count;
            t->along_weight = press[i].share * t->along_part;
        }
    }
}

/* What the walls of a tool have come to, and with it whether its contact yields. */
static void yield_walls(const shcd_scene *scene, shcd_state *state, size_t b, double dt_s,
                        const shcdi_press *press, uint32_t n_presses) {
    for (uint32_t i = 0; i < n_presses; i++) {
        const shcdi_press *p = &press[i];
        shcdi_contact *contact = &shcdi_contacts_of(scene, state, p->tool)[b];
        if (p->is_wall) {
            contact->wall[p->wall].way_m = p->way_m;
            contact->wall[p->wall].share = p->way_share;
            contact->wall[p->wall].slope = p->tilt;
        }
        if (p->is_wall && (i + 1 == n_presses || p[1].tool != p->tool)) {
            shcdi_walls_yield(dt_s, contact);
        }
    }
}

void shcdi_respond_soft(const shcd_scene *scene, shcd_state *state, size_t b,
                        const shcd_input *input, shcd_output *output) {
    const shcdi_body *body = &scene->bodies[b];
    unsigned char *memory = (unsigned char *)state + body->soft_offset;
    const shcdi_gain *gains = shcdi_gains_of(scene, state) + body->first_effect;
    const size_t wave = (size_t)body->soft->wave;
    const shcdi_soft_gain gain = shcdi_soft_gain_of(body->soft, gains);
    const double carried = carried_by(body, gain);
    const bool has_law = body->soft->law >= 0;
    const size_t e = has_law ? (size_t)body->soft->law : wave;
    const bool is_timed = output->effects != NULL && input->clock_ns != NULL;
    const uint64_t start = is_timed ? input->clock_ns(input->clock_user) : 0;
    shcdi_soft_press(body->soft, memory, has_law ? &body->effects[e] : NULL, gain);
    report_ends(scene, state, b, gain.shown, output); /* of the forces that moved the modes */
    shcdi_soft_tilt(body->soft, memory, gain.shown);
    if (is_timed) {
        output->effects[body->first_effect + wave].time_ns += since(input, start);
    }
    const shcdi_soft_state *soft = (const shcdi_soft_state *)(const void *)memory;
    shcdi_press *press = shcdi_soft_parts_of(body->soft, memory).press;
    yield_walls(scene, state, b, input->dt_s, press, soft->n_presses);
    divide_along(press, soft->n_presses);
    for (uint32_t i = 0; i < soft->n_presses; i++) {
        shcdi_press *p = &press[i];
        const shcdi_response nothing = {.depth_m = p->response.depth_m,
                                        .other_force_n = p->response.other_force_n};
        const contact c = {
            scene,   body,     gains,    input,     output,
            p->tool, p->share, p->share, &p->touch, (unsigned char *)state + p->memory_at};
        if (carried > 0.0) {
            p->touch.surface_velocity_m_per_s = shcdi_soft_velocity(body->soft, memory, i, carried);
        }
        book(&c, e, &nothing, &p->response);
        act(&c, STAGE_APPLY, &p->response);
        add_wrench(&c, &p->response, p->arm_m, p->other_arm_m);
    }
    /* they hold the model's address, and a state none */
    memset(press, 0, soft->n_presses * sizeof *press);
}
