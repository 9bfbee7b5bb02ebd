/* SPDX-License-Identifier: BSD-3-Clause */
/* Mesh -> unit sphere without folds, in three stages.
 *
 * Start: some map onto the sphere, folds allowed (start.c). Untangle: descent on the energy of
 * energy.c with eps > 0, following the worst triangle: eps shrinks with the most negative
 * q = det/(2A), so that the barrier is always felt where the map is folded, and never grows again.
 * Polish: descent with eps = 0, which cannot fold an unfolded map; first with equal weight on
 * angles and areas, then with the area weight that was asked for, since from far away the strong
 * area term alone runs into long narrow valleys. If a start cannot be untangled the next one is
 * tried.
 *
 * The result decides how well a series of given degree can follow the mesh: a conformal map starves
 * limbs of parameter area, and their detail is lost; hence the area weight of 5 by default. */
#include "parameterize.h"

#include "fail.h"
#include "optimise.h"
#include "settings.h"
#include "start.h"

#include <stdlib.h>

#define N_UNTANGLE_ROUNDS 80
#define N_UNTANGLE_ITERATIONS 30
#define N_POLISH_ITERATIONS 600
#define ENERGY_TOLERANCE 1e-4
#define REFACTOR_EVERY 10

/* eps^2 = EPS_FLOOR + (EPS_SHARE min q)^2: a folded triangle of the worst kind feels a barrier that
 * is a fifth of its own size wide */
#define EPS_SHARE 0.2
#define EPS_FLOOR 1e-12
#define EPS_MIN 1e-8

typedef struct problem {
    shcdi_energy energy;
    shcdi_laplacian *laplacian;
    shcdi_optimiser *optimiser;
    shcd_vec3 *positions;
    double *weights;
    const shcdi_progress *progress;
} problem;

static void release(problem *p) {
    shcdi_optimiser_free(p->optimiser);
    shcdi_laplacian_free(p->laplacian);
    shcdi_energy_release(&p->energy);
    free(p->positions);
    free(p->weights);
}

/* Centred on the bounding box and scaled by a power of two to a size in [0.5, 1): exact, so that
 * the same body in another unit (a power of two apart) gives the same map, and no product under- or
 * overflows. */
static void prescale(const double *vertices_m, size_t n, shcd_vec3 *x) {
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (size_t i = 0; i < 3 * n; ++i) {
        low[i % 3] = fmin(low[i % 3], vertices_m[i]);
        high[i % 3] = fmax(high[i % 3], vertices_m[i]);
    }
    double half_extent = 0.0;
    for (int k = 0; k < 3; ++k) {
        half_extent = fmax(half_extent, 0.5 * high[k] - 0.5 * low[k]);
    }
    int exponent;
    (void)frexp(half_extent, &exponent);
    const double *v = vertices_m;
    for (size_t i = 0; i < n; ++i, v += 3) {
        x[i] = shcd_vec3_make(ldexp(v[0] - (0.5 * low[0] + 0.5 * high[0]), -exponent),
                              ldexp(v[1] - (0.5 * low[1] + 0.5 * high[1]), -exponent),
                              ldexp(v[2] - (0.5 * low[2] + 0.5 * high[2]), -exponent));
    }
}

static shcd_status prepare(problem *p, const shcd_mesh *mesh) {
    const size_t n = shcd_mesh_vertex_count(mesh), m = shcd_mesh_triangle_count(mesh);
    const uint32_t *triangles = shcd_mesh_triangles(mesh);
    p->positions = malloc(n * sizeof *p->positions);
    p->weights = malloc(3 * m * sizeof *p->weights);
    if (p->positions == NULL || p->weights == NULL) {
        return SHCD_ERR_MEMORY;
    }
    prescale(shcd_mesh_vertices(mesh), n, p->positions);
    shcd_status status = shcdi_energy_init(&p->energy, p->positions, n, triangles, m);
    if (status == SHCD_OK) {
        status = shcdi_laplacian_create(n, triangles, m, &p->laplacian);
    }
    if (status == SHCD_OK) {
        status = shcdi_optimiser_create(&p->energy, p->laplacian, &p->optimiser);
    }
    return status;
}

