/* SPDX-License-Identifier: BSD-3-Clause */
/* From a definition to the constant scene. Everything is checked here, once, so that a tick checks
 * only what changes from tick to tick; names are resolved and copied into one block of memory.
 *
 * The state belongs to a scene by a fingerprint of all that the definition says (FNV-1a over
 * values, never over addresses): a snapshot may be resumed by another process that built the same
 * scene, and is refused by any other. */
#include "response/accuracy.h"
#include "response/learned_dent.h"
#include "response/scene_private.h"

#include <stdalign.h>
#include <string.h>

bool shcdi_is_rotation(shcd_quat q) {
    const double n = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
    return fabs(n - 1.0) <= SHCDI_QUATERNION_TOLERANCE;
}

bool shcdi_is_moderate(shcd_vec3 v) {
    return fabs(v.x) <= SHCDI_MAGNITUDE_MAX && fabs(v.y) <= SHCDI_MAGNITUDE_MAX &&
           fabs(v.z) <= SHCDI_MAGNITUDE_MAX;
}

/* ---- reading the definition ----------------------------------------------------------------- */

/* Element i of a caller's array whose elements may be older (shorter) or newer (longer) than ours:
 * what both know is copied over the defaults already in `element`. */
static void read_element(const void *array, size_t stride, size_t i, void *element, size_t size) {
    memcpy(element, (const char *)array + i * stride, stride < size ? stride : size);
}

static shcd_body_def read_body(const shcd_body_def *bodies, size_t i) {
    shcd_body_def body = SHCD_BODY_DEF_INIT;
    read_element(bodies, bodies->struct_size, i, &body, sizeof body);
    return body;
}

static shcd_tool_def read_tool(const shcd_tool_def *tools, size_t i) {
    shcd_tool_def tool = SHCD_TOOL_DEF_INIT;
    read_element(tools, tools->struct_size, i, &tool, sizeof tool);
    return tool;
}

/* ---- checks --------------------------------------------------------------------------------- */

static shcd_status check_name(const char *kind, size_t i, const char *name, shcd_error *error) {
    size_t n = 0;
    if (name == NULL || name[0] == '\0') {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "scene_create: %s %zu has no name", kind, i);
    }
    for (; n < SHCDI_NAME_BYTES && name[n] != '\0'; n++) {
        if ((unsigned char)name[n] < 0x20 || name[n] == 0x7f) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: the name of %s %zu holds a control character", kind,
                              i);
        }
    }
    if (n == SHCDI_NAME_BYTES) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: the name of %s %zu is longer than %d bytes", kind, i,
                          SHCDI_NAME_BYTES - 1);
    }
    return SHCD_OK;
}

static shcd_status check_pose(const char *body, shcd_pose pose, shcd_error *error) {
    const shcd_quat q = pose.orientation;
    if (!shcd_vec3_is_finite(pose.position_m) ||
        !shcd_vec3_is_finite(shcd_vec3_make(q.x, q.y, q.z)) || !shcdi_is_finite(q.w)) {
        return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                          "scene_create: body '%s': its pose is not finite", body);
    }
    if (!shcdi_is_moderate(pose.position_m)) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': a coordinate of its position exceeds %g m",
                          body, SHCDI_MAGNITUDE_MAX);
    }
    if (!shcdi_is_rotation(q)) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': its orientation is not a unit quaternion "
                          "(|q|^2 = %.9g)",
                          body, q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    }
    return SHCD_OK;
}

