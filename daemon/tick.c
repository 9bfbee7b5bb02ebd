/* SPDX-License-Identifier: BSD-3-Clause */
#include "tick.h"

#include "shcd/vec.h"

#include "shcdmsg_tool_force_t.h"

#include <stdlib.h>
#include <time.h>

_Static_assert((int)TICK_STALE == SHCDMSG_TOOL_FORCE_T_STALE &&
                   (int)SAFETY_LIMITED == SHCDMSG_TOOL_FORCE_T_LIMITED &&
                   (int)SAFETY_SLEW == SHCDMSG_TOOL_FORCE_T_SLEW &&
                   (int)PASSIVITY_ACTED == SHCDMSG_TOOL_FORCE_T_PASSIVITY &&
                   (int)SAFETY_FAULT == SHCDMSG_TOOL_FORCE_T_FAULT &&
                   (int)SAFETY_RAMP == SHCDMSG_TOOL_FORCE_T_RAMP &&
                   (int)TICK_CONTACT == SHCDMSG_TOOL_FORCE_T_CONTACT &&
                   (int)TICK_INACTIVE == SHCDMSG_TOOL_FORCE_T_INACTIVE &&
                   (int)TICK_DISABLED == SHCDMSG_TOOL_FORCE_T_DISABLED &&
                   (int)TICK_DEGRADED == SHCDMSG_TOOL_FORCE_T_DEGRADED &&
                   (int)TICK_TRUNCATED == SHCDMSG_TOOL_FORCE_T_TRUNCATED &&
                   (int)TICK_SIGN_UNSURE == SHCDMSG_TOOL_FORCE_T_SIGN_UNSURE &&
                   (int)TICK_LATE == SHCDMSG_TOOL_FORCE_T_LATE &&
                   (int)TICK_FINAL == SHCDMSG_TOOL_FORCE_T_FINAL &&
                   (int)TICK_EXTRAPOLATED == SHCDMSG_TOOL_FORCE_T_EXTRAPOLATED &&
                   (int)TICK_YIELDING == SHCDMSG_TOOL_FORCE_T_YIELDING,
               "flags are those of the wire");

bool tick_init(tick_core *core, const daemon_config *config, mailbox poses[], ring *commands,
               ring *applied) {
    device_profile late = *config->device;
    late.delay_s = fmax(late.delay_s, config->delay_s);
    memset(core, 0, sizeof *core);
    core->config = config;
    core->poses = poses;
    core->commands = commands;
    core->applied = applied;
    core->limits.force_max_n = config->device->force_max_n;
    core->limits.torque_max_n_m = config->device->torque_max_n_m;
    core->limits.slew_max_n_per_s = config->device->slew_max_n_per_s;
    core->period_ns = (int64_t)(1e9 / config->rate_hz + 0.5);
    core->passivity = (passivity_limits){.reserve_j = config->reserve_j,
                                         .damping_n_s_per_m = config->device->damping_n_s_per_m,
                                         .speed_max_m_per_s = config->device->speed_max_m_per_s,
                                         .turn_max_rad_per_s = config->device->turn_max_rad_per_s,
                                         .force_max_n = config->device->force_max_n,
                                         .torque_max_n_m = config->device->torque_max_n_m,
                                         .period_s = 1e-9 * (double)core->period_ns,
                                         .delays = device_delays(&late, config->rate_hz)};
    core->n_tools = shcd_scene_tool_count(config->scene);
    core->memory_size = EXCHANGE_STRIDE(shcd_state_size(config->scene));
    core->memory = aligned_alloc(EXCHANGE_LINE, core->memory_size);
    if (core->memory == NULL) {
        return false;
    }
    memset(core->memory, 0, core->memory_size);
    core->n_effects = shcd_scene_effect_count(config->scene);
    core->effects = calloc(core->n_effects + 1, sizeof *core->effects);
    core->effect_times = calloc(core->n_effects + 1, sizeof *core->effect_times);
    core->effect_forces_n =
        calloc(core->n_tools * core->n_effects + 1, sizeof *core->effect_forces_n);
    core->effect_energy_j = calloc(core->n_effects + 1, sizeof *core->effect_energy_j);
    if (core->effects == NULL || core->effect_times == NULL || core->effect_forces_n == NULL ||
        core->effect_energy_j == NULL) {
        return false;
    }
    for (size_t i = 0; i < core->n_tools; i++) {
        core->inputs[i].tool_in_world.orientation.w = 1.0;
    }
    return shcd_state_init(config->scene, core->memory, core->memory_size, &core->state) == SHCD_OK;
}

