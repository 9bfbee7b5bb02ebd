/* SPDX-License-Identifier: BSD-3-Clause */
/* The grid of a textbook: the whole box, all nodes exact. */
#include "cost_grid.h"

#include "cost_clock.h"

#include "shcd/query.h"
#include "shcd/vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

double cost_source_ask(const cost_source *source, shcd_vec3 point) {
    shcd_proximity answer = {.distance_m = 0.0};
    const shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    return shcd_closest(source->model, point, &options, &answer) == SHCD_OK ? answer.distance_m
                                                                            : (double)NAN;
}

static shcd_vec3 node_at(const cost_grid *grid, double i, double j, double k) {
    return shcd_mul_add(grid->origin, grid->spacing_m, shcd_vec3_make(i, j, k));
}

enum cost_build cost_grid_build(const cost_source *source, int cells, cost_grid *grid) {
    const shcd_vec3 side = shcd_sub(source->high, source->low);
    const double sides[3] = {side.x, side.y, side.z};
    memset(grid, 0, sizeof *grid);
    grid->origin = source->low;
    grid->spacing_m = fmax(side.x, fmax(side.y, side.z)) / cells;
    size_t n_nodes = 1;
    for (int a = 0; a < 3; a++) {
        grid->n[a] = (size_t)ceil(sides[a] / grid->spacing_m) + 1;
        n_nodes *= grid->n[a];
    }
    grid->distance_m = malloc(n_nodes * sizeof *grid->distance_m);
    if (grid->distance_m == NULL) {
        return COST_NO_MEMORY;
    }
    size_t node = 0;
    for (size_t k = 0; k < grid->n[2]; k++) {
        for (size_t j = 0; j < grid->n[1]; j++) {
            for (size_t i = 0; i < grid->n[0]; i++) {
                const shcd_vec3 point = node_at(grid, (double)i, (double)j, (double)k);
                grid->distance_m[node++] = (float)cost_source_ask(source, point);
            }
            if (cost_spent_s() > source->deadline_s) {
                cost_grid_free(grid);
                return COST_TOO_LONG;
            }
        }
        source->progress((double)(k + 1) / (double)grid->n[2], source->user);
    }
    return COST_BUILT;
}

void cost_grid_free(cost_grid *grid) {
    free(grid->distance_m);
    grid->distance_m = NULL;
}

size_t cost_grid_bytes(const cost_grid *grid) {
    return sizeof *grid + grid->n[0] * grid->n[1] * grid->n[2] * sizeof *grid->distance_m;
}

double cost_trilinear(const float corner[8], const double at[3], double gradient[3]) {
    const double x = at[0], y = at[1], z = at[2];
    double low[4], slope[4]; /* along x, on the edges at (y, z) = (0, 0), (1, 0), (0, 1), (1, 1) */
    for (int e = 0; e < 4; e++) {
        low[e] = (double)corner[2 * e];
        slope[e] = (double)corner[2 * e + 1] - low[e];
        low[e] += x * slope[e];
    }
    const double bottom = low[0] + y * (low[1] - low[0]);
    const double top = low[2] + y * (low[3] - low[2]);
    const double slope_bottom = slope[0] + y * (slope[1] - slope[0]);
    const double slope_top = slope[2] + y * (slope[3] - slope[2]);
    gradient[0] = slope_bottom + z * (slope_top - slope_bottom);
    gradient[1] = low[1] - low[0] + z * (low[3] - low[2] - low[1] + low[0]);
    gradient[2] = top - bottom;
    return bottom + z * (top - bottom);
}

void cost_grid_query(const cost_grid *grid, shcd_vec3 point, double *distance_m,
                     shcd_vec3 *gradient) {
    const double scale = 1.0 / grid->spacing_m;
    const shcd_vec3 v = shcd_scale(scale, shcd_sub(point, grid->origin));
    const double u[3] = {v.x, v.y, v.z};
    double at[3], slope[3];
    size_t cell[3];
    for (int a = 0; a < 3; a++) {
        const double last = (double)(grid->n[a] - 2);
        const double whole = u[a] > 0.0 ? (u[a] < last ? (double)(size_t)u[a] : last) : 0.0;
        cell[a] = (size_t)whole;
        at[a] = u[a] - whole;
    }
    const size_t row = grid->n[0], layer = grid->n[0] * grid->n[1];
    const float *d = grid->distance_m + cell[2] * layer + cell[1] * row + cell[0];
    const float corner[8] = {d[0],     d[1],         d[row],         d[row + 1],
                             d[layer], d[layer + 1], d[layer + row], d[layer + row + 1]};
    *distance_m = cost_trilinear(corner, at, slope);
    *gradient = shcd_scale(scale, shcd_vec3_make(slope[0], slope[1], slope[2]));
}
