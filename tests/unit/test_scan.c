/* SPDX-License-Identifier: BSD-3-Clause */
/* The scans that every search begins with, and the view that queries have of a model: bounds
 * against dense samples of the surface, and the same bits on every compiled path. */
#include "model/scan.h"
#include "query/patch.h"
#include "query/view.h"
#include "support/bodies.h"
#include "support/check.h"
#include "support/derivatives.h"

#define LEAVES SHCDI_BLOCK_LEAVES
#define N_PATHS 3

static const int path_of[N_PATHS] = {SHCD_SIMD_PORTABLE, SHCD_SIMD_AVX2, SHCD_SIMD_AVX512};

static int has_path(int k) {
    return k == 0 || shcdi_simd_choose(path_of[k]) == path_of[k];
}

static shcdi_view view_of(const shcd_model *model) {
    shcdi_view view;
    shcdi_view_of(model, NULL, &view);
    return view;
}

/* In, on and far from the body, as the scans take it. */
static void random_at(const shcdi_view *view, check_random *random, size_t i, float at[3]) {
    const shcd_vec3 w = bodies_random_direction(random);
    const shcd_vec3 s =
        shcd_scale(view->index->scale, shcd_sub(shcdi_view_point(view, w), view->index->origin));
    static const double away[4] = {0.0, 1e-4, 0.3, 30.0};
    const shcd_vec3 p = shcd_mul_add(s, away[i % 4], bodies_random_direction(random));
    at[0] = (float)p.x;
    at[1] = (float)p.y;
    at[2] = (float)p.z;
}

static shcd_vec3 place_of(const shcdi_view *view, const float at[3]) {
    const shcd_vec3 q = {(double)at[0], (double)at[1], (double)at[2]};
    return shcd_mul_add(view->index->origin, 1.0 / view->index->scale, q);
}

static shcdi_ball_table balls_of(const shcdi_view *view) {
    const size_t n = view->index->n_balls;
    const float *b = view->positions.ball;
    const shcdi_ball_table table = {b, b + n, b + 2 * n, b + 3 * n, NULL, n};
    return table;
}

/* Distance from p to the surface of a leaf, sampled on a grid; *margin: to its nearest point from
 * the next sample. A part of an n-th of the edges lies within 1.3 R/n of its corners, R the leaf's
 * own radius (central projection stretches by less than 1.3 here). */
static double leaf_distance(const shcdi_view *view, size_t leaf, shcd_vec3 p, double *margin) {
    enum { N = 12 };
    shcdi_view_leaf l;
    double least = HUGE_VAL;
    shcdi_view_leaf_at(view, leaf, &l);
    for (int i = 0; i <= N; i++) {
        for (int k = 0; k <= N - i; k++) {
            const double b[3] = {(double)i / N, (double)k / N, (double)(N - i - k) / N};
            shcd_vec3 w = {0.0, 0.0, 0.0};
            for (int c = 0; c < 3; c++) {
                w = shcd_mul_add(w, b[c], l.w[c]);
            }
            least = fmin(least, shcd_norm(shcd_sub(shcdi_view_point(view, shcd_unit(w)), p)));
        }
    }
    *margin = l.m1 * 1.3 * l.angle / N;
    return least;
}

