/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies of known shape and small scenes, for the tests of the response. */
#ifndef SHCD_TESTS_SCENE_FIXTURE_H
#define SHCD_TESTS_SCENE_FIXTURE_H

#include "shcd/shcd.h"
#include "support/check.h"

#include <string.h>

#define FIXTURE_TICK_S 0.001

/** Ellipsoid with half axes a, b, c [m] along x, y, z: exactly degree 1, since
 *  Y_1,1 = sqrt(3/(4 pi)) x and likewise Y_1,-1 with y and Y_1,0 with z. */
static inline shcd_model *fixture_ellipsoid(double a, double b, double c) {
    const double unit = 2.0466534158929770; /* sqrt(4 pi / 3) */
    double coefficients[12] = {0.0};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    coefficients[3 * SHCD_INDEX(1, 1) + 0] = a * unit;
    coefficients[3 * SHCD_INDEX(1, -1) + 1] = b * unit;
    coefficients[3 * SHCD_INDEX(1, 0) + 2] = c * unit;
    def.degree = 1;
    def.coefficients = coefficients;
    if (shcd_model_create(&def, NULL, &model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return model;
}

static inline shcd_model *fixture_sphere(double radius_m) {
    return fixture_ellipsoid(radius_m, radius_m, radius_m);
}

static inline shcd_pose fixture_pose(double x, double y, double z) {
    const shcd_pose pose = {{x, y, z}, {1.0, 0.0, 0.0, 0.0}};
    return pose;
}

/** Uniform rotation and a position in a cube of half side `spread`. */
static inline shcd_pose fixture_random_pose(check_random *random, double spread) {
    shcd_pose pose;
    double q[4];
    double n = 0.0;
    for (int i = 0; i < 4; i++) {
        q[i] = check_normal(random);
        n += q[i] * q[i];
    }
    n = sqrt(n);
    pose.orientation.w = q[0] / n;
    pose.orientation.x = q[1] / n;
    pose.orientation.y = q[2] / n;
    pose.orientation.z = q[3] / n;
    pose.position_m.x = check_uniform(random, -spread, spread);
    pose.position_m.y = check_uniform(random, -spread, spread);
    pose.position_m.z = check_uniform(random, -spread, spread);
    return pose;
}

static inline shcd_vec3 fixture_random_direction(check_random *random) {
    const double x = check_normal(random);
    const double y = check_normal(random);
    return shcd_unit(shcd_vec3_make(x, y, check_normal(random)));
}

/** A scene with its state, and the last tick's input and output. */
typedef struct fixture {
    shcd_scene *scene;
    shcd_state *state;
    void *memory;
    shcd_tool_input in[SHCD_TOOLS_MAX];
    shcd_tool_output out[SHCD_TOOLS_MAX];
} fixture;

static inline shcd_body_def fixture_body(const char *name, const shcd_model *model, shcd_pose pose,
                                         const shcd_effect_def *effects, size_t n_effects) {
    shcd_body_def body = SHCD_BODY_DEF_INIT;
    body.name = name;
    body.model = model;
    body.body_in_world = pose;
    body.effects = effects;
    body.n_effects = n_effects;
    return body;
}

/** radius 0: a point. */
static inline shcd_tool_def fixture_tool(const char *name, double radius_m) {
    shcd_tool_def tool = SHCD_TOOL_DEF_INIT;
    tool.name = name;
    tool.kind = radius_m > 0.0 ? SHCD_TOOL_SPHERE : SHCD_TOOL_POINT;
    tool.radius_m = radius_m;
    return tool;
}

static inline shcd_tool_geometry *fixture_geometry(const shcd_tool_geometry_def *def) {
    shcd_tool_geometry *geometry = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcd_tool_geometry_create(def, NULL, &geometry, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return geometry;
}

static inline shcd_tool_geometry *fixture_capsule(double radius_m, double half_length_m) {
    shcd_tool_geometry_def def = SHCD_TOOL_GEOMETRY_DEF_INIT;
    def.kind = SHCD_TOOL_CAPSULE;
    def.radius_m = radius_m;
    def.half_length_m = half_length_m;
    return fixture_geometry(&def);
}

static inline shcd_tool_geometry *fixture_box(double x, double y, double z, double radius_m) {
    shcd_tool_geometry_def def = SHCD_TOOL_GEOMETRY_DEF_INIT;
    def.kind = SHCD_TOOL_BOX;
    def.radius_m = radius_m;
    def.half_extents_m = shcd_vec3_make(x, y, z);
    return fixture_geometry(&def);
}

static inline shcd_tool_geometry *fixture_shell(const shcd_vec3 *points, const shcd_vec3 *normals,
                                                size_t n) {
    shcd_tool_geometry_def def = SHCD_TOOL_GEOMETRY_DEF_INIT;
    def.kind = SHCD_TOOL_SHELL;
    def.points = points;
    def.normals = normals;
    def.n_points = n;
    return fixture_geometry(&def);
}

static inline shcd_tool_def fixture_tool_of(const char *name, int32_t kind,
                                            const shcd_tool_geometry *geometry) {
    shcd_tool_def tool = SHCD_TOOL_DEF_INIT;
    tool.name = name;
    tool.kind = kind;
    tool.geometry = geometry;
    return tool;
}

static inline void fixture_open(fixture *f, const shcd_body_def *bodies, size_t n_bodies,
                                const shcd_tool_def *tools, size_t n_tools) {
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    shcd_error error = {SHCD_OK, ""};
    size_t size;
    memset(f, 0, sizeof *f);
    def.bodies = bodies;
    def.n_bodies = n_bodies;
    def.tools = tools;
    def.n_tools = n_tools;
    if (shcd_scene_create(&def, NULL, &f->scene, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    size = (shcd_state_size(f->scene) + 15) / 16 * 16;
    f->memory = aligned_alloc(16, size);
    assert_non_null(f->memory);
    assert_int_equal(shcd_state_init(f->scene, f->memory, size, &f->state), SHCD_OK);
    for (size_t t = 0; t < n_tools; t++) {
        f->in[t].tool_in_world = fixture_pose(0.0, 0.0, 0.0);
        f->in[t].flags = SHCD_TOOL_INPUT_ACTIVE;
    }
}

static inline void fixture_close(fixture *f) {
    shcd_scene_free(f->scene);
    free(f->memory);
}

/** One tick with f->in. */
static inline void fixture_step(fixture *f) {
    const size_t n = shcd_scene_tool_count(f->scene);
    const shcd_input input = {FIXTURE_TICK_S, f->in, n};
    shcd_output output = {f->out, n};
    assert_int_equal(shcd_step(f->scene, f->state, &input, &output), SHCD_OK);
}

/** One tick with tool 0 at p, moving with v. */
static inline const shcd_tool_output *fixture_move(fixture *f, shcd_vec3 p, shcd_vec3 v) {
    f->in[0].tool_in_world.position_m = p;
    f->in[0].velocity_m_per_s = v;
    fixture_step(f);
    return &f->out[0];
}

static inline double fixture_diagonal(const shcd_model *model) {
    shcd_model_info info = {.struct_size = sizeof info};
    assert_int_equal(shcd_model_describe(model, &info), SHCD_OK);
    return info.diagonal_m;
}

/** One body with a spring of the default stiffness and one tool. */
static inline void fixture_open_one(fixture *f, const shcd_model *model, shcd_pose pose,
                                    double radius_m) {
    const shcd_effect_def spring = {"stiffness", NULL, 0};
    const shcd_body_def body = fixture_body("body", model, pose, &spring, 1);
    const shcd_tool_def tool = fixture_tool("tool", radius_m);
    fixture_open(f, &body, 1, &tool, 1);
}

/** The same with a tool of any kind. */
static inline void fixture_open_with(fixture *f, const shcd_model *model, shcd_pose pose,
                                     const shcd_tool_def *tool) {
    const shcd_effect_def spring = {"stiffness", NULL, 0};
    const shcd_body_def body = fixture_body("body", model, pose, &spring, 1);
    fixture_open(f, &body, 1, tool, 1);
}

static inline int fixture_in_contact(const shcd_tool_output *out) {
    return (out->flags & SHCD_TOOL_OUTPUT_CONTACT) != 0;
}

static inline void assert_vec3_near(shcd_vec3 a, shcd_vec3 b, double tolerance) {
    assert_near(a.x, b.x, tolerance);
    assert_near(a.y, b.y, tolerance);
    assert_near(a.z, b.z, tolerance);
}

static inline void assert_no_force(const shcd_tool_output *out) {
    assert_true(out->wrench.force_n.x == 0.0 && out->wrench.force_n.y == 0.0 &&
                out->wrench.force_n.z == 0.0);
    assert_true(out->wrench.torque_n_m.x == 0.0 && out->wrench.torque_n_m.y == 0.0 &&
                out->wrench.torque_n_m.z == 0.0);
}

#endif
