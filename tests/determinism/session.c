/* SPDX-License-Identifier: BSD-3-Clause */
#include "session.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE_MAX 15
#define BLOCK ((size_t)250) /* ticks of one manner of moving */
#define N_MANNERS 5

typedef struct body_recipe {
    const char *name;
    int degree;
    double axes_m[3];   /* of the ellipsoid that carries the detail */
    double detail_m;    /* size of the coefficients of degree l >= 2, times l^3 */
    shcd_pose in_world; /* quaternions: integers whose squares sum to a square */
    double reach_m;     /* about half its size: how far the tools' paths go */
    size_t n_modes;     /* 0: a rigid body */
} body_recipe;

static const body_recipe recipes[SESSION_BODIES] = {
    {"egg", 1, {0.06, 0.04, 0.03}, 0.0, {{0.0, 0.0, 0.0}, {0.2, 0.4, 0.4, 0.8}}, 0.045},
    {"lump",
     15,
     {0.05, 0.045, 0.04},
     0.012,
     {{0.15, 0.01, -0.02}, {2.0 / 9.0, 4.0 / 9.0, 5.0 / 9.0, 6.0 / 9.0}},
     0.05},
    {"bean", 9, {0.03, 0.05, 0.035}, 0.01, {{0.02, 0.085, 0.03}, {0.8, -0.4, 0.4, 0.2}}, 0.045, 49},
    {"marble", 1, {0.02, 0.02, 0.02}, 0.0, {{-0.08, 0.03, 0.02}, {1.0, 0.0, 0.0, 0.0}}, 0.02}};

static const double radii_m[SESSION_TOOLS] = {0.0, 0.003, 0.008, 0.0, 0.0, 0.0};
#define FIRST_TURNING ((size_t)4) /* the capsule; the tools before it do not turn */
#define SHELL_POINTS 150

/* ---- bodies --------------------------------------------------------------------------------- */

/* A linear congruence (Knuth, The Art of Computer Programming 2, 3.3.4); the high bits are used. */
static int64_t next_integer(uint64_t *random) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return (int64_t)((*random >> 33) % 2001u) - 1000;
}

/* Modes as if the body were a sphere: not its own, and as good for a test of bits. */
static const shcd_modes *make_modes(const body_recipe *r) {
    static double eigenvalues[SHCD_COUNT(DEGREE_MAX)];
    static double rows[SHCD_COUNT(DEGREE_MAX) * SHCD_COUNT(DEGREE_MAX)];
    static shcd_modes modes;
    const double radius_m = r->reach_m;
    const size_t count = SHCD_COUNT(r->degree);
    memset(rows, 0, sizeof rows);
    for (int l = 0; l <= r->degree; l++) {
        for (size_t i = SHCD_INDEX(l, -l); i <= SHCD_INDEX(l, l); i++) {
            eigenvalues[i] = l * (l + 1) / (radius_m * radius_m);
            rows[i * count + i] = 1.0 / radius_m;
        }
    }
    modes.n_modes = r->n_modes;
    modes.eigenvalue_per_m2 = eigenvalues;
    modes.coefficient_per_m = rows;
    modes.area_m2 = 12.5 * radius_m * radius_m;
    modes.volume_m3 = 4.0 * radius_m * radius_m * radius_m;
    return &modes;
}

