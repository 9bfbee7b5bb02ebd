/* SPDX-License-Identifier: BSD-3-Clause */
/* Points within 1 % of the diagonal from the surface, always the same; one query at a time between
 * two readings of the clock, less what two readings cost. Prices of one evaluation and one bound
 * come from a least-squares fit of the times to the counts. */
#include "cost_quick.h"

#include "tools/cost_machine.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define N_POINTS 400
#define BAND 0.01  /* of the diagonal: where a tool is in contact, or nearly */
#define STEP 0.001 /* of the diagonal, between two points of a path */

typedef struct sample {
    shcd_vec3 point, seed; /* seed: the parameter a step away, for the track tier */
    shcd_proximity truth;
} sample;

typedef struct costs {
    double ns[N_POINTS], error_m[N_POINTS], angle_rad[N_POINTS];
    double evaluations[N_POINTS], patches[N_POINTS];
} costs;

void cost_quick_machine(char name[SHCD_COST_MACHINE_SIZE]) {
    cost_machine machine;
    cost_machine_describe(&machine);
    snprintf(name, SHCD_COST_MACHINE_SIZE, "%.*s", SHCD_COST_MACHINE_SIZE - 1, machine.cpu);
    for (char *c = name; *c != '\0'; c++) {
        *c = *c >= ' ' && *c <= '~' ? *c : '?';
    }
}

static double now_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double quantile(const double *values, double share) {
    double sorted[N_POINTS];
    memcpy(sorted, values, sizeof sorted);
    qsort(sorted, N_POINTS, sizeof sorted[0], compare);
    return sorted[(size_t)(share * (N_POINTS - 1) + 0.5)];
}

static double clock_ns(void) {
    double between[N_POINTS];
    for (size_t i = 0; i < N_POINTS; i++) {
        const double start = now_ns();
        between[i] = now_ns() - start;
    }
    return quantile(between, 0.5);
}

/* ---- points ---- */

