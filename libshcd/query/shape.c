/* SPDX-License-Identifier: BSD-3-Clause */
/* The current shape: coefficients in, bounds that follow (view.h tells how). */
#include "query/shape.h"

#include "model/norms.h"
#include "query/view.h"

#include <string.h>

/* Refresh when what is stale exceeds this share of the leaves' largest deviation: from there on the
 * extra leaves that a search has to settle cost more than the next refresh saves. */
#define STALE_SHARE 0.5
/* Of the same: blocks that are stale by less are left as they are. */
#define PROGRESS_SHARE 0.1

static size_t aligned(size_t n) {
    return (n + 1) & ~(size_t)1; /* in doubles: 16 bytes */
}

static size_t coefficient_count(const shcd_model *model) {
    return aligned(3 * SHCD_COUNT(model->degree));
}

static size_t growth_count(const shcd_model *model) {
    return model->index.n_balls / 2; /* floats */
}

static size_t ellipsoid_count(const shcd_model *model) {
    return model->degree == 1 ? aligned(sizeof(shcdi_ellipsoid) / sizeof(double)) : 0;
}

static size_t value_count(const shcd_model *model) {
    return 2 * coefficient_count(model) + aligned(shcdi_packed_size(model->degree)) +
           growth_count(model) + aligned(shcdi_positions_bytes(&model->index) / sizeof(double)) +
           ellipsoid_count(model);
}

const shcdi_ellipsoid *shcdi_shape_ellipsoid(const shcd_model *model, const shcd_shape *shape) {
    union {
        const double *given;
        const shcdi_ellipsoid *ellipsoid;
    } at = {shape->value + (value_count(model) - ellipsoid_count(model))};
    return at.ellipsoid;
}

static void take_half_axes(const shcd_model *model, shcd_shape *shape) {
    if (model->degree == 1) {
        shcdi_ellipsoid made;
        shcdi_ellipsoid_make(shape->value, &made);
        memcpy(shape->value + (value_count(model) - ellipsoid_count(model)), &made, sizeof made);
    }
}

/* ---- how positions follow ----
 *
 * Uniform: all positions stem from the coefficients kept as the tree's, and what they are stale by
 * is B_0(current - tree). Otherwise each sector stems from a call of its own, whose coefficients
 * are not kept: since B_0 is a norm, what a sector is stale by is at most the sum of B_0 over the
 * changes since, a difference of two values of path[0], which is rounded up as it is summed. */

/* All of the current surface lies within this of the index's origin. */
static double reach_of(const shcd_model *model, const shcd_shape *shape) {
    return model->info.radius_m + shape->displacement[0];
}

static size_t blocks_of_sector(const shcdi_index_table *table, size_t sector) {
    return (size_t)table->sector_at[sector + 1] - (size_t)table->sector_at[sector];
}

/* What leaves whose positions are evaluated from the current coefficients deviate by more than at
 * rest (view.h). */
static double tree_growth(const shcd_model *model, const shcd_shape *shape) {
    const shcdi_index_table *table = &model->index.table;
    const double *displacement = shape->displacement;
    return (table->per_first * displacement[1] + table->per_second * displacement[2]) *
               (1.0 + 1e-15) +
           2.0 * shape->evaluation_error_m;
}

static double sector_stale(const shcd_shape *shape, size_t sector) {
    return (shape->path[0] - shape->sector[sector].path_m) * (1.0 + 4e-16);
}

static float scaled_up(const shcd_model *model, double growth_m) {
    return (float)(growth_m * model->index.scale * (1.0 + 0x1p-22));
}

static void update_growths(const shcd_model *model, shcd_shape *shape) {
    const shcdi_index *index = &model->index;
    const shcdi_index_table *table = &index->table;
    float *growth = shcdi_shape_growths(shape);
    if (shape->is_uniform) {
        shape->inflation_m = shape->stale[0];
        shape->growth_m = shape->stale[0] + shape->tree_m;
        const float same = scaled_up(model, shape->growth_m);
        for (size_t b = 0; b < index->n_balls; b++) {
            growth[b] = same;
        }
        return;
    }
    shape->inflation_m = shape->growth_m = 0.0;
    for (size_t q = 0; q < table->n_sectors; q++) {
        const double stale = sector_stale(shape, q), sum = stale + shape->sector[q].tree_m;
        const float same = scaled_up(model, sum);
        shape->inflation_m = shcdi_max(shape->inflation_m, stale);
        shape->growth_m = shcdi_max(shape->growth_m, sum);
        for (size_t t = table->sector_at[q]; t < table->sector_at[q + 1]; t++) {
            growth[table->sector_block[t]] = same;
        }
    }
}

