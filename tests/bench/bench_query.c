/* SPDX-License-Identifier: BSD-3-Clause */
/* What a query costs: libshcd's tiers and its peers on the same surface, in one interleaved run.
 * The method of measurement is told in run.c, the choice of points in points.c, what counts as
 * agreement in compare.c. tools/bench.sh builds and runs this. */
#include "clock.h"
#include "counted.h"
#include "methods.h"
#include "points.h"
#include "report.h"
#include "run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define METHODS_MAX 32
#define UPDATES_MAX 16
#define MESH_LEVEL 6 /* 81 920 triangles */
/* Of the diagonal, bounds: how far the deformed surface is from rest, and from where its bounds are
 * inflated. methods_shape.c tells these to the reader. */
#define DENT 0.02
#define ALMOST (DENT - 0.001)

static const char usage[] =
    "usage: bench_query [OPTION...] BODY.shcd...\n"
    "  --points N       points of the random set and of the path (2000)\n"
    "  --cold N         of them asked with cold caches (300)\n"
    "  --checked N      of them compared with all triangles (100)\n"
    "  --repetitions N  times each point is asked; its median counts (7)\n"
    "  --updates N      repetitions of each change of shape (101)\n"
    "  --level N        triangles: 20 * 4^N (6: 81 920)\n"
    "  --seed N         of the points (1)\n"
    "  --only A,B,...   these methods and changes of shape only\n"
    "  --simd PATH      how surfaces are evaluated: auto, portable, avx2 or avx512 (auto)\n"
    "  --json FILE      the report for programs\n"
    "  --count N        no clock: each method answers N queries, for callgrind to count\n";

typedef struct arguments {
    run_options run;
    int level;
    int simd;
    size_t n_counted;
    const char *json;
    const char *only;
    char **paths;
    int n_paths;
} arguments;

static void bad_usage(const char *message, const char *argument) {
    fprintf(stderr, "bench_query: %s: %s\n%s", message, argument, usage);
    exit(2);
}

static size_t whole(const char *option, const char *text) {
    char *end = NULL;
    const unsigned long value = text != NULL ? strtoul(text, &end, 10) : 0;
    if (text == NULL || *text == '\0' || *end != '\0' || value < 1 || value > 10000000) {
        bad_usage("not a number from 1 to 10000000 for", option);
    }
    return (size_t)value;
}

static int simd_of(const char *name) {
    for (int simd = SHCD_SIMD_AUTO; simd <= SHCD_SIMD_AVX512; simd++) {
        if (strcmp(name, report_simd_name(simd)) == 0) {
            return simd;
        }
    }
    bad_usage("unknown path", name);
    return SHCD_SIMD_AUTO;
}

static arguments parse(int argc, char **argv) {
    arguments a = {{2000, 300, 100, 7, 101, 1}, MESH_LEVEL, SHCD_SIMD_AUTO, 0, NULL, NULL, NULL, 0};
    const struct {
        const char *name;
        size_t *value;
    } numbers[] = {{"--points", &a.run.n_points},   {"--cold", &a.run.n_cold},
                   {"--checked", &a.run.n_checked}, {"--repetitions", &a.run.n_repetitions},
                   {"--updates", &a.run.n_updates}, {"--count", &a.n_counted}};
    int i = 1;
    for (; i < argc && argv[i][0] == '-'; i += 2) {
        size_t k = 0;
        while (k < sizeof numbers / sizeof numbers[0] && strcmp(argv[i], numbers[k].name) != 0) {
            k++;
        }
        if (i + 1 >= argc) {
            bad_usage("no value for, or unknown", argv[i]);
        } else if (k < sizeof numbers / sizeof numbers[0]) {
            *numbers[k].value = whole(argv[i], argv[i + 1]);
        } else if (strcmp(argv[i], "--seed") == 0) {
            a.run.seed = whole(argv[i], argv[i + 1]);
        } else if (strcmp(argv[i], "--level") == 0) {
            a.level = (int)fmin(8.0, (double)whole(argv[i], argv[i + 1]));
        } else if (strcmp(argv[i], "--simd") == 0) {
            a.simd = simd_of(argv[i + 1]);
        } else if (strcmp(argv[i], "--json") == 0) {
            a.json = argv[i + 1];
        } else if (strcmp(argv[i], "--only") == 0) {
            a.only = argv[i + 1];
        } else {
            bad_usage("unknown option", argv[i]);
        }
    }
    a.paths = argv + i;
    a.n_paths = argc - i;
    if (a.n_paths < 1) {
        bad_usage("missing", "BODY.shcd");
    }
    if (a.n_counted > 0 && !counted_is_possible()) {
        fputs("bench_query: --count: built without valgrind/callgrind.h\n", stderr);
        exit(1);
    }
    a.run.n_cold = a.run.n_cold < a.run.n_points ? a.run.n_cold : a.run.n_points;
    a.run.n_checked = a.run.n_checked < a.run.n_points ? a.run.n_checked : a.run.n_points;
    return a;
}

