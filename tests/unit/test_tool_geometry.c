/* SPDX-License-Identifier: BSD-3-Clause */
/* Tool geometries: what is refused and how, what a hull keeps, how a shell is ordered, and
 * distances to the cores of all kinds against other formulas. */
#include "query/tool_core.h"
#include "support/tools.h"

#include <string.h>

/* ---- arguments ------------------------------------------------------------------------------ */

static shcd_tool_geometry_def def_of(int kind) {
    shcd_tool_geometry_def def = SHCD_TOOL_GEOMETRY_DEF_INIT;
    def.kind = kind;
    def.radius_m = 0.01;
    def.half_length_m = 0.05;
    def.half_extents_m = shcd_vec3_make(0.1, 0.2, 0.3);
    return def;
}

static void expect(const shcd_tool_geometry_def *def, shcd_status expected, const char *text) {
    shcd_tool_geometry *geometry = NULL;
    shcd_error error = {SHCD_OK, ""};
    assert_int_equal(shcd_tool_geometry_create(def, NULL, &geometry, &error), expected);
    assert_int_equal(shcd_tool_geometry_create(def, NULL, &geometry, NULL), expected);
    assert_null(geometry);
    assert_int_equal(error.status, expected);
    if (strstr(error.message, text) == NULL) {
        fail_msg("message '%s' lacks '%s'", error.message, text);
    }
}

static void test_create_refuses_bad_lengths(void **state) {
    (void)state;
    shcd_tool_geometry_def def = def_of(SHCD_TOOL_SPHERE);
    expect(NULL, SHCD_ERR_ARGUMENT, "struct_size");
    def.struct_size = 0;
    expect(&def, SHCD_ERR_ARGUMENT, "struct_size");
    def = def_of(6);
    expect(&def, SHCD_ERR_ARGUMENT, "kind 6");
    def = def_of(-1);
    expect(&def, SHCD_ERR_ARGUMENT, "kind -1");
    def = def_of(SHCD_TOOL_SPHERE);
    def.radius_m = -1e-9;
    expect(&def, SHCD_ERR_ARGUMENT, "radius_m");
    def.radius_m = NAN;
    expect(&def, SHCD_ERR_NOT_FINITE, "radius_m");
    def = def_of(SHCD_TOOL_CAPSULE);
    def.half_length_m = INFINITY;
    expect(&def, SHCD_ERR_NOT_FINITE, "half_length_m");
    def.half_length_m = 1e7;
    expect(&def, SHCD_ERR_ARGUMENT, "half_length_m");
    def = def_of(SHCD_TOOL_BOX);
    def.half_extents_m.y = -0.1;
    expect(&def, SHCD_ERR_ARGUMENT, "half_extents_m.y");
    def.half_extents_m.y = NAN;
    expect(&def, SHCD_ERR_NOT_FINITE, "half_extents_m.y");
    assert_int_equal(shcd_tool_geometry_create(&def, NULL, NULL, NULL), SHCD_ERR_ARGUMENT);
    shcd_tool_geometry_free(NULL);
}

static void test_create_refuses_bad_points(void **state) {
    (void)state;
    shcd_vec3 p[5] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.2, 0.2, 0.2}};
    shcd_vec3 n[5] = {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 0, 1}};
    shcd_tool_geometry_def def = def_of(SHCD_TOOL_HULL);
    expect(&def, SHCD_ERR_ARGUMENT, "0 points");
    def.points = p;
    def.n_points = 3;
    expect(&def, SHCD_ERR_ARGUMENT, "3 points");
    def.n_points = SHCD_HULL_POINTS_MAX + 1;
    expect(&def, SHCD_ERR_ARGUMENT, "257 points");
    def.n_points = 5;
    p[2].y = NAN;
    expect(&def, SHCD_ERR_NOT_FINITE, "point 2");
    p[2].y = 1e9;
    expect(&def, SHCD_ERR_ARGUMENT, "point 2");
    p[2].y = 1.0;
    p[3].z = 0.0;
    p[4].z = 0.0;
    expect(&def, SHCD_ERR_GEOMETRY, "plane");
    for (int i = 0; i < 5; i++) {
        p[i] = shcd_vec3_make(0.3, 0.3, 0.3);
    }
    expect(&def, SHCD_ERR_GEOMETRY, "plane");
    def.kind = SHCD_TOOL_SHELL;
    expect(&def, SHCD_ERR_ARGUMENT, "normals");
    def.normals = n;
    n[4].z = 1.1;
    expect(&def, SHCD_ERR_ARGUMENT, "normal 4");
    n[4].z = INFINITY;
    expect(&def, SHCD_ERR_NOT_FINITE, "normal 4");
    def.n_points = 0;
    expect(&def, SHCD_ERR_ARGUMENT, "0 points");
}

