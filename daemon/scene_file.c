/* SPDX-License-Identifier: BSD-3-Clause */
/* The grammar of a scene file: which keys a map may hold, and what their values mean.
 *
 * The keys of effects come from the library's effects table, so an effect that the library gains is
 * known here at once. All text is checked before the first model is loaded, since loading may take
 * seconds. What is read lives in the tree's memory until the scene has copied it. */
#define _POSIX_C_SOURCE 200809L
#include "config.h"
#include "scene_accuracy.h"
#include "scene_device.h"
#include "scene_effects.h"
#include "scene_pairs.h"
#include "scene_stiffness.h"
#include "tool_shape.h"
#include "yaml_reader.h"
#include "yaml_value.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define NAME_BYTES_MAX 63
#define PATH_BYTES_MAX 4095
#define POSITION_MAX_M 100.0
#define SEMI_AXIS_MIN_M 1e-4
#define SEMI_AXIS_MAX_M 10.0
#define EVALUATIONS_MAX 1000000
/* three decimals, each off by half a unit of the last, change a length of 1 by up to this */
#define QUATERNION_TOLERANCE 1e-3

#define COUNT(array) (sizeof(array) / sizeof(array)[0])

typedef struct body_draft {
    const yaml_node *shape; /* the value of `model` or `ellipsoid` */
    const char *model_path; /* NULL: an ellipsoid */
    double semi_axes_m[3];
    scene_accuracy accuracy;
    scene_law law;
} body_draft;

typedef struct scene_draft {
    yaml_tree *tree;
    scene_device device;
    size_t n_bodies, n_tools;
    body_draft bodies[SHCD_BODIES_MAX];
    const yaml_node *effects[SHCD_BODIES_MAX]; /* the maps; NULL: none */
    shcd_body_def body_defs[SHCD_BODIES_MAX];
    shcd_tool_def tool_defs[SHCD_TOOLS_MAX];
    int32_t tool_ids[SHCD_TOOLS_MAX];
    tool_shape shapes[SHCD_TOOLS_MAX];
} scene_draft;

/* ---- bodies ---------------------------------------------------------------------------------- */

static bool read_orientation(const yaml_tree *tree, const yaml_node *node, shcd_quat *q) {
    double v[4] = {1.0, 0.0, 0.0, 0.0};
    if (!yaml_numbers(tree, node, 4, -2.0, 2.0, NULL, v)) {
        return false;
    }
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + v[3] * v[3]);
    if (!(fabs(length - 1.0) <= QUATERNION_TOLERANCE)) {
        if (!(length > 0.0)) {
            return yaml_fail(tree, node,
                             "is no rotation, must be a quaternion of length 1, w first, like "
                             "[1, 0, 0, 0]");
        }
        return yaml_fail(tree, node,
                         "has length %.6g, must be 1; [%.9g, %.9g, %.9g, %.9g] has the same "
                         "direction",
                         length, v[0] / length, v[1] / length, v[2] / length, v[3] / length);
    }
    const shcd_quat unit = {v[0] / length, v[1] / length, v[2] / length, v[3] / length};
    *q = unit;
    return true;
}

static bool read_pose(const yaml_tree *tree, const yaml_node *node, shcd_pose *pose) {
    yaml_field fields[] = {{"position_m", NULL, NULL}, {"orientation_wxyz", NULL, NULL}};
    if (!yaml_fields(tree, node, "key", fields, COUNT(fields))) {
        return false;
    }
    if (fields[0].node != NULL) {
        double v[3] = {0.0, 0.0, 0.0};
        if (!yaml_numbers(tree, fields[0].node, 3, -POSITION_MAX_M, POSITION_MAX_M, "m", v)) {
            return false;
        }
        pose->position_m = shcd_vec3_make(v[0], v[1], v[2]);
    }
    return fields[1].node == NULL || read_orientation(tree, fields[1].node, &pose->orientation);
}

static bool read_model_path(const yaml_tree *tree, const yaml_node *node, body_draft *body) {
    return yaml_text(tree, node, PATH_BYTES_MAX, &body->model_path);
}

static bool read_ellipsoid(const yaml_tree *tree, const yaml_node *node, body_draft *body) {
    yaml_field fields[] = {{"semi_axes_m", "three lengths, like [0.08, 0.06, 0.05]", NULL}};
    return yaml_fields(tree, node, "key", fields, COUNT(fields)) &&
           yaml_numbers(tree, fields[0].node, 3, SEMI_AXIS_MIN_M, SEMI_AXIS_MAX_M, "m",
                        body->semi_axes_m);
}

