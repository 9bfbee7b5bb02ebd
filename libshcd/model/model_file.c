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
 *   MODE, optional: mode count u32, degree u32, is_anchored u32, reserved u32, area, volume,
 *                   eigenvalue error, then the eigenvalues, then the modes' coefficients, all
 *                   doubles in SI units and in the order of shcd_modes
 *   LEAR, optional: counts of centres, terms, modes and the source u32; n_samples, n_holdout u64;
 * the other scalars of shcd_learned, then of its record, then centres, weights and dents, all
 * doubles in SI units
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

/* ---- writing: what a model has none of takes no payload ---- */

static size_t coefficient_payload(int degree) {
    return 8 + 24 * SHCD_COUNT(degree);
}
static size_t chunk_size(size_t payload) {
    return CHUNK_HEADER + payload + 4;
}

static size_t coefficient_size(const shcd_model *model) {
    return coefficient_payload(model->degree);
}

static void write_coefficients(const shcd_model *model, unsigned char *payload) {
    shcdi_put_u32(payload, (uint32_t)model->degree);
    shcdi_put_u32(payload + 4, 0);
    for (size_t i = 0; i < 3 * SHCD_COUNT(model->degree); i++) {
        shcdi_put_double(payload + 8 + 8 * i, model->coefficients[i]);
    }
}

static size_t fit_size(const shcd_model *model) {
    return model->info.fit.n_triangles != 0 ? FIT_SIZE : 0;
}

static void write_fit(const shcd_model *model, unsigned char *payload) {
    const shcd_fit_record *fit = &model->info.fit;
    double values[FIT_DOUBLES];
    memcpy(values, (const char *)fit + 16, sizeof values);
    shcdi_put_u64(payload, fit->n_triangles);
    shcdi_put_u64(payload + 8, fit->n_vertices);
    for (size_t i = 0; i < FIT_DOUBLES; i++) {
        shcdi_put_double(payload + 16 + 8 * i, values[i]);
    }
}

static size_t cost_size(const shcd_model *model) {
    return model->cost.n != 0 ? shcdi_cost_payload_size(model->cost.n) : 0;
}

static void write_cost(const shcd_model *model, unsigned char *payload) {
    shcdi_cost_write(&model->cost, payload);
}

static size_t modes_size(const shcd_model *model) {
    const size_t n = model->modes.view.n_modes;
    return n != 0 ? shcdi_modes_payload_size(n, model->degree) : 0;
}

static void write_modes(const shcd_model *model, unsigned char *payload) {
    shcdi_modes_write(&model->modes, model->degree, payload);
}

static size_t learned_size(const shcd_model *model) {
    const shcd_learned *learned = &model->learned.view;
    return learned->n_centres != 0 ? shcdi_learned_payload_size(learned) : 0;
}

static void write_learned(const shcd_model *model, unsigned char *payload) {
    shcdi_learned_write(&model->learned, payload);
}

/* ---- reading ---- */

/* Payloads are noted when their chunk is met, and looked at again when the degree is known,
 * whichever chunk comes first. */
typedef struct noted {
    const unsigned char *payload; /* NULL: none */
    size_t at;                    /* where its chunk starts */
    size_t n;                     /* rows, modes or numbers that it says it holds */
} noted;

