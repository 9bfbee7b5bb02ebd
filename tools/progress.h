/* SPDX-License-Identifier: BSD-3-Clause */
/* One line on the terminal that tells how far a long command is; nothing where stderr is not a
 * terminal. */
#ifndef SHCD_TOOLS_PROGRESS_H
#define SHCD_TOOLS_PROGRESS_H

#include <stdbool.h>

typedef struct progress_line {
    bool shown; /**< stderr is a terminal and the user did not ask for silence */
    int width;  /**< characters on the line now */
    double last_s;
    const char *stage; /**< compared by address: stages are literals */
} progress_line;

void progress_begin(progress_line *line, bool wanted);

/** A shcd_progress callback, `user` a progress_line; never asks to stop. */
int progress_update(const char *stage, double fraction, void *user);

/** Wipes the line, so that a report or a message starts on an empty one. */
void progress_end(progress_line *line);

#endif
