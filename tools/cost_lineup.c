/* SPDX-License-Identifier: BSD-3-Clause */
/* A model of a lower degree is made from the first coefficients of the whole: they are stored
 * degree by degree. */
#include "cost_lineup.h"

#include "report.h"

#include "shcd/vec.h"

#include <stdio.h>
#include <string.h>

static const int degrees[] = {3, 5, 8, 10, 12, 15, 20, 30, 50};
static const int quick_degrees[] = {3, 5};

void cost_lineup_note(cost_lineup *lineup, const char *what, const char *why) {
    if (lineup->n_notes < COST_NOTES_MAX) {
        snprintf(lineup->note[lineup->n_notes++], sizeof lineup->note[0], "%s: %s", what, why);
    }
}

cost_contender *cost_lineup_add(cost_lineup *lineup) {
    return &lineup->contender[lineup->n_contenders++];
}

/* NULL: left out, with a note. */
static shcd_model *make_truncated(const shcd_model *full, int degree, cost_lineup *lineup) {
    shcd_model_def definition = SHCD_MODEL_DEF_INIT;
    definition.degree = degree;
    definition.coefficients = shcd_model_coefficients(full);
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = shcd_model_create(&definition, NULL, &model, &error);
    if (status != SHCD_OK) {
        char what[32];
        snprintf(what, sizeof what, "degree %d", degree);
        cost_lineup_note(lineup, what, report_reason(status, &error));
    }
    return model;
}

static void make_models(const shcd_model *full, const cost_lineup_settings *settings,
                        cost_progress *progress, cost_lineup *lineup) {
    const int *list = settings->quick ? quick_degrees : degrees;
    const size_t n = settings->quick ? sizeof quick_degrees / sizeof quick_degrees[0]
                                     : sizeof degrees / sizeof degrees[0];
    cost_progress_stage(progress, "making lower degrees");
    for (size_t i = 0; i < n && list[i] < shcd_model_degree(full); i++) {
        shcd_model *model = make_truncated(full, list[i], lineup);
        if (model != NULL) {
            lineup->model[lineup->n_models++] = model;
        }
        cost_progress_update((double)(i + 1) / (double)n, progress);
    }
}

/* The whole body stands at the end of the list, but is not owned. */
static const shcd_model *model_at(const cost_lineup *lineup, size_t i) {
    return i < lineup->n_models ? lineup->model[i] : lineup->full;
}

static shcd_status ask_map(cost_contender *self, shcd_vec3 point, shcd_proximity *out) {
    return shcd_map_query(self->subject, point, self->options.map_hermite, out);
}

static void add_look_up(const shcd_model *model, const shcd_map *map, const shcd_map_info *info,
                        double build_s, int interpolation, cost_lineup *lineup) {
    const bool hermite = interpolation == SHCD_MAP_HERMITE;
    cost_contender *contender = cost_lineup_add(lineup);
    *contender = (cost_contender){.ask = ask_map,
                                  .subject = map,
                                  .options = SHCD_QUERY_OPTIONS_INIT,
                                  .row = {.degree = shcd_model_degree(model),
                                          .tier = "map",
                                          .map_resolution = info->resolution,
                                          .interpolation = hermite ? "hermite" : "linear",
                                          .build_s = build_s,
                                          .map_bytes = info->bytes}};
    contender->options.map_hermite = interpolation;
    contender->row.radius_error_max_m =
        hermite ? info->hermite_error_max_m : info->linear_error_max_m;
    contender->row.radius_error_rms_m =
        hermite ? info->hermite_error_rms_m : info->linear_error_rms_m;
}

/* NULL: reported. Bounds would not change an answer, only what is proven about it. */
static shcd_map *make_map(const shcd_model *model, int resolution, shcd_map_info *info,
                          cost_lineup *lineup) {
    shcd_map_options options = SHCD_MAP_OPTIONS_INIT;
    shcd_map *map = NULL;
    shcd_error error = {SHCD_OK, ""};
    options.resolution = resolution;
    options.without_bounds = 1;
    *info = (shcd_map_info){.struct_size = sizeof *info};
    shcd_status status = shcd_map_create(model, &options, NULL, &map, &error);
    if (status == SHCD_OK) {
        lineup->map[lineup->n_maps++] = map;
        status = shcd_map_describe(map, info);
    }
    if (status != SHCD_OK) {
        report_failure("a map of degree %d: %s", shcd_model_degree(model),
                       report_reason(status, &error));
        return NULL;
    }
    return map;
}