typedef struct parsed {
    int degree; /* 0: none yet */
    const unsigned char *coefficients;
    int has_fit;
    shcd_fit_record fit;
    noted cost, modes, learned;
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

/* Notes a payload that holds n things; n 0: none that fits. */
static shcd_status note(noted *out, const char *name, const unsigned char *payload, uint64_t length,
                        size_t at, size_t n, shcd_error *error) {
    if (out->payload != NULL || n == 0) {
        return shcdi_fail(
            error, SHCD_ERR_FORMAT,
            "model_read: chunk %s is a second one, or its %llu bytes do not fit the numbers at its "
            "start, byte %zu",
            name, (unsigned long long)length, at);
    }
    *out = (noted){payload, at, n};
    return SHCD_OK;
}

#define WHERE_SIZE 64
static const char *where_of(const noted *chunk, const char *name, char *where) {
    (void)snprintf(where, WHERE_SIZE, "model_read: chunk %s at byte %zu", name, chunk->at);
    return where;
}

static shcd_status read_cost(const unsigned char *payload, uint64_t length, size_t at, parsed *out,
                             shcd_error *error) {
    return note(&out->cost, "COST", payload, length, at, shcdi_cost_payload_rows(payload, length),
                error);
}

static shcd_status check_cost(const parsed *in, shcd_error *error) {
    char machine[SHCD_COST_MACHINE_SIZE], room[WHERE_SIZE];
    if (in->cost.payload == NULL) {
        return SHCD_OK;
    }
    const char *where = where_of(&in->cost, "COST", room);
    shcdi_cost_read_machine(in->cost.payload, machine);
    shcd_status status = shcdi_cost_check_machine(where, SHCD_ERR_FORMAT, machine, error);
    for (size_t i = 0; status == SHCD_OK && i < in->cost.n; i++) {
        shcd_cost_row row;
        shcdi_cost_read_row(in->cost.payload, i, &row);
        status = shcdi_cost_check_row(where, SHCD_ERR_FORMAT, in->degree, &row, i, error);
    }
    return status;
}

static shcd_status read_modes(const unsigned char *payload, uint64_t length, size_t at, parsed *out,
                              shcd_error *error) {
    return note(&out->modes, "MODE", payload, length, at,
                shcdi_modes_payload_count(payload, length), error);
}

static shcd_status check_modes(const parsed *in, shcd_error *error) {
    char room[WHERE_SIZE];
    return in->modes.payload == NULL
               ? SHCD_OK
               : shcdi_modes_check_payload(where_of(&in->modes, "MODE", room), in->degree,
                                           in->modes.payload, error);
}

static shcd_status read_learned(const unsigned char *payload, uint64_t length, size_t at,
                                parsed *out, shcd_error *error) {
    return note(&out->learned, "LEAR", payload, length, at,
                shcdi_learned_payload_count(payload, length), error);
}

/* ---- the kinds of chunks, in the order in which they are written ---- */

typedef struct chunk_kind {
    char name[5];
    uint32_t flags;
    void (*write)(const shcd_model *model, unsigned char *payload);
    shcd_status (*read)(const unsigned char *payload, uint64_t length, size_t at, parsed *out,
                        shcd_error *error);
    shcd_status (*check)(const parsed *in, shcd_error *error); /* NULL: read() says it all */
} chunk_kind;

static const chunk_kind KINDS[] = {
    {"COEF", CHUNK_REQUIRED, write_coefficients, read_coefficients, NULL},
    {"FITR", 0, write_fit, read_fit, NULL},
    {"COST", 0, write_cost, read_cost, check_cost},
    {"MODE", 0, write_modes, read_modes, check_modes},
    {"LEAR", 0, write_learned, read_learned, NULL}, /* checked by make() */
};
#define N_KINDS (sizeof KINDS / sizeof KINDS[0])

/* Sizes of their payloads, 0: the model has none. Apart from the rest, so that what a real-time
 * function can call stays visible. */
static size_t (*const SIZES[])(const shcd_model *model) = {coefficient_size, fit_size, cost_size,
                                                           modes_size, learned_size};

_Static_assert(sizeof SIZES / sizeof SIZES[0] == N_KINDS, "each kind has its size");

size_t shcd_model_write_size(const shcd_model *model) {
    if (model == NULL) {
        return 0;
    }
    size_t size = HEADER_SIZE;
    for (size_t k = 0; k < N_KINDS; k++) {
        const size_t payload = SIZES[k](model);
        size += payload > 0 ? chunk_size(payload) : 0;
    }
    return size;
}

static unsigned char *write_chunk(const chunk_kind *kind, const shcd_model *model, size_t payload,
                                  unsigned char *p) {
    const size_t n = CHUNK_HEADER + payload;
    memcpy(p, kind->name, 4);
    shcdi_put_u32(p + 4, 1);
    shcdi_put_u32(p + 8, kind->flags);
    shcdi_put_u32(p + 12, 0);
    shcdi_put_u64(p + 16, payload);
    kind->write(model, p + CHUNK_HEADER);
    shcdi_put_u32(p + n, (uint32_t)crc32_z(0, p, n));
    return p + n + 4;
}

shcd_status shcd_model_write(const shcd_model *model, void *bytes, size_t capacity) {
    if (model == NULL || bytes == NULL || capacity < shcd_model_write_size(model)) {
        return SHCD_ERR_ARGUMENT;
    }
    unsigned char *const head = bytes;
    unsigned char *p = head + HEADER_SIZE;
    uint32_t n_chunks = 0;
    for (size_t k = 0; k < N_KINDS; k++) {
        const size_t payload = SIZES[k](model);
        if (payload > 0) {
            p = write_chunk(&KINDS[k], model, payload, p);
            n_chunks++;
        }
    }
    memcpy(head, MAGIC, sizeof MAGIC);
    shcdi_put_u32(head + 8, FORMAT_VERSION);
    shcdi_put_u32(head + 12, 0);
    shcdi_put_u64(head + 16, (uint64_t)(p - head));
    shcdi_put_u32(head + 24, n_chunks);
    shcdi_put_u32(head + 28, (uint32_t)crc32(0, head, 28));
    return SHCD_OK;
}

/* ---- reading, continued ---- */

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
    size_t k = shcdi_get_u32(p + 4) == 1 && shcdi_get_u32(p + 12) == 0 ? 0 : N_KINDS;
    while (k < N_KINDS && memcmp(p, KINDS[k].name, 4) != 0) {
        k++;
    }
    shcd_status status = SHCD_OK;
    if (k < N_KINDS) {
        status = KINDS[k].read(p + CHUNK_HEADER, length, *at, out, error);
    } else if ((shcdi_get_u32(p + 8) & CHUNK_REQUIRED) != 0) {
        status = shcdi_fail(error, SHCD_ERR_UNSUPPORTED,
                            "model_read: required chunk 0x%08x version %u at byte %zu is unknown",
                            shcdi_get_u32(p), shcdi_get_u32(p + 4), *at);
    }
    *at += n + 4;
    return status;
}

