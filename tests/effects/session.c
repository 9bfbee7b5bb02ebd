/* SPDX-License-Identifier: BSD-3-Clause */
/* A session with the effects that the arguments name: a point, a ball, a box and a shell go over an
 * uneven body and into it. Prints the bytes of the state and a checksum of the output. */
#include "shcd/shcd.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE 8
#define N_TOOLS 4
#define N_POINTS 80
#define N_TICKS 500
#define EFFECTS_MAX 8

static double uniform(uint64_t *state) {
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-52 - 1.0;
}

static shcd_vec3 direction(uint64_t *state) {
    const double x = uniform(state), y = uniform(state);
    return shcd_unit(shcd_vec3_make(x, y, uniform(state)));
}

static void need(shcd_status status, const shcd_error *error) {
    if (status != SHCD_OK) {
        (void)fprintf(stderr, "effects_session: %s\n", error->message);
        exit(1);
    }
}

static shcd_model *make_body(uint64_t *random) {
    double c[3 * SHCD_COUNT(DEGREE)];
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    for (size_t i = 0; i < 3 * SHCD_COUNT(DEGREE); i++) {
        c[i] = i < 12 ? 0.0 : 1e-4 * uniform(random);
    }
    c[3 * SHCD_INDEX(1, 1) + 0] = 0.08 * 2.0466534158929770;
    c[3 * SHCD_INDEX(1, -1) + 1] = 0.06 * 2.0466534158929770;
    c[3 * SHCD_INDEX(1, 0) + 2] = 0.05 * 2.0466534158929770;
    def.degree = DEGREE;
    def.coefficients = c;
    need(shcd_model_create(&def, NULL, &model, &error), &error);
    return model;
}

static void make_tools(uint64_t *random, shcd_tool_geometry **box, shcd_tool_geometry **shell) {
    shcd_vec3 points[N_POINTS], normals[N_POINTS];
    shcd_tool_geometry_def def = SHCD_TOOL_GEOMETRY_DEF_INIT;
    shcd_tool_geometry_def of_box = SHCD_TOOL_GEOMETRY_DEF_INIT;
    shcd_error error = {SHCD_OK, ""};
    for (size_t i = 0; i < N_POINTS; i++) {
        normals[i] = direction(random);
        points[i] = shcd_scale(-0.008, normals[i]);
    }
    def.kind = SHCD_TOOL_SHELL;
    def.points = points;
    def.normals = normals;
    def.n_points = N_POINTS;
    need(shcd_tool_geometry_create(&def, NULL, shell, &error), &error);
    of_box.kind = SHCD_TOOL_BOX;
    of_box.half_extents_m = shcd_vec3_make(0.006, 0.004, 0.003);
    of_box.radius_m = 0.001;
    need(shcd_tool_geometry_create(&of_box, NULL, box, &error), &error);
}

static void name_tool(shcd_tool_def *tool, const char *name, int32_t kind,
                      const shcd_tool_geometry *geometry) {
    const shcd_tool_def blank = SHCD_TOOL_DEF_INIT;
    *tool = blank;
    tool->name = name;
    tool->kind = kind;
    tool->radius_m = kind == SHCD_TOOL_SPHERE ? 0.004 : 0.0;
    tool->geometry = geometry;
}

static uint64_t go(const shcd_scene *scene, shcd_state *state, uint64_t *random) {
    shcd_tool_input in[N_TOOLS];
    shcd_tool_output out[N_TOOLS];
    shcd_vec3 u[N_TOOLS];
    const shcd_input input = {0.001, in, N_TOOLS};
    shcd_output output = {out, N_TOOLS};
    uint64_t sum = 0xcbf29ce484222325u;
    size_t n_contacts = 0;
    memset(in, 0, sizeof in);
    for (size_t t = 0; t < N_TOOLS; t++) {
        u[t] = direction(random);
        in[t].flags = SHCD_TOOL_INPUT_ACTIVE;
        in[t].tool_in_world.orientation.w = 1.0;
    }
    for (int i = 0; i < N_TICKS; i++) {
        for (size_t t = 0; t < N_TOOLS; t++) {
            const double share = 0.98 + 0.0005 * (i % 200);
            u[t] = shcd_unit(shcd_mul_add(u[t], 0.01, direction(random)));
            in[t].tool_in_world.position_m =
                shcd_vec3_make(0.08 * share * u[t].x, 0.06 * share * u[t].y, 0.05 * share * u[t].z);
            in[t].velocity_m_per_s = shcd_scale(0.2, direction(random));
        }
        if (shcd_step(scene, state, &input, &output) != SHCD_OK) {
            exit(1);
        }
        for (size_t t = 0; t < N_TOOLS; t++) {
            const unsigned char *bytes = (const unsigned char *)&out[t];
            n_contacts += out[t].n_contacts;
            for (size_t b = 0; b < sizeof out[t]; b++) {
                sum = (sum ^ bytes[b]) * 0x100000001b3u;
            }
        }
    }
    if (n_contacts < N_TICKS) {
        (void)fprintf(stderr, "effects_session: only %zu contacts\n", n_contacts);
        exit(1);
    }
    return sum;
}

int main(int argc, char **argv) {
    uint64_t random = 1;
    shcd_effect_def effects[EFFECTS_MAX];
    shcd_body_def body = SHCD_BODY_DEF_INIT;
    shcd_tool_def tools[N_TOOLS];
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    shcd_tool_geometry *box = NULL, *shell = NULL;
    shcd_scene *scene = NULL;
    shcd_state *state = NULL;
    shcd_error error = {SHCD_OK, ""};
    memset(effects, 0, sizeof effects);
    for (int i = 1; i < argc && i <= EFFECTS_MAX; i++) {
        effects[i - 1].name = argv[i];
    }
    shcd_model *model = make_body(&random);
    make_tools(&random, &box, &shell);
    name_tool(&tools[0], "tip", SHCD_TOOL_POINT, NULL);
    name_tool(&tools[1], "ball", SHCD_TOOL_SPHERE, NULL);
    name_tool(&tools[2], "box", SHCD_TOOL_BOX, box);
    name_tool(&tools[3], "shell", SHCD_TOOL_SHELL, shell);
    body.name = "body";
    body.model = model;
    body.effects = effects;
    body.n_effects = (size_t)(argc - 1);
    def.bodies = &body;
    def.n_bodies = 1;
    def.tools = tools;
    def.n_tools = N_TOOLS;
    need(shcd_scene_create(&def, NULL, &scene, &error), &error);
    const size_t size = (shcd_state_size(scene) + 15) / 16 * 16;
    void *memory = aligned_alloc(16, size);
    if (memory == NULL || shcd_state_init(scene, memory, size, &state) != SHCD_OK) {
        return 1;
    }
    const uint64_t sum = go(scene, state, &random);
    printf("%zu %016" PRIx64 "\n", shcd_state_size(scene), sum);
    free(memory);
    shcd_scene_free(scene);
    shcd_tool_geometry_free(shell);
    shcd_tool_geometry_free(box);
    shcd_model_free(model);
    return 0;
}
