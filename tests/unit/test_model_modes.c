/* SPDX-License-Identifier: BSD-3-Clause */
/* The modes of a model: what goes in comes out, through a file too, and what a response could not
 * take does not get in. */
#include "shcd/model.h"
#include "support/bodies.h"
#include "support/some_modes.h"

#include <zlib.h>

#define DEGREE 3
#define N_MODES 5
#define N_NUMBERS SOME_MODES_SIZE(DEGREE, N_MODES)
#define CHUNK_HEADER 24
#define HEAD 40 /* of the payload, before the numbers */
#define CHUNK_SIZE (CHUNK_HEADER + HEAD + 8 * N_NUMBERS + 4)

static shcd_status create(const shcd_modes *modes, shcd_model **model, shcd_error *error) {
    double coefficients[3 * SHCD_COUNT(DEGREE)];
    check_random random = {0x40deu};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    bodies_random_coefficients(&random, DEGREE, 0.05, coefficients);
    def.degree = DEGREE;
    def.coefficients = coefficients;
    def.modes = modes;
    return shcd_model_create(&def, NULL, model, error);
}

static void assert_same(const shcd_modes *got, const shcd_modes *expected) {
    assert_non_null(got);
    assert_int_equal(got->n_modes, expected->n_modes);
    assert_memory_equal(got->eigenvalue_per_m2, expected->eigenvalue_per_m2,
                        N_MODES * sizeof(double));
    assert_memory_equal(got->coefficient_per_m, expected->coefficient_per_m,
                        N_MODES * SHCD_COUNT(DEGREE) * sizeof(double));
    assert_memory_equal(&got->area_m2, &expected->area_m2,
                        sizeof *got - offsetof(shcd_modes, area_m2));
}

static size_t written(const shcd_model *model, unsigned char **bytes) {
    const size_t size = shcd_model_write_size(model);
    *bytes = malloc(size);
    assert_non_null(*bytes);
    assert_int_equal(shcd_model_write(model, *bytes, size), SHCD_OK);
    return size;
}

static void test_modes_go_through_a_file_unchanged(void **state) {
    double numbers[N_NUMBERS];
    const shcd_modes modes = some_modes(DEGREE, N_MODES, numbers);
    shcd_model *model = NULL, *copy = NULL;
    unsigned char *bytes = NULL, *again = NULL;
    (void)state;
    assert_int_equal(create(&modes, &model, NULL), SHCD_OK);
    assert_same(shcd_model_modes(model), &modes);
    assert_ptr_not_equal(shcd_model_modes(model)->eigenvalue_per_m2, numbers);
    const size_t size = written(model, &bytes);
    assert_int_equal(shcd_model_read(bytes, size, NULL, &copy, NULL), SHCD_OK);
    assert_same(shcd_model_modes(copy), &modes);
    assert_int_equal(written(copy, &again), size);
    assert_memory_equal(bytes, again, size);
    free(bytes);
    free(again);
    shcd_model_free(copy);
    shcd_model_free(model);
}

static void test_modes_none_are_no_chunk_and_no_memory(void **state) {
    double numbers[N_NUMBERS];
    const shcd_modes modes = some_modes(DEGREE, N_MODES, numbers);
    shcd_model *without = NULL, *with = NULL;
    (void)state;
    assert_int_equal(create(NULL, &without, NULL), SHCD_OK);
    assert_int_equal(create(&modes, &with, NULL), SHCD_OK);
    assert_null(shcd_model_modes(without));
    assert_null(shcd_model_modes(NULL));
    assert_int_equal(shcd_model_write_size(with) - shcd_model_write_size(without), CHUNK_SIZE);
    assert_int_equal(bodies_info(with).run_time_bytes - bodies_info(without).run_time_bytes,
                     N_NUMBERS * sizeof(double));
    shcd_model_free(with);
    shcd_model_free(without);
}

/* ---- what is refused ---- */

static void refused(const shcd_modes *modes, shcd_status expected, const char *text) {
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = create(modes, &model, &error);
    if (status != expected || strstr(error.message, text) == NULL || model != NULL) {
        fail_msg("status %d, '%s', not '%s'", (int)status, error.message, text);
    }
}

