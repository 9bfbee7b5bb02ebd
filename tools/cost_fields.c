/* SPDX-License-Identifier: BSD-3-Clause */
/* The fields that a body is compared with, from coarse to fine; each level costs about eight times
 * (grid) or three times (tree) the one before, so the first that takes too long ends its row. */
#include "cost_lineup.h"

#include "report.h"

#include "shcd/vec.h"

#include <stdio.h>

/* Cells along the longest side; the tolerance as a share of the diagonal. */
static const int grid_cells[COST_GRIDS_MAX] = {32, 64, 128};
static const int quick_grid_cells[2] = {16, 32};
static const double adf_tolerances[COST_ADFS_MAX] = {1e-2, 3e-3, 1e-3, 3e-4};
static const double quick_adf_tolerances[1] = {1e-2};

static shcd_status answer(double distance_m, shcd_vec3 gradient, shcd_proximity *out) {
    out->distance_m = distance_m;
    out->normal = shcd_unit(gradient);
    out->n_evaluations = 0;
    return SHCD_OK;
}

static shcd_status ask_grid(cost_contender *self, shcd_vec3 point, shcd_proximity *out) {
    double distance_m;
    shcd_vec3 gradient;
    cost_grid_query(self->subject, point, &distance_m, &gradient);
    return answer(distance_m, gradient, out);
}

static shcd_status ask_adf(cost_contender *self, shcd_vec3 point, shcd_proximity *out) {
    double distance_m;
    shcd_vec3 gradient;
    cost_adf_query(self->subject, point, &distance_m, &gradient);
    return answer(distance_m, gradient, out);
}

/* False: reported, since there is no memory. What took too long is noted. */
static bool is_built(enum cost_build result, const char *what, double time_s, bool *too_long,
                     cost_lineup *lineup) {
    if (result == COST_NO_MEMORY) {
        report_failure("%s: no memory", what);
        return false;
    }
    if (result == COST_TOO_LONG) {
        char why[96];
        snprintf(why, sizeof why, "left out, since building takes more than %.3g s", time_s);
        cost_lineup_note(lineup, what, why);
        *too_long = true;
    }
    return true;
}

/* False: reported. */
static bool add_grid(const cost_source *source, int cells, double time_s, bool *too_long,
                     cost_lineup *lineup) {
    cost_grid *grid = &lineup->grid[lineup->n_grids];
    const double start_s = cost_spent_s();
    const enum cost_build result = cost_grid_build(source, cells, grid);
    char what[64];
    snprintf(what, sizeof what, "grid of %d cells and finer ones", cells);
    if (result != COST_BUILT) {
        return is_built(result, what, time_s, too_long, lineup);
    }
    lineup->n_grids++;
    cost_contender *contender = cost_lineup_add(lineup);
    *contender = (cost_contender){.ask = ask_grid,
                                  .subject = grid,
                                  .row = {.degree = -1,
                                          .tier = "grid",
                                          .map_resolution = cells,
                                          .interpolation = "trilinear",
                                          .build_s = cost_spent_s() - start_s,
                                          .bytes = cost_grid_bytes(grid)}};
    return true;
}

/* False: reported. */
static bool add_adf(const cost_source *source, double share, double diagonal_m, double time_s,
                    bool *too_long, cost_lineup *lineup) {
    cost_adf *adf = &lineup->adf[lineup->n_adfs];
    const double start_s = cost_spent_s();
    const enum cost_build result = cost_adf_build(source, share * diagonal_m, adf);
    char what[64];
    snprintf(what, sizeof what, "ADF of %.3g %% and finer ones", 100.0 * share);
    if (result != COST_BUILT) {
        return is_built(result, what, time_s, too_long, lineup);
    }
    lineup->n_adfs++;
    cost_contender *contender = cost_lineup_add(lineup);
    *contender = (cost_contender){.ask = ask_adf,
                                  .subject = adf,
                                  .row = {.degree = -1,
                                          .tier = "adf",
                                          .interpolation = "trilinear",
                                          .field_tolerance_m = share * diagonal_m,
                                          .build_s = cost_spent_s() - start_s,
                                          .bytes = cost_adf_bytes(adf)}};
    return true;
}

bool cost_lineup_fields(const shcd_model_info *info, const cost_lineup_settings *settings,
                        cost_progress *progress, cost_lineup *lineup) {
    const int *cells = settings->quick ? quick_grid_cells : grid_cells;
    const double *shares = settings->quick ? quick_adf_tolerances : adf_tolerances;
    const size_t n_grids = settings->quick ? 2 : COST_GRIDS_MAX;
    const size_t n_adfs = settings->quick ? 1 : COST_ADFS_MAX;
    const double band_m = COST_NEAR_BAND * info->diagonal_m;
    const double time_s = settings->field_time_s;
    /* the box of the surface is one of samples: a little wider */
    const double margin_m = 1.1 * band_m;
    const shcd_vec3 margin = shcd_vec3_make(margin_m, margin_m, margin_m);
    cost_source source = {.model = lineup->full,
                          .low = shcd_sub(info->box_min_m, margin),
                          .high = shcd_add(info->box_max_m, margin),
                          .band_m = band_m,
                          .deadline_s = cost_spent_s() + 0.5 * time_s,
                          .progress = cost_progress_update,
                          .user = progress};
    bool too_long = false, good = true;
    cost_progress_stage(progress, "building octree fields");
    for (size_t i = 0; good && !too_long && i < n_adfs; i++) {
        good = add_adf(&source, shares[i], info->diagonal_m, 0.5 * time_s, &too_long, lineup);
    }
    cost_progress_stage(progress, "building grids");
    source.deadline_s = cost_spent_s() + 0.5 * time_s;
    too_long = false;
    for (size_t i = 0; good && !too_long && i < n_grids; i++) {
        good = add_grid(&source, cells[i], 0.5 * time_s, &too_long, lineup);
    }
    return good;
}
