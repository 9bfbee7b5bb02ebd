/* SPDX-License-Identifier: BSD-3-Clause */
/* Two tables: how far the surfaces are apart, and what queries cost. Lengths in millimetres,
 * three digits: more would not come out again in a second run. */
#include "cost_report.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define DEGREES_PER_RAD (180.0 / 3.14159265358979323846)

static void print_head(FILE *file, const cost_machine *machine, const cost_result *result) {
    const uint32_t version = shcd_version();
    const double diagonal_mm = 1e3 * result->info.diagonal_m;
    fprintf(file, "body     %s, degree %d, diagonal %.6g mm\n", result->settings->body_path,
            (int)result->info.degree, diagonal_mm);
    if (result->settings->mesh_path != NULL) {
        fprintf(file, "mesh     %s, diagonal %.6g mm\n", result->settings->mesh_path,
                1e3 * result->mesh_diagonal_m);
    }
    fprintf(file, "machine  %s, %d processors, load %.2f; libshcd %u.%u.%u\n", machine->cpu,
            machine->n_processors, machine->load, (unsigned)(version / 10000u),
            (unsigned)(version / 100u % 100u), (unsigned)(version % 100u));
    fprintf(file, "clock    %s, steps of %.3g ns, %.3g ns taken off each time\n",
            result->clock.uses_counter ? "time-stamp counter" : "CLOCK_MONOTONIC",
            result->clock.resolution_ns, result->clock.ns_per_tick * result->clock.overhead_ticks);
    fprintf(file,
            "points   %zu at random within %.3g %% of the diagonal from the surface, %zu on a path "
            "in steps\n         of %.3g %%; %zu of them in the contact band of %.3g %% (%.3g mm)\n",
            result->n_points, 100.0 * COST_NEAR_BAND, result->n_points, 100.0 * COST_PATH_STEP,
            result->n_contact, 100.0 * COST_CONTACT_BAND, COST_CONTACT_BAND * diagonal_mm);
    fprintf(file, "truth    the exact tier at degree %d, certified to %.2g mm\n",
            (int)result->info.degree, 1e3 * result->tolerance_m);
    if (result->n_unknown > 0) {
        fprintf(file, "         unknown for %zu points, which do not count\n", result->n_unknown);
    }
}

/* What lies below `floor` is not resolved. */
static void print_above(FILE *file, double value, double floor) {
    char text[24];
    snprintf(text, sizeof text, value < floor ? "<%.1g" : "%.3g", value < floor ? floor : value);
    fprintf(file, " %8s", text);
}

static void print_spread_mm(FILE *file, const cost_spread *spread, double floor_m) {
    print_above(file, 1e3 * spread->max, 1e3 * floor_m);
    print_above(file, 1e3 * spread->p99, 1e3 * floor_m);
    print_above(file, 1e3 * spread->rms, 1e3 * floor_m);
}

static const cost_row *exact_row(const cost_result *result, int degree) {
    for (size_t i = 0; i < result->lineup.n_contenders; i++) {
        const cost_row *row = &result->lineup.contender[i].row;
        if (row->degree == degree && strcmp(row->tier, "exact") == 0) {
            return row;
        }
    }
    return NULL;
}

static void print_surfaces(FILE *file, const cost_result *result) {
    const bool has_mesh = result->settings->mesh_path != NULL;
    fputs("\nSURFACES [mm]: the series cut off at a degree\n", file);
    fprintf(file, "        %26s %10s", "distance to the whole     ", "certified");
    fputs(has_mesh ? "  distance to the mesh        exact tier against mesh\n" : "\n", file);
    fprintf(file, "degree  %8s %8s %8s %10s", "max", "p99", "rms", "<=");
    if (has_mesh) {
        for (int i = 0; i < 2; i++) {
            fprintf(file, "  %8s %8s %8s", "max", "p99", "rms");
        }
    }
    fputc('\n', file);
    for (size_t i = 0; i < result->n_surfaces; i++) {
        const cost_surface *surface = &result->surface[i];
        const cost_row *row = exact_row(result, surface->degree);
        fprintf(file, "%6d ", surface->degree);
        print_spread_mm(file, &surface->position_m, result->tolerance_m);
        fprintf(file, " %10.3g", 1e3 * surface->enclosure_offset_m);
        if (has_mesh && row != NULL) {
            fputc(' ', file);
            print_spread_mm(file, &surface->mesh_position_m, 0.0);
            fputc(' ', file);
            print_spread_mm(file, &row->mesh_error_m, 0.0);
        }
        fputc('\n', file);
    }
}