/* One node for each name so far: names are few, and the first use is worth telling. */
static bool check_new(const yaml_tree *tree, const yaml_node *node, const yaml_node **seen,
                      size_t n_seen, const char *what) {
    char excerpt[YAML_EXCERPT_SIZE];
    for (size_t i = 0; i < n_seen; i++) {
        if (strcmp(seen[i]->text, node->text) == 0) {
            return yaml_fail(tree, node, "%s '%s' is taken, in line %u; each must be its own", what,
                             yaml_excerpt(node, excerpt), seen[i]->at.line);
        }
    }
    seen[n_seen] = node;
    return true;
}

static bool read_body(scene_draft *draft, const yaml_node *node, const yaml_node **names) {
    const size_t i = draft->n_bodies;
    const shcd_body_def blank = SHCD_BODY_DEF_INIT;
    body_draft *body = &draft->bodies[i];
    shcd_body_def *def = &draft->body_defs[i];
    *def = blank;
    const material *made_of = NULL;
    enum { NAME, MODEL, ELLIPSOID, POSE, MATERIAL, EFFECTS, ACCURACY };
    yaml_field fields[] = {
        [NAME] = {"name", "a name, like liver", NULL}, [MODEL] = {"model", NULL, NULL},
        [ELLIPSOID] = {"ellipsoid", NULL, NULL},       [POSE] = {"pose", NULL, NULL},
        [MATERIAL] = {"material", NULL, NULL},         [EFFECTS] = {"effects", NULL, NULL},
        [ACCURACY] = {"accuracy", NULL, NULL}};
    if (!yaml_fields(draft->tree, node, "key", fields, COUNT(fields)) ||
        !yaml_text(draft->tree, fields[NAME].node, NAME_BYTES_MAX, &def->name) ||
        !check_new(draft->tree, fields[NAME].node, names, i, "the body name")) {
        return false;
    }
    const yaml_node *model = fields[MODEL].node;
    const yaml_node *ellipsoid = fields[ELLIPSOID].node;
    if (model == NULL && ellipsoid == NULL) {
        return yaml_fail_missing(draft->tree, node, "model",
                                 "missing; must be the path of a .shcd file, unless the body is an "
                                 "ellipsoid: {semi_axes_m: [a, b, c]}");
    }
    if (model != NULL && ellipsoid != NULL) {
        return yaml_fail_at_key(draft->tree, model->index > ellipsoid->index ? model : ellipsoid,
                                "a body has one shape, either model or ellipsoid; remove one");
    }
    body->shape = model != NULL ? model : ellipsoid;
    draft->effects[i] = fields[EFFECTS].node;
    return (model == NULL || read_model_path(draft->tree, model, body)) &&
           (ellipsoid == NULL || read_ellipsoid(draft->tree, ellipsoid, body)) &&
           (fields[POSE].node == NULL ||
            read_pose(draft->tree, fields[POSE].node, &def->body_in_world)) &&
           (fields[MATERIAL].node == NULL ||
            material_read(draft->tree, fields[MATERIAL].node, &made_of)) &&
           ((fields[EFFECTS].node == NULL && made_of == NULL) ||
            scene_effects_read(draft->tree, fields[EFFECTS].node, fields[MATERIAL].node, made_of,
                               &draft->device, def, &body->law)) &&
           (fields[ACCURACY].node == NULL ||
            scene_accuracy_read(draft->tree, fields[ACCURACY].node, &body->accuracy));
}

static bool read_bodies(scene_draft *draft, const yaml_node *list) {
    const yaml_node *names[SHCD_BODIES_MAX];
    if (!yaml_list(draft->tree, list, "bodies", 0, SHCD_BODIES_MAX)) {
        return false;
    }
    for (const yaml_node *node = list->first; node != NULL; node = node->next) {
        if (!read_body(draft, node, names)) {
            return false;
        }
        draft->n_bodies++;
    }
    return true;
}

/* ---- tools ----------------------------------------------------------------------------------- */

/* What the tool meets, and of a shell all points together, k / contact_share: no more than the
 * device renders. */
static bool check_laws(const scene_draft *draft, const tool_shape *shape, const char *tool) {
    const double limit = draft->device.stiffness_limit_n_per_m;
    const double force_n = draft->device.profile->force_max_n;
    double stiffest = 0.0;
    for (size_t b = 0; b < draft->n_bodies; b++) {
        const scene_law *law = &draft->bodies[b].law;
        if (!scene_law_check(draft->tree, law, &draft->device, tool, shape->geometry.radius_m)) {
            return false;
        }
        stiffest = fmax(stiffest, scene_law_stiffness(law, 0.0, force_n));
    }
    if (shape->share_node == NULL || stiffest / shape->contact_share <= limit) {
        return true;
    }
    return yaml_fail(draft->tree, shape->share_node,
                     "with a stiffness of %.9g N/m all points together give %.9g N/m, more than "
                     "device %s renders, must be at least %.9g",
                     stiffest, stiffest / shape->contact_share, draft->device.profile->name,
                     stiffest / limit);
}

