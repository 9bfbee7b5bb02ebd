/* SPDX-License-Identifier: BSD-3-Clause */
/* No map that comes back has a fold or covers the sphere more than once: on every real mesh that
 * can be fitted, on the project's own, and on input made to be hard. */
#define _POSIX_C_SOURCE 200809L
#include "fit_support.h"
#include "realtime/sanitized.h"

#include <dirent.h>

static double *take_directions(const shcd_mesh *mesh) {
    double *directions = calloc(3 * shcd_mesh_vertex_count(mesh), sizeof *directions);
    assert_non_null(directions);
    return directions;
}

/* Parameterizes, checks the map independently, prints what it took. */
static double *check_mesh(const shcd_mesh *mesh, const char *name, shcd_fit_report *report) {
    double *directions = take_directions(mesh);
    shcd_fit_report own = {.struct_size = sizeof own};
    shcd_error error = {SHCD_OK, ""};
    if (shcd_parameterize(mesh, NULL, directions, &own, &error) != SHCD_OK) {
        fail_msg("%s: %s", name, error.message);
    }
    print_message(
        "%s: %zu triangles, start %d, folded %llu -> %llu, %llu + %llu iterations, "
        "min det/2A %.3g, %.2f s\n",
        name, shcd_mesh_triangle_count(mesh), own.start, (unsigned long long)own.n_flipped_start,
        (unsigned long long)own.n_flipped, (unsigned long long)own.n_untangle_iterations,
        (unsigned long long)own.n_polish_iterations, own.min_det_ratio, own.time_parameterize_s);
    check_one_to_one(mesh, directions, name);
    assert_int_equal(own.n_flipped, 0);
    assert_true(own.min_det_ratio > 0.0);
    if (report != NULL) {
        *report = own;
    }
    return directions;
}

static void check_soup(const soup *shape, const char *name) {
    shcd_mesh *mesh = mesh_of(shape);
    free(check_mesh(mesh, name, NULL));
    shcd_mesh_free(mesh);
}

/* ---- real meshes ---- */

static int is_mesh_name(const char *name) {
    static const char *const endings[] = {".obj", ".stl", ".ply", ".off"};
    const size_t length = strlen(name);
    for (size_t k = 0; k < sizeof endings / sizeof *endings; ++k) {
        if (length > 4 && strcmp(name + length - 4, endings[k]) == 0) {
            return 1;
        }
    }
    return 0;
}

static int is_refused_mesh(const char *name) {
    return strcmp(name, "torus.obj") == 0 || strcmp(name, "dental_instrument_light.obj") == 0 ||
           strcmp(name, "stylus.obj") == 0;
}

static size_t check_folder(const char *folder) {
    DIR *directory = opendir(folder);
    const struct dirent *entry;
    size_t n_checked = 0;
    if (directory == NULL) {
        fail_msg("cannot read the folder %s", folder);
    }
    while ((entry = readdir(directory)) != NULL) {
        if (is_mesh_name(entry->d_name) && !is_refused_mesh(entry->d_name)) {
            shcd_mesh *mesh = mesh_named(folder, entry->d_name, 0.01);
            free(check_mesh(mesh, entry->d_name, NULL));
            shcd_mesh_free(mesh);
            ++n_checked;
        }
    }
    (void)closedir(directory);
    return n_checked;
}

static void test_parameterize_every_real_mesh_is_one_to_one(void **state) {
    (void)state;
    assert_true(check_folder(meshes_folder()) >= 4);
}

static void test_parameterize_every_scene_mesh_is_one_to_one(void **state) {
    (void)state;
    assert_true(check_folder(SHCD_SCENES) >= 1);
}

/* ---- hard input ---- */

static const char *const real_names[] = {"liver-smooth.obj", "liver.obj", "Bunny.stl",
                                         "Armadillo_verysimplified.obj"};

static void check_stretched(double x, double z, const char *what) {
    for (size_t k = 0; k < sizeof real_names / sizeof *real_names; ++k) {
        char name[128];
        shcd_mesh *mesh = mesh_named(meshes_folder(), real_names[k], 1.0);
        soup shape = soup_of_mesh(mesh);
        for (size_t i = 0; i < shape.n_vertices; ++i) {
            shape.vertices[3 * i] *= x;
            shape.vertices[3 * i + 2] *= z;
        }
        (void)snprintf(name, sizeof name, "%s %s", what, real_names[k]);
        check_soup(&shape, name);
        soup_free(&shape);
        shcd_mesh_free(mesh);
    }
}

