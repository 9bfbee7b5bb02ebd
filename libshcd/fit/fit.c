/* SPDX-License-Identifier: BSD-3-Clause */
/* The pipeline: parameterize, least squares, compare with the mesh, make the model.
 *
 * With a tolerance the degree is searched upwards, since the error against the mesh is not monotone
 * in the degree and only the smallest one is wanted. Degrees are taken in groups: one factorisation
 * of the normal equations at the top of a group serves all degrees in it, and a small top costs
 * little where a low degree will do. */
#include "coefficients.h"
#include "fail.h"
#include "fit_error.h"
#include "modes.h"
#include "parameterize.h"
#include "settings.h"

#include <stdlib.h>

typedef struct job {
    const shcd_mesh *mesh;
    shcd_fit_options settings;
    shcdi_progress progress;
    shcdi_body body;
    shcd_vec3 *u;
    shcdi_comparison *comparison;
    double *coefficients_m; /* room for the highest degree; relative to the body's centre */
    shcd_modes *modes;
    shcd_fit_report *report;
    shcd_error *error;
} job;

static shcd_status explain(const job *j, shcd_status status, const char *what) {
    const char *why = status == SHCD_ERR_MEMORY      ? "out of memory"
                      : status == SHCD_ERR_CANCELLED ? "stopped by the caller"
                                                     : shcd_status_string(status);
    return shcdi_fit_fail(j->error, status, "fit: %s: %s", what, why);
}

static shcd_status prepare(job *j) {
    const int highest = j->settings.degree > 0 ? j->settings.degree : j->settings.degree_max;
    j->u = malloc(shcd_mesh_vertex_count(j->mesh) * sizeof *j->u);
    j->coefficients_m = malloc(3 * SHCD_COUNT(highest) * sizeof *j->coefficients_m);
    if (j->u == NULL || j->coefficients_m == NULL) {
        return explain(j, SHCD_ERR_MEMORY, "start");
    }
    shcd_status status = shcdi_body_init(&j->body, j->mesh);
    if (status == SHCD_OK) {
        status = shcdi_comparison_create(&j->body, &j->comparison);
    }
    return status == SHCD_OK ? SHCD_OK : explain(j, status, "start");
}

static void release(job *j) {
    shcdi_comparison_free(j->comparison);
    shcdi_body_release(&j->body);
    free(j->u);
    free(j->coefficients_m);
    shcd_modes_free(j->modes);
}

/* Normal equations up to a degree, with as many samples as that degree calls for. */
static shcd_status make_least_squares(job *j, int degree, shcdi_least_squares **least_squares) {
    const double start_s = shcdi_seconds();
    const uint64_t by_degree = SHCDI_SAMPLES_PER_COEFFICIENT * (uint64_t)SHCD_COUNT(degree);
    uint64_t n_wanted = by_degree > SHCDI_SAMPLES_MIN ? by_degree : SHCDI_SAMPLES_MIN;
    n_wanted = j->settings.n_samples > 0 ? j->settings.n_samples : n_wanted;
    shcdi_samples samples;
    shcd_status status = shcdi_samples_make(&samples, &j->body, j->u, n_wanted);
    if (status == SHCD_OK) {
        j->report->n_samples = samples.n;
        status = shcdi_least_squares_create(degree, &samples, &j->progress, least_squares);
        shcdi_samples_release(&samples);
    }
    j->report->time_coefficients_s += shcdi_seconds() - start_s;
    if (status == SHCD_ERR_CONVERGENCE) {
        return shcdi_fit_fail(j->error, status,
                              "fit: %llu samples do not determine a series of degree %d: a lower "
                              "degree, more samples or a less slender mesh is needed",
                              (unsigned long long)j->report->n_samples, degree);
    }
    return status == SHCD_OK ? SHCD_OK : explain(j, status, "least squares");
}

