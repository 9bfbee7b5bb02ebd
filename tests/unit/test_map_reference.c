/* SPDX-License-Identifier: BSD-3-Clause */
/* Reference surfaces of D = r_ref - r_body, and what shcd_map_create() and the look-ups refuse. */
#include "model/map_cast.h"
#include "support/maps.h"

/* ---- reference surfaces ---- */

/* The look-up's reference against the surface itself; at nodes float storage is all. */
static void check_reference(const shcd_map *map, double at_nodes, double between) {
    check_random random = {206};
    const shcd_map_info info = maps_describe(map);
    const int n = info.resolution;
    assert_true(info.reference_margin_m > 0.0);
    for (size_t i = 0; i < check_scaled(1000); i++) {
        const int a = (int)check_uniform(&random, 0.0, n + 1.0);
        const int b = (int)check_uniform(&random, 0.0, n - a + 1.0);
        const int c = i % 2 == 0 ? n - a - b : a + b - n;
        const shcd_vec3 node = {a, -b, c}, d = bodies_random_direction(&random);
        for (int hermite = 0; hermite < 2; hermite++) {
            double r;
            assert_int_equal(shcd_map_reference_radius(map, node, &r), SHCD_OK);
            const shcd_map_ray ray = maps_look(map, node, hermite);
            assert_near(ray.reference_m, r, at_nodes * r);
            assert_true(ray.crossing[0].reference_distance_m ==
                        ray.reference_m - ray.crossing[0].radius_m);
            assert_int_equal(shcd_map_reference_radius(map, d, &r), SHCD_OK);
            assert_near(maps_look(map, d, hermite).reference_m, r, between);
        }
    }
}

static void test_reference_ball(void **state) {
    check_random random = {207};
    shcd_model *model = bodies_create_random(&random, 6, 0.1);
    const shcd_model_info body = bodies_info(model);
    shcd_map_options options = maps_on_grid(SHCD_MAP_OCTAHEDRAL, 32);
    options.reference = SHCD_MAP_REFERENCE_BALL;
    shcd_map *map = maps_create(model, &options);
    (void)state;
    const shcd_vec3 c = shcd_sub(body.star_centre_m, body.centre_m);
    const double margin = body.radius_m - shcd_norm(c);
    assert_near(maps_describe(map).reference_margin_m, margin, 1e-11 * body.radius_m);
    /* an off-centre ball is as smooth as a sphere gets: |r''| <= 3 R at these offsets, and the
     * linear look-up errs by at most (|r''| + |r'|)/n^2 */
    check_reference(map, 2.0 * MAPS_STORED, 4.0 * body.radius_m / (32.0 * 32.0));
    for (size_t i = 0; i < check_scaled(2000); i++) {
        const shcd_vec3 d = bodies_random_direction(&random);
        double r;
        assert_int_equal(shcd_map_reference_radius(map, d, &r), SHCD_OK);
        assert_near(shcd_norm(shcd_mul_add(c, r, d)), body.radius_m, 1e-14 * body.radius_m);
        assert_true(maps_look(map, d, SHCD_MAP_LINEAR).crossing[0].radius_m < r);
    }
    shcd_map_free(map);
    shcd_model_free(model);
}

static void test_reference_of_low_degree(void **state) {
    check_random random = {208};
    shcd_model *model = bodies_create_random(&random, 8, 0.06);
    shcd_map_options options = maps_on_grid(SHCD_MAP_OCTAHEDRAL, 24);
    (void)state;
    options.reference = SHCD_MAP_REFERENCE_LOW_DEGREE;
    shcd_model *tree = maps_with_tree(model);
    for (int degree = 1; degree <= 8; degree += degree < 3 ? 1 : 5) {
        double least[2] = {HUGE_VAL, HUGE_VAL};
        for (int enclosing = 0; enclosing < 2; enclosing++) {
            options.reference_degree = degree;
            options.reference_enclosing = enclosing;
            shcd_map *map = maps_create(model, &options);
            const shcd_map_info info = maps_describe(map);
            assert_int_equal(info.reference_degree, degree);
            assert_true(enclosing ? info.reference_scale >= 1.0 : info.reference_scale == 1.0);
            for (size_t i = 0; i < check_scaled(500); i++) {
                const shcd_vec3 d = bodies_random_direction(&random);
                shcdi_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1];
                double r;
                assert_int_equal(shcdi_cast(tree, info.centre_m, d, hits), 1);
                assert_int_equal(shcd_map_reference_radius(map, d, &r), SHCD_OK);
                least[enclosing] = fmin(least[enclosing], r - hits[0].radius);
                if (degree == 8 && !enclosing) { /* the body itself */
                    assert_near(r, hits[0].radius, 1e-12 * r);
                    const shcd_map_ray ray = maps_look(map, d, SHCD_MAP_HERMITE);
                    assert_near(ray.crossing[0].reference_distance_m, 0.0, 1e-12 * r);
                }
            }
            shcd_map_free(map);
        }
        print_message("degree %d: least D %.3g, enclosing %.3g\n", degree, least[0], least[1]);
        /* a truncated series cuts through the body; scaled, it does not */
        assert_true(degree == 8 || least[0] < 0.0);
        assert_true(least[1] >= (degree == 8 ? -1e-12 : 0.0));
    }
    shcd_model_free(tree);
    shcd_model_free(model);
}

