/* SPDX-License-Identifier: BSD-3-Clause */
/* The learned response that a model carries: checked, copied, and as bytes of a file. */
#ifndef SHCDI_MODEL_LEARNED_H
#define SHCDI_MODEL_LEARNED_H

#include "base/internal.h"
#include "shcd/learned.h"

typedef struct shcdi_learned {
    shcd_learned view; /**< n_centres 0: none; else its pointers point into numbers */
    double *numbers;   /**< centres, weights, dents; NULL: none */
} shcdi_learned;

/** Whether a network may be stored. Messages start with `where`; `wrong` is the status of a value
 *  out of range. NULL is good.
 *  @param[in] n_modes  of the model that it belongs to */
shcd_status shcdi_learned_check(const char *where, shcd_status wrong, size_t n_modes,
                                const shcd_learned *learned, shcd_error *error);
/** Copies a checked network; NULL: none. @return SHCD_OK, SHCD_ERR_MEMORY. */
shcd_status shcdi_learned_copy(const shcd_learned *learned, const shcd_allocator *allocator,
                               shcdi_learned *copy);
/** Doubles of centres, weights and dents together; 0 without centres. */
size_t shcdi_learned_count(const shcd_learned *learned);

/** Bytes of the payload of chunk LEAR. */
size_t shcdi_learned_payload_size(const shcd_learned *learned);
void shcdi_learned_write(const shcdi_learned *learned, unsigned char *payload);
/** Doubles that a payload of this length holds beside its head, 0 if it is not one. */
size_t shcdi_learned_payload_count(const unsigned char *payload, uint64_t length);
/** The network of such a payload, unchecked. numbers: shcdi_learned_payload_count() doubles, which
 *  *learned points to. */
void shcdi_learned_read(const unsigned char *payload, double *numbers, shcd_learned *learned);

#endif
