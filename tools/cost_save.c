/* SPDX-License-Identifier: BSD-3-Clause */
/* The table as part of the body, where scenes that state an accuracy find it. Fields are not
 * something that a scene could choose, and stay out. */
#include "cost_report.h"

#include "body.h"
#include "report.h"

#include <stddef.h>
#include <string.h>

static int tier_of(const char *name) {
    return strcmp(name, "fast") == 0    ? SHCD_TIER_FAST
           : strcmp(name, "track") == 0 ? SHCD_TIER_TRACK
           : strcmp(name, "map") == 0   ? SHCD_TIER_MAP
                                        : SHCD_TIER_EXACT;
}

/* An error that the truth does not resolve is stored as its tolerance: the row must not promise
 * more. */
static double at_least(double value, double least) {
    return value > least ? value : least;
}

static shcd_cost_row stored_row(const cost_row *row, double tolerance_m) {
    return (shcd_cost_row){
        .degree = row->degree,
        .tier = tier_of(row->tier),
        .map_resolution = row->map_resolution,
        .interpolation = row->interpolation != NULL && strcmp(row->interpolation, "hermite") == 0
                             ? SHCD_MAP_HERMITE
                             : SHCD_MAP_LINEAR,
        .error_max_m = at_least(row->error_m.max, tolerance_m),
        .error_p99_m = at_least(row->error_m.p99, tolerance_m),
        .error_rms_m = at_least(row->error_m.rms, tolerance_m),
        .normal_p99_rad = row->normal_rad.p99,
        .ns_p50 = row->ns_p50,
        .ns_p99 = row->ns_p99,
        .path_ns_p50 = row->path_ns_p50,
        .path_ns_p99 = row->path_ns_p99,
        .evaluations_mean = row->evaluations_mean,
        .patches_mean = row->patches_mean,
        .bytes = row->bytes,
    };
}

/* What the library takes: printable ASCII, cut off where the room ends. */
static void machine_name(const cost_machine *machine, char name[SHCD_COST_MACHINE_SIZE]) {
    snprintf(name, SHCD_COST_MACHINE_SIZE, "%.*s", SHCD_COST_MACHINE_SIZE - 1, machine->cpu);
    for (char *c = name; *c != '\0'; c++) {
        *c = *c >= ' ' && *c <= '~' ? *c : '?';
    }
}

bool cost_save(const char *path, const shcd_model *model, const cost_machine *machine,
               const cost_result *result) {
    shcd_cost_row rows[COST_CONTENDERS_MAX];
    char name[SHCD_COST_MACHINE_SIZE];
    shcd_model_info info;
    shcd_model_def definition = SHCD_MODEL_DEF_INIT;
    if (!body_definition(model, &info, &definition)) {
        return false;
    }
    machine_name(machine, name);
    definition.cost_rows = rows;
    definition.n_cost_rows = 0;
    definition.cost_machine = name;
    for (size_t i = 0; i < result->lineup.n_contenders; i++) {
        const cost_row *row = &result->lineup.contender[i].row;
        if (row->degree >= 1) {
            rows[definition.n_cost_rows++] = stored_row(row, result->tolerance_m);
        }
    }
    shcd_model *copy = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = shcd_model_create(&definition, NULL, &copy, &error);
    if (status != SHCD_OK) {
        report_failure("%s: %s", path, report_reason(status, &error));
        return false;
    }
    const bool saved = body_save(copy, path);
    shcd_model_free(copy);
    return saved;
}
