/* SPDX-License-Identifier: BSD-3-Clause */
/* The JSON members carry the names of the C structures, units included. */
#include "fit_report.h"

#include "body.h"
#include "body_modes.h"
#include "report.h"

#include <inttypes.h>
#include <stddef.h>

/* As a share of the diagonal: a hundredth of the RMS error of a good fit. */
#define ROUNDING_WORTH_A_WARNING 1e-5

static void print_repair(FILE *file, uint64_t n, const char *what) {
    if (n > 0) {
        fprintf(file, "%-22s%" PRIu64 " %s\n", "", n, what);
    }
}

static void print_mesh(FILE *file, const fit_result *r) {
    const shcd_mesh_report *mesh = &r->mesh;
    fprintf(file, "%-22s%s, %" PRIu64 " triangles, %" PRIu64 " vertices, %.6g m in one unit\n",
            "mesh", r->mesh_path, mesh->n_triangles, mesh->n_vertices, r->unit_m);
    print_repair(file, mesh->n_vertices_merged, "vertices merged by equal position");
    print_repair(file, mesh->n_vertices_unused, "unused vertices dropped");
    print_repair(file, mesh->n_triangles_degenerate_dropped,
                 "triangles with a repeated corner dropped");
    print_repair(file, mesh->n_triangles_zero_area, "triangles without area kept");
    print_repair(file, mesh->n_triangles_flipped, "triangles turned to agree with the others");
    if (mesh->turned_inside_out != 0) {
        fprintf(file, "%-22sall triangles turned: the mesh was inside out\n", "");
    }
    body_print_length(file, "  diagonal", mesh->diagonal_m, 0.0);
    fprintf(file, "%-22s%.6g m^3, area %.6g m^2\n", "  volume", mesh->volume_m3, mesh->area_m2);
    body_print_length(file, "  import rounding", r->import_rounding_m, mesh->diagonal_m);
}

void fit_report_text(FILE *file, const fit_result *r) {
    const shcd_fit_report *fit = &r->fit;
    const shcd_fit_record *record = &fit->record;
    print_mesh(file, r);
    fprintf(file, "%-22s%s\n", "body", r->body_path);
    fprintf(file, "%-22s%d (%zu harmonics)\n", "degree", (int)fit->degree, SHCD_COUNT(fit->degree));
    body_print_length(file, "RMS error", record->rms_error_m, record->mesh_diagonal_m);
    body_print_length(file, "Hausdorff error", record->hausdorff_error_m, record->mesh_diagonal_m);
    body_print_length(file, "least thickness", record->local_thickness_m, record->mesh_diagonal_m);
    fprintf(file, "%-22slog ratio rms %.4g, ratio %.4g to %.4g\n", "area distortion",
            record->area_log_ratio_rms, record->area_ratio_min, record->area_ratio_max);
    fprintf(file, "%-22s%" PRIu64 " (%" PRIu64 " at the start, %" PRIu64 " + %" PRIu64 " steps)\n",
            "flipped triangles", fit->n_flipped, fit->n_flipped_start, fit->n_untangle_iterations,
            fit->n_polish_iterations);
    body_print_topology(file, &r->model);
    body_print_modes(file, r->modes);
    fprintf(file,
            "%-22s%.3g s (parameterization %.3g, coefficients %.3g, model %.3g, errors %.3g)\n",
            "time", r->time_s, fit->time_parameterize_s, fit->time_coefficients_s,
            fit->time_model_s, fit->time_error_s);
}