static bool read_tool(scene_draft *draft, const yaml_node *node, const yaml_node **names,
                      const yaml_node **ids) {
    const size_t i = draft->n_tools;
    const shcd_tool_def blank = SHCD_TOOL_DEF_INIT;
    shcd_tool_def *def = &draft->tool_defs[i];
    *def = blank;
    enum { ID, NAME, SHAPE, EVALUATIONS };
    yaml_field fields[] = {[ID] = {"id", "a whole number, 0 .. 255", NULL},
                           [NAME] = {"name", "a name, like probe", NULL},
                           [SHAPE] = {"shape", TOOL_SHAPE_HINT, NULL},
                           [EVALUATIONS] = {"evaluations_max", NULL, NULL}};
    unsigned id = 0, evaluations_max = 0;
    if (!yaml_fields(draft->tree, node, "key", fields, COUNT(fields)) ||
        !yaml_integer(draft->tree, fields[ID].node, CONFIG_TOOL_ID_MAX, &id) ||
        !check_new(draft->tree, fields[ID].node, ids, i, "the tool id") ||
        !yaml_text(draft->tree, fields[NAME].node, NAME_BYTES_MAX, &def->name) ||
        !check_new(draft->tree, fields[NAME].node, names, i, "the tool name")) {
        return false;
    }
    draft->tool_ids[i] = (int32_t)id;
    if (fields[EVALUATIONS].node != NULL &&
        !yaml_integer(draft->tree, fields[EVALUATIONS].node, EVALUATIONS_MAX, &evaluations_max)) {
        return false;
    }
    def->evaluations_max = evaluations_max;
    return tool_shape_read(draft->tree, fields[SHAPE].node, &draft->shapes[i]) &&
           check_laws(draft, &draft->shapes[i], def->name);
}

static bool read_tools(scene_draft *draft, const yaml_node *list) {
    const yaml_node *names[SHCD_TOOLS_MAX];
    const yaml_node *ids[SHCD_TOOLS_MAX];
    if (!yaml_list(draft->tree, list, "tools", 1, SHCD_TOOLS_MAX)) {
        return false;
    }
    for (const yaml_node *node = list->first; node != NULL; node = node->next) {
        if (!read_tool(draft, node, names, ids)) {
            return false;
        }
        draft->n_tools++;
    }
    return true;
}

/* ---- the whole ------------------------------------------------------------------------------- */

static bool read_scene(scene_draft *draft) {
    enum { RATE, DEVICE, BODIES, TOOLS, PASSIVITY, DELAY };
    yaml_field fields[] = {
        [RATE] = {"rate_hz", NULL, NULL},
        [DEVICE] = {"device", NULL, NULL},
        [BODIES] = {"bodies", "a list of bodies (or [])", NULL},
        [TOOLS] = {"tools", "a list of tools, like [{id: 0, name: probe, shape: point}]", NULL},
        [PASSIVITY] = {"passivity", NULL, NULL},
        [DELAY] = {"delay_s", NULL, NULL}};
    return yaml_fields(draft->tree, draft->tree->root, "key", fields, COUNT(fields)) &&
           scene_device_read(draft->tree, fields[RATE].node, fields[DEVICE].node,
                             fields[DELAY].node, fields[PASSIVITY].node, &draft->device) &&
           read_bodies(draft, fields[BODIES].node) && read_tools(draft, fields[TOOLS].node);
}

/* ---- models and scene ------------------------------------------------------------------------ */

static shcd_model *find_loaded(const scene_draft *draft, const daemon_config *config, size_t i) {
    for (size_t k = 0; k < i; k++) {
        if (draft->bodies[k].model_path != NULL &&
            strcmp(draft->bodies[k].model_path, draft->bodies[i].model_path) == 0) {
            return config->sources[k] != NULL ? config->sources[k] : config->models[k];
        }
    }
    return NULL;
}

/* A model that is cut off after a degree has neither modes nor a learned response. */
static bool needs_whole_model(const shcd_body_def *def) {
    bool is_needed = false;
    for (size_t e = 0; e < def->n_effects; e++) {
        const char *name = def->effects[e].name;
        is_needed |= strcmp(name, "wave") == 0 || strcmp(name, "learned") == 0;
    }
    return is_needed;
}

