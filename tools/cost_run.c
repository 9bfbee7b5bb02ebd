/* SPDX-License-Identifier: BSD-3-Clause */
/* Everything that is not measured is done before or after the rounds, so that they follow each
 * other. The time is bounded by the number of points, which a trial of the exact tier decides. */
#include "cost_run.h"

#include "report.h"

#include "shcd/vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define N_TRIAL 200
/* What the rounds may take, and the fields. */
#define ROUNDS_TIME_S 15.0
#define QUICK_ROUNDS_TIME_S 1.0
#define FIELDS_TIME_S 24.0
#define QUICK_FIELDS_TIME_S 2.0
enum { POINTS_MAX = 20000, QUICK_POINTS_MAX = 2000, POINTS_MIN = 1000 };

/* What a run holds besides its result. */
typedef struct cost_work {
    cost_sampler *sampler;
    cost_mesh *mesh;
    cost_points random, path;
    cost_random numbers;
    double *scratch;
    cost_progress progress;
} cost_work;

static bool no_memory(void) {
    report_failure("no memory");
    return false;
}

/* Seconds of one exact query near the surface. */
static double trial(const shcd_model *model, double diagonal_m, cost_work *work) {
    cost_points points;
    cost_random numbers = work->numbers;
    if (!cost_points_random(work->sampler, diagonal_m, N_TRIAL, &numbers, &points)) {
        return -1.0;
    }
    const double start_s = cost_spent_s();
    cost_points_ask(model, 0, N_TRIAL, &points);
    const double time_s = (cost_spent_s() - start_s) / N_TRIAL;
    cost_points_free(&points);
    return time_s;
}

/* For a point of either set a degree answers exactly, fast, and once more as a start of track, none
 * of which takes much longer than the whole body's exact answer; the truth is another query. */
static size_t choose_points(const cost_settings *settings, double query_s, size_t n_degrees) {
    const double most = settings->quick ? QUICK_POINTS_MAX : POINTS_MAX;
    const double time_s = settings->quick ? QUICK_ROUNDS_TIME_S : ROUNDS_TIME_S;
    const double affordable = time_s / (2.0 * query_s * (2.5 * (double)n_degrees + 1.0));
    double n = fmin(most, fmax(POINTS_MIN, affordable));
    if (settings->n_points > 0) {
        n = settings->n_points;
    }
    return (size_t)ceil(n / COST_ROUNDS) * COST_ROUNDS;
}

static bool ask_mesh(const cost_mesh *mesh, cost_progress *progress, cost_points *points) {
    points->mesh_m = malloc(points->n * sizeof *points->mesh_m);
    if (points->mesh_m == NULL) {
        return no_memory();
    }
    for (size_t i = 0; i < points->n; i++) {
        points->mesh_m[i] = cost_mesh_distance(mesh, points->point[i]);
        if (i % 256 == 0) {
            cost_progress_update((double)i / (double)points->n, progress);
        }
    }
    return true;
}

static bool make_points(const shcd_model *model, cost_work *work, cost_result *result) {
    const double diagonal_m = result->info.diagonal_m;
    const size_t n = result->n_points;
    if (!cost_points_random(work->sampler, diagonal_m, n, &work->numbers, &work->random) ||
        !cost_points_path(model, diagonal_m, n, &work->numbers, &work->path)) {
        return no_memory();
    }
    cost_progress_stage(&work->progress, "exact answers");
    const size_t chunk = n / COST_ROUNDS;
    for (size_t first = 0; first < n; first += chunk) {
        cost_points_ask(model, first, chunk, &work->random);
        cost_points_ask(model, first, chunk, &work->path);
        cost_progress_update((double)(first + chunk) / (double)n, &work->progress);
    }
    result->n_unknown = work->random.n_unknown + work->path.n_unknown;
    const double contact_m = COST_CONTACT_BAND * diagonal_m;
    for (size_t i = 0; i < n; i++) {
        result->n_contact += fabs(work->random.distance_m[i]) <= contact_m ? 1 : 0;
        result->n_contact += fabs(work->path.distance_m[i]) <= contact_m ? 1 : 0;
    }
    if (work->mesh != NULL) {
        cost_progress_stage(&work->progress, "distances to the mesh");
        return ask_mesh(work->mesh, &work->progress, &work->random) &&
               ask_mesh(work->mesh, &work->progress, &work->path);
    }
    return true;
}

