/* SPDX-License-Identifier: BSD-3-Clause */
/* The current shape: coefficients in, bounds that follow (view.h tells how). */
#include "query/shape.h"

#include "query/growth.h"
#include "query/view.h"

#include <string.h>

/* Refresh when what is stale exceeds this share of the leaves' largest deviation: from there on the
 * extra leaves that a search has to settle cost more than the next refresh saves. */
#define STALE_SHARE 0.5

static size_t aligned(size_t n) {
    return (n + 1) & ~(size_t)1; /* in doubles: 16 bytes */
}

static size_t coefficient_count(const shcd_model *model) {
    return aligned(3 * SHCD_COUNT(model->degree));
}

static size_t value_count(const shcd_model *model) {
    return 2 * coefficient_count(model) + aligned(shcdi_packed_size(model->degree)) +
           aligned(shcdi_positions_bytes(&model->index) / sizeof(double));
}

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
    made->position_at = made->packed_at + aligned(shcdi_packed_size(model->degree));
    made->evaluation_error_m = model->evaluation_error_m;
    memcpy(made->value, model->coefficients, n * sizeof(double));
    memcpy(made->value + made->tree_at, model->coefficients, n * sizeof(double));
    shcdi_pack(model->degree, model->coefficients, made->value + made->packed_at);
    *shape = made;
    return SHCD_OK;
}

static void refresh(const shcd_model *model, shcd_shape *shape) {
    shcdi_series series = model->series;
    series.packed = shape->value + shape->packed_at;
    shcdi_positions positions =
        shcdi_positions_at(&model->index, shape->value + shape->position_at);
    shcdi_positions_fill(&model->index, &series, &positions);
    memcpy(shape->value + shape->tree_at, shape->value,
           3 * SHCD_COUNT(model->degree) * sizeof(double));
    memcpy(shape->tree, shape->displacement, sizeof shape->tree);
    memset(shape->stale, 0, sizeof shape->stale);
    shape->n_refreshes++;
}

shcd_status shcd_shape_set(const shcd_model *model, shcd_shape *shape, const double *coefficients,
                           int follow) {
    if (model == NULL || shape == NULL || coefficients == NULL ||
        shape->size != shcd_shape_size(model) || follow < SHCD_FOLLOW_AUTO ||
        follow > SHCD_FOLLOW_REFRESH) {
        return SHCD_ERR_ARGUMENT;
    }
    const int degree = model->degree;
    const size_t n = 3 * SHCD_COUNT(degree);
    for (size_t i = 0; i < n; i++) {
        if (!(fabs(coefficients[i]) <= SHCDI_COEFFICIENT_MAX)) {
            return SHCD_ERR_NOT_FINITE;
        }
    }
    double step[4];
    shcdi_growth(degree, coefficients, shape->value, step);
    for (int k = 0; k < 4; k++) {
        shape->path[k] = (shape->path[k] + step[k]) * (1.0 + 4e-16);
    }
    shcdi_growth(degree, coefficients, model->coefficients, shape->displacement);
    shcdi_growth(degree, coefficients, shape->value + shape->tree_at, shape->stale);
    memcpy(shape->value, coefficients, n * sizeof(double));
    shcdi_pack_for(&model->series, coefficients, shape->value + shape->packed_at);
    shape->evaluation_error_m = shcdi_evaluation_error(coefficients, degree);
    shape->n_sets++;
    if (follow == SHCD_FOLLOW_REFRESH ||
        (follow == SHCD_FOLLOW_AUTO &&
         shape->stale[0] > STALE_SHARE * model->info.max_deviation_m)) {
        refresh(model, shape);
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
    all.inflation_m = shape->stale[0];
    all.radius_m = model->info.radius_m + shape->displacement[0];
    all.n_sets = shape->n_sets;
    all.n_refreshes = shape->n_refreshes;
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
    shcdi_series series = model->series;
    series.packed = shape->value + shape->packed_at;
    return shcdi_surface_values(&series, model->degree, parameter, point, normal, jacobian);
}
