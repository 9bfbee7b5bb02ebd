/* SPDX-License-Identifier: BSD-3-Clause */
/* The .shcd format: what is written comes back to the bit, and nothing that is cut, altered or
 * crafted gets in or does harm. */
#include "shcd/shcd.h"
#include "support/bodies.h"
#include "support/check.h"

#include <zlib.h>

#define HEADER 32u
#define CHUNK 24u
#define REQUIRED 1u

/* ---- files in memory ---- */

typedef struct file {
    unsigned char *bytes;
    size_t size;
} file;

static void put(unsigned char *p, uint64_t v, int n) {
    for (int i = 0; i < n; i++) {
        p[i] = (unsigned char)(v >> (8 * i));
    }
}

static uint64_t get(const unsigned char *p, int n) {
    uint64_t v = 0;
    for (int i = 0; i < n; i++) {
        v |= (uint64_t)p[i] << (8 * i);
    }
    return v;
}

static file file_of(const shcd_model *model) {
    file f = {NULL, shcd_model_write_size(model)};
    f.bytes = malloc(f.size);
    assert_non_null(f.bytes);
    assert_int_equal(shcd_model_write(model, f.bytes, f.size), SHCD_OK);
    return f;
}

static void repair_header(file *f) {
    put(f->bytes + 28, crc32(0, f->bytes, 28), 4);
}

/* CRC of the chunk at a byte, as long as it says it is. */
static void repair_chunk(file *f, size_t at) {
    const size_t n = CHUNK + (size_t)get(f->bytes + at + 16, 8);
    assert_true(at + n + 4 <= f->size);
    put(f->bytes + at + n, crc32(0, f->bytes + at, (uInt)n), 4);
}

/* Inserts a chunk of zeros before byte `at` and repairs header and CRCs. */
static void insert_chunk(file *f, size_t at, const char *name, uint32_t version, uint32_t flags,
                         size_t payload) {
    const size_t n = CHUNK + payload + 4;
    f->bytes = realloc(f->bytes, f->size + n);
    assert_non_null(f->bytes);
    memmove(f->bytes + at + n, f->bytes + at, f->size - at);
    f->size += n;
    memset(f->bytes + at, 0, n);
    memcpy(f->bytes + at, name, 4);
    put(f->bytes + at + 4, version, 4);
    put(f->bytes + at + 8, flags, 4);
    put(f->bytes + at + 16, payload, 8);
    repair_chunk(f, at);
    put(f->bytes + 16, f->size, 8);
    put(f->bytes + 24, get(f->bytes + 24, 4) + 1, 4);
    repair_header(f);
}

static void assert_refused(const void *bytes, size_t size, shcd_status status, const char *text) {
    shcd_error error = {SHCD_OK, ""};
    shcd_model *const untouched = (shcd_model *)(void *)&error;
    shcd_model *model = untouched;
    /* a copy of exactly that size, so that a tool like AddressSanitizer sees a step beyond it */
    unsigned char *copy = malloc(size > 0 ? size : 1);
    assert_non_null(copy);
    memcpy(copy, bytes, size);
    const shcd_status got = shcd_model_read(copy, size, NULL, &model, &error);
    free(copy);
    assert_ptr_equal(model, untouched);
    assert_true(got != SHCD_OK && got == error.status && error.message[0] != '\0');
    if (status != SHCD_OK) {
        assert_int_equal(got, status);
    }
    if (strstr(error.message, text) == NULL) {
        fail_msg("\"%s\" does not say \"%s\"", error.message, text);
    }
}

