/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd cost`: what every step of accuracy costs on this machine. Every output appears whole or not
 * at all. If one of the figures' files fails, those before it go, too; a plot that fails takes
 * nothing with it. */
#include "arguments.h"
#include "body.h"
#include "commands.h"
#include "cost_report.h"
#include "gnuplot.h"
#include "number.h"
#include "output.h"
#include "report.h"

#include <limits.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define STIFFNESS_N_PER_M 500.0
enum { POINTS_LEAST = 100, POINTS_MOST = 1000000 };

typedef struct cost_request {
    cost_settings settings;
    const char *json; /**< NULL: none; "-": instead of the text */
    const char *plot; /**< NULL: none */
    const char *body; /**< copy of the body with the table; NULL: none */
} cost_request;

/* False: reported. */
static bool take_option(void *user, int key, const char *value) {
    cost_request *request = user;
    cost_settings *settings = &request->settings;
    switch (key) {
    case OPTION_MESH:
        settings->mesh_path = value;
        return true;
    case OPTION_JSON:
        request->json = value;
        return true;
    case OPTION_PLOT:
        request->plot = value;
        return true;
    case OPTION_OUTPUT:
        request->body = value;
        return true;
    case OPTION_QUICK:
        settings->quick = true;
        return true;
    case OPTION_UNIT:
        if (!number_parse_unit(value, &settings->unit_m)) {
            report_usage("--unit %s: must be m, cm, mm, um, in or a positive number", value);
            return false;
        }
        return true;
    case OPTION_POINTS:
        if (!number_parse_integer(value, POINTS_LEAST, POINTS_MOST, &settings->n_points)) {
            report_usage("--points %s: must be %d to %d", value, POINTS_LEAST, POINTS_MOST);
            return false;
        }
        return true;
    case OPTION_SEED:
        if (!number_parse_integer(value, 0, INT_MAX, &settings->seed)) {
            report_usage("--seed %s: must be 0 to %d", value, INT_MAX);
            return false;
        }
        return true;
    default: /* OPTION_STIFFNESS */
        if (!number_parse(value, &settings->stiffness_n_per_m) ||
            !(settings->stiffness_n_per_m > 0.0)) {
            report_usage("--stiffness %s: must be a positive number", value);
            return false;
        }
        return true;
    }
}

/* Returns an exit status, or -1 if the command is to go on. */
static int parse_request(int argc, char **argv, cost_request *request) {
    arguments a;
    const int status = arguments_take(&a, argc, argv, take_option, request);
    if (status >= 0) {
        return status;
    }
    if (request->settings.unit_m > 0.0 && request->settings.mesh_path == NULL) {
        return report_usage("--unit has a meaning with --mesh only");
    }
    if (request->plot != NULL && gnuplot_format_of(request->plot) == GNUPLOT_UNKNOWN) {
        return report_usage("--plot %s: the name must end in .svg or .png", request->plot);
    }
    request->settings.body_path = arguments_operand(&a, "BODY.shcd");
    return request->settings.body_path != NULL ? -1 : STATUS_USAGE;
}

/* NULL unless it is the name of a file. */
static const char *json_file(const cost_request *request) {
    return request->json != NULL && strcmp(request->json, "-") != 0 ? request->json : NULL;
}

/* The table may go into the body that it is about; the other outputs are no bodies. */
static bool check_output(const cost_request *request, const char *path, bool is_body) {
    const cost_settings *settings = &request->settings;
    if ((!is_body && output_same(path, settings->body_path)) ||
        (settings->mesh_path != NULL && output_same(path, settings->mesh_path))) {
        report_failure("%s: the output would overwrite an input", path);
        return false;
    }
    return output_check(path);
}

/* Before a minute of work: are the outputs possible, and different from each other? */
static bool check_outputs(const cost_request *request) {
    const char *paths[3] = {request->body, json_file(request), request->plot};
    for (size_t i = 0; i < 3; i++) {
        for (size_t k = 0; paths[i] != NULL && k < i; k++) {
            if (paths[k] != NULL && output_same(paths[i], paths[k])) {
                report_failure("%s: two outputs cannot be one file", paths[i]);
                return false;
            }
        }
        if (paths[i] != NULL && !check_output(request, paths[i], i == 0)) {
            return false;
        }
    }
    return request->plot == NULL || gnuplot_check();
}

/* False: reported, and no file is left. */
static bool write_plot(const char *path, const cost_machine *machine, const cost_result *result) {
    output_file plot;
    if (!output_open(&plot, path)) {
        return false;
    }
    if (!cost_plot_draw(plot.file, gnuplot_format_of(path), machine, result)) {
        output_abandon(&plot);
        return false;
    }
    return output_finish(&plot) && output_publish(&plot);
}

/* False: reported, and no file is left. */
static bool write_json(const char *path, const cost_machine *machine, const cost_result *result) {
    output_file json;
    if (!output_open(&json, path)) {
        return false;
    }
    cost_report_json(json.file, machine, result);
    return output_finish(&json) && output_publish(&json);
}

/* False: reported, and neither file is left. The body comes last: the other can be taken back. */
static bool write_files(const cost_request *request, const shcd_model *model,
                        const cost_machine *machine, const cost_result *result) {
    if (request->json != NULL && !write_json(request->json, machine, result)) {
        return false;
    }
    if (request->body != NULL && !cost_save(request->body, model, machine, result)) {
        if (json_file(request) != NULL) {
            unlink(request->json);
        }
        return false;
    }
    return true;
}

/* Files first: what stands on standard output has its files beside it. A plot is only a view of
 * them: the figures, which took a minute, do not go where gnuplot fails; the status tells. */
static bool write_results(const cost_request *request, const shcd_model *model,
                          const cost_machine *machine, const cost_result *result) {
    if (!write_files(request, model, machine, result)) {
        return false;
    }
    const bool drawn = request->plot == NULL || write_plot(request->plot, machine, result);
    if (request->json == NULL || json_file(request) != NULL) {
        cost_report_text(stdout, machine, result);
    }
    return drawn;
}

static int run(const cost_request *request) {
    shcd_model *model = body_load(request->settings.body_path);
    cost_result *result = malloc(sizeof *result);
    if (model == NULL || result == NULL) {
        const int status = model == NULL ? STATUS_FAILED : report_failure("no memory");
        shcd_model_free(model);
        free(result);
        return status;
    }
    cost_machine machine;
    cost_machine_describe(&machine);
    bool good = cost_run(model, &request->settings, result);
    good = good && write_results(request, model, &machine, result);
    cost_result_free(result);
    free(result);
    shcd_model_free(model);
    return good ? STATUS_DONE : STATUS_FAILED;
}

int command_cost(int argc, char **argv) {
    cost_request request = {.settings = {.seed = 1, .stiffness_n_per_m = STIFFNESS_N_PER_M}};
    const int status = parse_request(argc, argv, &request);
    if (status >= 0) {
        return status;
    }
    return check_outputs(&request) ? run(&request) : STATUS_FAILED;
}