/* ---- how far the surfaces are apart ---- */

static double distance_to(const shcd_model *model, shcd_vec3 point) {
    const shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity answer = {.distance_m = 0.0};
    /* finite points and a model in order: cannot fail */
    return shcd_closest(model, point, &options, &answer) == SHCD_OK ? fabs(answer.distance_m)
                                                                    : (double)NAN;
}

/* Both ways between the surface that `sampler` draws from and the whole body. */
static cost_spread between_surfaces(const shcd_model *model, const shcd_model *full,
                                    const cost_sampler *sampler, cost_work *work, size_t n) {
    for (size_t i = 0; i < n; i += 2) {
        shcd_vec3 point;
        cost_sampler_draw(sampler, &work->numbers, &point, NULL);
        work->scratch[i] = distance_to(full, point);
        cost_sampler_draw(work->sampler, &work->numbers, &point, NULL);
        work->scratch[i + 1] = distance_to(model, point);
    }
    return cost_spread_of(work->scratch, n);
}

static cost_spread between_mesh(const shcd_model *model, const cost_sampler *sampler,
                                cost_work *work, size_t n) {
    for (size_t i = 0; i < n; i += 2) {
        shcd_vec3 point;
        cost_sampler_draw(sampler, &work->numbers, &point, NULL);
        work->scratch[i] = fabs(cost_mesh_distance(work->mesh, point));
        work->scratch[i + 1] = distance_to(model, cost_mesh_draw(work->mesh, &work->numbers));
    }
    return cost_spread_of(work->scratch, n);
}

/* Both series at one parameter are within the offset, so the surfaces are. */
static bool measure_surface(const shcd_model *model, const shcd_model *full, cost_work *work,
                            size_t n, cost_surface *surface) {
    *surface = (cost_surface){.degree = shcd_model_degree(model)};
    const shcd_status status =
        shcd_model_enclosure_offset(full, surface->degree, &surface->enclosure_offset_m);
    if (status != SHCD_OK) {
        report_failure("%s", shcd_status_string(status));
        return false;
    }
    cost_sampler *sampler = cost_sampler_create(model);
    if (sampler == NULL) {
        return no_memory();
    }
    if (model != full) {
        surface->position_m = between_surfaces(model, full, sampler, work, n);
    }
    if (work->mesh != NULL) {
        surface->mesh_position_m = between_mesh(model, sampler, work, n);
    }
    cost_sampler_free(sampler);
    return true;
}

static bool measure_surfaces(const shcd_model *full, cost_work *work, cost_result *result) {
    const cost_lineup *lineup = &result->lineup;
    const size_t n = result->n_points / 10 * 2; /* both ways are equal in number */
    result->n_surface_points = n;
    cost_progress_stage(&work->progress, "comparing surfaces");
    for (size_t i = 0; i <= lineup->n_models; i++) {
        const shcd_model *model = i < lineup->n_models ? lineup->model[i] : full;
        if (!measure_surface(model, full, work, n, &result->surface[result->n_surfaces++])) {
            return false;
        }
        cost_progress_update((double)(i + 1) / (double)(lineup->n_models + 1), &work->progress);
    }
    return true;
}

/* ---- the rounds ---- */

