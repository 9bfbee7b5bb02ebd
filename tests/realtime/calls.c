/* SPDX-License-Identifier: BSD-3-Clause */
#include "realtime/calls.h"

#include "shcd/accuracy.h"
#include "shcd/energy.h"
#include "shcd/pair.h"
#include "shcd/sweep.h"
#include "support/bodies.h"
#include "support/network.h"
#include "support/soft.h"

#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof(array)[0])
enum { DEGREE = 15, N_TOOLS = 6, N_SHELL = 60, STEPS = 600, SOFT_DEGREE = 7 };

static shcd_model *sphere, *uneven, *soft; /* 1 m, about 1 m, 50 mm */
static shcd_map *maps[2];                  /* by grid */
static shcd_tool_geometry *tools[N_TOOLS]; /* by kind */
static shcd_shape *shape;
static void *shape_memory, *scratch, *state_memory;
static size_t scratch_size, state_size;
static shcd_scene *scene;
static double moved[3 * SHCD_COUNT(DEGREE)];
static double harmonics[10 * SHCD_COUNT(SHCD_DEGREE_MAX)];
static double network_numbers[NETWORK_NUMBERS];
static shcd_learned network;

static const shcd_vec3 points[] = {{0.0, 0.0, 0.0}, {0.3, 0.2, -0.1}, {1.5, -0.4, 0.6},
                                   {1e9, 1e9, 0.0}, {1e-9, 0.0, 0.0}, {0.0, 0.0, 1.0}};

/* ---- what has to be there ------------------------------------------------------------------- */

static size_t aligned(size_t size) {
    return (size + 63) / 64 * 64;
}

static int make_tools(void) {
    static shcd_vec3 hull[8], shell[N_SHELL], inward[N_SHELL];
    shcd_tool_geometry_def def = SHCD_TOOL_GEOMETRY_DEF_INIT;
    int failed = 0;
    for (size_t i = 0; i < COUNT(hull); i++) { /* a prism, one side of it sharp */
        hull[i] = shcd_vec3_make((i & 1) != 0 ? 0.01 : -0.012, (i & 2) != 0 ? 0.006 : -0.006,
                                 (i & 4) != 0 ? 0.015 : -0.01 + ((i & 1) != 0 ? 0.004 : 0.0));
    }
    for (size_t i = 0; i < N_SHELL; i++) { /* a spiral on a ball */
        const double z = -1.0 + (2.0 * (double)i + 1.0) / N_SHELL, a = 2.4 * (double)i;
        const double r = sqrt(1.0 - z * z);
        inward[i] = shcd_vec3_make(-r * cos(a), -r * sin(a), -z);
        shell[i] = shcd_scale(-0.01, inward[i]);
    }
    def.half_length_m = 0.02;
    def.half_extents_m = shcd_vec3_make(0.012, 0.008, 0.005);
    for (int kind = 0; kind < N_TOOLS; kind++) {
        def.kind = kind;
        def.radius_m = kind == SHCD_TOOL_POINT || kind == SHCD_TOOL_HULL ? 0.0 : 0.003;
        def.points = kind == SHCD_TOOL_SHELL ? shell : hull;
        def.n_points = kind == SHCD_TOOL_SHELL ? N_SHELL : COUNT(hull);
        def.normals = inward;
        failed |= shcd_tool_geometry_create(&def, NULL, &tools[kind], NULL) != SHCD_OK;
    }
    return failed;
}

