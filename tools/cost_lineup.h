/* SPDX-License-Identifier: BSD-3-Clause */
/* Everything that is measured: the body at several degrees in several tiers, distance maps of
 * several resolutions, and fields of its exact distance. */
#ifndef SHCD_TOOLS_COST_LINEUP_H
#define SHCD_TOOLS_COST_LINEUP_H

#include "cost_adf.h"
#include "cost_grid.h"
#include "cost_progress.h"
#include "cost_row.h"

#include "shcd/map.h"

enum {
    COST_DEGREES_MAX = 12,
    COST_MAPS_MAX = 3 * 5, /* three degrees, five resolutions */
    COST_GRIDS_MAX = 3,
    COST_ADFS_MAX = 4,
    COST_CONTENDERS_MAX = 3 * COST_DEGREES_MAX + 2 * COST_MAPS_MAX + COST_GRIDS_MAX + COST_ADFS_MAX,
    COST_NOTES_MAX = COST_DEGREES_MAX + COST_MAPS_MAX + COST_GRIDS_MAX + COST_ADFS_MAX
};

typedef struct cost_lineup {
    size_t n_models, n_maps, n_grids, n_adfs, n_contenders, n_notes;
    const shcd_model *full; /**< borrowed; not among the models */
    shcd_model *model[COST_DEGREES_MAX];
    shcd_map *map[COST_MAPS_MAX];
    cost_grid grid[COST_GRIDS_MAX];
    cost_adf adf[COST_ADFS_MAX];
    cost_contender contender[COST_CONTENDERS_MAX]; /**< the body's rows, then the fields */
    char note[COST_NOTES_MAX][160];                /**< what was left out, and why */
} cost_lineup;

typedef struct cost_lineup_settings {
    bool quick;
    double field_time_s; /**< for building all fields together */
} cost_lineup_settings;

/** Models of lower degrees, and the contenders of models and maps. `lineup` is zeroed by the call.
 *  False: reported. */
bool cost_lineup_bodies(const shcd_model *full, const cost_lineup_settings *settings,
                        cost_progress *progress, cost_lineup *lineup);

/** The fields; what would take too long is left out with a note. False: reported. */
bool cost_lineup_fields(const shcd_model_info *info, const cost_lineup_settings *settings,
                        cost_progress *progress, cost_lineup *lineup);

/** For both: what was left out, and why. */
void cost_lineup_note(cost_lineup *lineup, const char *what, const char *why);
/** For both: the next contender, to be filled in. */
cost_contender *cost_lineup_add(cost_lineup *lineup);

void cost_lineup_free(cost_lineup *lineup);

#endif