static shcd_model *make_model(const body_recipe *r, uint64_t random) {
    static const double unit = 2.0466534158929770; /* sqrt(4 pi / 3) */
    double coefficients[3 * SHCD_COUNT(DEGREE_MAX)] = {0.0};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    coefficients[3 * SHCD_INDEX(1, 1) + 0] = r->axes_m[0] * unit;
    coefficients[3 * SHCD_INDEX(1, -1) + 1] = r->axes_m[1] * unit;
    coefficients[3 * SHCD_INDEX(1, 0) + 2] = r->axes_m[2] * unit;
    for (int l = 2; l <= r->degree; l++) {
        const double size_m = r->detail_m / (double)(1000 * l * l * l);
        for (size_t i = 3 * SHCD_INDEX(l, -l); i < 3 * SHCD_INDEX(l, l) + 3; i++) {
            coefficients[i] = size_m * (double)next_integer(&random);
        }
    }
    def.degree = r->degree;
    def.coefficients = coefficients;
    def.modes = r->n_modes > 0 ? make_modes(r) : NULL;
    if (shcd_model_create(&def, NULL, &model, &error) != SHCD_OK) {
        fprintf(stderr, "session: %s: %s\n", r->name, error.message);
    }
    return model;
}

/* A capsule of 6 mm, 40 mm long, and points on a ball of 8 mm. */
static int make_geometries(session *s) {
    shcd_tool_geometry_def capsule = SHCD_TOOL_GEOMETRY_DEF_INIT;
    shcd_tool_geometry_def shell = SHCD_TOOL_GEOMETRY_DEF_INIT;
    shcd_vec3 points[SHELL_POINTS], normals[SHELL_POINTS];
    uint64_t random = 77;
    for (size_t i = 0; i < SHELL_POINTS;) {
        const shcd_vec3 p = {(double)next_integer(&random), (double)next_integer(&random),
                             (double)next_integer(&random)};
        if (shcd_dot(p, p) > 1e4 && shcd_dot(p, p) < 1e6) { /* evenly over all directions */
            normals[i] = shcd_scale(-1.0, shcd_unit(p));
            points[i] = shcd_scale(-0.008, normals[i]);
            i++;
        }
    }
    capsule.kind = SHCD_TOOL_CAPSULE;
    capsule.radius_m = 0.003;
    capsule.half_length_m = 0.017;
    shell.kind = SHCD_TOOL_SHELL;
    shell.points = points;
    shell.normals = normals;
    shell.n_points = SHELL_POINTS;
    return shcd_tool_geometry_create(&capsule, NULL, &s->capsule, NULL) != SHCD_OK ||
           shcd_tool_geometry_create(&shell, NULL, &s->shell, NULL) != SHCD_OK;
}

static int make_scene(session *s) {
    static const shcd_parameter_value stiff = {"k_n_per_m", 1200.0};
    static const shcd_parameter_value lossy = {"ratio", 0.5};
    static const shcd_parameter_value wave[2] = {{.name = "modes", .value = 49.0},
                                                 {.name = "thickness_m", .value = 0.01}};
    static const shcd_effect_def effects[SESSION_BODIES][8] = {
        {{"stiffness", NULL, 0}, {"damping", NULL, 0}, {"friction", NULL, 0}},
        {{"stiffness", NULL, 0}},
        {{"stiffness", &stiff, 1},
         {"damping", &lossy, 1},
         {"wave", wave, 2},
         {"pulse", NULL, 0},
         {"texture", NULL, 0},
         {"relaxation", NULL, 0},
         {"friction", NULL, 0},
         {"viscosity", NULL, 0}},
        {{"damping", NULL, 0}, {"stiffness", NULL, 0}}};
    static const size_t n_effects[SESSION_BODIES] = {3, 1, 8, 2};
    static const char *const tool_names[SESSION_TOOLS] = {"tip",    "bead",    "ball",
                                                          "needle", "capsule", "shell"};
    shcd_body_def bodies[SESSION_BODIES];
    shcd_tool_def tools[SESSION_TOOLS];
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    shcd_error error = {SHCD_OK, ""};
    for (size_t b = 0; b < SESSION_BODIES; b++) {
        const shcd_body_def empty = SHCD_BODY_DEF_INIT;
        bodies[b] = empty;
        bodies[b].name = recipes[b].name;
        bodies[b].model = s->models[b];
        bodies[b].body_in_world = recipes[b].in_world;
        bodies[b].effects = effects[b];
        bodies[b].n_effects = n_effects[b];
    }
    for (size_t t = 0; t < SESSION_TOOLS; t++) {
        const shcd_tool_def empty = SHCD_TOOL_DEF_INIT;
        tools[t] = empty;
        tools[t].name = tool_names[t];
        tools[t].kind = radii_m[t] > 0.0 ? SHCD_TOOL_SPHERE : SHCD_TOOL_POINT;
        tools[t].radius_m = radii_m[t];
    }
    tools[FIRST_TURNING].kind = SHCD_TOOL_CAPSULE;
    tools[FIRST_TURNING].geometry = s->capsule;
    tools[FIRST_TURNING + 1].kind = SHCD_TOOL_SHELL;
    tools[FIRST_TURNING + 1].geometry = s->shell;
    tools[FIRST_TURNING + 1].contact_share = 0.25;
    tools[FIRST_TURNING + 1].evaluations_max = 200; /* now and then too few */
    def.bodies = bodies;
    def.n_bodies = SESSION_BODIES;
    def.tools = tools;
    def.n_tools = SESSION_TOOLS;
    if (shcd_scene_create(&def, NULL, &s->scene, &error) != SHCD_OK) {
        fprintf(stderr, "session: %s\n", error.message);
        return 1;
    }
    return 0;
}