static void stop_if(int bad, const char *what, const char *why) {
    if (bad) {
        fprintf(stderr, "bench_query: %s: %s\n", what, why);
        exit(1);
    }
}

void bench_add_method(bench_list *list, const bench_method *method) {
    stop_if(list->n_methods == list->methods_max, method->name, "too many methods");
    list->methods[list->n_methods++] = *method;
}

void bench_add_update(bench_list *list, const bench_update *update) {
    stop_if(list->n_updates == list->updates_max, update->name, "too many updates");
    list->updates[list->n_updates++] = *update;
}

static int is_wanted(const char *name, const char *only) {
    const size_t length = strlen(name);
    for (const char *c = only; c != NULL; c = strchr(c, ',')) {
        c += *c == ',';
        if (strncmp(c, name, length) == 0 && (c[length] == ',' || c[length] == '\0')) {
            return 1;
        }
    }
    return only == NULL;
}

/* Drops what --only does not name; the harness stays. */
static void select_methods(bench_list *list, const char *only) {
    size_t kept = 1;
    for (size_t m = 1; m < list->n_methods; m++) {
        const bench_method method = list->methods[m];
        if (is_wanted(method.name, only)) {
            list->methods[kept++] = method;
        } else if (method.release != NULL) {
            method.release(method.self);
        }
    }
    list->n_methods = kept;
    kept = 0;
    for (size_t u = 0; u < list->n_updates; u++) {
        const bench_update update = list->updates[u];
        if (is_wanted(update.name, only)) {
            list->updates[kept++] = update;
        } else if (update.release != NULL) {
            update.release(update.self);
        }
    }
    list->n_updates = kept;
}

/* Coefficients of degree 1 to 4 changed at random, scaled to the wanted bound: with
 * |Y_l| <= sqrt((2l+1)/(4 pi)) for the vector of a degree, |D(w)| <= sum_l |D_l| sqrt((2l+1)/4 pi),
 * |D_l| the Frobenius norm. */
static double *deformed(const shcd_model *model, double most_m) {
    const int degree = shcd_model_degree(model);
    const size_t n = 3 * SHCD_COUNT(degree);
    double *c = points_memory(n * sizeof *c), bound = 0.0;
    uint64_t seed = 77;
    memset(c, 0, n * sizeof *c);
    for (int l = 1; l <= 4 && l <= degree; l++) {
        double norm2 = 0.0;
        for (size_t i = 3 * SHCD_INDEX(l, -l); i < 3 * SHCD_INDEX(l, l) + 3; i++) {
            c[i] = points_uniform(&seed, -1.0, 1.0) / (l * l);
            norm2 += c[i] * c[i];
        }
        bound += sqrt(norm2 * (2.0 * l + 1.0) / (4.0 * 3.14159265358979324));
    }
    for (size_t i = 0; i < n; i++) {
        c[i] = shcd_model_coefficients(model)[i] + c[i] * most_m / bound;
    }
    return c;
}

typedef struct session {
    shcd_model *model, *moved;
    shcd_map *map;
    double *moved_coefficients, *almost_coefficients;
    methods_body body;
    report_body report;
} session;

/* The file's body, evaluated in the way that was asked for. */
static shcd_model *load(const char *path, int simd) {
    shcd_model *file = NULL, *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    stop_if(shcd_model_load(path, NULL, &file, &error) != SHCD_OK, path, error.message);
    if (simd == SHCD_SIMD_AUTO) {
        return file;
    }
    def.degree = shcd_model_degree(file);
    def.coefficients = shcd_model_coefficients(file);
    def.simd = simd;
    stop_if(shcd_model_create(&def, NULL, &model, &error) != SHCD_OK, path, error.message);
    shcd_model_free(file);
    return model;
}