static void test_create_modes_out_of_range_are_refused(void **state) {
    double numbers[N_NUMBERS];
    const shcd_modes good = some_modes(DEGREE, N_MODES, numbers);
    shcd_modes modes = good;
    (void)state;
    modes.n_modes = 0;
    refused(&modes, SHCD_ERR_ARGUMENT, "model_create: 0 modes, not 1 .. 16");
    modes.n_modes = 17;
    refused(&modes, SHCD_ERR_ARGUMENT, "17 modes, not 1 .. 16");
    modes = good;
    modes.area_m2 = 0.0;
    refused(&modes, SHCD_ERR_ARGUMENT, "the modes' area is 0");
    modes.area_m2 = (double)INFINITY;
    refused(&modes, SHCD_ERR_NOT_FINITE, "the modes' area is not finite");
    modes = good;
    modes.volume_m3 = -1.0;
    refused(&modes, SHCD_ERR_ARGUMENT, "the modes' volume is -1");
    modes = good;
    modes.eigenvalue_error = -1e-9;
    refused(&modes, SHCD_ERR_ARGUMENT, "the modes' eigenvalue error is -1e-09");
    modes = good;
    modes.is_anchored = 2;
    refused(&modes, SHCD_ERR_ARGUMENT, "is_anchored of the modes is 2");
    modes = good;
    modes.eigenvalue_per_m2 = NULL;
    refused(&modes, SHCD_ERR_ARGUMENT, "no eigenvalues");
    modes = good;
    modes.coefficient_per_m = NULL;
    refused(&modes, SHCD_ERR_ARGUMENT, "no coefficients");
}

static void refused_number(size_t at, double value, shcd_status expected, const char *text) {
    double numbers[N_NUMBERS];
    const shcd_modes modes = some_modes(DEGREE, N_MODES, numbers);
    numbers[at] = value;
    refused(&modes, expected, text);
}

static void test_create_numbers_of_modes_that_cannot_be_are_refused(void **state) {
    (void)state;
    refused_number(0, -1e-300, SHCD_ERR_ARGUMENT, "eigenvalue 0 is -1e-300");
    refused_number(2, 99.0, SHCD_ERR_ARGUMENT, "eigenvalue 2 is 99");
    refused_number(4, 1e31, SHCD_ERR_ARGUMENT, "eigenvalue 4 is 1e+31");
    refused_number(3, (double)NAN, SHCD_ERR_NOT_FINITE, "eigenvalue 3 is not finite");
    refused_number(N_MODES + 16 + 2, (double)NAN, SHCD_ERR_NOT_FINITE, "coefficient 2 of mode 1");
    refused_number(N_NUMBERS - 1, -1e31, SHCD_ERR_ARGUMENT, "coefficient 15 of mode 4");
}

static void put(unsigned char *p, uint64_t bits, size_t n) {
    for (size_t i = 0; i < n; i++) {
        p[i] = (unsigned char)(bits >> (8 * i));
    }
}

/* Changes bytes of the payload, mends the sum, and expects the refusal. */
static void refused_in_file(size_t at, uint64_t bits, size_t n, shcd_status expected,
                            const char *text) {
    double numbers[N_NUMBERS];
    const shcd_modes modes = some_modes(DEGREE, N_MODES, numbers);
    shcd_model *model = NULL, *copy = NULL;
    unsigned char *bytes = NULL;
    shcd_error error = {SHCD_OK, ""};
    assert_int_equal(create(&modes, &model, NULL), SHCD_OK);
    const size_t size = written(model, &bytes);
    const size_t chunk = size - CHUNK_SIZE;
    assert_memory_equal(bytes + chunk, "MODE", 4);
    put(bytes + chunk + CHUNK_HEADER + at, bits, n);
    put(bytes + size - 4, crc32(0, bytes + chunk, (uInt)(size - 4 - chunk)), 4);
    const shcd_status status = shcd_model_read(bytes, size, NULL, &copy, &error);
    if (status != expected || strstr(error.message, "chunk MODE") == NULL ||
        strstr(error.message, text) == NULL || copy != NULL) {
        fail_msg("status %d, '%s', not '%s'", (int)status, error.message, text);
    }
    free(bytes);
    shcd_model_free(model);
}

