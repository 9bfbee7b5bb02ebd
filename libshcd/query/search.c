/* SPDX-License-Identifier: BSD-3-Clause */
/* The scan: all blocks' balls at once, then the leaves of the near ones, 16 at a time.
 *
 * |S(w) - p| >= d(p, ball) over a block, and >= d(p, flat triangle) - deviation over a leaf
 * (tree.c, view.h); scan_kernel.h accounts for rounding. A plain list of a few hundred balls is
 * faster than the upper levels of a tree: it is read in order, without a branch.
 *
 * A point far away is moved in along its ray from the origin o: with u the unit vector to it and T
 * its distance, |o + T u - x| - T falls with T and tends to -u.(x - o); for |x - o| <= 1 it is at
 * most 1/(2 (T - 1)) above that. So distances from the nearer point, plus the way moved, minus
 * that, are lower bounds.
 */
#include "query/search.h"

#include "query/patch.h"

/* [scaled lengths] where floats still resolve leaves */
#define FAR 512.0

void shcdi_search_prepare(shcdi_search *s, const shcdi_view *view, shcd_vec3 p,
                          const shcd_query_options *options, double *allowed) {
    const shcd_model_info *info = &view->model->info;
    const double to_centre = shcd_norm(shcd_sub(p, info->centre_m));
    const double relative = options->tolerance > 0.0 ? options->tolerance : 1e-9;
    s->view = view;
    s->p = p;
    s->slack = 2.0 * view->evaluation_error_m +
               16.0 * 2.2e-16 * (shcd_norm(p) + shcd_norm(info->centre_m) + view->radius_m);
    /* |p - c| - r is at most the distance: a tolerance relative to it is at most the one asked for
     */
    *allowed = relative * shcdi_max(view->diagonal_m, to_centre - view->radius_m);
    /* a third is left for finishing the foot, twice a quarter of the tolerance (newton.c) */
    s->tolerance = (2.0 / 3.0) * shcdi_max(*allowed - 2.5 * s->slack, 0.25 * *allowed);
    s->n_visited = 0;
    s->nearest = s->least = HUGE_VALF;
    s->nearest_leaf = 0;
    s->upper = s->expected = s->lower = s->leaves_lower = s->beyond_lower = HUGE_VAL;
    s->n_balls = 0;
    s->is_exact = options->tier == SHCD_TIER_EXACT;
    s->last_sign = s->truncated = s->not_stationary = s->bounds_only = 0;
    s->levels_max = SHCDI_SPLIT_LEVELS_MAX;
    s->best_room = s->moved_m = 0.0;
    s->n_evaluations = s->n_patches = s->n_newton = 0;
    s->patches_max = options->patches_max != 0 ? options->patches_max : SHCD_QUERY_PATCHES_DEFAULT;
    s->evaluations_max =
        options->evaluations_max != 0 ? options->evaluations_max : SHCD_QUERY_EVALUATIONS_DEFAULT;
}

/* Where the scan is, and the distances of all blocks. */
void shcdi_search_begin(shcdi_search *s, const shcdi_view *view, shcd_vec3 p,
                        const shcd_query_options *options, double *allowed) {
    const shcdi_index *index = view->index;
    shcdi_search_prepare(s, view, p, options, allowed);
    shcd_vec3 q = shcd_scale(index->scale, shcd_sub(p, index->origin));
    const double far = shcd_norm(q);
    s->offset_m = 0.0;
    if (far > FAR) {
        q = shcd_scale(FAR / far, q);
        const double extent = shcdi_max(1.0, view->radius_m * index->scale);
        s->offset_m =
            (far * (1.0 - 1e-15) - FAR - extent * extent / (2.0 * (FAR - extent))) / index->scale;
    }
    s->extent = (float)(shcd_norm(q) * (1.0 + 0x1p-22));
    s->at[0] = (float)q.x;
    s->at[1] = (float)q.y;
    s->at[2] = (float)q.z;
    const shcdi_ball_table balls = {view->positions.ball,
                                    view->positions.ball + index->n_balls,
                                    view->positions.ball + 2 * index->n_balls,
                                    view->positions.ball + 3 * index->n_balls,
                                    view->block_growth,
                                    index->n_balls};
    shcdi_scan_balls(view->series.simd, &balls, s->at, s->ball);
    for (size_t b = index->table.n_blocks; b < index->n_balls; b++) {
        s->ball[b] = HUGE_VALF;
    }
    s->n_patches += (uint32_t)(index->n_balls / SHCDI_BLOCK_LEAVES);
}

