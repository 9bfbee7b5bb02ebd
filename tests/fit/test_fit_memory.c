/* SPDX-License-Identifier: BSD-3-Clause */
/* Failing memory: for each k the k-th allocation of a call fails, alone or with all that follow.
 * The call must report it, release everything, and leave what it would have given untouched.
 *
 * The linker hands every malloc, calloc, realloc and free of libshcd-fit's own objects to the
 * functions here (--wrap), CHOLMOD asks them through SuiteSparse's table, and libshcd through the
 * allocator argument. GSL, FFTW and Assimp keep their own memory: what they do without is not
 * ours. */
#define _POSIX_C_SOURCE 200809L /* mkdtemp */

#include "mesh_files.h"

#include <SuiteSparse_config.h>

void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__real_realloc(void *memory, size_t size);
void __real_free(void *memory);
/* visible, since the linker lets the runtime of a sanitizer refer to them, too */
#define VISIBLE __attribute__((visibility("default")))
VISIBLE void *__wrap_malloc(size_t size);
VISIBLE void *__wrap_calloc(size_t n, size_t size);
VISIBLE void *__wrap_realloc(void *memory, size_t size);
VISIBLE void __wrap_free(void *memory);

static struct {
    size_t n, fail_at; /* 0: never */
    int and_after;
    ptrdiff_t n_live;
} heap;

static int is_failing(void) {
    ++heap.n;
    return heap.fail_at > 0 && (heap.and_after ? heap.n >= heap.fail_at : heap.n == heap.fail_at);
}

void *__wrap_malloc(size_t size) {
    void *memory = is_failing() ? NULL : __real_malloc(size);
    heap.n_live += memory != NULL;
    return memory;
}

void *__wrap_calloc(size_t n, size_t size) {
    void *memory = is_failing() ? NULL : __real_calloc(n, size);
    heap.n_live += memory != NULL;
    return memory;
}

void *__wrap_realloc(void *old, size_t size) {
    void *memory = is_failing() ? NULL : __real_realloc(old, size);
    heap.n_live += memory != NULL && old == NULL;
    return memory;
}

void __wrap_free(void *memory) {
    heap.n_live -= memory != NULL;
    __real_free(memory);
}

static void *allocate(size_t size, void *user) {
    (void)user;
    return __wrap_malloc(size);
}

static void release(void *memory, void *user) {
    (void)user;
    __wrap_free(memory);
}

static const shcd_allocator allocator = {allocate, release, NULL};

static int redirect_cholmod(void **state) {
    SuiteSparse_config.malloc_func = __wrap_malloc;
    SuiteSparse_config.calloc_func = __wrap_calloc;
    SuiteSparse_config.realloc_func = __wrap_realloc;
    SuiteSparse_config.free_func = __wrap_free;
    return make_folder(state);
}

/* One call under test: returns its status, checks its outputs, releases what it gave. */
typedef shcd_status (*attempt)(shcd_error *error);

static void check_failure(shcd_status status, const shcd_error *error, size_t k) {
    if (status != SHCD_ERR_MEMORY || error->status != status ||
        strstr(error->message, "out of memory") == NULL) {
        fail_msg("allocation %zu failed: status %d, '%s'", k, (int)status, error->message);
    }
}

static void fail_each(attempt call, const char *name) {
    const ptrdiff_t n_before = heap.n_live;
    const size_t stride = check_scaled(1000) >= 1000 ? 1 : 1000 / check_scaled(1000);
    shcd_error error = {SHCD_OK, ""};
    size_t n_calls = 0;
    heap.fail_at = heap.n = 0;
    assert_int_equal(call(&error), SHCD_OK);
    const size_t n_allocations = heap.n;
    for (int and_after = 0; and_after < 2; ++and_after) {
        for (size_t k = 1; k <= n_allocations; k += stride) {
            error = (shcd_error){SHCD_OK, ""};
            heap.n = 0;
            heap.fail_at = k;
            heap.and_after = and_after;
            const shcd_status status = call(&error);
            heap.fail_at = 0;
            check_failure(status, &error, k);
            if (heap.n_live != n_before) {
                fail_msg("%s: %td blocks are lost when allocation %zu fails", name,
                         heap.n_live - n_before, k);
            }
            ++n_calls;
        }
    }
    print_message("%s: %zu allocations, %zu failing calls\n", name, n_allocations, n_calls);
}

/* ---- the calls ---- */

static soup surface;
static shcd_mesh *sphere;
static char path[128];