static double gauge_of(const double half[3], shcd_vec3 x, double e1, double e2) {
    const double flat = pow(fabs(x.x) / half[0], 2.0 / e2) + pow(fabs(x.y) / half[1], 2.0 / e2);
    return pow(pow(flat, e2 / e1) + pow(fabs(x.z) / half[2], 2.0 / e1), 0.5 * e1);
}

static void test_reference_superquadric(void **state) {
    static const double exponents[5][2] = {{0, 0}, {0.3, 0.5}, {1.7, 0.2}, {2.0, 2.0}, {0.1, 0.1}};
    static const double half[3] = {0.02, 0.01, 0.03};
    check_random random = {209};
    shcd_model *model = bodies_create_ellipsoid(half[0], half[1], half[2]);
    (void)state;
    for (int i = 0; i < 5; i++) {
        for (int off = 0; off < 2; off++) {
            shcd_map_options options = maps_on_grid(SHCD_MAP_OCTAHEDRAL, 16);
            options.reference = SHCD_MAP_REFERENCE_SUPERQUADRIC;
            options.superquadric_e1 = exponents[i][0];
            options.superquadric_e2 = exponents[i][1];
            options.has_centre = off;
            options.centre_m = shcd_vec3_make(0.004, 0.001, -0.006);
            shcd_map *map = maps_create(model, &options);
            const shcd_vec3 centre = maps_describe(map).centre_m;
            const double e1 = i == 0 ? 1.0 : exponents[i][0], e2 = i == 0 ? 1.0 : exponents[i][1];
            for (size_t k = 0; k < check_scaled(1000); k++) {
                const shcd_vec3 d = bodies_random_direction(&random);
                double r;
                assert_int_equal(shcd_map_reference_radius(map, d, &r), SHCD_OK);
                const shcd_vec3 x = shcd_mul_add(centre, r, d);
                /* the box is that of the leaves' corners, which include the six tips */
                assert_near(gauge_of(half, x, e1, e2), 1.0, 1e-12);
                if (i == 0) { /* e1 = e2 = 1 is the ellipsoid itself */
                    const shcd_map_ray ray = maps_look(map, d, SHCD_MAP_HERMITE);
                    assert_near(ray.crossing[0].reference_distance_m, 0.0, 4.0 * MAPS_STORED * r);
                }
            }
            shcd_map_free(map);
        }
    }
    shcd_model_free(model);
}

/* ---- refusals ---- */

static void refuse(const shcd_model *model, const shcd_map_options *options, shcd_status expected,
                   const char *word) {
    shcd_map *map = NULL;
    shcd_error error = {SHCD_OK, ""};
    assert_int_equal(shcd_map_create(model, options, NULL, &map, &error), expected);
    assert_null(map);
    assert_int_equal(error.status, expected);
    if (strstr(error.message, word) == NULL) {
        fail_msg("\"%s\" does not say \"%s\"", error.message, word);
    }
}