static shcd_status check_body(const shcd_scene_def *definition, size_t i, size_t *n_active,
                              size_t *soft_bytes, shcd_error *error) {
    const shcd_body_def body = read_body(definition->bodies, i);
    shcdi_active_effect active[SHCDI_EFFECTS_MAX];
    size_t memory_bytes;
    shcd_status status;
    if (body.struct_size != definition->bodies->struct_size) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body %zu: struct_size differs from that of body 0", i);
    }
    status = check_name("body", i, body.name, error);
    if (status != SHCD_OK) {
        return status;
    }
    for (size_t k = 0; k < i; k++) {
        if (strcmp(read_body(definition->bodies, k).name, body.name) == 0) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT, "scene_create: two bodies are named '%s'",
                              body.name);
        }
    }
    if (body.model == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "scene_create: body '%s' has no model",
                          body.name);
    }
    status = check_pose(body.name, body.body_in_world, error);
    if (status == SHCD_OK) {
        status = shcdi_accuracy_check(body.name, &body.accuracy, error);
    }
    if (status != SHCD_OK) {
        return status;
    }
    status = shcdi_effects_resolve(body.name, body.effects, body.n_effects, active, n_active,
                                   &memory_bytes, error);
    if (status == SHCD_OK) {
        status = shcdi_learned_effect_check(body.name, body.model, active, *n_active, error);
        if (status == SHCD_OK) {
            status = shcdi_soft_check(body.name, body.model, active, *n_active, error);
        }
        *soft_bytes += status == SHCD_OK ? shcdi_soft_bytes(body.model, active, *n_active) : 0;
    }
    return status;
}

static shcd_status check_tool(const shcd_scene_def *definition, size_t i, shcd_error *error) {
    const shcd_tool_def tool = read_tool(definition->tools, i);
    shcd_status status;
    if (tool.struct_size != definition->tools->struct_size) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: tool %zu: struct_size differs from that of tool 0", i);
    }
    status = check_name("tool", i, tool.name, error);
    if (status != SHCD_OK) {
        return status;
    }
    for (size_t k = 0; k < i; k++) {
        if (strcmp(read_tool(definition->tools, k).name, tool.name) == 0) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT, "scene_create: two tools are named '%s'",
                              tool.name);
        }
    }
    return shcdi_tool_check(&tool, error);
}

static shcd_status check_counts(const shcd_scene_def *definition, shcd_error *error) {
    if (definition->n_bodies > SHCD_BODIES_MAX) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: %zu bodies, at most %d are allowed", definition->n_bodies,
                          SHCD_BODIES_MAX);
    }
    if (definition->n_tools < 1 || definition->n_tools > SHCD_TOOLS_MAX) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "scene_create: %zu tools, must be 1 .. %d",
                          definition->n_tools, SHCD_TOOLS_MAX);
    }
    if (definition->n_bodies > 0 && definition->bodies == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "scene_create: bodies is null");
    }
    if (definition->tools == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "scene_create: tools is null");
    }
    if (definition->n_bodies > 0 && definition->bodies->struct_size < sizeof(size_t)) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body 0: struct_size is %zu; use SHCD_BODY_DEF_INIT",
                          definition->bodies->struct_size);
    }
    if (definition->tools->struct_size < sizeof(size_t)) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: tool 0: struct_size is %zu; use SHCD_TOOL_DEF_INIT",
                          definition->tools->struct_size);
    }
    return SHCD_OK;
}

static shcd_status check_definition(const shcd_scene_def *definition, size_t *n_active,
                                    size_t *soft_bytes, shcd_error *error) {
    shcd_status status = check_counts(definition, error);
    *n_active = 0;
    *soft_bytes = 0;
    for (size_t i = 0; status == SHCD_OK && i < definition->n_bodies; i++) {
        size_t n = 0;
        status = check_body(definition, i, &n, soft_bytes, error);
        *n_active += n;
    }
    for (size_t i = 0; status == SHCD_OK && i < definition->n_tools; i++) {
        status = check_tool(definition, i, error);
    }
    return status;
}

/* ---- building ------------------------------------------------------------------------------- */

#define FNV_BASIS 0xcbf29ce484222325u
#define FNV_PRIME 0x100000001b3u

static uint64_t hash(uint64_t h, const void *bytes, size_t n) {
    const unsigned char *b = bytes;
    for (size_t i = 0; i < n; i++) {
        h = (h ^ b[i]) * FNV_PRIME;
    }
    return h;
}