/* A rigid ball beside a soft one, both of 50 mm, and a tool of each kind. */
static int make_scene(void) {
    static shcd_model *small; /* lives as long as the program */
    static const char *const names[N_TOOLS] = {"point", "sphere", "capsule",
                                               "box",   "hull",   "shell"};
    const shcd_effect_def effects[] = {
        {"stiffness", NULL, 0}, {"damping", NULL, 0}, {"friction", NULL, 0}, {"wave", NULL, 0}};
    shcd_body_def bodies[2] = {SHCD_BODY_DEF_INIT, SHCD_BODY_DEF_INIT};
    shcd_tool_def defs[N_TOOLS];
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    small = small != NULL ? small : bodies_create_ellipsoid(0.05, 0.045, 0.04);
    bodies[0].name = "rigid";
    bodies[0].model = small;
    bodies[1].name = "soft";
    bodies[1].model = soft;
    for (size_t i = 0; i < 2; i++) {
        bodies[i].body_in_world.position_m.x = i == 0 ? -0.06 : 0.06;
        bodies[i].effects = effects;
        bodies[i].n_effects = i == 0 ? 3 : 4;
    }
    for (int kind = 0; kind < N_TOOLS; kind++) {
        const shcd_tool_def empty = SHCD_TOOL_DEF_INIT;
        defs[kind] = empty;
        defs[kind].name = names[kind];
        defs[kind].kind = kind;
        defs[kind].geometry = tools[kind];
    }
    def.bodies = bodies;
    def.n_bodies = 2;
    def.tools = defs;
    def.n_tools = N_TOOLS;
    if (shcd_scene_create(&def, NULL, &scene, NULL) != SHCD_OK) {
        return 1;
    }
    state_size = aligned(shcd_state_size(scene));
    state_memory = aligned_alloc(64, state_size);
    return state_memory == NULL;
}

int calls_open(void) {
    check_random random = {3};
    sphere = bodies_create_ellipsoid(1.0, 1.0, 1.0);
    uneven = bodies_create_random(&random, DEGREE, 0.3);
    soft = soft_sphere(0.05, SOFT_DEGREE);
    network = network_by_hand(network_numbers);
    memcpy(moved, shcd_model_coefficients(uneven), sizeof moved);
    for (size_t i = 3; i < COUNT(moved); i++) {
        moved[i] += 0.01 * check_normal(&random);
    }
    for (int32_t grid = 0; grid < 2; grid++) {
        shcd_map_options options = SHCD_MAP_OPTIONS_INIT;
        options.grid = grid;
        options.resolution = 12;
        if (shcd_map_create(uneven, &options, NULL, &maps[grid], NULL) != SHCD_OK) {
            return 1;
        }
    }
    scratch_size = aligned(shcd_sweep_scratch_size(uneven));
    scratch = aligned_alloc(64, scratch_size);
    shape_memory = aligned_alloc(64, aligned(shcd_shape_size(uneven)));
    return scratch == NULL || shape_memory == NULL || make_tools() != 0 || make_scene() != 0;
}

void calls_close(void) {
    for (int kind = 0; kind < N_TOOLS; kind++) {
        shcd_tool_geometry_free(tools[kind]);
    }
    shcd_scene_free(scene);
    shcd_map_free(maps[0]);
    shcd_map_free(maps[1]);
    shcd_model_free(sphere);
    shcd_model_free(uneven);
    shcd_model_free(soft);
    free(scratch);
    free(shape_memory);
    free(state_memory);
}

/* ---- points against one body ---------------------------------------------------------------- */

static int query_all(const shcd_model *model, shcd_vec3 p) {
    const shcd_vec3 near = {p.x, p.y + 0.2, p.z};
    int failed = 0;
    for (int32_t tier = SHCD_TIER_EXACT; tier <= SHCD_TIER_MAP; tier++) {
        shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
        shcd_proximity found;
        options.tier = tier;
        for (options.map_hermite = 0; options.map_hermite < 2; options.map_hermite++) {
            options.tolerance = options.map_hermite != 0 ? 1e-15 : 0.0;
            failed |= shcd_closest(model, p, &options, &found) != SHCD_OK;
            failed |=
                model == uneven && shcd_shape_closest(model, shape, p, &options, &found) != SHCD_OK;
        }
        failed |= shcd_track(model, near, found.parameter, &found) != SHCD_OK;
        failed |= model == uneven &&
                  shcd_shape_track(model, shape, near, found.parameter, &found) != SHCD_OK;
    }
    return failed;
}

/* From stage to stage, and a path that a certificate follows and then loses. */
static int detect_all(const shcd_model *model, const shcd_shape *deformed, shcd_vec3 p) {
    static const double reaches_m[] = {0.0, 1e-3, 10.0};
    shcd_certificate certificate;
    int failed = 0;
    memset(&certificate, 0, sizeof certificate);
    for (int i = 0; i < 12; i++) {
        const shcd_vec3 at = {p.x + 1e-3 * i, p.y, p.z + (i > 8 ? 0.7 : 0.0)};
        shcd_detect_options options = SHCD_DETECT_OPTIONS_INIT;
        shcd_detection found;
        shcd_proximity near;
        options.certificate = &certificate;
        options.skipped = i % 4 == 3 ? 1u << SHCD_STAGE_BALL | 1u << SHCD_STAGE_LOW_DEGREE : 0u;
        failed |= shcd_closest_next(model, deformed, at, NULL, &certificate, &near) != SHCD_OK;
        options.seed = i % 2 == 0 ? near.parameter : shcd_vec3_make(0.0, 0.0, 0.0);
        failed |= shcd_detect(model, deformed, at, reaches_m[i % 3], &options, &found) != SHCD_OK;
        failed |= shcd_detect(model, deformed, at, reaches_m[i % 3], NULL, &found) != SHCD_OK;
    }
    return failed;
}