/* ---- memory --------------------------------------------------------------------------------- */

typedef struct source {
    long left, live;
} source;

static void *source_allocate(size_t size, void *user) {
    source *s = user;
    if (s->left-- <= 0) {
        return NULL;
    }
    s->live++;
    return malloc(size);
}

static void source_release(void *memory, void *user) {
    source *s = user;
    s->live -= memory != NULL;
    free(memory);
}

static void test_create_survives_every_failing_allocation(void **state) {
    check_random random = {3};
    shcd_vec3 p[40];
    (void)state;
    for (int i = 0; i < 40; i++) {
        p[i] = bodies_random_direction(&random);
    }
    for (int kind = SHCD_TOOL_POINT; kind <= SHCD_TOOL_SHELL; kind++) {
        shcd_tool_geometry_def def = def_of(kind);
        def.points = p;
        def.normals = p;
        def.n_points = 40;
        long needed = 0;
        for (;; needed++) {
            source s = {needed, 0};
            const shcd_allocator allocator = {source_allocate, source_release, &s};
            shcd_tool_geometry *geometry = NULL;
            shcd_error error = {SHCD_OK, ""};
            const shcd_status status =
                shcd_tool_geometry_create(&def, &allocator, &geometry, &error);
            if (status == SHCD_OK) {
                assert_int_equal(s.live, 1);
                shcd_tool_geometry_free(geometry);
                assert_int_equal(s.live, 0);
                break;
            }
            assert_int_equal(status, SHCD_ERR_MEMORY);
            assert_null(geometry);
            assert_int_equal(s.live, 0);
        }
        assert_int_equal(needed, kind == SHCD_TOOL_HULL || kind == SHCD_TOOL_SHELL ? 2 : 1);
    }
}

/* ---- hulls ---------------------------------------------------------------------------------- */

static shcd_tool_geometry *create(const shcd_tool_geometry_def *def) {
    shcd_tool_geometry *geometry = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcd_tool_geometry_create(def, NULL, &geometry, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return geometry;
}

/* A grid of points in a cube: its eight corners are left, whatever lies on its faces and edges. */
static void test_hull_of_a_grid_is_its_corners(void **state) {
    shcd_vec3 p[216];
    size_t n = 0;
    (void)state;
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < 6; j++) {
            for (int k = 0; k < 6; k++) {
                p[n++] = shcd_vec3_make(0.2 * i - 0.5, 0.1 * j, 0.3 * k + 7.0);
            }
        }
    }
    shcd_tool_geometry_def def = def_of(SHCD_TOOL_HULL);
    def.points = p;
    def.n_points = n;
    shcd_tool_geometry *geometry = create(&def);
    assert_int_equal(geometry->n_points, 8);
    assert_int_equal(geometry->n_faces, 12);
    assert_near(geometry->half_m.x, 0.5, 1e-14);
    assert_near(geometry->middle_m.z, 7.75, 1e-14);
    shcd_tool_geometry_free(geometry);
}

