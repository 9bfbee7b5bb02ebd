/* SPDX-License-Identifier: BSD-3-Clause */
/* golden_contact FILE: the force of one tick of shcd_step against contact.txt. */
#include "table.h"

#include "shcd/shcd.h"

#define ROWS_MIN 20
#define BODIES_MAX 4
#define UNIT 2.0466534158929770 /* sqrt(4 pi / 3) */

typedef struct case_body {
    shcd_model *model;
    shcd_pose pose;
    shcd_parameter_value stiffness, damping[2];
    shcd_effect_def effects[2];
    size_t n_effects;
} case_body;

static int make_model(table *t, case_body *b, const double a[3]) {
    double c[12] = {0.0};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_error error = {SHCD_OK, ""};
    c[3 * SHCD_INDEX(1, 1)] = a[0] * UNIT;
    c[3 * SHCD_INDEX(1, -1) + 1] = a[1] * UNIT;
    c[3 * SHCD_INDEX(1, 0) + 2] = a[2] * UNIT;
    def.degree = 1;
    def.coefficients = c;
    if (shcd_model_create(&def, NULL, &b->model, &error) != SHCD_OK) {
        table_complain(t, "%s", error.message);
        return 1;
    }
    return 0;
}

/* One clause behind the shape: at, turned, stiffness, damping. */
static int read_clause(table *t, case_body *b, const char *word, char **rest) {
    double n[4];
    if (strcmp(word, "at") == 0 && table_numbers(t, rest, 3, n) == 0) {
        b->pose.position_m = shcd_vec3_make(n[0], n[1], n[2]);
        return 0;
    }
    if (strcmp(word, "turned") == 0 && table_numbers(t, rest, 4, n) == 0) {
        const shcd_quat q = {n[0], n[1], n[2], n[3]};
        b->pose.orientation = q;
        return 0;
    }
    if (strcmp(word, "stiffness") == 0 && table_numbers(t, rest, 1, n) == 0) {
        b->stiffness.name = "k_n_per_m";
        b->stiffness.value = n[0];
        b->effects[b->n_effects++] = (shcd_effect_def){"stiffness", &b->stiffness, 1};
        return 0;
    }
    if (strcmp(word, "damping") == 0 && table_numbers(t, rest, 2, n) == 0) {
        b->damping[0] = (shcd_parameter_value){"ratio", n[0]};
        b->damping[1] = (shcd_parameter_value){"reference_speed_m_per_s", n[1]};
        b->effects[b->n_effects++] = (shcd_effect_def){"damping", b->damping, 2};
        return 0;
    }
    table_complain(t, "a body has: at, turned, stiffness, damping, each once; not %s", word);
    return 1;
}

static int read_body(table *t, char *text, case_body *b) {
    const char *kind = table_word(&text);
    const int is_sphere = kind != NULL && strcmp(kind, "sphere") == 0;
    double a[3];
    b->pose.orientation.w = 1.0;
    if (!is_sphere && (kind == NULL || strcmp(kind, "ellipsoid") != 0)) {
        table_complain(t, "a body is a sphere or an ellipsoid");
        return 1;
    }
    if (table_numbers(t, &text, is_sphere ? 1 : 3, a) != 0) {
        return 1;
    }
    if (is_sphere) {
        a[1] = a[2] = a[0];
    }
    for (const char *word = table_word(&text); word != NULL; word = table_word(&text)) {
        if (b->n_effects == 2 || read_clause(t, b, word, &text) != 0) {
            return 1;
        }
    }
    return make_model(t, b, a);
}

static int read_tool(table *t, char *text, double *radius_m, shcd_tool_input *in) {
    double n[3];
    for (const char *word = table_word(&text); word != NULL; word = table_word(&text)) {
        if (strcmp(word, "radius") == 0 && table_numbers(t, &text, 1, radius_m) == 0) {
            continue;
        }
        if (strcmp(word, "at") == 0 && table_numbers(t, &text, 3, n) == 0) {
            in->tool_in_world.position_m = shcd_vec3_make(n[0], n[1], n[2]);
        } else if (strcmp(word, "moving") == 0 && table_numbers(t, &text, 3, n) == 0) {
            in->velocity_m_per_s = shcd_vec3_make(n[0], n[1], n[2]);
        } else {
            table_complain(t, "a tool has: radius, at, moving; not %s", word);
            return 1;
        }
    }
    return 0;
}

