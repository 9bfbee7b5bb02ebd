/* SPDX-License-Identifier: BSD-3-Clause */
/* What the effects of a soft body make of its contacts, which respond.c has noted: their normal
 * forces are solved for together, and what remains of the effects acts on the result. */
#include "response/chain.h"
#include "response/respond.h"
#include "response/walls.h"

#include <string.h>

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
        shcdi_touch *t = &press[i].touch;
        if (count > 1.0) {
            t->along_part = sum > 0.0 ? press[i].response.normal_force_n / sum : 1.0 / count;
        }
        if (press[i].is_wall) {
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

/* What the hand of a tool gave since the last tick by the law's force that was held, and what
 * holding it may yield; HUGE_VAL for one that begins to press, by its way or put there. */
static double given_by(const shcdi_contact *contact, size_t tool, const shcdi_soft_parts *p) {
    const shcd_vec3 moved_m = shcd_sub(contact->last_m, contact->held_at_m);
    bool begins = false;
    if (shcd_norm(contact->held_n) > 0.0) {
        return 0.5 * p->head->law_n_per_m * shcd_dot(moved_m, moved_m) -
               shcd_dot(contact->held_n, moved_m);
    }
    for (uint32_t i = 0; i < p->head->n_presses; i++) {
        begins |= p->press[i].tool == tool && p->press[i].response.depth_m > 0.0;
    }
    return begins ? HUGE_VAL : 0.0;
}

/* What may be stored now, account.h; what is known is what balls give. */
static double most_of(const shcd_scene *scene, shcd_state *state, size_t b,
                      const shcdi_soft_parts *p, double dt_s) {
    const shcdi_body *body = &scene->bodies[b];
    const double gains = shcdi_gain_sum(body, shcdi_gains_of(scene, state) + body->first_effect);
    bool is_known = body->soft->law >= 0 && p->head->n_presses > 0;
    double given_j = 0.0;
    for (uint32_t i = 0; i < p->head->n_presses; i++) {
        is_known &= p->press[i].is_wall != 0;
    }
    for (size_t t = 0; t < scene->n_tools && is_known; t++) {
        given_j += given_by(&shcdi_contacts_of(scene, state, t)[b], t, p);
    }
    const double most_j = shcdi_account_most(&p->head->account, given_j, gains, is_known, dt_s);
    for (uint32_t i = 0; i < p->head->n_presses; i++) {
        p->press[i].share *= p->press[i].is_wall ? 1.0 - p->head->account.withheld : 1.0;
    }
    return most_j;
}

/* What is stored now, and what is held from now on. */
static void settle(const shcd_scene *scene, shcd_state *state, size_t b, const shcdi_soft_parts *p,
                   double most_j) {
    const double drive_j = p->head->drive_work_j - p->head->booked_work_j;
    const bool has_law = scene->bodies[b].soft->law >= 0;
    double stored_j = p->head->stored_j, slope = 0.0;
    bool has_groove = p->head->account.is_open != 0;
    for (size_t t = 0; t < scene->n_tools; t++) {
        shcdi_contact *contact = &shcdi_contacts_of(scene, state, t)[b];
        const shcd_vec3 none = {0.0, 0.0, 0.0};
        contact->held_at_m = contact->last_m;
        contact->held_n = none;
    }
    for (uint32_t i = 0; i < p->head->n_presses; i++) {
        const shcdi_press *press = &p->press[i];
        const shcdi_response *r = &press->response;
        const double force_n = press->share * r->normal_force_n;
        shcdi_contact *contact = &shcdi_contacts_of(scene, state, press->tool)[b];
        p->press[i].response.flags |= press->is_wall ? shcdi_walls_flag(press->share) : 0u;
        contact->held_n =
            shcd_mul_add(contact->held_n, force_n, shcd_add(press->touch.normal, r->slope));
        slope = shcdi_max(slope, press->slope_n_per_m);
        stored_j += press->share * r->stored_j;
        has_groove |= i > 0 && press->tool == press[-1].tool && press->is_wall != 0;
    }
    p->head->booked_work_j = p->head->drive_work_j;
    p->head->law_n_per_m = shcdi_max(p->head->n_presses > 0 ? p->head->law_n_per_m : 0.0, slope);
    if (has_groove && has_law) {
        shcdi_account_settle(&p->head->account, most_j + drive_j, stored_j);
    }
}

/* A surface that is driven carries what rubs on it: its velocities at the contacts, and its work on
 * the forces that were held since the last tick. */
static void carry(const shcd_scene *scene, shcd_state *state, size_t b, const shcdi_soft_parts *p,
                  double carried, double dt_s) {
    const shcd_vec3 none = {0.0, 0.0, 0.0};
    unsigned char *memory = (unsigned char *)state + scene->bodies[b].soft_offset;
    for (size_t t = 0; t < scene->n_tools; t++) {
        shcdi_contact *contact = &shcdi_contacts_of(scene, state, t)[b];
        shcd_vec3 sum = none;
        double count = 0.0;
        for (uint32_t i = 0; i < p->head->n_presses; i++) {
            shcdi_touch *touch = &p->press[i].touch;
            if (p->press[i].tool == t) {
                touch->surface_velocity_m_per_s =
                    shcdi_soft_velocity(scene->bodies[b].soft, memory, i, carried);
                sum = shcd_add(sum, touch->surface_velocity_m_per_s);
                count += 1.0;
            }
        }
        if (count > 0.0) {
            p->head->carried_work_j += dt_s / count * shcd_dot(contact->rubbing_n, sum);
        }
        contact->rubbing_n = none;
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
    const shcdi_soft_parts parts = shcdi_soft_parts_of(body->soft, memory);
    const double most_j = most_of(scene, state, b, &parts, input->dt_s);
    shcdi_soft_press(body->soft, memory, has_law ? &body->effects[e] : NULL, gain, most_j);
    report_ends(scene, state, b, gain.shown, output); /* of the forces that moved the modes */
    shcdi_soft_tilt(body->soft, memory, gain.shown);
    if (is_timed) {
        output->effects[body->first_effect + wave].time_ns += shcdi_since(input, start);
    }
    const uint32_t n_presses = parts.head->n_presses;
    shcdi_press *press = parts.press;
    settle(scene, state, b, &parts, most_j);
    yield_walls(scene, state, b, input->dt_s, press, n_presses);
    divide_along(press, n_presses);
    if (carried > 0.0) {
        carry(scene, state, b, &parts, carried, input->dt_s);
    }
    for (uint32_t i = 0; i < n_presses; i++) {
        shcdi_press *p = &press[i];
        const shcdi_response nothing = {.depth_m = p->response.depth_m,
                                        .other_force_n = p->response.other_force_n};
        const shcdi_chain c = {
            scene,   body,     gains,    input,     output,
            p->tool, p->share, p->share, &p->touch, (unsigned char *)state + p->memory_at};
        shcdi_chain_book(&c, e, &nothing, &p->response);
        shcdi_chain_act(&c, SHCDI_STAGE_APPLY, &p->response);
        shcdi_chain_push(&c, &p->response, p->arm_m, p->other_arm_m);
        if (carried > 0.0) {
            shcdi_contact *contact = &shcdi_contacts_of(scene, state, p->tool)[b];
            contact->rubbing_n =
                shcd_mul_add(contact->rubbing_n, p->share, p->response.other_force_n);
        }
    }
    /* they hold the model's address, and a state none */
    memset(press, 0, n_presses * sizeof *press);
}