static void test_scans_bound_the_distance_to_the_surface(void **state) {
    check_random random = {141};
    (void)state;
    for (int degree = 1; degree <= 15; degree += 7) {
        shcd_model *m = bodies_create_random(&random, degree, 0.15);
        const shcdi_view view = view_of(m);
        const double scale = view.index->scale;
        const size_t n_blocks = shcdi_view_block_count(&view);
        const shcdi_ball_table balls = balls_of(&view);
        float *ball = calloc(balls.n, sizeof *ball);
        assert_non_null(ball);
        for (size_t i = 0; i < 4 + check_scaled(60); i++) {
            float at[3], lower[LEAVES], upper[LEAVES], least[2], shifted[LEAVES], far[2];
            random_at(&view, &random, i, at);
            const shcd_vec3 p = place_of(&view, at);
            const size_t block = (size_t)(check_random_bits(&random) % n_blocks);
            shcdi_scan_balls(view.series.simd, &balls, at, ball);
            for (size_t b = n_blocks; b < balls.n; b++) {
                assert_true(ball[b] == HUGE_VALF);
            }
            shcdi_scan_leaves(view.series.simd, &view.positions.block[block],
                              &view.index->bounds[block], at, 0.0f, lower, upper, least);
            float low = HUGE_VALF, high = HUGE_VALF;
            for (size_t k = 0; k < LEAVES; k++) {
                double margin, b[3];
                shcdi_view_leaf leaf;
                const double found = leaf_distance(&view, LEAVES * block + k, p, &margin) * scale;
                assert_true((double)lower[k] <= found);
                assert_true((double)ball[block] <= found);
                assert_true((double)upper[k] >= found - margin * scale);
                /* and no wider than deviation and noise make them: 1e-6 of places, and as much of a
                 * triangle's tilt for each unit of ee/|n|, below 8 of these bodies */
                shcdi_view_leaf_at(&view, LEAVES * block + k, &leaf);
                const double flat = shcdi_triangle_distance(p, leaf.x, b) * scale;
                const double room = leaf.deviation_m * scale + 1e-5 * (2.0 + flat);
                assert_true((double)lower[k] >= flat - room && (double)upper[k] <= flat + room);
                low = fminf(low, lower[k]);
                high = fminf(high, upper[k]);
            }
            assert_true(least[0] == low && least[1] == high);
            /* growth moves both */
            shcdi_scan_leaves(view.series.simd, &view.positions.block[block],
                              &view.index->bounds[block], at, 0.25f, shifted, upper, far);
            for (size_t k = 0; k < LEAVES; k++) {
                assert_near((double)shifted[k], (double)lower[k] - 0.25,
                            1e-6 * (1.0 + fabs((double)lower[k])));
            }
        }
        free(ball);
        shcd_model_free(m);
    }
}

static void test_all_paths_scan_the_same_bits(void **state) {
    check_random random = {142};
    shcd_model *m = bodies_create_random(&random, 12, 0.3);
    const shcdi_view view = view_of(m);
    shcdi_ball_table balls = balls_of(&view);
    const size_t bytes = balls.n * sizeof(float);
    float *ball[N_PATHS], *growths = calloc(balls.n, sizeof(float)), *plain = malloc(bytes);
    int n_paths = 0;
    (void)state;
    for (int k = 0; k < N_PATHS; k++) {
        ball[k] = calloc(balls.n, sizeof(float));
        assert_non_null(ball[k]);
        n_paths += has_path(k);
    }
    assert_true(growths != NULL && plain != NULL);
    for (size_t i = 0; i < 8 + check_scaled(200); i++) {
        const float growth = i % 3 ? 0.0f : 0.01f;
        float at[3];
        random_at(&view, &random, i, at);
        balls.growth = NULL;
        shcdi_scan_balls(path_of[0], &balls, at, plain);
        for (size_t b = 0; b < balls.n; b++) {
            growths[b] = growth * (float)(b % 7);
        }
        balls.growth = i % 2 ? growths : NULL;
        for (int k = 0; k < N_PATHS; k++) {
            if (has_path(k)) {
                shcdi_scan_balls(path_of[k], &balls, at, ball[k]);
                assert_memory_equal(ball[k], ball[0], bytes);
            }
        }
        /* each ball by its own growth */
        for (size_t b = 0; b < shcdi_view_block_count(&view); b++) {
            const double expected = (double)plain[b] - (i % 2 ? (double)growths[b] : 0.0);
            assert_near((double)ball[0][b], expected, 1e-6 * (1.0 + fabs(expected)));
        }
        for (size_t b = 0; b < shcdi_view_block_count(&view); b++) {
            struct {
                float lower[LEAVES], upper[LEAVES], least[2];
            } out[N_PATHS];
            for (int k = 0; k < N_PATHS; k++) {
                if (has_path(k)) {
                    shcdi_scan_leaves(path_of[k], &view.positions.block[b], &view.index->bounds[b],
                                      at, growth, out[k].lower, out[k].upper, out[k].least);
                    assert_memory_equal(&out[k], &out[0], sizeof out[0]);
                }
            }
        }
    }
    print_message("%d paths\n", n_paths);
    free(growths);
    free(plain);
    for (int k = 0; k < N_PATHS; k++) {
        free(ball[k]);
    }
    shcd_model_free(m);
}

