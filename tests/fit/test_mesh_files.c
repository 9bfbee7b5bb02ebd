/* SPDX-License-Identifier: BSD-3-Clause */
/* What holds for all formats: polygons, empty meshes, paths, and the real meshes: which are
 * accepted, and which are refused for what. */
#define _POSIX_C_SOURCE 200809L /* mkdtemp */

#include "mesh_files.h"

/* A prism over an L with one reflex corner, of side 2, in units of `size`. */
static void test_import_polygons_are_split(void **state) {
    static const char faces[] = "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\nf 1 2 8 7\nf 2 3 9 8\n"
                                "f 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";
    static const double outline[6][2] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
    static const double sizes[] = {1e-9, 1e-6, 1.0, 1e6};
    (void)state;
    for (size_t s = 0; s < COUNT(sizes); ++s) {
        char text[1024];
        size_t n = 0;
        shcd_mesh *mesh = NULL;
        shcd_mesh_report report;
        for (int i = 0; i < 12; ++i) {
            n += (size_t)snprintf(text + n, sizeof text - n, "v %.9g %.9g %.9g\n",
                                  sizes[s] * outline[i % 6][0], sizes[s] * outline[i % 6][1],
                                  sizes[s] * (i / 6));
        }
        memcpy(text + n, faces, sizeof faces);
        assert_int_equal(import_bytes("prism.obj", text, strlen(text), &mesh, &report, NULL),
                         SHCD_OK);
        assert_int_equal(report.n_triangles, 20);
        assert_int_equal(report.n_triangles_flipped, 0);
        /* base 3, height 1, in mm; positions are rounded to float, 6e-8 for each of three factors
         */
        assert_near(report.volume_m3 / (sizes[s] * sizes[s] * sizes[s] * 1e-9), 3.0,
                    3.0 * 3.0 * 6e-8);
        shcd_mesh_free(mesh);
    }
}

static void test_import_polygon_with_nan_is_refused(void **state) {
    (void)state;
    refuse_text("nan.obj", "v 0 0 0\nv 1 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 4\nf 1 2 3 4\n",
                SHCD_ERR_NOT_FINITE, "vertex (1, nan, 0) is not finite; face 1 uses it");
}

static void test_import_empty_meshes_are_refused(void **state) {
    static const unsigned char no_facets[84] = {0};
    (void)state;
    refuse_text("empty.obj", "", SHCD_ERR_FORMAT, "the file is empty");
    refuse_text("empty.ply", "", SHCD_ERR_FORMAT, "the file is empty");
    refuse_text("empty.stl", "", SHCD_ERR_FORMAT, "the file is empty");
    refuse_text("empty.off", "", SHCD_ERR_FORMAT, "the file is empty");
    refuse_text("points.obj", OBJ_VERTICES, SHCD_ERR_GEOMETRY,
                "the mesh is empty (4 vertices, no faces)");
    refuse_text("text.obj", "hello\n", SHCD_ERR_GEOMETRY,
                "the mesh is empty (0 vertices, no faces)");
    refuse_text("points.ply", PLY_HEAD("ascii", "4", "0") INDEXED_VERTICES, SHCD_ERR_GEOMETRY,
                "the mesh is empty (4 vertices, no faces)");
    refuse_text("points.off", "OFF\n4 0 0\n" INDEXED_VERTICES, SHCD_ERR_GEOMETRY,
                "the mesh is empty (4 vertices, no faces)");
    refuse_bytes("no_facets.stl", no_facets, sizeof no_facets, SHCD_ERR_GEOMETRY,
                 "the mesh is empty (0 vertices, no faces)");
}

/* The topology is checked for files as for arrays; coordinates are in metres. */
static void test_import_open_mesh_is_refused_in_metres(void **state) {
    (void)state;
    refuse_text("open.obj", OBJ_VERTICES OBJ_REST, SHCD_ERR_GEOMETRY,
                "open edge from (0, 0, 0) to (0.001, 0, 0) m at triangle 0 (3 of 6 edges are open, "
                "1 component)");
}

static void refuse_path(const char *path, double unit_m, shcd_status status, const char *reason) {
    char expected[256];
    shcd_mesh *mesh = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status got = shcd_mesh_import(path, unit_m, &mesh, NULL, &error);
    (void)snprintf(expected, sizeof expected, "%s: %s", path, reason);
    assert_string_equal(error.message, expected);
    assert_int_equal(got, status);
    assert_null(mesh);
}

static void test_import_unreadable_paths_are_named(void **state) {
    char path[128];
    shcd_error error = {SHCD_OK, ""};
    shcd_mesh *mesh = NULL;
    (void)state;
    (void)snprintf(path, sizeof path, "%s/missing.obj", folder);
    refuse_path(path, 1.0, SHCD_ERR_IO, "cannot be opened: No such file or directory");
    (void)snprintf(path, sizeof path, "%s/folder.obj", folder);
    assert_int_equal(mkdir(path, 0700), 0);
    refuse_path(path, 1.0, SHCD_ERR_IO, "cannot be read: Is a directory");
    assert_int_equal(rmdir(path), 0);
    refuse_path("body.fbx", 1.0, SHCD_ERR_FORMAT,
                "unknown kind of file; .obj, .ply, .stl and .off are read");
    refuse_path("body", 1.0, SHCD_ERR_FORMAT,
                "unknown kind of file; .obj, .ply, .stl and .off are read");
    refuse_path("body.obj", 0.0, SHCD_ERR_ARGUMENT, "the unit of 0 m is not positive and finite");
    refuse_path("body.obj", (double)NAN, SHCD_ERR_ARGUMENT,
                "the unit of nan m is not positive and finite");
    refuse_path("body.obj", (double)INFINITY, SHCD_ERR_ARGUMENT,
                "the unit of inf m is not positive and finite");
    assert_int_equal(shcd_mesh_import(NULL, 1.0, &mesh, NULL, &error), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_mesh_import("body.obj", 1.0, NULL, NULL, &error), SHCD_ERR_ARGUMENT);
}