/* The first tick of a new scene. */
static int step(table *t, const case_body *bodies, size_t n_bodies, double radius_m,
                const shcd_tool_input *in, shcd_tool_output *out) {
    static _Alignas(16) unsigned char memory[1 << 16];
    static const char *const names[BODIES_MAX] = {"first", "second", "third", "fourth"};
    shcd_body_def defs[BODIES_MAX];
    shcd_tool_def tool = SHCD_TOOL_DEF_INIT;
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    shcd_scene *scene = NULL;
    shcd_state *state = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_input input = {0.001, in, 1};
    shcd_output output = {out, 1};
    for (size_t i = 0; i < n_bodies; i++) {
        const shcd_body_def empty = SHCD_BODY_DEF_INIT;
        defs[i] = empty;
        defs[i].name = names[i];
        defs[i].model = bodies[i].model;
        defs[i].body_in_world = bodies[i].pose;
        defs[i].effects = bodies[i].effects;
        defs[i].n_effects = bodies[i].n_effects;
    }
    tool.name = "tool";
    tool.kind = radius_m > 0.0 ? SHCD_TOOL_SPHERE : SHCD_TOOL_POINT;
    tool.radius_m = radius_m;
    def.bodies = defs;
    def.n_bodies = n_bodies;
    def.tools = &tool;
    def.n_tools = 1;
    int failed = shcd_scene_create(&def, NULL, &scene, &error) != SHCD_OK ||
                 shcd_state_size(scene) > sizeof memory ||
                 shcd_state_init(scene, memory, sizeof memory, &state) != SHCD_OK ||
                 shcd_step(scene, state, &input, &output) != SHCD_OK;
    if (failed) {
        table_complain(t, "refused: %s", error.message);
    }
    shcd_scene_free(scene);
    return failed;
}

static int read_bodies(table *t, case_body *bodies, size_t *n_bodies) {
    for (char *rest = t->fields[0]; rest != NULL;) {
        char *end = strchr(rest, ';');
        if (end != NULL) {
            *end = '\0';
        }
        if (*n_bodies == BODIES_MAX) {
            table_complain(t, "more than %d bodies", BODIES_MAX);
            return 1;
        }
        if (read_body(t, rest, &bodies[(*n_bodies)++]) != 0) {
            return 1;
        }
        rest = end != NULL ? end + 1 : NULL;
    }
    return 0;
}

static void check_row(table *t) {
    case_body bodies[BODIES_MAX] = {{0}};
    size_t n_bodies = 0;
    double radius_m = 0.0, force[3], tolerance;
    shcd_tool_input in = {.tool_in_world = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}},
                          .flags = SHCD_TOOL_INPUT_ACTIVE};
    shcd_tool_output out;
    if (read_bodies(t, bodies, &n_bodies) == 0 && read_tool(t, t->fields[1], &radius_m, &in) == 0 &&
        table_quantity(t, 2, 3, force, NULL) == 0 &&
        table_quantity(t, 3, 1, &tolerance, "N") == 0 &&
        step(t, bodies, n_bodies, radius_m, &in, &out) == 0) {
        table_check(t, out.wrench.force_n.x, force[0], tolerance);
        table_check(t, out.wrench.force_n.y, force[1], tolerance);
        table_check(t, out.wrench.force_n.z, force[2], tolerance);
    }
    for (size_t i = 0; i < n_bodies; i++) {
        shcd_model_free(bodies[i].model);
    }
}

int main(int argc, char **argv) {
    table t;
    if (argc != 2 || table_open(&t, argv[1]) != 0) {
        fprintf(stderr, "usage: golden_contact FILE\n");
        return 2;
    }
    while (table_next(&t, 5)) {
        check_row(&t);
    }
    return table_close(&t, ROWS_MIN);
}