static int look_up_all(shcd_vec3 p) {
    int failed = 0;
    for (int grid = 0; grid < 2; grid++) {
        for (int how = SHCD_MAP_LINEAR; how <= SHCD_MAP_HERMITE - grid; how++) {
            const shcd_vec3 d = {p.x, p.y, p.z + 1e-3};
            shcd_map_info info = SHCD_MAP_INFO_INIT;
            shcd_map_ray ray;
            shcd_proximity found;
            failed |= shcd_map_look_up(maps[grid], d, how, &ray) != SHCD_OK;
            failed |= shcd_map_query(maps[grid], p, how, &found) != SHCD_OK;
            failed |= shcd_map_describe(maps[grid], &info) != SHCD_OK;
        }
    }
    return failed;
}

/* ---- one body ------------------------------------------------------------------------------- */

static int evaluate_all(shcd_vec3 w) {
    static shcd_vec3 sums[DEGREE + 1];
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    shcd_shape_info shape_info = SHCD_SHAPE_INFO_INIT;
    shcd_vec3 point, normal;
    double jacobian[9], offset;
    double *gradient = harmonics + SHCD_COUNT(SHCD_DEGREE_MAX), *hessian = gradient + 3 * 22801;
    int failed = shcd_model_surface(uneven, -1, w, &point, &normal, jacobian) != SHCD_OK;
    failed |= shcd_model_surface(uneven, 1, w, &point, NULL, NULL) != SHCD_OK;
    failed |= shcd_model_partial_sums(uneven, w, sums) != SHCD_OK;
    failed |= shcd_shape_surface(uneven, shape, w, &point, &normal, jacobian) != SHCD_OK;
    failed |= shcd_shape_describe(uneven, shape, &shape_info) != SHCD_OK;
    failed |= shcd_model_describe(uneven, &info) != SHCD_OK;
    failed |= shcd_model_enclosure_offset(uneven, 1, &offset) != SHCD_OK;
    failed |= shcd_harmonics(SHCD_DEGREE_MAX, w, harmonics, gradient, hessian) != SHCD_OK;
    return failed;
}

static int ask_models(void) {
    static double complex_pairs[2 * SHCD_COUNT(DEGREE)], back[SHCD_COUNT(DEGREE)];
    size_t n_rows = 1;
    int failed = shcd_version() == 0 || shcd_status_string(SHCD_OK) == NULL;
    failed |= shcd_model_degree(uneven) != DEGREE || shcd_model_write_size(uneven) == 0;
    failed |= shcd_model_cost_rows(uneven, &n_rows) != NULL || n_rows != 0;
    failed |= shcd_model_cost_machine(uneven)[0] != '\0' || shcd_model_modes(soft) == NULL;
    failed |= shcd_model_learned(uneven) != NULL;
    failed |= shcd_coefficients_to_complex(DEGREE, shcd_model_coefficients(uneven), 3,
                                           complex_pairs) != SHCD_OK;
    failed |= shcd_coefficients_from_complex(DEGREE, complex_pairs, back, 1) != SHCD_OK;
    return failed;
}

/* Followed by inflated bounds, then refreshed, then back. */
static int deform(void) {
    int failed = shcd_shape_init(uneven, shape_memory, shcd_shape_size(uneven), &shape) != SHCD_OK;
    for (int follow = 0; follow < 2; follow++) {
        failed |= shcd_shape_set(uneven, shape, shcd_model_coefficients(uneven), follow) != SHCD_OK;
        failed |= shcd_shape_set(uneven, shape, moved, follow) != SHCD_OK;
    }
    return failed | (shcd_shape_coefficients(shape) == NULL);
}