/* Resolutions in rising order, the model's own among them. Returns how many. */
static size_t list_resolutions(int own, bool quick, int list[5]) {
    static const int usual[] = {8, 16, 32, 64};
    size_t n = 0;
    bool has_own = false;
    for (size_t i = 0; i < (quick ? 1 : sizeof usual / sizeof usual[0]); i++) {
        if (!has_own && own < usual[i]) {
            list[n++] = own;
        }
        has_own = has_own || own <= usual[i];
        list[n++] = usual[i];
    }
    if (!has_own) {
        list[n++] = own;
    }
    return n;
}

static bool add_maps(const shcd_model *model, const shcd_model_info *model_info, bool quick,
                     cost_lineup *lineup) {
    int list[5];
    const size_t n = list_resolutions(model_info->map_resolution, quick, list);
    const size_t first = lineup->n_contenders;
    uint64_t own_bytes = 0;
    for (size_t i = 0; i < n; i++) {
        shcd_map_info info;
        const double start_s = cost_spent_s();
        const shcd_map *map = make_map(model, list[i], &info, lineup);
        if (map == NULL) {
            return false;
        }
        const double build_s = cost_spent_s() - start_s;
        add_look_up(model, map, &info, build_s, SHCD_MAP_LINEAR, lineup);
        add_look_up(model, map, &info, build_s, SHCD_MAP_HERMITE, lineup);
        own_bytes = list[i] == model_info->map_resolution ? info.bytes : own_bytes;
    }
    for (size_t i = first; i < lineup->n_contenders; i++) {
        cost_row *row = &lineup->contender[i].row;
        row->bytes = model_info->run_time_bytes - own_bytes + row->map_bytes;
    }
    return true;
}

static bool add_model(const shcd_model *model, bool with_maps, bool quick, cost_lineup *lineup) {
    static const char *const tiers[] = {"exact", "fast", "track"};
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    const shcd_status status = shcd_model_describe(model, &info);
    if (status != SHCD_OK) {
        report_failure("%s", shcd_status_string(status));
        return false;
    }
    for (size_t i = 0; i < sizeof tiers / sizeof tiers[0]; i++) {
        cost_contender *contender = cost_lineup_add(lineup);
        cost_contender_model(model, tiers[i], contender);
        contender->row.bytes = info.run_time_bytes;
    }
    return !with_maps || add_maps(model, &info, quick, lineup);
}

bool cost_lineup_bodies(const shcd_model *full, const cost_lineup_settings *settings,
                        cost_progress *progress, cost_lineup *lineup) {
    memset(lineup, 0, sizeof *lineup);
    lineup->full = full;
    make_models(full, settings, progress, lineup);
    cost_progress_stage(progress, "making distance maps");
    bool good = true;
    for (size_t i = 0; good && i <= lineup->n_models; i++) {
        const shcd_model *model = model_at(lineup, i);
        const int degree = shcd_model_degree(model);
        const bool with_maps = model == full || (!settings->quick && (degree == 5 || degree == 10));
        good = add_model(model, with_maps, settings->quick, lineup);
        cost_progress_update((double)(i + 1) / (double)(lineup->n_models + 1), progress);
    }
    return good;
}

void cost_lineup_free(cost_lineup *lineup) {
    for (size_t i = 0; i < lineup->n_contenders; i++) {
        cost_contender_release(&lineup->contender[i]);
    }
    for (size_t i = 0; i < lineup->n_maps; i++) {
        shcd_map_free(lineup->map[i]);
    }
    for (size_t i = 0; i < lineup->n_models; i++) {
        shcd_model_free(lineup->model[i]);
    }
    for (size_t i = 0; i < lineup->n_grids; i++) {
        cost_grid_free(&lineup->grid[i]);
    }
    for (size_t i = 0; i < lineup->n_adfs; i++) {
        cost_adf_free(&lineup->adf[i]);
    }
    memset(lineup, 0, sizeof *lineup);
}
