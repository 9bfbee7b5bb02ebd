/* SPDX-License-Identifier: BSD-3-Clause */
/* The cost table that a model carries: checked, copied, and as bytes of a file. */
#ifndef SHCDI_MODEL_COST_H
#define SHCDI_MODEL_COST_H

#include "base/internal.h"
#include "shcd/model.h"

typedef struct shcdi_cost {
    shcd_cost_row *rows; /**< NULL: none */
    size_t n;
    char machine[SHCD_COST_MACHINE_SIZE];
} shcdi_cost;

/** A row as bytes of a file. */
#define SHCDI_COST_ROW_SIZE 160u

/** Whether a row may be stored. Messages start with `where`; `wrong` is the status of a value out
 * of range. */
shcd_status shcdi_cost_check_row(const char *where, shcd_status wrong, int degree,
                                 const shcd_cost_row *row, size_t i, shcd_error *error);
/** The same of the machine's name; NULL is good. */
shcd_status shcdi_cost_check_machine(const char *where, shcd_status wrong, const char *machine,
                                     shcd_error *error);
/** Both, of a whole table. */
shcd_status shcdi_cost_check(const char *where, shcd_status wrong, int degree,
                             const shcd_cost_row *rows, size_t n, const char *machine,
                             shcd_error *error);
/** Copies a checked table. @return SHCD_OK, SHCD_ERR_MEMORY. */
shcd_status shcdi_cost_copy(const shcd_cost_row *rows, size_t n, const char *machine,
                            const shcd_allocator *allocator, shcdi_cost *cost);

/** Bytes of the payload of chunk COST. */
size_t shcdi_cost_payload_size(size_t n_rows);
void shcdi_cost_write(const shcdi_cost *cost, unsigned char *payload);
/** Number of rows that a payload of this length holds, 0 if it is not one. */
size_t shcdi_cost_payload_rows(const unsigned char *payload, uint64_t length);
/** The rows and the machine of such a payload, unchecked. */
void shcdi_cost_read_row(const unsigned char *payload, size_t i, shcd_cost_row *row);
void shcdi_cost_read_machine(const unsigned char *payload, char machine[SHCD_COST_MACHINE_SIZE]);

#endif
