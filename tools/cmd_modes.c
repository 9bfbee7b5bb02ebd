/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd modes`: computes the modes of a body's surface anew; all else that the body carries stays.
 */
#include "arguments.h"
#include "body.h"
#include "body_modes.h"
#include "commands.h"
#include "number.h"
#include "output.h"
#include "progress.h"
#include "report.h"

#include "shcd/fit.h"

#include <stddef.h>
#include <string.h>

#define NUMBERS_MAX 5 /* of an anchor */

typedef struct modes_request {
    const char *body;
    const char *output;
    int n_modes; /**< 0: none; -1: the default */
    size_t n_anchors;
    shcd_anchor anchors[SHCD_ANCHORS_MAX];
    bool quiet;
} modes_request;

/* Numbers separated by commas; 0 if one of them is none, or if there are too many. */
static size_t parse_numbers(const char *text, double numbers[NUMBERS_MAX]) {
    for (size_t n = 0; n < NUMBERS_MAX; n++) {
        char one[64];
        const size_t length = strcspn(text, ",");
        if (length >= sizeof one) {
            return 0;
        }
        memcpy(one, text, length);
        one[length] = '\0';
        if (!number_parse(one, &numbers[n])) {
            return 0;
        }
        if (text[length] == '\0') {
            return n + 1;
        }
        text += length + 1;
    }
    return 0;
}

/* False: reported. */
static bool take_anchor(modes_request *request, const char *value) {
    double number[NUMBERS_MAX];
    const size_t n = parse_numbers(value, number);
    if (n < 4 || !(number[3] > 0.0) || (n == 5 && !(number[4] > 0.0))) {
        report_usage("--anchor %s: must be x,y,z,radius or x,y,z,radius,alpha, the last two "
                     "positive",
                     value);
        return false;
    }
    if (request->n_anchors == SHCD_ANCHORS_MAX) {
        report_usage("more than %d times --anchor", SHCD_ANCHORS_MAX);
        return false;
    }
    request->anchors[request->n_anchors++] =
        (shcd_anchor){{number[0], number[1], number[2]}, number[3], n == 5 ? number[4] : 0.0};
    return true;
}

/* False: reported. */
static bool take_option(modes_request *request, int key, const char *value) {
    switch (key) {
    case OPTION_OUTPUT:
        request->output = value;
        return true;
    case OPTION_QUIET:
        request->quiet = true;
        return true;
    case OPTION_MODES:
        if (!number_parse_integer(value, 0, SHCD_MODES_MAX, &request->n_modes)) {
            report_usage("--modes %s: must be 0 to %d", value, SHCD_MODES_MAX);
            return false;
        }
        return true;
    default: /* OPTION_ANCHOR */
        return take_anchor(request, value);
    }
}

/* Returns an exit status, or -1 if the command is to go on. */
static int parse_request(int argc, char **argv, modes_request *request) {
    arguments a;
    int key;
    arguments_begin(&a, argc, argv);
    while ((key = arguments_next(&a)) > 0) {
        if (!take_option(request, key, a.value)) {
            return STATUS_USAGE;
        }
    }
    if (key != ARGUMENTS_END) {
        return arguments_status(key);
    }
    request->body = arguments_operand(&a, "BODY.shcd");
    if (request->body == NULL) {
        return STATUS_USAGE;
    }
    if (request->output == NULL || strcmp(request->output, "-") == 0) {
        return report_usage("-o OUT.shcd is missing");
    }
    if (request->n_modes == 0 && request->n_anchors > 0) {
        return report_usage("--modes 0 leaves no modes to be anchored");
    }
    return -1;
}

/* False: reported. */
static bool compute(const modes_request *request, const shcd_model *model, shcd_modes **modes) {
    shcd_modes_options options = SHCD_MODES_OPTIONS_INIT;
    shcd_error error = {SHCD_OK, ""};
    progress_line line;
    progress_begin(&line, !request->quiet);
    options.n_modes = request->n_modes > 0 ? request->n_modes : 0;
    options.anchors = request->anchors;
    options.n_anchors = request->n_anchors;
    options.progress = progress_update;
    options.progress_user = &line;
    const shcd_status status = shcd_fit_modes(model, &options, modes, &error);
    progress_end(&line);
    if (status != SHCD_OK) {
        report_failure("%s: %s", request->body, report_reason(status, &error));
    }
    return status == SHCD_OK;
}

/* The dents of a learned response are in terms of the modes that it was trained with. */
static bool save_copy(const modes_request *request, const shcd_model *model,
                      const shcd_modes *modes) {
    shcd_model_info info;
    shcd_model_def definition = SHCD_MODEL_DEF_INIT;
    if (!body_definition(model, &info, &definition)) {
        return false;
    }
    if (definition.learned != NULL) {
        report_warning("%s: the learned response belongs to the old modes and is left out",
                       request->output);
        definition.learned = NULL;
    }
    definition.modes = modes;
    shcd_model *copy = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = shcd_model_create(&definition, NULL, &copy, &error);
    if (status != SHCD_OK) {
        report_failure("%s: %s", request->output, report_reason(status, &error));
        return false;
    }
    const bool saved = body_save(copy, request->output);
    shcd_model_free(copy);
    return saved;
}

int command_modes(int argc, char **argv) {
    modes_request request = {.n_modes = -1};
    const int status = parse_request(argc, argv, &request);
    if (status >= 0) {
        return status;
    }
    if (!output_check(request.output)) {
        return STATUS_FAILED;
    }
    shcd_model *model = body_load(request.body);
    if (model == NULL) {
        return STATUS_FAILED;
    }
    shcd_modes *modes = NULL;
    bool good = request.n_modes == 0 || compute(&request, model, &modes);
    good = good && save_copy(&request, model, modes);
    if (good && !request.quiet) {
        body_print_modes(stdout, modes);
    }
    shcd_modes_free(modes);
    shcd_model_free(model);
    return good ? STATUS_DONE : STATUS_FAILED;
}
