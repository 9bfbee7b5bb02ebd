/* SPDX-License-Identifier: BSD-3-Clause */
/* The .shcd format, version 1; little-endian throughout.
 *
 *   header, 32 bytes: magic (8), version u32, flags u32 (0), total length u64, chunk count u32,
 *                     CRC-32 u32 of the 28 bytes before it
 *   chunk:            name (4), version u32, flags u32 (bit 0: required), reserved u32 (0),
 *                     payload length u64, payload, CRC-32 u32 of everything before it in the chunk
 *
 *   COEF, required: degree u32, reserved u32, 3 (degree+1)^2 doubles in the public order [m]
 *   FITR, optional: n_triangles u64, n_vertices u64, then the doubles of shcd_fit_record in order
 *   COST, optional: row count u32, row size u32 (160), machine (96 bytes, zero-ended ASCII), rows:
 *                   the members of shcd_cost_row in order
 *
 * Bounds, tree and map are derived anew when a file is read: a file cannot lie about them. Unknown
 * optional chunks are skipped, unknown required ones refused.
 */
#include "model/bytes.h"
#include "model/model.h"

#include <stdio.h>
#include <zlib.h>

#define HEADER_SIZE 32u
#define CHUNK_HEADER 24u
#define CHUNK_REQUIRED 1u
#define FORMAT_VERSION 1u
#define CHUNKS_MAX 256u
#define FIT_DOUBLES 14u
#define FIT_SIZE (16u + 8u * FIT_DOUBLES)

_Static_assert(sizeof(shcd_fit_record) == FIT_SIZE, "FITR holds the record field by field");

static const unsigned char MAGIC[8] = {0x89, 'S', 'H', 'C', 'D', '\r', '\n', 0x1a};

/* ---- writing ---- */

static size_t coefficient_payload(int degree) {
    return 8 + 24 * SHCD_COUNT(degree);
}
static size_t chunk_size(size_t payload) {
    return CHUNK_HEADER + payload + 4;
}
static int has_fit(const shcd_model *model) {
    return model->info.fit.n_triangles != 0;
}
static int has_cost(const shcd_model *model) {
    return model->cost.n != 0;
}

size_t shcd_model_write_size(const shcd_model *model) {
    if (model == NULL) {
        return 0;
    }
    return HEADER_SIZE + chunk_size(coefficient_payload(model->degree)) +
           (has_fit(model) ? chunk_size(FIT_SIZE) : 0) +
           (has_cost(model) ? chunk_size(shcdi_cost_payload_size(model->cost.n)) : 0);
}

static unsigned char *begin_chunk(unsigned char *p, const char *name, uint32_t flags,
                                  size_t payload) {
    memcpy(p, name, 4);
    shcdi_put_u32(p + 4, 1);
    shcdi_put_u32(p + 8, flags);
    shcdi_put_u32(p + 12, 0);
    shcdi_put_u64(p + 16, payload);
    return p + CHUNK_HEADER;
}

static unsigned char *end_chunk(unsigned char *start, size_t payload) {
    const size_t n = CHUNK_HEADER + payload;
    shcdi_put_u32(start + n, (uint32_t)crc32(0, start, (uInt)n));
    return start + n + 4;
}