static void test_hull_of_a_sphere_keeps_all_points(void **state) {
    check_random random = {8};
    shcd_vec3 p[SHCD_HULL_POINTS_MAX];
    (void)state;
    for (size_t i = 0; i < SHCD_HULL_POINTS_MAX; i++) {
        p[i] = bodies_random_direction(&random);
    }
    shcd_tool_geometry_def def = def_of(SHCD_TOOL_HULL);
    def.points = p;
    def.n_points = SHCD_HULL_POINTS_MAX;
    shcd_tool_geometry *geometry = create(&def);
    assert_int_equal(geometry->n_points, SHCD_HULL_POINTS_MAX);
    assert_int_equal(geometry->n_faces, 2 * SHCD_HULL_POINTS_MAX - 4); /* Euler */
    shcd_tool_geometry_free(geometry);
}

/* Every point given lies in every half-space of the hull, also of nearly flat and coplanar sets. */
static void test_hull_faces_hold_all_points(void **state) {
    check_random random = {9};
    (void)state;
    for (size_t i = 0; i < check_scaled(400); i++) {
        shcd_vec3 p[60];
        const double thin = i % 3 == 0 ? 1e-4 : 1.0;
        const size_t n = 5 + i % 55;
        for (size_t k = 0; k < n; k++) {
            p[k].x = check_uniform(&random, -1.0, 1.0);
            p[k].y = check_uniform(&random, -1.0, 1.0);
            p[k].z = thin * check_uniform(&random, -1.0, 1.0);
            if (i % 4 == 1) { /* a lattice: many coplanar points */
                p[k] =
                    shcd_vec3_make(round(2.0 * p[k].x), round(2.0 * p[k].y), round(3.0 * p[k].z));
            }
        }
        shcd_tool_geometry_def def = def_of(SHCD_TOOL_HULL);
        def.points = p;
        def.n_points = n;
        shcd_tool_geometry *geometry = NULL;
        if (shcd_tool_geometry_create(&def, NULL, &geometry, NULL) != SHCD_OK) {
            assert_int_equal(i % 4, 1); /* few lattice points may lie in a plane */
            continue;
        }
        /* of a simple polytope with triangles: F = 2 V - 4 */
        assert_int_equal(geometry->n_faces, 2 * geometry->n_points - 4);
        for (size_t f = 0; f < geometry->n_faces; f++) {
            for (size_t k = 0; k < n; k++) {
                assert_at_most(
                    shcd_dot(geometry->face[f].normal, p[k]) - geometry->face[f].offset_m, 4e-9);
            }
        }
        shcd_tool_geometry_free(geometry);
    }
}

/* ---- shells --------------------------------------------------------------------------------- */

static void test_shell_is_nested_and_covers(void **state) {
    check_random random = {10};
    static shcd_vec3 p[700], n[700];
    (void)state;
    for (size_t i = 0; i < 700; i++) {
        p[i] = shcd_scale(0.3, bodies_random_direction(&random));
        n[i] = shcd_scale(-1.0 / 0.3, p[i]);
    }
    shcd_tool_geometry_def def = def_of(SHCD_TOOL_SHELL);
    def.points = p;
    def.normals = n;
    def.n_points = 700;
    shcd_tool_geometry *g = create(&def);
    assert_int_equal(shcdi_tool_point_count(g), 700);
    assert_near(shcdi_tool_bounding_radius(g), 0.3, 1e-14);
    assert_true(shcdi_tool_radius(g) == 0.0);
    double before = HUGE_VAL;
    for (size_t k = 1; k <= 700; k += 13) {
        double worst = 0.0;
        for (size_t i = 0; i < 700; i++) {
            double least = HUGE_VAL;
            for (size_t m = 0; m < k; m++) {
                least = fmin(least, shcd_norm(shcd_sub(p[i], g->point_m[m])));
            }
            worst = fmax(worst, least);
        }
        assert_near(shcdi_tool_covering(g, k), worst, 1e-14);
        assert_true(shcdi_tool_covering(g, k) <= before);
        before = shcdi_tool_covering(g, k);
    }
    assert_true(shcdi_tool_covering(g, 700) == 0.0);
    assert_true(isinf(shcdi_tool_covering(g, 0)) && isinf(shcdi_tool_covering(g, 701)));
    /* 50 points of a sphere of radius a cover it within 0.53 a at best (cap areas); twice that */
    assert_at_most(shcdi_tool_covering(g, 50), 0.32);
    for (size_t i = 0; i < 700; i++) { /* normals stay with their points */
        assert_near(shcd_dot(g->normal[i], g->point_m[i]), -0.3, 1e-14);
    }
    shcd_tool_geometry_free(g);
}