static double from_scan(const shcdi_search *s, float a) {
    return (double)a / s->view->index->scale + s->offset_m;
}

static float growth_of(const shcdi_search *s, size_t block) {
    const float *growth = s->view->block_growth;
    return growth != NULL ? growth[block] : 0.0f;
}

static void scan_block(const shcdi_search *s, size_t block, float lower[SHCDI_BLOCK_LEAVES],
                       float upper[SHCDI_BLOCK_LEAVES], float least[2]) {
    const shcdi_index *index = s->view->index;
    shcdi_scan_leaves(s->view->series.simd, &s->view->positions.block[block], &index->bounds[block],
                      s->at, growth_of(s, block), lower, upper, least);
}

static void visit_block(shcdi_search *s, size_t block) {
    float lower[SHCDI_BLOCK_LEAVES], upper[SHCDI_BLOCK_LEAVES], least[2];
    float *kept = s->n_visited < SHCDI_VISITS_KEPT ? s->kept[s->n_visited] : lower;
    scan_block(s, block, kept, upper, least);
    s->ball[block] = HUGE_VALF;
    s->visited[s->n_visited++] = (uint16_t)block;
    s->n_patches++;
    s->least = least[0] < s->least ? least[0] : s->least;
    if (least[1] < s->nearest) {
        size_t i = 0;
        while (upper[i] > least[1] && i < SHCDI_BLOCK_LEAVES - 1) {
            i++;
        }
        s->nearest = least[1];
        s->nearest_leaf = SHCDI_BLOCK_LEAVES * block + i;
    }
}

/* Lower bound of the distance to a block by its slab and its ball; rounding as in scan_kernel.h. In
 * double, since a root in float would be a call of libm's. */
static float block_lower(const shcdi_search *s, size_t b) {
    const shcdi_block *block = &s->view->positions.block[b];
    double x[3], h = 0.0, d2 = 0.0;
    for (int k = 0; k < 3; k++) {
        x[k] = (double)s->at[k] - (double)block->centre[k];
        h += x[k] * (double)block->normal[k];
        d2 += x[k] * x[k];
    }
    const double across = shcdi_max(0.0, fabs(h) - (double)block->thickness);
    const double along = shcdi_max(0.0, sqrt(shcdi_max(0.0, d2 - h * h)) - (double)block->width);
    const double noise = 0x1p-19 * (sqrt(d2) + (double)s->extent);
    const double lower = sqrt(across * across + along * along) - ((double)growth_of(s, b) + noise);
    return lower > (double)s->ball[b] ? (float)lower : s->ball[b];
}

/* All blocks nearer than `limit`, the nearest last. Beyond QUEUE_SORTED of them the order is left
 * to chance: it matters for time only. */
#define QUEUE_SORTED 64
static size_t fill_queue(shcdi_search *s, float limit) {
    const size_t n =
        shcdi_scan_below(s->view->series.simd, s->ball, s->view->index->n_balls, limit, s->queue);
    size_t kept = 0;
    for (size_t i = 0; i < n; i++) {
        const uint16_t block = s->queue[i];
        const float lower = block_lower(s, block);
        s->ball[block] = lower;
        if (lower < limit) {
            size_t at = kept++;
            const size_t end = at > QUEUE_SORTED ? at - QUEUE_SORTED : 0;
            for (; at > end && s->ball[s->queue[at - 1]] < lower; at--) {
                s->queue[at] = s->queue[at - 1];
            }
            s->queue[at] = block;
        }
    }
    return kept;
}

