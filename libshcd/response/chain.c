/* SPDX-License-Identifier: BSD-3-Clause */
/* An effect whose gain is neither 0 nor 1 acts in that proportion: an elastic law scaled by g under
 * the compliance W is the law itself under g W, times g; any other is blended with its absence. */
#include "response/chain.h"

double shcdi_since(const shcd_input *input, uint64_t before) {
    return (double)(input->clock_ns(input->clock_user) - before);
}

static void call(const shcdi_chain *c, const shcdi_active_effect *active, double gain,
                 shcdi_stage at, shcdi_response *r) {
    unsigned char *memory = c->memory + active->state_offset;
    if (at == SHCDI_STAGE_BEND) {
        active->effect->bend(active->constants, c->touch, memory, r);
    } else if (at == SHCDI_STAGE_PRESS) {
        double stored_j = 0.0;
        r->normal_force_n +=
            gain * active->effect->press(active->constants, c->touch, r->depth_m, 0.0, &stored_j);
        r->stored_j += gain * stored_j;
    } else {
        active->effect->apply(active->constants, c->touch, memory, r);
    }
}

static bool has_stage(const shcdi_effect *effect, shcdi_stage at) {
    return at == SHCDI_STAGE_BEND    ? effect->bend != NULL
           : at == SHCDI_STAGE_PRESS ? effect->press != NULL
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

static shcd_vec3 force_of(const shcdi_chain *c, const shcdi_response *r) {
    return shcd_mul_add(r->other_force_n, r->normal_force_n, shcd_add(c->touch->normal, r->slope));
}

void shcdi_chain_book(const shcdi_chain *c, size_t e, const shcdi_response *before,
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

void shcdi_chain_act(const shcdi_chain *c, shcdi_stage at, shcdi_response *r) {
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
        if (gain < 1.0 && at != SHCDI_STAGE_PRESS) {
            blend(&before, gain, r);
        }
        if (is_timed) {
            c->output->effects[c->body->first_effect + e].time_ns += shcdi_since(c->input, start);
        }
        if (is_booked) {
            shcdi_chain_book(c, e, &before, r);
        }
    }
}

void shcdi_chain_push(const shcdi_chain *c, const shcdi_response *r, shcd_vec3 arm_m,
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

shcd_vec3 shcdi_chain_along(const shcdi_chain *c, const shcdi_response *pressed) {
    shcd_vec3 sum = {0.0, 0.0, 0.0};
    for (size_t e = 0; e < c->body->n_effects; e++) {
        const shcdi_active_effect *active = &c->body->effects[e];
        shcdi_response r = *pressed;
        if (active->effect->press != NULL && active->effect->apply != NULL &&
            c->gains[e].now > 0.0) {
            call(c, active, 1.0, SHCDI_STAGE_APPLY, &r);
            sum = shcd_mul_add(sum, c->gains[e].now,
                               shcd_sub(r.other_force_n, pressed->other_force_n));
        }
    }
    return sum;
}