static shcd_mesh *const no_mesh = (shcd_mesh *)(uintptr_t)16;
static shcd_model *const no_model = (shcd_model *)(uintptr_t)16;

static shcd_status end_mesh(shcd_status status, shcd_mesh *mesh, const shcd_mesh_report *report) {
    const shcd_mesh_report blank = SHCD_MESH_REPORT_INIT;
    if (status == SHCD_OK) {
        shcd_mesh_free(mesh);
    } else {
        assert_ptr_equal(mesh, no_mesh);
        assert_memory_equal(report, &blank, sizeof blank);
    }
    return status;
}

static shcd_status create(shcd_error *error) {
    shcd_mesh *mesh = no_mesh;
    shcd_mesh_report report = SHCD_MESH_REPORT_INIT;
    const shcd_status status =
        shcd_mesh_create(surface.vertices, surface.n_vertices, surface.triangles,
                         surface.n_triangles, &mesh, &report, error);
    return end_mesh(status, mesh, &report);
}

static shcd_status import(shcd_error *error) {
    shcd_mesh *mesh = no_mesh;
    shcd_mesh_report report = SHCD_MESH_REPORT_INIT;
    const shcd_status status = shcd_mesh_import(path, 1.0, &mesh, &report, error);
    return end_mesh(status, mesh, &report);
}

static shcd_fit_options small_fit(void) {
    shcd_fit_options options = SHCD_FIT_OPTIONS_INIT;
    options.degree = 2;
    options.n_samples = 400;
    options.n_modes = -1;
    return options;
}

static shcd_status parameterize(shcd_error *error) {
    static double directions[3 * 1024];
    const shcd_fit_options options = small_fit();
    const size_t n = 3 * shcd_mesh_vertex_count(sphere);
    assert_true(n <= sizeof directions / sizeof directions[0]);
    for (size_t i = 0; i < n; ++i) {
        directions[i] = 7.0;
    }
    const shcd_status status = shcd_parameterize(sphere, &options, directions, NULL, error);
    for (size_t i = 0; i < n; ++i) {
        assert_true((directions[i] == 7.0) == (status != SHCD_OK));
    }
    return status;
}

static shcd_status fit_with(const shcd_fit_options *options, shcd_error *error) {
    shcd_fit_report report = SHCD_FIT_REPORT_INIT;
    shcd_model *model = no_model;
    const shcd_status status = shcd_fit(sphere, options, &allocator, &model, &report, error);
    assert_int_equal(report.struct_size, sizeof report);
    if (status == SHCD_OK) {
        shcd_model_free(model);
    } else {
        assert_ptr_equal(model, no_model);
    }
    return status;
}

static shcd_status fit(shcd_error *error) {
    const shcd_fit_options options = small_fit();
    return fit_with(&options, error);
}

static shcd_status fit_to_tolerance(shcd_error *error) {
    shcd_fit_options options = small_fit();
    options.degree = 0;
    options.degree_max = 4;
    options.tolerance_m = 0.3;
    return fit_with(&options, error);
}

static shcd_model *held;

static shcd_status modes(shcd_error *error) {
    static const shcd_anchor anchor = {{0.0, 0.0, 0.06}, 0.05, 0.0};
    shcd_modes *const untouched = (shcd_modes *)(uintptr_t)16;
    shcd_modes *made = untouched;
    shcd_modes_options options = SHCD_MODES_OPTIONS_INIT;
    options.anchors = &anchor;
    options.n_anchors = 1;
    const shcd_status status = shcd_fit_modes(held, &options, &made, error);
    if (status == SHCD_OK) {
        shcd_modes_free(made);
    } else {
        assert_ptr_equal(made, untouched);
    }
    return status;
}

/* ---- the tests ---- */

static int make_surface(void **state) {
    static const double half_axes[3] = {1.0, 0.8, 0.6};
    (void)state;
    surface = soup_ellipsoid(5, half_axes);
    sphere = mesh_of(&surface);
    return 0;
}

static int free_surface(void **state) {
    (void)state;
    shcd_mesh_free(sphere);
    soup_free(&surface);
    return 0;
}

static void test_mesh_create_failing_memory_is_reported(void **state) {
    (void)state;
    fail_each(create, "mesh_create");
}

