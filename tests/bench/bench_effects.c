/* SPDX-License-Identifier: BSD-3-Clause */
/* What the effects of a scene cost in a tick: bench_effects BODY.shcd [TICKS].
 *
 * A ball of 3 mm presses, slides and leaves over a body at 1 kHz. Once with every effect that gets
 * along with the others, then with each of them left out: its price is what the tick is shorter
 * without it, of medians, since what an effect spares others (a soft body's certificates, say) does
 * not show on a clock around it. The runs are interleaved in blocks, so that a slow moment of the
 * machine is everybody's. */
#define _POSIX_C_SOURCE 200809L
#include "shcd/shcd.h"

#include "clock.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EFFECTS_MAX 32
#define BLOCK 500

typedef struct lane {
    const char *without; /* NULL: everything is there */
    shcd_scene *scene;
    shcd_state *state;
    void *memory;
    double *ns;
} lane;

static void fail(const char *text) {
    fprintf(stderr, "bench_effects: %s\n", text);
    exit(1);
}

static int by_size(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* All names but one. `learned` stands for the others on a body that has it. */
static size_t choose(const char *without, shcd_effect_def *defs) {
    size_t n = 0;
    for (size_t e = 0; shcd_effect_at(e) != NULL; e++) {
        const char *name = shcd_effect_at(e)->name;
        const int depends =
            without != NULL && strcmp(without, "wave") == 0 && strcmp(name, "pulse") == 0;
        if (strcmp(name, "learned") != 0 && !depends &&
            (without == NULL || strcmp(name, without) != 0)) {
            defs[n++] = (shcd_effect_def){name, NULL, 0};
        }
    }
    return n;
}

static void open_lane(const shcd_model *model, const char *without, int ticks, lane *l) {
    shcd_effect_def defs[EFFECTS_MAX];
    shcd_body_def body = SHCD_BODY_DEF_INIT;
    shcd_tool_def tool = SHCD_TOOL_DEF_INIT;
    shcd_scene_def def = SHCD_SCENE_DEF_INIT;
    shcd_error error = {SHCD_OK, ""};
    body.name = "body";
    body.model = model;
    body.effects = defs;
    body.n_effects = choose(without, defs);
    tool.name = "ball";
    tool.kind = SHCD_TOOL_SPHERE;
    tool.radius_m = 0.003;
    def.bodies = &body;
    def.n_bodies = 1;
    def.tools = &tool;
    def.n_tools = 1;
    if (shcd_scene_create(&def, NULL, &l->scene, &error) != SHCD_OK) {
        fail(error.message);
    }
    const size_t size = (shcd_state_size(l->scene) + 63) / 64 * 64;
    l->without = without;
    l->memory = aligned_alloc(64, size);
    l->ns = malloc((size_t)ticks * sizeof *l->ns);
    if (l->memory == NULL || l->ns == NULL ||
        shcd_state_init(l->scene, l->memory, size, &l->state) != SHCD_OK) {
        fail("out of memory");
    }
}

/* Over the highest point of the body: down to 3 mm, in circles of 5 mm, up again, every 2 s. */
static shcd_tool_input pose_at(shcd_vec3 top, int tick) {
    const double t = 0.001 * tick, turn = 6.28318530717958648;
    const double down = 0.0035 * (1.0 - cos(0.5 * turn * t)) - 0.0005;
    shcd_tool_input in = {.flags = SHCD_TOOL_INPUT_ACTIVE};
    in.tool_in_world.orientation.w = 1.0;
    in.tool_in_world.position_m =
        shcd_vec3_make(top.x + 0.005 * cos(0.7 * turn * t), top.y + 0.005 * sin(0.7 * turn * t),
                       top.z + 0.003 - down);
    in.velocity_m_per_s =
        shcd_vec3_make(-0.0035 * turn * sin(0.7 * turn * t), 0.0035 * turn * cos(0.7 * turn * t),
                       -0.00175 * turn * sin(0.5 * turn * t));
    return in;
}

static void run_block(lane *l, shcd_vec3 top, int first, int n) {
    for (int i = first; i < first + n; i++) {
        const shcd_tool_input in = pose_at(top, i);
        shcd_tool_output out;
        const shcd_input input = {.dt_s = 0.001, .tools = &in, .n_tools = 1};
        shcd_output output = {.tools = &out, .n_tools = 1};
        const uint64_t start = clock_stamp();
        if (shcd_step(l->scene, l->state, &input, &output) != SHCD_OK) {
            fail("a tick failed");
        }
        l->ns[i] = (double)(clock_stamp() - start) * clock_tick_ns();
    }
}

static shcd_vec3 highest(const shcd_model *model) {
    shcd_vec3 top = {0.0, 0.0, -1e300}, w, s;
    for (int i = 0; i < 4000; i++) { /* a spiral over the upper half and a little more */
        const double z = 1.0 - 1.5 * (i + 0.5) / 4000.0, r = sqrt(1.0 - z * z);
        w = shcd_vec3_make(r * cos(2.39996322972865332 * i), r * sin(2.39996322972865332 * i), z);
        if (shcd_model_surface(model, -1, w, &s, NULL, NULL) == SHCD_OK && s.z > top.z) {
            top = s;
        }
    }
    return top;
}

int main(int argc, char **argv) {
    const int ticks = argc > 2 ? atoi(argv[2]) / BLOCK * BLOCK : 20000;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    lane lanes[EFFECTS_MAX + 1];
    shcd_effect_def all[EFFECTS_MAX];
    size_t n_lanes = 0;
    if (argc < 2 || ticks < BLOCK) {
        fprintf(stderr, "usage: bench_effects BODY.shcd [TICKS]\n");
        return 2;
    }
    if (shcd_model_load(argv[1], NULL, &model, &error) != SHCD_OK) {
        fail(error.message);
    }
    clock_open();
    const size_t n_all = choose(NULL, all);
    open_lane(model, NULL, ticks, &lanes[n_lanes++]);
    for (size_t e = 0; e < n_all; e++) {
        open_lane(model, all[e].name, ticks, &lanes[n_lanes++]);
    }
    const shcd_vec3 top = highest(model);
    for (int first = 0; first < ticks; first += BLOCK) {
        for (size_t k = 0; k < n_lanes; k++) {
            run_block(&lanes[k], top, first, BLOCK);
        }
    }
    for (size_t k = 0; k < n_lanes; k++) {
        qsort(lanes[k].ns, (size_t)ticks, sizeof(double), by_size);
    }
    const double p50 = lanes[0].ns[ticks / 2];
    printf("%-12s %9s %9s %9s %9s %10s\n", "effects", "price us", "p50 us", "p99 us", "max us",
           "state KiB");
    for (size_t k = 0; k < n_lanes; k++) {
        const lane *l = &lanes[k];
        printf("%-12s ", k == 0 ? "all" : l->without);
        if (k == 0) {
            printf("%9s ", "");
        } else {
            printf("%9.2f ", 1e-3 * (p50 - l->ns[ticks / 2]));
        }
        printf("%9.2f %9.2f %9.2f %10.1f\n", 1e-3 * l->ns[ticks / 2],
               1e-3 * l->ns[(size_t)(0.99 * ticks)], 1e-3 * l->ns[ticks - 1],
               (double)shcd_state_size(l->scene) / 1024.0);
    }
    printf("%d ticks; a row but the first: all effects without that one\n", ticks);
    printf("bars: all, p50 <= 30 us %s, p99 <= 150 us %s\n", p50 <= 30e3 ? "met" : "MISSED",
           lanes[0].ns[(size_t)(0.99 * ticks)] <= 150e3 ? "met" : "MISSED");
    for (size_t k = 0; k < n_lanes; k++) {
        shcd_scene_free(lanes[k].scene);
        free(lanes[k].memory);
        free(lanes[k].ns);
    }
    shcd_model_free(model);
    return 0;
}
