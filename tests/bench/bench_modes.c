/* SPDX-License-Identifier: BSD-3-Clause */
/* Force at a held depth against the number of modes: bench_modes BODY.shcd prints a table.
 *
 * A ball is held 1 mm below the rest surface at its highest point until nothing moves. The library
 * keeps what the chosen modes leave out as a compliance in series; the column beside it takes that
 * out again, f' = f/(1 - f W_res/depth), which is what a truncated sum alone would say. */
#include "shcd/shcd.h"

#include "response/soft.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEPTH_M 1e-3
#define TOOL_M 0.003

static void fail(const char *text) {
    fprintf(stderr, "bench_modes: %s\n", text);
    exit(1);
}

static double held_force(const shcd_model *model, shcd_vec3 at, double n_modes) {
    const shcd_parameter_value wave[2] = {{.name = "modes", .value = n_modes},
                                          {.name = "damping_ratio", .value = 1.0}};
    const shcd_effect_def effect = {"wave", wave, 2};
    shcd_body_def body = SHCD_BODY_DEF_INIT;
    shcd_tool_def tool = SHCD_TOOL_DEF_INIT;
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    shcd_error error = {SHCD_OK, ""};
    shcd_scene *scene = NULL;
    shcd_state *state = NULL;
    shcd_tool_input in = {.flags = SHCD_TOOL_INPUT_ACTIVE};
    shcd_tool_output out;
    body.name = "body";
    body.model = model;
    body.effects = &effect;
    body.n_effects = 1;
    tool.name = "ball";
    tool.kind = SHCD_TOOL_SPHERE;
    tool.radius_m = TOOL_M;
    def.bodies = &body;
    def.n_bodies = 1;
    def.tools = &tool;
    def.n_tools = 1;
    if (shcd_scene_create(&def, NULL, &scene, &error) != SHCD_OK) {
        fail(error.message);
    }
    const size_t size = (shcd_state_size(scene) + 63) / 64 * 64;
    void *memory = aligned_alloc(64, size);
    if (memory == NULL || shcd_state_init(scene, memory, size, &state) != SHCD_OK) {
        fail("out of memory");
    }
    in.tool_in_world.orientation.w = 1.0;
    in.tool_in_world.position_m = at;
    for (int i = 0; i < 2000; i++) {
        const double share = i < 100 ? 0.01 * i : 1.0;
        in.tool_in_world.position_m.z = at.z + TOOL_M - share * DEPTH_M;
        const shcd_input input = {.dt_s = 0.001, .tools = &in, .n_tools = 1};
        shcd_output output = {.tools = &out, .n_tools = 1};
        if (shcd_step(scene, state, &input, &output) != SHCD_OK) {
            fail("a tick failed");
        }
    }
    free(memory);
    shcd_scene_free(scene);
    return shcd_norm(out.wrench.force_n);
}

static shcd_vec3 highest(const shcd_model *model) {
    shcd_vec3 top = {0.0, 0.0, -1e300}, s;
    for (int i = 0; i < 20000; i++) {
        const double z = 1.0 - 1.5 * (i + 0.5) / 20000.0, r = sqrt(1.0 - z * z);
        const shcd_vec3 w =
            shcd_vec3_make(r * cos(2.39996322972865332 * i), r * sin(2.39996322972865332 * i), z);
        if (shcd_model_surface(model, -1, w, &s, NULL, NULL) == SHCD_OK && s.z > top.z) {
            top = s;
        }
    }
    return top;
}

int main(int argc, char **argv) {
    static const double counts[] = {1, 4, 9, 16, 25, 36, 49, 64, 81, 100, 144, 196, 256};
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    double wave[SHCDI_EFFECT_PARAMETERS_MAX];
    if (argc != 2) {
        fprintf(stderr, "usage: bench_modes BODY.shcd\n");
        return 2;
    }
    if (shcd_model_load(argv[1], NULL, &model, &error) != SHCD_OK) {
        fail(error.message);
    }
    const shcd_modes *modes = shcd_model_modes(model);
    if (modes == NULL) {
        fail("the body has no modes; 'shcd modes' adds them");
    }
    for (size_t i = 0; i < shcdi_effect_wave.info.n_parameters; i++) {
        wave[i] = shcdi_effect_wave.info.parameters[i].default_value;
    }
    const shcdi_membrane m = shcdi_membrane_of(wave);
    const shcd_vec3 top = highest(model);
    printf(
        "# modes, force with the residual compliance [N], without [N], half-space 2 E* a d [N]\n");
    for (size_t i = 0; i < sizeof counts / sizeof counts[0] && counts[i] <= (double)modes->n_modes;
         i++) {
        const double f = held_force(model, top, counts[i]);
        const double residual = shcdi_residual_compliance(&m, modes->area_m2, (size_t)counts[i]);
        const double nu = wave[SHCDI_WAVE_POISSON];
        printf("%g %.6f %.6f %.6f\n", counts[i], f, f / (1.0 - f * residual / DEPTH_M),
               2.0 * wave[SHCDI_WAVE_YOUNG] / (1.0 - nu * nu) * wave[SHCDI_WAVE_PATCH] * DEPTH_M);
    }
    shcd_model_free(model);
    return 0;
}
