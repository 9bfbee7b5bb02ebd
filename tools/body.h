/* SPDX-License-Identifier: BSD-3-Clause */
/* What several subcommands do with a body: load it, warn about it, describe it. */
#ifndef SHCD_TOOLS_BODY_H
#define SHCD_TOOLS_BODY_H

#include "json.h"

#include "shcd/model.h"

#include <stdbool.h>
#include <stdio.h>

/** NULL: reported. */
shcd_model *body_load(const char *path);

/** False: reported. */
bool body_describe(const shcd_model *model, shcd_model_info *info);

/** Fills a definition with all that the model carries, for a copy with a change. It borrows from
 * the model and from *info. False: reported. */
bool body_definition(const shcd_model *model, shcd_model_info *info, shcd_model_def *definition);

/** Saves and reports a failure; on failure no file is left. */
bool body_save(const shcd_model *model, const char *path);

/** Warns if a body of this diagonal is not between 1 mm and 10 m: most likely a wrong unit. True if
 *  it warned. */
bool body_warn_size(double diagonal_m);

/** Warns if the surface intersects itself. True if it warned. */
bool body_warn_embedding(const shcd_model_info *info);

/** "unknown", "sampled" or "proven". */
const char *body_certainty(int certainty);

/** Length with its millimetres, and its share of the diagonal unless that is 0. */
void body_print_length(FILE *file, const char *label, double length_m, double diagonal_m);

/** Lines on topology that the reports of fit and info share. */
void body_print_topology(FILE *file, const shcd_model_info *info);

/** Members of an open JSON object: all of the description. */
void body_write_json(json_writer *json, const shcd_model_info *info);
void body_write_fit_record(json_writer *json, const char *key, const shcd_fit_record *record);

#endif
