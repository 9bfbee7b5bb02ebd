/* SPDX-License-Identifier: BSD-3-Clause */
/* Sums over modes: what a soft body's coefficients change by. */
#ifndef SHCDI_MODAL_H
#define SHCDI_MODAL_H

#include "model/surface.h"

/** Columns come in multiples of this; the rest of a row is zero. */
#define SHCDI_MODAL_COLUMNS 8

static inline size_t shcdi_modal_stride(size_t n_columns) {
    return (n_columns + SHCDI_MODAL_COLUMNS - 1) / SHCDI_MODAL_COLUMNS * SHCDI_MODAL_COLUMNS;
}

#define SHCDI_DECLARE_MODAL(suffix)                                                                \
    void shcdi_modal_sum_##suffix(const double *rows, size_t stride, size_t n_rows,                \
                                  const shcd_vec3 *x, const double *scale,                         \
                                  double out[3][SHCDI_MODAL_COLUMNS]);

SHCDI_DECLARE_MODAL(portable)
#ifdef __x86_64__
SHCDI_DECLARE_MODAL(avx2)
SHCDI_DECLARE_MODAL(avx512)
#endif

/** out[c][i] = sum over k of rows[k stride + i] scale_k x_k[c], eight columns. The same bits on
 * every path. RT safe.
 *  @param[in] simd  a shcd_simd that this processor has */
static inline void shcdi_modal_sum(int simd, const double *rows, size_t stride, size_t n_rows,
                                   const shcd_vec3 *x, const double *scale,
                                   double out[3][SHCDI_MODAL_COLUMNS]) {
    SHCDI_ON_PATH(simd, modal_sum, rows, stride, n_rows, x, scale, out)
}

#endif
