/* SPDX-License-Identifier: BSD-3-Clause */
/* The cost table of a model. A table comes from a measurement or from a file, and scenes trust it:
 * what could mislead them (a negative time, a degree that the model does not have, an unknown tier)
 * is refused in both cases by the same check. */
#include "model/cost.h"

#include "model/bytes.h"
#include "model/model.h"
#include "shcd/map.h"

#define HEAD_SIZE (8u + SHCD_COST_MACHINE_SIZE)
#define N_INTEGERS 4u
#define N_BEFORE_BYTES 12u /* doubles from error_max_m to patch_ns */
#define N_RESERVED 5u

_Static_assert(sizeof(shcd_cost_row) == SHCDI_COST_ROW_SIZE &&
                   offsetof(shcd_cost_row, error_max_m) == 4 * N_INTEGERS &&
                   offsetof(shcd_cost_row, bytes) == 4 * N_INTEGERS + 8 * N_BEFORE_BYTES &&
                   SHCDI_COST_ROW_SIZE == 4 * N_INTEGERS + 8 * (N_BEFORE_BYTES + 1 + N_RESERVED),
               "a row is written field by field");

/* ---- checks ---- */

static double number_of(const shcd_cost_row *row, size_t i) {
    double value;
    const size_t at = i < N_BEFORE_BYTES
                          ? offsetof(shcd_cost_row, error_max_m) + 8 * i
                          : offsetof(shcd_cost_row, reserved) + 8 * (i - N_BEFORE_BYTES);
    memcpy(&value, (const char *)row + at, sizeof value);
    return value;
}

shcd_status shcdi_cost_check_row(const char *where, shcd_status wrong, int degree,
                                 const shcd_cost_row *row, size_t i, shcd_error *error) {
    if (row->degree < 1 || row->degree > degree) {
        return shcdi_fail(error, wrong, "%s: cost row %zu: degree %d is not in 1 .. %d", where, i,
                          (int)row->degree, degree);
    }
    if (row->tier < SHCD_TIER_EXACT || row->tier > SHCD_TIER_TRACK) {
        return shcdi_fail(error, wrong, "%s: cost row %zu: unknown tier %d", where, i,
                          (int)row->tier);
    }
    const int is_map = row->tier == SHCD_TIER_MAP;
    if (row->map_resolution < (is_map ? 2 : 0) ||
        row->map_resolution > (is_map ? SHCD_MAP_RESOLUTION_MAX : 0) ||
        row->interpolation < SHCD_MAP_LINEAR ||
        row->interpolation > (is_map ? SHCD_MAP_HERMITE : SHCD_MAP_LINEAR)) {
        return shcdi_fail(
            error, wrong,
            "%s: cost row %zu: map resolution %d, interpolation %d do not fit its tier", where, i,
            (int)row->map_resolution, (int)row->interpolation);
    }
    for (size_t k = 0; k < N_BEFORE_BYTES + N_RESERVED; k++) {
        if (!shcdi_is_finite(number_of(row, k))) {
            return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                              "%s: cost row %zu: value %zu is not finite", where, i, k);
        }
        if (k < N_BEFORE_BYTES && number_of(row, k) < 0.0) {
            return shcdi_fail(error, wrong, "%s: cost row %zu: value %zu is negative", where, i, k);
        }
    }
    return SHCD_OK;
}

shcd_status shcdi_cost_check_machine(const char *where, shcd_status wrong, const char *machine,
                                     shcd_error *error) {
    for (size_t i = 0; machine != NULL && machine[i] != '\0'; i++) {
        if (i == SHCD_COST_MACHINE_SIZE - 1 || machine[i] < 0x20 || machine[i] > 0x7e) {
            return shcdi_fail(error, wrong,
                              "%s: the name of the cost table's machine is too long or not "
                              "printable ASCII at byte %zu",
                              where, i);
        }
    }
    return SHCD_OK;
}

shcd_status shcdi_cost_check(const char *where, shcd_status wrong, int degree,
                             const shcd_cost_row *rows, size_t n, const char *machine,
                             shcd_error *error) {
    if (n > SHCD_COST_ROWS_MAX || (n > 0 && rows == NULL)) {
        return shcdi_fail(error, wrong, "%s: %zu cost rows, not 0 .. %d, or none given", where, n,
                          SHCD_COST_ROWS_MAX);
    }
    shcd_status status = shcdi_cost_check_machine(where, wrong, machine, error);
    for (size_t i = 0; status == SHCD_OK && i < n; i++) {
        status = shcdi_cost_check_row(where, wrong, degree, &rows[i], i, error);
    }
    return status;
}

