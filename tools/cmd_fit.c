/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd fit`: mesh -> body, with a report. The report is complete on disk under a temporary name
 * before the body is saved, and gets its name afterwards, so that a failure leaves neither. */
#include "arguments.h"
#include "body.h"
#include "commands.h"
#include "fit_report.h"
#include "import_child.h"
#include "number.h"
#include "output.h"
#include "progress.h"
#include "report.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

const char command_fit_build[] =
    "with libshcd-fit (GSL, FFTW, CHOLMOD, Assimp): these binaries are GPL-3.0-or-later";

typedef struct fit_request {
    const char *mesh;
    const char *body;
    const char *json; /**< NULL: none */
    double unit_m;
    int degree;     /**< 0: not given */
    int degree_max; /**< 0: not given */
    double tolerance_m;
    double area_weight;
    int n_modes; /**< -1: not given */
    import_limits import;
    bool quiet;
} fit_request;

/* False: reported. */
static bool take_import_limit(fit_request *request, int key, const char *value) {
    const bool is_memory = key == OPTION_IMPORT_MEMORY;
    const int most = is_memory ? IMPORT_MEMORY_MAX_MIB : IMPORT_TIME_MAX_S;
    if (!number_parse_integer(value, 1, most,
                              is_memory ? &request->import.memory_mib : &request->import.time_s)) {
        report_usage("--import-%s %s: must be 1 to %d", is_memory ? "memory" : "time", value, most);
        return false;
    }
    return true;
}

/* False: reported. */
static bool take_option(void *user, int key, const char *value) {
    fit_request *request = user;
    switch (key) {
    case OPTION_OUTPUT:
        request->body = value;
        return true;
    case OPTION_JSON:
        request->json = value;
        return true;
    case OPTION_QUIET:
        request->quiet = true;
        return true;
    case OPTION_DEGREE:
    case OPTION_DEGREE_MAX:
        if (!number_parse_integer(value, 1, SHCD_DEGREE_MAX,
                                  key == OPTION_DEGREE ? &request->degree : &request->degree_max)) {
            report_usage("--degree%s %s: must be 1 to %d", key == OPTION_DEGREE ? "" : "-max",
                         value, SHCD_DEGREE_MAX);
            return false;
        }
        return true;
    case OPTION_MODES:
        if (!number_parse_integer(value, 0, SHCD_MODES_MAX, &request->n_modes)) {
            report_usage("--modes %s: must be 0 to %d", value, SHCD_MODES_MAX);
            return false;
        }
        return true;
    case OPTION_IMPORT_MEMORY:
    case OPTION_IMPORT_TIME:
        return take_import_limit(request, key, value);
    case OPTION_TOLERANCE:
        if (!number_parse_length(value, &request->tolerance_m)) {
            report_usage("--tolerance %s: is not a positive length", value);
            return false;
        }
        return true;
    case OPTION_UNIT:
        if (!number_parse_unit(value, &request->unit_m)) {
            report_usage("--unit %s: must be m, cm, mm, um, in or a positive number", value);
            return false;
        }
        return true;
    default: /* OPTION_AREA_WEIGHT */
        if (!number_parse(value, &request->area_weight) || !(request->area_weight > 0.0)) {
            report_usage("--area-weight %s: must be a positive number", value);
            return false;
        }
        return true;
    }
}

/* Returns an exit status, or -1 if the command is to go on. */
static int parse_request(int argc, char **argv, fit_request *request) {
    arguments a;
    const int status = arguments_take(&a, argc, argv, take_option, request);
    if (status >= 0) {
        return status;
    }
    request->mesh = arguments_operand(&a, "MESH");
    if (request->mesh == NULL) {
        return STATUS_USAGE;
    }
    if (request->body == NULL || strcmp(request->body, "-") == 0) {
        return report_usage("-o BODY.shcd is missing");
    }
    if (request->degree > 0 && request->tolerance_m > 0.0) {
        return report_usage("--degree and --tolerance exclude each other");
    }
    if (request->degree_max > 0 && !(request->tolerance_m > 0.0)) {
        return report_usage("--degree-max needs --tolerance");
    }
    return -1;
}

/* Before a minute of work: are the outputs possible, and different from the input? */
static bool check_paths(const fit_request *request) {
    const bool json_file = request->json != NULL && strcmp(request->json, "-") != 0;
    if (output_same(request->mesh, request->body) ||
        (json_file && output_same(request->mesh, request->json))) {
        report_failure("%s: the output would overwrite the input", request->mesh);
        return false;
    }
    if (json_file && output_same(request->json, request->body)) {
        report_failure("%s: report and body cannot be one file", request->json);
        return false;
    }
    return output_check(request->body) && (!json_file || output_check(request->json));
}

static double now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Half a unit in the last place of the largest coordinate in single precision, in which the
 * importer stores positions. Its reader of numbers adds roundings of its own to text OBJ, STL and
 * OFF: up to 2.7 times this was seen. */
static double import_rounding(const shcd_mesh *mesh, double unit_m) {
    const double *coordinates = shcd_mesh_vertices(mesh);
    double largest = 0.0;
    for (size_t i = 0; i < 3 * shcd_mesh_vertex_count(mesh); i++) {
        largest = fmax(largest, fabs(coordinates[i]));
    }
    return fmax(0x1p-24 * largest, 0x1p-150 * unit_m);
}

static shcd_mesh *import_mesh(const fit_request *request, fit_result *result) {
    shcd_mesh *mesh =
        import_in_child(request->mesh, request->unit_m, &request->import, &result->mesh);
    if (mesh == NULL) {
        return NULL;
    }
    body_warn_size(result->mesh.diagonal_m);
    result->import_rounding_m = import_rounding(mesh, request->unit_m);
    fit_report_warn_rounding(result);
    return mesh;
}

static shcd_model *fit_mesh(const fit_request *request, const shcd_mesh *mesh, fit_result *result) {
    progress_line line;
    progress_begin(&line, !request->quiet);
    shcd_fit_options options = SHCD_FIT_OPTIONS_INIT;
    options.degree = request->degree;
    options.degree_max = request->degree_max;
    options.tolerance_m = request->tolerance_m;
    options.area_weight = request->area_weight;
    options.unit_m = request->unit_m;
    options.n_modes = request->n_modes;
    options.progress = progress_update;
    options.progress_user = &line;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = shcd_fit(mesh, &options, NULL, &model, &result->fit, &error);
    progress_end(&line);
    if (status != SHCD_OK) {
        report_failure("%s: %s", request->mesh, report_reason(status, &error));
        return NULL;
    }
    if (result->fit.modes_error.status != SHCD_OK && request->n_modes > 0) {
        report_failure("%s: %s", request->mesh, result->fit.modes_error.message);
        shcd_model_free(model);
        return NULL;
    }
    if (!body_describe(model, &result->model)) {
        shcd_model_free(model);
        return NULL;
    }
    result->modes = shcd_model_modes(model);
    return model;
}

/* Body and report appear together; what standard output could not take counts as a failure. */
static bool write_results(const fit_request *request, const shcd_model *model,
                          const fit_result *result) {
    const bool json_on_stdout = request->json != NULL && strcmp(request->json, "-") == 0;
    output_file json = {NULL, "", ""};
    if (request->json != NULL && !json_on_stdout) {
        if (!output_open(&json, request->json)) {
            return false;
        }
        fit_report_json(json.file, result);
        if (!output_finish(&json)) {
            return false;
        }
    }
    if (!body_save(model, request->body)) {
        output_abandon(&json);
        return false;
    }
    if (json_on_stdout) {
        fit_report_json(stdout, result);
    } else if (!request->quiet) {
        fit_report_text(stdout, result);
    }
    if (fflush(stdout) != 0) {
        report_failure("standard output: cannot write: %s", strerror(errno));
        output_abandon(&json);
        unlink(request->body);
        return false;
    }
    if (!output_publish(&json)) {
        unlink(request->body);
        return false;
    }
    return true;
}

int command_fit(int argc, char **argv) {
    fit_request request = {.unit_m = 1.0, .n_modes = -1};
    const int status = parse_request(argc, argv, &request);
    if (status >= 0) {
        return status;
    }
    if (!check_paths(&request)) {
        return STATUS_FAILED;
    }
    fit_result result = {.mesh_path = request.mesh,
                         .body_path = request.body,
                         .unit_m = request.unit_m,
                         .tolerance_m = request.tolerance_m,
                         .mesh = {.struct_size = sizeof result.mesh},
                         .fit = {.struct_size = sizeof result.fit}};
    const double start_s = now_s();
    shcd_mesh *mesh = import_mesh(&request, &result);
    if (mesh == NULL) {
        return STATUS_FAILED;
    }
    shcd_model *model = fit_mesh(&request, mesh, &result);
    shcd_mesh_free(mesh);
    if (model == NULL) {
        return STATUS_FAILED;
    }
    result.time_s = now_s() - start_s;
    const bool written = write_results(&request, model, &result);
    if (written) {
        fit_report_warnings(&result);
    }
    shcd_model_free(model);
    return written ? STATUS_DONE : STATUS_FAILED;
}
