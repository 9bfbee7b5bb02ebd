/* SPDX-License-Identifier: BSD-3-Clause */
/* Certified bounds contain what they claim to contain: derivatives along great circles and the
 * product of the first two, from below the first, deviations from flat triangles, balls of tree
 * nodes, the enclosing ball, the enclosure offsets. Samples may never exceed a bound, so these
 * comparisons have no tolerance, except for what the sampling itself rounds (1e-12 of the bound:
 * sums of some hundred products) or truncates. */
#include "model/bounds.h"
#include "model/model.h"
#include "query/patch.h"
#include "realtime/sanitized.h"
#include "support/bodies.h"
#include "support/check.h"
#include "support/derivatives.h"
#include "support/maps.h"

/* Making a model of a high degree is slow under a sanitizer, and no other code than at 15. */
#define DEGREE_MAX (IS_SANITIZED ? 15 : SHCD_DEGREE_MAX)

typedef struct fixture {
    shcd_model *model; /* with its tree */
    shcdi_bounds bounds;
} fixture;

static void fixture_open(fixture *f, int degree, double rough, uint64_t seed) {
    const shcd_allocator memory = shcdi_allocator(NULL);
    check_random random = {seed};
    shcd_error error = {SHCD_OK, ""};
    double *coefficients = calloc(3 * SHCD_COUNT(degree), sizeof *coefficients);
    assert_non_null(coefficients);
    bodies_random_coefficients(&random, degree, rough, coefficients);
    if (shcdi_model_create_plain(degree, coefficients, SHCD_SIMD_AUTO, &memory, &f->model,
                                 &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    free(coefficients);
    assert_int_equal(shcdi_bounds_create(degree, f->model->coefficients, &memory, &f->bounds),
                     SHCD_OK);
}

static void fixture_close(fixture *f) {
    const shcd_allocator memory = shcdi_allocator(NULL);
    shcdi_bounds_free(&f->bounds, &memory);
    shcd_model_free(f->model);
}

/* ---- derivatives ---- */

static void test_grid_covering_reaches_every_direction(void **state) {
    check_random random = {42};
    (void)state;
    for (size_t n = 4; n <= 64; n *= 2) {
        const double covering = shcdi_grid_covering(n);
        double farthest = 0.0;
        for (size_t i = 0; i < 4000; i++) {
            const shcd_vec3 w = bodies_random_direction(&random);
            const double step = BODIES_PI / (double)n;
            const double j = floor(acos(w.z) / step), k = floor(atan2(w.y, w.x) / step + 0.5);
            const double theta = (j + 0.5) * step, phi = k * step;
            const shcd_vec3 node = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
            farthest = fmax(farthest, 2.0 * asin(0.5 * shcd_norm(shcd_sub(w, node))));
        }
        assert_true(farthest <= covering);
        assert_true(farthest >= 0.9 * covering); /* and it is not far too large */
    }
}

static void test_global_suprema_contain_samples_and_are_tight(void **state) {
    /* the last ones: grids that are coarser for their degree, down to L delta = 0.83 */
    static const int degree[] = {1, 2, 3, 6, 15, 30, 54, SHCD_DEGREE_MAX};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0] && degree[d] <= DEGREE_MAX; d++) {
        fixture f;
        check_random random = {43};
        double largest[SHCDI_SUPREMA] = {0.0};
        fixture_open(&f, degree[d], 0.1, 400 + d);
        for (size_t n = 0; n < 1000 + check_scaled(2000); n++) { /* enough to come near it */
            double value[DERIVATIVES_SAMPLES], error;
            derivatives_magnitudes(f.model, &random, bodies_random_direction(&random), value,
                                   &error);
            derivatives_assert_contained(value, f.bounds.sup, 0.0, error, f.bounds.sup);
            for (int k = 0; k < SHCDI_SUPREMA; k++) {
                largest[k] = fmax(largest[k], value[k]);
            }
        }
        print_message("degree %d: bound over sampled maximum %.3f %.3f %.3f, product %.3f\n",
                      degree[d], f.bounds.sup[0] / largest[0], f.bounds.sup[1] / largest[1],
                      f.bounds.sup[2] / largest[2],
                      f.bounds.sup[DERIVATIVES_PRODUCT] / largest[DERIVATIVES_PRODUCT]);
        const double wave = degree[d] * f.bounds.covering;
        for (int k = 0; k < 3; k++) {
            /* 1/cos(3 pi/32) 1/cos(L covering) is due to the axes and the grid, the rest to
             * random samples that miss the maximum: a bound that is safe but useless is caught */
            assert_at_most(f.bounds.sup[k], 1.9 / cos(wave) * largest[k]);
            assert_true(f.model->m[k] == f.bounds.sup[k]);
        }
        /* the product may vary twice as fast, which the coarsest grids do not follow */
        if (wave < 0.6) {
            assert_at_most(f.bounds.sup[DERIVATIVES_PRODUCT],
                           2.3 / cos(2.0 * wave) * largest[DERIVATIVES_PRODUCT]);
        }
        fixture_close(&f);
    }
}

