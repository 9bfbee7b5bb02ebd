/* SPDX-License-Identifier: BSD-3-Clause */
/* The line is overwritten with blanks rather than cleared by an escape sequence: that works on
 * every terminal. */
#include "progress.h"

#include <stddef.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

/* Ten updates a second are enough for the eye, and cost nothing. */
#define INTERVAL_S 0.1

static double now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void progress_begin(progress_line *line, bool wanted) {
    line->shown = wanted && isatty(STDERR_FILENO) == 1;
    line->width = 0;
    line->last_s = 0.0;
    line->stage = NULL;
}

int progress_update(const char *stage, double fraction, void *user) {
    progress_line *line = user;
    if (!line->shown) {
        return 0;
    }
    const double now = now_s();
    if (stage == line->stage && now - line->last_s < INTERVAL_S) {
        return 0;
    }
    line->stage = stage;
    line->last_s = now;
    const double inside = fraction > 0.0 ? (fraction < 1.0 ? fraction : 1.0) : 0.0;
    const int printed = fprintf(stderr, "\r%.50s %3.0f %%", stage, 100.0 * inside);
    const int width = printed > 0 ? printed - 1 : 0;
    if (width < line->width) {
        fprintf(stderr, "%*s", line->width - width, "");
    }
    line->width = width;
    fflush(stderr);
    return 0;
}

void progress_end(progress_line *line) {
    if (line->width > 0) {
        fprintf(stderr, "\r%*s\r", line->width, "");
        fflush(stderr);
        line->width = 0;
    }
}
