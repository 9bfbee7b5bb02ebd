/* SPDX-License-Identifier: BSD-3-Clause */
/* Body files of less than 8 KB, changed at random and then given the checksums that fit: refused
 * with a reason, or a model that answers. And a file cannot make the reader take more memory than
 * its size allows. */
#include "mutate.h"

#include "shcd/query.h"
#include "support/some_modes.h"

enum {
    N_CASES = 4000,
    CAPACITY = 8192,
    HEADER = 32,
    CHUNK_HEADER = 24,
    CHUNK_LENGTH = 16, /* where in a chunk its length stands */
    COEFFICIENTS = 8,  /* where in the payload of COEF they start */
    N_MODES_MOST = 9,
    N_SEEDS = 5
};

/* The stated bound. A model takes a tree and a map of a size that is capped, at most 16 MiB while
 * it is made, and grids that grow with the number of coefficients, at most 1 KiB for each harmonic,
 * which takes 24 bytes of the file. What is refused before its coefficients are complete takes
 * nothing, what is refused for one of them a copy of the payload. */
#define BYTES_CONSTANT ((size_t)16 << 20)
#define BYTES_PER_HARMONIC ((size_t)1024)

/* ---- an allocator that counts ---- */

typedef struct meter {
    size_t now, peak;
} meter;

typedef union block {
    size_t size;
    max_align_t aligned;
} block;

static void *meter_allocate(size_t size, void *user) {
    meter *m = user;
    block *b = malloc(sizeof *b + size);
    if (b == NULL) {
        return NULL;
    }
    b->size = size;
    m->now += size;
    m->peak = m->now > m->peak ? m->now : m->peak;
    return b + 1;
}

static void meter_release(void *memory, void *user) {
    meter *m = user;
    block *b = memory;
    if (b != NULL) {
        m->now -= b[-1].size;
        free(b - 1);
    }
}

/* ---- the format ---- */

static uint64_t get_bits(const unsigned char *p, size_t n) {
    uint64_t bits = 0;
    while (n-- > 0) {
        bits = bits << 8 | p[n];
    }
    return bits;
}

static void put_bits(unsigned char *p, uint64_t bits, size_t n) {
    for (size_t i = 0; i < n; ++i) {
        p[i] = (unsigned char)(bits >> (8 * i));
    }
}

/* CRC-32 by its definition, bit by bit: not the library's. */
static uint32_t crc_of(const unsigned char *p, size_t n) {
    uint32_t crc = UINT32_MAX;
    for (size_t i = 0; i < n; ++i) {
        crc ^= p[i];
        for (int k = 0; k < 8; ++k) {
            crc = crc >> 1 ^ (crc & 1u ? 0xedb88320u : 0u);
        }
    }
    return ~crc;
}

/* The chunk after the one at `at`; 0 if that one does not fit. */
static size_t next_chunk(const mutant *m, size_t at) {
    if (at > m->size || m->size - at < CHUNK_HEADER + 4) {
        return 0;
    }
    const uint64_t length = get_bits(m->bytes + at + CHUNK_LENGTH, 8);
    return length <= m->size - at - CHUNK_HEADER - 4 ? at + CHUNK_HEADER + (size_t)length + 4 : 0;
}

/* Sums over whatever the lengths now say; the size and the number of chunks only if wanted. */
static void repair(mutant *m, int with_counts) {
    uint32_t n_chunks = 0;
    for (size_t at = HEADER, next; (next = next_chunk(m, at)) != 0; at = next) {
        put_bits(m->bytes + next - 4, crc_of(m->bytes + at, next - 4 - at), 4);
        ++n_chunks;
    }
    if (m->size >= HEADER) {
        if (with_counts) {
            put_bits(m->bytes + 16, m->size, 8);
            put_bits(m->bytes + 24, n_chunks, 4);
        }
        put_bits(m->bytes + 28, crc_of(m->bytes, 28), 4);
    }
}

/* ---- files to start from ---- */