/* The numbers of all chunks in one piece of memory for as long as the model is made. */
static shcd_status make(const parsed *in, const shcd_allocator *allocator, shcd_model **model,
                        shcd_error *error) {
    const shcd_allocator memory = shcdi_allocator(allocator);
    const size_t n = 3 * SHCD_COUNT(in->degree), n_rows = in->cost.n;
    const size_t n_modes = shcdi_modes_count(in->modes.n, in->degree);
    const size_t n_numbers = n + n_modes + in->learned.n;
    const size_t size = n_numbers * sizeof(double) + n_rows * sizeof(shcd_cost_row);
    double *coefficients = memory.allocate(size, memory.user);
    char machine[SHCD_COST_MACHINE_SIZE] = "", room[WHERE_SIZE];
    shcd_modes modes;
    shcd_learned learned;
    shcd_status status = SHCD_OK;
    if (coefficients == NULL) {
        return shcdi_fail(error, SHCD_ERR_MEMORY, "model_read: out of memory");
    }
    for (size_t i = 0; i < n; i++) {
        coefficients[i] = shcdi_get_double(in->coefficients + 8 * i);
    }
    shcd_cost_row *rows = (shcd_cost_row *)(void *)(coefficients + n_numbers);
    for (size_t i = 0; i < n_rows; i++) {
        shcdi_cost_read_row(in->cost.payload, i, &rows[i]);
    }
    if (n_rows > 0) {
        shcdi_cost_read_machine(in->cost.payload, machine);
    }
    if (n_modes > 0) {
        shcdi_modes_read(in->modes.payload, coefficients + n, &modes);
    }
    if (in->learned.n > 0) {
        shcdi_learned_read(in->learned.payload, coefficients + n + n_modes, &learned);
        status = shcdi_learned_check(where_of(&in->learned, "LEAR", room), SHCD_ERR_FORMAT,
                                     in->modes.n, &learned, error);
    }
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    def.degree = in->degree;
    def.coefficients = coefficients;
    def.fit = in->has_fit ? &in->fit : NULL;
    def.cost_rows = n_rows > 0 ? rows : NULL;
    def.n_cost_rows = n_rows;
    def.cost_machine = machine;
    def.modes = n_modes > 0 ? &modes : NULL;
    def.learned = in->learned.n > 0 ? &learned : NULL;
    status = status == SHCD_OK ? shcd_model_create(&def, allocator, model, error) : status;
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
    for (size_t k = 0; k < N_KINDS && status == SHCD_OK; k++) {
        status = KINDS[k].check != NULL ? KINDS[k].check(&found, error) : SHCD_OK;
    }
    return status == SHCD_OK ? make(&found, allocator, model, error) : status;
}