/* More than 1024 corners, so that the list of faces grows; quadrilaterals are split. */
static void write_mesh(const char *extension) {
    const unsigned n = (unsigned)surface.n_vertices, m = (unsigned)surface.n_triangles;
    const char *kind = extension;
    FILE *file = NULL;
    (void)snprintf(path, sizeof path, "%s/mesh.%s", folder, extension);
    file = fopen(path, "w");
    assert_non_null(file);
    if (strcmp(kind, "off") == 0) {
        (void)fprintf(file, "OFF\n%u %u 0\n", n, m);
    } else if (strcmp(kind, "ply") == 0) {
        (void)fprintf(file,
                      "ply\nformat ascii 1.0\nelement vertex %u\nproperty float x\n"
                      "property float y\nproperty float z\nelement face %u\n"
                      "property list uchar int vertex_indices\nend_header\n",
                      n, m);
    } else if (strcmp(kind, "stl") == 0) {
        (void)fputs("solid s\n", file);
    }
    for (size_t v = 0; v < n && strcmp(kind, "stl") != 0; ++v) {
        const double *p = &surface.vertices[3 * v];
        (void)fprintf(file, "%s%.9g %.9g %.9g\n", strcmp(kind, "obj") == 0 ? "v " : "", p[0], p[1],
                      p[2]);
    }
    for (size_t t = 0; t < m; ++t) {
        const uint32_t *c = &surface.triangles[3 * t];
        if (strcmp(kind, "stl") == 0) {
            (void)fputs("facet normal 0 0 0\nouter loop\n", file);
            for (size_t k = 0; k < 3; ++k) {
                const double *p = &surface.vertices[3 * (size_t)c[k]];
                (void)fprintf(file, "vertex %.9g %.9g %.9g\n", p[0], p[1], p[2]);
            }
            (void)fputs("endloop\nendfacet\n", file);
        } else if (strcmp(kind, "obj") == 0) {
            (void)fprintf(file, "f %u %u %u\n", c[0] + 1, c[1] + 1, c[2] + 1);
        } else {
            (void)fprintf(file, "3 %u %u %u\n", c[0], c[1], c[2]);
        }
    }
    if (strcmp(kind, "stl") == 0) {
        (void)fputs("endsolid s\n", file);
    }
    assert_int_equal(fclose(file), 0);
}

static void test_mesh_import_failing_memory_is_reported(void **state) {
    static const char *const extensions[] = {"obj", "ply", "stl", "off"};
    const soup kept = surface;
    static const double half_axes[3] = {1.0, 0.8, 0.6};
    (void)state;
    surface = soup_ellipsoid(12, half_axes);
    for (size_t i = 0; i < COUNT(extensions); ++i) {
        write_mesh(extensions[i]);
        fail_each(import, extensions[i]);
        assert_int_equal(remove(path), 0);
    }
    soup_free(&surface);
    surface = kept;
}

static void test_parameterize_failing_memory_is_reported(void **state) {
    (void)state;
    fail_each(parameterize, "parameterize");
}

static void test_fit_failing_memory_is_reported(void **state) {
    (void)state;
    fail_each(fit, "fit");
}

static void test_fit_to_tolerance_failing_memory_is_reported(void **state) {
    (void)state;
    fail_each(fit_to_tolerance, "fit to a tolerance");
}

static void test_fit_modes_failing_memory_is_reported(void **state) {
    const double axes_m[3] = {0.05, 0.04, 0.06}, unit = 2.0466534158929770;
    double coefficients[12] = {0.0};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    (void)state;
    coefficients[3 * SHCD_INDEX(1, 1)] = axes_m[0] * unit;
    coefficients[3 * SHCD_INDEX(1, -1) + 1] = axes_m[1] * unit;
    coefficients[3 * SHCD_INDEX(1, 0) + 2] = axes_m[2] * unit;
    def.degree = 1;
    def.coefficients = coefficients;
    assert_int_equal(shcd_model_create(&def, NULL, &held, NULL), SHCD_OK);
    fail_each(modes, "fit_modes");
    shcd_model_free(held);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_mesh_create_failing_memory_is_reported, make_surface,
                                        free_surface),
        cmocka_unit_test_setup_teardown(test_mesh_import_failing_memory_is_reported, make_surface,
                                        free_surface),
        cmocka_unit_test_setup_teardown(test_parameterize_failing_memory_is_reported, make_surface,
                                        free_surface),
        cmocka_unit_test_setup_teardown(test_fit_failing_memory_is_reported, make_surface,
                                        free_surface),
        cmocka_unit_test_setup_teardown(test_fit_to_tolerance_failing_memory_is_reported,
                                        make_surface, free_surface),
        cmocka_unit_test(test_fit_modes_failing_memory_is_reported),
    };
    return cmocka_run_group_tests(tests, redirect_cholmod, remove_folder);
}
