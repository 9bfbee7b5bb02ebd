/* SPDX-License-Identifier: BSD-3-Clause */
/* Every repair of shcd_mesh_create() and every refusal before topology: arguments, indices, values,
 * merging, dropping, measures. */
#include "mesh_support.h"

static void test_create_tetrahedron_reports_its_measures(void **state) {
    shcd_mesh_report report;
    shcd_mesh *mesh = accept(tetra_vertices, 4, tetra_triangles, 4, &report);
    (void)state;
    assert_int_equal(report.n_vertices, 4);
    assert_int_equal(report.n_triangles, 4);
    assert_int_equal(report.n_triangles_zero_area, 0);
    assert_int_equal(report.n_triangles_flipped, 0);
    assert_int_equal(report.turned_inside_out, 0);
    /* sums of four terms of order 1 */
    assert_near(report.volume_m3, 1.0 / 6.0, 4.0 * DBL_EPSILON);
    assert_near(report.area_m2, 1.5 + sqrt(3.0) / 2.0, 8.0 * DBL_EPSILON);
    assert_near(report.diagonal_m, sqrt(3.0), 4.0 * DBL_EPSILON);
    assert_memory_equal(shcd_mesh_vertices(mesh), tetra_vertices, sizeof tetra_vertices);
    assert_memory_equal(shcd_mesh_triangles(mesh), tetra_triangles, sizeof tetra_triangles);
    shcd_mesh_free(mesh);
}

static void test_create_without_report_and_error_works(void **state) {
    shcd_mesh *mesh = NULL;
    (void)state;
    assert_int_equal(shcd_mesh_create(tetra_vertices, 4, tetra_triangles, 4, &mesh, NULL, NULL),
                     SHCD_OK);
    shcd_mesh_free(mesh);
    assert_int_equal(shcd_mesh_create(tetra_vertices, 4, tetra_triangles, 3, &mesh, NULL, NULL),
                     SHCD_ERR_GEOMETRY);
}

static void test_create_shorter_report_fills_only_that_part(void **state) {
    shcd_mesh_report report;
    shcd_mesh *mesh = NULL;
    (void)state;
    memset(&report, 0x55, sizeof report);
    report.struct_size = offsetof(shcd_mesh_report, n_vertices);
    assert_int_equal(shcd_mesh_create(tetra_vertices, 4, tetra_triangles, 4, &mesh, &report, NULL),
                     SHCD_OK);
    assert_int_equal(report.struct_size, offsetof(shcd_mesh_report, n_vertices));
    assert_int_equal(report.n_triangles_read, 4);
    assert_int_equal(report.n_vertices, 0x5555555555555555u);
    shcd_mesh_free(mesh);
}

static void test_create_null_arguments_are_refused(void **state) {
    shcd_mesh *mesh = NULL;
    shcd_mesh_report report;
    (void)state;
    memset(&report, 0, sizeof report);
    assert_int_equal(shcd_mesh_create(tetra_vertices, 4, tetra_triangles, 4, NULL, NULL, NULL),
                     SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_mesh_create(tetra_vertices, 4, tetra_triangles, 4, &mesh, &report, NULL),
                     SHCD_ERR_ARGUMENT);
    refuse(NULL, 4, tetra_triangles, 4, SHCD_ERR_ARGUMENT,
           "mesh_create: a null pointer, or a report without struct_size");
    refuse(tetra_vertices, 4, NULL, 4, SHCD_ERR_ARGUMENT,
           "mesh_create: a null pointer, or a report without struct_size");
}

static void test_free_and_accessors_accept_null(void **state) {
    (void)state;
    shcd_mesh_free(NULL);
    assert_int_equal(shcd_mesh_vertex_count(NULL), 0);
    assert_int_equal(shcd_mesh_triangle_count(NULL), 0);
    assert_null(shcd_mesh_vertices(NULL));
    assert_null(shcd_mesh_triangles(NULL));
}

