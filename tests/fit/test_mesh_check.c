/* SPDX-License-Identifier: BSD-3-Clause */
/* Every refusal and repair that depends on how the triangles hang together. */
#include "mesh_support.h"

static void test_create_missing_face_names_the_open_edge(void **state) {
    (void)state;
    refuse(cube_vertices, 8, cube_triangles, 11, SHCD_ERR_GEOMETRY,
           "mesh_create: open edge from (1, 0, 1) to (1, 1, 1) m at triangle 3 (3 of 18 edges are "
           "open, 1 component)");
}

static void test_create_open_edges_come_before_components(void **state) {
    const uint32_t triangles[] = {0, 1, 2, 3, 4, 5};
    (void)state;
    refuse(cube_vertices, 8, triangles, 2, SHCD_ERR_GEOMETRY,
           "mesh_create: open edge from (0, 0, 0) to (1, 0, 0) m at triangle 0 (6 of 6 edges are "
           "open, 2 components)");
}

static void test_create_fin_on_an_edge_is_open(void **state) {
    const double vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, -1, -1, -1};
    const uint32_t triangles[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2, 0, 1, 4};
    (void)state;
    refuse(vertices, 5, triangles, 5, SHCD_ERR_GEOMETRY,
           "mesh_create: open edge from (1, 0, 0) to (-1, -1, -1) m at triangle 4 (2 of 8 edges "
           "are open, 1 component)");
}

static void test_create_two_bodies_sharing_an_edge_are_non_manifold(void **state) {
    /* the second tetrahedron is the first turned by half a turn about the z axis */
    const double vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, -1, 0, 0, 0, -1, 0};
    const uint32_t triangles[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2,
                                  0, 5, 4, 0, 4, 3, 4, 5, 3, 0, 3, 5};
    (void)state;
    refuse(vertices, 6, triangles, 8, SHCD_ERR_GEOMETRY,
           "mesh_create: non-manifold edge from (0, 0, 1) to (0, 0, 0) m: 4 triangles share it (1 "
           "such edge)");
}

/* n copies of a mesh, each 10 m further along x. */
static void repeat(const double *vertices, size_t n_vertices, const uint32_t *triangles,
                   size_t n_triangles, size_t n, double *all_vertices, uint32_t *all_triangles) {
    for (size_t i = 0; i < n; ++i) {
        for (size_t k = 0; k < 3 * n_vertices; ++k) {
            *all_vertices++ = vertices[k] + (k % 3 == 0 ? 10.0 * (double)i : 0.0);
        }
        for (size_t k = 0; k < 3 * n_triangles; ++k) {
            *all_triangles++ = triangles[k] + (uint32_t)(i * n_vertices);
        }
    }
}

static void test_create_several_components_are_counted(void **state) {
    double vertices[6 * 12 + 24];
    uint32_t triangles[6 * 12 + 36];
    (void)state;
    repeat(cube_vertices, 8, cube_triangles, 12, 2, vertices, triangles);
    refuse(vertices, 16, triangles, 24, SHCD_ERR_GEOMETRY,
           "mesh_create: 2 components (of 12, 12 triangles); a body is one closed surface");
    repeat(tetra_vertices, 4, tetra_triangles, 4, 6, vertices, triangles);
    refuse(
        vertices, 24, triangles, 24, SHCD_ERR_GEOMETRY,
        "mesh_create: 6 components (of 4, 4, 4, 4, ... triangles); a body is one closed surface");
}

static void test_create_bodies_touching_at_a_vertex_are_components(void **state) {
    const double vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, -1, 0, 0, 0, -1, 0, 0, 0, -1};
    const uint32_t triangles[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2,
                                  0, 4, 5, 0, 6, 4, 4, 6, 5, 0, 5, 6};
    (void)state;
    refuse(vertices, 7, triangles, 8, SHCD_ERR_GEOMETRY,
           "mesh_create: 2 components (of 4, 4 triangles); a body is one closed surface");
}

enum { GRID = 8 };

/* A grid of GRID x GRID vertices closed in both directions: a torus, or with one direction reversed
 * at the seam a Klein bottle (whose vertices may lie anywhere: topology comes first). */
static void closed_grid(int is_klein, double *vertices, uint32_t *triangles) {
    const double turn = 2.0 * 3.14159265358979324 / GRID;
    for (uint32_t i = 0; i < GRID; ++i) {
        for (uint32_t j = 0; j < GRID; ++j) {
            const uint32_t next_row = (i + 1) % GRID;
            const uint32_t there = is_klein && i + 1 == GRID ? (GRID - j) % GRID : j;
            const uint32_t there1 =
                is_klein && i + 1 == GRID ? (2 * GRID - j - 1) % GRID : (j + 1) % GRID;
            const uint32_t a = GRID * i + j, b = GRID * i + (j + 1) % GRID;
            const uint32_t c = GRID * next_row + there, d = GRID * next_row + there1;
            const uint32_t quad[] = {a, c, b, b, c, d};
            const double out = 2.0 + cos(turn * (double)j);
            *vertices++ = out * cos(turn * (double)i);
            *vertices++ = out * sin(turn * (double)i);
            *vertices++ = sin(turn * (double)j);
            memcpy(triangles, quad, sizeof quad);
            triangles += COUNT(quad);
        }
    }
}