/* The body is queried as its accuracy asks for, perhaps in a lower degree. */
static bool apply_accuracy(scene_draft *draft, daemon_config *config, size_t i) {
    shcd_body_def *def = &draft->body_defs[i];
    scene_answer answer;
    if (!scene_accuracy_resolve(draft->tree, &draft->bodies[i].accuracy, config->models[i],
                                def->name, needs_whole_model(def), draft->n_tools, &answer)) {
        return false;
    }
    def->accuracy = answer.accuracy;
    config->maps[i] = answer.map;
    if (answer.model != NULL) {
        config->sources[i] = config->models[i];
        config->models[i] = answer.model;
    }
    return true;
}

static bool make_model(scene_draft *draft, daemon_config *config, size_t i) {
    const body_draft *body = &draft->bodies[i];
    shcd_error problem = {SHCD_OK, ""};
    shcd_status status = SHCD_OK;
    if (body->model_path == NULL) {
        status = config_ellipsoid(body->semi_axes_m, &config->models[i], &problem);
    } else if ((config->models[i] = find_loaded(draft, config, i)) == NULL) {
        const char *path = yaml_resolve_path(draft->tree, body->model_path);
        if (path == NULL) {
            return false;
        }
        status = shcd_model_load(path, NULL, &config->models[i], &problem);
    }
    if (status != SHCD_OK) {
        return yaml_fail(draft->tree, body->shape, "no body can be made from it: %s",
                         problem.message);
    }
    config->n_models = i + 1;
    if (body->accuracy.node != NULL && !apply_accuracy(draft, config, i)) {
        return false;
    }
    draft->body_defs[i].model = config->models[i];
    config->body_in_world[i] = draft->body_defs[i].body_in_world;
    return scene_stiffness_check_learned(draft->tree, draft->effects[i], &draft->body_defs[i],
                                         &draft->device);
}

static bool make_config(scene_draft *draft, daemon_config *config) {
    shcd_error problem = {SHCD_OK, ""};
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    config->rate_hz = draft->device.rate_hz;
    config->device = draft->device.profile;
    config->reserve_j = draft->device.reserve_j;
    config->delay_s = draft->device.stated.delay_s;
    memcpy(config->tool_ids, draft->tool_ids, sizeof config->tool_ids);
    for (size_t i = 0; i < draft->n_bodies; i++) {
        if (!make_model(draft, config, i)) {
            return false;
        }
    }
    for (size_t i = 0; i < draft->n_tools; i++) {
        if (!tool_shape_make(draft->tree, &draft->shapes[i], &draft->tool_defs[i],
                             &config->geometries[i])) {
            return false;
        }
    }
    def.bodies = draft->n_bodies > 0 ? draft->body_defs : NULL;
    def.n_bodies = draft->n_bodies;
    def.tools = draft->tool_defs;
    def.n_tools = draft->n_tools;
    if (shcd_scene_create(&def, NULL, &config->scene, &problem) != SHCD_OK) {
        return scene_effects_fail(draft->tree, draft->effects, draft->body_defs, draft->n_bodies,
                                  problem.message);
    }
    double radius_m = 0.0, width_m = 0.0, stiffness_n_per_m[SHCD_BODIES_MAX];
    for (size_t i = 0; i < draft->n_tools; i++) {
        radius_m = fmax(radius_m, draft->shapes[i].geometry.radius_m);
        width_m = fmax(width_m, scene_tool_width(&draft->shapes[i].geometry));
    }
    for (size_t i = 0; i < draft->n_bodies; i++) {
        if (!scene_stiffness_check_wave(draft->tree, draft->effects[i], config->scene, i,
                                        &draft->body_defs[i], &draft->bodies[i].law, radius_m,
                                        &draft->device)) {
            return false;
        }
        stiffness_n_per_m[i] =
            scene_stiffness_of(draft->effects[i], config->scene, i, &draft->body_defs[i],
                               &draft->bodies[i].law, radius_m, &draft->device);
    }
    (void)scene_pairs_tell(draft->body_defs, stiffness_n_per_m, draft->n_bodies, width_m,
                           &draft->device);
    return true;
}

static bool load(yaml_tree *tree, daemon_config *config) {
    daemon_config made = {0};
    scene_draft *draft = yaml_allocate(tree, sizeof *draft);
    if (draft == NULL) {
        return false;
    }
    draft->tree = tree;
    if (!yaml_read(tree) || !read_scene(draft) || !make_config(draft, &made)) {
        config_free(&made);
        return false;
    }
    *config = made;
    return true;
}

bool config_load(const char *path, daemon_config *config, char *error, size_t error_size) {
    yaml_tree tree = {.file = path, .error = error, .error_size = error_size};
    /* in the C locale a number has a point, whatever the user's language; for this thread only */
    const locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (plain == (locale_t)0) {
        return yaml_fail(&tree, NULL, "out of memory");
    }
    const locale_t users = uselocale(plain);
    const bool good = load(&tree, config);
    yaml_release(&tree);
    (void)uselocale(users);
    freelocale(plain);
    return good;
}
