/* SPDX-License-Identifier: BSD-3-Clause */
/* The price of one effect, in a scene of its own: a ball slides over the body, 2 mm deep, at half a
 * metre a second; the library says by the given clock what the effect took in each tick. */
#include "effect_cost.h"

#include "report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define N_TICKS 6000
#define N_WARM_UP 1000
#define BALL_RADIUS_M 0.005
#define DEPTH_M 0.002
#define TICK_S 0.001
#define STEP_M 0.0005
#define DEGREE 15

shcd_model *effect_cost_body(void) {
    static const double half_m[3] = {0.08, 0.06, 0.05};
    double coefficients[3 * SHCD_COUNT(DEGREE)] = {0.0};
    const double unit = 2.0466534158929770; /* sqrt(4 pi/3): Y_1m = (y, z, x)/unit */
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    coefficients[3 * SHCD_INDEX(1, 1) + 0] = half_m[0] * unit;
    coefficients[3 * SHCD_INDEX(1, -1) + 1] = half_m[1] * unit;
    coefficients[3 * SHCD_INDEX(1, 0) + 2] = half_m[2] * unit;
    def.degree = DEGREE;
    def.coefficients = coefficients;
    const shcd_status status = shcd_model_create(&def, NULL, &model, &error);
    if (status != SHCD_OK) {
        (void)report_failure("%s", report_reason(status, &error));
    }
    return model;
}

/* ---- a scene --------------------------------------------------------------------------------- */

/* What an effect does not work without. */
static size_t companions(const char *effect, shcd_effect_def *defs) {
    const bool is_law = strcmp(effect, "stiffness") == 0 || strcmp(effect, "learned") == 0;
    size_t n = 0;
    memset(defs, 0, 2 * sizeof *defs);
    if (!is_law) {
        defs[n++].name = "stiffness";
    }
    if (strcmp(effect, "pulse") == 0) {
        defs[n++].name = "wave";
    }
    return n;
}

static bool carries(const shcd_model *model, const char *effect) {
    if (strcmp(effect, "wave") == 0 || strcmp(effect, "pulse") == 0) {
        return shcd_model_modes(model) != NULL;
    }
    return strcmp(effect, "learned") != 0 || shcd_model_learned(model) != NULL;
}

static shcd_scene *make_scene(const shcd_model *model, const shcd_effect_def *effects, size_t n) {
    shcd_body_def body = SHCD_BODY_DEF_INIT;
    shcd_tool_def tool = SHCD_TOOL_DEF_INIT;
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    shcd_scene *scene = NULL;
    shcd_error error = {SHCD_OK, ""};
    body.name = "body";
    body.model = model;
    body.effects = effects;
    body.n_effects = n;
    tool.name = "ball";
    tool.kind = SHCD_TOOL_SPHERE;
    tool.radius_m = BALL_RADIUS_M;
    def.bodies = &body;
    def.n_bodies = 1;
    def.tools = &tool;
    def.n_tools = 1;
    const shcd_status status = shcd_scene_create(&def, NULL, &scene, &error);
    if (status != SHCD_OK) {
        (void)report_failure("%s", report_reason(status, &error));
    }
    return scene;
}

/* All modes of the body, if they are fewer than the default number. */
static shcd_parameter_value modes_of(const shcd_model *model) {
    const shcd_modes *modes = shcd_model_modes(model);
    const shcd_parameter_value value = {"modes",
                                        modes == NULL ? 1.0 : fmin(64.0, (double)modes->n_modes)};
    return value;
}

/* ---- ticks ----------------------------------------------------------------------------------- */

