/* SPDX-License-Identifier: BSD-3-Clause */
/* How constants and coefficients lie in memory for evaluation, and what the paths of
 * surface_kernel.h are called.
 *
 * Orders come in blocks of eight, m = 8 b + lane. Block b has the rows l = 8 b .. L; blocks follow
 * one another. A row is eight lanes of a constant, or 6 x 8 of coefficients: cosine x, y, z, then
 * sine x, y, z. Lanes with m > l hold zeros.
 *
 * The recurrence runs on monic polynomials, Q_lm = scale_lm q_lm with
 *   q_mm = 1, q_lm = z q_{l-1,m} - gamma_lm q_{l-2,m}, gamma = ((l-1)^2 - m^2)/(4 (l-1)^2 - 1),
 * which costs two products instead of three; scale_lm (up to about 2^150) goes into the packed
 * coefficients. */
#ifndef SHCDI_MODEL_SURFACE_LAYOUT_H
#define SHCDI_MODEL_SURFACE_LAYOUT_H

#include "model/surface.h"

/** Rows before block b: sum over i < b of (L + 1 - 8 i). */
static inline size_t shcdi_rows_before(int degree, int block) {
    return (size_t)block * (size_t)(degree + 5 - 4 * block);
}
static inline size_t shcdi_row_count(int degree) {
    return shcdi_rows_before(degree, degree / 8 + 1);
}

/** Whether eight orders of a row, up and down, lie within the coefficients; those above l have the
 *  scale 0, and what is read for them does not matter. Not so the last row and the first three. */
static inline int shcdi_has_whole_row(int degree, int block, int l) {
    return l - 8 * block + 1 >= 8 || (l >= 3 && l < degree);
}

/** Parts of `recurrence`: gamma, then scale, a row each; then -l(l+1), l = 0..L; then the
 *  factors of norms.h. */
static inline const double *shcdi_gamma_rows(const shcdi_series *series) {
    return series->recurrence;
}
static inline const double *shcdi_scale_rows(const shcdi_series *series) {
    return series->recurrence + 8 * shcdi_row_count(series->degree);
}
static inline const double *shcdi_lambda(const shcdi_series *series) {
    return series->recurrence + 16 * shcdi_row_count(series->degree);
}

#endif