static shcd_status measure(job *j, int degree, double stop_above_m, shcdi_distance *distance) {
    const double start_s = shcdi_seconds();
    const shcd_status status = shcdi_comparison_measure(j->comparison, degree, j->coefficients_m,
                                                        stop_above_m, &j->progress, distance);
    j->report->time_error_s += shcdi_seconds() - start_s;
    return status == SHCD_OK ? SHCD_OK : explain(j, status, "error against the mesh");
}

static shcd_status fit_degree(job *j, int degree, shcdi_distance *distance) {
    shcdi_least_squares *least_squares = NULL;
    shcd_status status = make_least_squares(j, degree, &least_squares);
    if (status == SHCD_OK) {
        shcdi_least_squares_solve(least_squares, degree, j->coefficients_m);
        status = measure(j, degree, HUGE_VAL, distance);
    }
    shcdi_least_squares_free(least_squares);
    j->report->degree = degree;
    return status;
}

/* Tops of the groups of degrees: the cost of one grows with the sixth power of its top. */
static int next_top(int top, int degree_max) {
    static const int tops[] = {8, 15, 22, 30, 40, 50, 65, 85, 110};
    for (size_t k = 0; k < sizeof tops / sizeof *tops; ++k) {
        if (tops[k] > top) {
            return tops[k] < degree_max ? tops[k] : degree_max;
        }
    }
    return degree_max;
}

static shcd_status fit_tolerance(job *j, shcdi_distance *distance) {
    const double tolerance_m = j->settings.tolerance_m;
    const int degree_max = j->settings.degree_max;
    double best_m = HUGE_VAL;
    int best_degree = 0, degree = 0, top = 0;
    shcd_status status = SHCD_OK;
    while (degree < degree_max && status == SHCD_OK) {
        shcdi_least_squares *least_squares = NULL;
        top = next_top(top, degree_max);
        status = make_least_squares(j, top, &least_squares);
        while (degree < top && status == SHCD_OK) {
            ++degree;
            shcdi_least_squares_solve(least_squares, degree, j->coefficients_m);
            status = measure(j, degree, fmax(best_m, tolerance_m), distance);
            if (status != SHCD_OK || !distance->is_complete) {
                continue;
            }
            if (distance->hausdorff_m <= tolerance_m) {
                shcdi_least_squares_free(least_squares);
                j->report->degree = degree;
                return SHCD_OK;
            }
            best_degree = distance->hausdorff_m < best_m ? degree : best_degree;
            best_m = fmin(best_m, distance->hausdorff_m);
        }
        shcdi_least_squares_free(least_squares);
    }
    return status != SHCD_OK
               ? status
               : shcdi_fit_fail(j->error, SHCD_ERR_CONVERGENCE,
                                "fit: no degree up to %d comes within %g m of the mesh: degree %d "
                                "comes nearest, within %.4g m (%.3g %% of the diagonal)",
                                degree_max, tolerance_m, best_degree, best_m,
                                100.0 * best_m / j->body.diagonal_m);
}

static void fill_record(job *j, const shcdi_distance *distance) {
    const double start_s = shcdi_seconds();
    shcd_fit_record *record = &j->report->record;
    record->n_triangles = j->body.n_triangles;
    record->n_vertices = j->body.n_vertices;
    record->mesh_diagonal_m = j->body.diagonal_m;
    record->rms_error_m = distance->rms_m;
    record->hausdorff_error_m = distance->hausdorff_m;
    record->unit_m = j->settings.unit_m;
    shcdi_area_ratios(&j->body, j->u, record);
    record->local_thickness_m = shcdi_comparison_thickness(j->comparison);
    j->report->time_error_s += shcdi_seconds() - start_s;
    record->fit_time_s =
        j->report->time_parameterize_s + j->report->time_coefficients_s + j->report->time_error_s;
}

