/* SPDX-License-Identifier: BSD-3-Clause */
/* The members of the JSON description carry the names of the C structures, units included. */
#include "body.h"

#include "report.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define SIZE_MIN_M 1e-3
#define SIZE_MAX_M 10.0

/* The library's messages about files start with the path, cut short if it is long. */
static void report_file(const char *path, const char *reason) {
    const size_t length = strlen(path);
    if (strncmp(reason, path, length < 100 ? length : 100) == 0) {
        report_failure("%s", reason);
    } else {
        report_failure("%s: %s", path, reason);
    }
}

shcd_model *body_load(const char *path) {
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = shcd_model_load(path, NULL, &model, &error);
    if (status != SHCD_OK) {
        report_file(path, report_reason(status, &error));
        return NULL;
    }
    return model;
}

bool body_describe(const shcd_model *model, shcd_model_info *info) {
    *info = (shcd_model_info){.struct_size = sizeof *info};
    const shcd_status status = shcd_model_describe(model, info);
    if (status != SHCD_OK) {
        report_failure("%s", shcd_status_string(status));
    }
    return status == SHCD_OK;
}

bool body_definition(const shcd_model *model, shcd_model_info *info, shcd_model_def *definition) {
    if (!body_describe(model, info)) {
        return false;
    }
    definition->degree = shcd_model_degree(model);
    definition->coefficients = shcd_model_coefficients(model);
    definition->fit = info->fit.n_triangles > 0 ? &info->fit : NULL;
    definition->cost_rows = shcd_model_cost_rows(model, &definition->n_cost_rows);
    definition->cost_machine = shcd_model_cost_machine(model);
    definition->modes = shcd_model_modes(model);
    definition->learned = shcd_model_learned(model);
    return true;
}

bool body_save(const shcd_model *model, const char *path) {
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = shcd_model_save(model, path, &error);
    if (status != SHCD_OK) {
        report_file(path, report_reason(status, &error));
    }
    return status == SHCD_OK;
}

bool body_warn_size(double diagonal_m) {
    if (diagonal_m >= SIZE_MIN_M && diagonal_m <= SIZE_MAX_M) {
        return false;
    }
    report_warning("the body's diagonal is %.4g m, not between 1 mm and 10 m: is the unit right "
                   "(--unit)?",
                   diagonal_m);
    return true;
}

bool body_warn_embedding(const shcd_model_info *info) {
    if (info->is_embedded != 0) {
        return false;
    }
    report_warning("the surface intersects itself (%s): inside and outside are not defined there",
                   body_certainty(info->embedded_certainty));
    return true;
}

const char *body_certainty(int certainty) {
    switch (certainty) {
    case SHCD_CERTAINTY_SAMPLED:
        return "sampled";
    case SHCD_CERTAINTY_PROVEN:
        return "proven";
    default:
        return "unknown";
    }
}

void body_print_length(FILE *file, const char *label, double length_m, double diagonal_m) {
    fprintf(file, "%-22s%.6g m (%.6g mm", label, length_m, 1e3 * length_m);
    if (diagonal_m > 0.0) {
        fprintf(file, ", %.3g %% of the diagonal", 100.0 * length_m / diagonal_m);
    }
    fputs(")\n", file);
}

void body_print_topology(FILE *file, const shcd_model_info *info) {
    if (info->embedded_certainty == SHCD_CERTAINTY_UNKNOWN) {
        fprintf(file, "%-22snot examined\n", "self-intersection");
    } else {
        fprintf(file, "%-22s%s (%s)\n", "self-intersection",
                info->is_embedded != 0 ? "none" : "yes", body_certainty(info->embedded_certainty));
    }
    if (info->star_certainty == SHCD_CERTAINTY_UNKNOWN) {
        fprintf(file, "%-22snot examined\n", "star-shaped");
    } else {
        fprintf(file, "%-22s%s (%s), about (%.6g, %.6g, %.6g) m\n", "star-shaped",
                info->is_star_shaped != 0 ? "yes" : "no", body_certainty(info->star_certainty),
                info->star_centre_m.x, info->star_centre_m.y, info->star_centre_m.z);
    }
}

void body_write_fit_record(json_writer *json, const char *key, const shcd_fit_record *record) {
    if (record->n_triangles == 0) {
        json_null(json, key);
        return;
    }
    json_open_object(json, key);
    json_count(json, "n_triangles", record->n_triangles);
    json_count(json, "n_vertices", record->n_vertices);
    json_number(json, "mesh_diagonal_m", record->mesh_diagonal_m);
    json_number(json, "rms_error_m", record->rms_error_m);
    json_number(json, "hausdorff_error_m", record->hausdorff_error_m);
    json_number(json, "rms_error_percent_of_diagonal",
                100.0 * record->rms_error_m / record->mesh_diagonal_m);
    json_number(json, "hausdorff_error_percent_of_diagonal",
                100.0 * record->hausdorff_error_m / record->mesh_diagonal_m);
    json_number(json, "area_log_ratio_rms", record->area_log_ratio_rms);
    json_number(json, "area_ratio_min", record->area_ratio_min);
    json_number(json, "area_ratio_max", record->area_ratio_max);
    json_number(json, "local_thickness_m", record->local_thickness_m);
    json_number(json, "fit_time_s", record->fit_time_s);
    json_number(json, "unit_m", record->unit_m);
    json_close_object(json);
}

void body_write_json(json_writer *json, const shcd_model_info *info) {
    json_integer(json, "degree", info->degree);
    json_count(json, "n_coefficients", (uint64_t)SHCD_COUNT(info->degree));
    json_bool(json, "is_embedded", info->is_embedded != 0);
    json_string(json, "embedded_certainty", body_certainty(info->embedded_certainty));
    json_bool(json, "is_star_shaped", info->is_star_shaped != 0);
    json_string(json, "star_certainty", body_certainty(info->star_certainty));
    json_vec3(json, "box_min_m", info->box_min_m);
    json_vec3(json, "box_max_m", info->box_max_m);
    json_number(json, "diagonal_m", info->diagonal_m);
    json_vec3(json, "centre_m", info->centre_m);
    json_number(json, "radius_m", info->radius_m);
    json_vec3(json, "star_centre_m", info->star_centre_m);
    json_number(json, "star_margin_m", info->star_margin_m);
    json_number(json, "volume_m3", info->volume_m3);
    json_number(json, "area_m2", info->area_m2);
    json_number(json, "max_first_derivative_m", info->max_first_derivative_m);
    json_number(json, "max_second_derivative_m", info->max_second_derivative_m);
    json_number(json, "max_deviation_m", info->max_deviation_m);
    json_count(json, "n_leaves", info->n_leaves);
    json_count(json, "run_time_bytes", info->run_time_bytes);
    json_integer(json, "map_resolution", info->map_resolution);
    json_integer(json, "map_crossings_max", info->map_crossings_max);
    json_number(json, "map_one_crossing_share", info->map_one_crossing_share);
    json_number(json, "map_bilinear_error_m", info->map_bilinear_error_m);
    json_number(json, "map_hermite_error_m", info->map_hermite_error_m);
    json_number(json, "map_bilinear_rms_m", info->map_bilinear_rms_m);
    json_number(json, "map_hermite_rms_m", info->map_hermite_rms_m);
    json_number(json, "map_equal_count_share", info->map_equal_count_share);
    json_number(json, "map_bounded_share", info->map_bounded_share);
    json_number(json, "map_bilinear_bound_m", info->map_bilinear_bound_m);
    json_number(json, "map_hermite_bound_m", info->map_hermite_bound_m);
    body_write_fit_record(json, "fit", &info->fit);
}
