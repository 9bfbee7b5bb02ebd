/* SPDX-License-Identifier: BSD-3-Clause */
/* What `shcd fit` found out, as text and as JSON. */
#ifndef SHCD_TOOLS_FIT_REPORT_H
#define SHCD_TOOLS_FIT_REPORT_H

#include "shcd/fit.h"

#include <stdio.h>

typedef struct fit_result {
    const char *mesh_path;
    const char *body_path;
    double unit_m;
    double tolerance_m; /**< 0: the degree was given */
    shcd_mesh_report mesh;
    double import_rounding_m; /**< of the largest coordinate, in single precision */
    shcd_fit_report fit;
    shcd_model_info model;
    const shcd_modes *modes; /**< of the model; NULL: none */
    double time_s;           /**< wall clock, from opening the mesh to the finished model */
} fit_result;

void fit_report_text(FILE *file, const fit_result *result);
void fit_report_json(FILE *file, const fit_result *result);

/** Warns if the importer's rounding is more than 1e-5 of the diagonal, or than the tolerance. */
void fit_report_warn_rounding(const fit_result *result);

/** Warnings on the finished fit, on stderr. */
void fit_report_warnings(const fit_result *result);

#endif
