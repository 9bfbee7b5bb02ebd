/* SPDX-License-Identifier: BSD-3-Clause */
/* Sums of squares over degrees, and coefficients packed for evaluation; the end of
 * surface_kernel.h, whose types it uses. Sums run in eight lanes on every path. */

typedef int64_t mask __attribute__((vector_size(8 * LANES)));

static const int64_t none_then_all[16] = {0, 0, 0, 0, 0, 0, 0, 0, -1, -1, -1, -1, -1, -1, -1, -1};

/* square[l]: of the differences of degree l. */
void NAME(squares)(int degree, const double *a, const double *b, double *square) {
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    square[0] = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    for (int l = 1; l <= degree; l++) {
        const size_t end = 3 * SHCD_COUNT(l);
        size_t i = 3 * SHCD_COUNT(l - 1);
        vec sum[8 / LANES];
        UNROLL for (size_t k = 0; k < 8 / LANES; k++) {
            sum[k] = all(0.0);
        }
        for (; i + 8 <= end; i += 8) {
            UNROLL for (size_t k = 0; k < 8 / LANES; k++) {
                const vec e = load(a + i + k * LANES) - load(b + i + k * LANES);
                sum[k] += e * e;
            }
        }
        if (i < end) {
            /* the last eight, without those that are in the sum already */
            const int64_t *keep = none_then_all + 8 - (i + 8 - end);
            const double *last_a = a + end - 8, *last_b = b + end - 8;
            UNROLL for (size_t k = 0; k < 8 / LANES; k++) {
                mask m;
                memcpy(&m, keep + k * LANES, sizeof m);
                const vec e = load(last_a + k * LANES) - load(last_b + k * LANES);
                sum[k] += (vec)((mask)(e * e) & m);
            }
        }
        double lane[8];
        memcpy(lane, sum, sizeof lane);
        square[l] = ((lane[0] + lane[4]) + (lane[2] + lane[6])) +
                    ((lane[1] + lane[5]) + (lane[3] + lane[7]));
    }
}

#if LANES == 8
/* shcdi_pack_for(), those rows of which eight orders lie within the coefficients: 24 numbers upward
 * from order 8 b on, and 24 downward, apart by coordinates. */
void NAME(pack_rows)(int degree, const double *coefficients, const double *scale,
                     double *restrict packed) {
    for (int block = 0; 8 * block <= degree; block++) {
        for (int l = 8 * block; l <= degree; l++, packed += 48, scale += 8) {
            if (!shcdi_has_whole_row(degree, block, l)) {
                continue;
            }
            const double *up = coefficients + 3 * SHCD_INDEX(l, 8 * block);
            const double *down = coefficients + 3 * SHCD_INDEX(l, -8 * block) - 21;
            const vec s = load(scale), u0 = load(up), u1 = load(up + 8), u2 = load(up + 16);
            const vec d0 = load(down), d1 = load(down + 8), d2 = load(down + 16);
            vec to[6] = {__builtin_shufflevector(u0, u1, 0, 3, 6, 9, 12, 15, 0, 0),
                         __builtin_shufflevector(u0, u1, 1, 4, 7, 10, 13, 0, 0, 0),
                         __builtin_shufflevector(u0, u1, 2, 5, 8, 11, 14, 0, 0, 0),
                         __builtin_shufflevector(d0, d1, 15, 12, 9, 6, 3, 0, 0, 0),
                         __builtin_shufflevector(d0, d1, 13, 10, 7, 4, 1, 0, 0, 0),
                         __builtin_shufflevector(d0, d1, 14, 11, 8, 5, 2, 0, 0, 0)};
            to[0] = __builtin_shufflevector(to[0], u2, 0, 1, 2, 3, 4, 5, 10, 13);
            to[1] = __builtin_shufflevector(to[1], u2, 0, 1, 2, 3, 4, 8, 11, 14);
            to[2] = __builtin_shufflevector(to[2], u2, 0, 1, 2, 3, 4, 9, 12, 15);
            to[3] = __builtin_shufflevector(to[3], d2, 13, 10, 0, 1, 2, 3, 4, 5);
            to[4] = __builtin_shufflevector(to[4], d2, 14, 11, 8, 0, 1, 2, 3, 4);
            to[5] = __builtin_shufflevector(to[5], d2, 15, 12, 9, 0, 1, 2, 3, 4);
            UNROLL for (int k = 0; k < 6; k++) {
                to[k] *= s;
                memcpy(packed + 8 * k, &to[k], sizeof to[k]);
            }
            if (block == 0) {
                packed[24] = packed[32] = packed[40] = 0.0; /* no sine of order 0 */
            }
        }
    }
}
#endif
