/* SPDX-License-Identifier: BSD-3-Clause */
/* What share of a tool's path each stage of shcd_detect() decides, and what that saves.
 *
 *   bench_stages [--quick] BODY.shcd...
 *
 * The path: a ball of 1 % of the diagonal comes from half a diagonal away, touches, slides along
 * the surface while pressed in by half of its radius, lifts off and goes away, six times at
 * different places; steps are about 0.1 % of the diagonal. Each way of asking takes its turn on
 * every point, and of five times per point the least counts: what is compared is the work, not the
 * interruptions.
 *
 * The second table is what a stage of a higher degree would have to earn: the series cut off at
 * that degree as a body of its own, searched by the fast tier, its distance less the certified
 * offset. */
#include "clock.h"
#include "points.h"
#include "shcd/accuracy.h"
#include "shcd/vec.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PLACES 6
#define BIT(stage) (1u << (stage))

/* Smaller with --quick: everything is done, nothing is timed in earnest. */
static int n_steps = 500; /* of each part of the way to a place: there, along, away */
static int n_repetitions = 5;
static size_t n_points; /* PLACES * 3 * n_steps */

typedef struct way_of_asking {
    const char *name;
    uint32_t skipped;
    int has_seed, has_certificate;
    double *ns;
    shcd_detection *found;
    shcd_vec3 seed;
    shcd_certificate certificate;
} way_of_asking;

static void demand(shcd_status status, const char *what) {
    if (status != SHCD_OK) {
        fprintf(stderr, "bench_stages: %s: %s\n", what, shcd_status_string(status));
        exit(1);
    }
}

/* ---- the path ---- */

static void make_path(const shcd_model *model, double diagonal_m, shcd_vec3 *point) {
    uint64_t state = 20;
    size_t n = 0;
    for (int place = 0; place < PLACES; place++) {
        shcd_vec3 w = {points_uniform(&state, -1.0, 1.0), points_uniform(&state, -1.0, 1.0),
                       points_uniform(&state, -1.0, 1.0)};
        const shcd_vec3 along = {points_uniform(&state, -1.0, 1.0),
                                 points_uniform(&state, -1.0, 1.0),
                                 points_uniform(&state, -1.0, 1.0)};
        for (int i = 0; i < 3 * n_steps; i++, n++) {
            const double share = (double)(i % n_steps) / n_steps;
            const double far = i < n_steps ? 1.0 - share : i < 2 * n_steps ? 0.0 : share;
            shcd_vec3 x, normal;
            if (i >= n_steps && i < 2 * n_steps) {
                w = shcd_unit(shcd_mul_add(w, 1.5 / n_steps, along));
            }
            demand(shcd_model_surface(model, -1, w, &x, &normal, NULL), "surface");
            point[n] = shcd_mul_add(x, diagonal_m * (0.0051 + 0.5 * far), normal);
        }
    }
}

/* ---- the stages ---- */

static void ask(const shcd_model *model, shcd_vec3 p, double reach_m, way_of_asking *way,
                size_t i) {
    shcd_detect_options options = SHCD_DETECT_OPTIONS_INIT;
    options.skipped = way->skipped;
    options.seed = way->seed;
    options.certificate = way->has_certificate ? &way->certificate : NULL;
    const uint64_t start = clock_stamp();
    const shcd_status status = shcd_detect(model, NULL, p, reach_m, &options, &way->found[i]);
    const double ns = (double)(clock_stamp() - start) * clock_tick_ns();
    demand(status, "detect");
    way->ns[i] = ns < way->ns[i] ? ns : way->ns[i];
    if (way->has_seed) {
        way->seed = way->found[i].parameter;
    }
}

static double mean_ns(const way_of_asking *way) {
    double sum = 0.0;
    for (size_t i = 0; i < n_points; i++) {
        sum += way->ns[i] / (double)n_points;
    }
    return sum;
}

static void print_way(const way_of_asking *way, double reference_ns) {
    double ns[SHCD_N_STAGES] = {0.0};
    size_t n[SHCD_N_STAGES] = {0};
    for (size_t i = 0; i < n_points; i++) {
        n[way->found[i].stage]++;
        ns[way->found[i].stage] += way->ns[i];
    }
    printf("%-34s", way->name);
    for (int k = 0; k < SHCD_N_STAGES; k++) {
        if (n[k] > 0) {
            printf(" %5.1f %% %6.0f", 100.0 * (double)n[k] / (double)n_points,
                   ns[k] / (double)n[k]);
        } else {
            printf("     -      -  ");
        }
    }
    printf(" %8.0f %7.1f %%\n", mean_ns(way), 100.0 * (1.0 - mean_ns(way) / reference_ns));
}

/* All ways must say the same. */
static void compare(const way_of_asking *ways, size_t n_ways) {
    for (size_t k = 1; k < n_ways; k++) {
        for (size_t i = 0; i < n_points; i++) {
            if (ways[k].found[i].is_within != ways[0].found[i].is_within) {
                fprintf(stderr, "bench_stages: point %zu: '%s' contradicts the search\n", i,
                        ways[k].name);
                exit(1);
            }
        }
    }
}

/* ---- a stage of a higher degree ---- */

