/* SPDX-License-Identifier: BSD-3-Clause */
/* Body of the modal sums, compiled once for each instruction set: include after defining MODAL_PATH
 * and LANES (2, 4 or 8 doubles in a vector), with the target set.
 *
 *   out[c][i] = sum_k rows[k][i] (scale_k x_k[c]),  c = x, y, z, for eight columns i:
 *
 * each sum is one lane's, over k in order, so that every path gives the same bits. */
#include "response/modal.h"

#include <string.h>

#define JOIN(a, b) a##b
#define NAMED(a, b) JOIN(a, b)
#define VECTORS (SHCDI_MODAL_COLUMNS / LANES)

typedef double vd __attribute__((vector_size(8 * LANES)));

void NAMED(shcdi_modal_sum_, MODAL_PATH)(const double *rows, size_t stride, size_t n_rows,
                                         const shcd_vec3 *x, const double *scale,
                                         double out[3][SHCDI_MODAL_COLUMNS]) {
    vd sum[3][VECTORS] = {{{0.0}}};
    for (size_t k = 0; k < n_rows; k++) {
        const double *row = rows + k * stride;
        const double q[3] = {scale[k] * x[k].x, scale[k] * x[k].y, scale[k] * x[k].z};
        for (size_t v = 0; v < VECTORS; v++) {
            vd a;
            memcpy(&a, row + v * LANES, sizeof a);
            sum[0][v] += a * q[0];
            sum[1][v] += a * q[1];
            sum[2][v] += a * q[2];
        }
    }
    memcpy(out, sum, sizeof sum);
}
