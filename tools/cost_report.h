/* SPDX-License-Identifier: BSD-3-Clause */
/* What a measurement found, as text, as JSON and as a plot. */
#ifndef SHCD_TOOLS_COST_REPORT_H
#define SHCD_TOOLS_COST_REPORT_H

#include "cost_machine.h"
#include "cost_run.h"
#include "gnuplot.h"

#include <stdio.h>

void cost_report_text(FILE *file, const cost_machine *machine, const cost_result *result);
void cost_report_json(FILE *file, const cost_machine *machine, const cost_result *result);

/** Saves a copy of the body that carries the table. False: reported. */
bool cost_save(const char *path, const shcd_model *model, const cost_machine *machine,
               const cost_result *result);

/** Draws into an open file, at whose start nothing is written yet. False: reported. */
bool cost_plot_draw(FILE *file, enum gnuplot_format format, const cost_machine *machine,
                    const cost_result *result);

#endif
