/* SPDX-License-Identifier: BSD-3-Clause */
/* The hold-out test of a learned response as a picture. */
#ifndef SHCD_TOOLS_TRAIN_PLOT_H
#define SHCD_TOOLS_TRAIN_PLOT_H

#include "gnuplot.h"

#include "shcd/fit.h"

/** The samples that a training was tested on, in the order in which it told of them. */
typedef struct train_checks {
    shcd_train_check *check;
    size_t n, room;
    bool failed; /**< out of memory: some are missing */
} train_checks;

/** A shcd_train_watch; `user` is a train_checks. */
void train_checks_add(const shcd_train_check *check, void *user);

/** False: reported. */
bool train_plot_draw(FILE *picture, enum gnuplot_format format, const char *body,
                     const shcd_learned *learned, const train_checks *checks);

#endif