static void test_import_long_path_leaves_room_for_the_reason(void **state) {
    char path[1024];
    shcd_error error = {SHCD_OK, ""};
    shcd_mesh *mesh = NULL;
    (void)state;
    memset(path, 'a', sizeof path);
    memcpy(path + sizeof path - 9, "/end.obj", 9);
    assert_int_equal(shcd_mesh_import(path, 1.0, &mesh, NULL, &error), SHCD_ERR_IO);
    assert_non_null(strstr(error.message, "aaa/end.obj: cannot be opened: "));
    assert_memory_equal(error.message, "...aaa", 6);
}

typedef struct known_mesh {
    const char *name;
    double unit_m;
    size_t n_vertices, n_triangles; /* after merging */
} known_mesh;

static void check_accepted(const char *where, const known_mesh *known) {
    shcd_mesh *mesh = mesh_named(where, known->name, known->unit_m);
    assert_int_equal(shcd_mesh_vertex_count(mesh), known->n_vertices);
    assert_int_equal(shcd_mesh_triangle_count(mesh), known->n_triangles);
    shcd_mesh_free(mesh);
}

static void test_import_real_closed_meshes_are_accepted(void **state) {
    static const known_mesh known[] = {{"liver-smooth.obj", 0.01, 2194, 4384},
                                       {"liver.obj", 0.01, 139, 274},
                                       {"Bunny.stl", 0.01, 1366, 2728},
                                       {"Armadillo_verysimplified.obj", 0.01, 531, 1058}};
    (void)state;
    for (size_t i = 0; i < COUNT(known); ++i) {
        check_accepted(meshes_folder(), &known[i]);
    }
}

static void check_real_refusal(const char *name, const char *reason) {
    char path[512], expected[512];
    shcd_mesh *mesh = NULL;
    shcd_error error = {SHCD_OK, ""};
    (void)snprintf(path, sizeof path, "%s/%s", meshes_folder(), name);
    assert_int_equal(shcd_mesh_import(path, 1.0, &mesh, NULL, &error), SHCD_ERR_GEOMETRY);
    (void)snprintf(expected, sizeof expected, "%s: %s", name, reason);
    if (strstr(error.message, expected) == NULL) {
        fail_msg("'%s' does not end in '%s'", error.message, expected);
    }
}

static void test_import_real_unfit_meshes_are_refused_for_their_reason(void **state) {
    (void)state;
    check_real_refusal("torus.obj", "genus 1 (Euler number 0): a body must have genus 0 (Euler "
                                    "number 2), no handles or holes");
    check_real_refusal("dental_instrument_light.obj",
                       "open edge from (0.0387782007, 0.0107781999, -3.55100012) to (0.0344173014, "
                       "0.0174173005, -3.55100012) m at triangle 753 (16 of 1184 edges are open, "
                       "1 component)");
    check_real_refusal("stylus.obj",
                       "open edge from (-0.00400000019, 0.00600000005, 0.0170000009) to "
                       "(0.00499999989, 0.00600000005, 0.0170000009) m at triangle 625 (4 of 965 "
                       "edges are open, 2 components)");
}

/* Euler number 2 is part of being accepted; here: nothing had to be repaired. */
static void test_import_own_meshes_need_no_repair(void **state) {
    static const known_mesh known[] = {{"organ.obj", 1.0, 2562, 5120},
                                       {"hook.obj", 1.0, 1168, 2332}};
    (void)state;
    for (size_t i = 0; i < COUNT(known); ++i) {
        char path[1024];
        shcd_mesh *mesh = NULL;
        shcd_mesh_report report;
        memset(&report, 0, sizeof report);
        report.struct_size = sizeof report;
        (void)snprintf(path, sizeof path, "%s/%s", SHCD_SCENES, known[i].name);
        assert_int_equal(shcd_mesh_import(path, 1.0, &mesh, &report, NULL), SHCD_OK);
        assert_int_equal(report.n_vertices, known[i].n_vertices);
        assert_int_equal(report.n_triangles, known[i].n_triangles);
        assert_int_equal(report.n_vertices_merged, 0);
        assert_int_equal(report.n_vertices_unused, 0);
        assert_int_equal(report.n_triangles_degenerate_dropped, 0);
        assert_int_equal(report.n_triangles_zero_area, 0);
        assert_int_equal(report.n_triangles_flipped, 0);
        assert_int_equal(report.turned_inside_out, 0);
        shcd_mesh_free(mesh);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_import_polygons_are_split),
        cmocka_unit_test(test_import_polygon_with_nan_is_refused),
        cmocka_unit_test(test_import_empty_meshes_are_refused),
        cmocka_unit_test(test_import_open_mesh_is_refused_in_metres),
        cmocka_unit_test(test_import_unreadable_paths_are_named),
        cmocka_unit_test(test_import_long_path_leaves_room_for_the_reason),
        cmocka_unit_test(test_import_real_closed_meshes_are_accepted),
        cmocka_unit_test(test_import_real_unfit_meshes_are_refused_for_their_reason),
        cmocka_unit_test(test_import_own_meshes_need_no_repair),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
