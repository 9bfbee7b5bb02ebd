/* SPDX-License-Identifier: BSD-3-Clause */
/* The cost table of a model: what goes in comes out, through a file too, and what could mislead a
 * scene does not get in. */
#include "shcd/accuracy.h"
#include "shcd/map.h"
#include "support/bodies.h"

#include <zlib.h>

#define DEGREE 3
#define N_ROWS 4
#define CHUNK_HEADER 24
#define HEADER 32
#define ROW_SIZE 160
#define TABLE_AT (8 + SHCD_COST_MACHINE_SIZE) /* of the first row, in the payload */

/* Every member has a value of its own. */
static void fill_rows(shcd_cost_row *rows) {
    for (int i = 0; i < N_ROWS; i++) {
        double values[12];
        memset(&rows[i], 0, sizeof rows[i]);
        rows[i].degree = 1 + i % DEGREE;
        rows[i].tier = i;
        rows[i].map_resolution = i == SHCD_TIER_MAP ? 32 : 0;
        rows[i].interpolation = i == SHCD_TIER_MAP ? SHCD_MAP_HERMITE : 0;
        for (int k = 0; k < 12; k++) {
            values[k] = 0.1 + 100.0 * i + k;
        }
        memcpy(&rows[i].error_max_m, values, sizeof values);
        rows[i].bytes = 0x123456789abcdef0u + (uint64_t)i;
        for (int k = 0; k < 5; k++) {
            rows[i].reserved[k] = -1.5 * k; /* what later versions may put there comes through */
        }
    }
}

static shcd_status create(const shcd_cost_row *rows, size_t n, const char *machine,
                          const shcd_fit_record *fit, shcd_model **model, shcd_error *error) {
    double coefficients[3 * SHCD_COUNT(DEGREE)];
    check_random random = {0xc057u};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    bodies_random_coefficients(&random, DEGREE, 0.05, coefficients);
    def.degree = DEGREE;
    def.coefficients = coefficients;
    def.fit = fit;
    def.cost_rows = rows;
    def.n_cost_rows = n;
    def.cost_machine = machine;
    return shcd_model_create(&def, NULL, model, error);
}

static void assert_table(const shcd_model *model, const shcd_cost_row *rows, size_t n,
                         const char *machine) {
    size_t got = 99;
    const shcd_cost_row *table = shcd_model_cost_rows(model, &got);
    assert_int_equal(got, n);
    if (n > 0) {
        assert_memory_equal(table, rows, n * sizeof *rows);
    } else {
        assert_null(table);
    }
    assert_string_equal(shcd_model_cost_machine(model), machine);
}

static size_t written(const shcd_model *model, unsigned char **bytes) {
    const size_t size = shcd_model_write_size(model);
    *bytes = malloc(size);
    assert_non_null(*bytes);
    assert_int_equal(shcd_model_write(model, *bytes, size), SHCD_OK);
    return size;
}

static void test_cost_table_goes_through_a_file_unchanged(void **state) {
    const char *const machines[] = {"A processor of 3 GHz", "", NULL};
    shcd_fit_record fit;
    shcd_cost_row rows[N_ROWS];
    (void)state;
    memset(&fit, 0, sizeof fit);
    fit.n_triangles = 7;
    fill_rows(rows);
    for (int i = 0; i < 6; i++) {
        const char *machine = machines[i % 3];
        const char *expected = machine != NULL ? machine : "";
        shcd_model *model = NULL, *copy = NULL;
        unsigned char *bytes = NULL, *again = NULL;
        assert_int_equal(create(rows, N_ROWS, machine, i < 3 ? NULL : &fit, &model, NULL), SHCD_OK);
        assert_table(model, rows, N_ROWS, expected);
        const size_t size = written(model, &bytes);
        assert_int_equal(shcd_model_read(bytes, size, NULL, &copy, NULL), SHCD_OK);
        assert_table(copy, rows, N_ROWS, expected);
        assert_int_equal(written(copy, &again), size);
        assert_memory_equal(bytes, again, size);
        free(bytes);
        free(again);
        shcd_model_free(copy);
        shcd_model_free(model);
    }
}

