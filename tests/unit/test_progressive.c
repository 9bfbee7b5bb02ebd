/* SPDX-License-Identifier: BSD-3-Clause */
/* SHCD_FOLLOW_PROGRESSIVE: positions of the query tree from several moments at once. How much is
 * done in a call, and that every bound holds in mid-pass. */
#include "query/growth.h"
#include "query/patch.h"
#include "query/view.h"
#include "query/winding.h"
#include "support/shapes.h"

#define SEED 20261122u
#define TOP 30
#define ORDERS 4

/* A travelling wave of the surface, as a tick would set it. */
static void set_wave(const shcd_model *model, shcd_shape *shape, double size, int tick,
                     int follow) {
    static double c[3 * SHCD_COUNT(TOP)];
    const double *rest = shcd_model_coefficients(model);
    const int degree = shcd_model_degree(model);
    for (int l = 0; l <= degree; l++) {
        for (size_t i = 3 * SHCD_INDEX(l, -l); i < 3 * SHCD_INDEX(l, l) + 3; i++) {
            c[i] = rest[i] + size / ((l + 1.0) * (l + 1.0)) * sin(0.05 * tick + (double)i);
        }
    }
    assert_int_equal(shcd_shape_set(model, shape, c, follow), SHCD_OK);
}

/* Every call evaluates at most its share, all blocks have their turn, what they are stale by stays
 * within a pass's motion, and none is evaluated while nothing moves. */
static void test_progressive_refreshes_share_the_work(void **state) {
    static const struct {
        int degree;
        uint64_t share; /* of the blocks, at least */
    } cases[] = {{2, 1}, {6, 4}, {9, 4}, {15, 4}, {20, 12}};
    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        check_random random = {SEED + 7 + k};
        shcd_model *model = bodies_create_random(&random, cases[k].degree, 0.05);
        const double deviation = bodies_info(model).max_deviation_m;
        shcd_shape *shape = shapes_create(model);
        shcd_shape_info before = shapes_info(model, shape);
        const uint64_t share = before.blocks_per_call;
        double moved[64] = {0.0};
        assert_true(share >= 1 && share <= before.n_blocks);
        /* sectors differ by less than an eighth of the tree's first octant */
        assert_true(share <= before.n_blocks / cases[k].share + before.n_blocks / 8);
        for (int tick = 1; tick <= 400; tick++) {
            double old[3 * SHCD_COUNT(TOP)], growth[ORDERS];
            const size_t n = 3 * SHCD_COUNT(cases[k].degree);
            memcpy(old, shcd_shape_coefficients(shape), n * sizeof *old);
            set_wave(model, shape, 3.0 * deviation, tick, SHCD_FOLLOW_PROGRESSIVE);
            const shcd_shape_info after = shapes_info(model, shape);
            shcdi_growth(cases[k].degree, shcd_shape_coefficients(shape), old, growth);
            memmove(moved + 1, moved, sizeof moved - sizeof *moved);
            moved[0] = growth[0];
            assert_true(after.n_blocks_evaluated - before.n_blocks_evaluated <= share);
            assert_int_equal(after.n_refreshes, 0);
            /* a pass takes n_blocks/share calls, a few more where sectors differ in size */
            double way = 0.0;
            const uint64_t calls = 2 * ((before.n_blocks + share - 1) / share);
            for (uint64_t i = 0; i < calls; i++) {
                way += moved[i];
            }
            assert_at_most(after.inflation_m, way * (1.0 + 1e-9) + 0.101 * deviation);
            before = after;
        }
        assert_true(before.n_blocks_evaluated >= 4 * before.n_blocks);
        /* it comes to rest: a pass at most, then nothing */
        for (int tick = 0; tick < 40; tick++) {
            set_wave(model, shape, 3.0 * deviation, 400, SHCD_FOLLOW_PROGRESSIVE);
        }
        const shcd_shape_info rest = shapes_info(model, shape);
        assert_true(rest.n_blocks_evaluated <= before.n_blocks_evaluated + before.n_blocks);
        assert_at_most(rest.inflation_m, 0.101 * deviation);
        set_wave(model, shape, 3.0 * deviation, 400, SHCD_FOLLOW_PROGRESSIVE);
        assert_true(shapes_info(model, shape).n_blocks_evaluated == rest.n_blocks_evaluated);
        free(shape);
        shcd_model_free(model);
    }
}

/* Whatever moments the positions stem from, every leaf holds the surface, and the winding number
 * and a copy made in mid-pass answer alike. */
