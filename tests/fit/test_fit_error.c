/* SPDX-License-Identifier: BSD-3-Clause */
/* The error that a fit reports, against brute force and closed forms. */
#include "fit_support.h"

#include "fit_error.h"
#include "triangle_tree.h"

static const shcdi_progress silent = {NULL, NULL};
static const double pi = 3.14159265358979324;

static shcd_vec3 random_point(check_random *random, double size) {
    return shcd_vec3_make(check_uniform(random, -size, size), check_uniform(random, -size, size),
                          check_uniform(random, -size, size));
}

/* Nearest of a grid of points on a triangle: slow, and nothing like the library's distinction of
 * cases. */
static double slow_distance(shcd_vec3 p, const shcd_vec3 *v) {
    double best = HUGE_VAL;
    const int n = 400;
    for (int i = 0; i <= n; ++i) {
        for (int j = 0; i + j <= n; ++j) {
            const double a = (double)i / n, b = (double)j / n;
            const shcd_vec3 q = shcd_add(shcd_scale(1.0 - a - b, v[0]),
                                         shcd_add(shcd_scale(a, v[1]), shcd_scale(b, v[2])));
            best = fmin(best, shcd_norm(shcd_sub(p, q)));
        }
    }
    return best;
}

static void test_distance_to_one_triangle_matches_sampling(void **state) {
    (void)state;
    check_random random = {1};
    const uint32_t triangle[3] = {0, 1, 2};
    for (int k = 0; k < 30; ++k) {
        shcd_vec3 v[3];
        shcdi_triangle_tree *tree = NULL;
        for (int i = 0; i < 3; ++i) {
            v[i] = random_point(&random, 1.0);
        }
        if (k % 5 == 0) { /* without area */
            v[2] = shcd_add(shcd_scale(0.3, v[0]), shcd_scale(0.7, v[1]));
        }
        assert_int_equal(shcdi_triangle_tree_create(v, triangle, 1, &tree), SHCD_OK);
        const shcd_vec3 p = random_point(&random, 2.0);
        const double found = shcdi_triangle_tree_distance(tree, p), slow = slow_distance(p, v);
        /* sampled from above; edges of length < 2 sqrt(3) in 400 steps miss by at most a step */
        assert_true(found <= slow + 1e-12);
        assert_near(found, slow, 2.0 * 1.7320508 / 400.0);
        shcdi_triangle_tree_free(tree);
    }
}

typedef struct cloud {
    shcd_vec3 *points;
    uint32_t *triangles;
    size_t n;
} cloud;

static cloud cloud_make(size_t n, uint64_t seed) {
    check_random random = {seed};
    cloud c = {malloc(3 * n * sizeof(shcd_vec3)), malloc(3 * n * sizeof(uint32_t)), n};
    assert_true(c.points != NULL && c.triangles != NULL);
    for (size_t t = 0; t < n; ++t) {
        const shcd_vec3 centre = random_point(&random, 1.0);
        for (size_t k = 0; k < 3; ++k) {
            c.points[3 * t + k] = shcd_add(centre, random_point(&random, 0.1));
            c.triangles[3 * t + k] = (uint32_t)(3 * t + k);
        }
    }
    return c;
}

static void test_tree_distance_is_that_of_the_nearest_triangle(void **state) {
    (void)state;
    check_random random = {2};
    cloud c = cloud_make(777, 3);
    shcdi_triangle_tree *tree = NULL, *one = NULL;
    assert_int_equal(shcdi_triangle_tree_create(c.points, c.triangles, c.n, &tree), SHCD_OK);
    for (int k = 0; k < 50; ++k) {
        const shcd_vec3 p = random_point(&random, 1.5);
        double best = HUGE_VAL;
        for (size_t t = 0; t < c.n; ++t) {
            assert_int_equal(shcdi_triangle_tree_create(c.points, c.triangles + 3 * t, 1, &one),
                             SHCD_OK);
            best = fmin(best, shcdi_triangle_tree_distance(one, p));
            shcdi_triangle_tree_free(one);
        }
        assert_true(shcdi_triangle_tree_distance(tree, p) == best);
    }
    shcdi_triangle_tree_free(tree);
    free(c.points);
    free(c.triangles);
}