/* ---- tools, sweeps, accounts, the learned response ------------------------------------------ */

static shcd_pose pose_at(shcd_vec3 p, double turn) {
    const shcd_pose pose = {p, {cos(turn), 0.6 * sin(turn), 0.0, 0.8 * sin(turn)}};
    return pose;
}

static int tools_against(shcd_vec3 p) {
    int failed = 0;
    for (int kind = SHCD_TOOL_POINT; kind < SHCD_TOOL_SHELL; kind++) {
        for (int32_t tier = SHCD_TIER_EXACT; tier <= SHCD_TIER_FAST; tier++) {
            shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
            shcd_tool_proximity found;
            options.tier = tier;
            failed |= shcd_tool_closest(uneven, NULL, tools[kind], pose_at(p, 0.5), &options,
                                        &found) != SHCD_OK;
            failed |= shcd_tool_closest(uneven, shape, tools[kind], pose_at(p, 0.5), &options,
                                        &found) != SHCD_OK;
        }
        shcd_sweep_def motion = SHCD_SWEEP_DEF_INIT;
        shcd_sweep_result out;
        motion.tool = tools[kind];
        motion.from = pose_at(shcd_vec3_make(p.x, p.y, p.z + 1.8), 0.2);
        motion.to = pose_at(p, 0.6);
        motion.tolerance_m = 1e-5 * (1.0 + shcd_norm(p)); /* far away positions are that coarse */
        failed |= shcd_sweep(uneven, &motion, NULL, 0, &out) != SHCD_OK;
        motion.coefficients_to = moved;
        failed |= shcd_sweep(uneven, &motion, scratch, scratch_size, &out) != SHCD_OK;
        motion.shape = shape;
        motion.coefficients_to = shcd_model_coefficients(uneven);
        failed |= shcd_sweep(uneven, &motion, scratch, scratch_size, &out) != SHCD_OK;
    }
    return failed;
}

static int keep_accounts(void) {
    const shcd_vec3 up = {0.0, 0.0, 1.0};
    shcd_ledger ledger;
    shcd_ledger_input held;
    double entry_j = 0.0;
    int failed = 0;
    memset(&ledger, 0, sizeof ledger);
    memset(&held, 0, sizeof held);
    held.published.force_n = held.model.force_n = up;
    held.stiffness_n_per_m = 300.0;
    for (int i = 0; i < 4; i++) {
        const shcd_pose pose = pose_at(shcd_scale(1e-3 * i, up), 0.01 * i);
        failed |= !(fabs(shcd_ledger_move(&ledger, &pose, 1e-3)) < 1.0);
        shcd_ledger_share(&ledger, &up, 1, &entry_j);
        failed |= shcd_ledger_hold(&ledger, &held) != SHCD_OK;
    }
    failed |= !(fabs(shcd_ledger_requery(300.0, 1e-3, up, up, 2e-3)) < 1.0);
    shcd_ledger_lift(&ledger);
    return failed | !(fabs(shcd_ledger_margin(&ledger)) < 1.0) | !(entry_j < 0.0);
}

static int ask_network(void) {
    static const double phi_per_m[NETWORK_MODES] = {3.0, -2.0};
    double q_m2[NETWORK_MODES];
    int failed = 0;
    for (int i = 0; i < 4; i++) { /* in its domain, too deep, too far */
        const shcd_vec3 p = {0.05 + (i == 3 ? 1.0 : 0.0), 0.0, 0.0};
        shcd_learned_output out;
        failed |= shcd_learned_evaluate(&network, p, 5e-3 * i, &out) != SHCD_OK;
        failed |= shcd_learned_dent(&network, phi_per_m, 1.0, 5e-3 * i, q_m2) != SHCD_OK;
    }
    return failed;
}

int calls_queries(void) {
    int failed = deform() | ask_models() | keep_accounts() | ask_network();
    for (size_t i = 0; i < COUNT(points); i++) {
        failed |= query_all(sphere, points[i]) | query_all(uneven, points[i]);
        failed |= detect_all(sphere, NULL, points[i]) | detect_all(uneven, NULL, points[i]) |
                  detect_all(uneven, shape, points[i]);
        failed |= look_up_all(points[i]) | tools_against(points[i]);
        failed |= evaluate_all(shcd_vec3_make(points[i].y, points[i].x, 1e-3));
    }
    return failed;
}

