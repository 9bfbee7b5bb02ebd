/* SPDX-License-Identifier: BSD-3-Clause */
/* Options and reports of libshcd-fit from callers with older or newer headers. */
#include "shcd/fit.h"

#include "abi/sized.h"

#define NEWER 24 /* bytes that a newer header would have appended */

static const double octahedron[18] = {0.01, 0.0,   0.0, -0.01, 0.0, 0.0,  0.0, 0.01, 0.0,
                                      0.0,  -0.01, 0.0, 0.0,   0.0, 0.01, 0.0, 0.0,  -0.01};
static const uint32_t faces[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4,
                                   2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};

static shcd_status make_mesh(shcd_mesh **mesh, shcd_mesh_report *report, shcd_error *error) {
    return shcd_mesh_create(octahedron, 6, faces, 8, mesh, report, error);
}

static void test_mesh_create_fills_what_the_caller_knows(void **unused) {
    (void)unused;
    shcd_mesh_report whole = SHCD_MESH_REPORT_INIT;
    shcd_mesh *mesh = NULL;
    assert_int_equal(make_mesh(&mesh, &whole, NULL), SHCD_OK);
    shcd_mesh_free(mesh);
    for (size_t size = sizeof(size_t); size <= sizeof whole + NEWER; size += sizeof(size_t)) {
        shcd_mesh_report *report = sized_copy("", 0, size);
        assert_int_equal(make_mesh(&mesh, report, NULL), SHCD_OK);
        shcd_mesh_free(mesh);
        sized_check_output(report, size, &whole, sizeof whole);
    }
}

static void test_mesh_create_without_size_is_refused(void **unused) {
    (void)unused;
    shcd_mesh_report report = SHCD_MESH_REPORT_INIT;
    shcd_mesh *mesh = NULL;
    shcd_error error = {SHCD_OK, ""};
    for (size_t size = 0; size < sizeof report.struct_size; size++) { /* less than itself */
        report.struct_size = size;
        sized_check_refusal(make_mesh(&mesh, &report, &error), &error);
        assert_null(mesh);
        sized_check_refusal(shcd_mesh_import("none.obj", 1.0, &mesh, &report, &error), &error);
        assert_null(mesh);
    }
}

/* Times are not reproducible; everything else is. */
static void clear_times(shcd_fit_report *report) {
    report->time_parameterize_s = report->time_coefficients_s = 0.0;
    report->time_model_s = report->time_error_s = report->time_modes_s = 0.0;
    report->record.fit_time_s = 0.0;
}

static void test_fit_old_or_new_caller_works(void **unused) {
    (void)unused;
    shcd_mesh *mesh = NULL;
    shcd_fit_options options = SHCD_FIT_OPTIONS_INIT;
    shcd_fit_report whole = SHCD_FIT_REPORT_INIT;
    options.degree = 2;
    assert_int_equal(make_mesh(&mesh, NULL, NULL), SHCD_OK);
    shcd_model *model = NULL;
    assert_int_equal(shcd_fit(mesh, &options, NULL, &model, &whole, NULL), SHCD_OK);
    shcd_model_free(model);
    clear_times(&whole);
    const size_t option_sizes[] = {offsetof(shcd_fit_options, tolerance_m),
                                   offsetof(shcd_fit_options, progress), sizeof options + NEWER};
    const size_t report_sizes[] = {offsetof(shcd_fit_report, n_flipped_start),
                                   offsetof(shcd_fit_report, time_parameterize_s),
                                   sizeof whole + NEWER};
    for (size_t i = 0; i < 3; i++) {
        shcd_fit_options *given = sized_input(&options, sizeof options, option_sizes[i]);
        shcd_fit_report *report = sized_copy("", 0, report_sizes[i]);
        assert_int_equal(shcd_fit(mesh, given, NULL, &model, report, NULL), SHCD_OK);
        shcd_model_free(model);
        if (report_sizes[i] >= sizeof whole) {
            clear_times(report);
        }
        sized_check_output(report, report_sizes[i], &whole, sizeof whole);
        free(given);
    }
    shcd_mesh_free(mesh);
}