static void test_cost_table_none_is_no_chunk(void **state) {
    shcd_cost_row rows[N_ROWS];
    shcd_model *without = NULL, *with = NULL;
    (void)state;
    fill_rows(rows);
    assert_int_equal(create(NULL, 0, NULL, NULL, &without, NULL), SHCD_OK);
    assert_int_equal(create(rows, N_ROWS, NULL, NULL, &with, NULL), SHCD_OK);
    assert_table(without, NULL, 0, "");
    assert_int_equal(shcd_model_write_size(with) - shcd_model_write_size(without),
                     CHUNK_HEADER + TABLE_AT + N_ROWS * ROW_SIZE + 4);
    assert_null(shcd_model_cost_rows(NULL, NULL));
    assert_string_equal(shcd_model_cost_machine(NULL), "");
    shcd_model_free(with);
    shcd_model_free(without);
}

/* ---- what is refused ---- */

static void refused(const shcd_cost_row *row, size_t n, const char *machine, shcd_status expected,
                    const char *text) {
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = create(row, n, machine, NULL, &model, &error);
    if (status != expected || strstr(error.message, text) == NULL || model != NULL) {
        fail_msg("status %d, '%s', not '%s'", (int)status, error.message, text);
    }
}

static void test_create_misleading_row_is_refused(void **state) {
    static shcd_cost_row many[SHCD_COST_ROWS_MAX + 1];
    shcd_cost_row rows[N_ROWS], row;
    char machine[SHCD_COST_MACHINE_SIZE + 1];
    (void)state;
    fill_rows(rows);
    row = rows[1];
    row.degree = DEGREE + 1;
    refused(&row, 1, NULL, SHCD_ERR_ARGUMENT, "degree 4 is not in 1 .. 3");
    row.degree = 0;
    refused(&row, 1, NULL, SHCD_ERR_ARGUMENT, "degree 0 is not in 1 .. 3");
    row = rows[1];
    row.tier = SHCD_TIER_TRACK + 1;
    refused(&row, 1, NULL, SHCD_ERR_ARGUMENT, "unknown tier 4");
    row = rows[1];
    row.map_resolution = 32;
    refused(&row, 1, NULL, SHCD_ERR_ARGUMENT, "map resolution 32");
    row = rows[SHCD_TIER_MAP];
    row.map_resolution = SHCD_MAP_RESOLUTION_MAX + 1;
    refused(&row, 1, NULL, SHCD_ERR_ARGUMENT, "map resolution 513");
    row = rows[1];
    row.ns_p99 = -1.0;
    refused(&row, 1, NULL, SHCD_ERR_ARGUMENT, "value 5 is negative");
    row = rows[1];
    row.error_max_m = (double)NAN;
    refused(&row, 1, NULL, SHCD_ERR_NOT_FINITE, "value 0 is not finite");
    row = rows[1];
    row.reserved[4] = (double)INFINITY;
    refused(&row, 1, NULL, SHCD_ERR_NOT_FINITE, "value 16 is not finite");
    refused(NULL, 1, NULL, SHCD_ERR_ARGUMENT, "1 cost rows");
    refused(many, SHCD_COST_ROWS_MAX + 1, NULL, SHCD_ERR_ARGUMENT, "257 cost rows");
    memset(machine, 'm', sizeof machine);
    machine[SHCD_COST_MACHINE_SIZE] = '\0';
    refused(rows, N_ROWS, machine, SHCD_ERR_ARGUMENT, "too long");
    refused(rows, N_ROWS, "two\nlines", SHCD_ERR_ARGUMENT, "byte 3");
}

static void put(unsigned char *p, uint64_t bits, size_t n) {
    for (size_t i = 0; i < n; i++) {
        p[i] = (unsigned char)(bits >> (8 * i));
    }
}

