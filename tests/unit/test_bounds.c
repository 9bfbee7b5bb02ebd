/* SPDX-License-Identifier: BSD-3-Clause */
/* Certified bounds contain what they claim to contain: derivatives along great circles, deviations
 * from flat triangles, balls of tree nodes, the enclosing ball, the enclosure offsets. Samples may
 * never exceed a bound, so these comparisons have no tolerance, except for what the sampling itself
 * rounds (1e-12 of the bound: sums of some hundred products) or truncates. */
#include "model/bounds.h"
#include "model/generators.h"
#include "model/model.h"
#include "query/patch.h"
#include "support/bodies.h"
#include "support/check.h"

#define ROUNDING 1e-12

typedef struct fixture {
    shcd_model *model;
    shcdi_bounds bounds;
} fixture;

static void fixture_open(fixture *f, int degree, double rough, uint64_t seed) {
    const shcd_allocator memory = shcdi_allocator(NULL);
    check_random random = {seed};
    f->model = bodies_create_random(&random, degree, rough);
    assert_int_equal(shcdi_bounds_create(degree, f->model->coefficients, &memory, &f->bounds),
                     SHCD_OK);
}

static void fixture_close(fixture *f) {
    const shcd_allocator memory = shcdi_allocator(NULL);
    shcdi_bounds_free(&f->bounds, &memory);
    shcd_model_free(f->model);
}

/* A direction within an angle of a centre; uniform in the angle, so that the middle and the border
 * are both seen. */
static shcd_vec3 near(check_random *random, shcd_vec3 centre, double angle) {
    const shcd_vec3 v = shcd_unit(shcd_cross(centre, bodies_random_direction(random)));
    const double t = check_uniform(random, 0.0, angle);
    return shcd_unit(shcd_mul_add(shcd_scale(cos(t), centre), sin(t), v));
}

/* k-th derivatives, k = 1, 2, of S along the great circle through w with unit tangent v. */
static void derivatives(const shcd_model *model, shcd_vec3 w, shcd_vec3 v, shcd_vec3 out[2]) {
    shcdi_jet j;
    shcdi_surface_jet(&model->series, model->degree, w, &j);
    const double a = shcd_dot(v, j.t1), b = shcd_dot(v, j.t2);
    out[0] = shcd_mul_add(shcd_scale(a, j.s1), b, j.s2);
    out[1] = shcd_mul_add(shcd_scale(a * a, j.s11), 2.0 * a * b, j.s12);
    out[1] = shcd_mul_add(out[1], b * b, j.s22);
}

/* |S'|, |S''|, |S'''| along a random great circle through w; the third by central differences of
 * the second, *error its truncation h^2/6 |S^(5)| <= h^2/6 L^2 M3 and rounding over h. */
static void magnitudes(const fixture *f, check_random *random, shcd_vec3 w, double out[3],
                       double *error) {
    const shcd_vec3 v = shcd_unit(shcd_cross(w, bodies_random_direction(random)));
    const double h = 1e-4, degree = f->model->degree;
    shcd_vec3 here[2], ahead[2], behind[2];
    derivatives(f->model, w, v, here);
    derivatives(f->model, shcd_unit(shcd_mul_add(shcd_scale(cos(h), w), sin(h), v)),
                shcd_unit(shcd_mul_add(shcd_scale(cos(h), v), -sin(h), w)), ahead);
    derivatives(f->model, shcd_unit(shcd_mul_add(shcd_scale(cos(h), w), -sin(h), v)),
                shcd_unit(shcd_mul_add(shcd_scale(cos(h), v), sin(h), w)), behind);
    out[0] = shcd_norm(here[0]);
    out[1] = shcd_norm(here[1]);
    out[2] = shcd_norm(shcd_sub(ahead[1], behind[1])) / (2.0 * h);
    *error = h * h / 6.0 * degree * degree * f->model->m[2] + ROUNDING * f->model->m[1] / h;
}

static void assert_contained(const double value[3], const double bound[3], double third_error) {
    assert_true(value[0] <= bound[0] * (1.0 + ROUNDING));
    assert_true(value[1] <= bound[1] * (1.0 + ROUNDING));
    assert_true(value[2] <= bound[2] * (1.0 + ROUNDING) + third_error);
}