void tick_free(tick_core *core) {
    free(core->memory);
    free(core->effects);
    free(core->effect_times);
    free(core->effect_forces_n);
    free(core->effect_energy_j);
    core->effect_forces_n = NULL;
    core->effect_energy_j = NULL;
    core->memory = NULL;
    core->effects = NULL;
    core->effect_times = NULL;
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
        core->tools[i].passivity = (passivity_state){0};
        shcd_ledger_lift(&core->tools[i].ledger);
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
        } else if (command->op == SHCDMSG_COMMAND_T_SET_EFFECT) {
            const shcd_status status = shcd_state_switch(
                core->config->scene, core->state, command->effect, command->is_on, command->ramp_s);
            (void)status; /* commands.c has checked what could be refused */
            confirm(core, command);
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
        core->tools[i].in_debt || level >= WATCHDOG_RAMP) {
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
    r |= (flags & SHCD_TOOL_OUTPUT_EXTRAPOLATED) != 0 ? TICK_EXTRAPOLATED : 0u;
    r |= (flags & SHCD_TOOL_OUTPUT_YIELDING) != 0 ? TICK_YIELDING : 0u;
    r |= (flags & SHCD_TOOL_OUTPUT_BAD_INPUT) != 0 ? SAFETY_FAULT : 0u;
    return r;
}

/* Contact data for the message; a number that is not finite is not sent either. */
static void copy_contact(const shcd_tool_output *out, bool active, tool_result *result) {
    const shcd_vec3 none = {0.0, 0.0, 0.0};
    const bool known = active && out->body >= 0 && shcd_vec3_is_finite(out->proxy_m) &&
                       shcd_vec3_is_finite(out->normal) &&
                       out->penetration_m - out->penetration_m == 0.0 &&
                       out->displacement_m - out->displacement_m == 0.0;
    result->proxy_m = known ? out->proxy_m : none;
    result->normal = known ? out->normal : none;
    result->penetration_m = known ? out->penetration_m : 0.0;
    result->displacement_m = known ? out->displacement_m : 0.0;
    result->body = known ? out->body : -1;
}

/* Before the step: what the force of the last tick did while the tool came here. A tool that is
 * inactive has none, and its account begins anew. */
static void watch_energy(tick_core *core, size_t i, double dt_s, double elapsed_s) {
    tick_tool *tool = &core->tools[i];
    const shcd_tool_input *in = &core->inputs[i];
    const shcd_vec3 way =
        shcd_sub(in->tool_in_world.position_m, tool->ledger.tool_in_world.position_m);
    const double apart_s = 1e-9 * (double)(core->samples[i].recv_ns - tool->counted_ns);
    const double reach_m = PASSIVITY_JUMP * core->passivity.speed_max_m_per_s *
                           (apart_s > elapsed_s ? apart_s : elapsed_s);
    if ((in->flags & SHCD_TOOL_INPUT_ACTIVE) == 0) {
        shcd_ledger_lift(&tool->ledger);
        tool->passivity = (passivity_state){0};
        return;
    }
    if (shcd_norm(way) > reach_m) { /* no hand: a script, or a client that started again */
        shcd_ledger_lift(&tool->ledger);
        passivity_jump(&tool->passivity);
    }
    tool->counted_ns = core->samples[i].recv_ns;
    (void)shcd_ledger_move(&tool->ledger, &in->tool_in_world, dt_s);
    shcd_ledger_share(&tool->ledger, core->effect_forces_n + i * core->n_effects, core->n_effects,
                      core->effect_energy_j);
    passivity_observe(&core->passivity, &tool->passivity, tool->ledger.moved_m,
                      tool->ledger.turned_rad,
                      (core->outputs[i].flags & SHCD_TOOL_OUTPUT_CONTACT) != 0);
    tool->in_debt = tool->in_debt || passivity_is_in_debt(&core->passivity, &tool->passivity);
}

/* After the step: the end of the output chain, and the wrench that is held until the next tick. */
static shcd_wrench guard_energy(tick_core *core, size_t i, shcd_wrench model, shcd_wrench wrench,
                                double dt_s, uint32_t *flags) {
    tick_tool *tool = &core->tools[i];
    const shcd_vec3 velocity = shcd_scale(1.0 / dt_s, tool->ledger.moved_m);
    const shcd_vec3 turn = shcd_scale(1.0 / dt_s, tool->ledger.turned_rad);
    bool acted;
    shcd_wrench w =
        passivity_apply(&core->passivity, &tool->passivity, wrench, velocity, turn, &acted);
    *flags |= acted ? PASSIVITY_ACTED : 0u;
    core->passivity_ticks += acted;
    w = safety_finish(&tool->safety, w, flags);
    const shcd_ledger_input held = {
        .published = w, .model = model, .velocity_m_per_s = core->inputs[i].velocity_m_per_s};
    const bool is_held = shcd_ledger_hold(&tool->ledger, &held) == SHCD_OK;
    (void)is_held; /* false for an inactive tool only */
    if (tool->in_debt && tool->safety.gain == 0.0) {
        tool->in_debt = false;
        tool->passivity = (passivity_state){0};
    }
    /* A soft start inside a body raises the force of a spring that is pressed already: that energy
     * is its price, and not a sign of trembling. */
    if (tool->is_starting && tool->safety.gain == 1.0) {
        passivity_renew(&tool->passivity);
    }
    tool->is_starting = tool->safety.gain < 1.0;
    return w;
}