static void test_cap_suprema_contain_samples(void **state) {
    static const int degree[] = {1, 3, 8, 15, 30};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0] && degree[d] <= DEGREE_MAX; d++) {
        fixture f;
        check_random random = {44};
        fixture_open(&f, degree[d], 0.1, 500 + d);
        for (int n = 0; n < 60; n++) {
            const double angle = pow(10.0, check_uniform(&random, -6.0, 0.49));
            shcd_vec3 centre = bodies_random_direction(&random);
            double sup[SHCDI_SUPREMA], again[SHCDI_SUPREMA], least, value[DERIVATIVES_SAMPLES],
                error;
            if (n < 4) { /* the poles, and just beside */
                const double r = n < 2 ? 0.0 : 1e-9;
                centre = shcd_unit(shcd_vec3_make(r * centre.x, r * centre.y, n % 2 ? -1.0 : 1.0));
            }
            shcdi_bounds_cap(&f.bounds, centre, angle, sup, &least);
            shcdi_bounds_cap(&f.bounds, centre, angle, again, NULL);
            assert_memory_equal(again, sup, sizeof sup);
            for (size_t i = 0; i < check_scaled(100); i++) {
                derivatives_magnitudes(f.model, &random, derivatives_near(&random, centre, angle),
                                       value, &error);
                derivatives_assert_contained(value, sup, least, error, f.bounds.sup);
            }
        }
        fixture_close(&f);
    }
}

static void test_leaf_bounds_hold_within_their_reach(void **state) {
    static const int degree[] = {1, 4, 15, 25};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0] && degree[d] <= DEGREE_MAX; d++) {
        fixture f;
        check_random random = {45};
        fixture_open(&f, degree[d], 0.1, 600 + d);
        const shcdi_tree *tree = &f.model->tree;
        for (size_t i = 0; i < tree->n_leaves; i++) {
            const shcdi_leaf *leaf = &tree->leaf[i];
            const double bound[SHCDI_SUPREMA] = {(double)leaf->m1, (double)leaf->m2,
                                                 (double)leaf->m3, (double)leaf->product};
            shcd_vec3 w[3];
            double angle, value[DERIVATIVES_SAMPLES], error;
            for (int k = 0; k < 3; k++) {
                w[k] = tree->direction[leaf->vertex[k]];
            }
            const shcd_vec3 centre = shcdi_cap_of(w, &angle);
            const double chord = shcd_norm(shcd_sub(w[i % 3], centre));
            assert_true(2.0 * asin(0.5 * chord) <=
                        fmin(angle, tree->angle_max) + DERIVATIVES_ROUNDING);
            assert_true(angle < tree->reach && tree->reach == SHCDI_TREE_REACH * tree->angle_max);
            /* mostly up to the reach, and within the leaf */
            derivatives_magnitudes(f.model, &random,
                                   derivatives_near(&random, centre, i % 4 ? tree->reach : angle),
                                   value, &error);
            derivatives_assert_contained(value, bound, (double)leaf->sigma, error, f.bounds.sup);
        }
        fixture_close(&f);
    }
}