static void test_progressive_bounds_hold_in_mid_pass(void **state) {
    (void)state;
    check_random random = {SEED + 20};
    shcd_model *model = bodies_create_random(&random, 15, 0.05);
    const shcd_model_info info = bodies_info(model);
    const size_t size = shcd_shape_size(model);
    shcd_shape *shape = shapes_create(model);
    int mixed = 0, decided = 0;
    for (int tick = 1; tick <= 60; tick++) {
        const int follow = tick % 23 == 0  ? SHCD_FOLLOW_REFRESH
                           : tick % 7 == 0 ? SHCD_FOLLOW_INFLATE
                                           : SHCD_FOLLOW_PROGRESSIVE;
        shcdi_view view;
        set_wave(model, shape, 4.0 * info.max_deviation_m, 3 * tick, follow);
        shcdi_view_of(model, shape, &view);
        mixed += view.parting_m > 0.0;
        for (int k = 0; k < 400; k++) {
            const shcd_vec3 w = bodies_random_direction(&random), s = shcdi_view_point(&view, w);
            const size_t leaf = shcdi_view_leaf_of(&view, w);
            shcdi_view_leaf at;
            shcd_vec3 centre;
            double b[3];
            shcdi_view_leaf_at(&view, leaf, &at);
            assert_at_most(shcdi_triangle_distance(s, at.x, b), at.deviation_m);
            const double radius = shcdi_view_block_ball(&view, leaf / SHCDI_BLOCK_LEAVES, &centre);
            assert_at_most(shcd_norm(shcd_sub(s, centre)), radius);
        }
        const shcd_vec3 p = shapes_point_near(&random, &info);
        const double far = fabs(shcd_norm(shcd_sub(p, info.centre_m)));
        int winding;
        uint32_t n_patches = 0;
        if ((far < 0.3 * info.radius_m || far > 1.4 * info.radius_m) &&
            shcdi_winding(&view, p, &winding, &n_patches)) {
            assert_int_equal(winding, far < info.radius_m);
            decided++;
        }
        if (tick % 10 == 5) {
            shcd_shape *copy = memcpy(shapes_block(model), shape, size);
            shapes_assert_same_answers(model, shape, copy, &random);
            set_wave(model, shape, info.max_deviation_m, tick, SHCD_FOLLOW_PROGRESSIVE);
            set_wave(model, copy, info.max_deviation_m, tick, SHCD_FOLLOW_PROGRESSIVE);
            assert_memory_equal(shape, copy, size);
            free(copy);
        }
    }
    assert_true(mixed > 20 && decided > 5);
    free(shape);
    shcd_model_free(model);
}

/* Every node of every cut of the tree, at rest and far away from it, within the error of its
 * block's grid. */
static void test_nodes_are_where_the_surface_is(void **state) {
    static const int degree[] = {1, 4, 9, 15, 16, 30, 41};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        check_random random = {SEED + 40 + d};
        shcd_model *model = bodies_create_random(&random, degree[d], 0.05);
        const size_t n = 3 * SHCD_COUNT(degree[d]);
        shcd_shape *shape = shapes_create(model);
        double *c = malloc(n * sizeof *c), worst = 0.0;
        assert_non_null(c);
        for (int round = 0; round < 3; round++) {
            const double factor = round == 0 ? 1.0 : round == 1 ? 37.0 : -0.01;
            shcdi_view view;
            for (size_t i = 0; i < n; i++) {
                c[i] = factor * shcd_model_coefficients(model)[i];
            }
            assert_int_equal(shcd_shape_set(model, shape, c, SHCD_FOLLOW_REFRESH), SHCD_OK);
            shcdi_view_of(model, shape, &view);
            const shcdi_index *index = view.index;
            const double rounding = 4.0 * view.evaluation_error_m * index->scale;
            for (size_t b = 0; b < index->table.n_blocks; b++) {
                const shcdi_block *block = &view.positions.block[b];
                for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
                    const size_t node = index->table.node[SHCDI_BLOCK_NODES * b + i];
                    const shcd_vec3 s = shcdi_view_point(&view, index->table.direction[node]);
                    const shcd_vec3 at = shcd_scale(index->scale, shcd_sub(s, index->origin));
                    const double unit = (double)block->unit;
                    const shcd_vec3 off = {
                        (double)block->centre[0] + unit * (double)block->q[0][i] - at.x,
                        (double)block->centre[1] + unit * (double)block->q[1][i] - at.y,
                        (double)block->centre[2] + unit * (double)block->q[2][i] - at.z};
                    assert_at_most(shcd_norm(off), (double)SHCDI_GRID_ERROR * unit + rounding);
                    worst = fmax(worst, shcd_norm(off) / unit);
                }
            }
        }
        assert_true(worst > 0.4);
        free(c);
        free(shape);
        shcd_model_free(model);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_progressive_refreshes_share_the_work),
        cmocka_unit_test(test_progressive_bounds_hold_in_mid_pass),
        cmocka_unit_test(test_nodes_are_where_the_surface_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