/* ---- generators ---- */

static double series_at(const double *c, int degree, shcd_vec3 w) {
    double y[SHCD_COUNT(8)], sum = 0.0;
    assert_int_equal(shcd_harmonics(degree, w, y, NULL, NULL), SHCD_OK);
    for (size_t i = 0; i < SHCD_COUNT(degree); i++) {
        sum += c[i] * y[i];
    }
    return sum;
}

static shcd_vec3 turned(shcd_vec3 w, int axis, double angle) {
    const shcd_quat q = {cos(0.5 * angle), axis == 0 ? sin(0.5 * angle) : 0.0,
                         axis == 1 ? sin(0.5 * angle) : 0.0, axis == 2 ? sin(0.5 * angle) : 0.0};
    return shcd_rotate(q, w);
}

static void test_generators_are_derivatives_of_finite_rotations(void **state) {
    enum { DEGREE = 8, COUNT = 81 };
    static const double weight[3] = {45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0};
    const double step = 0.01;
    check_random random = {41};
    double c[COUNT], image[COUNT], work[4 * COUNT], size = 0.0;
    (void)state;
    for (size_t i = 0; i < COUNT; i++) {
        c[i] = check_normal(&random);
        size += fabs(c[i]) * sqrt(17.0 / (4.0 * BODIES_PI));
    }
    for (int axis = 0; axis < 3; axis++) {
        shcdi_generator(DEGREE, axis, c, image, work);
        for (int n = 0; n < 50; n++) {
            const shcd_vec3 w = bodies_random_direction(&random);
            double slope = 0.0;
            for (int k = 1; k <= 3; k++) {
                slope += weight[k - 1] / step *
                         (series_at(c, DEGREE, turned(w, axis, k * step)) -
                          series_at(c, DEGREE, turned(w, axis, -k * step)));
            }
            /* h^6/140 |f^(7)|, |f^(7)| <= L^7 size; rounding 1e-14 of the size over h */
            const double tolerance = size * (pow(step, 6.0) / 140.0 * pow(8.0, 7.0) + 2e-14 / step);
            assert_near(series_at(image, DEGREE, w), slope, tolerance);
        }
        double in_place[COUNT];
        memcpy(in_place, c, sizeof c);
        shcdi_generator(DEGREE, axis, in_place, in_place, work);
        assert_memory_equal(in_place, image, sizeof image);
    }
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
    static const int degree[] = {1, 2, 3, 6, 15, 30};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        fixture f;
        check_random random = {43};
        double largest[3] = {0.0};
        fixture_open(&f, degree[d], 0.1, 400 + d);
        for (size_t n = 0; n < 1000 + check_scaled(2000); n++) { /* enough to come near it */
            double value[3], error;
            magnitudes(&f, &random, bodies_random_direction(&random), value, &error);
            assert_contained(value, f.bounds.sup, error);
            for (int k = 0; k < 3; k++) {
                largest[k] = fmax(largest[k], value[k]);
            }
        }
        print_message("degree %d: bound over sampled maximum %.3f %.3f %.3f\n", degree[d],
                      f.bounds.sup[0] / largest[0], f.bounds.sup[1] / largest[1],
                      f.bounds.sup[2] / largest[2]);
        for (int k = 0; k < 3; k++) {
            /* 1/cos(0.33) 1/cos(3 pi/32) = 1.106 is due to the grid and the axes, the rest to
             * random samples that miss the maximum: 2 catches a bound that is safe but useless */
            assert_at_most(f.bounds.sup[k], 2.0 * largest[k]);
            assert_true(f.model->m[k] == f.bounds.sup[k]);
        }
        fixture_close(&f);
    }
}