/* On a unit sphere |S'| = |S''| = |S'''| = 1 and S'.S'' = 0 everywhere. */
static void test_bounds_of_a_sphere_are_as_tight_as_its_grid(void **state) {
    const shcd_allocator memory = shcdi_allocator(NULL);
    double c[12], sup[SHCDI_SUPREMA], least;
    shcdi_bounds b;
    check_random random = {49};
    (void)state;
    bodies_ellipsoid_coefficients(1.0, 1.0, 1.0, c);
    assert_int_equal(shcdi_bounds_create(1, c, &memory, &b), SHCD_OK);
    for (int n = 0; n < 100; n++) {
        shcdi_bounds_cap(&b, bodies_random_direction(&random), check_uniform(&random, 0.0, 1.0),
                         sup, &least);
        for (int k = 0; k < 3; k++) {
            assert_true(sup[k] >= 1.0 - DERIVATIVES_ROUNDING);
            /* 16 axes, 1/cos((k + 1) pi/32), and the grid, 1/cos(covering) */
            assert_at_most(sup[k], 1.000001 / cos((k + 1) * BODIES_PI / 32.0) / cos(b.covering));
        }
        assert_at_most(sup[DERIVATIVES_PRODUCT], DERIVATIVES_ROUNDING);
        assert_true(least <= 1.0);
        assert_true(least >= 1.0 - b.covering * sup[1] * 1.000001 - 1e-6);
    }
    shcdi_bounds_free(&b, &memory);
}

/* ---- deviation, balls, enclosures ---- */

static void test_leaf_deviation_contains_the_surface(void **state) {
    static const int degree[] = {1, 2, 6, 15, 25};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0] && degree[d] <= DEGREE_MAX; d++) {
        fixture f;
        check_random random = {46};
        double largest = 0.0;
        fixture_open(&f, degree[d], d == 3 ? 0.5 : 0.1, 700 + d);
        const shcdi_tree *tree = &f.model->tree;
        for (size_t i = 0; i < tree->n_leaves; i++) {
            const uint32_t *vertex = tree->leaf[i].vertex;
            for (int n = 0; n < 4; n++) {
                double a = check_uniform(&random, 0.0, 1.0), b = check_uniform(&random, 0.0, 1.0);
                if (a + b > 1.0) {
                    a = 1.0 - a;
                    b = 1.0 - b;
                }
                const double c = n == 0 ? 1.0 / 3.0 : 1.0 - a - b;
                const double share[3] = {n == 0 ? c : a, n == 0 ? c : b, c};
                shcd_vec3 w = {0.0, 0.0, 0.0}, flat = w;
                for (int k = 0; k < 3; k++) {
                    w = shcd_mul_add(w, share[k], tree->direction[vertex[k]]);
                    flat = shcd_mul_add(flat, share[k], tree->position[vertex[k]]);
                }
                const shcd_vec3 s = shcdi_surface_point(&f.model->series, degree[d], shcd_unit(w));
                const double off = shcd_norm(shcd_sub(s, flat));
                assert_true(off <= (double)tree->leaf[i].deviation);
                largest = fmax(largest, off);
            }
            assert_true((double)tree->leaf[i].deviation <= tree->deviation_max);
        }
        print_message("degree %d: largest deviation %.2g of the largest bound\n", degree[d],
                      largest / tree->deviation_max);
        fixture_close(&f);
    }
}