/* The network of a body that calls for it: all numbers that its force depends on. */
static uint64_t hash_learned(uint64_t h, const shcdi_body *body) {
    const shcd_learned *l = shcd_model_learned(body->model);
    for (size_t e = 0; e < body->n_effects; e++) {
        if (l != NULL && body->effects[e].effect == &shcdi_effect_learned) {
            const double scalars[] = {l->support_m, l->fill_m, l->depth_max_m, l->direct_n_per_m,
                                      l->damping_n_s_per_m2};
            const size_t n = l->n_centres;
            h = hash(h, scalars, sizeof scalars);
            h = hash(h, l->centre_m, 3 * n * sizeof(double));
            h = hash(h, l->weight_n_per_m, (n + 1) * l->n_terms * sizeof(double));
        }
    }
    return h;
}

static uint64_t hash_body(uint64_t h, const shcdi_body *body) {
    const int degree = shcd_model_degree(body->model);
    h = hash(h, body->name, sizeof body->name);
    h = hash(h, &body->body_in_world, sizeof body->body_in_world);
    h = hash(h, &degree, sizeof degree);
    h = hash(h, shcd_model_coefficients(body->model), 3 * SHCD_COUNT(degree) * sizeof(double));
    h = shcdi_accuracy_hash(h, &body->accuracy, hash);
    if (body->soft != NULL) {
        const size_t n = body->soft->n_modes;
        const shcd_modes *modes = shcd_model_modes(body->model);
        h = hash(h, modes->eigenvalue_per_m2, n * sizeof(double));
        h = hash(h, modes->coefficient_per_m, n * SHCD_COUNT(degree) * sizeof(double));
    }
    h = hash_learned(h, body);
    for (size_t e = 0; e < body->n_effects; e++) {
        const shcdi_active_effect *active = &body->effects[e];
        /* the terminating null ends the name, so that names cannot run into each other */
        h = hash(h, active->effect->info.name, strlen(active->effect->info.name) + 1);
        h = hash(h, active->constants, sizeof active->constants);
    }
    return h;
}

static uint64_t hash_tool(uint64_t h, const shcdi_tool *tool) {
    h = hash(h, tool->name, sizeof tool->name);
    h = hash(h, &tool->kind, sizeof tool->kind);
    h = hash(h, &tool->evaluations_max, sizeof tool->evaluations_max);
    h = hash(h, &tool->radius_m, sizeof tool->radius_m);
    h = hash(h, &tool->contact_share, sizeof tool->contact_share);
    if (tool->geometry != NULL) {
        const shcd_tool_geometry *g = tool->geometry;
        const uint64_t n = shcdi_tool_point_count(g);
        h = hash(h, &n, sizeof n);
        h = hash(h, &g->middle_m, sizeof g->middle_m);
        h = hash(h, &g->half_m, sizeof g->half_m);
        h = n > 0 ? hash(h, shcdi_tool_points(g), n * sizeof(shcd_vec3)) : h;
        h = g->normal != NULL ? hash(h, g->normal, n * sizeof(shcd_vec3)) : h;
    }
    return h;
}

static uint64_t fingerprint(const shcd_scene *scene) {
    const uint64_t counts[2] = {scene->n_bodies, scene->n_tools};
    uint64_t h = hash(FNV_BASIS, counts, sizeof counts);
    for (size_t i = 0; i < scene->n_bodies; i++) {
        h = hash_body(h, &scene->bodies[i]);
    }
    for (size_t i = 0; i < scene->n_tools; i++) {
        h = hash_tool(h, &scene->tools[i]);
    }
    return h;
}

