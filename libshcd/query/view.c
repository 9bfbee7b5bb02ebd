/* SPDX-License-Identifier: BSD-3-Clause */
/* The current surface as queries see it. */
#include "query/view.h"

#include "query/patch.h"
#include "query/shape.h"

#include <string.h>

void shcdi_view_of(const shcd_model *model, const shcd_shape *shape, shcdi_view *view) {
    view->model = model;
    view->index = &model->index;
    view->positions = model->index.rest;
    view->series = model->series;
    view->evaluation_error_m = model->evaluation_error_m;
    view->radius_m = model->info.radius_m;
    view->diagonal_m = model->info.diagonal_m;
    view->is_embedded = model->info.is_embedded;
    view->deviation_growth_m = view->parting_m = 0.0;
    view->block_growth = NULL;
    memset(view->growth, 0, sizeof view->growth);
    if (shape != NULL) {
        memcpy(view->growth, shape->displacement, sizeof view->growth);
        view->series.packed = shape->value + shape->packed_at;
        view->evaluation_error_m = shape->evaluation_error_m;
        view->radius_m += shape->displacement[0];
        view->block_growth = shcdi_shape_growths(shape);
        view->deviation_growth_m = shape->growth_m;
        view->parting_m = shape->is_uniform ? 0.0 : 2.0 * shape->inflation_m;
        view->positions = shcdi_positions_at(&model->index, shape->value + shape->position_at);
        /* the share of pairs (a, b) that come closest to touching, |S(a) - S(b)| per angle, falls
         * by at most B_1: an embedded surface stays one while that is above 0 */
        view->is_embedded = view->is_embedded && shape->displacement[1] < model->spread_m;
    }
}

size_t shcdi_view_block_count(const shcdi_view *view) {
    return view->index->table.n_blocks;
}

static shcd_vec3 from_index(const shcdi_index *index, const double x[3]) {
    return shcd_mul_add(index->origin, 1.0 / index->scale, shcd_vec3_make(x[0], x[1], x[2]));
}

double shcdi_view_block_ball(const shcdi_view *view, size_t block, shcd_vec3 *centre) {
    const shcdi_index *index = view->index;
    const float *ball = view->positions.ball;
    const double x[3] = {(double)ball[block], (double)ball[index->n_balls + block],
                         (double)ball[2 * index->n_balls + block]};
    *centre = from_index(index, x);
    return (double)ball[3 * index->n_balls + block] / index->scale + shcdi_view_growth(view, block);
}

void shcdi_view_leaf_bounds(const shcdi_view *view, size_t leaf, shcdi_leaf_bounds *out) {
    const shcdi_index *index = view->index;
    const shcdi_block_bounds *b = &index->bounds[leaf / SHCDI_BLOCK_LEAVES];
    const size_t g = leaf % SHCDI_BLOCK_LEAVES / 4;
    const double unit = 1.0 / index->scale;
    const double m1 = (double)shcdi_from_half(b->m1[g]) * unit;
    const double m2 = (double)shcdi_from_half(b->m2[g]) * unit;
    out->m1 = m1 + view->growth[1];
    out->m2 = m2 + view->growth[2];
    out->product = (double)shcdi_from_half(b->product[g]) * unit * unit +
                   view->growth[1] * (m2 + view->growth[2]) + view->growth[2] * m1;
    out->m3 = (double)shcdi_from_half(b->m3[g]) * unit + view->growth[3];
    out->sigma = shcdi_max(0.0, (double)shcdi_from_half(b->sigma[g]) * unit - view->growth[1]);
    out->reach = index->table.reach;
}

void shcdi_view_triangle(const shcdi_view *view, size_t leaf, shcd_vec3 x[3]) {
    const shcdi_block *block = &view->positions.block[leaf / SHCDI_BLOCK_LEAVES];
    const double unit = (double)block->unit;
    for (int k = 0; k < 3; k++) {
        const size_t node = shcdi_block_corner[k][leaf % SHCDI_BLOCK_LEAVES];
        double at[3];
        for (int c = 0; c < 3; c++) {
            at[c] = (double)block->centre[c] + unit * (double)block->q[c][node];
        }
        x[k] = from_index(view->index, at);
    }
}

double shcdi_view_deviation(const shcdi_view *view, size_t leaf) {
    const shcdi_index *index = view->index;
    const size_t b = leaf / SHCDI_BLOCK_LEAVES, i = leaf % SHCDI_BLOCK_LEAVES;
    const double unit = (double)view->positions.block[b].unit;
    return ((double)shcdi_from_half(index->bounds[b].deviation[i]) +
            (double)SHCDI_GRID_ERROR * unit) /
               index->scale +
           shcdi_view_growth(view, b) + 4e-16 * (shcd_norm(index->origin) + 1.0 / index->scale);
}

void shcdi_view_leaf_at(const shcdi_view *view, size_t leaf, shcdi_view_leaf *out) {
    shcdi_leaf_bounds bounds;
    shcd_vec3 w[3];
    shcdi_view_triangle(view, leaf, out->x);
    for (int k = 0; k < 3; k++) {
        w[k] = shcdi_view_corner(view, leaf, k);
        out->w[k] = w[k];
    }
    out->deviation_m = shcdi_view_deviation(view, leaf);
    out->centre = shcdi_cap_of(w, &out->angle);
    shcdi_view_leaf_bounds(view, leaf, &bounds);
    out->m1 = bounds.m1;
    out->m2 = bounds.m2;
    out->m3 = bounds.m3;
    out->sigma = bounds.sigma;
    out->product = bounds.product;
    out->reach = bounds.reach;
}

/* Descends with the midpoints that the tree was built from. */
size_t shcdi_view_leaf_of(const shcdi_view *view, shcd_vec3 w) {
    return shcdi_leaf_of(view->index->table.level, w);
}