static void test_balls_offsets_and_enclosing_ball_contain_the_surface(void **state) {
    static const int degree[] = {1, 3, 15, 45};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0] && degree[d] <= DEGREE_MAX; d++) {
        check_random random = {47};
        shcd_model *m = bodies_create_random(&random, degree[d], 0.2);
        shcd_model *plain = maps_with_tree(m);
        const shcdi_tree *tree = &plain->tree;
        double offset[64], tallest = 0.0;
        assert_int_equal(m->tree.n_leaves, 0);
        for (int l = 0; l <= degree[d]; l++) {
            assert_int_equal(shcd_model_enclosure_offset(m, l, &offset[l]), SHCD_OK);
        }
        assert_true(offset[degree[d]] == 0.0);
        for (size_t n = 0; n < check_scaled(100000 / (d + 1)); n++) {
            const shcd_vec3 w =
                n < tree->n_vertices ? tree->direction[n] : bodies_random_direction(&random);
            const shcd_vec3 s = shcdi_surface_point(&m->series, degree[d], w);
            size_t node = shcdi_leaf_of(tree->level, w);
            for (int level = tree->level; level >= 0; level--, node /= 4) {
                const shcdi_ball *b = &tree->ball[shcdi_tree_level_start(level) + node];
                assert_true(shcd_norm(shcd_sub(s, b->centre)) <= b->radius);
            }
            const double r = shcd_norm(shcd_sub(s, m->info.centre_m));
            assert_true(r <= m->info.radius_m);
            const int l = (int)(n % (size_t)(degree[d] + 1));
            const shcd_vec3 low = shcdi_surface_point(&m->series, l, w);
            assert_true(shcd_norm(shcd_sub(s, low)) <= offset[l] + 2.0 * m->evaluation_error_m);
        }
        for (size_t i = 0; i < tree->n_vertices; i++) {
            tallest = fmax(tallest, shcd_norm(shcd_sub(tree->position[i], m->info.centre_m)));
        }
        /* no larger than the deviations of the leaves make it */
        assert_at_most(m->info.radius_m, (tallest + tree->deviation_max) * (1.0 + 2e-12));
        shcd_model_free(plain);
        shcd_model_free(m);
    }
}

static void test_enclosure_offset_refuses_bad_arguments(void **state) {
    shcd_model *m = bodies_create_ellipsoid(1.0, 1.0, 2.0);
    double offset = 4.0;
    (void)state;
    assert_int_equal(shcd_model_enclosure_offset(NULL, 0, &offset), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_enclosure_offset(m, -1, &offset), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_enclosure_offset(m, 2, &offset), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_enclosure_offset(m, 0, NULL), SHCD_ERR_ARGUMENT);
    assert_true(offset == 4.0);
    /* degree 0 of an ellipsoid is its centre: the longest half axis */
    assert_int_equal(shcd_model_enclosure_offset(m, 0, &offset), SHCD_OK);
    assert_true(offset >= 2.0);
    assert_at_most(offset, 2.0 / cos(0.2) + 1e-9); /* L delta of the grid of 12 latitudes: 0.185 */
    shcd_model_free(m);
}

/* ---- tree ---- */

typedef struct edge {
    uint32_t from, to;
} edge;

static int edge_order(const void *a, const void *b) {
    const edge *e = a, *f = b;
    return e->from != f->from ? (e->from < f->from ? -1 : 1) : (e->to > f->to) - (e->to < f->to);
}