static double uniform(uint64_t *state) {
    uint64_t z = (*state += 0x9e3779b97f4a7c15u); /* splitmix64 */
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static shcd_vec3 direction(uint64_t *state) {
    const double z = 2.0 * uniform(state) - 1.0, phi = 6.283185307179586 * uniform(state);
    const double s = sqrt(1.0 - z * z);
    return shcd_vec3_make(s * cos(phi), s * sin(phi), z);
}

static bool draw(const shcd_model *truth, sample *samples) {
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    uint64_t state = 0x5eed;
    bool good = shcd_model_describe(truth, &info) == SHCD_OK;
    for (size_t i = 0; good && i < N_POINTS; i++) {
        sample *s = &samples[i];
        shcd_vec3 x, n;
        shcd_proximity near;
        good = shcd_model_surface(truth, -1, direction(&state), &x, &n, NULL) == SHCD_OK;
        s->point = shcd_mul_add(x, BAND * info.diagonal_m * (2.0 * uniform(&state) - 1.0), n);
        const shcd_vec3 before = shcd_mul_add(s->point, STEP * info.diagonal_m, direction(&state));
        good = good && shcd_closest(truth, s->point, NULL, &s->truth) == SHCD_OK &&
               shcd_closest(truth, before, NULL, &near) == SHCD_OK;
        s->seed = near.parameter;
    }
    return good;
}

/* ---- queries ---- */

static shcd_status ask(const shcd_model *model, const sample *s, int tier, int hermite,
                       shcd_proximity *found) {
    const shcd_query_options options = {
        .struct_size = sizeof options, .tier = tier, .map_hermite = hermite};
    return tier == SHCD_TIER_TRACK ? shcd_track(model, s->point, s->seed, found)
                                   : shcd_closest(model, s->point, &options, found);
}

/* One round untimed, so that code and tables are in the caches, as they are in a loop. */
static bool measure(const shcd_model *model, const sample *samples, int tier, int hermite,
                    double clock, costs *c) {
    for (size_t k = 0; k < 2 * N_POINTS; k++) {
        const size_t i = k % N_POINTS;
        shcd_proximity found;
        const double start = now_ns();
        if (ask(model, &samples[i], tier, hermite, &found) != SHCD_OK) {
            return false;
        }
        c->ns[i] = fmax(0.0, now_ns() - start - clock);
        c->error_m[i] = fabs(found.distance_m - samples[i].truth.distance_m);
        c->angle_rad[i] =
            acos(fmin(1.0, fmax(-1.0, shcd_dot(found.normal, samples[i].truth.normal))));
        c->evaluations[i] = (double)found.n_evaluations;
        c->patches[i] = (double)found.n_patches;
    }
    return true;
}

static double mean(const double *values) {
    double sum = 0.0;
    for (size_t i = 0; i < N_POINTS; i++) {
        sum += values[i] / N_POINTS;
    }
    return sum;
}

/* ns = evaluations price + patches price in least squares over the exact and the fast queries that
 * were not disturbed; left at 0, not known, unless both prices come out above 0. */
static void fit_prices(const costs *const sets[2], const double limit[2], shcd_cost_row *row) {
    double ee = 0.0, ep = 0.0, pp = 0.0, et = 0.0, pt = 0.0;
    for (size_t k = 0; k < 2; k++) {
        for (size_t i = 0; i < N_POINTS; i++) {
            const double e = sets[k]->evaluations[i], p = sets[k]->patches[i];
            const double t = sets[k]->ns[i];
            if (t <= limit[k]) {
                ee += e * e;
                ep += e * p;
                pp += p * p;
                et += e * t;
                pt += p * t;
            }
        }
    }
    const double det = ee * pp - ep * ep;
    const double evaluation = det > 0.0 ? (et * pp - pt * ep) / det : 0.0;
    const double patch = det > 0.0 ? (pt * ee - et * ep) / det : 0.0;
    if (evaluation > 0.0 && patch > 0.0) {
        row->evaluation_ns = evaluation;
        row->patch_ns = patch;
    }
}

static void fill_row(const shcd_model *model, int tier, int hermite, const costs *c,
                     shcd_cost_row *row) {
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    memset(row, 0, sizeof *row);
    if (shcd_model_describe(model, &info) == SHCD_OK) {
        row->map_resolution = tier == SHCD_TIER_MAP ? info.map_resolution : 0;
        row->bytes = info.run_time_bytes;
    }
    row->degree = shcd_model_degree(model);
    row->tier = tier;
    row->interpolation = hermite;
    row->error_max_m = quantile(c->error_m, 1.0);
    row->error_p99_m = quantile(c->error_m, 0.99);
    for (size_t i = 0; i < N_POINTS; i++) {
        row->error_rms_m += c->error_m[i] * c->error_m[i] / N_POINTS;
    }
    row->error_rms_m = sqrt(row->error_rms_m);
    row->normal_p99_rad = quantile(c->angle_rad, 0.99);
    row->ns_p50 = quantile(c->ns, 0.5);
    row->ns_p99 = quantile(c->ns, 0.99);
    row->evaluations_mean = mean(c->evaluations);
    row->patches_mean = mean(c->patches);
}

static const struct {
    int tier, hermite;
} kinds[COST_QUICK_ROWS] = {{SHCD_TIER_EXACT, 0},
                            {SHCD_TIER_FAST, 0},
                            {SHCD_TIER_TRACK, 0},
                            {SHCD_TIER_MAP, SHCD_MAP_LINEAR},
                            {SHCD_TIER_MAP, SHCD_MAP_HERMITE}};

bool cost_quick(const shcd_model *truth, const shcd_model *model, shcd_cost_row *rows) {
    sample *samples = calloc(N_POINTS, sizeof *samples);
    costs *all = calloc(COST_QUICK_ROWS, sizeof *all);
    bool good = samples != NULL && all != NULL && draw(truth, samples);
    const double clock = clock_ns();
    for (size_t k = 0; good && k < COST_QUICK_ROWS; k++) {
        good = measure(model, samples, kinds[k].tier, kinds[k].hermite, clock, &all[k]);
        fill_row(model, kinds[k].tier, kinds[k].hermite, &all[k], &rows[k]);
    }
    if (good) {
        shcd_cost_row price = {.evaluation_ns = 0.0};
        const costs *const sets[2] = {&all[0], &all[1]};
        const double limit[2] = {quantile(all[0].ns, 0.95), quantile(all[1].ns, 0.95)};
        fit_prices(sets, limit, &price);
        for (size_t k = 0; k < COST_QUICK_ROWS; k++) {
            rows[k].evaluation_ns = price.evaluation_ns;
            rows[k].patch_ns = price.patch_ns;
        }
    }
    free(all);
    free(samples);
    return good;
}