static shcd_model *assert_read(const file *f) {
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcd_model_read(f->bytes, f->size, NULL, &model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return model;
}

static shcd_model *create_with_record(int degree, const shcd_fit_record *fit) {
    static double coefficients[3 * SHCD_COUNT(8)];
    check_random random = {71};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    bodies_random_coefficients(&random, degree, 0.05, coefficients);
    coefficients[3] = 4.9406564584124654e-324; /* the smallest number; -0 is another trap */
    coefficients[5] = -0.0;
    def.degree = degree;
    def.coefficients = coefficients;
    def.fit = fit;
    assert_int_equal(shcd_model_create(&def, NULL, &model, NULL), SHCD_OK);
    return model;
}

static shcd_fit_record record_of_distinct_values(void) {
    shcd_fit_record r;
    double values[14];
    memset(&r, 0, sizeof r);
    r.n_triangles = 0x123456789abcdef0u;
    r.n_vertices = 2;
    for (int i = 0; i < 14; i++) {
        values[i] = 0.1 + i;
    }
    memcpy(&r.mesh_diagonal_m, values, sizeof values);
    return r;
}

/* ---- round trip ---- */

static void test_round_trip_keeps_every_bit(void **state) {
    const shcd_fit_record fit = record_of_distinct_values();
    (void)state;
    for (int degree = 1; degree <= 8; degree += 7) {
        for (int with_fit = 0; with_fit < 2; with_fit++) {
            shcd_model *a = create_with_record(degree, with_fit ? &fit : NULL);
            file f = file_of(a), g;
            shcd_model *b = assert_read(&f);
            const shcd_model_info x = bodies_info(a), y = bodies_info(b);
            assert_int_equal(shcd_model_degree(b), degree);
            assert_memory_equal(shcd_model_coefficients(a), shcd_model_coefficients(b),
                                3 * SHCD_COUNT(degree) * sizeof(double));
            assert_memory_equal(&x, &y, sizeof x);
            if (with_fit) {
                assert_memory_equal(&y.fit, &fit, sizeof fit);
            }
            g = file_of(b);
            assert_int_equal(f.size, g.size);
            assert_memory_equal(f.bytes, g.bytes, f.size);
            shcd_proximity p, q;
            assert_int_equal(shcd_closest(a, shcd_vec3_make(3.0, 1.0, -1.0), NULL, &p), SHCD_OK);
            assert_int_equal(shcd_closest(b, shcd_vec3_make(3.0, 1.0, -1.0), NULL, &q), SHCD_OK);
            assert_memory_equal(&p, &q, sizeof p);
            free(f.bytes);
            free(g.bytes);
            shcd_model_free(a);
            shcd_model_free(b);
        }
    }
}

static void test_size_and_layout_are_as_documented(void **state) {
    const shcd_fit_record fit = record_of_distinct_values();
    shcd_model *model = create_with_record(2, &fit);
    file f = file_of(model);
    double third;
    (void)state;
    assert_int_equal(f.size, HEADER + (CHUNK + 8 + 24 * 9 + 4) + (CHUNK + 16 + 8 * 14 + 4));
    assert_memory_equal(f.bytes, "\x89SHCD\r\n\x1a", 8);
    assert_int_equal(get(f.bytes + 8, 4), 1);
    assert_int_equal(get(f.bytes + 16, 8), f.size);
    assert_int_equal(get(f.bytes + 24, 4), 2);
    assert_memory_equal(f.bytes + HEADER, "COEF", 4);
    assert_int_equal(get(f.bytes + HEADER + CHUNK, 4), 2);
    const uint64_t bits = get(f.bytes + HEADER + CHUNK + 8 + 8 * 8, 8); /* little-endian */
    memcpy(&third, &bits, sizeof third);
    assert_true(third == shcd_model_coefficients(model)[8]);
    assert_int_equal(shcd_model_write(model, f.bytes, f.size - 1), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_write(model, NULL, f.size), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_write(NULL, f.bytes, f.size), SHCD_ERR_ARGUMENT);
    free(f.bytes);
    shcd_model_free(model);
}

/* ---- damage ---- */

static void test_every_altered_byte_is_noticed(void **state) {
    const shcd_fit_record fit = record_of_distinct_values();
    shcd_model *model = create_with_record(1, &fit);
    file f = file_of(model);
    (void)state;
    for (size_t i = 0; i < f.size; i++) {
        static const unsigned char flip[3] = {0xff, 0x01, 0x80};
        for (int k = 0; k < 3; k++) {
            f.bytes[i] ^= flip[k];
            assert_refused(f.bytes, f.size, SHCD_OK, "byte");
            f.bytes[i] ^= flip[k];
        }
    }
    shcd_model_free(assert_read(&f));
    free(f.bytes);
    shcd_model_free(model);
}

static void test_every_prefix_and_every_tail_is_refused(void **state) {
    const shcd_fit_record fit = record_of_distinct_values();
    shcd_model *model = create_with_record(1, &fit);
    file f = file_of(model);
    (void)state;
    for (size_t size = 0; size < f.size; size++) {
        assert_refused(f.bytes, size, SHCD_ERR_FORMAT, "byte");
        /* the same with a header that agrees with the cut */
        if (size >= HEADER) {
            file g = {malloc(size), size};
            assert_non_null(g.bytes);
            memcpy(g.bytes, f.bytes, size);
            put(g.bytes + 16, size, 8);
            repair_header(&g);
            assert_refused(g.bytes, g.size, SHCD_ERR_FORMAT, "byte");
            free(g.bytes);
        }
    }
    f.bytes = realloc(f.bytes, f.size + 1);
    assert_non_null(f.bytes);
    f.bytes[f.size] = 0;
    assert_refused(f.bytes, f.size + 1, SHCD_ERR_FORMAT, "byte");
    put(f.bytes + 16, f.size + 1, 8); /* said in the header, but in no chunk */
    f.size++;
    repair_header(&f);
    assert_refused(f.bytes, f.size, SHCD_ERR_FORMAT, "after the last chunk");
    free(f.bytes);
    shcd_model_free(model);
}

static void test_lengths_that_lie_are_refused_with_a_right_crc(void **state) {
    static const uint64_t lie[] = {0,
                                   1,
                                   7,
                                   8,
                                   95,
                                   105,
                                   1000,
                                   UINT32_MAX,
                                   (uint64_t)UINT32_MAX + 105,
                                   UINT64_MAX,
                                   UINT64_MAX - 27,
                                   UINT64_MAX - 28,
                                   (uint64_t)1 << 63};
    shcd_model *model = create_with_record(1, NULL);
    (void)state;
    for (size_t i = 0; i < sizeof lie / sizeof lie[0]; i++) {
        file f = file_of(model);
        put(f.bytes + HEADER + 16, lie[i], 8);
        if (HEADER + CHUNK + lie[i] + 4 <= f.size && lie[i] < 1000) {
            repair_chunk(&f, HEADER);
        } else { /* the CRC where the true length has it */
            const size_t n = f.size - HEADER - 4;
            put(f.bytes + HEADER + n, crc32(0, f.bytes + HEADER, (uInt)n), 4);
        }
        assert_refused(f.bytes, f.size, SHCD_ERR_FORMAT, "byte");
        put(f.bytes + 16, lie[i], 8); /* and in the header */
        repair_header(&f);
        assert_refused(f.bytes, f.size, SHCD_ERR_FORMAT, "byte");
        free(f.bytes);
    }
    shcd_model_free(model);
}

static void test_values_out_of_range_are_refused_with_a_right_crc(void **state) {
    static const uint64_t degree[] = {0, 2, 150, 151, UINT32_MAX, 0x80000001u};
    const shcd_fit_record fit = record_of_distinct_values();
    shcd_model *model = create_with_record(1, &fit);
    file f = file_of(model);
    const size_t second = HEADER + CHUNK + 104 + 4;
    uint64_t bits;
    double nan_value = NAN;
    (void)state;
    for (size_t i = 0; i < sizeof degree / sizeof degree[0]; i++) {
        put(f.bytes + HEADER + CHUNK, degree[i], 4);
        repair_chunk(&f, HEADER);
        assert_refused(f.bytes, f.size, SHCD_ERR_FORMAT, "COEF");
    }
    put(f.bytes + HEADER + CHUNK, 1, 4);
    put(f.bytes + HEADER + CHUNK + 4, 1, 4); /* reserved */
    repair_chunk(&f, HEADER);
    assert_refused(f.bytes, f.size, SHCD_ERR_FORMAT, "COEF");
    put(f.bytes + HEADER + CHUNK + 4, 0, 4);
    const uint64_t kept = get(f.bytes + HEADER + CHUNK + 8 + 8 * 7, 8);
    memcpy(&bits, &nan_value, sizeof bits);
    put(f.bytes + HEADER + CHUNK + 8 + 8 * 7, bits, 8);
    repair_chunk(&f, HEADER);
    assert_refused(f.bytes, f.size, SHCD_ERR_NOT_FINITE, "(l=1, m=0) of y");
    put(f.bytes + HEADER + CHUNK + 8 + 8 * 7, kept, 8);
    repair_chunk(&f, HEADER);
    put(f.bytes + second + CHUNK + 16, bits, 8);
    repair_chunk(&f, second);
    assert_refused(f.bytes, f.size, SHCD_ERR_NOT_FINITE, "FITR");
    free(f.bytes);
    shcd_model_free(model);
}

static void test_headers_out_of_range_are_refused_with_a_right_crc(void **state) {
    shcd_model *model = create_with_record(1, NULL);
    (void)state;
    for (int i = 0; i < 6; i++) {
        static const size_t at[6] = {8, 8, 12, 24, 24, 24};
        static const uint32_t value[6] = {0, 2, 1, 0, 2, UINT32_MAX};
        file f = file_of(model);
        put(f.bytes + at[i], value[i], 4);
        repair_header(&f);
        assert_refused(f.bytes, f.size, i < 3 ? SHCD_ERR_UNSUPPORTED : SHCD_ERR_FORMAT,
                       i < 3 ? "version" : "chunk");
        free(f.bytes);
    }
    shcd_model_free(model);
}

/* ---- chunks ---- */

static void test_unknown_chunks_are_skipped_unless_required(void **state) {
    const shcd_fit_record fit = record_of_distinct_values();
    shcd_model *model = create_with_record(1, &fit);
    const size_t end = shcd_model_write_size(model), second = HEADER + CHUNK + 104 + 4;
    const size_t at[3] = {HEADER, second, end};
    (void)state;
    for (int i = 0; i < 3; i++) {
        file f = file_of(model);
        insert_chunk(&f, at[i], "ZZZZ", 9, 0, i == 0 ? 0 : 4099);
        insert_chunk(&f, at[i], "COEF", 2, 0, 5); /* a later version that may be ignored */
        insert_chunk(&f, at[i], "FITR", 7, 0, 3);
        shcd_model *back = assert_read(&f);
        const shcd_model_info info = bodies_info(back);
        assert_memory_equal(&info.fit, &fit, sizeof fit);
        shcd_model_free(back);
        insert_chunk(&f, at[i], "ZZZZ", 9, REQUIRED, 16);
        assert_refused(f.bytes, f.size, SHCD_ERR_UNSUPPORTED, "byte");
        free(f.bytes);
    }
    shcd_model_free(model);
}

static void test_chunks_that_must_be_single_or_present_are(void **state) {
    shcd_model *model = create_with_record(1, NULL);
    file f = file_of(model);
    (void)state;
    insert_chunk(&f, f.size, "COEF", 1, REQUIRED, 104);
    put(f.bytes + f.size - 4 - 104, 1, 4); /* its degree */
    repair_chunk(&f, f.size - 4 - 104 - CHUNK);
    assert_refused(f.bytes, f.size, SHCD_ERR_FORMAT, "second chunk COEF");
    free(f.bytes);
    f = file_of(model);
    memcpy(f.bytes + HEADER, "coef", 4);
    put(f.bytes + HEADER + 8, 0, 4);
    repair_chunk(&f, HEADER);
    assert_refused(f.bytes, f.size, SHCD_ERR_FORMAT, "no chunk COEF");
    memcpy(f.bytes + HEADER, "COEF", 4); /* a later version of it, required */
    put(f.bytes + HEADER + 4, 2, 4);
    put(f.bytes + HEADER + 8, REQUIRED, 4);
    repair_chunk(&f, HEADER);
    assert_refused(f.bytes, f.size, SHCD_ERR_UNSUPPORTED, "version 2");
    free(f.bytes);
    f = file_of(model);
    for (int i = 0; i < 2; i++) {
        insert_chunk(&f, f.size, "FITR", 1, 0, 128);
        put(f.bytes + f.size - 4 - 128, 5, 8); /* n_triangles: a record */
        repair_chunk(&f, f.size - 4 - 128 - CHUNK);
    }
    assert_refused(f.bytes, f.size, SHCD_ERR_FORMAT, "FITR");
    free(f.bytes);
    shcd_model_free(model);
}

static void test_read_refuses_null(void **state) {
    shcd_model *model = NULL;
    const unsigned char byte = 0;
    (void)state;
    assert_int_equal(shcd_model_read(NULL, 9, NULL, &model, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_read(&byte, 1, NULL, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_read(&byte, 1, NULL, &model, NULL), SHCD_ERR_FORMAT);
    assert_null(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip_keeps_every_bit),
        cmocka_unit_test(test_size_and_layout_are_as_documented),
        cmocka_unit_test(test_every_altered_byte_is_noticed),
        cmocka_unit_test(test_every_prefix_and_every_tail_is_refused),
        cmocka_unit_test(test_lengths_that_lie_are_refused_with_a_right_crc),
        cmocka_unit_test(test_values_out_of_range_are_refused_with_a_right_crc),
        cmocka_unit_test(test_headers_out_of_range_are_refused_with_a_right_crc),
        cmocka_unit_test(test_unknown_chunks_are_skipped_unless_required),
        cmocka_unit_test(test_chunks_that_must_be_single_or_present_are),
        cmocka_unit_test(test_read_refuses_null)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