static unsigned char seed_bytes[N_SEEDS][CAPACITY];
static mutant seeds[N_SEEDS];

/* An ellipsoid with small ripples. */
static shcd_model *make_body(int degree, int with_fit, size_t n_cost_rows, size_t n_modes,
                             const shcd_allocator *allocator) {
    static const double half_axes[3] = {0.05, 0.04, 0.03};
    const double n1 = 0.48860251190291992;
    const size_t n = 3 * SHCD_COUNT(degree);
    check_random r = {0xb0d1e5u + (uint64_t)degree};
    double *coefficients = calloc(n, sizeof *coefficients);
    shcd_fit_record fit;
    shcd_cost_row rows[4];
    double *numbers = calloc(SOME_MODES_SIZE(degree, N_MODES_MOST), sizeof *numbers);
    shcd_modes modes;
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    assert_non_null(coefficients);
    assert_non_null(numbers);
    assert_true(n_modes <= N_MODES_MOST);
    assert_true(n_cost_rows <= sizeof rows / sizeof rows[0]);
    for (size_t i = 12; i < n; ++i) {
        coefficients[i] = check_uniform(&r, -1.0, 1.0) * 0.002 / (double)SHCD_COUNT(degree);
    }
    coefficients[3 * SHCD_INDEX(1, 1)] = half_axes[0] / n1;
    coefficients[3 * SHCD_INDEX(1, -1) + 1] = half_axes[1] / n1;
    coefficients[3 * SHCD_INDEX(1, 0) + 2] = half_axes[2] / n1;
    memset(&fit, 0, sizeof fit);
    fit.n_triangles = 100;
    fit.n_vertices = 52;
    fit.mesh_diagonal_m = 0.1;
    def.degree = degree;
    def.coefficients = coefficients;
    def.fit = with_fit ? &fit : NULL;
    memset(rows, 0, sizeof rows);
    for (size_t i = 0; i < n_cost_rows; ++i) {
        rows[i].degree = 1 + (int32_t)i % degree;
        rows[i].tier = (int32_t)i;
        rows[i].map_resolution = i == SHCD_TIER_MAP ? 32 : 0;
        rows[i].error_max_m = 1e-4;
        rows[i].ns_p50 = rows[i].ns_p99 = 500.0 * (double)(i + 1);
    }
    def.cost_rows = rows;
    def.n_cost_rows = n_cost_rows;
    def.cost_machine = "a machine";
    modes = some_modes(degree, n_modes, numbers);
    def.modes = n_modes > 0 ? &modes : NULL;
    if (shcd_model_create(&def, allocator, &model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    free(coefficients);
    free(numbers);
    return model;
}

static int make_seeds(void **state) {
    static const int degree[N_SEEDS] = {1, 1, 2, 3, 2};
    static const size_t n_cost_rows[N_SEEDS] = {0, 4, 0, 2, 0};
    static const size_t n_modes[N_SEEDS] = {0, 0, 0, 3, 9};
    (void)state;
    for (size_t i = 0; i < N_SEEDS; ++i) {
        shcd_model *model = make_body(degree[i], i > 0, n_cost_rows[i], n_modes[i], NULL);
        seeds[i].bytes = seed_bytes[i];
        seeds[i].size = shcd_model_write_size(model);
        seeds[i].capacity = CAPACITY;
        assert_int_equal(shcd_model_write(model, seeds[i].bytes, CAPACITY), SHCD_OK);
        shcd_model_free(model);
    }
    return 0;
}

/* ---- changes ---- */

static double any_double(check_random *r) {
    static const double special[] = {
        (double)NAN, (double)INFINITY, -(double)INFINITY, 0.0, -0.0, 1e300, -1e300, 1e-310, 1e10,
        -1e9};
    const size_t i = mutate_below(r, 2 * sizeof special / sizeof special[0]);
    return i < sizeof special / sizeof special[0] ? special[i] : check_normal(r) * 0.01;
}

static void put_double(check_random *r, unsigned char *p) {
    double value = any_double(r);
    uint64_t bits = 0;
    memcpy(&bits, &value, sizeof bits);
    if (mutate_below(r, 4) == 0) { /* a small change instead */
        bits = get_bits(p, 8);
        memcpy(&value, &bits, sizeof value);
        value *= check_uniform(r, 0.9, 1.1);
        memcpy(&bits, &value, sizeof bits);
    }
    put_bits(p, bits, 8);
}

static size_t any_chunk(check_random *r, const mutant *m) {
    size_t at = HEADER;
    for (size_t n = mutate_below(r, 4); n > 0 && next_chunk(m, at) != 0; --n) {
        at = next_chunk(m, at);
    }
    return next_chunk(m, at) != 0 ? at : HEADER;
}

static uint64_t any_length(check_random *r, uint64_t length) {
    static const uint64_t special[] = {0,          1,          7,          8,          56,
                                       104,        128,        UINT16_MAX, UINT32_MAX, UINT64_MAX,
                                       1ull << 63, 1ull << 31, 547208};
    const size_t i = mutate_below(r, 2 * sizeof special / sizeof special[0]);
    return i < sizeof special / sizeof special[0] ? special[i] : length + mutate_below(r, 17) - 8;
}

/* A change that keeps to the format: a field of a chunk's header, one more chunk, one fewer. */
static void change_chunk(check_random *r, mutant *m, size_t at) {
    static const char *const names[] = {"COEF", "FITR", "COST", "MODE", "XTRA", "\0\0\0\0"};
    const size_t end = next_chunk(m, at);
    unsigned char piece[CAPACITY];
    memcpy(piece, m->bytes + at, end - at);
    switch (mutate_below(r, 8)) {
    case 0:
        memcpy(m->bytes + at, names[mutate_below(r, 6)], 4);
        break;
    case 1:
        put_bits(m->bytes + at + 4 * (1 + mutate_below(r, 3)), check_random_bits(r) & 3u, 4);
        break;
    case 2:
        put_bits(m->bytes + at + CHUNK_LENGTH,
                 any_length(r, get_bits(m->bytes + at + CHUNK_LENGTH, 8)), 8);
        break;
    case 3:
        mutate_insert(m, end, piece, end - at);
        break;
    case 4:
        mutate_remove(m, at, end - at);
        break;
    case 5: /* unknown; required or not */
        memcpy(piece, "XTRA", 4);
        put_bits(piece + 8, check_random_bits(r) & 1u, 4);
        mutate_insert(m, mutate_below(r, 2) == 0 ? at : end, piece, end - at);
        break;
    default:
        put_bits(m->bytes + at + CHUNK_HEADER, any_length(r, get_bits(m->bytes + at + 24, 4)), 4);
        break;
    }
}

static void change(check_random *r, mutant *m) {
    static const char *const pieces[] = {
        "COEF", "FITR", "COST", "MODE", "XTRA", "\1", "\xff\xff\xff\xff"};
    static const mutate_tokens tokens = {pieces, sizeof pieces / sizeof pieces[0]};
    const size_t kind = mutate_below(r, 16), at = any_chunk(r, m), end = next_chunk(m, at);
    if (end == 0 || kind == 0) {
        mutate_once(r, m, &tokens);
    } else if (kind < 5) {
        change_chunk(r, m, at);
    } else if (kind < 7) {
        put_bits(m->bytes + mutate_below(r, HEADER - 8), check_random_bits(r), 1);
    } else if (end - at >= CHUNK_HEADER + COEFFICIENTS + 8 + 4) {
        const size_t n = (end - 4 - at - CHUNK_HEADER - COEFFICIENTS) / 8;
        put_double(r, m->bytes + at + CHUNK_HEADER + COEFFICIENTS + 8 * mutate_below(r, n));
    }
}

/* ---- what must hold ---- */

static void check_memory(const meter *m, shcd_status status, size_t size, const shcd_model *model) {
    if (status == SHCD_OK) {
        const size_t n_harmonics = SHCD_COUNT(shcd_model_degree(model));
        assert_true(24 * n_harmonics < size);
        assert_true(m->peak <= BYTES_CONSTANT + BYTES_PER_HARMONIC * n_harmonics);
    } else if (status == SHCD_ERR_GEOMETRY) {
        assert_true(m->peak <= BYTES_CONSTANT + BYTES_PER_HARMONIC * (size / 24));
    } else {
        assert_true(m->peak <= size);
        if (status != SHCD_ERR_NOT_FINITE) {
            assert_int_equal(m->peak, 0);
        }
    }
}

/* The model is what the file says, and it answers. */
static void check_model(const shcd_model *model) {
    const shcd_query_options options = {sizeof options, SHCD_TIER_FAST, 0, 0.0, 0, 0};
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    shcd_proximity answer;
    assert_int_equal(shcd_model_describe(model, &info), SHCD_OK);
    assert_true(info.diagonal_m >= 1e-9 && info.diagonal_m <= 1e9);
    assert_true(info.volume_m3 > 0.0 && isfinite(info.volume_m3));
    assert_true(info.radius_m > 0.0 && isfinite(info.radius_m));
    for (int i = 0; i < 2; ++i) {
        const shcd_vec3 point = {info.centre_m.x + (double)i * info.radius_m, info.centre_m.y,
                                 info.centre_m.z};
        assert_int_equal(shcd_closest(model, point, &options, &answer), SHCD_OK);
        assert_true(isfinite(answer.distance_m));
        assert_true(answer.lower_m <= answer.upper_m);
    }
}

/* What is written from it is read as the same, byte for byte. */
static void check_written(const shcd_model *model) {
    unsigned char bytes[CAPACITY], again[CAPACITY];
    const size_t size = shcd_model_write_size(model);
    shcd_model *copy = NULL;
    assert_in_range(size, 1, CAPACITY);
    assert_int_equal(shcd_model_write(model, bytes, sizeof bytes), SHCD_OK);
    assert_int_equal(shcd_model_read(bytes, size, NULL, &copy, NULL), SHCD_OK);
    assert_int_equal(shcd_model_write_size(copy), size);
    assert_int_equal(shcd_model_write(copy, again, sizeof again), SHCD_OK);
    assert_memory_equal(again, bytes, size);
    shcd_model_free(copy);
}

static shcd_status read_and_check(const unsigned char *bytes, size_t size, int thorough) {
    meter m = {0, 0};
    const shcd_allocator allocator = {meter_allocate, meter_release, &m};
    shcd_model *const untouched = (shcd_model *)(uintptr_t)16;
    shcd_model *model = untouched;
    shcd_error error = {SHCD_OK, ""};
    unsigned char *exact = malloc(size + (size == 0)); /* a byte too far is found by sanitizers */
    shcd_status status = SHCD_OK;
    assert_non_null(exact);
    memcpy(exact, bytes, size);
    status = shcd_model_read(exact, size, &allocator, &model, &error);
    free(exact);
    check_memory(&m, status, size, model);
    if (status == SHCD_OK) {
        check_model(model);
        if (thorough) {
            check_written(model);
        }
        shcd_model_free(model);
    } else {
        assert_ptr_equal(model, untouched);
        assert_int_equal(error.status, status);
        assert_true(strncmp(error.message, "model_read: ", 12) == 0 ||
                    strncmp(error.message, "model_create: ", 14) == 0);
    }
    assert_int_equal(m.now, 0);
    return status;
}

static shcd_status check_case(size_t number) {
    static unsigned char bytes[CAPACITY];
    check_random r = {0xc0ffee0000000000u + number};
    const mutant *from = &seeds[mutate_below(&r, N_SEEDS)];
    mutant m = {bytes, from->size, CAPACITY};
    memcpy(bytes, from->bytes, from->size);
    for (size_t n = 1 + mutate_below(&r, 3); n > 0; --n) {
        change(&r, &m);
    }
    repair(&m, mutate_below(&r, 8) != 0);
    return read_and_check(m.bytes, m.size, number % 16 == 0);
}

static void test_model_read_changed_files_are_refused_or_answer(void **state) {
    const size_t n = check_scaled(N_CASES);
    size_t counts[16] = {0};
    (void)state;
    for (size_t i = 0; i < n; ++i) {
        ++counts[-(int)check_case(i)];
    }
    print_message("%zu files: %zu read, %zu format, %zu not finite, %zu geometry, %zu unknown\n", n,
                  counts[0], counts[-SHCD_ERR_FORMAT], counts[-SHCD_ERR_NOT_FINITE],
                  counts[-SHCD_ERR_GEOMETRY], counts[-SHCD_ERR_UNSUPPORTED]);
    /* else the changes are too wild, or too tame, to test anything */
    for (size_t i = 0; n >= 400 && i < 16; ++i) {
        const int is_possible = i == 0 || i == -SHCD_ERR_FORMAT || i == -SHCD_ERR_NOT_FINITE ||
                                i == -SHCD_ERR_GEOMETRY || i == -SHCD_ERR_UNSUPPORTED;
        assert_int_equal(counts[i] > n / 200, is_possible);
    }
}

/* The seeds pass, so that a change alone is what refuses. */
static void test_model_read_unchanged_and_repaired_files_are_read(void **state) {
    (void)state;
    for (size_t i = 0; i < N_SEEDS; ++i) {
        unsigned char bytes[CAPACITY];
        mutant m = {bytes, seeds[i].size, CAPACITY};
        memcpy(bytes, seeds[i].bytes, seeds[i].size);
        repair(&m, 1);
        assert_memory_equal(bytes, seeds[i].bytes, seeds[i].size);
        assert_int_equal(read_and_check(bytes, m.size, 1), SHCD_OK);
    }
}

/* A degree that the payload does not pay for is refused before a byte is allocated. */
static void test_model_read_degree_is_bounded_by_the_payload(void **state) {
    unsigned char bytes[CAPACITY];
    mutant m = {bytes, seeds[2].size, CAPACITY};
    (void)state;
    memcpy(bytes, seeds[2].bytes, m.size);
    for (uint32_t degree = 0; degree <= 200; ++degree) {
        put_bits(bytes + HEADER + CHUNK_HEADER, degree < 200 ? degree : UINT32_MAX, 4);
        repair(&m, 1);
        assert_int_equal(read_and_check(bytes, m.size, 0), degree == 2 ? SHCD_OK : SHCD_ERR_FORMAT);
    }
}

/* The bound in terms of the degree, where files are larger than those above: the size of the tree
 * changes at 4, 9 and 41. */
static void test_model_create_memory_is_bounded_by_the_degree(void **state) {
    static const int degrees[] = {1, 4, 9, 17, 41};
    (void)state;
    for (size_t i = 0; i < sizeof degrees / sizeof degrees[0]; ++i) {
        meter m = {0, 0};
        const shcd_allocator allocator = {meter_allocate, meter_release, &m};
        const size_t n_harmonics = SHCD_COUNT(degrees[i]);
        shcd_model *model = make_body(degrees[i], 0, 0, 0, &allocator);
        print_message("degree %d: %zu bytes at most, %zu kept\n", degrees[i], m.peak, m.now);
        assert_true(m.peak <= BYTES_CONSTANT + BYTES_PER_HARMONIC * n_harmonics);
        shcd_model_free(model);
        assert_int_equal(m.now, 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_model_read_unchanged_and_repaired_files_are_read),
        cmocka_unit_test(test_model_read_degree_is_bounded_by_the_payload),
        cmocka_unit_test(test_model_create_memory_is_bounded_by_the_degree),
        cmocka_unit_test(test_model_read_changed_files_are_refused_or_answer),
    };
    return cmocka_run_group_tests(tests, make_seeds, NULL);
}