/* ---- the tick ------------------------------------------------------------------------------- */

static int ask_scene(shcd_state *state) {
    static double coefficients[3 * SHCD_COUNT(SOFT_DEGREE)];
    const shcd_cost_row row = {.degree = 3,
                               .ns_p50 = 800.0,
                               .ns_p99 = 900.0,
                               .evaluations_mean = 5.0,
                               .patches_mean = 90.0};
    shcd_body_accuracy accuracy;
    int failed = shcd_scene_tool_count(scene) != N_TOOLS || shcd_scene_body_count(scene) != 2;
    failed |= shcd_scene_tool_name(scene, 0) == NULL || shcd_scene_body_name(scene, 0) == NULL;
    failed |= shcd_effect_at(0) == NULL || shcd_scene_effect_count(scene) != 7;
    failed |= shcd_scene_effect_name(scene, 0) == NULL || shcd_scene_effect_body(scene, 6) != 1;
    failed |= shcd_scene_body_is_soft(scene, 0) != 0 || shcd_scene_body_is_soft(scene, 1) != 1;
    failed |=
        shcd_state_coefficients(scene, state, 1, coefficients, COUNT(coefficients)) != SHCD_OK;
    failed |= shcd_state_switch(scene, state, 2, 0, 0.05) != SHCD_OK;
    failed |= shcd_body_accuracy_of(&row, 1, 0, 20.0, &accuracy) != SHCD_OK;
    return failed;
}

/* Around and through both bodies, every tool out of step with the others. */
static void place(shcd_tool_input *in, int tool, int step) {
    const double t = 1e-2 * step + 0.9 * tool;
    const shcd_vec3 p = {0.1 * sin(0.8 * t), 0.03 * sin(1.7 * t), 0.055 * cos(2.3 * t)};
    in->tool_in_world = pose_at(p, t);
    in->velocity_m_per_s = shcd_vec3_make(0.0, 0.3 * cos(t), -0.4);
    in->angular_velocity_rad_per_s = shcd_vec3_make(1.0, -2.0, 0.5);
    in->flags = (step / 50 + tool) % 9 == 0 ? 0u : SHCD_TOOL_INPUT_ACTIVE;
}

int calls_step(void) {
    shcd_tool_input in[N_TOOLS];
    shcd_tool_output out[N_TOOLS];
    shcd_state *state = NULL;
    int n_felt[N_TOOLS] = {0};
    int failed = shcd_state_init(scene, state_memory, state_size, &state) != SHCD_OK;
    memset(in, 0, sizeof in);
    for (int step = 0; step < STEPS && !failed; step++) {
        const shcd_input input = SHCD_INPUT(1e-3, in, N_TOOLS);
        shcd_output output = SHCD_OUTPUT(out, N_TOOLS);
        for (int i = 0; i < N_TOOLS; i++) {
            place(&in[i], i, step);
        }
        failed |= shcd_step(scene, state, &input, &output) != SHCD_OK;
        for (int i = 0; i < N_TOOLS; i++) {
            n_felt[i] += (out[i].flags & SHCD_TOOL_OUTPUT_CONTACT) != 0;
        }
    }
    for (int i = 0; i < N_TOOLS; i++) { /* else nothing was tested */
        failed |= n_felt[i] < STEPS / 20 || n_felt[i] > STEPS - STEPS / 20;
    }
    return failed | ask_scene(state);
}

/* ---- body against body ---------------------------------------------------------------------- */

int calls_pair(void) {
    static const double apart_m[] = {5.0, 2.4, 1.0, 0.0};
    int failed = 0;
    for (size_t i = 0; i < COUNT(apart_m); i++) {
        const shcd_vec3 p = {0.3 * apart_m[i], apart_m[i], 0.0};
        shcd_pair_options options = SHCD_PAIR_OPTIONS_INIT;
        shcd_pair_proximity found;
        options.patches_max = 40000;
        options.evaluations_max = 4000;
        failed |= shcd_pair_closest(sphere, NULL, uneven, NULL, pose_at(p, 0.3), &options,
                                    &found) != SHCD_OK;
        failed |= shcd_pair_closest(uneven, shape, uneven, NULL, pose_at(p, 0.3), &options,
                                    &found) != SHCD_OK;
    }
    return failed;
}