/* ---- distances to cores --------------------------------------------------------------------- */

static void test_core_distance_agrees_with_other_formulas(void **state) {
    static const int kinds[4] = {SHCD_TOOL_POINT, SHCD_TOOL_CAPSULE, SHCD_TOOL_BOX, SHCD_TOOL_HULL};
    check_random random = {12};
    double worst = 0.0;
    size_t inside = 0;
    (void)state;
    for (size_t i = 0; i < check_scaled(4000); i++) {
        test_tool t;
        tools_make_random(&t, kinds[i % 4], 1.0, &random);
        for (int k = 0; k < 8; k++) {
            const shcd_vec3 from =
                k % 2 == 0 ? tools_core_point(&t, &random) : shcd_vec3_make(0, 0, 0);
            const double reach = k % 3 == 0 ? 0.01 : 1.0;
            const shcd_vec3 x = shcd_add(from, tools_random_point(0.0, reach, &random));
            shcdi_core_foot foot;
            shcdi_core_closest(t.geometry, x, &foot);
            const double expected = tools_core_distance(&t, x);
            assert_near(foot.distance, expected, 2e-9); /* near points that a hull leaves out */
            assert_at_most(foot.lower, foot.distance + 1e-15);
            /* u = v/|v| is right to a rounding over |v|, which moves u.x - h(u) by the tool's size
             */
            assert_near(foot.lower, foot.distance, 1e-15 * (1.0 + 1.0 / fabs(foot.distance)));
            assert_near(shcd_norm(shcd_sub(x, foot.point)), fabs(foot.distance), 1e-13);
            assert_at_most(shcdi_core_box_distance(t.geometry, x), fmax(0.0, foot.distance));
            worst = fmax(worst, fabs(foot.distance - expected));
            inside += expected < 0.0;
        }
        shcd_tool_geometry_free(t.geometry);
    }
    print_message("cores: %zu points inside, largest difference %.2g m (seed 12)\n", inside, worst);
    assert_true(inside > check_scaled(4000) / 2); /* of eight points each */
}

/* d^2/2 >= |r|^2/2 + r.D + sum (q.D)^2/2 in the whole ball; also at its border. */
static void test_core_curvature_is_a_lower_model(void **state) {
    static const int kinds[4] = {SHCD_TOOL_POINT, SHCD_TOOL_CAPSULE, SHCD_TOOL_BOX, SHCD_TOOL_HULL};
    check_random random = {13};
    size_t count[4] = {0, 0, 0, 0};
    (void)state;
    for (size_t i = 0; i < check_scaled(4000); i++) {
        test_tool t;
        tools_make_random(&t, kinds[i % 4], 1.0, &random);
        for (int k = 0; k < 8; k++) {
            const shcd_vec3 from = tools_core_point(&t, &random);
            const double away = pow(10.0, check_uniform(&random, -3.0, 0.5));
            const shcd_vec3 x0 = shcd_mul_add(from, away, bodies_random_direction(&random));
            shcdi_core_foot foot;
            shcdi_core_closest(t.geometry, x0, &foot);
            if (!(foot.distance > 1e-6)) {
                continue;
            }
            const double rho = foot.distance * pow(10.0, check_uniform(&random, -3.0, 0.7));
            shcdi_core_curvature model;
            shcdi_core_curvature_of(t.geometry, x0, &foot, rho, &model);
            count[model.n]++;
            for (int m = 0; m < 12; m++) {
                const double length = m % 2 == 0 ? rho : check_uniform(&random, 0.0, rho);
                const shcd_vec3 d = shcd_scale(length, bodies_random_direction(&random));
                shcdi_core_foot at;
                shcdi_core_closest(t.geometry, shcd_add(x0, d), &at);
                double value = 0.5 * shcd_dot(model.r, model.r) + shcd_dot(model.r, d);
                for (int n = 0; n < model.n; n++) {
                    const double q = shcd_dot(model.q[n], d);
                    value += 0.5 * q * q;
                }
                const double f = at.distance > 0.0 ? 0.5 * at.distance * at.distance : 0.0;
                assert_at_most(value, f + 1e-14 * (1.0 + rho) * (1.0 + rho + foot.distance));
            }
        }
        shcd_tool_geometry_free(t.geometry);
    }
    for (int n = 0; n < 4; n++) {
        assert_true(count[n] > 0); /* every kind of model was seen */
    }
}

