/* SPDX-License-Identifier: BSD-3-Clause */
/* The library refuses the same samples, but it knows their numbers only, not their lines. */
#include "train_table.h"

#include "csv.h"
#include "report.h"

#include "shcd/query.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SAMPLES_MAX 100000
#define FAR_SHARE 0.05 /* of the diagonal: as shcd_train() */

typedef struct layout {
    const char *header;
    size_t n;
    bool has_energy, has_speed;
} layout;

static const layout layouts[] = {
    {"x,y,z,depth_m,force_n", 5, false, false},
    {"x,y,z,depth_m,force_n,energy_j", 6, true, false},
    {"x,y,z,depth_m,force_n,speed_m_per_s", 6, false, true},
    {"x,y,z,depth_m,force_n,energy_j,speed_m_per_s", 7, true, true},
};
#define N_LAYOUTS (sizeof layouts / sizeof layouts[0])

static const layout *layout_of(const csv_reader *reader) {
    for (size_t i = 0; i < N_LAYOUTS; i++) {
        if (csv_is_header(reader, layouts[i].header)) {
            return &layouts[i];
        }
    }
    return NULL;
}

/* False: reported. */
static bool take_row(const csv_reader *reader, const layout *as, const shcd_model *model,
                     double diagonal_m, shcd_train_sample *sample) {
    double v[7];
    if (reader->n_fields != as->n) {
        report_failure("%s:%lu: %zu fields instead of %s", reader->name, reader->line,
                       reader->n_fields, as->header);
        return false;
    }
    if (!csv_numbers(reader, 0, as->n, v)) {
        return false;
    }
    *sample = (shcd_train_sample){.point_m = {v[0], v[1], v[2]}, .depth_m = v[3], .force_n = v[4]};
    sample->energy_j = as->has_energy ? v[5] : 0.0;
    sample->speed_m_per_s = as->has_speed ? v[as->n - 1] : 0.0;
    if (!(sample->depth_m > 0.0)) {
        report_failure("%s:%lu: a depth of %g m is not positive", reader->name, reader->line,
                       sample->depth_m);
        return false;
    }
    shcd_proximity found;
    const shcd_status status = shcd_closest(model, sample->point_m, NULL, &found);
    if (status != SHCD_OK || !(fabs(found.distance_m) <= FAR_SHARE * diagonal_m)) {
        report_failure("%s:%lu: the point is %.3g m from the surface, more than 5 %% of the "
                       "diagonal",
                       reader->name, reader->line,
                       status == SHCD_OK ? fabs(found.distance_m) : 0.0);
        return false;
    }
    return true;
}

/* False: reported. */
static bool grow(train_table *table, size_t *room, const csv_reader *reader) {
    if (table->n == SAMPLES_MAX) {
        report_failure("%s:%lu: more than %d samples", reader->name, reader->line, SAMPLES_MAX);
        return false;
    }
    if (table->n < *room) {
        return true;
    }
    const size_t wanted = *room > 0 ? 2 * *room : 256;
    shcd_train_sample *grown = realloc(table->sample, wanted * sizeof *grown);
    if (grown == NULL) {
        report_failure("no memory");
        return false;
    }
    table->sample = grown;
    *room = wanted;
    return true;
}

/* False: reported. */
static bool read_rows(train_table *table, csv_reader *reader, const shcd_model *model,
                      double diagonal_m) {
    const layout *as = NULL;
    size_t room = 0;
    csv_status status;
    while ((status = csv_next(reader)) == CSV_ROW) {
        if (as == NULL) {
            as = layout_of(reader);
            if (as == NULL) {
                report_failure("%s:%lu: the first line must be %s, then if you have them energy_j "
                               "and speed_m_per_s",
                               reader->name, reader->line, layouts[0].header);
                return false;
            }
            continue;
        }
        if (!grow(table, &room, reader) ||
            !take_row(reader, as, model, diagonal_m, &table->sample[table->n])) {
            return false;
        }
        table->n++;
    }
    if (status == CSV_END && table->n == 0) {
        report_failure("%s: no samples", reader->name);
        return false;
    }
    table->has_energy = as != NULL && as->has_energy;
    table->has_speed = as != NULL && as->has_speed;
    return status == CSV_END;
}

bool train_table_read(train_table *table, const char *path, const shcd_model *model,
                      double diagonal_m) {
    const bool is_stdin = strcmp(path, "-") == 0;
    *table = (train_table){NULL, 0, false, false};
    FILE *file = is_stdin ? stdin : fopen(path, "r");
    if (file == NULL) {
        report_failure("%s: cannot open: %s", path, strerror(errno));
        return false;
    }
    csv_reader reader;
    csv_begin(&reader, file, is_stdin ? "stdin" : path);
    const bool good = read_rows(table, &reader, model, diagonal_m);
    if (!is_stdin) {
        fclose(file);
    }
    return good;
}
