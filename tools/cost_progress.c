/* SPDX-License-Identifier: BSD-3-Clause */
/* Never called between the two reads of the clock around a query. */
#include "cost_progress.h"

#include "cost_clock.h"

#include <stdio.h>

#define PLAIN_LINE_S 15.0

void cost_progress_begin(cost_progress *progress) {
    progress_begin(&progress->line, true);
    progress->stage = "";
    progress->last_s = cost_now_s();
}

void cost_progress_stage(cost_progress *progress, const char *stage) {
    progress->stage = stage;
    cost_progress_update(0.0, progress);
}

void cost_progress_update(double fraction, void *user) {
    cost_progress *progress = user;
    if (progress->line.shown) {
        (void)progress_update(progress->stage, fraction, &progress->line);
        return;
    }
    const double now = cost_now_s();
    if (now - progress->last_s >= PLAIN_LINE_S) {
        progress->last_s = now;
        fprintf(stderr, "shcd cost: %s, %.0f %%\n", progress->stage, 100.0 * fraction);
    }
}

void cost_progress_end(cost_progress *progress) {
    progress_end(&progress->line);
}