static double beyond(const shcdi_search *s) {
    const size_t n = s->view->index->n_balls;
    return from_scan(s, s->ball[shcdi_scan_least(s->view->series.simd, s->ball, n)]);
}

void shcdi_search_scan(shcdi_search *s) {
    const size_t n = s->view->index->n_balls;
    visit_block(s, shcdi_scan_least(s->view->series.simd, s->ball, n));
    size_t left = fill_queue(s, s->nearest);
    while (left > 0 && s->n_patches < s->patches_max) {
        const uint16_t block = s->queue[--left];
        if (s->ball[block] < s->nearest) {
            visit_block(s, block);
        }
    }
    /* what is left is farther than the nearest leaf's far side */
    s->beyond_lower = left == 0 ? from_scan(s, s->nearest) : beyond(s);
    s->leaves_lower = shcdi_min(from_scan(s, s->least), s->beyond_lower);
}

void shcdi_search_scan_to(shcdi_search *s, double limit_m) {
    const float limit = (float)((limit_m - s->offset_m) * s->view->index->scale * (1.0 + 0x1p-22));
    size_t left = fill_queue(s, limit);
    while (left > 0 && s->n_patches < s->patches_max) {
        visit_block(s, s->queue[--left]);
    }
    s->beyond_lower = beyond(s);
    s->leaves_lower = shcdi_min(from_scan(s, s->least), s->beyond_lower);
}

int shcdi_survivors_next(shcdi_search *s, shcdi_survivors *it, size_t *leaf, double *lower) {
    while (it->at == it->n) {
        if (it->visit == s->n_visited) {
            return 0;
        }
        /* all that were kept at once, others block by block */
        it->first = it->visit;
        it->lower = s->kept[0];
        size_t blocks = s->n_visited < SHCDI_VISITS_KEPT ? s->n_visited : SHCDI_VISITS_KEPT;
        if (it->visit >= SHCDI_VISITS_KEPT) {
            float upper[SHCDI_BLOCK_LEAVES], least[2];
            scan_block(s, s->visited[it->visit], it->again, upper, least);
            it->lower = it->again;
            blocks = 1;
        }
        it->visit += blocks;
        it->at = 0;
        it->n = shcdi_scan_below(s->view->series.simd, it->lower, blocks * SHCDI_BLOCK_LEAVES,
                                 it->limit, it->index);
    }
    const size_t i = it->index[it->at++];
    *leaf = SHCDI_BLOCK_LEAVES * (size_t)s->visited[it->first + i / SHCDI_BLOCK_LEAVES] +
            i % SHCDI_BLOCK_LEAVES;
    *lower = from_scan(s, it->lower[i]);
    return 1;
}

void shcdi_survivors_begin(shcdi_search *s, shcdi_survivors *it, double limit_m) {
    it->limit = (float)((limit_m - s->offset_m) * s->view->index->scale * (1.0 + 0x1p-22));
    it->at = it->n = it->visit = it->first = 0;
    it->lower = NULL;
    /* leaves that are not below the limit */
    shcdi_search_drop(s, limit_m);
}

shcd_vec3 shcdi_search_start(const shcdi_search *s) {
    shcd_vec3 x[3], w = {0.0, 0.0, 0.0};
    double b[3];
    shcdi_view_triangle(s->view, s->nearest_leaf, x);
    (void)shcdi_triangle_distance(s->p, x, b);
    for (int k = 0; k < 3; k++) {
        w = shcd_mul_add(w, b[k], shcdi_view_corner(s->view, s->nearest_leaf, k));
    }
    return shcd_unit(w);
}