static double next_eps(double eps, double min_ratio, int round) {
    const double worst = EPS_SHARE * fmin(min_ratio, 0.0);
    const double wanted = sqrt(EPS_FLOOR + worst * worst);
    const double kept = round % 2 == 1 ? 0.5 * eps : eps;
    return fmax(EPS_MIN, fmin(kept, wanted));
}

/* Opens folds; *n_flipped tells how far it came. */
static shcd_status untangle(problem *p, shcd_vec3 *u, shcd_fit_report *report) {
    double eps = HUGE_VAL;
    double min_ratio;
    report->n_flipped = shcdi_energy_count_folds(&p->energy, u, &min_ratio);
    const uint64_t n_at_start = report->n_flipped > 0 ? report->n_flipped : 1;
    p->energy.area_weight = 1.0;
    shcdi_energy_cotangent_weights(&p->energy, p->weights);
    shcd_status status = shcdi_laplacian_factorise(p->laplacian, p->weights, p->energy.vertex_area);
    for (int round = 0; status == SHCD_OK && report->n_flipped > 0 && round < N_UNTANGLE_ROUNDS;
         ++round) {
        status = shcdi_progress_report(p->progress, "untangle",
                                       1.0 - (double)report->n_flipped / (double)n_at_start);
        if (status != SHCD_OK) {
            break;
        }
        eps = next_eps(eps, min_ratio, round);
        const shcdi_progress silent = {NULL, NULL};
        const shcdi_descent descent = {.eps = eps,
                                       .iterations_max = N_UNTANGLE_ITERATIONS,
                                       .window = 10,
                                       .tolerance = ENERGY_TOLERANCE,
                                       .first_step_rad = 0.1,
                                       .stop_unfolded = 1,
                                       .stage = "untangle",
                                       .progress = &silent};
        status = shcdi_optimiser_descend(p->optimiser, &descent, u, &report->n_untangle_iterations);
        report->n_flipped = shcdi_energy_count_folds(&p->energy, u, &min_ratio);
    }
    return status;
}

static shcd_status polish(problem *p, double area_weight, const char *stage, shcd_vec3 *u,
                          shcd_fit_report *report) {
    const shcdi_descent descent = {.eps = 0.0,
                                   .iterations_max = N_POLISH_ITERATIONS,
                                   .window = 20,
                                   .tolerance = ENERGY_TOLERANCE,
                                   .first_step_rad = 0.5,
                                   .refactor_every = REFACTOR_EVERY,
                                   .stage = stage,
                                   .progress = p->progress};
    p->energy.area_weight = area_weight;
    return shcdi_optimiser_descend(p->optimiser, &descent, u, &report->n_polish_iterations);
}

/* How one start ended, to tell the user if none did well. */
typedef struct outcome {
    uint64_t n_flipped; /* least over the starts so far */
    int is_multiple;    /* some start covers the sphere not just once, folded or not */
} outcome;

/* Folds come in pairs that cancel in the sum of solid angles, so that this tells how often the map
 * covers the sphere on balance, folded or not; descent moves vertices and does not change it, short
 * of turning whole regions over. */
static int covers_once(const problem *p, const shcd_vec3 *u) {
    return fabs(shcdi_energy_coverage(&p->energy, u) - 1.0) < 0.5; /* an integer, up to rounding */
}

/* Unfolded and covered once, hence one to one; else the next start is to be tried. */
static shcd_status judge(problem *p, const shcd_vec3 *u, shcd_fit_report *report, outcome *best) {
    report->n_flipped = shcdi_energy_count_folds(&p->energy, u, &report->min_det_ratio);
    best->n_flipped = report->n_flipped < best->n_flipped ? report->n_flipped : best->n_flipped;
    if (report->n_flipped > 0) {
        return SHCD_ERR_CONVERGENCE;
    }
    if (!covers_once(p, u)) {
        best->is_multiple = 1;
        return SHCD_ERR_CONVERGENCE;
    }
    return SHCD_OK;
}