static void print_name(FILE *file, const cost_result *result, const cost_row *row) {
    char name[32] = "";
    if (row->field_tolerance_m > 0.0) {
        snprintf(name, sizeof name, "%.3g %%",
                 100.0 * row->field_tolerance_m / result->info.diagonal_m);
    } else if (row->map_resolution > 0) {
        snprintf(name, sizeof name, "%d %s", row->map_resolution,
                 row->degree >= 0 ? row->interpolation : "cells");
    }
    if (row->degree >= 0) {
        fprintf(file, "%6d  %-5s %-10s", row->degree, row->tier, name);
    } else {
        fprintf(file, "%6s  %-5s %-10s", "", row->tier, name);
    }
}

static void print_row(FILE *file, const cost_result *result, const cost_row *row) {
    print_name(file, result, row);
    print_spread_mm(file, &row->error_m, result->tolerance_m);
    print_above(file, DEGREES_PER_RAD * row->normal_rad.p99, 1e-6);
    print_above(file, row->force_error_n.max,
                result->settings->stiffness_n_per_m * result->tolerance_m);
    if (strcmp(row->tier, "track") == 0) {
        fprintf(file, " %6s %6s", "-", "-");
    } else {
        fprintf(file, " %6.0f %6.0f", row->ns_p50, row->ns_p99);
    }
    fprintf(file, " %6.0f %6.0f", row->path_ns_p50, row->path_ns_p99);
    if (row->degree >= 0) {
        fprintf(file, " %6.1f", row->evaluations_mean);
    } else {
        fprintf(file, " %6s", "-");
    }
    fprintf(file, " %7.1f  %s%s", 1e-3 * (double)row->bytes, row->on_time_front ? "T" : "",
            row->on_bytes_front ? "B" : "");
    fputc('\n', file);
}

static void print_group(FILE *file, const cost_result *result, const char *tier) {
    int degree = 0;
    bool first = true;
    for (size_t i = 0; i < result->lineup.n_contenders; i++) {
        const cost_row *row = &result->lineup.contender[i].row;
        if (strcmp(row->tier, tier) != 0) {
            continue;
        }
        /* maps: a group for each degree */
        if (first || (row->map_resolution > 0 && row->degree != degree)) {
            fputc('\n', file);
        }
        first = false;
        degree = row->degree;
        print_row(file, result, row);
    }
}

static void print_legend(FILE *file, const cost_result *result) {
    fprintf(file,
            "\nmax, p99 and rms are those of the points in the contact band. force: what %.6g N/m "
            "make of the\nerror of the depth. front: no row of the body has both a smaller max "
            "error and less time (T,\nmedian on the path), or less memory (B).\n",
            result->settings->stiffness_n_per_m);
    fputs("track follows the foot of the last query and misses jumps of the closest point. map "
          "gives depth\nalong a ray: a finer one does not make that a distance. grid and adf are "
          "fields sampled from\nthe exact distance, for comparison.\n",
          file);
    for (size_t i = 0; i < result->lineup.n_notes; i++) {
        fprintf(file, "not measured: %s\n", result->lineup.note[i]);
    }
    fprintf(file, "took %.1f s\n", result->time_s);
}

void cost_report_text(FILE *file, const cost_machine *machine, const cost_result *result) {
    static const char *const groups[] = {"exact", "fast", "track", "map", "grid", "adf"};
    print_head(file, machine, result);
    print_surfaces(file, result);
    fputs("\nQUERIES\n", file);
    fprintf(file, "%-24s %26s %8s %8s %13s %13s %6s %7s\n", "", "error of distance [mm]    ",
            "normal", "force", "random [ns]", "path [ns]", "evalu-", "memory");
    fprintf(file, "%6s  %-5s %-10s %8s %8s %8s %8s %8s %6s %6s %6s %6s %6s %7s  %s\n", "degree",
            "tier", "map", "max", "p99", "rms", "p99 [deg]", "max [N]", "p50", "p99", "p50", "p99",
            "ations", "[KB]", "front");
    for (size_t i = 0; i < sizeof groups / sizeof groups[0]; i++) {
        print_group(file, result, groups[i]);
    }
    print_legend(file, result);
}
