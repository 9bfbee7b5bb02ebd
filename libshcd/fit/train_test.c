/* SPDX-License-Identifier: BSD-3-Clause */
/* The test goes through the same functions as a tick: shcd_learned_evaluate() and
 * shcd_learned_dent(). Of tables with speeds the force is dU/d depth plus the damping that was
 * found with it. */
#include "train_test.h"

#include "fail.h"

#include "shcd/vec.h"

#include <math.h>
#include <stdlib.h>

#define SCATTERED 4000
#define DEPTHS 10

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

typedef struct spread {
    double max, p99, rms;
} spread;

/* Sorts the values. p99: the smallest value that 99 % do not exceed. */
static spread spread_of(double *value, size_t n) {
    spread s = {0.0, 0.0, 0.0};
    if (n > 0) {
        qsort(value, n, sizeof *value, compare);
        for (size_t i = 0; i < n; i++) {
            s.rms += value[i] * value[i];
        }
        s.rms = sqrt(s.rms / (double)n);
        s.max = value[n - 1];
        s.p99 = value[(99 * n + 99) / 100 - 1];
    }
    return s;
}

/* Largest difference of the dent from the true one, over the nodes. */
static double dent_error(shcdi_membrane_grid *dents, const shcd_learned *network,
                         const shcdi_train_data *data, size_t place, size_t row, double force_n,
                         double *q, double *node) {
    const double *truth = data->test_q + row * data->n_modes;
    if (shcd_learned_dent(network, data->test_phi + place * data->n_modes, force_n,
                          data->test.row[row].depth_m, q) != SHCD_OK) {
        return (double)INFINITY;
    }
    for (size_t k = 0; k < data->n_modes; k++) {
        q[k] -= truth[k];
    }
    double most = 0.0;
    shcdi_membrane_grid_values(dents, q, node);
    for (size_t i = 0; i < shcdi_membrane_grid_size(dents); i++) {
        most = fmax(most, fabs(node[i]));
    }
    return most;
}

/* What a place's tangents make of a slope that is off. */
static double slope_error(const shcdi_train_place *place, const shcdi_train_row *row,
                          shcd_vec3 slope_n) {
    const double a = shcd_dot(slope_n, place->tangent[0]) - row->slope_n[0];
    const double b = shcd_dot(slope_n, place->tangent[1]) - row->slope_n[1];
    return isfinite(row->slope_n[0]) ? sqrt(a * a + b * b) : 0.0;
}

typedef struct tested {
    double *force, *slope, *dent; /* errors of each row */
    double *q, *node;             /* scratch */
} tested;

static shcd_status test_row(const shcdi_train_data *data, shcdi_membrane_grid *dents,
                            const shcd_learned *network, size_t place, size_t i,
                            const tested *error, shcd_train_check *check) {
    const shcdi_train_place *at = &data->test.place[place];
    const shcdi_train_row *row = &data->test.row[i];
    shcd_learned_output out;
    const shcd_status status = shcd_learned_evaluate(network, at->point_m, row->depth_m, &out);
    if (status != SHCD_OK) {
        return status;
    }
    const double force_n =
        out.force_n + network->damping_n_s_per_m2 * row->depth_m * row->speed_m_per_s;
    error->force[i] = fabs(force_n - row->force_n);
    error->slope[i] = slope_error(at, row, out.slope_n);
    error->dent[i] = dents != NULL ? dent_error(dents, network, data, place, i, out.force_n,
                                                error->q, error->node)
                                   : 0.0;
    *check = (shcd_train_check){at->point_m, row->depth_m,   row->force_n,
                                force_n,     error->dent[i], error->slope[i]};
    return SHCD_OK;
}

