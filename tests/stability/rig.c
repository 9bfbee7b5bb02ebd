/* SPDX-License-Identifier: BSD-3-Clause */
#include "rig.h"

#include "shcd/vec.h"
#include "support/scene_fixture.h"

const device_profile rig_bare_device = {"bare", 1e9, 1e9, 1e18, 1e9, 1e3, 0.0, 1e3, 1e3, 0.1};

static shcd_scene *make_scene(const rig_setup *setup) {
    const shcd_parameter_value k = {.name = "k_n_per_m", .value = setup->stiffness_n_per_m};
    const shcd_parameter_value ratio = {.name = "ratio", .value = setup->damping_ratio};
    const shcd_parameter_value rub = {.name = "stiffness_n_per_m",
                                      .value = setup->friction_n_per_m};
    const shcd_parameter_value wave[2] = {
        {.name = "youngs_modulus_pa", .value = setup->youngs_modulus_pa},
        {.name = "damping_ratio", .value = setup->wave_damping_ratio}};
    shcd_effect_def effects[4];
    size_t n = 0;
    if (setup->stiffness_n_per_m > 0.0) {
        effects[n++] = (shcd_effect_def){"stiffness", &k, 1};
    }
    if (setup->damping_ratio > 0.0) {
        effects[n++] = (shcd_effect_def){"damping", &ratio, 1};
    }
    if (setup->friction_n_per_m > 0.0) {
        effects[n++] = (shcd_effect_def){"friction", &rub, 1};
    }
    if (setup->youngs_modulus_pa > 0.0) {
        effects[n++] = (shcd_effect_def){"wave", wave, setup->wave_damping_ratio > 0.0 ? 2 : 1};
    }
    const shcd_vec3 at = setup->other_at_m;
    const shcd_body_def bodies[2] = {
        fixture_body("body", setup->model, fixture_pose(0, 0, 0), effects, n),
        fixture_body("other", setup->other, fixture_pose(at.x, at.y, at.z), effects, n)};
    const shcd_tool_def tool = fixture_tool("tool", setup->radius_m);
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    shcd_scene *scene = NULL;
    shcd_error error = {SHCD_OK, ""};
    def.bodies = bodies;
    def.n_bodies = setup->other != NULL ? 2 : 1;
    def.tools = &tool;
    def.n_tools = 1;
    if (shcd_scene_create(&def, NULL, &scene, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return scene;
}

double rig_static_stiffness(const rig_setup *setup) {
    const double nu = 0.45, patch_m = 0.005; /* the defaults of `wave` */
    if (!(setup->youngs_modulus_pa > 0.0)) {
        return setup->stiffness_n_per_m;
    }
    const double soft = 2.0 * setup->youngs_modulus_pa / (1.0 - nu * nu) * patch_m;
    return setup->stiffness_n_per_m > 0.0 ? 1.0 / (1.0 / setup->stiffness_n_per_m + 1.0 / soft)
                                          : soft;
}

double rig_tick_stiffness(const rig_setup *setup) {
    double tick = setup->stiffness_n_per_m, held;
    if (!(tick > 0.0)) {
        shcd_scene *scene = make_scene(setup);
        assert_int_equal(
            shcd_scene_wave_stiffness(scene, 0, 1.0 / setup->hand.rate_hz, &tick, &held), SHCD_OK);
        tick = fmax(tick, held);
        shcd_scene_free(scene);
    }
    return fmax(tick, setup->friction_n_per_m);
}

void rig_open(rig *r, const rig_setup *setup, shcd_vec3 position_m) {
    memset(r, 0, sizeof *r);
    r->config.rate_hz = setup->hand.rate_hz;
    r->config.device = setup->device;
    r->config.reserve_j = setup->reserve_j;
    r->config.delay_s = setup->delay_s;
    r->config.scene = make_scene(setup);
    const size_t poses = MAILBOX_BYTES(sizeof(tool_sample));
    const size_t commands = RING_BYTES(sizeof(tick_command), 2);
    const size_t applied = RING_BYTES(sizeof(tick_applied), 2);
    unsigned char *memory = aligned_alloc(EXCHANGE_LINE, poses + commands + applied);
    assert_non_null(memory);
    r->memory = memory;
    mailbox_init(&r->pose, memory, sizeof(tool_sample));
    ring_init(&r->commands, memory + poses, sizeof(tick_command), 2);
    ring_init(&r->applied, memory + poses + commands, sizeof(tick_applied), 2);
    assert_true(tick_init(&r->core, &r->config, &r->pose, &r->commands, &r->applied));
    hand_begin(&r->hand, &setup->hand, position_m);
    r->now_ns = 1000000000;
    for (int i = 0; i < 300; i++) { /* the soft start takes 0.2 s */
        rig_tick(r, position_m);
    }
    assert_true(r->core.tools[0].safety.gain == 1.0);
    r->taken_j = r->taken_most_j = 0.0;
    r->hand.dissipated_j = 0.0;
    r->excess_j = 0.0;
    r->n_guarded = 0;
}

void rig_close(rig *r) {
    tick_free(&r->core);
    shcd_scene_free(r->config.scene);
    free(r->memory);
}

static void send(rig *r) {
    const shcd_vec3 seen = hand_measured(&r->hand);
    tool_sample *sample = mailbox_back(&r->pose);
    const tool_sample fresh = {.seq = ++r->seq,
                               .utime = r->now_ns / 1000,
                               .recv_ns = r->now_ns,
                               .tool_in_world = {seen, {1.0, 0.0, 0.0, 0.0}},
                               .velocity_m_per_s =
                                   velocity_update(&r->velocity, r->now_ns / 1000, seen),
                               .valid = true,
                               .force_enable = true};
    *sample = fresh;
    mailbox_publish(&r->pose);
}

/* The position after so many substeps. */
static shcd_vec3 past(const hand *h, size_t n) {
    return h->history_m[(h->n_steps + HAND_HISTORY - n) % HAND_HISTORY];
}

/* How far the tool was, when the tick's force began to act, from the line between the two positions
 * about that instant which ticks see. */
static double unevenness(const hand *h) {
    const size_t part = h->delay_steps % HAND_SUBSTEPS;
    const double f = (double)part / HAND_SUBSTEPS;
    const shcd_vec3 line =
        shcd_add(shcd_scale(1.0 - f, past(h, HAND_SUBSTEPS + part)), shcd_scale(f, past(h, part)));
    return part > 0 ? shcd_norm(shcd_sub(past(h, HAND_SUBSTEPS), line)) : 0.0;
}

void rig_tick(rig *r, shcd_vec3 target_m) {
    r->now_ns += r->core.period_ns;
    send(r);
    (void)tick_run(&r->core, r->now_ns, 0, false, &r->record);
    r->most_contacts = r->core.outputs[0].n_contacts > r->most_contacts
                           ? r->core.outputs[0].n_contacts
                           : r->most_contacts;
    r->n_guarded += (r->record.tools[0].flags & PASSIVITY_ACTED) != 0;
    const shcd_vec3 last_n = r->force_n;
    r->force_n = r->record.tools[0].wrench.force_n;
    const shcd_vec3 before = r->hand.position_m;
    hand_tick(&r->hand, r->force_n, target_m);
    const double uneven_m = unevenness(&r->hand);
    r->uneven_j += shcd_norm(shcd_sub(r->force_n, last_n)) * uneven_m;
    r->uneven_most_m = fmax(r->uneven_most_m, uneven_m);
    r->taken_j += shcd_dot(r->force_n, shcd_sub(r->hand.position_m, before));
    r->taken_most_j = fmax(r->taken_most_j, r->taken_j);
    r->excess_j = fmax(r->excess_j, r->taken_j - r->hand.dissipated_j);
}

double rig_depth(const rig *r) {
    return r->record.tools[0].penetration_m;
}