static shcd_status fill_body(shcd_scene *scene, const shcd_body_def *definition,
                             shcdi_active_effect *active, shcdi_body *body, shcd_error *error) {
    shcd_model_info info = {.struct_size = sizeof info};
    shcd_status status = shcd_model_describe(definition->model, &info);
    if (status != SHCD_OK) {
        return shcdi_fail(error, status, "scene_create: body '%s': its model has no description",
                          definition->name);
    }
    memcpy(body->name, definition->name, strlen(definition->name));
    body->model = definition->model;
    body->body_in_world.position_m = definition->body_in_world.position_m;
    body->body_in_world.orientation = shcdi_unit_quaternion(definition->body_in_world.orientation);
    body->ball_centre_m = info.centre_m;
    body->ball_radius_m = info.radius_m;
    body->diagonal_m = info.diagonal_m;
    body->deviation_m = info.max_deviation_m;
    body->n_leaves = (uint32_t)info.n_leaves;
    body->n_harmonics = (uint32_t)SHCD_COUNT(info.degree);
    body->accuracy = definition->accuracy;
    body->effects = active;
    body->memory_offset = scene->tool_memory_bytes;
    status = shcdi_effects_resolve(definition->name, definition->effects, definition->n_effects,
                                   active, &body->n_effects, &body->memory_bytes, error);
    scene->tool_memory_bytes += body->memory_bytes;
    body->first_effect = scene->n_effects;
    scene->n_effects += body->n_effects;
    return status;
}

/* Shells keep what they know in the state behind all that every tool has, one part for each body.
 * @return the end of the trees */
static unsigned char *fill_tools(shcd_scene *scene, const shcd_scene_def *definition,
                                 unsigned char *trees) {
    scene->gains_offset =
        sizeof(shcd_state) + scene->n_tools * (scene->n_bodies * sizeof(shcdi_contact) +
                                               SHCDI_WALLS_MAX * scene->tool_memory_bytes);
    scene->state_size = scene->gains_offset + scene->n_effects * sizeof(shcdi_gain);
    for (size_t i = 0; i < definition->n_tools; i++) {
        const shcd_tool_def def = read_tool(definition->tools, i);
        shcdi_tool *tool = &scene->tools[i];
        memcpy(tool->name, def.name, strlen(def.name));
        shcdi_tool_fill(&def, trees, tool);
        trees += shcdi_tool_bytes(&def);
        tool->state_offset = scene->state_size;
        scene->state_size += scene->n_bodies * tool->shell.body_bytes +
                             tool->shell.n_slots * scene->tool_memory_bytes;
    }
    return trees;
}

/* Last in the state: the memory of soft bodies, which wants more alignment than the rest. */
static void fill_soft(shcd_scene *scene, unsigned char *memory) {
    for (size_t b = 0; b < scene->n_bodies; b++) {
        shcdi_body *body = &scene->bodies[b];
        const size_t bytes = shcdi_soft_bytes(body->model, body->effects, body->n_effects);
        if (bytes > 0) {
            body->soft = shcdi_soft_create(body->model, body->effects, body->n_effects, memory);
            memory += bytes;
            body->soft_offset = (scene->state_size + 15) / 16 * 16;
            scene->state_size = body->soft_offset + body->soft->state_bytes;
        }
    }
}

static shcd_status fill_scene(shcd_scene *scene, const shcd_scene_def *definition,
                              shcdi_active_effect *active, shcd_error *error) {
    for (size_t i = 0; i < definition->n_bodies; i++) {
        const shcd_body_def body = read_body(definition->bodies, i);
        const shcd_status status = fill_body(scene, &body, active, &scene->bodies[i], error);
        if (status != SHCD_OK) {
            return status;
        }
        active += scene->bodies[i].n_effects;
    }
    fill_soft(scene,
              fill_tools(scene, definition, (unsigned char *)(scene->tools + scene->n_tools)));
    scene->fingerprint = fingerprint(scene);
    return SHCD_OK;
}

static size_t tree_bytes(const shcd_scene_def *definition) {
    size_t bytes = 0;
    for (size_t i = 0; i < definition->n_tools; i++) {
        const shcd_tool_def tool = read_tool(definition->tools, i);
        bytes += shcdi_tool_bytes(&tool);
    }
    return bytes;
}