static size_t least_of(const float *value, size_t n) {
    size_t best = 0;
    for (size_t i = 1; i < n; i++) {
        best = value[i] < value[best] ? i : best;
    }
    return best;
}

static void test_least_and_below_agree_with_plain_loops(void **state) {
    enum { MAX = 512 };
    check_random random = {143};
    float value[MAX];
    uint16_t index[MAX];
    (void)state;
    for (size_t i = 0; i < 50 + check_scaled(2000); i++) {
        const size_t n = 16 * (1 + (size_t)(check_random_bits(&random) % (MAX / 16)));
        for (size_t k = 0; k < n; k++) {
            /* few values, so that many are equal; infinite where a block was visited */
            const double v = floor(check_uniform(&random, -4.0, i % 2 ? 5.0 : 4000.0));
            value[k] = v > 3.0 && k % 3 == 0 ? HUGE_VALF : (float)v;
        }
        const float limit = (float)floor(check_uniform(&random, -6.0, 8.0));
        for (int path = 0; path < N_PATHS; path++) {
            if (!has_path(path)) {
                continue;
            }
            assert_int_equal(shcdi_scan_least(path_of[path], value, n), least_of(value, n));
            const size_t found = shcdi_scan_below(path_of[path], value, n, limit, index);
            size_t at = 0;
            for (size_t k = 0; k < n; k++) {
                if (value[k] < limit) {
                    assert_true(at < found && index[at] == k);
                    at++;
                }
            }
            assert_int_equal(at, found);
        }
    }
}

static void test_leaf_of_a_view_contains_the_surface(void **state) {
    check_random random = {144};
    (void)state;
    for (int degree = 1; degree <= 15; degree += 7) {
        shcd_model *m = bodies_create_random(&random, degree, 0.15);
        const shcdi_view view = view_of(m);
        const double whole[SHCDI_SUPREMA] = {m->m[0], m->m[1], m->m[2], 0.0};
        for (size_t i = 0; i < LEAVES * shcdi_view_block_count(&view); i++) {
            shcdi_view_leaf leaf;
            shcd_vec3 ball, w = {0.0, 0.0, 0.0};
            double value[DERIVATIVES_SAMPLES], error, b[3], sum = 0.0;
            shcdi_view_leaf_at(&view, i, &leaf);
            const double radius = shcdi_view_block_ball(&view, i / LEAVES, &ball);
            for (int k = 0; k < 3; k++) {
                const double share = check_uniform(&random, 0.0, 1.0);
                const shcd_vec3 s = shcdi_view_point(&view, leaf.w[k]);
                w = shcd_mul_add(w, share, leaf.w[k]);
                sum += share;
                /* a corner has no deviation but the grid's and rounding */
                assert_true(shcd_norm(shcd_sub(s, leaf.x[k])) <= leaf.deviation_m);
                assert_true(2.0 * asin(0.5 * shcd_norm(shcd_sub(leaf.w[k], leaf.centre))) <=
                            leaf.angle);
            }
            w = shcd_unit(w);
            assert_true(sum > 0.0);
            const shcd_vec3 s = shcdi_view_point(&view, w);
            assert_true(shcdi_triangle_distance(s, leaf.x, b) <= leaf.deviation_m);
            /* the ball is stored in floats, in units of the body's size */
            assert_true(shcd_norm(shcd_sub(s, ball)) <= radius + 1e-6 / view.index->scale);
            const double bound[SHCDI_SUPREMA] = {leaf.m1, leaf.m2, leaf.m3, leaf.product};
            derivatives_magnitudes(m, &random, derivatives_near(&random, leaf.centre, leaf.reach),
                                   value, &error);
            derivatives_assert_contained(value, bound, leaf.sigma, error, whole);
            assert_true(leaf.reach > 2.0 * leaf.angle);
        }
        shcd_model_free(m);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scans_bound_the_distance_to_the_surface),
        cmocka_unit_test(test_all_paths_scan_the_same_bits),
        cmocka_unit_test(test_least_and_below_agree_with_plain_loops),
        cmocka_unit_test(test_leaf_of_a_view_contains_the_surface)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