static void test_create_torus_names_its_genus(void **state) {
    double vertices[3 * GRID * GRID];
    uint32_t triangles[6 * GRID * GRID];
    (void)state;
    closed_grid(0, vertices, triangles);
    refuse(vertices, GRID * GRID, triangles, 2 * GRID * GRID, SHCD_ERR_GEOMETRY,
           "mesh_create: genus 1 (Euler number 0): a body must have genus 0 (Euler number 2), no "
           "handles or holes");
}

static void test_create_klein_bottle_is_not_orientable(void **state) {
    static const char expected[] =
        "mesh_create: not orientable: no turning of triangles makes them agree at the edge from ";
    double vertices[3 * GRID * GRID];
    uint32_t triangles[6 * GRID * GRID];
    shcd_mesh *mesh = NULL;
    shcd_error error = {SHCD_OK, ""};
    (void)state;
    closed_grid(1, vertices, triangles);
    assert_int_equal(
        shcd_mesh_create(vertices, GRID * GRID, triangles, 2 * GRID * GRID, &mesh, NULL, &error),
        SHCD_ERR_GEOMETRY);
    assert_memory_equal(error.message, expected, sizeof expected - 1);
}

static void turn_triangle(uint32_t *triangle) {
    const uint32_t kept = triangle[1];
    triangle[1] = triangle[2];
    triangle[2] = kept;
}

static void check_turned_cube(size_t n_turned, size_t n_expected, int is_inside_out) {
    uint32_t triangles[COUNT(cube_triangles)];
    shcd_mesh_report report;
    shcd_mesh *mesh = NULL;
    memcpy(triangles, cube_triangles, sizeof triangles);
    for (size_t i = 0; i < n_turned; ++i) {
        turn_triangle(&triangles[3 * ((5 * i) % 12)]);
    }
    mesh = accept(cube_vertices, 8, triangles, 12, &report);
    assert_int_equal(report.n_triangles_flipped, n_expected);
    assert_int_equal(report.turned_inside_out, is_inside_out);
    assert_near(report.volume_m3, 1.0, 12.0 * DBL_EPSILON);
    assert_near(volume_of(mesh), 1.0, 0.0);
    shcd_mesh_free(mesh);
}

static void test_create_turned_triangles_are_turned_back(void **state) {
    (void)state;
    check_turned_cube(1, 1, 0);
    check_turned_cube(3, 3, 0);
    check_turned_cube(9, 3, 1);
    check_turned_cube(12, 0, 1);
}

static void test_create_pinched_vertex_is_refused(void **state) {
    /* a tube of three rings whose two ends meet in one point: its edges are all in order, and the
     * Euler number 1 would give no genus */
    enum { AROUND = 6, RINGS = 3 };
    const double shape[RINGS][2] = {{1.0, 1.0}, {2.0, 0.0}, {1.0, -1.0}}; /* radius, height */
    double vertices[3 * (1 + RINGS * AROUND)] = {0.0, 0.0, 0.0};
    uint32_t triangles[3 * 2 * RINGS * AROUND], *t = triangles;
    (void)state;
    for (uint32_t i = 0; i < AROUND; ++i) {
        const uint32_t a = 1 + i, b = 1 + (i + 1) % AROUND;
        const uint32_t ends[] = {0, a, b, 0, b + 2 * AROUND, a + 2 * AROUND};
        const double angle = 3.14159265358979324 / 3.0 * (double)i;
        memcpy(t, ends, sizeof ends);
        t += COUNT(ends);
        for (uint32_t r = 0; r < RINGS; ++r) {
            double *v = vertices + 3 * (1 + r * AROUND + i);
            v[0] = shape[r][0] * cos(angle);
            v[1] = shape[r][0] * sin(angle);
            v[2] = shape[r][1];
            if (r + 1 < RINGS) {
                const uint32_t p = a + r * AROUND, q = b + r * AROUND;
                const uint32_t quad[] = {p, p + AROUND, q, q, p + AROUND, q + AROUND};
                memcpy(t, quad, sizeof quad);
                t += COUNT(quad);
            }
        }
    }
    refuse(vertices, 1 + RINGS * AROUND, triangles, 2 * RINGS * AROUND, SHCD_ERR_GEOMETRY,
           "mesh_create: non-manifold vertex (0, 0, 0) m: the surface touches itself there (2 fans "
           "of triangles)");
}