shcd_status shcd_model_write(const shcd_model *model, void *bytes, size_t capacity) {
    if (model == NULL || bytes == NULL || capacity < shcd_model_write_size(model)) {
        return SHCD_ERR_ARGUMENT;
    }
    unsigned char *p = bytes;
    memcpy(p, MAGIC, sizeof MAGIC);
    shcdi_put_u32(p + 8, FORMAT_VERSION);
    shcdi_put_u32(p + 12, 0);
    shcdi_put_u64(p + 16, shcd_model_write_size(model));
    shcdi_put_u32(p + 24, 1u + (has_fit(model) ? 1u : 0u) + (has_cost(model) ? 1u : 0u));
    shcdi_put_u32(p + 28, (uint32_t)crc32(0, p, 28));
    p += HEADER_SIZE;

    const size_t payload = coefficient_payload(model->degree);
    unsigned char *q = begin_chunk(p, "COEF", CHUNK_REQUIRED, payload);
    shcdi_put_u32(q, (uint32_t)model->degree);
    shcdi_put_u32(q + 4, 0);
    for (size_t i = 0; i < 3 * SHCD_COUNT(model->degree); i++) {
        shcdi_put_double(q + 8 + 8 * i, model->coefficients[i]);
    }
    p = end_chunk(p, payload);
    if (has_fit(model)) {
        const shcd_fit_record *fit = &model->info.fit;
        q = begin_chunk(p, "FITR", 0, FIT_SIZE);
        double values[FIT_DOUBLES];
        memcpy(values, (const char *)fit + 16, sizeof values);
        shcdi_put_u64(q, fit->n_triangles);
        shcdi_put_u64(q + 8, fit->n_vertices);
        for (size_t i = 0; i < FIT_DOUBLES; i++) {
            shcdi_put_double(q + 16 + 8 * i, values[i]);
        }
        p = end_chunk(p, FIT_SIZE);
    }
    if (has_cost(model)) {
        const size_t size = shcdi_cost_payload_size(model->cost.n);
        shcdi_cost_write(&model->cost, begin_chunk(p, "COST", 0, size));
        end_chunk(p, size);
    }
    return SHCD_OK;
}

/* ---- reading ---- */

typedef struct parsed {
    int degree; /* 0: none yet */
    const unsigned char *coefficients;
    int has_fit;
    shcd_fit_record fit;
    const unsigned char *cost; /* payload; NULL: none */
    size_t cost_at;            /* where its chunk starts */
    size_t n_cost_rows;
} parsed;

static shcd_status read_header(const unsigned char *p, size_t size, uint32_t *n_chunks,
                               shcd_error *error) {
    if (size < HEADER_SIZE) {
        return shcdi_fail(error, SHCD_ERR_FORMAT,
                          "model_read: %zu bytes are too few for a header of %u", size,
                          HEADER_SIZE);
    }
    if (memcmp(p, MAGIC, sizeof MAGIC) != 0) {
        return shcdi_fail(error, SHCD_ERR_FORMAT, "model_read: not a .shcd file (magic, byte 0)");
    }
    if (shcdi_get_u32(p + 28) != (uint32_t)crc32(0, p, 28)) {
        return shcdi_fail(error, SHCD_ERR_FORMAT, "model_read: header CRC differs, byte 28");
    }
    if (shcdi_get_u32(p + 8) != FORMAT_VERSION || shcdi_get_u32(p + 12) != 0) {
        return shcdi_fail(error, SHCD_ERR_UNSUPPORTED,
                          "model_read: format version %u, flags %u; this library reads version %u",
                          shcdi_get_u32(p + 8), shcdi_get_u32(p + 12), FORMAT_VERSION);
    }
    if (shcdi_get_u64(p + 16) != size) {
        return shcdi_fail(error, SHCD_ERR_FORMAT,
                          "model_read: the header says %llu bytes, there are %zu",
                          (unsigned long long)shcdi_get_u64(p + 16), size);
    }
    *n_chunks = shcdi_get_u32(p + 24);
    if (*n_chunks == 0 || *n_chunks > CHUNKS_MAX) {
        return shcdi_fail(error, SHCD_ERR_FORMAT, "model_read: %u chunks, not 1 .. %u, byte 24",
                          *n_chunks, CHUNKS_MAX);
    }
    return SHCD_OK;
}