tick_energy tick_energy_of(const tick_core *core) {
    tick_energy sum = {.stored_j = core->stored_j,
                       .driven_j = core->driven_j,
                       .reserve_left_j = -1.0,
                       .passivity_ticks = core->passivity_ticks};
    for (size_t i = 0; i < core->n_tools; i++) {
        const tick_tool *tool = &core->tools[i];
        const double left_j = passivity_left(&core->passivity, &tool->passivity);
        sum.given_j += tool->ledger.given_j;
        sum.taken_j += tool->ledger.taken_j;
        sum.output_chain_j += tool->ledger.output_chain_j;
        if (left_j < HUGE_VAL && (i == 0 || left_j < sum.reserve_left_j)) {
            sum.reserve_left_j = left_j > 0.0 ? left_j : 0.0;
        }
    }
    return sum;
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

    const shcd_wrench model = active && !fault ? out->wrench : zero;
    result->wrench = safety_apply(&core->limits, &core->tools[i].safety, model,
                                  fault && wish == SAFETY_FULL ? SAFETY_CUT : wish, dt_s, &flags);
    result->wrench = guard_energy(core, i, model, result->wrench, dt_s, &flags);
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

/* ---- effects and shapes --------------------------------------------------------------------- */

static uint64_t clock_ns(void *user) {
    struct timespec t;
    (void)user;
    clock_gettime(CLOCK_MONOTONIC, &t); /* no system call, unlike the clocks of CPU time */
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static void note_effects(tick_core *core) {
    double stored_j = 0.0, driven_j = 0.0;
    for (size_t e = 0; e < core->n_effects; e++) {
        const shcd_effect_output *out = &core->effects[e];
        effect_time *t = &core->effect_times[e];
        t->n++;
        t->sum_ns += out->time_ns;
        t->max_ns = fmax(t->max_ns, out->time_ns);
        t->is_active = out->gain > 0.0 &&
                       (out->time_ns > 0.0 || out->stored_j != 0.0 || out->work_j != t->driven_j);
        t->energy_j = core->effect_energy_j[e];
        t->stored_j = out->stored_j;
        t->driven_j = out->work_j;
        stored_j += out->stored_j;
        driven_j += out->work_j;
    }
    core->stored_j = stored_j;
    core->driven_j = driven_j;
}

/* At most one body a tick: the sum over its modes takes microseconds. */
static void offer_shape(tick_core *core, int64_t now_ns) {
    deform_boxes *boxes = core->deforms;
    for (size_t n = 0; boxes != NULL && n < boxes->n_bodies; n++) {
        const size_t b = core->deform_body;
        core->deform_body = (b + 1) % boxes->n_bodies;
        if (!boxes->is_soft[b] || now_ns - core->deform_ns[b] < DEFORM_SOFT_NS) {
            continue;
        }
        deform_snapshot *slot = mailbox_back(&boxes->box[b]);
        slot->tick = core->tick;
        slot->utime_ns = now_ns;
        core->deform_ns[b] = now_ns;
        if (shcd_state_coefficients(core->config->scene, core->state, b, slot->coefficients,
                                    boxes->count[b]) == SHCD_OK) {
            mailbox_publish(&boxes->box[b]);
        }
        return;
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
        watch_energy(core, i, dt_s, elapsed_s);
    }
    const shcd_input input = {
        .dt_s = dt_s, .tools = core->inputs, .n_tools = core->n_tools, .clock_ns = clock_ns};
    shcd_output output = {.tools = core->outputs,
                          .n_tools = core->n_tools,
                          .effects = core->effects,
                          .n_effects = core->n_effects,
                          .effect_forces_n = core->effect_forces_n};
    const bool stepped = shcd_step(core->config->scene, core->state, &input, &output) == SHCD_OK;
    for (size_t i = 0; i < core->n_tools; i++) {
        finish_tool(core, i, stepped, stop, dt_s, &record->tools[i]);
        record->tools[i].flags |= missed > 0 ? TICK_LATE : 0u;
    }

    note_effects(core);
    offer_shape(core, now_ns);
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