int session_open(session *s) {
    memset(s, 0, sizeof *s);
    for (size_t b = 0; b < SESSION_BODIES; b++) {
        s->models[b] = make_model(&recipes[b], 1 + b);
        if (s->models[b] == NULL) {
            return 1;
        }
    }
    return make_geometries(s) != 0 ? 1 : make_scene(s);
}

void session_close(session *s) {
    shcd_scene_free(s->scene);
    shcd_tool_geometry_free(s->capsule);
    shcd_tool_geometry_free(s->shell);
    for (size_t b = 0; b < SESSION_BODIES; b++) {
        shcd_model_free(s->models[b]);
    }
}

shcd_state *session_state(const session *s) {
    const size_t size = (shcd_state_size(s->scene) + 15) / 16 * 16;
    void *memory = aligned_alloc(16, size);
    shcd_state *state = NULL;
    if (memory == NULL || shcd_state_init(s->scene, memory, size, &state) != SHCD_OK) {
        free(memory);
        return NULL;
    }
    return state;
}

/* ---- paths ---------------------------------------------------------------------------------- */

/* One of 26 directions to the neighbours of a cube's middle. */
static shcd_vec3 direction(size_t n) {
    const size_t i = n % 26 < 13 ? n % 26 : n % 26 + 1; /* 13 is the middle itself */
    return shcd_unit(
        shcd_vec3_make((double)(i % 3) - 1.0, (double)(i / 3 % 3) - 1.0, (double)(i / 9) - 1.0));
}

/* Rises from 0 to 1 and falls back, with slope zero at the ends and the top. */
static double bump(double s) {
    return 16.0 * s * s * (1.0 - s) * (1.0 - s);
}

/* A full circle for s in [0, 1), quarter by quarter ((1 - t^2), 2 t)/(1 + t^2). */
static shcd_vec3 circle(double s, size_t plane) {
    const double u = 4.0 * s;
    const int quarter = (int)u;
    const double t = u - quarter;
    const double c = (1.0 - t * t) / (1.0 + t * t), d = 2.0 * t / (1.0 + t * t);
    const double x = quarter == 0 ? c : quarter == 1 ? -d : quarter == 2 ? -c : d;
    const double y = quarter == 0 ? d : quarter == 1 ? c : quarter == 2 ? -d : -c;
    return plane % 3 == 0   ? shcd_vec3_make(x, y, 0.25)
           : plane % 3 == 1 ? shcd_vec3_make(0.25, x, y)
                            : shcd_vec3_make(y, 0.25, x);
}