static void write_mesh(json_writer *json, const fit_result *r) {
    const shcd_mesh_report *mesh = &r->mesh;
    json_open_object(json, "mesh");
    json_count(json, "n_vertices_read", mesh->n_vertices_read);
    json_count(json, "n_triangles_read", mesh->n_triangles_read);
    json_count(json, "n_vertices", mesh->n_vertices);
    json_count(json, "n_triangles", mesh->n_triangles);
    json_count(json, "n_vertices_merged", mesh->n_vertices_merged);
    json_count(json, "n_vertices_unused", mesh->n_vertices_unused);
    json_count(json, "n_triangles_degenerate_dropped", mesh->n_triangles_degenerate_dropped);
    json_count(json, "n_triangles_zero_area", mesh->n_triangles_zero_area);
    json_count(json, "n_triangles_flipped", mesh->n_triangles_flipped);
    json_bool(json, "turned_inside_out", mesh->turned_inside_out != 0);
    json_number(json, "diagonal_m", mesh->diagonal_m);
    json_number(json, "volume_m3", mesh->volume_m3);
    json_number(json, "area_m2", mesh->area_m2);
    json_number(json, "import_rounding_m", r->import_rounding_m);
    json_number(json, "import_rounding_percent_of_diagonal",
                100.0 * r->import_rounding_m / mesh->diagonal_m);
    json_close_object(json);
}

static void write_fit(json_writer *json, const shcd_fit_report *fit) {
    json_open_object(json, "fit");
    json_integer(json, "degree", fit->degree);
    json_integer(json, "start", fit->start);
    json_count(json, "n_flipped_start", fit->n_flipped_start);
    json_count(json, "n_flipped", fit->n_flipped);
    json_count(json, "n_untangle_iterations", fit->n_untangle_iterations);
    json_count(json, "n_polish_iterations", fit->n_polish_iterations);
    json_count(json, "n_samples", fit->n_samples);
    json_number(json, "min_det_ratio", fit->min_det_ratio);
    json_number(json, "time_parameterize_s", fit->time_parameterize_s);
    json_number(json, "time_coefficients_s", fit->time_coefficients_s);
    json_number(json, "time_model_s", fit->time_model_s);
    json_number(json, "time_error_s", fit->time_error_s);
    json_number(json, "time_modes_s", fit->time_modes_s);
    body_write_fit_record(json, "record", &fit->record);
    json_close_object(json);
}

void fit_report_json(FILE *file, const fit_result *r) {
    json_writer json;
    json_begin(&json, file);
    json_string(&json, "mesh_file", r->mesh_path);
    json_string(&json, "body_file", r->body_path);
    json_number(&json, "unit_m", r->unit_m);
    if (r->tolerance_m > 0.0) {
        json_number(&json, "tolerance_m", r->tolerance_m);
    } else {
        json_null(&json, "tolerance_m");
    }
    json_number(&json, "time_s", r->time_s);
    write_mesh(&json, r);
    write_fit(&json, &r->fit);
    json_open_object(&json, "model");
    body_write_json(&json, &r->model);
    body_write_modes(&json, r->modes);
    json_close_object(&json);
    json_end(&json);
}

void fit_report_warn_rounding(const fit_result *r) {
    const double relative = r->import_rounding_m / r->mesh.diagonal_m;
    if (relative > ROUNDING_WORTH_A_WARNING) {
        report_warning("single precision of the import rounds coordinates by about %.3g m, %.3g of "
                       "the diagonal: move the mesh closer to its origin",
                       r->import_rounding_m, relative);
    } else if (r->tolerance_m > 0.0 && r->import_rounding_m > r->tolerance_m) {
        report_warning("single precision of the import rounds coordinates by about %.3g m, more "
                       "than the tolerance of %.3g m",
                       r->import_rounding_m, r->tolerance_m);
    }
}

void fit_report_warnings(const fit_result *r) {
    const shcd_fit_record *record = &r->fit.record;
    if (record->local_thickness_m > 0.0 && record->hausdorff_error_m > record->local_thickness_m) {
        report_warning("the Hausdorff error, %.3g m, exceeds the least thickness of the mesh, "
                       "%.3g m: thin parts may be lost or pierced; a higher degree may help",
                       record->hausdorff_error_m, record->local_thickness_m);
    }
    body_warn_embedding(&r->model);
    if (r->fit.modes_error.status != SHCD_OK) {
        report_warning("the body has no modes: %s", r->fit.modes_error.message);
    }
}