static void test_create_empty_mesh_is_refused(void **state) {
    (void)state;
    refuse(NULL, 0, NULL, 0, SHCD_ERR_GEOMETRY,
           "mesh_create: the mesh is empty (0 vertices, 0 triangles)");
    refuse(tetra_vertices, 4, NULL, 0, SHCD_ERR_GEOMETRY,
           "mesh_create: the mesh is empty (4 vertices, 0 triangles)");
}

static void test_create_too_many_triangles_are_refused_before_reading(void **state) {
    (void)state;
    refuse(tetra_vertices, 4, tetra_triangles, (size_t)1 << 40, SHCD_ERR_ARGUMENT,
           "mesh_create: 4 vertices and 1099511627776 triangles are too many (at most 4294967294 "
           "and 1431655765)");
}

static void test_create_index_out_of_range_names_the_triangle(void **state) {
    const uint32_t triangles[] = {0, 2, 1, 0, 1, 4, 1, 2, 3, 0, 3, 2};
    (void)state;
    refuse(tetra_vertices, 4, triangles, 4, SHCD_ERR_ARGUMENT,
           "mesh_create: triangle 1 refers to vertex 4, but there are only 4");
}

static void test_create_vertex_not_finite_names_a_face(void **state) {
    double vertices[12];
    (void)state;
    memcpy(vertices, tetra_vertices, sizeof vertices);
    vertices[10] = (double)NAN;
    refuse(vertices, 4, tetra_triangles, 4, SHCD_ERR_NOT_FINITE,
           "mesh_create: vertex 3 (0, nan, 1) is not finite; triangle 1 uses it");
    vertices[10] = (double)-INFINITY;
    refuse(vertices, 4, tetra_triangles, 4, SHCD_ERR_NOT_FINITE,
           "mesh_create: vertex 3 (0, -inf, 1) is not finite; triangle 1 uses it");
}

static void test_create_unused_vertex_may_be_nan_and_is_dropped(void **state) {
    double vertices[15];
    uint32_t triangles[12];
    shcd_mesh_report report;
    shcd_mesh *mesh = NULL;
    (void)state;
    vertices[0] = vertices[1] = vertices[2] = (double)NAN;
    memcpy(vertices + 3, tetra_vertices, sizeof tetra_vertices);
    for (size_t i = 0; i < 12; ++i) {
        triangles[i] = tetra_triangles[i] + 1;
    }
    mesh = accept(vertices, 5, triangles, 4, &report);
    assert_int_equal(report.n_vertices, 4);
    assert_int_equal(report.n_vertices_unused, 1);
    assert_memory_equal(shcd_mesh_vertices(mesh), tetra_vertices, sizeof tetra_vertices);
    shcd_mesh_free(mesh);
}

/* Each triangle brings its own three vertices; half of the zeros are negative. */
static void tetra_soup(double vertices[36], uint32_t triangles[12]) {
    for (uint32_t c = 0; c < 12; ++c) {
        for (size_t k = 0; k < 3; ++k) {
            const double x = tetra_vertices[3 * tetra_triangles[c] + k];
            vertices[3 * c + k] = x == 0.0 && c % 2 == 1 ? -0.0 : x;
        }
        triangles[c] = c;
    }
}

static void test_create_equal_positions_merge_and_zero_has_no_sign(void **state) {
    double vertices[36];
    uint32_t triangles[12];
    shcd_mesh_report report;
    shcd_mesh *mesh = NULL;
    (void)state;
    tetra_soup(vertices, triangles);
    mesh = accept(vertices, 12, triangles, 4, &report);
    assert_int_equal(report.n_vertices, 4);
    assert_int_equal(report.n_vertices_merged, 8);
    for (size_t i = 0; i < 12; ++i) {
        assert_false(signbit(shcd_mesh_vertices(mesh)[i]));
    }
    shcd_mesh_free(mesh);
}