static void test_parameterize_needle_is_one_to_one(void **state) {
    (void)state;
    check_stretched(100.0, 1.0, "needle");
}

static void test_parameterize_thin_sheet_is_one_to_one(void **state) {
    (void)state;
    check_stretched(1.0, 0.01, "sheet");
}

/* The centroid of these lies outside of the body: the radial start covers the sphere 0 times. */
static void test_parameterize_bent_tubes_are_one_to_one(void **state) {
    (void)state;
    const double tubes[][3] = {
        {0.5, 0.0, 0.3}, {0.75, 0.0, 0.2}, {0.9, 0.0, 0.1}, {2.0, 0.5, 0.15}, {4.0, 0.3, 0.1}};
    /* the last ones have the more vertices the more they are bent */
    const size_t n_tubes = IS_SANITIZED ? 3 : sizeof tubes / sizeof *tubes;
    for (size_t k = 0; k < n_tubes; ++k) {
        char name[64];
        const double *tube = tubes[k];
        /* as many rings as make the quadrilaterals square */
        const size_t n_rings = (size_t)(tube[0] / tube[2] * 24.0);
        soup shape = soup_tube(n_rings, 24, tube[0], tube[1], tube[2]);
        (void)snprintf(name, sizeof name, "tube of %g turns", tube[0]);
        check_soup(&shape, name);
        soup_free(&shape);
    }
}

static void check_slivers(double place, const char *what) {
    for (size_t k = 0; k < sizeof real_names / sizeof *real_names; ++k) {
        char name[128];
        shcd_mesh *mesh = mesh_named(meshes_folder(), real_names[k], 1.0);
        soup shape = soup_of_mesh(mesh);
        soup with = soup_with_slivers(&shape, 100, place);
        (void)snprintf(name, sizeof name, "%s %s", real_names[k], what);
        check_soup(&with, name);
        soup_free(&with);
        soup_free(&shape);
        shcd_mesh_free(mesh);
    }
}

static void test_parameterize_collinear_triangles_are_one_to_one(void **state) {
    (void)state;
    check_slivers(0.47, "with 100 collinear triangles");
}

static void test_parameterize_all_but_zero_edges_are_one_to_one(void **state) {
    (void)state;
    check_slivers(1e-9, "with 100 edges of relative length 1e-9");
}

