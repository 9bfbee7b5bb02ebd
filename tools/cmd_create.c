/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd create`: a body from a table of coefficients. */
#include "arguments.h"
#include "body.h"
#include "coefficient_table.h"
#include "commands.h"
#include "number.h"
#include "output.h"
#include "report.h"

#include <errno.h>
#include <stddef.h>
#include <string.h>

typedef struct create_request {
    const char *table;
    const char *body;
    double unit_m;
} create_request;

/* Returns an exit status, or -1 if the command is to go on. */
static int parse_request(int argc, char **argv, create_request *request) {
    arguments a;
    int key;
    arguments_begin(&a, argc, argv);
    while ((key = arguments_next(&a)) > 0) {
        if (key == OPTION_OUTPUT) {
            request->body = a.value;
        } else if (!number_parse_unit(a.value, &request->unit_m)) {
            return report_usage("--unit %s: must be m, cm, mm, um, in or a positive number",
                                a.value);
        }
    }
    if (key != ARGUMENTS_END) {
        return arguments_status(key);
    }
    request->table = arguments_operand(&a, "COEFFICIENTS.csv");
    if (request->table == NULL) {
        return STATUS_USAGE;
    }
    if (request->body == NULL || strcmp(request->body, "-") == 0) {
        return report_usage("-o BODY.shcd is missing");
    }
    return -1;
}

static bool read_table(const char *path, coefficient_table *table) {
    if (strcmp(path, "-") == 0) {
        return coefficient_table_read(stdin, "stdin", table);
    }
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        report_failure("%s: cannot open: %s", path, strerror(errno));
        return false;
    }
    const bool good = coefficient_table_read(file, path, table);
    fclose(file);
    return good;
}

static bool make_body(const create_request *request, const coefficient_table *table) {
    shcd_model_def definition = SHCD_MODEL_DEF_INIT;
    definition.degree = table->degree;
    definition.coefficients = table->coefficients;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = shcd_model_create(&definition, NULL, &model, &error);
    if (status != SHCD_OK) {
        report_failure("%s: %s", request->table, report_reason(status, &error));
        return false;
    }
    shcd_model_info info;
    const bool good = body_describe(model, &info) && body_save(model, request->body);
    shcd_model_free(model);
    if (good) {
        body_warn_size(info.diagonal_m);
        body_warn_embedding(&info);
    }
    return good;
}

int command_create(int argc, char **argv) {
    create_request request = {NULL, NULL, 1.0};
    const int status = parse_request(argc, argv, &request);
    if (status >= 0) {
        return status;
    }
    if (output_same(request.table, request.body)) {
        return report_failure("%s: the output would overwrite the input", request.body);
    }
    coefficient_table table;
    if (!output_check(request.body) || !read_table(request.table, &table)) {
        return STATUS_FAILED;
    }
    for (size_t i = 0; i < 3 * SHCD_COUNT(table.degree); i++) {
        table.coefficients[i] *= request.unit_m;
    }
    const bool made = make_body(&request, &table);
    coefficient_table_free(&table);
    return made ? STATUS_DONE : STATUS_FAILED;
}
