/* SPDX-License-Identifier: BSD-3-Clause */
/* The surface's modes that a model carries: checked, copied, and as bytes of a file. */
#ifndef SHCDI_MODEL_MODES_H
#define SHCDI_MODEL_MODES_H

#include "base/internal.h"
#include "shcd/model.h"

typedef struct shcdi_modes {
    shcd_modes view; /**< n_modes 0: none; else its pointers point into numbers */
    double *numbers; /**< eigenvalues, then coefficients; NULL: none */
} shcdi_modes;

/** Whether modes may be stored. Messages start with `where`; `wrong` is the status of a value out
 *  of range. NULL is good. That the modes are orthonormal is the fit's business: to check it here
 *  would take the fit's quadrature. */
shcd_status shcdi_modes_check(const char *where, shcd_status wrong, int degree,
                              const shcd_modes *modes, shcd_error *error);
/** Copies checked modes; NULL: none. @return SHCD_OK, SHCD_ERR_MEMORY. */
shcd_status shcdi_modes_copy(const shcd_modes *modes, int degree, const shcd_allocator *allocator,
                             shcdi_modes *copy);
/** Doubles of eigenvalues and coefficients together. */
size_t shcdi_modes_count(size_t n_modes, int degree);

/** Bytes of the payload of chunk MODE. */
size_t shcdi_modes_payload_size(size_t n_modes, int degree);
void shcdi_modes_write(const shcdi_modes *modes, int degree, unsigned char *payload);
/** Number of modes that a payload of this length holds, 0 if it is not one. */
size_t shcdi_modes_payload_count(const unsigned char *payload, uint64_t length);
/** shcdi_modes_check() of such a payload, without a copy; besides, its degree must be `degree`. */
shcd_status shcdi_modes_check_payload(const char *where, int degree, const unsigned char *payload,
                                      shcd_error *error);
/** The modes of a checked payload. numbers: shcdi_modes_count() doubles, which *modes points to. */
void shcdi_modes_read(const unsigned char *payload, double *numbers, shcd_modes *modes);

#endif