shcd_status shcd_scene_create(const shcd_scene_def *definition, const shcd_allocator *allocator,
                              shcd_scene **scene, shcd_error *error) {
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    const shcd_allocator memory = shcdi_allocator(allocator);
    size_t n_active, soft_bytes;
    if (definition == NULL || scene == NULL || memory.allocate == NULL || memory.release == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "scene_create: an argument is null");
    }
    if (definition->struct_size < sizeof(size_t)) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: struct_size is %zu; use SHCD_SCENE_DEF_INIT",
                          definition->struct_size);
    }
    read_element(definition, definition->struct_size, 0, &def, sizeof def);
    shcd_status status = check_definition(&def, &n_active, &soft_bytes, error);
    if (status != SHCD_OK) {
        return status;
    }
    _Static_assert(sizeof(shcd_scene) % alignof(shcdi_body) == 0 &&
                       sizeof(shcdi_body) % alignof(shcdi_active_effect) == 0 &&
                       sizeof(shcdi_active_effect) % alignof(shcdi_tool) == 0 &&
                       sizeof(shcdi_tool) % alignof(double) == 0,
                   "the arrays follow each other without gaps");
    const size_t size = sizeof(shcd_scene) + def.n_bodies * sizeof(shcdi_body) +
                        n_active * sizeof(shcdi_active_effect) + def.n_tools * sizeof(shcdi_tool) +
                        tree_bytes(&def) + soft_bytes;
    shcd_scene *made = memory.allocate(size, memory.user);
    if (made == NULL) {
        return shcdi_fail(error, SHCD_ERR_MEMORY, "scene_create: no memory for %zu bytes", size);
    }
    memset(made, 0, size);
    made->allocator = memory;
    made->n_bodies = def.n_bodies;
    made->n_tools = def.n_tools;
    made->bodies = (shcdi_body *)(void *)(made + 1);
    shcdi_active_effect *active = (shcdi_active_effect *)(void *)(made->bodies + def.n_bodies);
    made->tools = (shcdi_tool *)(void *)(active + n_active);
    status = fill_scene(made, &def, active, error);
    if (status != SHCD_OK) {
        shcd_scene_free(made);
        return status;
    }
    *scene = made;
    return SHCD_OK;
}

void shcd_scene_free(shcd_scene *scene) {
    if (scene != NULL) {
        const shcd_allocator memory = scene->allocator;
        memory.release(scene, memory.user);
    }
}

/* ---- what a scene is ------------------------------------------------------------------------ */

size_t shcd_scene_body_count(const shcd_scene *scene) {
    return scene != NULL ? scene->n_bodies : 0;
}

size_t shcd_scene_tool_count(const shcd_scene *scene) {
    return scene != NULL ? scene->n_tools : 0;
}

const char *shcd_scene_body_name(const shcd_scene *scene, size_t body) {
    return scene != NULL && body < scene->n_bodies ? scene->bodies[body].name : NULL;
}

const char *shcd_scene_tool_name(const shcd_scene *scene, size_t tool) {
    return scene != NULL && tool < scene->n_tools ? scene->tools[tool].name : NULL;
}

size_t shcd_scene_effect_count(const shcd_scene *scene) {
    return scene != NULL ? scene->n_effects : 0;
}

size_t shcd_scene_effect_body(const shcd_scene *scene, size_t effect) {
    if (scene == NULL || effect >= scene->n_effects) {
        return SIZE_MAX;
    }
    size_t b = 0;
    while (effect >= scene->bodies[b].first_effect + scene->bodies[b].n_effects) {
        b++;
    }
    return b;
}

const char *shcd_scene_effect_name(const shcd_scene *scene, size_t effect) {
    const size_t b = shcd_scene_effect_body(scene, effect);
    return b != SIZE_MAX
               ? scene->bodies[b].effects[effect - scene->bodies[b].first_effect].effect->info.name
               : NULL;
}

int shcd_scene_body_is_soft(const shcd_scene *scene, size_t body) {
    return scene != NULL && body < scene->n_bodies &&
           (scene->bodies[body].soft != NULL || shcdi_learned_has_dent(&scene->bodies[body]));
}
