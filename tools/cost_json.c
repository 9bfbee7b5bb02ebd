/* SPDX-License-Identifier: BSD-3-Clause */
/* The names are an interface: docs/cost.md lists them, scenes read the rows. */
#include "cost_report.h"

#include "body.h"

#include <stddef.h>

#define SCHEMA 1

/* error -> error_max_m, error_p99_m, error_rms_m */
static void write_spread(json_writer *json, const char *name, const char *unit,
                         const cost_spread *spread) {
    char key[64];
    snprintf(key, sizeof key, "%s_max_%s", name, unit);
    json_number(json, key, spread->max);
    snprintf(key, sizeof key, "%s_p99_%s", name, unit);
    json_number(json, key, spread->p99);
    snprintf(key, sizeof key, "%s_rms_%s", name, unit);
    json_number(json, key, spread->rms);
}

static void write_machine(json_writer *json, const cost_machine *machine, const cost_clock *clock) {
    const uint32_t version = shcd_version();
    char text[32];
    json_open_object(json, "machine");
    json_string(json, "cpu", machine->cpu);
    json_string(json, "architecture", machine->architecture);
    json_string(json, "system", machine->system);
    json_integer(json, "n_processors", machine->n_processors);
    json_number(json, "load", machine->load);
    json_string(json, "clock", clock->uses_counter ? "time-stamp counter" : "CLOCK_MONOTONIC");
    json_number(json, "clock_resolution_ns", clock->resolution_ns);
    json_number(json, "clock_overhead_ns", clock->ns_per_tick * clock->overhead_ticks);
    snprintf(text, sizeof text, "%u.%u.%u", (unsigned)(version / 10000u),
             (unsigned)(version / 100u % 100u), (unsigned)(version % 100u));
    json_string(json, "library_version", text);
    json_close_object(json);
}

static void write_settings(json_writer *json, const cost_result *result) {
    const cost_settings *settings = result->settings;
    const double diagonal_m = result->info.diagonal_m;
    json_open_object(json, "settings");
    json_bool(json, "quick", settings->quick);
    json_integer(json, "seed", settings->seed);
    json_integer(json, "rounds", COST_ROUNDS);
    json_count(json, "n_random_points", result->n_points);
    json_count(json, "n_path_points", result->n_points);
    json_count(json, "n_contact_points", result->n_contact);
    json_count(json, "n_unknown_points", result->n_unknown);
    json_count(json, "n_surface_points", result->n_surface_points);
    json_number(json, "contact_band_m", COST_CONTACT_BAND * diagonal_m);
    json_number(json, "near_band_m", COST_NEAR_BAND * diagonal_m);
    json_number(json, "path_step_m", COST_PATH_STEP * diagonal_m);
    json_number(json, "stiffness_n_per_m", settings->stiffness_n_per_m);
    json_number(json, "truth_tolerance_m", result->tolerance_m);
    json_close_object(json);
}

static void write_mesh(json_writer *json, const cost_result *result) {
    if (result->settings->mesh_path == NULL) {
        json_null(json, "mesh");
        return;
    }
    json_open_object(json, "mesh");
    json_string(json, "file", result->settings->mesh_path);
    json_number(json, "unit_m", result->unit_m);
    json_number(json, "diagonal_m", result->mesh_diagonal_m);
    json_close_object(json);
}

static void write_surface(json_writer *json, const cost_result *result, size_t i) {
    const cost_surface *surface = &result->surface[i];
    json_open_object(json, NULL);
    json_integer(json, "degree", surface->degree);
    write_spread(json, "position", "m", &surface->position_m);
    json_number(json, "enclosure_offset_m", surface->enclosure_offset_m);
    if (result->settings->mesh_path != NULL) {
        write_spread(json, "mesh_position", "m", &surface->mesh_position_m);
    }
    json_close_object(json);
}