static void test_create_flat_surface_encloses_no_volume(void **state) {
    const uint32_t two_sides[] = {1, 2, 3, 1, 3, 2};
    double flat[COUNT(cube_vertices)];
    shcd_mesh *mesh = NULL;
    shcd_error error = {SHCD_OK, ""};
    (void)state;
    refuse(tetra_vertices, 4, two_sides, 2, SHCD_ERR_GEOMETRY,
           "mesh_create: the surface encloses no volume (0 m^3 is no more than rounding)");
    /* a cube pressed into an oblique plane: z = (x + y)/3 rounds, and so does the volume */
    for (size_t v = 0; v < 8; ++v) {
        flat[3 * v] = cube_vertices[3 * v] + 0.1 * cube_vertices[3 * v + 2];
        flat[3 * v + 1] = cube_vertices[3 * v + 1] + 0.3 * cube_vertices[3 * v + 2];
        flat[3 * v + 2] = (flat[3 * v] + flat[3 * v + 1]) / 3.0;
    }
    assert_int_equal(shcd_mesh_create(flat, 8, cube_triangles, 12, &mesh, NULL, &error),
                     SHCD_ERR_GEOMETRY);
    assert_non_null(strstr(error.message, "encloses no volume"));
}

static void test_create_any_size_and_place_is_measured(void **state) {
    static const double sizes[] = {1e-100, 1e-30, 1e-9, 1e9, 1e100};
    (void)state;
    for (size_t s = 0; s < COUNT(sizes); ++s) {
        double vertices[12];
        shcd_mesh_report report;
        shcd_mesh *mesh = NULL;
        for (size_t i = 0; i < 12; ++i) {
            vertices[i] = tetra_vertices[i] * sizes[s];
        }
        mesh = accept(vertices, 4, tetra_triangles, 4, &report);
        assert_near(report.diagonal_m / sizes[s], sqrt(3.0), 8.0 * DBL_EPSILON);
        assert_near(report.volume_m3 / sizes[s] / sizes[s] / sizes[s], 1.0 / 6.0,
                    8.0 * DBL_EPSILON);
        shcd_mesh_free(mesh);
        for (size_t i = 0; i < 12; ++i) { /* 2^20 sizes away, exactly */
            vertices[i] = (tetra_vertices[i] + 0x1p20) * ldexp(1.0, (int)s * 20 - 40);
        }
        mesh = accept(vertices, 4, tetra_triangles, 4, &report);
        assert_near(ldexp(report.volume_m3, 120 - (int)s * 60), 1.0 / 6.0, 8.0 * DBL_EPSILON);
        shcd_mesh_free(mesh);
    }
}

/* Turned over and shuffled, a mesh is the same body: the repairs do not depend on the order. */
static void test_create_shuffled_triangles_give_the_same_body(void **state) {
    check_random random = {7};
    (void)state;
    for (size_t round = 0; round < check_scaled(50); ++round) {
        uint32_t triangles[COUNT(cube_triangles)];
        size_t n_turned = 0;
        shcd_mesh_report report;
        shcd_mesh *mesh = NULL;
        memcpy(triangles, cube_triangles, sizeof triangles);
        for (size_t i = 0; i < 12; ++i) {
            uint32_t kept[3];
            const size_t j = check_random_bits(&random) % (i + 1);
            memcpy(kept, &triangles[3 * i], sizeof kept);
            memmove(&triangles[3 * i], &triangles[3 * j], sizeof kept);
            memcpy(&triangles[3 * j], kept, sizeof kept);
        }
        for (size_t i = 0; i < 12; ++i) {
            if (check_random_bits(&random) % 3 == 0) {
                turn_triangle(&triangles[3 * i]);
                ++n_turned;
            }
        }
        mesh = accept(cube_vertices, 8, triangles, 12, &report);
        assert_int_equal(report.n_triangles_flipped, n_turned > 6 ? 12 - n_turned : n_turned);
        assert_near(volume_of(mesh), 1.0, 0.0);
        shcd_mesh_free(mesh);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_create_missing_face_names_the_open_edge),
        cmocka_unit_test(test_create_open_edges_come_before_components),
        cmocka_unit_test(test_create_fin_on_an_edge_is_open),
        cmocka_unit_test(test_create_two_bodies_sharing_an_edge_are_non_manifold),
        cmocka_unit_test(test_create_several_components_are_counted),
        cmocka_unit_test(test_create_bodies_touching_at_a_vertex_are_components),
        cmocka_unit_test(test_create_torus_names_its_genus),
        cmocka_unit_test(test_create_klein_bottle_is_not_orientable),
        cmocka_unit_test(test_create_turned_triangles_are_turned_back),
        cmocka_unit_test(test_create_pinched_vertex_is_refused),
        cmocka_unit_test(test_create_flat_surface_encloses_no_volume),
        cmocka_unit_test(test_create_any_size_and_place_is_measured),
        cmocka_unit_test(test_create_shuffled_triangles_give_the_same_body),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