static void test_read_modes_that_cannot_be_are_refused(void **state) {
    const uint64_t nan_bits = 0x7ff8000000000000u, minus_one = 0xbff0000000000000u;
    (void)state;
    refused_in_file(0, 0, 4, SHCD_ERR_FORMAT, "do not fit");
    refused_in_file(0, N_MODES + 1, 4, SHCD_ERR_FORMAT, "do not fit");
    refused_in_file(0, UINT32_MAX, 4, SHCD_ERR_FORMAT, "do not fit");
    refused_in_file(4, DEGREE + 1, 4, SHCD_ERR_FORMAT, "do not fit");
    refused_in_file(4, UINT32_MAX, 4, SHCD_ERR_FORMAT, "do not fit");
    refused_in_file(8, UINT32_MAX, 4, SHCD_ERR_FORMAT, "is_anchored of the modes is -1");
    refused_in_file(16, nan_bits, 8, SHCD_ERR_NOT_FINITE, "area is not finite");
    refused_in_file(24, minus_one, 8, SHCD_ERR_FORMAT, "volume is -1");
    refused_in_file(32, minus_one, 8, SHCD_ERR_FORMAT, "eigenvalue error is -1");
    refused_in_file(HEAD, minus_one, 8, SHCD_ERR_FORMAT, "eigenvalue 0 is -1");
    refused_in_file(HEAD + 16, 0, 8, SHCD_ERR_FORMAT, "eigenvalue 2 is 0");
    refused_in_file(HEAD + 8 * N_MODES, nan_bits, 8, SHCD_ERR_NOT_FINITE,
                    "coefficient 0 of mode 0");
}

/* Modes of one body in the file of another: they fit each other's size, not the degree. */
static void test_read_modes_of_another_degree_are_refused(void **state) {
    double numbers[N_NUMBERS], low[12];
    const shcd_modes modes = some_modes(DEGREE, N_MODES, numbers);
    shcd_model *model = NULL, *other = NULL, *copy = NULL;
    unsigned char *bytes = NULL, *others = NULL;
    shcd_error error = {SHCD_OK, ""};
    (void)state;
    bodies_ellipsoid_coefficients(1.0, 0.9, 0.8, low);
    other = bodies_create(1, low);
    assert_int_equal(create(&modes, &model, NULL), SHCD_OK);
    const size_t size = written(model, &bytes), other_size = written(other, &others);
    unsigned char *both = malloc(other_size + CHUNK_SIZE);
    assert_non_null(both);
    memcpy(both, others, other_size);
    memcpy(both + other_size, bytes + size - CHUNK_SIZE, CHUNK_SIZE);
    put(both + 16, other_size + CHUNK_SIZE, 8);
    put(both + 24, 2, 4);
    put(both + 28, crc32(0, both, 28), 4);
    assert_int_equal(shcd_model_read(both, other_size + CHUNK_SIZE, NULL, &copy, &error),
                     SHCD_ERR_FORMAT);
    assert_non_null(strstr(error.message, "modes of degree 3, the body's is 1"));
    free(both);
    free(bytes);
    free(others);
    shcd_model_free(model);
    shcd_model_free(other);
}

/* A caller compiled before modes existed passes a shorter definition. */
static void test_create_older_definition_has_no_modes(void **state) {
    double coefficients[12];
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    (void)state;
    bodies_ellipsoid_coefficients(1.0, 0.8, 0.6, coefficients);
    def.struct_size = offsetof(shcd_model_def, modes);
    def.degree = 1;
    def.coefficients = coefficients;
    def.modes = (const shcd_modes *)(uintptr_t)16; /* beyond what it says it has */
    assert_int_equal(shcd_model_create(&def, NULL, &model, NULL), SHCD_OK);
    assert_null(shcd_model_modes(model));
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_modes_go_through_a_file_unchanged),
        cmocka_unit_test(test_modes_none_are_no_chunk_and_no_memory),
        cmocka_unit_test(test_create_modes_out_of_range_are_refused),
        cmocka_unit_test(test_create_numbers_of_modes_that_cannot_be_are_refused),
        cmocka_unit_test(test_read_modes_that_cannot_be_are_refused),
        cmocka_unit_test(test_read_modes_of_another_degree_are_refused),
        cmocka_unit_test(test_create_older_definition_has_no_modes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
