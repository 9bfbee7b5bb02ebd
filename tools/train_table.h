/* SPDX-License-Identifier: BSD-3-Clause */
/* A table of indentations in CSV. */
#ifndef SHCD_TOOLS_TRAIN_TABLE_H
#define SHCD_TOOLS_TRAIN_TABLE_H

#include "shcd/fit.h"

#include <stdbool.h>

typedef struct train_table {
    shcd_train_sample *sample;
    size_t n;
    bool has_energy, has_speed;
} train_table;

/** Reads and checks a table for a body: a bad line is named. False: reported. Free the samples in
 *  any case. */
bool train_table_read(train_table *table, const char *path, const shcd_model *model,
                      double diagonal_m);

#endif