static void test_tree_ray_meets_the_first_triangle(void **state) {
    (void)state;
    check_random random = {4};
    cloud c = cloud_make(300, 5);
    shcdi_triangle_tree *tree = NULL, *one = NULL;
    int n_hits = 0;
    assert_int_equal(shcdi_triangle_tree_create(c.points, c.triangles, c.n, &tree), SHCD_OK);
    for (int k = 0; k < 200; ++k) {
        const shcd_vec3 p = random_point(&random, 1.5);
        const shcd_vec3 d = shcd_unit(shcd_scale(-1.0, p));
        double best = HUGE_VAL;
        uint32_t hit = UINT32_MAX, ignored;
        for (size_t t = 1; t < c.n; ++t) { /* triangle 0 is the ray's own */
            const uint32_t pair[6] = {c.triangles[0],         c.triangles[1],
                                      c.triangles[2],         c.triangles[3 * t],
                                      c.triangles[3 * t + 1], c.triangles[3 * t + 2]};
            assert_int_equal(shcdi_triangle_tree_create(c.points, pair, 2, &one), SHCD_OK);
            best = fmin(best, shcdi_triangle_tree_ray(one, p, d, 0, &ignored));
            shcdi_triangle_tree_free(one);
        }
        assert_true(shcdi_triangle_tree_ray(tree, p, d, 0, &hit) == best);
        n_hits += isfinite(best);
    }
    assert_true(n_hits > 20);
    shcdi_triangle_tree_free(tree);
    free(c.points);
    free(c.triangles);
}

static shcdi_body body_of_ellipsoid(size_t n_rings, const double *axes, soup *shape,
                                    shcd_mesh **mesh) {
    shcdi_body body;
    *shape = soup_ellipsoid(n_rings, axes);
    *mesh = mesh_of(shape);
    assert_int_equal(shcdi_body_init(&body, *mesh), SHCD_OK);
    return body;
}

/* A sphere of radius 1.1 as a series against a fine mesh of the unit sphere: every distance is 0.1,
 * up to the flatness edge^2/8 of the mesh (edge pi/80) and of the tessellation (edge 1.2/48). */
static void test_error_of_concentric_spheres_is_their_gap(void **state) {
    (void)state;
    const double axes[3] = {1.0, 1.0, 1.0};
    soup shape;
    shcd_mesh *mesh;
    shcdi_body body = body_of_ellipsoid(79, axes, &shape, &mesh);
    shcdi_comparison *comparison = NULL;
    shcdi_distance distance;
    const double k = 1.1 * sqrt(4.0 * pi / 3.0);
    double c[12] = {0.0}; /* Y_1,-1 = y, Y_10 = z, Y_11 = x, times sqrt(3/(4 pi)) */
    c[3 * SHCD_INDEX(1, 1)] = c[3 * SHCD_INDEX(1, -1) + 1] = c[3 * SHCD_INDEX(1, 0) + 2] = k;
    const double flatness = (pi / 80.0) * (pi / 80.0) / 8.0 * 2.0 + 1.1 * 0.025 * 0.025 / 8.0 * 2.0;
    assert_int_equal(shcdi_comparison_create(&body, &comparison), SHCD_OK);
    assert_int_equal(shcdi_comparison_measure(comparison, 1, c, HUGE_VAL, &silent, &distance),
                     SHCD_OK);
    assert_int_equal(distance.is_complete, 1);
    assert_near(distance.hausdorff_m, 0.1, flatness);
    assert_near(distance.rms_m, 0.1, flatness);
    assert_int_equal(shcdi_comparison_measure(comparison, 1, c, 0.05, &silent, &distance), SHCD_OK);
    assert_int_equal(distance.is_complete, 0);
    assert_true(distance.hausdorff_m > 0.05);
    shcdi_comparison_free(comparison);
    shcdi_body_release(&body);
    shcd_mesh_free(mesh);
    soup_free(&shape);
}