/* Changes bytes of the payload, mends the sum, and expects the refusal. */
static void refused_in_file(size_t at, uint64_t bits, size_t n, shcd_status expected,
                            const char *text) {
    shcd_cost_row rows[N_ROWS];
    shcd_model *model = NULL, *copy = NULL;
    unsigned char *bytes = NULL;
    shcd_error error = {SHCD_OK, ""};
    fill_rows(rows);
    assert_int_equal(create(rows, N_ROWS, "m", NULL, &model, NULL), SHCD_OK);
    const size_t size = written(model, &bytes);
    const size_t chunk = size - (CHUNK_HEADER + TABLE_AT + N_ROWS * ROW_SIZE + 4);
    assert_memory_equal(bytes + chunk, "COST", 4);
    put(bytes + chunk + CHUNK_HEADER + at, bits, n);
    put(bytes + size - 4, crc32(0, bytes + chunk, (uInt)(size - 4 - chunk)), 4);
    const shcd_status status = shcd_model_read(bytes, size, NULL, &copy, &error);
    if (status != expected || strstr(error.message, text) == NULL || copy != NULL) {
        fail_msg("status %d, '%s', not '%s'", (int)status, error.message, text);
    }
    free(bytes);
    shcd_model_free(model);
}

static void test_read_misleading_table_is_refused(void **state) {
    const uint64_t nan_bits = 0x7ff8000000000000u, minus_one = 0xbff0000000000000u;
    (void)state;
    refused_in_file(0, 0, 4, SHCD_ERR_FORMAT, "COST");
    refused_in_file(0, N_ROWS + 1, 4, SHCD_ERR_FORMAT, "COST");
    refused_in_file(0, UINT32_MAX, 4, SHCD_ERR_FORMAT, "COST");
    refused_in_file(4, ROW_SIZE + 8, 4, SHCD_ERR_FORMAT, "COST");
    refused_in_file(8, 7, 1, SHCD_ERR_FORMAT, "machine");
    refused_in_file(TABLE_AT + ROW_SIZE, DEGREE + 1, 4, SHCD_ERR_FORMAT, "row 1: degree 4");
    refused_in_file(TABLE_AT, UINT32_MAX, 4, SHCD_ERR_FORMAT, "row 0: degree -1");
    refused_in_file(TABLE_AT + 4, UINT32_MAX, 4, SHCD_ERR_FORMAT, "unknown tier -1");
    refused_in_file(TABLE_AT + 16, nan_bits, 8, SHCD_ERR_NOT_FINITE, "value 0 is not finite");
    refused_in_file(TABLE_AT + 24, minus_one, 8, SHCD_ERR_FORMAT, "value 1 is negative");
    refused_in_file(TABLE_AT + ROW_SIZE - 8, nan_bits, 8, SHCD_ERR_NOT_FINITE, "value 16");
}

/* A caller compiled before the table existed passes a shorter definition. */
static void test_create_older_definition_has_no_table(void **state) {
    double coefficients[12];
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    (void)state;
    bodies_ellipsoid_coefficients(1.0, 0.8, 0.6, coefficients);
    def.struct_size = offsetof(shcd_model_def, cost_rows);
    def.degree = 1;
    def.coefficients = coefficients;
    def.cost_rows = (const shcd_cost_row *)(uintptr_t)16; /* beyond what it says it has */
    def.n_cost_rows = 1;
    assert_int_equal(shcd_model_create(&def, NULL, &model, NULL), SHCD_OK);
    assert_table(model, NULL, 0, "");
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cost_table_goes_through_a_file_unchanged),
        cmocka_unit_test(test_cost_table_none_is_no_chunk),
        cmocka_unit_test(test_create_misleading_row_is_refused),
        cmocka_unit_test(test_read_misleading_table_is_refused),
        cmocka_unit_test(test_create_older_definition_has_no_table),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
