/* SPDX-License-Identifier: BSD-3-Clause */
#include "tick.h"

#include "shcd/vec.h"

#include "shcdmsg_tool_force_t.h"

#include <stdlib.h>

_Static_assert((int)TICK_STALE == SHCDMSG_TOOL_FORCE_T_STALE &&
                   (int)SAFETY_LIMITED == SHCDMSG_TOOL_FORCE_T_LIMITED &&
                   (int)SAFETY_SLEW == SHCDMSG_TOOL_FORCE_T_SLEW &&
                   (int)SAFETY_FAULT == SHCDMSG_TOOL_FORCE_T_FAULT &&
                   (int)SAFETY_RAMP == SHCDMSG_TOOL_FORCE_T_RAMP &&
                   (int)TICK_CONTACT == SHCDMSG_TOOL_FORCE_T_CONTACT &&
                   (int)TICK_INACTIVE == SHCDMSG_TOOL_FORCE_T_INACTIVE &&
                   (int)TICK_DISABLED == SHCDMSG_TOOL_FORCE_T_DISABLED &&
                   (int)TICK_DEGRADED == SHCDMSG_TOOL_FORCE_T_DEGRADED &&
                   (int)TICK_TRUNCATED == SHCDMSG_TOOL_FORCE_T_TRUNCATED &&
                   (int)TICK_SIGN_UNSURE == SHCDMSG_TOOL_FORCE_T_SIGN_UNSURE &&
                   (int)TICK_LATE == SHCDMSG_TOOL_FORCE_T_LATE &&
                   (int)TICK_FINAL == SHCDMSG_TOOL_FORCE_T_FINAL,
               "flags are those of the wire");

bool tick_init(tick_core *core, const daemon_config *config, mailbox poses[], ring *commands,
               ring *applied) {
    memset(core, 0, sizeof *core);
    core->config = config;
    core->poses = poses;
    core->commands = commands;
    core->applied = applied;
    core->limits.force_max_n = config->device->force_max_n;
    core->limits.torque_max_n_m = config->device->torque_max_n_m;
    core->limits.slew_max_n_per_s = config->device->slew_max_n_per_s;
    core->period_ns = (int64_t)(1e9 / config->rate_hz + 0.5);
    core->n_tools = shcd_scene_tool_count(config->scene);
    core->memory_size = EXCHANGE_STRIDE(shcd_state_size(config->scene));
    core->memory = aligned_alloc(EXCHANGE_LINE, core->memory_size);
    if (core->memory == NULL) {
        return false;
    }
    memset(core->memory, 0, core->memory_size);
    for (size_t i = 0; i < core->n_tools; i++) {
        core->inputs[i].tool_in_world.orientation.w = 1.0;
    }
    return shcd_state_init(config->scene, core->memory, core->memory_size, &core->state) == SHCD_OK;
}

void tick_free(tick_core *core) {
    free(core->memory);
    core->memory = NULL;
}

/* ---- commands ------------------------------------------------------------------------------- */

static bool is_quiet(const tick_core *core) {
    for (size_t i = 0; i < core->n_tools; i++) {
        if (core->tools[i].safety.gain > 0.0) {
            return false;
        }
    }
    return true;
}

static void confirm(tick_core *core, const tick_command *command) {
    tick_applied *slot = ring_reserve(core->applied);
    if (slot != NULL) { /* the callers made sure that there is room */
        slot->client_id = command->client_id;
        slot->cmd_id = command->cmd_id;
        slot->tick = core->tick;
        ring_commit(core->applied);
    }
}

/* The state may only be replaced while no force depends on it. */
static void finish_reset(tick_core *core) {
    if (shcd_state_init(core->config->scene, core->memory, core->memory_size, &core->state) !=
        SHCD_OK) {
        return; /* cannot be: the same call succeeded in tick_init() */
    }
    for (size_t i = 0; i < core->n_tools; i++) {
        core->tools[i].safety = (safety_state){0};
        core->tools[i].zeroed = false;
    }
    core->resetting = false;
    confirm(core, &core->reset);
}