/* Of the final coefficients. A surface that has no modes to the wanted accuracy is still a body. */
static shcd_status make_modes(job *j) {
    const double start_s = shcdi_seconds();
    const size_t n = SHCD_COUNT(j->report->degree);
    const int32_t wanted = j->settings.n_modes;
    shcd_modes_options options = SHCD_MODES_OPTIONS_INIT, settings;
    shcd_anchor none[SHCD_ANCHORS_MAX];
    options.n_modes = wanted < 0 ? 0 : (size_t)wanted > n ? (int32_t)n : wanted;
    options.progress = j->progress.call;
    options.progress_user = j->progress.user;
    shcd_error *why = &j->report->modes_error;
    shcd_status status = shcdi_modes_settings(&options, j->report->degree, &settings, none, why);
    if (status == SHCD_OK) {
        status =
            shcdi_modes_compute(j->report->degree, j->coefficients_m, &settings, &j->modes, why);
    }
    j->report->time_modes_s = shcdi_seconds() - start_s;
    if (status == SHCD_OK || status == SHCD_ERR_CONVERGENCE || status == SHCD_ERR_GEOMETRY) {
        return SHCD_OK;
    }
    return explain(j, status, "modes");
}

static void move_to_centre(job *j) {
    const double y00 = 0.28209479177387814347; /* 1 / sqrt(4 pi) */
    j->coefficients_m[0] += j->body.centre_m.x / y00;
    j->coefficients_m[1] += j->body.centre_m.y / y00;
    j->coefficients_m[2] += j->body.centre_m.z / y00;
}

static shcd_status make_model(job *j, const shcd_allocator *allocator, shcd_model **model) {
    const double start_s = shcdi_seconds();
    shcd_model_def definition = SHCD_MODEL_DEF_INIT;
    definition.degree = j->report->degree;
    definition.coefficients = j->coefficients_m;
    definition.fit = &j->report->record;
    definition.modes = j->modes;
    if (shcdi_progress_report(&j->progress, "model", 0.0) != SHCD_OK) {
        return explain(j, SHCD_ERR_CANCELLED, "model");
    }
    const shcd_status status = shcd_model_create(&definition, allocator, model, j->error);
    j->report->time_model_s = shcdi_seconds() - start_s;
    return status;
}

static shcd_status run(job *j, const shcd_allocator *allocator, shcd_model **model) {
    shcdi_distance distance;
    shcd_status status = prepare(j);
    if (status == SHCD_OK) {
        status = shcdi_parameterize(j->mesh, j->settings.area_weight, &j->progress, j->u, j->report,
                                    j->error);
    }
    if (status == SHCD_OK) {
        status = j->settings.degree > 0 ? fit_degree(j, j->settings.degree, &distance)
                                        : fit_tolerance(j, &distance);
    }
    if (status == SHCD_OK) {
        fill_record(j, &distance);
        move_to_centre(j);
        status = j->settings.n_modes != 0 ? make_modes(j) : SHCD_OK;
    }
    if (status == SHCD_OK) {
        status = make_model(j, allocator, model);
    }
    return status;
}

shcd_status shcd_fit(const shcd_mesh *mesh, const shcd_fit_options *options,
                     const shcd_allocator *allocator, shcd_model **model, shcd_fit_report *report,
                     shcd_error *error) {
    shcd_fit_report full = {.struct_size = sizeof full};
    job j = {.mesh = mesh, .report = &full, .error = error};
    if (mesh == NULL || model == NULL) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "fit: null argument");
    }
    shcd_status status = shcdi_report_check(report, error);
    status = status == SHCD_OK ? shcdi_settings_resolve(options, &j.settings, error) : status;
    if (status != SHCD_OK) {
        return status;
    }
    j.progress = (shcdi_progress){j.settings.progress, j.settings.progress_user};
    shcd_model *made = NULL;
    status = run(&j, allocator, &made);
    release(&j);
    shcdi_report_write(&full, report);
    if (status == SHCD_OK) {
        *model = made;
    }
    return status;
}