static void test_tree_is_a_closed_oriented_tiling(void **state) {
    const shcd_allocator memory = shcdi_allocator(NULL);
    (void)state;
    for (int level = 0; level <= SHCDI_TREE_LEVEL_MAX; level++) {
        shcdi_tree t;
        double area = 0.0;
        assert_int_equal(shcdi_tree_create(level, &memory, &t), SHCD_OK);
        assert_int_equal(t.n_vertices, ((size_t)4 << (2 * level)) + 2);
        assert_int_equal(t.n_leaves, (size_t)8 << (2 * level));
        edge *edges = calloc(3 * t.n_leaves, sizeof *edges);
        assert_non_null(edges);
        for (size_t i = 0; i < t.n_leaves; i++) {
            shcd_vec3 w[3];
            for (int k = 0; k < 3; k++) {
                edges[3 * i + (size_t)k] =
                    (edge){t.leaf[i].vertex[k], t.leaf[i].vertex[(k + 1) % 3]};
                w[k] = t.direction[t.leaf[i].vertex[k]];
                assert_near(shcd_norm(w[k]), 1.0, 3e-16);
            }
            const double volume = shcd_dot(w[0], shcd_cross(w[1], w[2]));
            assert_true(volume > 0.0); /* counter-clockwise from outside */
            area += 2.0 * atan2(volume, 1.0 + shcd_dot(w[0], w[1]) + shcd_dot(w[1], w[2]) +
                                            shcd_dot(w[2], w[0]));
        }
        /* no overlaps: a sum of n positive terms, each within 1e-15 or so */
        assert_near(area, 4.0 * BODIES_PI, 1e-15 * (double)t.n_leaves);
        qsort(edges, 3 * t.n_leaves, sizeof *edges, edge_order);
        for (size_t i = 0; i < 3 * t.n_leaves; i++) {
            const edge reverse = {edges[i].to, edges[i].from};
            assert_true(i == 0 || edge_order(&edges[i - 1], &edges[i]) < 0);
            assert_non_null(bsearch(&reverse, edges, 3 * t.n_leaves, sizeof *edges, edge_order));
        }
        /* V - E + F = 2 with two triangles at each edge */
        assert_int_equal(t.n_vertices + t.n_leaves, 3 * t.n_leaves / 2 + 2);
        free(edges);
        shcdi_tree_free(&t, &memory);
    }
}

static int leaf_holds(const shcdi_tree *t, size_t i, shcd_vec3 w) {
    for (int k = 0; k < 3; k++) {
        const shcd_vec3 a = t->direction[t->leaf[i].vertex[k]];
        const shcd_vec3 b = t->direction[t->leaf[i].vertex[(k + 1) % 3]];
        if (shcd_dot(shcd_cross(a, b), w) < -1e-15) {
            return 0;
        }
    }
    return 1;
}

static void test_leaf_of_agrees_with_the_spherical_triangles(void **state) {
    const shcd_allocator memory = shcdi_allocator(NULL);
    check_random random = {48};
    (void)state;
    for (int level = 0; level <= 5; level++) {
        shcdi_tree t;
        assert_int_equal(shcdi_tree_create(level, &memory, &t), SHCD_OK);
        for (size_t n = 0; n < check_scaled(20000); n++) {
            shcd_vec3 w = bodies_random_direction(&random);
            if (n < t.n_vertices) {
                w = t.direction[n];
            } else if (n % 8 == 0) { /* on an edge */
                const uint32_t *v = t.leaf[n % t.n_leaves].vertex;
                w = shcd_unit(shcd_add(t.direction[v[0]], t.direction[v[1]]));
            } else if (n % 8 == 1) { /* on a coordinate plane, and with negative zeros */
                w = shcd_unit(shcd_vec3_make(w.x, -0.0, w.z));
            }
            const size_t leaf = shcdi_leaf_of(level, w);
            assert_true(leaf < t.n_leaves);
            assert_true(leaf_holds(&t, leaf, w));
        }
        shcdi_tree_free(&t, &memory);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grid_covering_reaches_every_direction),
        cmocka_unit_test(test_global_suprema_contain_samples_and_are_tight),
        cmocka_unit_test(test_cap_suprema_contain_samples),
        cmocka_unit_test(test_leaf_bounds_hold_within_their_reach),
        cmocka_unit_test(test_bounds_of_a_sphere_are_as_tight_as_its_grid),
        cmocka_unit_test(test_leaf_deviation_contains_the_surface),
        cmocka_unit_test(test_balls_offsets_and_enclosing_ball_contain_the_surface),
        cmocka_unit_test(test_enclosure_offset_refuses_bad_arguments),
        cmocka_unit_test(test_tree_is_a_closed_oriented_tiling),
        cmocka_unit_test(test_leaf_of_agrees_with_the_spherical_triangles)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
