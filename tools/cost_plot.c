/* SPDX-License-Identifier: BSD-3-Clause */
/* The data of `shcd cost --plot`, written in front of cost_plot.gp. */
#include "cost_report.h"

#include "cost_plot_script.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* One line of data: time on the path [ns], memory [KB], error [mm], a label. An error that the
 * truth does not resolve stands at the bottom line of the plot, which is `floor_mm`. */
static void write_point(FILE *file, const cost_row *row, double floor_mm, double bottom_mm,
                        const char *label) {
    const double error_mm = 1e3 * row->error_m.max;
    fprintf(file, "%.6g %.6g %.6g \"%s\"\n", row->path_ns_p50, 1e-3 * (double)row->bytes,
            error_mm <= floor_mm ? bottom_mm : error_mm, label);
}

static bool is_series(const cost_row *row, const char *tier, const char *interpolation) {
    return strcmp(row->tier, tier) == 0 &&
           (interpolation == NULL || strcmp(row->interpolation, interpolation) == 0);
}

static void label_of(const cost_result *result, const cost_row *row, char *text, size_t size) {
    if (row->field_tolerance_m > 0.0) {
        snprintf(text, size, "%.2g %%", 100.0 * row->field_tolerance_m / result->info.diagonal_m);
    } else if (row->degree < 0) {
        snprintf(text, size, "%d", row->map_resolution);
    } else {
        snprintf(text, size, "%d", row->degree);
    }
}

/* How the errors are laid out: resolved ones from low_mm to high_mm, the others on a line below. */
typedef struct error_axis {
    double floor_mm;
    double low_mm, high_mm, bottom_mm;
} error_axis;

static error_axis find_axis(const cost_result *result) {
    error_axis axis = {1e3 * result->tolerance_m, HUGE_VAL, 0.0, 0.0};
    for (size_t i = 0; i < result->lineup.n_contenders; i++) {
        const double error_mm = 1e3 * result->lineup.contender[i].row.error_m.max;
        if (error_mm > axis.floor_mm) {
            axis.low_mm = fmin(axis.low_mm, error_mm);
        }
        axis.high_mm = fmax(axis.high_mm, fmax(error_mm, axis.floor_mm));
    }
    /* two decades at least */
    axis.low_mm = fmin(axis.low_mm, 0.01 * axis.high_mm);
    axis.bottom_mm = axis.low_mm * pow(axis.high_mm / axis.low_mm, -0.2);
    return axis;
}

/* From the cheapest to the dearest, with a margin of their ratio at both ends for labels. */
static void write_range(FILE *file, const cost_result *result, bool is_time) {
    double low = HUGE_VAL, high = 0.0;
    for (size_t i = 0; i < result->lineup.n_contenders; i++) {
        const cost_row *row = &result->lineup.contender[i].row;
        const double cost = is_time ? row->path_ns_p50 : 1e-3 * (double)row->bytes;
        low = fmin(low, cost);
        high = fmax(high, cost);
    }
    const double margin = pow(high / low, 0.13) * 1.1;
    fprintf(file, "%s_low = %.6g\n%s_high = %.6g\n", is_time ? "ns" : "kb", low / margin,
            is_time ? "ns" : "kb", high * margin);
}

static void write_series(FILE *file, const cost_result *result, const error_axis *axis,
                         const char *name, const char *tier, const char *interpolation) {
    int n = 0;
    fprintf(file, "$%s << EOD\n", name);
    for (size_t i = 0; i < result->lineup.n_contenders; i++) {
        const cost_row *row = &result->lineup.contender[i].row;
        char label[32];
        if (is_series(row, tier, interpolation)) {
            label_of(result, row, label, sizeof label);
            write_point(file, row, axis->floor_mm, axis->bottom_mm, label);
            n++;
        }
    }
    /* gnuplot takes no empty block and crashes (5.4) on one of NaN alone: a point off the axes */
    fprintf(file, "%sEOD\nn_%s = %d\n", n > 0 ? "" : "1e-30 1e-30 1e-30 \"\"\n", name, n);
}

static int by_cost(const void *a, const void *b) {
    const double *x = a;
    const double *y = b;
    return (x[0] > y[0]) - (x[0] < y[0]);
}

/* The body's rows on a front, cheapest first. */
static void write_front(FILE *file, const cost_result *result, const error_axis *axis,
                        bool is_time) {
    double point[COST_CONTENDERS_MAX][2];
    size_t n = 0;
    for (size_t i = 0; i < result->lineup.n_contenders; i++) {
        const cost_row *row = &result->lineup.contender[i].row;
        if (row->degree >= 0 && (is_time ? row->on_time_front : row->on_bytes_front)) {
            const double error_mm = 1e3 * row->error_m.max;
            point[n][0] = is_time ? row->path_ns_p50 : 1e-3 * (double)row->bytes;
            point[n++][1] = error_mm <= axis->floor_mm ? axis->bottom_mm : error_mm;
        }
    }
    qsort(point, n, sizeof point[0], by_cost);
    for (size_t i = 0; i < n; i++) {
        fprintf(file, "%.6g %.6g\n", point[i][0], point[i][1]);
    }
}

typedef struct cost_plot {
    enum gnuplot_format format;
    const cost_machine *machine;
    const cost_result *result;
} cost_plot;

static void write_program(FILE *file, const void *user) {
    const cost_plot *plot = user;
    const cost_result *result = plot->result;
    const error_axis axis = find_axis(result);
    const char *path = result->settings->body_path;
    const char *slash = strrchr(path, '/');
    fprintf(file, "is_png = %d\n", plot->format == GNUPLOT_PNG ? 1 : 0);
    gnuplot_write_text(file, "body", slash != NULL ? slash + 1 : path);
    gnuplot_write_text(file, "cpu", plot->machine->cpu);
    fprintf(file,
            "degree = %d\ndiagonal_mm = %.6g\nband_mm = %.6g\nfloor_mm = %.6g\nlow_mm = %.6g\n"
            "high_mm = %.6g\nbottom_mm = %.6g\n",
            (int)result->info.degree, 1e3 * result->info.diagonal_m,
            1e3 * COST_CONTACT_BAND * result->info.diagonal_m, axis.floor_mm, axis.low_mm,
            axis.high_mm, axis.bottom_mm);
    write_range(file, result, true);
    write_range(file, result, false);
    write_series(file, result, &axis, "exact", "exact", NULL);
    write_series(file, result, &axis, "fast", "fast", NULL);
    write_series(file, result, &axis, "track", "track", NULL);
    write_series(file, result, &axis, "linear", "map", "linear");
    write_series(file, result, &axis, "hermite", "map", "hermite");
    write_series(file, result, &axis, "grid", "grid", NULL);
    write_series(file, result, &axis, "adf", "adf", NULL);
    fputs("$front << EOD\n", file); /* two sets of data, with two empty lines between them */
    write_front(file, result, &axis, true);
    fputs("\n\n", file);
    write_front(file, result, &axis, false);
    fputs("EOD\n", file);
    for (size_t i = 0; plot_script[i] != NULL; i++) {
        fputs(plot_script[i], file);
    }
}

bool cost_plot_draw(FILE *file, enum gnuplot_format format, const cost_machine *machine,
                    const cost_result *result) {
    const cost_plot plot = {format, machine, result};
    return gnuplot_draw(file, write_program, &plot);
}
