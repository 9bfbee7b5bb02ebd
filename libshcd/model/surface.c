/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables for evaluation, and which of the compiled paths of surface_kernel.h this processor has. */
#include "model/surface.h"

#include "base/harmonics.h"
#include "model/norms.h"
#include "model/surface_layout.h"

#include <string.h>

#define Q_00 0.28209479177387814

size_t shcdi_recurrence_size(int degree) {
    return 16 * shcdi_row_count(degree) + (1 + SHCDI_NORMS) * ((size_t)degree + 1);
}

size_t shcdi_packed_size(int degree) {
    return 48 * shcdi_row_count(degree);
}

/* Scale of the eight orders of a block at row l from that at row l - 1. */
static void advance_scale(double scale[8], int block, int l, double *diagonal) {
    for (int lane = 0; lane < 8; lane++) {
        const int m = 8 * block + lane;
        if (m < l) {
            scale[lane] *= shcdi_recurrence_a(l, m);
        } else if (m == l) {
            *diagonal = m == 0 ? Q_00 : *diagonal * shcdi_recurrence_diagonal(m);
            scale[lane] = *diagonal;
        } else {
            scale[lane] = 0.0;
        }
    }
}

void shcdi_recurrence_fill(int degree, double *recurrence) {
    double *gamma = recurrence, *scales = recurrence + 8 * shcdi_row_count(degree);
    double diagonal = 0.0;
    for (int block = 0; 8 * block <= degree; block++) {
        double scale[8];
        for (int l = 8 * block; l <= degree; l++, gamma += 8, scales += 8) {
            const double k2 = (double)(l - 1) * (double)(l - 1);
            advance_scale(scale, block, l, &diagonal);
            memcpy(scales, scale, sizeof scale);
            for (int lane = 0; lane < 8; lane++) {
                const double m = 8.0 * block + lane;
                gamma[lane] = m + 1.0 < l ? (k2 - m * m) / (4.0 * k2 - 1.0) : 0.0;
            }
        }
    }
    for (int l = 0; l <= degree; l++) {
        scales[l] = -(double)l * (l + 1.0);
        shcdi_norm_factors(degree, l, scales + degree + 1 + SHCDI_NORMS * l);
    }
}

const double *shcdi_series_factors(const shcdi_series *series) {
    return shcdi_lambda(series) + series->degree + 1;
}

/* One row of n orders of a block from the first on; lanes beyond are set to zero. */
static inline __attribute__((always_inline)) void pack_lanes(int n, const double *up,
                                                             const double *down,
                                                             const double scale[8],
                                                             double *restrict packed) {
    for (int k = 0; k < 3; k++) {
        _Pragma("GCC unroll 8") for (int lane = 0; lane < n; lane++) {
            packed[8 * k + lane] = up[3 * lane + k] * scale[lane];
            packed[24 + 8 * k + lane] = down[k - 3 * lane] * scale[lane];
        }
        for (int lane = n; lane < 8; lane++) {
            packed[8 * k + lane] = packed[24 + 8 * k + lane] = 0.0;
        }
    }
}

static void pack_row(int degree, int block, int l, const double *coefficients,
                     const double scale[8], double *packed) {
    const int n = l - 8 * block + 1;
    const double *up = coefficients + 3 * SHCD_INDEX(l, 8 * block);
    const double *down = coefficients + 3 * SHCD_INDEX(l, -8 * block);
    if (shcdi_has_whole_row(degree, block, l)) {
        pack_lanes(8, up, down, scale, packed);
    } else {
        pack_lanes(n, up, down, scale, packed);
    }
    if (block == 0) {
        packed[24] = packed[32] = packed[40] = 0.0; /* no sine of order 0 */
    }
}

void shcdi_pack(int degree, const double *coefficients, double *packed) {
    double diagonal = 0.0;
    for (int block = 0; 8 * block <= degree; block++) {
        double scale[8];
        for (int l = 8 * block; l <= degree; l++, packed += 48) {
            advance_scale(scale, block, l, &diagonal);
            pack_row(degree, block, l, coefficients, scale, packed);
        }
    }
}

void shcdi_pack_for(const shcdi_series *series, const double *coefficients, double *packed) {
    const double *scale = shcdi_scale_rows(series);
    int is_done = 0;
#ifdef __x86_64__
    if (series->simd == SHCD_SIMD_AVX512) {
        shcdi_pack_rows_avx512(series->degree, coefficients, scale, packed);
        is_done = 1; /* but for the rows that are not whole */
    }
#endif
    for (int block = 0; 8 * block <= series->degree; block++) {
        for (int l = 8 * block; l <= series->degree; l++, packed += 48, scale += 8) {
            if (!is_done || !shcdi_has_whole_row(series->degree, block, l)) {
                pack_row(series->degree, block, l, coefficients, scale, packed);
            }
        }
    }
}

/* ---- paths ---- */

#ifdef __x86_64__
static int has_path(int simd) {
    __builtin_cpu_init();
    switch (simd) {
    case SHCD_SIMD_AVX512:
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
               __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    case SHCD_SIMD_AVX2:
        return __builtin_cpu_supports("avx2") != 0;
    default:
        return simd == SHCD_SIMD_PORTABLE;
    }
}
#else
static int has_path(int simd) {
    return simd == SHCD_SIMD_PORTABLE;
}
#endif

int shcdi_simd_choose(int wanted) {
    if (wanted != SHCD_SIMD_AUTO) {
        return has_path(wanted) ? wanted : 0;
    }
    int simd = SHCD_SIMD_AVX512;
    while (!has_path(simd)) {
        simd--;
    }
    return simd;
}