/* What is only needed to time and to compare is left out when instructions are counted. */
static session open_session(const arguments *a, const char *path) {
    const int is_counting = a->n_counted > 0;
    session s;
    shcd_error error = {SHCD_OK, ""};
    shcd_map_options options = SHCD_MAP_OPTIONS_INIT;
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    memset(&s, 0, sizeof s);
    s.model = load(path, a->simd);
    s.report.path = path;
    s.report.info = (shcd_model_info)SHCD_MODEL_INFO_INIT;
    s.report.map = (shcd_map_info)SHCD_MAP_INFO_INIT;
    stop_if(shcd_model_describe(s.model, &s.report.info) != SHCD_OK, path, "cannot describe");
    s.moved_coefficients = deformed(s.model, DENT * s.report.info.diagonal_m);
    s.almost_coefficients = deformed(s.model, ALMOST * s.report.info.diagonal_m);
    def.degree = shcd_model_degree(s.model);
    def.coefficients = s.moved_coefficients;
    def.simd = a->simd;
    if (!is_counting) {
        stop_if(shcd_model_create(&def, NULL, &s.moved, &error) != SHCD_OK, path, error.message);
    }
    options.without_bounds = is_counting;
    stop_if(shcd_map_create(s.model, &options, NULL, &s.map, &error) != SHCD_OK, path,
            error.message);
    stop_if(shcd_map_describe(s.map, &s.report.map) != SHCD_OK, path, "cannot describe the map");
    s.body.model = s.model;
    s.body.moved = s.moved;
    s.body.map = s.map;
    s.body.moved_coefficients = s.moved_coefficients;
    s.body.almost_coefficients = s.almost_coefficients;
    s.body.diagonal_m = s.report.info.diagonal_m;
    return s;
}

static void close_session(session *s) {
    shcd_map_free(s->map);
    shcd_model_free(s->moved);
    shcd_model_free(s->model);
    free(s->moved_coefficients);
    free(s->almost_coefficients);
}

static void release_list(bench_list *list) {
    for (size_t m = 0; m < list->n_methods; m++) {
        if (list->methods[m].release != NULL) {
            list->methods[m].release(list->methods[m].self);
        }
    }
    for (size_t u = 0; u < list->n_updates; u++) {
        if (list->updates[u].release != NULL) {
            list->updates[u].release(list->updates[u].self);
        }
    }
}

/* Returns the number of wrong claims. */
static size_t measure(const arguments *a, const char *path, FILE *json) {
    size_t n_wrong = 0;
    bench_method methods[METHODS_MAX];
    bench_update updates[UPDATES_MAX];
    bench_list list = {methods, 0, METHODS_MAX, updates, 0, UPDATES_MAX};
    bench_mesh mesh;
    run_points points;
    run_outcome outcome;
    session s = open_session(a, path);
    points_mesh(s.model, s.moved != NULL ? s.moved : s.model, a->level, &mesh);
    methods_add_nothing(&list);
    methods_add_tiers(&list, &s.body);
    run_make_points(&s.body, &a->run, &points);
    methods_add_shapes(&list, &s.body);
    methods_add_updates(&list, &s.body, points.path, a->run.n_points);
#ifdef SHCD_BENCH_PEERS
    stop_if(bench_add_peers(&list, &mesh) != 0, path, "a peer failed");
#endif
    select_methods(&list, a->only);
    if (a->n_counted > 0) {
        counted_all(&list, &points,
                    a->n_counted < a->run.n_points ? a->n_counted : a->run.n_points);
    } else {
        run_all(&list, &s.body, &mesh, &points, &a->run, &outcome);
        s.report.list = &list;
        s.report.mesh = &mesh;
        s.report.outcome = &outcome;
        s.report.options = &a->run;
        report_tables(stdout, &s.report);
        report_bars(stdout, &s.report);
        if (json != NULL) {
            report_json(json, &s.report);
        }
        for (size_t i = 0; i < list.n_methods * BENCH_N_WORKLOADS; i++) {
            n_wrong += outcome.results[i].n_wrong;
        }
        run_free(&outcome);
    }
    run_free_points(&points);
    release_list(&list);
    points_mesh_free(&mesh);
    close_session(&s);
    return n_wrong;
}

int main(int argc, char **argv) {
    const arguments a = parse(argc, argv);
    FILE *json = NULL;
    size_t n_wrong = 0;
    if (a.json != NULL) {
        json = fopen(a.json, "w");
        stop_if(json == NULL, a.json, "cannot be written");
        fputs("{\"bodies\": [\n", json);
    }
    clock_open();
    for (int i = 0; i < a.n_paths; i++) {
        if (i > 0) {
            fputs("\n", stdout);
            if (json != NULL) {
                fputs(",\n", json);
            }
        }
        n_wrong += measure(&a, a.paths[i], json);
        fflush(stdout);
    }
    if (json != NULL) {
        fputs("\n]}\n", json);
        const int failed = ferror(json);
        stop_if(fclose(json) != 0 || failed, a.json, "cannot be written");
    }
    stop_if(n_wrong > 0, "agreement", "some answers are wrong; the report names them");
    return 0;
}