shcd_status shcdi_cost_copy(const shcd_cost_row *rows, size_t n, const char *machine,
                            const shcd_allocator *allocator, shcdi_cost *cost) {
    if (n == 0) {
        return SHCD_OK;
    }
    cost->rows = allocator->allocate(n * sizeof *rows, allocator->user);
    if (cost->rows == NULL) {
        return SHCD_ERR_MEMORY;
    }
    memcpy(cost->rows, rows, n * sizeof *rows);
    cost->n = n;
    if (machine != NULL) { /* shorter than the room, and the room is zero */
        memcpy(cost->machine, machine, strlen(machine));
    }
    return SHCD_OK;
}

const shcd_cost_row *shcd_model_cost_rows(const shcd_model *model, size_t *n) {
    if (n != NULL) {
        *n = model != NULL ? model->cost.n : 0;
    }
    return model != NULL ? model->cost.rows : NULL;
}

const char *shcd_model_cost_machine(const shcd_model *model) {
    return model != NULL ? model->cost.machine : "";
}

/* ---- bytes: rows u32, row size u32, machine, rows ---- */

size_t shcdi_cost_payload_size(size_t n_rows) {
    return HEAD_SIZE + n_rows * SHCDI_COST_ROW_SIZE;
}

static void write_row(const shcd_cost_row *row, unsigned char *p) {
    const int32_t integers[N_INTEGERS] = {row->degree, row->tier, row->map_resolution,
                                          row->interpolation};
    for (size_t i = 0; i < N_INTEGERS; i++, p += 4) {
        shcdi_put_u32(p, (uint32_t)integers[i]);
    }
    for (size_t i = 0; i < N_BEFORE_BYTES; i++, p += 8) {
        shcdi_put_double(p, number_of(row, i));
    }
    shcdi_put_u64(p, row->bytes);
    p += 8;
    for (size_t i = 0; i < N_RESERVED; i++, p += 8) {
        shcdi_put_double(p, row->reserved[i]);
    }
}

void shcdi_cost_write(const shcdi_cost *cost, unsigned char *payload) {
    shcdi_put_u32(payload, (uint32_t)cost->n);
    shcdi_put_u32(payload + 4, SHCDI_COST_ROW_SIZE);
    memcpy(payload + 8, cost->machine, sizeof cost->machine);
    for (size_t i = 0; i < cost->n; i++) {
        write_row(&cost->rows[i], payload + HEAD_SIZE + i * SHCDI_COST_ROW_SIZE);
    }
}

size_t shcdi_cost_payload_rows(const unsigned char *payload, uint64_t length) {
    const uint32_t n = length >= HEAD_SIZE ? shcdi_get_u32(payload) : 0;
    const int fits = n > 0 && n <= SHCD_COST_ROWS_MAX &&
                     shcdi_get_u32(payload + 4) == SHCDI_COST_ROW_SIZE &&
                     length == shcdi_cost_payload_size(n);
    return fits ? n : 0;
}

/* Two's complement, without a cast of what does not fit. */
static int32_t get_i32(const unsigned char *p) {
    const uint32_t bits = shcdi_get_u32(p);
    int32_t value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

void shcdi_cost_read_row(const unsigned char *payload, size_t i, shcd_cost_row *row) {
    const unsigned char *p = payload + HEAD_SIZE + i * SHCDI_COST_ROW_SIZE;
    int32_t integers[N_INTEGERS];
    double numbers[N_BEFORE_BYTES];
    for (size_t k = 0; k < N_INTEGERS; k++, p += 4) {
        integers[k] = get_i32(p);
    }
    for (size_t k = 0; k < N_BEFORE_BYTES; k++, p += 8) {
        numbers[k] = shcdi_get_double(p);
    }
    memcpy(row, integers, sizeof integers);
    memcpy((char *)row + sizeof integers, numbers, sizeof numbers);
    row->bytes = shcdi_get_u64(p);
    p += 8;
    for (size_t k = 0; k < N_RESERVED; k++, p += 8) {
        row->reserved[k] = shcdi_get_double(p);
    }
}

void shcdi_cost_read_machine(const unsigned char *payload, char machine[SHCD_COST_MACHINE_SIZE]) {
    memcpy(machine, payload + 8, SHCD_COST_MACHINE_SIZE);
    machine[SHCD_COST_MACHINE_SIZE - 1] = '\0';
}