static uint64_t read_clock(void *user) {
    return cost_clock_read(user);
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* The ball's centre over the place at angle a of the equator. */
static bool place(const shcd_model *model, double a, shcd_tool_input *tool) {
    const shcd_vec3 w = {cos(a), sin(a), 0.0};
    shcd_vec3 point, normal;
    if (shcd_model_surface(model, shcd_model_degree(model), w, &point, &normal, NULL) != SHCD_OK) {
        return false;
    }
    const shcd_vec3 before = tool->tool_in_world.position_m;
    tool->tool_in_world.position_m = shcd_mul_add(point, BALL_RADIUS_M - DEPTH_M, normal);
    tool->velocity_m_per_s =
        shcd_scale(1.0 / TICK_S, shcd_sub(tool->tool_in_world.position_m, before));
    return true;
}

/* Ticks of the clock, without what reading it takes. */
static bool run(const shcd_model *model, const shcd_scene *scene, shcd_state *state,
                const char *effect, const cost_clock *clock, double *took) {
    shcd_model_info info = {.struct_size = sizeof info};
    shcd_tool_input tool = {{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}}};
    shcd_tool_output out;
    shcd_effect_output effects[8];
    cost_clock reader = *clock;
    const shcd_input input = {TICK_S, &tool, 1, read_clock, &reader};
    shcd_output output = {&out, 1, effects, shcd_scene_effect_count(scene)};
    size_t e = 0;
    while (strcmp(shcd_scene_effect_name(scene, e), effect) != 0) {
        e++;
    }
    tool.flags = SHCD_TOOL_INPUT_ACTIVE;
    if (shcd_model_describe(model, &info) != SHCD_OK) {
        return false;
    }
    for (int i = 0; i < N_WARM_UP + N_TICKS; i++) {
        if (!place(model, STEP_M / info.radius_m * i, &tool) ||
            shcd_step(scene, state, &input, &output) != SHCD_OK) {
            return false;
        }
        if (i >= N_WARM_UP) {
            took[i - N_WARM_UP] = effects[e].time_ns - clock->overhead_ticks;
        }
    }
    return true;
}

static size_t state_size(const shcd_model *model, const shcd_effect_def *effects, size_t n) {
    shcd_scene *scene = make_scene(model, effects, n);
    const size_t size = scene != NULL ? shcd_state_size(scene) : 0;
    shcd_scene_free(scene);
    return size;
}

static bool measure(const shcd_model *model, const shcd_scene *scene, const char *effect,
                    const cost_clock *clock, effect_cost *cost) {
    const size_t size = (shcd_state_size(scene) + 15) / 16 * 16;
    void *memory = aligned_alloc(16, size);
    double *took = malloc(N_TICKS * sizeof *took);
    shcd_state *state = NULL;
    const bool good = memory != NULL && took != NULL &&
                      shcd_state_init(scene, memory, size, &state) == SHCD_OK &&
                      run(model, scene, state, effect, clock, took);
    if (good) {
        qsort(took, N_TICKS, sizeof *took, compare);
        double sum = 0.0;
        for (size_t i = 0; i < N_TICKS / 100 * 99; i++) { /* without what else the machine did */
            sum += took[i];
        }
        cost->mean_ns = fmax(0.0, sum / (N_TICKS / 100 * 99) * clock->ns_per_tick);
        cost->p99_ns = fmax(0.0, took[N_TICKS / 100 * 99] * clock->ns_per_tick);
    } else {
        (void)report_failure("effect '%s' could not be measured", effect);
    }
    free(took);
    free(memory);
    return good;
}

bool effect_cost_measure(const shcd_model *model, const char *effect, const cost_clock *clock,
                         effect_cost *cost) {
    const effect_cost unknown = {0};
    const shcd_parameter_value modes = modes_of(model);
    shcd_effect_def defs[3];
    size_t n = companions(effect, defs);
    *cost = unknown;
    if (!carries(model, effect)) {
        return true;
    }
    const shcd_effect_def own = {effect, NULL, 0};
    defs[n++] = own;
    for (size_t i = 0; i < n; i++) {
        if (strcmp(defs[i].name, "wave") == 0) {
            defs[i].parameters = &modes;
            defs[i].n_parameters = 1;
        }
    }
    const size_t without = state_size(model, defs, n - 1);
    shcd_scene *scene = make_scene(model, defs, n);
    const bool good = scene != NULL && without > 0 && measure(model, scene, effect, clock, cost);
    if (good) {
        cost->is_known = true;
        cost->state_bytes = shcd_state_size(scene) - without;
    }
    shcd_scene_free(scene);
    return good;
}
