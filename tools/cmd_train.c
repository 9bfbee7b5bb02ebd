/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd train`: gives a body a learned response. Every output appears whole or not at all, and the
 * body comes last, so that a failure leaves none of them. */
#include "arguments.h"
#include "body.h"
#include "body_learned.h"
#include "commands.h"
#include "gnuplot.h"
#include "number.h"
#include "output.h"
#include "progress.h"
#include "report.h"
#include "train_plot.h"
#include "train_table.h"

#include "shcd/fit.h"

#include <errno.h>
#include <limits.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { POINTS_LEAST = 8, POINTS_MOST = 20000 };

typedef struct train_request {
    const char *body;
    const char *output;
    const char *samples;         /**< NULL: the built-in membrane */
    const char *json;            /**< NULL: none; "-": instead of the text */
    const char *plot;            /**< NULL: none */
    const char *membrane_option; /**< the first one given that a table has no use for */
    shcd_train_options options;
    bool quiet;
} train_request;

/* False: reported. */
static bool take_length(const char *name, const char *value, double *to) {
    if (!number_parse_length(value, to)) {
        report_usage("--%s %s: is not a positive length", name, value);
        return false;
    }
    return true;
}

/* False: reported. */
static bool take_number(const char *name, const char *value, double high, double *to) {
    if (!number_parse(value, to) || !(*to > 0.0 && *to < high)) {
        report_usage("--%s %s: must be above 0 and below %g", name, value, high);
        return false;
    }
    return true;
}

/* The options of the membrane; false: reported. */
static bool take_membrane(train_request *request, int key, const char *value) {
    shcd_train_options *o = &request->options;
    switch (key) {
    case OPTION_YOUNG:
        request->membrane_option = "young";
        return take_number("young", value, 1e12, &o->young_pa);
    case OPTION_POISSON:
        request->membrane_option = "poisson";
        return take_number("poisson", value, 0.4999, &o->poisson_ratio);
    case OPTION_BETA:
        request->membrane_option = "beta";
        if (!number_parse(value, &o->stiffening) ||
            !(o->stiffening >= 0.0 && o->stiffening <= 1e4)) {
            report_usage("--beta %s: must be 0 to 10000", value);
            return false;
        }
        return true;
    case OPTION_PATCH:
        request->membrane_option = "patch";
        return take_length("patch", value, &o->patch_radius_m);
    case OPTION_SUPPORT:
        request->membrane_option = "support";
        return take_length("support", value, &o->support_length_m);
    case OPTION_DEPTH_MAX:
        request->membrane_option = "depth-max";
        return take_length("depth-max", value, &o->depth_max_m);
    default: /* OPTION_N_SAMPLES */
        request->membrane_option = "n-samples";
        int n = 0;
        if (!number_parse_integer(value, POINTS_LEAST, POINTS_MOST, &n)) {
            report_usage("--n-samples %s: must be %d to %d", value, POINTS_LEAST, POINTS_MOST);
            return false;
        }
        o->n_points = n;
        return true;
    }
}

/* False: reported. */
static bool take_option(void *user, int key, const char *value) {
    train_request *request = user;
    int seed = 0;
    switch (key) {
    case OPTION_OUTPUT:
        request->output = value;
        return true;
    case OPTION_SAMPLES:
        request->samples = value;
        return true;
    case OPTION_JSON:
        request->json = value;
        return true;
    case OPTION_PLOT:
        request->plot = value;
        return true;
    case OPTION_QUIET:
        request->quiet = true;
        return true;
    case OPTION_SEED:
        if (!number_parse_integer(value, 1, INT_MAX, &seed)) {
            report_usage("--seed %s: must be 1 to %d", value, INT_MAX);
            return false;
        }
        request->options.seed = seed;
        return true;
    default:
        return take_membrane(request, key, value);
    }
}

/* Returns an exit status, or -1 if the command is to go on. */
static int parse_request(int argc, char **argv, train_request *request) {
    arguments a;
    const int status = arguments_take(&a, argc, argv, take_option, request);
    if (status >= 0) {
        return status;
    }
    request->body = arguments_operand(&a, "BODY.shcd");
    if (request->body == NULL) {
        return STATUS_USAGE;
    }
    if (request->output == NULL || strcmp(request->output, "-") == 0) {
        return report_usage("-o OUT.shcd is missing");
    }
    if (request->samples != NULL && request->membrane_option != NULL) {
        return report_usage("--%s has no meaning with --samples", request->membrane_option);
    }
    if (request->plot != NULL && gnuplot_format_of(request->plot) == GNUPLOT_UNKNOWN) {
        return report_usage("--plot %s: the name must end in .svg or .png", request->plot);
    }
    return -1;
}

/* NULL unless it is the name of a file. */
static const char *json_file(const train_request *request) {
    return request->json != NULL && strcmp(request->json, "-") != 0 ? request->json : NULL;
}

/* Before a minute of work: are the outputs possible, and different from each other? The body may be
 * overwritten by its trained copy. */
static bool check_outputs(const train_request *request) {
    const char *paths[3] = {request->output, json_file(request), request->plot};
    for (size_t i = 0; i < 3; i++) {
        for (size_t k = 0; paths[i] != NULL && k < i; k++) {
            if (paths[k] != NULL && output_same(paths[i], paths[k])) {
                report_failure("%s: two outputs cannot be one file", paths[i]);
                return false;
            }
        }
        if (paths[i] == NULL) {
            continue;
        }
        if ((i > 0 && output_same(paths[i], request->body)) ||
            (request->samples != NULL && output_same(paths[i], request->samples))) {
            report_failure("%s: the output would overwrite an input", paths[i]);
            return false;
        }
        if (!output_check(paths[i])) {
            return false;
        }
    }
    return request->plot == NULL || gnuplot_check();
}

/* NULL: reported. */
static shcd_model *train(train_request *request, const shcd_model *model, train_checks *checks) {
    shcd_error error = {SHCD_OK, ""};
    shcd_model *trained = NULL;
    progress_line line;
    progress_begin(&line, !request->quiet);
    request->options.progress = progress_update;
    request->options.progress_user = &line;
    request->options.watch = train_checks_add;
    request->options.watch_user = checks;
    const shcd_status status = shcd_train(model, &request->options, NULL, &trained, &error);
    progress_end(&line);
    if (status != SHCD_OK) {
        report_failure("%s: %s", request->samples != NULL ? request->samples : request->body,
                       report_reason(status, &error));
        return NULL;
    }
    return trained;
}

/* False: reported, and no file is left. */
static bool write_plot(const train_request *request, const shcd_learned *learned,
                       const train_checks *checks) {
    output_file plot;
    if (!output_open(&plot, request->plot)) {
        return false;
    }
    if (!train_plot_draw(plot.file, gnuplot_format_of(request->plot), request->body, learned,
                         checks)) {
        output_abandon(&plot);
        return false;
    }
    return output_finish(&plot) && output_publish(&plot);
}

/* False: reported, and no file is left. */
static bool write_json(const train_request *request, const shcd_learned *learned) {
    output_file file;
    json_writer json;
    if (!output_open(&file, request->json)) {
        return false;
    }
    json_begin(&json, file.file);
    json_string(&json, "body", request->body);
    body_write_learned(&json, learned);
    json_end(&json);
    return output_finish(&file) && output_publish(&file);
}

static bool write_results(const train_request *request, const shcd_model *trained,
                          const train_checks *checks) {
    const shcd_learned *learned = shcd_model_learned(trained);
    if (request->plot != NULL && !write_plot(request, learned, checks)) {
        return false;
    }
    const bool json_good = request->json == NULL || write_json(request, learned);
    if (!json_good || !body_save(trained, request->output)) {
        if (request->plot != NULL) {
            unlink(request->plot);
        }
        if (json_good && json_file(request) != NULL) {
            unlink(request->json);
        }
        return false;
    }
    if (!request->quiet && (request->json == NULL || json_file(request) != NULL)) {
        body_print_learned(stdout, learned);
    }
    return true;
}

static bool run(train_request *request, const shcd_model *model) {
    shcd_model_info info;
    train_table table = {NULL, 0, false, false};
    train_checks checks = {NULL, 0, 0, false};
    bool good = body_describe(model, &info);
    if (good && request->samples != NULL) {
        good = train_table_read(&table, request->samples, model, info.diagonal_m);
        request->options.samples = table.sample;
        request->options.n_samples = table.n;
        request->options.has_energy = table.has_energy;
        request->options.has_speed = table.has_speed;
    }
    shcd_model *trained = good ? train(request, model, &checks) : NULL;
    good = trained != NULL && write_results(request, trained, &checks);
    shcd_model_free(trained);
    free(checks.check);
    free(table.sample);
    return good;
}

int command_train(int argc, char **argv) {
    train_request request = {.options = SHCD_TRAIN_OPTIONS_INIT};
    const int status = parse_request(argc, argv, &request);
    if (status >= 0) {
        return status;
    }
    shcd_model *model = check_outputs(&request) ? body_load(request.body) : NULL;
    const bool good = model != NULL && run(&request, model);
    shcd_model_free(model);
    return good ? STATUS_DONE : STATUS_FAILED;
}
