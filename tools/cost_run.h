/* SPDX-License-Identifier: BSD-3-Clause */
/* The whole measurement of one body. */
#ifndef SHCD_TOOLS_COST_RUN_H
#define SHCD_TOOLS_COST_RUN_H

#include "cost_lineup.h"
#include "cost_mesh.h"

typedef struct cost_settings {
    const char *body_path;
    const char *mesh_path; /**< NULL: none */
    double unit_m;         /**< of the mesh; 0: what the body was fitted with, else 1 */
    int n_points;          /**< of each set; 0: as many as the time allows */
    int seed;
    double stiffness_n_per_m;
    bool quick;
} cost_settings;

/** How far the series cut off at a degree lies from the whole surface: distances of points of
 *  either to the other, sampled by area. */
typedef struct cost_surface {
    int degree;
    cost_spread position_m;
    double enclosure_offset_m;   /**< certified: no point of the whole surface is farther away */
    cost_spread mesh_position_m; /**< the same against the mesh */
} cost_surface;

typedef struct cost_result {
    const cost_settings *settings;
    shcd_model_info info;
    cost_clock clock;
    double tolerance_m; /**< of the truth: smaller errors are not resolved */
    size_t n_points;    /**< of each set */
    size_t n_unknown;   /**< left out: the truth was truncated */
    size_t n_contact;   /**< of both sets: from these come the errors */
    size_t n_surface_points;
    double unit_m;          /**< of the mesh */
    double mesh_diagonal_m; /**< 0: no mesh */
    cost_surface surface[COST_DEGREES_MAX];
    size_t n_surfaces;
    cost_lineup lineup;
    double time_s;
} cost_result;

/** False: reported. In any case to be freed. */
bool cost_run(const shcd_model *model, const cost_settings *settings, cost_result *result);
void cost_result_free(cost_result *result);

#endif