static void take_commands(tick_core *core) {
    for (int n = 0; n < 8 && ring_reserve(core->applied) != NULL; n++) {
        if (core->resetting) {
            if (!is_quiet(core)) {
                return;
            }
            finish_reset(core);
            continue;
        }
        const tick_command *command = ring_peek(core->commands);
        if (command == NULL) {
            return;
        }
        if (command->op == SHCDMSG_COMMAND_T_RESET) {
            core->resetting = true;
            core->reset = *command;
        } else {
            for (size_t i = 0; i < core->n_tools; i++) {
                core->tools[i].zeroed = true;
                core->tools[i].was_disabled = false;
            }
            confirm(core, command);
        }
        ring_release(core->commands);
    }
}

/* ---- tools ---------------------------------------------------------------------------------- */

static void take_sample(tick_core *core, size_t i, int64_t now_ns, tool_result *result) {
    bool fresh;
    const tool_sample *sample = mailbox_front(&core->poses[i], &fresh);
    if (fresh) {
        core->samples[i] = *sample;
    }
    const tool_sample *s = &core->samples[i];
    /* a pose can arrive between the wake-up and this line: its age is 0, not negative */
    const int64_t age_ns = now_ns > s->recv_ns ? now_ns - s->recv_ns : 0;
    result->tool_id = core->config->tool_ids[i];
    result->flags = 0;
    result->seq = s->valid ? s->seq : -1;
    result->utime = s->utime;
    result->recv_ns = s->recv_ns;
    result->age_ns = s->valid ? age_ns : -1;

    tick_tool *tool = &core->tools[i];
    if (s->valid && !s->force_enable) {
        tool->was_disabled = true;
    } else if (s->valid && tool->was_disabled) {
        tool->zeroed = false;
    }

    shcd_tool_input *in = &core->inputs[i];
    const watchdog_level level = watchdog_of_age(result->age_ns);
    in->flags = level == WATCHDOG_INACTIVE ? 0u : (uint32_t)SHCD_TOOL_INPUT_ACTIVE;
    if (s->valid) {
        in->tool_in_world = s->tool_in_world;
    }
    in->velocity_m_per_s =
        level == WATCHDOG_FRESH ? s->velocity_m_per_s : shcd_vec3_make(0.0, 0.0, 0.0);
    in->angular_velocity_rad_per_s =
        level == WATCHDOG_FRESH ? s->angular_velocity_rad_per_s : shcd_vec3_make(0.0, 0.0, 0.0);
}

static safety_wish wish_for(const tick_core *core, size_t i, watchdog_level level, bool stop) {
    if (stop || core->resetting || core->degraded || core->tools[i].zeroed ||
        level >= WATCHDOG_RAMP) {
        return SAFETY_FADE;
    }
    return core->samples[i].force_enable ? SAFETY_FULL : SAFETY_CUT;
}

static uint32_t model_flags(uint32_t flags) {
    uint32_t r = 0;
    r |= (flags & SHCD_TOOL_OUTPUT_CONTACT) != 0 ? TICK_CONTACT : 0u;
    /* a shell that met its cap is a query that met its cap */
    r |= (flags & (SHCD_TOOL_OUTPUT_TRUNCATED | SHCD_TOOL_OUTPUT_DEGRADED)) != 0 ? TICK_TRUNCATED
                                                                                 : 0u;
    r |= (flags & SHCD_TOOL_OUTPUT_SIGN_UNSURE) != 0 ? TICK_SIGN_UNSURE : 0u;
    r |= (flags & SHCD_TOOL_OUTPUT_BAD_INPUT) != 0 ? SAFETY_FAULT : 0u;
    return r;
}

/* Contact data for the message; a number that is not finite is not sent either. */
static void copy_contact(const shcd_tool_output *out, bool active, tool_result *result) {
    const shcd_vec3 none = {0.0, 0.0, 0.0};
    const bool known = active && out->body >= 0 && shcd_vec3_is_finite(out->proxy_m) &&
                       shcd_vec3_is_finite(out->normal) &&
                       out->penetration_m - out->penetration_m == 0.0;
    result->proxy_m = known ? out->proxy_m : none;
    result->normal = known ? out->normal : none;
    result->penetration_m = known ? out->penetration_m : 0.0;
    result->body = known ? out->body : -1;
}