static shcd_status read_coefficients(const unsigned char *payload, uint64_t length, size_t at,
                                     parsed *out, shcd_error *error) {
    if (out->degree != 0) {
        return shcdi_fail(error, SHCD_ERR_FORMAT, "model_read: second chunk COEF, byte %zu", at);
    }
    const uint32_t degree = length >= 8 ? shcdi_get_u32(payload) : 0;
    if (degree < 1 || degree > SHCD_DEGREE_MAX || shcdi_get_u32(payload + 4) != 0 ||
        length != coefficient_payload((int)degree)) {
        return shcdi_fail(error, SHCD_ERR_FORMAT,
                          "model_read: chunk COEF of %llu bytes does not fit degree %u, byte %zu",
                          (unsigned long long)length, degree, at);
    }
    out->degree = (int)degree;
    out->coefficients = payload + 8;
    return SHCD_OK;
}

static shcd_status read_fit(const unsigned char *payload, uint64_t length, size_t at, parsed *out,
                            shcd_error *error) {
    if (out->has_fit || length != FIT_SIZE) {
        return shcdi_fail(error, SHCD_ERR_FORMAT,
                          "model_read: chunk FITR is a second one or not %u bytes, byte %zu",
                          FIT_SIZE, at);
    }
    double values[FIT_DOUBLES];
    for (size_t i = 0; i < FIT_DOUBLES; i++) {
        values[i] = shcdi_get_double(payload + 16 + 8 * i);
        if (!shcdi_is_finite(values[i])) {
            return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                              "model_read: value %zu of chunk FITR is not finite, byte %zu", i,
                              at + CHUNK_HEADER + 16 + 8 * i);
        }
    }
    out->fit.n_triangles = shcdi_get_u64(payload);
    out->fit.n_vertices = shcdi_get_u64(payload + 8);
    memcpy((char *)&out->fit + 16, values, sizeof values);
    out->has_fit = out->fit.n_triangles != 0;
    return SHCD_OK;
}

/* The rows are checked when the degree is known, whichever chunk comes first. */
static shcd_status read_cost(const unsigned char *payload, uint64_t length, size_t at, parsed *out,
                             shcd_error *error) {
    const size_t n = shcdi_cost_payload_rows(payload, length);
    if (out->cost != NULL || n == 0) {
        return shcdi_fail(
            error, SHCD_ERR_FORMAT,
            "model_read: chunk COST is a second one, or its %llu bytes do not fit its "
            "number of rows, byte %zu",
            (unsigned long long)length, at);
    }
    out->cost = payload;
    out->cost_at = at;
    out->n_cost_rows = n;
    return SHCD_OK;
}

static shcd_status check_cost(const parsed *in, shcd_error *error) {
    char machine[SHCD_COST_MACHINE_SIZE], where[64];
    (void)snprintf(where, sizeof where, "model_read: chunk COST at byte %zu", in->cost_at);
    shcdi_cost_read_machine(in->cost, machine);
    shcd_status status = shcdi_cost_check_machine(where, SHCD_ERR_FORMAT, machine, error);
    for (size_t i = 0; status == SHCD_OK && i < in->n_cost_rows; i++) {
        shcd_cost_row row;
        shcdi_cost_read_row(in->cost, i, &row);
        status = shcdi_cost_check_row(where, SHCD_ERR_FORMAT, in->degree, &row, i, error);
    }
    return status;
}

