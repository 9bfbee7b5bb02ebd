/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd info`: all of shcd_model_info, for people or as JSON. */
#include "arguments.h"
#include "body.h"
#include "body_learned.h"
#include "body_modes.h"
#include "commands.h"
#include "report.h"

#include <inttypes.h>
#include <stddef.h>

static void print_vector(const char *label, shcd_vec3 v) {
    printf("%-22s(%.9g, %.9g, %.9g) m\n", label, v.x, v.y, v.z);
}

static void print_fit(const shcd_fit_record *fit) {
    if (fit->n_triangles == 0) {
        printf("%-22snone: the body was made from coefficients\n", "fit");
        return;
    }
    printf("%-22s%" PRIu64 " triangles, %" PRIu64 " vertices, %.6g m in one unit of its file\n",
           "fitted to a mesh of", fit->n_triangles, fit->n_vertices, fit->unit_m);
    body_print_length(stdout, "  diagonal", fit->mesh_diagonal_m, 0.0);
    body_print_length(stdout, "  RMS error", fit->rms_error_m, fit->mesh_diagonal_m);
    body_print_length(stdout, "  Hausdorff error", fit->hausdorff_error_m, fit->mesh_diagonal_m);
    body_print_length(stdout, "  least thickness", fit->local_thickness_m, fit->mesh_diagonal_m);
    printf("%-22slog ratio rms %.4g, ratio %.4g to %.4g\n", "  area distortion",
           fit->area_log_ratio_rms, fit->area_ratio_min, fit->area_ratio_max);
    printf("%-22s%.3g s\n", "  time", fit->fit_time_s);
}

static void print_info(const char *path, const shcd_model_info *info, const shcd_model *model) {
    printf("%-22s%s\n", "body", path);
    printf("%-22s%d (%zu harmonics)\n", "degree", (int)info->degree, SHCD_COUNT(info->degree));
    print_vector("box from", info->box_min_m);
    print_vector("box to", info->box_max_m);
    body_print_length(stdout, "diagonal", info->diagonal_m, 0.0);
    print_vector("enclosing ball about", info->centre_m);
    body_print_length(stdout, "  certified radius", info->radius_m, 0.0);
    printf("%-22s%.9g m^3\n", "volume", info->volume_m3);
    printf("%-22s%.9g m^2\n", "area", info->area_m2);
    body_print_topology(stdout, info);
    body_print_length(stdout, "  star margin", info->star_margin_m, info->diagonal_m);
    printf("%-22s|S'| <= %.6g m/rad, |S''| <= %.6g m/rad^2\n", "derivatives",
           info->max_first_derivative_m, info->max_second_derivative_m);
    printf("%-22s%" PRIu64 " leaves\n", "query tree", info->n_leaves);
    body_print_length(stdout, "  deviation <=", info->max_deviation_m, info->diagonal_m);
    printf("%-22s%" PRIu64 " bytes\n", "memory", info->run_time_bytes);
    printf("%-22s%d x %d texels, at most %d crossings, %.4g %% with one\n", "distance map",
           (int)info->map_resolution, (int)info->map_resolution, (int)info->map_crossings_max,
           100.0 * info->map_one_crossing_share);
    body_print_length(stdout, "  bilinear error", info->map_bilinear_error_m, info->diagonal_m);
    body_print_length(stdout, "  Hermite error", info->map_hermite_error_m, info->diagonal_m);
    printf("  with a proven error %.3g %% of the cells\n", 100.0 * info->map_bounded_share);
    if (info->map_bounded_share > 0.0) {
        body_print_length(stdout, "  bilinear bound", info->map_bilinear_bound_m, info->diagonal_m);
        body_print_length(stdout, "  Hermite bound", info->map_hermite_bound_m, info->diagonal_m);
    }
    body_print_modes(stdout, shcd_model_modes(model));
    body_print_learned(stdout, shcd_model_learned(model));
    print_fit(&info->fit);
}

static void write_json(const char *path, const shcd_model_info *info, const shcd_model *model) {
    json_writer json;
    json_begin(&json, stdout);
    json_string(&json, "file", path);
    body_write_json(&json, info);
    body_write_modes(&json, shcd_model_modes(model));
    body_write_learned(&json, shcd_model_learned(model));
    json_end(&json);
}

int command_info(int argc, char **argv) {
    arguments a;
    bool as_json = false;
    int key;
    arguments_begin(&a, argc, argv);
    while ((key = arguments_next(&a)) > 0) {
        as_json = as_json || key == OPTION_JSON;
    }
    if (key != ARGUMENTS_END) {
        return arguments_status(key);
    }
    const char *path = arguments_operand(&a, "BODY.shcd");
    if (path == NULL) {
        return STATUS_USAGE;
    }
    shcd_model *model = body_load(path);
    if (model == NULL) {
        return STATUS_FAILED;
    }
    shcd_model_info info;
    const bool described = body_describe(model, &info);
    if (described && as_json) {
        write_json(path, &info, model);
    } else if (described) {
        print_info(path, &info, model);
    }
    shcd_model_free(model);
    return described ? STATUS_DONE : STATUS_FAILED;
}