static shcdi_series series_of(const shcd_model *model, const shcd_shape *shape) {
    shcdi_series series = model->series;
    series.packed = shape->value + shape->packed_at;
    return series;
}

static void refresh(const shcd_model *model, shcd_shape *shape) {
    const shcdi_series series = series_of(model, shape);
    shcdi_positions positions =
        shcdi_positions_at(&model->index, shape->value + shape->position_at);
    shcdi_positions_fill(&model->index, &series, reach_of(model, shape), &positions);
    memcpy(shape->value + shape->tree_at, shape->value,
           3 * SHCD_COUNT(model->degree) * sizeof(double));
    shape->tree_m = tree_growth(model, shape);
    memset(shape->stale, 0, sizeof shape->stale);
    shape->is_uniform = 1;
    shape->n_refreshes++;
    shape->n_blocks_evaluated += model->index.table.n_blocks;
}

/* From now on each sector stands for itself. */
static void part_sectors(const shcd_model *model, shcd_shape *shape) {
    for (size_t q = 0; q < model->index.table.n_sectors; q++) {
        shape->sector[q].path_m = shape->path[0] * (1.0 - 4e-16) - shape->stale[0] * (1.0 + 4e-16);
        shape->sector[q].tree_m = shape->tree_m;
    }
    shape->is_uniform = 0;
    shape->next_sector = 0;
}

static void refresh_some(const shcd_model *model, shcd_shape *shape) {
    const double least = PROGRESS_SHARE * model->info.max_deviation_m;
    const shcdi_index_table *table = &model->index.table;
    const shcdi_series series = series_of(model, shape);
    shcdi_positions positions =
        shcdi_positions_at(&model->index, shape->value + shape->position_at);
    if (shape->is_uniform && shape->stale[0] > least) {
        part_sectors(model, shape);
    }
    const size_t q = shape->next_sector;
    if (shape->is_uniform || !(sector_stale(shape, q) > least)) {
        return;
    }
    shcdi_positions_fill_sector(&model->index, &series, reach_of(model, shape), q, &positions);
    shape->sector[q].path_m = shape->path[0];
    shape->sector[q].tree_m = tree_growth(model, shape);
    shape->n_blocks_evaluated += blocks_of_sector(table, q);
    shape->next_sector = (uint32_t)((q + 1) % table->n_sectors);
}

/* ---- the shape ---- */

size_t shcd_shape_size(const shcd_model *model) {
    return model != NULL ? sizeof(shcd_shape) + value_count(model) * sizeof(double) : 0;
}

shcd_status shcd_shape_init(const shcd_model *model, void *memory, size_t size,
                            shcd_shape **shape) {
    if (model == NULL || memory == NULL || shape == NULL || size < shcd_shape_size(model) ||
        (uintptr_t)memory % 16 != 0) {
        return SHCD_ERR_ARGUMENT;
    }
    shcd_shape *made = memory;
    const size_t n = 3 * SHCD_COUNT(model->degree);
    memset(made, 0, shcd_shape_size(model));
    made->size = shcd_shape_size(model);
    made->tree_at = coefficient_count(model);
    made->packed_at = 2 * coefficient_count(model);
    made->growth_at = made->packed_at + aligned(shcdi_packed_size(model->degree));
    made->position_at = made->growth_at + growth_count(model);
    made->evaluation_error_m = model->evaluation_error_m;
    made->is_uniform = 1;
    memcpy(made->value, model->coefficients, n * sizeof(double));
    memcpy(made->value + made->tree_at, model->coefficients, n * sizeof(double));
    shcdi_pack(model->degree, model->coefficients, made->value + made->packed_at);
    memcpy(made->value + made->position_at, model->index.rest.block,
           shcdi_positions_bytes(&model->index));
    made->tree_m = tree_growth(model, made);
    update_growths(model, made);
    take_half_axes(model, made);
    *shape = made;
    return SHCD_OK;
}

/* Without a branch, so that it is done in vectors. */
static int are_finite(const double *coefficients, size_t n) {
    int bad = 0;
    for (size_t i = 0; i < n; i++) {
        bad |= !(fabs(coefficients[i]) <= SHCDI_COEFFICIENT_MAX);
    }
    return !bad;
}