static void test_cap_suprema_contain_samples(void **state) {
    static const int degree[] = {1, 3, 8, 15, 30};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        fixture f;
        check_random random = {44};
        fixture_open(&f, degree[d], 0.1, 500 + d);
        for (int n = 0; n < 60; n++) {
            const double angle = pow(10.0, check_uniform(&random, -6.0, 0.49));
            shcd_vec3 centre = bodies_random_direction(&random);
            double sup[3], value[3], error;
            if (n < 4) { /* the poles, and just beside */
                const double r = n < 2 ? 0.0 : 1e-9;
                centre = shcd_unit(shcd_vec3_make(r * centre.x, r * centre.y, n % 2 ? -1.0 : 1.0));
            }
            shcdi_bounds_cap(&f.bounds, centre, angle, sup);
            for (size_t i = 0; i < check_scaled(100); i++) {
                magnitudes(&f, &random, near(&random, centre, angle), value, &error);
                assert_contained(value, sup, error);
            }
        }
        fixture_close(&f);
    }
}

static void test_leaf_bounds_hold_within_their_reach(void **state) {
    static const int degree[] = {1, 4, 15, 25};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        fixture f;
        check_random random = {45};
        fixture_open(&f, degree[d], 0.1, 600 + d);
        const shcdi_tree *tree = &f.model->tree;
        for (size_t i = 0; i < tree->n_leaves; i++) {
            const shcdi_leaf *leaf = &tree->leaf[i];
            const double bound[3] = {(double)leaf->m1, (double)leaf->m2, (double)leaf->m3};
            shcdi_patch patch;
            double angle, value[3], error;
            shcdi_patch_of_leaf(tree, i, &patch);
            const shcd_vec3 centre = shcdi_patch_centre(&patch, &angle);
            assert_true(angle < (double)leaf->reach);
            magnitudes(&f, &random, near(&random, centre, (double)leaf->reach), value, &error);
            assert_contained(value, bound, error);
        }
        fixture_close(&f);
    }
}

/* ---- deviation, balls, enclosures ---- */

static void test_leaf_deviation_contains_the_surface(void **state) {
    static const int degree[] = {1, 2, 6, 15, 25};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        fixture f;
        check_random random = {46};
        double largest = 0.0;
        fixture_open(&f, degree[d], d == 3 ? 0.5 : 0.1, 700 + d);
        const shcdi_tree *tree = &f.model->tree;
        for (size_t i = 0; i < tree->n_leaves; i++) {
            shcdi_patch patch;
            shcdi_patch_of_leaf(tree, i, &patch);
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
                    w = shcd_mul_add(w, share[k], patch.w[k]);
                    flat = shcd_mul_add(flat, share[k], patch.x[k]);
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
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        check_random random = {47};
        shcd_model *m = bodies_create_random(&random, degree[d], 0.2);
        const shcdi_tree *tree = &m->tree;
        double offset[64], tallest = 0.0;
        for (int l = 0; l <= degree[d]; l++) {
            assert_int_equal(shcd_model_enclosure_offset(m, l, &offset[l]), SHCD_OK);
        }
        assert_true(offset[degree[d]] == 0.0);
        for (size_t n = 0; n < check_scaled(100000 / (d + 1)); n++) {
            const shcd_vec3 w =
                n < tree->n_vertices ? tree->direction[n] : bodies_random_direction(&random);
            const shcd_vec3 s = shcdi_surface_point(&m->series, degree[d], w);
            size_t node = shcdi_leaf_of(tree, w);
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
            const size_t leaf = shcdi_leaf_of(&t, w);
            assert_true(leaf < t.n_leaves);
            assert_true(leaf_holds(&t, leaf, w));
        }
        shcdi_tree_free(&t, &memory);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_generators_are_derivatives_of_finite_rotations),
        cmocka_unit_test(test_grid_covering_reaches_every_direction),
        cmocka_unit_test(test_global_suprema_contain_samples_and_are_tight),
        cmocka_unit_test(test_cap_suprema_contain_samples),
        cmocka_unit_test(test_leaf_bounds_hold_within_their_reach),
        cmocka_unit_test(test_leaf_deviation_contains_the_surface),
        cmocka_unit_test(test_balls_offsets_and_enclosing_ball_contain_the_surface),
        cmocka_unit_test(test_enclosure_offset_refuses_bad_arguments),
        cmocka_unit_test(test_tree_is_a_closed_oriented_tiling),
        cmocka_unit_test(test_leaf_of_agrees_with_the_spherical_triangles)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