/* Triangles against cores, many of them cutting through: the weights are a point of the triangle in
 * any case, and attain the upper end where they are apart. */
static void test_core_gap_to_triangles_is_certified(void **state) {
    static const int kinds[4] = {SHCD_TOOL_POINT, SHCD_TOOL_CAPSULE, SHCD_TOOL_BOX, SHCD_TOOL_HULL};
    check_random random = {14};
    size_t apart = 0, cutting = 0;
    (void)state;
    for (size_t i = 0; i < check_scaled(4000); i++) {
        test_tool t;
        tools_make_random(&t, kinds[i % 4], 1.0, &random);
        for (int k = 0; k < 4; k++) {
            const double size = pow(10.0, check_uniform(&random, -2.0, 0.3));
            shcd_vec3 x[3], at = {0.0, 0.0, 0.0};
            x[0] = tools_random_point(0.0, 1.0, &random);
            for (int m = 1; m < 3; m++) {
                x[m] = shcd_add(x[0], tools_random_point(0.0, size, &random));
            }
            shcdi_core_gap gap;
            memset(&gap, 0x7f, sizeof gap); /* what is not set is large and nowhere near 1 */
            shcdi_core_gap_to(t.geometry, x, 3, 1e-12, HUGE_VAL, &gap);
            assert_true(0.0 <= gap.lower && gap.lower <= gap.upper + 1e-15);
            assert_near(gap.weight[0] + gap.weight[1] + gap.weight[2], 1.0, 1e-12);
            for (int m = 0; m < 3; m++) {
                assert_true(gap.weight[m] >= 0.0 && gap.weight[m] <= 1.0 + 1e-12);
                at = shcd_mul_add(at, gap.weight[m], x[m]);
            }
            if (gap.upper > 0.0) {
                assert_at_most(tools_core_distance(&t, at), gap.upper + 1e-8);
                assert_at_most(gap.upper - gap.lower, 1e-12 + 1e-15 / gap.upper);
            }
            apart += gap.lower > 0.0;
            cutting += gap.upper == 0.0;
            for (int m = 0; m < 12; m++) {
                double a = check_uniform(&random, 0.0, 1.0), b = check_uniform(&random, 0.0, 1.0);
                a = a + b > 1.0 ? 1.0 - a : a;
                b = a + b > 1.0 ? 1.0 - b : b;
                const shcd_vec3 p = shcd_mul_add(shcd_mul_add(x[0], a, shcd_sub(x[1], x[0])), b,
                                                 shcd_sub(x[2], x[0]));
                assert_at_most(gap.lower, fmax(0.0, tools_core_distance(&t, p)) + 1e-12);
            }
        }
        shcd_tool_geometry_free(t.geometry);
    }
    print_message("triangles: %zu apart, %zu cutting (seed 14)\n", apart, cutting);
    assert_true(cutting > 0 && apart > cutting);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_create_refuses_bad_lengths),
        cmocka_unit_test(test_create_refuses_bad_points),
        cmocka_unit_test(test_create_survives_every_failing_allocation),
        cmocka_unit_test(test_hull_of_a_grid_is_its_corners),
        cmocka_unit_test(test_hull_of_a_sphere_keeps_all_points),
        cmocka_unit_test(test_hull_faces_hold_all_points),
        cmocka_unit_test(test_shell_is_nested_and_covers),
        cmocka_unit_test(test_core_distance_agrees_with_other_formulas),
        cmocka_unit_test(test_core_curvature_is_a_lower_model),
        cmocka_unit_test(test_core_gap_to_triangles_is_certified),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