/* A surface that has lost a part of the mesh is near the mesh everywhere: only the other direction
 * sees it. Here the series is a sphere of radius 1 and the mesh an ellipsoid of half axes 1, 1, 2.
 */
static void test_error_sees_what_the_surface_has_missed(void **state) {
    (void)state;
    const double axes[3] = {1.0, 1.0, 2.0};
    soup shape;
    shcd_mesh *mesh;
    shcdi_body body = body_of_ellipsoid(79, axes, &shape, &mesh);
    shcdi_comparison *comparison = NULL;
    shcdi_distance distance;
    double c[12] = {0.0};
    c[3 * SHCD_INDEX(1, 1)] = c[3 * SHCD_INDEX(1, -1) + 1] = c[3 * SHCD_INDEX(1, 0) + 2] =
        sqrt(4.0 * pi / 3.0);
    assert_int_equal(shcdi_comparison_create(&body, &comparison), SHCD_OK);
    assert_int_equal(shcdi_comparison_measure(comparison, 1, c, HUGE_VAL, &silent, &distance),
                     SHCD_OK);
    assert_near(distance.hausdorff_m, 1.0, 1e-3); /* apex to sphere; the other way it is 0.58 */
    shcdi_comparison_free(comparison);
    shcdi_body_release(&body);
    shcd_mesh_free(mesh);
    soup_free(&shape);
}

/* Every ray between the two large faces is as long as the slab is high; those between the sides are
 * longer. */
static void test_thickness_of_a_slab_is_its_height(void **state) {
    (void)state;
    const double height = 0.05;
    double v[24];
    for (int i = 0; i < 8; ++i) {
        v[3 * i] = i & 1;
        v[3 * i + 1] = (i >> 1) & 1;
        v[3 * i + 2] = i & 4 ? height : 0.0;
    }
    uint32_t t[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                      2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    soup coarse = {v, t, 8, 12};
    shcd_mesh *mesh = mesh_of(&coarse);
    shcdi_body body;
    shcdi_comparison *comparison = NULL;
    assert_int_equal(shcdi_body_init(&body, mesh), SHCD_OK);
    assert_int_equal(shcdi_comparison_create(&body, &comparison), SHCD_OK);
    assert_near(shcdi_comparison_thickness(comparison), height, 1e-15);
    shcdi_comparison_free(comparison);
    shcdi_body_release(&body);
    shcd_mesh_free(mesh);
}

static void test_area_ratios_of_a_sphere_on_itself_are_one(void **state) {
    (void)state;
    const double axes[3] = {1.0, 1.0, 1.0};
    soup shape;
    shcd_mesh *mesh;
    shcdi_body body = body_of_ellipsoid(60, axes, &shape, &mesh);
    shcd_fit_record record = {0};
    shcd_vec3 *u = malloc(body.n_vertices * sizeof *u);
    assert_non_null(u);
    for (size_t i = 0; i < body.n_vertices; ++i) {
        u[i] = shcd_unit(body.positions_m[i]);
    }
    shcdi_area_ratios(&body, u, &record);
    const double edge2 = (pi / 61.0) * (pi / 61.0); /* flat against curved area, both ways */
    assert_near(record.area_ratio_min, 1.0, edge2);
    assert_near(record.area_ratio_max, 1.0, edge2);
    assert_near(record.area_log_ratio_rms, 0.0, edge2);
    free(u);
    shcdi_body_release(&body);
    shcd_mesh_free(mesh);
    soup_free(&shape);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_distance_to_one_triangle_matches_sampling),
        cmocka_unit_test(test_tree_distance_is_that_of_the_nearest_triangle),
        cmocka_unit_test(test_tree_ray_meets_the_first_triangle),
        cmocka_unit_test(test_error_of_concentric_spheres_is_their_gap),
        cmocka_unit_test(test_error_sees_what_the_surface_has_missed),
        cmocka_unit_test(test_thickness_of_a_slab_is_its_height),
        cmocka_unit_test(test_area_ratios_of_a_sphere_on_itself_are_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