/* What the new coefficients are away from the current ones, from rest, and from the tree's. What
 * rounds an evaluation is a sum of norms: it exceeds that at rest by no more than that of the
 * difference. */
static void take_norms(const shcd_model *model, shcd_shape *shape, const double *coefficients) {
    const double *factors = shcdi_series_factors(&model->series);
    const int simd = model->series.simd, degree = model->degree;
    double sum[SHCDI_NORMS];
    shcdi_norms(simd, factors, degree, coefficients, shape->value, sum);
    for (int k = 0; k < 4; k++) {
        shape->path[k] = (shape->path[k] + sum[k]) * (1.0 + 4e-16);
    }
    shcdi_norms(simd, factors, degree, coefficients, model->coefficients, sum);
    memcpy(shape->displacement, sum, sizeof shape->displacement);
    shape->evaluation_error_m = (model->evaluation_error_m + sum[4]) * (1.0 + 1e-15);
    if (shape->is_uniform) {
        shcdi_norms(simd, factors, degree, coefficients, shape->value + shape->tree_at, sum);
        memcpy(shape->stale, sum, sizeof shape->stale);
    }
}

shcd_status shcd_shape_set(const shcd_model *model, shcd_shape *shape, const double *coefficients,
                           int follow) {
    if (model == NULL || shape == NULL || coefficients == NULL ||
        shape->size != shcd_shape_size(model) || follow < SHCD_FOLLOW_AUTO ||
        follow > SHCD_FOLLOW_PROGRESSIVE) {
        return SHCD_ERR_ARGUMENT;
    }
    const size_t n = 3 * SHCD_COUNT(model->degree);
    if (!are_finite(coefficients, n)) {
        return SHCD_ERR_NOT_FINITE;
    }
    take_norms(model, shape, coefficients);
    memcpy(shape->value, coefficients, n * sizeof(double));
    shcdi_pack_for(&model->series, coefficients, shape->value + shape->packed_at);
    take_half_axes(model, shape);
    shape->n_sets++;
    if (follow == SHCD_FOLLOW_PROGRESSIVE) {
        refresh_some(model, shape);
    }
    update_growths(model, shape);
    if (follow == SHCD_FOLLOW_REFRESH ||
        (follow == SHCD_FOLLOW_AUTO &&
         shape->inflation_m > STALE_SHARE * model->info.max_deviation_m)) {
        refresh(model, shape);
        update_growths(model, shape);
    }
    return SHCD_OK;
}

const double *shcd_shape_coefficients(const shcd_shape *shape) {
    return shape != NULL ? shape->value : NULL;
}

shcd_status shcd_shape_describe(const shcd_model *model, const shcd_shape *shape,
                                shcd_shape_info *info) {
    if (model == NULL || shape == NULL || info == NULL ||
        info->struct_size < sizeof info->struct_size || shape->size != shcd_shape_size(model)) {
        return SHCD_ERR_ARGUMENT;
    }
    shcd_shape_info all = SHCD_SHAPE_INFO_INIT;
    memcpy(all.displacement_bound, shape->displacement, sizeof all.displacement_bound);
    all.inflation_m = shape->inflation_m;
    all.radius_m = model->info.radius_m + shape->displacement[0];
    all.n_sets = shape->n_sets;
    all.n_refreshes = shape->n_refreshes;
    all.n_blocks = model->index.table.n_blocks;
    all.n_blocks_evaluated = shape->n_blocks_evaluated;
    for (size_t q = 0; q < model->index.table.n_sectors; q++) {
        const size_t n = blocks_of_sector(&model->index.table, q);
        all.blocks_per_call = n > all.blocks_per_call ? n : all.blocks_per_call;
    }
    const size_t size = info->struct_size < sizeof all ? info->struct_size : sizeof all;
    memcpy((char *)info + sizeof(size_t), (const char *)&all + sizeof(size_t),
           size - sizeof(size_t));
    return SHCD_OK;
}

shcd_status shcd_shape_surface(const shcd_model *model, const shcd_shape *shape,
                               shcd_vec3 parameter, shcd_vec3 *point, shcd_vec3 *normal,
                               double *jacobian) {
    if (model == NULL || shape == NULL) {
        return SHCD_ERR_ARGUMENT;
    }
    const shcdi_series series = series_of(model, shape);
    return shcdi_surface_values(&series, model->degree, parameter, point, normal, jacobian);
}