/* Every other round runs backwards, so that none always comes after the same neighbour. */
static bool measure_rounds(cost_work *work, cost_result *result) {
    cost_lineup *lineup = &result->lineup;
    const cost_task task = {&result->clock, &work->random, &work->path, result->info.diagonal_m,
                            result->settings->stiffness_n_per_m};
    const size_t n = lineup->n_contenders;
    for (size_t c = 0; c < n; c++) {
        if (!cost_contender_reserve(result->n_points, &lineup->contender[c])) {
            return no_memory();
        }
    }
    cost_progress_stage(&work->progress, "measuring");
    for (int round = 0; round < COST_ROUNDS; round++) {
        for (size_t i = 0; i < n; i++) {
            const size_t c = round % 2 == 0 ? i : n - 1 - i;
            if (!cost_measure(&task, round, &lineup->contender[c], work->scratch)) {
                return false;
            }
            cost_progress_update(((double)round + (double)(i + 1) / (double)n) / COST_ROUNDS,
                                 &work->progress);
        }
    }
    for (size_t c = 0; c < n; c++) {
        cost_finish(&task, &lineup->contender[c], work->scratch);
        cost_contender_release(&lineup->contender[c]);
    }
    cost_mark_fronts(lineup->contender, n, result->tolerance_m);
    return true;
}

/* ---- all together ---- */

static bool open_mesh(const cost_settings *settings, cost_work *work, cost_result *result) {
    if (settings->mesh_path == NULL) {
        return true;
    }
    const double own_m = result->info.fit.unit_m > 0.0 ? result->info.fit.unit_m : 1.0;
    result->unit_m = settings->unit_m > 0.0 ? settings->unit_m : own_m;
    work->mesh = cost_mesh_read(settings->mesh_path, result->unit_m);
    if (work->mesh == NULL) {
        return false;
    }
    result->mesh_diagonal_m = cost_mesh_diagonal(work->mesh);
    const double ratio = result->mesh_diagonal_m / result->info.diagonal_m;
    if (ratio > 2.0 || ratio < 0.5) {
        report_warning("the mesh's diagonal is %.4g m, the body's %.4g m: is the unit right "
                       "(--unit)?",
                       result->mesh_diagonal_m, result->info.diagonal_m);
    }
    return true;
}

static bool measure_all(const shcd_model *model, cost_work *work, cost_result *result) {
    const cost_settings *settings = result->settings;
    const cost_lineup_settings lineup = {settings->quick,
                                         settings->quick ? QUICK_FIELDS_TIME_S : FIELDS_TIME_S};
    cost_clock_begin(&result->clock);
    work->sampler = cost_sampler_create(model);
    const double query_s =
        work->sampler != NULL ? trial(model, result->info.diagonal_m, work) : -1.0;
    if (query_s < 0.0) {
        return no_memory();
    }
    if (!cost_lineup_bodies(model, &lineup, &work->progress, &result->lineup)) {
        return false;
    }
    result->n_points = choose_points(settings, query_s, result->lineup.n_models + 1);
    work->scratch = malloc(2 * result->n_points * sizeof *work->scratch);
    if (work->scratch == NULL) {
        return no_memory();
    }
    return make_points(model, work, result) && measure_surfaces(model, work, result) &&
           cost_lineup_fields(&result->info, &lineup, &work->progress, &result->lineup) &&
           measure_rounds(work, result);
}

bool cost_run(const shcd_model *model, const cost_settings *settings, cost_result *result) {
    memset(result, 0, sizeof *result);
    result->settings = settings;
    result->info = (shcd_model_info){.struct_size = sizeof result->info};
    const double start_s = cost_now_s();
    if (shcd_model_describe(model, &result->info) != SHCD_OK) {
        report_failure("the body cannot be described");
        return false;
    }
    result->tolerance_m = COST_TRUTH * result->info.diagonal_m;
    cost_work work = {.numbers = {(uint64_t)settings->seed}};
    bool good = open_mesh(settings, &work, result);
    if (good) {
        cost_progress_begin(&work.progress);
        good = measure_all(model, &work, result);
        cost_progress_end(&work.progress);
    }
    cost_sampler_free(work.sampler);
    cost_mesh_free(work.mesh);
    cost_points_free(&work.random);
    cost_points_free(&work.path);
    free(work.scratch);
    result->time_s = cost_now_s() - start_s;
    return good;
}

void cost_result_free(cost_result *result) {
    cost_lineup_free(&result->lineup);
}