/* Position of a tool, relative to a body and in units of its reach. */
static shcd_vec3 wander(size_t manner, size_t block, double s, size_t tick) {
    const shcd_vec3 d = direction(7 * block + 3);
    switch (manner) {
    case 0: /* press: in by 4 tenths and out */
        return shcd_scale(1.4 - 0.8 * bump(s), d);
    case 1: /* slide round, now deeper, now out */
        return shcd_scale(0.9 - 0.2 * bump(s), circle(s, block));
    case 2: /* plunge through the middle and back the same way; every other time not quite */
        return shcd_mul_add(shcd_scale(1.5 - 3.0 * bump(s), d), block % 2 == 0 ? 0.0 : 0.04,
                            direction(block));
    case 3: /* strike: 8 ticks from outside into the body, each time elsewhere */
        return shcd_scale(1.8 - 0.2 * (double)(tick % 8), direction(tick / 8 * 5 + block));
    default: /* away, at last far away, and back */
        return shcd_scale(0.9 + 200.0 * bump(s) * bump(s), d);
    }
}

static shcd_vec3 position(size_t tool, size_t tick) {
    const size_t block = tick / BLOCK;
    const double s = (double)(tick % BLOCK) / (double)BLOCK;
    const body_recipe *r = &recipes[(block / N_MANNERS + tool) % SESSION_BODIES];
    return shcd_mul_add(r->in_world.position_m, r->reach_m,
                        wander((block + 2 * tool) % N_MANNERS, block + 11 * tool, s, tick));
}

/* A tool vanishes now and then, and comes back in the worst of places: at a sphere's centre, from
 * where no part of the surface can be ruled out. */
static size_t since_vanishing(size_t tool, size_t tick) {
    return (tick + 100 * tool) % 1200;
}

/* Two full turns about a fixed axis in 2000 ticks: (cos, sin) of half the angle by the rational
 * circle. */
static shcd_quat orientation(size_t tick) {
    const shcd_vec3 half = circle((double)(tick % 2000) / 2000.0, 0);
    const shcd_quat q = {half.x, half.y * (2.0 / 3.0), half.y * (1.0 / 3.0), half.y * (2.0 / 3.0)};
    return q;
}

static double step_of(size_t tick) {
    return tick % 97 == 96 ? 0.004 : 0.001;
}

static shcd_tool_input input_of(size_t tool, size_t tick) {
    shcd_tool_input in = {.tool_in_world = {{0.0, 0.0, 0.0}, {0.2, 0.4, 0.4, 0.8}},
                          .flags = SHCD_TOOL_INPUT_ACTIVE};
    in.tool_in_world.position_m = position(tool, tick);
    if (tool >= FIRST_TURNING) {
        in.tool_in_world.orientation = orientation(tick);
        in.angular_velocity_rad_per_s = shcd_vec3_make(2.0, 1.0, 2.0);
    }
    if (tick > 0) {
        in.velocity_m_per_s = shcd_scale(
            1.0 / step_of(tick), shcd_sub(in.tool_in_world.position_m, position(tool, tick - 1)));
    }
    if (since_vanishing(tool, tick) < 5) {
        in.flags = 0;
    } else if (since_vanishing(tool, tick) < 8) {
        in.tool_in_world.position_m = recipes[SESSION_BODIES - 1].in_world.position_m;
    } else if ((tick + 77 * tool) % 700 == 0) {
        in.tool_in_world.position_m.y = 2e9;
    } else if ((tick + 77 * tool) % 700 == 1) {
        in.tool_in_world.orientation.w = 0.3;
    }
    return in;
}

/* ---- running -------------------------------------------------------------------------------- */

uint64_t session_hash(uint64_t hash, const void *bytes, size_t n) {
    const unsigned char *b = bytes;
    for (size_t i = 0; i < n; i++) {
        hash = (hash ^ b[i]) * 0x100000001b3u;
    }
    return hash;
}

uint64_t session_hash_state(const session *s, const shcd_state *state) {
    return session_hash(SESSION_HASH_START, state, shcd_state_size(s->scene));
}

