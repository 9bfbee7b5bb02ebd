/* SPDX-License-Identifier: BSD-3-Clause */
/* A program outside the project, in C99: a body from coefficients, a query, one tick of a scene. */
#include <shcd/shcd.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* sqrt(4 pi / 3): Y_1,1 = x / AXIS, Y_1,-1 = y / AXIS, Y_1,0 = z / AXIS on the unit sphere */
#define AXIS 2.0466534158929770

static void stop(const char *what, const char *why) {
    fprintf(stderr, "consumer: %s: %s\n", what, why);
    exit(1);
}

static void expect(const char *what, double actual, double expected, double tolerance) {
    printf("%s %.9g\n", what, actual);
    if (!(fabs(actual - expected) <= tolerance)) {
        fprintf(stderr, "consumer: %s: expected %.17g\n", what, expected);
        exit(1);
    }
}

/* Ellipsoid with half axes of 30, 20 and 10 mm: degree 1. */
static shcd_model *make_ellipsoid(void) {
    double coefficients[12] = {0.0};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error;
    coefficients[3 * SHCD_INDEX(1, 1) + 0] = 0.03 * AXIS;
    coefficients[3 * SHCD_INDEX(1, -1) + 1] = 0.02 * AXIS;
    coefficients[3 * SHCD_INDEX(1, 0) + 2] = 0.01 * AXIS;
    def.degree = 1;
    def.coefficients = coefficients;
    if (shcd_model_create(&def, NULL, &model, &error) != SHCD_OK) {
        stop("shcd_model_create", error.message);
    }
    return model;
}

static void query(const shcd_model *model) {
    const shcd_vec3 on_long_axis = {0.05, 0.0, 0.0};
    shcd_proximity out;
    const shcd_status status = shcd_closest(model, on_long_axis, NULL, &out);
    if (status != SHCD_OK) {
        stop("shcd_closest", shcd_status_string(status));
    }
    /* the default tolerance of a query is 1e-9 of the larger of diagonal (75 mm) and distance */
    expect("distance", out.distance_m, 0.02, 1e-10);
    expect("normal", shcd_norm(out.normal), 1.0, 1e-12);
}

/* A ball of 5 mm pressed 1 mm deep onto the end of the long axis, against 1 N/mm. */
static void tick(const shcd_model *model) {
    const shcd_parameter_value stiffness = SHCD_PARAMETER("k_n_per_m", 1000.0);
    const shcd_effect_def spring = {"stiffness", &stiffness, 1};
    shcd_body_def body = SHCD_BODY_DEF_INIT;
    shcd_tool_def tool = SHCD_TOOL_DEF_INIT;
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    shcd_tool_input pressed = {{{0.034, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}},
                               {0.0, 0.0, 0.0},
                               SHCD_TOOL_INPUT_ACTIVE,
                               0,
                               {0.0, 0.0, 0.0},
                               {0, 0}};
    shcd_tool_output felt;
    shcd_input input = SHCD_INPUT(0.001, NULL, 1);
    shcd_output output = SHCD_OUTPUT(NULL, 1);
    shcd_scene *scene = NULL;
    shcd_state *state = NULL;
    shcd_error error;
    void *memory;
    body.name = "body";
    body.model = model;
    body.effects = &spring;
    body.n_effects = 1;
    tool.name = "ball";
    tool.kind = SHCD_TOOL_SPHERE;
    tool.radius_m = 0.005;
    def.bodies = &body;
    def.n_bodies = 1;
    def.tools = &tool;
    def.n_tools = 1;
    input.tools = &pressed;
    output.tools = &felt;
    if (shcd_scene_create(&def, NULL, &scene, &error) != SHCD_OK) {
        stop("shcd_scene_create", error.message);
    }
    memory = malloc(shcd_state_size(scene));
    if (memory == NULL ||
        shcd_state_init(scene, memory, shcd_state_size(scene), &state) != SHCD_OK ||
        shcd_step(scene, state, &input, &output) != SHCD_OK) {
        stop("shcd_step", "failed");
    }
    /* stiffness times the query's tolerance, 1000 N/m x 75e-12 m, rounded up */
    expect("force", felt.wrench.force_n.x, 1.0, 1e-6);
    free(memory);
    shcd_scene_free(scene);
}

int main(void) {
    shcd_model *model;
    if (shcd_version() != SHCD_VERSION) {
        stop("version", "the library is not the one of the headers");
    }
    model = make_ellipsoid();
    query(model);
    tick(model);
    shcd_model_free(model);
    return 0;
}