static void test_create_positions_one_ulp_apart_do_not_merge(void **state) {
    double vertices[36];
    uint32_t triangles[12];
    (void)state;
    tetra_soup(vertices, triangles);
    vertices[6] = nextafter(1.0, 2.0); /* vertex (1,0,0) as triangle 0 has it */
    refuse(vertices, 12, triangles, 4, SHCD_ERR_GEOMETRY,
           "mesh_create: open edge from (0, 1, 0) to (1, 0, 0) m at triangle 0 (4 of 8 edges are "
           "open, 1 component)");
}

static void test_create_repeated_corners_are_dropped(void **state) {
    /* vertex 4 is a copy of 0, vertex 5 serves a dropped triangle only */
    const double vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 7, 7, 7};
    const uint32_t triangles[] = {0, 4, 1, 0, 2, 1, 5, 5, 2, 4, 1, 3, 1, 2, 3, 0, 3, 2};
    shcd_mesh_report report;
    shcd_mesh *mesh = accept(vertices, 6, triangles, 6, &report);
    (void)state;
    assert_int_equal(report.n_triangles_degenerate_dropped, 2);
    assert_int_equal(report.n_triangles, 4);
    assert_int_equal(report.n_vertices_merged, 1);
    assert_int_equal(report.n_vertices_unused, 1);
    assert_near(report.diagonal_m, sqrt(3.0), 4.0 * DBL_EPSILON);
    shcd_mesh_free(mesh);
}

static void test_create_only_degenerate_triangles_is_empty(void **state) {
    const double vertices[] = {1, 2, 3, 1, 2, 3, 1, 2, 3};
    const uint32_t triangles[] = {0, 1, 2, 2, 1, 0};
    (void)state;
    refuse(vertices, 3, triangles, 2, SHCD_ERR_GEOMETRY,
           "mesh_create: the mesh is empty: all 2 triangles are degenerate (two corners at one "
           "place)");
}

static void test_create_collinear_triangle_is_kept_and_counted(void **state) {
    /* vertex 4 halves the edge from 0 to 1 for one of its two triangles only */
    const double vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.5, 0, 0};
    const uint32_t triangles[] = {0, 2, 1, 0, 1, 4, 0, 4, 3, 4, 1, 3, 1, 2, 3, 0, 3, 2};
    shcd_mesh_report report;
    shcd_mesh *mesh = accept(vertices, 5, triangles, 6, &report);
    (void)state;
    assert_int_equal(report.n_triangles, 6);
    assert_int_equal(report.n_triangles_zero_area, 1);
    assert_near(report.volume_m3, 1.0 / 6.0, 8.0 * DBL_EPSILON);
    shcd_mesh_free(mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_create_tetrahedron_reports_its_measures),
        cmocka_unit_test(test_create_without_report_and_error_works),
        cmocka_unit_test(test_create_shorter_report_fills_only_that_part),
        cmocka_unit_test(test_create_null_arguments_are_refused),
        cmocka_unit_test(test_free_and_accessors_accept_null),
        cmocka_unit_test(test_create_empty_mesh_is_refused),
        cmocka_unit_test(test_create_too_many_triangles_are_refused_before_reading),
        cmocka_unit_test(test_create_index_out_of_range_names_the_triangle),
        cmocka_unit_test(test_create_vertex_not_finite_names_a_face),
        cmocka_unit_test(test_create_unused_vertex_may_be_nan_and_is_dropped),
        cmocka_unit_test(test_create_equal_positions_merge_and_zero_has_no_sign),
        cmocka_unit_test(test_create_positions_one_ulp_apart_do_not_merge),
        cmocka_unit_test(test_create_repeated_corners_are_dropped),
        cmocka_unit_test(test_create_only_degenerate_triangles_is_empty),
        cmocka_unit_test(test_create_collinear_triangle_is_kept_and_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