static void fill_record(const shcdi_train_data *data, const tested *error,
                        shcd_learned_record *record) {
    const size_t n = data->test.n_rows;
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        sum += data->test.row[i].force_n * data->test.row[i].force_n;
    }
    const spread force = spread_of(error->force, n), slope = spread_of(error->slope, n);
    const spread dent = spread_of(error->dent, n);
    record->n_samples = data->train.n_rows;
    record->n_holdout = n;
    record->force_error_max_n = force.max;
    record->force_error_p99_n = force.p99;
    record->force_error_rms_n = force.rms;
    record->force_rms_n = n > 0 ? sqrt(sum / (double)n) : 0.0;
    record->slope_error_max_n = slope.max;
    record->slope_error_rms_n = slope.rms;
    record->dent_error_max_m = dent.max;
    record->dent_error_p99_m = dent.p99;
    record->dent_error_rms_m = dent.rms;
}

shcd_status shcdi_train_test(const shcdi_train_data *data, shcdi_membrane_grid *dents,
                             shcd_learned *network, shcd_train_watch watch, void *user) {
    const size_t n = data->test.n_rows, n_modes = data->n_modes;
    const size_t n_nodes = dents != NULL ? shcdi_membrane_grid_size(dents) : 0;
    tested error;
    error.force = malloc((3 * n + n_modes + n_nodes + 1) * sizeof(double));
    if (error.force == NULL) {
        return SHCD_ERR_MEMORY;
    }
    error.slope = error.force + n;
    error.dent = error.slope + n;
    error.q = error.dent + n;
    error.node = error.q + n_modes;
    shcd_status status = SHCD_OK;
    for (size_t j = 0; j < data->test.n_places && status == SHCD_OK; j++) {
        const shcdi_train_place *place = &data->test.place[j];
        for (size_t i = place->first; i < place->first + place->n && status == SHCD_OK; i++) {
            shcd_train_check check;
            status = test_row(data, dents, network, j, i, &error, &check);
            if (status == SHCD_OK && watch != NULL) {
                watch(&check, user);
            }
        }
    }
    if (status == SHCD_OK) {
        fill_record(data, &error, &network->record);
    }
    free(error.force);
    return status;
}

static shcd_status examine_at(shcd_vec3 point, shcd_learned *network, shcd_error *error) {
    for (int i = 1; i <= DEPTHS; i++) {
        const double depth = network->depth_max_m * i / DEPTHS;
        shcd_learned_output out;
        const shcd_status status = shcd_learned_evaluate(network, point, depth, &out);
        if (status != SHCD_OK || out.direct_share > 0.0) {
            return status;
        }
        if (!(out.energy_j > 0.0) || !(out.force_n > 0.0)) {
            return shcdi_fit_fail(error, SHCD_ERR_CONVERGENCE,
                                  "train: at (%.4g, %.4g, %.4g) m the network does not resist a "
                                  "depth of %.3g m (%.3g J, %.3g N): more samples are needed",
                                  point.x, point.y, point.z, depth, out.energy_j, out.force_n);
        }
        const double k = 2.0 * out.energy_j / (depth * depth);
        shcd_learned_record *record = &network->record;
        record->stiffness_min_n_per_m = fmin(record->stiffness_min_n_per_m, k);
        record->stiffness_max_n_per_m = fmax(record->stiffness_max_n_per_m, k);
    }
    return SHCD_OK;
}

shcd_status shcdi_train_examine(const shcdi_train_data *data, const shcd_model *model,
                                shcd_learned *network, shcd_error *error) {
    const size_t n = model != NULL ? SCATTERED : 1;
    shcd_vec3 *w = malloc(n * sizeof *w);
    shcdi_train_place *place = malloc(n * sizeof *place);
    shcd_status status = w != NULL && place != NULL
                             ? SHCD_OK
                             : shcdi_fit_fail(error, SHCD_ERR_MEMORY, "train: out of memory");
    network->record.stiffness_min_n_per_m = (double)INFINITY;
    network->record.stiffness_max_n_per_m = 0.0;
    for (size_t i = 0; i < data->train.n_places && status == SHCD_OK; i++) {
        status = examine_at(data->train.place[i].point_m, network, error);
    }
    if (model != NULL && status == SHCD_OK) {
        status = shcdi_train_scatter(model, n, w, place);
        for (size_t i = 0; i < n && status == SHCD_OK; i++) {
            status = examine_at(place[i].point_m, network, error);
        }
    }
    free(w);
    free(place);
    return status;
}