static shcd_status run_start(problem *p, shcdi_start start, double area_weight, shcd_vec3 *u,
                             shcd_fit_report *report, outcome *best) {
    shcd_status status = shcdi_start_make(start, &p->energy, p->laplacian, p->positions, u);
    if (status != SHCD_OK) {
        return status;
    }
    report->start = (int32_t)start;
    report->n_flipped_start = shcdi_energy_count_folds(&p->energy, u, &report->min_det_ratio);
    if (!covers_once(p, u)) {
        best->is_multiple = 1;
        return SHCD_ERR_CONVERGENCE;
    }
    status = untangle(p, u, report);
    status = status == SHCD_OK ? judge(p, u, report, best) : status;
    if (status == SHCD_OK) {
        status = polish(p, fmin(1.0, area_weight), "polish shapes", u, report);
    }
    if (status == SHCD_OK && area_weight > 1.0) {
        status = polish(p, area_weight, "polish areas", u, report);
    }
    return status == SHCD_OK ? judge(p, u, report, best) : status;
}

static shcd_status explain(shcd_status status, const outcome *best, const shcd_mesh *mesh,
                           shcd_error *error) {
    const size_t n_triangles = shcd_mesh_triangle_count(mesh);
    switch (status) {
    case SHCD_ERR_CANCELLED:
        return shcdi_fit_fail(error, status, "parameterize: stopped by the caller");
    case SHCD_ERR_ARGUMENT:
        return shcdi_fit_fail(error, status, "parameterize: %zu triangles, more than %d",
                              n_triangles, INT32_MAX / 8);
    case SHCD_ERR_MEMORY:
        return shcdi_fit_fail(error, status, "parameterize: out of memory");
    default:
        break;
    }
    if (best->is_multiple && (best->n_flipped == 0 || best->n_flipped == n_triangles)) {
        return shcdi_fit_fail(error, status,
                              "parameterize: none of %d starts covers the sphere just once: "
                              "shorten or thicken the longest limbs, or remesh them more finely",
                              (int)SHCDI_START_COUNT);
    }
    return shcdi_fit_fail(error, status,
                          "parameterize: %llu of %zu spherical triangles stay folded after %d "
                          "starts: smooth the thinnest limbs, or remesh them more evenly",
                          (unsigned long long)best->n_flipped, n_triangles, (int)SHCDI_START_COUNT);
}

shcd_status shcdi_parameterize(const shcd_mesh *mesh, double area_weight,
                               const shcdi_progress *progress, shcd_vec3 *u,
                               shcd_fit_report *report, shcd_error *error) {
    const double start_s = shcdi_seconds();
    outcome best = {shcd_mesh_triangle_count(mesh), 0};
    problem p = {.progress = progress};
    shcd_status status = prepare(&p, mesh);
    for (int k = 0; k < SHCDI_START_COUNT; ++k) {
        if (status == SHCD_OK) {
            status = run_start(&p, (shcdi_start)k, area_weight, u, report, &best);
        }
        if (status != SHCD_ERR_CONVERGENCE) {
            break; /* done, or no other start would help */
        }
        status = k + 1 < SHCDI_START_COUNT ? SHCD_OK : status;
    }
    release(&p);
    report->time_parameterize_s = shcdi_seconds() - start_s;
    return status == SHCD_OK ? SHCD_OK : explain(status, &best, mesh, error);
}

shcd_status shcd_parameterize(const shcd_mesh *mesh, const shcd_fit_options *options,
                              double *directions, shcd_fit_report *report, shcd_error *error) {
    shcd_fit_options settings;
    if (mesh == NULL || directions == NULL) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "parameterize: null argument");
    }
    shcd_status status = shcdi_report_check(report, error);
    status = status == SHCD_OK ? shcdi_settings_resolve(options, &settings, error) : status;
    if (status != SHCD_OK) {
        return status;
    }
    const size_t n = shcd_mesh_vertex_count(mesh);
    shcd_vec3 *u = malloc(n * sizeof *u);
    if (u == NULL) {
        return shcdi_fit_fail(error, SHCD_ERR_MEMORY, "parameterize: out of memory");
    }
    const shcdi_progress progress = {settings.progress, settings.progress_user};
    shcd_fit_report full = {.struct_size = sizeof full};
    status = shcdi_parameterize(mesh, settings.area_weight, &progress, u, &full, error);
    for (size_t i = 0; i < n && status == SHCD_OK; ++i) {
        directions[3 * i] = u[i].x;
        directions[3 * i + 1] = u[i].y;
        directions[3 * i + 2] = u[i].z;
    }
    free(u);
    shcdi_report_write(&full, report);
    return status;
}