static void test_references_that_rays_do_not_cross_once_are_refused(void **state) {
    shcd_model *bent = bodies_create_bent(0.5, 0.6, 1.2, 3.0);
    shcd_map_options options = maps_on_grid(SHCD_MAP_OCTAHEDRAL, 8);
    (void)state;
    options.reference = SHCD_MAP_REFERENCE_LOW_DEGREE;
    options.reference_degree = 2;
    refuse(bent, &options, SHCD_ERR_GEOMETRY, "exactly once");
    options.reference_degree = 3;
    refuse(bent, &options, SHCD_ERR_ARGUMENT, "degree 3");
    options.reference_degree = -1;
    refuse(bent, &options, SHCD_ERR_ARGUMENT, "degree -1");
    options.has_centre = 1;
    options.centre_m = shcd_vec3_make(10.0, 0.0, 0.0);
    options.reference = SHCD_MAP_REFERENCE_BALL;
    refuse(bent, &options, SHCD_ERR_GEOMETRY, "outside the enclosing ball");
    options.reference = SHCD_MAP_REFERENCE_SUPERQUADRIC;
    refuse(bent, &options, SHCD_ERR_GEOMETRY, "outside the superquadric");
    options.has_centre = 0;
    options.superquadric_e2 = 3.0;
    refuse(bent, &options, SHCD_ERR_ARGUMENT, "convex");
    options.superquadric_e2 = (double)NAN;
    refuse(bent, &options, SHCD_ERR_ARGUMENT, "exponents");
    options.reference = 4;
    refuse(bent, &options, SHCD_ERR_ARGUMENT, "reference surface 4");
    shcd_model_free(bent);
}

static void test_bad_arguments_are_refused(void **state) {
    shcd_model *model = bodies_create_ellipsoid(1.0, 1.0, 1.0);
    shcd_map_options options = maps_on_grid(2, 8);
    shcd_map_ray ray;
    shcd_proximity got;
    double r;
    (void)state;
    refuse(model, &options, SHCD_ERR_ARGUMENT, "grid 2");
    options = maps_on_grid(0, 1);
    refuse(model, &options, SHCD_ERR_ARGUMENT, "resolution 1");
    options = maps_on_grid(0, SHCD_MAP_RESOLUTION_MAX + 1);
    refuse(model, &options, SHCD_ERR_ARGUMENT, "resolution");
    options = maps_on_grid(0, 8);
    options.has_centre = 1;
    options.centre_m.y = (double)NAN;
    refuse(model, &options, SHCD_ERR_NOT_FINITE, "finite");
    options.struct_size = 0;
    refuse(model, &options, SHCD_ERR_ARGUMENT, "struct_size");
    refuse(NULL, NULL, SHCD_ERR_ARGUMENT, "no model");
    assert_int_equal(shcd_map_create(model, NULL, NULL, NULL, NULL), SHCD_ERR_ARGUMENT);

    options = maps_on_grid(SHCD_MAP_LATITUDE_LONGITUDE, 6);
    shcd_map *map = maps_create(model, &options);
    const shcd_vec3 x = {1.0, 0.0, 0.0}, zero = {0.0, 0.0, 0.0}, bad = {(double)NAN, 0.0, 0.0};
    assert_int_equal(shcd_map_look_up(map, x, SHCD_MAP_HERMITE, &ray), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_map_look_up(map, x, 2, &ray), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_map_look_up(map, zero, 0, &ray), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_map_look_up(map, bad, 0, &ray), SHCD_ERR_NOT_FINITE);
    assert_int_equal(shcd_map_look_up(map, x, 0, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_map_query(map, x, SHCD_MAP_HERMITE, &got), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_map_query(map, bad, 0, &got), SHCD_ERR_NOT_FINITE);
    assert_int_equal(shcd_map_reference_radius(map, x, &r), SHCD_ERR_ARGUMENT);
    shcd_map_info info = {0};
    assert_int_equal(shcd_map_describe(map, &info), SHCD_ERR_ARGUMENT);
    info.struct_size = offsetof(shcd_map_info, n_nodes); /* a caller that knows less */
    info.n_nodes = 77;
    assert_int_equal(shcd_map_describe(map, &info), SHCD_OK);
    assert_int_equal(info.resolution, 6);
    assert_int_equal(info.n_nodes, 77);
    shcd_map_free(map);
    shcd_map_free(NULL);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reference_ball), cmocka_unit_test(test_reference_of_low_degree),
        cmocka_unit_test(test_reference_superquadric),
        cmocka_unit_test(test_references_that_rays_do_not_cross_once_are_refused),
        cmocka_unit_test(test_bad_arguments_are_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