static void finish_tool(tick_core *core, size_t i, bool stepped, bool stop, double dt_s,
                        tool_result *result) {
    static const shcd_wrench zero = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    const shcd_tool_output *out = &core->outputs[i];
    const watchdog_level level = watchdog_of_age(result->age_ns);
    const bool active = level != WATCHDOG_INACTIVE;
    const bool fault = !stepped || (out->flags & SHCD_TOOL_OUTPUT_BAD_INPUT) != 0;
    const safety_wish wish = wish_for(core, i, level, stop);
    uint32_t flags;

    result->wrench =
        safety_apply(&core->limits, &core->tools[i].safety, active && !fault ? out->wrench : zero,
                     fault && wish == SAFETY_FULL ? SAFETY_CUT : wish, dt_s, &flags);
    flags |= stepped ? model_flags(active ? out->flags : 0u) : (uint32_t)SAFETY_FAULT;
    flags |= level == WATCHDOG_HOLD || level == WATCHDOG_RAMP ? TICK_STALE : 0u;
    flags |= active ? 0u : TICK_INACTIVE;
    flags |=
        core->tools[i].zeroed || (active && !core->samples[i].force_enable) ? TICK_DISABLED : 0u;
    flags |= core->degraded ? TICK_DEGRADED : 0u;
    result->flags |= flags;
    copy_contact(out, active && stepped, result);
}

static void mark_due(tick_tool *tool, int64_t now_ns, bool final, tool_result *result) {
    const uint32_t momentary = TICK_LATE;
    const bool changed = ((result->flags ^ tool->flags_published) & ~momentary) != 0;
    result->due = (result->flags & TICK_INACTIVE) == 0 || changed || final ||
                  now_ns - tool->published_ns >= TICK_IDLE_NS;
    if (result->due) {
        tool->flags_published = result->flags;
        tool->published_ns = now_ns;
    }
}

static void watch_gaps(tick_core *core, int64_t now_ns, int64_t missed) {
    if (missed > TICK_MISSED_MAX) {
        core->degraded = true;
        core->degraded_until_ns = now_ns + TICK_RECOVERY_NS;
    } else if (core->degraded && now_ns >= core->degraded_until_ns) {
        core->degraded = false;
    }
}

bool tick_run(tick_core *core, int64_t now_ns, int64_t missed, bool stop, tick_record *record) {
    const double period_s = 1e-9 * (double)core->period_ns;
    const double elapsed_s = period_s * (double)(missed + 1);
    const double dt_s =
        elapsed_s <= fmax(SAFETY_DT_MAX_S, period_s) ? elapsed_s : fmax(SAFETY_DT_MAX_S, period_s);
    core->tick++;
    watch_gaps(core, now_ns, missed);
    take_commands(core);

    record->tick = core->tick;
    record->utime_ns = now_ns;
    record->compute_us = 0.0f;
    record->n_tools = core->n_tools;
    for (size_t i = 0; i < core->n_tools; i++) {
        take_sample(core, i, now_ns, &record->tools[i]);
    }
    const shcd_input input = {dt_s, core->inputs, core->n_tools};
    shcd_output output = {core->outputs, core->n_tools};
    const bool stepped = shcd_step(core->config->scene, core->state, &input, &output) == SHCD_OK;
    for (size_t i = 0; i < core->n_tools; i++) {
        finish_tool(core, i, stepped, stop, dt_s, &record->tools[i]);
        record->tools[i].flags |= missed > 0 ? TICK_LATE : 0u;
    }

    const bool final = stop && is_quiet(core);
    for (size_t i = 0; i < core->n_tools; i++) {
        if (final) {
            record->tools[i].wrench = (shcd_wrench){{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
            record->tools[i].flags |= TICK_FINAL;
        }
        mark_due(&core->tools[i], now_ns, final, &record->tools[i]);
    }
    return final;
}