static void test_parameterize_smallest_mesh_is_one_to_one(void **state) {
    (void)state;
    double v[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    uint32_t t[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    const soup tetrahedron = {v, t, 4, 4};
    check_soup(&tetrahedron, "tetrahedron");
}

/* ---- what must not matter ---- */

static double *directions_of(const soup *shape) {
    shcd_mesh *mesh = mesh_of(shape);
    double *directions = take_directions(mesh);
    assert_int_equal(shcd_parameterize(mesh, NULL, directions, NULL, NULL), SHCD_OK);
    shcd_mesh_free(mesh);
    return directions;
}

static double largest_gap(const double *a, const double *b, size_t n) {
    double gap = 0.0;
    for (size_t i = 0; i < n; ++i) {
        gap = fmax(gap, fabs(a[i] - b[i]));
    }
    return gap;
}

static void test_parameterize_unit_and_place_do_not_matter(void **state) {
    (void)state;
    shcd_mesh *mesh = mesh_named(meshes_folder(), "liver.obj", 1.0);
    const struct {
        double scale, offset, tolerance;
    } cases[] = {
        {1.0, 0.0, 0.0},     /* the same call: the same bits */
        {0x1p-40, 0.0, 0.0}, /* powers of two are exact */
        {0x1p60, 0.0, 0.0},
        {1e-6, 0.0,
         1e-2},           /* here the input differs by roundings, and two descents that both stop */
        {1e6, 0.0, 1e-2}, /* within 1e-4 of the lowest energy may end sqrt(1e-4) apart */
        {1.0, 1e6, 1e-2},
    };
    soup shape = soup_of_mesh(mesh);
    double *reference = directions_of(&shape);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        soup moved = soup_of_mesh(mesh);
        for (size_t i = 0; i < 3 * moved.n_vertices; ++i) {
            moved.vertices[i] = moved.vertices[i] * cases[k].scale + cases[k].offset;
        }
        double *directions = directions_of(&moved);
        assert_near(largest_gap(directions, reference, 3 * moved.n_vertices), 0.0,
                    cases[k].tolerance);
        free(directions);
        soup_free(&moved);
    }
    free(reference);
    soup_free(&shape);
    shcd_mesh_free(mesh);
}

/* More weight on areas makes areas more even. */
static void test_parameterize_area_weight_evens_areas(void **state) {
    (void)state;
    shcd_mesh *mesh = mesh_named(meshes_folder(), "Bunny.stl", 1.0);
    const double weights[3] = {0.2, 1.0, 5.0};
    double least = 0.0;
    for (int k = 0; k < 3; ++k) {
        double *directions = take_directions(mesh);
        shcd_fit_options options = SHCD_FIT_OPTIONS_INIT;
        shcd_fit_report report = {.struct_size = sizeof report};
        options.area_weight = weights[k];
        assert_int_equal(shcd_parameterize(mesh, &options, directions, &report, NULL), SHCD_OK);
        check_one_to_one(mesh, directions, "Bunny.stl");
        assert_true(report.min_det_ratio > least);
        least = report.min_det_ratio;
        free(directions);
    }
    shcd_mesh_free(mesh);
}

/* ---- the contract ---- */

typedef struct stopper {
    int calls_left, n_calls;
    double last;
    const char *stage;
} stopper;

static int stop_after(const char *stage, double fraction, void *user) {
    stopper *s = user;
    ++s->n_calls;
    assert_non_null(stage);
    assert_true(fraction >= 0.0 && fraction <= 1.0);
    return s->calls_left-- <= 0;
}

static void test_parameterize_stops_when_the_caller_asks(void **state) {
    (void)state;
    shcd_mesh *mesh = mesh_named(meshes_folder(), "liver.obj", 1.0);
    double *directions = take_directions(mesh);
    stopper s = {1000000, 0, 0.0, NULL};
    shcd_fit_options options = SHCD_FIT_OPTIONS_INIT;
    options.progress = stop_after;
    options.progress_user = &s;
    assert_int_equal(shcd_parameterize(mesh, &options, directions, NULL, NULL), SHCD_OK);
    const int n_calls = s.n_calls;
    assert_true(n_calls > 10);
    for (int k = 0; k < n_calls; k += 7) {
        shcd_error error = {SHCD_OK, ""};
        s = (stopper){k, 0, 0.0, NULL};
        assert_int_equal(shcd_parameterize(mesh, &options, directions, NULL, &error),
                         SHCD_ERR_CANCELLED);
        assert_int_equal(s.n_calls, k + 1);
        assert_int_equal(error.status, SHCD_ERR_CANCELLED);
    }
    free(directions);
    shcd_mesh_free(mesh);
}

static void test_parameterize_refuses_bad_arguments(void **state) {
    (void)state;
    const double axes[3] = {1.0, 1.0, 1.0};
    soup shape = soup_ellipsoid(6, axes);
    shcd_mesh *mesh = mesh_of(&shape);
    double *directions = take_directions(mesh);
    shcd_fit_options options = SHCD_FIT_OPTIONS_INIT;
    shcd_fit_report report = {.struct_size = 0};
    assert_int_equal(shcd_parameterize(NULL, NULL, directions, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_parameterize(mesh, NULL, NULL, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_parameterize(mesh, NULL, directions, &report, NULL), SHCD_ERR_ARGUMENT);
    options.area_weight = -1.0;
    assert_int_equal(shcd_parameterize(mesh, &options, directions, NULL, NULL), SHCD_ERR_ARGUMENT);
    options.area_weight = 0.0;
    options.struct_size = 0;
    assert_int_equal(shcd_parameterize(mesh, &options, directions, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_true(directions[0] == 0.0); /* untouched */
    free(directions);
    shcd_mesh_free(mesh);
    soup_free(&shape);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_parameterize_every_real_mesh_is_one_to_one),
        cmocka_unit_test(test_parameterize_every_scene_mesh_is_one_to_one),
        cmocka_unit_test(test_parameterize_needle_is_one_to_one),
        cmocka_unit_test(test_parameterize_thin_sheet_is_one_to_one),
        cmocka_unit_test(test_parameterize_bent_tubes_are_one_to_one),
        cmocka_unit_test(test_parameterize_collinear_triangles_are_one_to_one),
        cmocka_unit_test(test_parameterize_all_but_zero_edges_are_one_to_one),
        cmocka_unit_test(test_parameterize_smallest_mesh_is_one_to_one),
        cmocka_unit_test(test_parameterize_unit_and_place_do_not_matter),
        cmocka_unit_test(test_parameterize_area_weight_evens_areas),
        cmocka_unit_test(test_parameterize_stops_when_the_caller_asks),
        cmocka_unit_test(test_parameterize_refuses_bad_arguments),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