static void write_cost(json_writer *json, const cost_row *row, bool has_mesh) {
    write_spread(json, "error", "m", &row->error_m);
    write_spread(json, "near_error", "m", &row->near_error_m);
    write_spread(json, "normal", "rad", &row->normal_rad);
    write_spread(json, "near_normal", "rad", &row->near_normal_rad);
    write_spread(json, "force_error", "n", &row->force_error_n);
    if (has_mesh) {
        write_spread(json, "mesh_error", "m", &row->mesh_error_m);
    }
    json_number(json, "ns_p50", row->ns_p50);
    json_number(json, "ns_p99", row->ns_p99);
    json_number(json, "path_ns_p50", row->path_ns_p50);
    json_number(json, "path_ns_p99", row->path_ns_p99);
    json_count(json, "bytes", row->bytes);
}

static void write_fronts(json_writer *json, const cost_row *row) {
    json_bool(json, "on_time_front", row->on_time_front);
    json_bool(json, "on_bytes_front", row->on_bytes_front);
    json_close_object(json);
}

static void write_row(json_writer *json, const cost_row *row, bool has_mesh) {
    const bool is_map = row->map_resolution > 0;
    json_open_object(json, NULL);
    json_integer(json, "degree", row->degree);
    json_string(json, "tier", row->tier);
    if (is_map) {
        json_integer(json, "map_resolution", row->map_resolution);
        json_string(json, "interpolation", row->interpolation);
        json_count(json, "map_bytes", row->map_bytes);
        json_number(json, "map_build_s", row->build_s);
        json_number(json, "map_radius_error_max_m", row->radius_error_max_m);
        json_number(json, "map_radius_error_rms_m", row->radius_error_rms_m);
    } else {
        json_null(json, "map_resolution");
        json_null(json, "interpolation");
    }
    write_cost(json, row, has_mesh);
    json_number(json, "evaluations_mean", row->evaluations_mean);
    json_number(json, "evaluations_p99", row->evaluations_p99);
    json_number(json, "patches_mean", row->patches_mean);
    json_number(json, "path_evaluations_mean", row->path_evaluations_mean);
    write_fronts(json, row);
}

static void write_field(json_writer *json, const cost_row *row, bool has_mesh) {
    json_open_object(json, NULL);
    json_string(json, "field", row->tier);
    if (row->map_resolution > 0) {
        json_integer(json, "cells", row->map_resolution);
        json_null(json, "tolerance_m");
    } else {
        json_null(json, "cells");
        json_number(json, "tolerance_m", row->field_tolerance_m);
    }
    json_string(json, "interpolation", row->interpolation);
    json_number(json, "build_s", row->build_s);
    write_cost(json, row, has_mesh);
    write_fronts(json, row);
}

void cost_report_json(FILE *file, const cost_machine *machine, const cost_result *result) {
    const cost_lineup *lineup = &result->lineup;
    const bool has_mesh = result->settings->mesh_path != NULL;
    json_writer json;
    json_begin(&json, file);
    json_integer(&json, "schema", SCHEMA);
    json_string(&json, "body_file", result->settings->body_path);
    json_number(&json, "time_s", result->time_s);
    write_machine(&json, machine, &result->clock);
    write_settings(&json, result);
    write_mesh(&json, result);
    json_open_object(&json, "model");
    body_write_json(&json, &result->info);
    json_close_object(&json);
    json_open_array(&json, "surfaces");
    for (size_t i = 0; i < result->n_surfaces; i++) {
        write_surface(&json, result, i);
    }
    json_close_array(&json);
    json_open_array(&json, "rows");
    for (size_t i = 0; i < lineup->n_contenders; i++) {
        if (lineup->contender[i].row.degree >= 0) {
            write_row(&json, &lineup->contender[i].row, has_mesh);
        }
    }
    json_close_array(&json);
    json_open_array(&json, "fields");
    for (size_t i = 0; i < lineup->n_contenders; i++) {
        if (lineup->contender[i].row.degree < 0) {
            write_field(&json, &lineup->contender[i].row, has_mesh);
        }
    }
    json_close_array(&json);
    json_open_array(&json, "left_out");
    for (size_t i = 0; i < lineup->n_notes; i++) {
        json_string(&json, NULL, lineup->note[i]);
    }
    json_close_array(&json);
    json_end(&json);
}