static void count(session_tally *tally, size_t tool, const shcd_tool_output *out) {
    if ((out->flags & SHCD_TOOL_OUTPUT_CONTACT) != 0) {
        tally->n_contact[tool][out->body]++;
        tally->deepest_m =
            out->penetration_m > tally->deepest_m ? out->penetration_m : tally->deepest_m;
    }
    tally->n_bad += (out->flags & SHCD_TOOL_OUTPUT_BAD_INPUT) != 0;
    tally->n_inactive += out->body < 0 && (out->flags & SHCD_TOOL_OUTPUT_BAD_INPUT) == 0;
    tally->n_truncated += (out->flags & SHCD_TOOL_OUTPUT_TRUNCATED) != 0;
    tally->n_unsure += (out->flags & SHCD_TOOL_OUTPUT_SIGN_UNSURE) != 0;
}

int session_run(const session *s, shcd_state *state, size_t first, size_t last, uint64_t *hash,
                uint64_t *marks, session_tally *tally) {
    for (size_t tick = first; tick < last; tick++) {
        shcd_tool_input in[SESSION_TOOLS];
        shcd_tool_output out[SESSION_TOOLS];
        const shcd_input input = {step_of(tick), in, SESSION_TOOLS};
        shcd_output output = {out, SESSION_TOOLS};
        memset(out, 0, sizeof out); /* padding, if there ever is any, must not count */
        for (size_t t = 0; t < SESSION_TOOLS; t++) {
            in[t] = input_of(t, tick);
        }
        if (shcd_step(s->scene, state, &input, &output) != SHCD_OK) {
            fprintf(stderr, "session: tick %zu was refused\n", tick);
            return 1;
        }
        *hash = session_hash(*hash, out, sizeof out);
        for (size_t t = 0; tally != NULL && t < SESSION_TOOLS; t++) {
            count(tally, t, &out[t]);
        }
        if (marks != NULL && (tick + 1) % SESSION_PART == 0) {
            marks[tick / SESSION_PART] = *hash;
        }
    }
    return 0;
}

int session_marks(const session *s, uint64_t marks[SESSION_MARKS], session_tally *tally) {
    uint64_t hash = SESSION_HASH_START;
    shcd_state *state = session_state(s);
    if (state == NULL || session_run(s, state, 0, SESSION_TICKS, &hash, marks, tally) != 0) {
        free(state);
        return 1;
    }
    marks[SESSION_MARKS - 1] = session_hash_state(s, state);
    free(state);
    return 0;
}

/* ---- the committed marks -------------------------------------------------------------------- */

int session_read(const char *path, uint64_t marks[SESSION_MARKS]) {
    char line[200];
    size_t n = 0;
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        fprintf(stderr, "session: cannot read %s\n", path);
        return 1;
    }
    while (fgets(line, sizeof line, file) != NULL) {
        if (line[0] != '#' && n < SESSION_MARKS && sscanf(line, "%*s %" SCNx64, &marks[n]) == 1) {
            n++;
        }
    }
    fclose(file);
    if (n != SESSION_MARKS) {
        fprintf(stderr, "session: %s holds %zu hashes, not %zu\n", path, n, SESSION_MARKS);
        return 1;
    }
    return 0;
}

int session_compare(const uint64_t found[SESSION_MARKS], const uint64_t expected[SESSION_MARKS]) {
    for (size_t i = 0; i < SESSION_MARKS; i++) {
        if (found[i] != expected[i]) {
            if (i < SESSION_MARKS - 1) {
                fprintf(stderr,
                        "session: outputs differ first in ticks %zu to %zu: ", i * SESSION_PART,
                        (i + 1) * SESSION_PART - 1);
            } else {
                fprintf(stderr, "session: outputs agree, but the final state differs: ");
            }
            fprintf(stderr, "%016" PRIx64 ", committed %016" PRIx64 "\n", found[i], expected[i]);
            return 1;
        }
    }
    return 0;
}