static void test_fit_without_size_is_refused(void **unused) {
    (void)unused;
    shcd_mesh *mesh = NULL;
    shcd_model *model = NULL;
    double directions[18];
    shcd_error error = {SHCD_OK, ""};
    shcd_fit_options options = SHCD_FIT_OPTIONS_INIT;
    shcd_fit_report report = SHCD_FIT_REPORT_INIT;
    assert_int_equal(make_mesh(&mesh, NULL, NULL), SHCD_OK);
    options.struct_size = 0;
    sized_check_refusal(shcd_fit(mesh, &options, NULL, &model, NULL, &error), &error);
    sized_check_refusal(shcd_parameterize(mesh, &options, directions, NULL, &error), &error);
    report.struct_size = 0;
    sized_check_refusal(shcd_fit(mesh, NULL, NULL, &model, &report, &error), &error);
    sized_check_refusal(shcd_parameterize(mesh, NULL, directions, &report, &error), &error);
    assert_null(model);
    shcd_mesh_free(mesh);
}

static void test_fit_modes_options_of_any_caller_give_the_same_bits(void **unused) {
    (void)unused;
    const double coefficients[12] = {[3 * 3 + 0] = 0.06, [3 * 1 + 1] = 0.05, [3 * 2 + 2] = 0.04};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_modes *whole = NULL, *modes = NULL;
    shcd_error error = {SHCD_OK, ""};
    shcd_modes_options options = SHCD_MODES_OPTIONS_INIT;
    def.degree = 1;
    def.coefficients = coefficients;
    options.n_modes = 3;
    assert_int_equal(shcd_model_create(&def, NULL, &model, NULL), SHCD_OK);
    assert_int_equal(shcd_fit_modes(model, &options, &whole, NULL), SHCD_OK);
    const size_t sizes[] = {offsetof(shcd_modes_options, anchors),
                            offsetof(shcd_modes_options, progress), sizeof options + NEWER};
    for (size_t i = 0; i < 3; i++) {
        shcd_modes_options *given = sized_input(&options, sizeof options, sizes[i]);
        assert_int_equal(shcd_fit_modes(model, given, &modes, NULL), SHCD_OK);
        assert_int_equal(modes->n_modes, 3);
        assert_memory_equal(modes->eigenvalue_per_m2, whole->eigenvalue_per_m2,
                            3 * (1 + SHCD_COUNT(1)) * sizeof(double));
        shcd_modes_free(modes);
        free(given);
    }
    modes = NULL;
    options.struct_size = 0;
    sized_check_refusal(shcd_fit_modes(model, &options, &modes, &error), &error);
    assert_null(modes);
    shcd_modes_free(whole);
    shcd_model_free(model);
}

static size_t trained_bytes(const shcd_model *model, const shcd_train_options *options,
                            unsigned char **bytes) {
    shcd_model *trained = NULL;
    assert_int_equal(shcd_train(model, options, NULL, &trained, NULL), SHCD_OK);
    const size_t size = shcd_model_write_size(trained);
    *bytes = malloc(size);
    assert_non_null(*bytes);
    assert_int_equal(shcd_model_write(trained, *bytes, size), SHCD_OK);
    shcd_model_free(trained);
    return size;
}

static void test_train_options_of_any_caller_give_the_same_bits(void **unused) {
    (void)unused;
    const double coefficients[12] = {[3 * 3 + 0] = 0.06, [3 * 1 + 1] = 0.05, [3 * 2 + 2] = 0.04};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_train_options options = SHCD_TRAIN_OPTIONS_INIT;
    shcd_model *model = NULL;
    unsigned char *whole = NULL, *bytes = NULL;
    def.degree = 1;
    def.coefficients = coefficients;
    options.n_points = 20;
    assert_int_equal(shcd_model_create(&def, NULL, &model, NULL), SHCD_OK);
    const size_t size = trained_bytes(model, &options, &whole);
    const size_t sizes[] = {offsetof(shcd_train_options, space_degree),
                            offsetof(shcd_train_options, progress), sizeof options + NEWER};
    for (size_t i = 0; i < 3; i++) {
        shcd_train_options *given = sized_input(&options, sizeof options, sizes[i]);
        assert_int_equal(trained_bytes(model, given, &bytes), size);
        assert_memory_equal(bytes, whole, size);
        free(bytes);
        free(given);
    }
    free(whole);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mesh_create_fills_what_the_caller_knows),
        cmocka_unit_test(test_mesh_create_without_size_is_refused),
        cmocka_unit_test(test_fit_old_or_new_caller_works),
        cmocka_unit_test(test_fit_without_size_is_refused),
        cmocka_unit_test(test_fit_modes_options_of_any_caller_give_the_same_bits),
        cmocka_unit_test(test_train_options_of_any_caller_give_the_same_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