/* Checks the chunk at byte `at` and advances `at` past it. */
static shcd_status read_chunk(const unsigned char *bytes, size_t size, size_t *at, parsed *out,
                              shcd_error *error) {
    const size_t left = size - *at;
    const unsigned char *p = bytes + *at;
    if (left < chunk_size(0)) {
        return shcdi_fail(error, SHCD_ERR_FORMAT, "model_read: chunk cut off at byte %zu", *at);
    }
    const uint64_t length = shcdi_get_u64(p + 16);
    if (length > left - chunk_size(0)) {
        return shcdi_fail(error, SHCD_ERR_FORMAT,
                          "model_read: chunk at byte %zu says %llu bytes, %zu are left", *at,
                          (unsigned long long)length, left - chunk_size(0));
    }
    const size_t n = CHUNK_HEADER + (size_t)length;
    if (shcdi_get_u32(p + n) != (uint32_t)crc32_z(0, p, n)) {
        return shcdi_fail(error, SHCD_ERR_FORMAT,
                          "model_read: CRC of the chunk at byte %zu differs", *at);
    }
    const int known_version = shcdi_get_u32(p + 4) == 1 && shcdi_get_u32(p + 12) == 0;
    shcd_status status = SHCD_OK;
    if (known_version && memcmp(p, "COEF", 4) == 0) {
        status = read_coefficients(p + CHUNK_HEADER, length, *at, out, error);
    } else if (known_version && memcmp(p, "FITR", 4) == 0) {
        status = read_fit(p + CHUNK_HEADER, length, *at, out, error);
    } else if (known_version && memcmp(p, "COST", 4) == 0) {
        status = read_cost(p + CHUNK_HEADER, length, *at, out, error);
    } else if ((shcdi_get_u32(p + 8) & CHUNK_REQUIRED) != 0) {
        status = shcdi_fail(error, SHCD_ERR_UNSUPPORTED,
                            "model_read: required chunk 0x%08x version %u at byte %zu is unknown",
                            shcdi_get_u32(p), shcdi_get_u32(p + 4), *at);
    }
    *at += n + 4;
    return status;
}

static shcd_status make(const parsed *in, const shcd_allocator *allocator, shcd_model **model,
                        shcd_error *error) {
    const shcd_allocator memory = shcdi_allocator(allocator);
    const size_t n = 3 * SHCD_COUNT(in->degree), n_rows = in->n_cost_rows;
    const size_t size = n * sizeof(double) + n_rows * sizeof(shcd_cost_row);
    double *coefficients = memory.allocate(size, memory.user);
    char machine[SHCD_COST_MACHINE_SIZE] = "";
    if (coefficients == NULL) {
        return shcdi_fail(error, SHCD_ERR_MEMORY, "model_read: out of memory");
    }
    for (size_t i = 0; i < n; i++) {
        coefficients[i] = shcdi_get_double(in->coefficients + 8 * i);
    }
    shcd_cost_row *rows = (shcd_cost_row *)(void *)(coefficients + n);
    for (size_t i = 0; i < n_rows; i++) {
        shcdi_cost_read_row(in->cost, i, &rows[i]);
    }
    if (n_rows > 0) {
        shcdi_cost_read_machine(in->cost, machine);
    }
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    def.degree = in->degree;
    def.coefficients = coefficients;
    def.fit = in->has_fit ? &in->fit : NULL;
    def.cost_rows = n_rows > 0 ? rows : NULL;
    def.n_cost_rows = n_rows;
    def.cost_machine = machine;
    const shcd_status status = shcd_model_create(&def, allocator, model, error);
    memory.release(coefficients, memory.user);
    return status;
}

shcd_status shcd_model_read(const void *bytes, size_t size, const shcd_allocator *allocator,
                            shcd_model **model, shcd_error *error) {
    if (bytes == NULL || model == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "model_read: no bytes, or no place for the model");
    }
    uint32_t n_chunks = 0;
    shcd_status status = read_header(bytes, size, &n_chunks, error);
    parsed found;
    memset(&found, 0, sizeof found);
    size_t at = HEADER_SIZE;
    for (uint32_t i = 0; i < n_chunks && status == SHCD_OK; i++) {
        status = read_chunk(bytes, size, &at, &found, error);
    }
    if (status != SHCD_OK) {
        return status;
    }
    if (at != size) {
        return shcdi_fail(error, SHCD_ERR_FORMAT,
                          "model_read: %zu bytes after the last chunk, byte %zu", size - at, at);
    }
    if (found.degree == 0) {
        return shcdi_fail(error, SHCD_ERR_FORMAT, "model_read: no chunk COEF");
    }
    status = found.cost != NULL ? check_cost(&found, error) : SHCD_OK;
    if (status != SHCD_OK) {
        return status;
    }
    return make(&found, allocator, model, error);
}