static void try_degree(const shcd_model *model, int degree, const shcd_vec3 *point, double reach_m,
                       const way_of_asking *left, const way_of_asking *full) {
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *low = NULL;
    double offset_m;
    def.degree = degree;
    def.coefficients = shcd_model_coefficients(model);
    if (shcd_model_create(&def, NULL, &low, NULL) != SHCD_OK) {
        printf("%6d   is no body when cut off there\n", degree);
        return;
    }
    demand(shcd_model_enclosure_offset(model, degree, &offset_m), "offset");
    const shcd_query_options options = {sizeof options, SHCD_TIER_FAST, 0, 0.0, 0, 0};
    size_t n = 0, n_decided = 0;
    double spent_ns = 0.0, saved_ns = 0.0;
    for (size_t i = 0; i < n_points; i++) {
        double least_ns = HUGE_VAL;
        shcd_proximity near;
        if (left->found[i].stage != SHCD_STAGE_SEARCH) {
            continue;
        }
        for (int k = 0; k < n_repetitions; k++) {
            const uint64_t start = clock_stamp();
            demand(shcd_closest(low, point[i], &options, &near), "closest");
            least_ns = fmin(least_ns, (double)(clock_stamp() - start) * clock_tick_ns());
        }
        const int is_decided =
            near.lower_m - offset_m > reach_m || near.upper_m + offset_m <= reach_m;
        n++;
        n_decided += (size_t)is_decided;
        spent_ns += least_ns;
        saved_ns += is_decided ? full->ns[i] : 0.0;
    }
    const double each = n > 0 ? 1.0 / (double)n : 0.0;
    printf("%6d %9.2f %% %9.1f %% %9.0f %9.0f %9.0f\n", degree,
           100.0 * offset_m / (reach_m * 100.0), 100.0 * (double)n_decided * each, spent_ns * each,
           saved_ns * each, (saved_ns - spent_ns) * each);
    shcd_model_free(low);
}

/* ---- a body ---- */

static void run(const char *path) {
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    if (shcd_model_load(path, NULL, &model, &error) != SHCD_OK) {
        fprintf(stderr, "bench_stages: %s: %s\n", path, error.message);
        exit(1);
    }
    demand(shcd_model_describe(model, &info), "describe");
    const double reach_m = 0.01 * info.diagonal_m;
    const uint32_t ball = BIT(SHCD_STAGE_BALL), low = BIT(SHCD_STAGE_LOW_DEGREE);
    const uint32_t seed = BIT(SHCD_STAGE_SEED);
    way_of_asking ways[] = {
        {.name = "search", .skipped = ball | low | seed},
        {.name = "ball, search", .skipped = low | seed},
        {.name = "ball, degree 1, search", .skipped = seed},
        {.name = "ball, degree 1, seed, search", .has_seed = 1},
        {.name = "search with certificates", .skipped = ball | low | seed, .has_certificate = 1},
        {.name = "all stages, and certificates", .has_seed = 1, .has_certificate = 1}};
    const size_t n_ways = sizeof ways / sizeof ways[0];
    shcd_vec3 *point = points_memory(n_points * sizeof *point);
    make_path(model, info.diagonal_m, point);
    for (size_t k = 0; k < n_ways; k++) {
        ways[k].ns = points_memory(n_points * sizeof(double));
        ways[k].found = points_memory(n_points * sizeof(shcd_detection));
        for (size_t i = 0; i < n_points; i++) {
            ways[k].ns[i] = HUGE_VAL;
        }
    }
    for (int repetition = 0; repetition < n_repetitions; repetition++) {
        for (size_t i = 0; i < n_points; i++) {
            for (size_t k = 0; k < n_ways; k++) {
                ask(model, point[i], reach_m, &ways[k], i);
            }
        }
    }
    compare(ways, n_ways);
    printf("\n%s: degree %d, diagonal %.4g m, %zu points of a tool's path, reach 1 %% of it\n",
           path, shcd_model_degree(model), info.diagonal_m, n_points);
    printf("%-34s %14s %14s %15s %14s %9s %9s\n", "share and mean ns where it ended", "ball",
           "degree 1", "seed", "search", "mean ns", "saved");
    for (size_t k = 0; k < n_ways; k++) {
        print_way(&ways[k], mean_ns(&ways[0]));
    }
    printf("A stage of a higher degree, for the points that ball and degree 1 leave over:\n");
    printf("%6s %11s %11s %9s %9s %9s\n", "degree", "offset", "decided", "costs ns", "saves ns",
           "net ns");
    static const int degrees[] = {2, 3, 5, 8};
    for (size_t k = 0; k < sizeof degrees / sizeof degrees[0]; k++) {
        if (degrees[k] < shcd_model_degree(model)) {
            try_degree(model, degrees[k], point, reach_m, &ways[2], &ways[0]);
        }
    }
    for (size_t k = 0; k < n_ways; k++) {
        free(ways[k].ns);
        free(ways[k].found);
    }
    free(point);
    shcd_model_free(model);
}

int main(int argc, char **argv) {
    const int is_quick = argc > 1 && strcmp(argv[1], "--quick") == 0;
    const int first = is_quick ? 2 : 1;
    const int is_help = argc > 1 && strcmp(argv[1], "--help") == 0;
    if (is_help || argc <= first || argv[first][0] == '-') {
        fprintf(is_help ? stdout : stderr, "usage: bench_stages [--quick] BODY.shcd...\n");
        return is_help ? 0 : 2;
    }
    n_steps = is_quick ? 50 : n_steps;
    n_repetitions = is_quick ? 1 : n_repetitions;
    n_points = (size_t)PLACES * 3 * (size_t)n_steps;
    clock_open();
    for (int i = first; i < argc; i++) {
        run(argv[i]);
    }
    return 0;
}
