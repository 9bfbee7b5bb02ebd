/* SPDX-License-Identifier: BSD-3-Clause */
/* How far a long measurement is: the progress line on a terminal, else a plain line on stderr every
 * quarter of a minute, so that a log shows that the command lives. */
#ifndef SHCD_TOOLS_COST_PROGRESS_H
#define SHCD_TOOLS_COST_PROGRESS_H

#include "progress.h"

typedef struct cost_progress {
    progress_line line;
    const char *stage;
    double last_s;
} cost_progress;

void cost_progress_begin(cost_progress *progress);

/** Stages are literals. */
void cost_progress_stage(cost_progress *progress, const char *stage);

/** `user` is a cost_progress. */
void cost_progress_update(double fraction, void *user);

void cost_progress_end(cost_progress *progress);

#endif
