/* SPDX-License-Identifier: BSD-3-Clause */
/* Distances from a point to many balls or to the 16 leaf triangles of a block at a time: the inner
 * loops of every search. Lower bounds, rounding included. */
#ifndef SHCDI_MODEL_SCAN_H
#define SHCDI_MODEL_SCAN_H

#include "shcd/model.h"

#include <stddef.h>
#include <stdint.h>

#define SHCDI_BLOCK_LEAVES 16
/** The 15 nodes of a triangle split twice; the last slot repeats the first. */
#define SHCDI_BLOCK_NODES 16

/** Corners of the leaves of a block among its nodes, also as lists. */
#define SHCDI_BLOCK_CORNER_0 14, 13, 12, 13, 11, 8, 7, 8, 9, 6, 5, 6, 11, 7, 10, 7
#define SHCDI_BLOCK_CORNER_1 13, 11, 10, 10, 8, 4, 3, 3, 6, 2, 1, 1, 7, 2, 6, 6
#define SHCDI_BLOCK_CORNER_2 12, 10, 9, 12, 7, 3, 2, 7, 5, 1, 0, 5, 10, 6, 9, 10
extern const uint8_t shcdi_block_corner[3][SHCDI_BLOCK_LEAVES];

/** Node positions of one block: centre + unit (x, y, z), relative to the index's origin. Rounding a
 *  position to the grid moves it by at most SHCDI_GRID_ERROR units. S stays within `thickness` of
 * the plane through the centre along `normal`, a unit vector or zero, and within `width` of the
 * centre along the plane. */
typedef struct shcdi_block {
    float centre[3];
    float unit;
    float normal[3];
    float thickness, width;
    int16_t q[3][SHCDI_BLOCK_NODES];
} shcdi_block;
#define SHCDI_GRID_ERROR 0.9f /* sqrt(3)/2 and a little: block_kernel.h */

/** What bounds say about the leaves of one block, as the upper halves of floats rounded outward:
 *  the deviation of each leaf, and the derivatives' bounds of each four siblings. */
typedef struct shcdi_block_bounds {
    uint16_t deviation[SHCDI_BLOCK_LEAVES];
    uint16_t m1[4], m2[4], m3[4], sigma[4], product[4];
    uint16_t largest; /**< of the deviations */
} shcdi_block_bounds;

/** Enclosing balls of all blocks, SHCDI_BLOCK_LEAVES of them at a time. */
typedef struct shcdi_ball_table {
    const float *x, *y, *z, *radius;
    const float *growth; /**< what each radius may have grown by; NULL: nothing */
    size_t n;            /**< a multiple of 16; those that fill it up have radius -inf */
} shcdi_ball_table;

/** Blocks to be made from node positions: node i of the block index[t] is the place source[16 t +
 * i] of each of three planes, a coordinate each, counted in steps. */
typedef struct shcdi_block_fill {
    const int32_t *place;
    size_t plane;
    const uint16_t *source, *index;
    size_t n;
    const shcdi_block_bounds *bounds; /**< of all blocks */
    float step;                       /**< a power of two */
    shcdi_block *block;
    float *ball; /**< x, y, z, radius, n_balls each */
    size_t n_balls;
} shcdi_block_fill;

/* One source, compiled for several instruction sets (scan_kernel.h); all give the same bits. */
#define SHCDI_DECLARE_SCAN(suffix)                                                                 \
    void shcdi_scan_balls_##suffix(const shcdi_ball_table *balls, const float p[3], float *lower); \
    void shcdi_scan_leaves_##suffix(const shcdi_block *block, const shcdi_block_bounds *bounds,    \
                                    const float p[3], float growth,                                \
                                    float lower[SHCDI_BLOCK_LEAVES],                               \
                                    float upper[SHCDI_BLOCK_LEAVES], float least[2]);              \
    void shcdi_scan_fill_##suffix(const shcdi_block_fill *fill);                                   \
    size_t shcdi_scan_least_##suffix(const float *value, size_t n);                                \
    size_t shcdi_scan_below_##suffix(const float *value, size_t n, float limit, uint16_t *index);

SHCDI_DECLARE_SCAN(portable)
#ifdef __x86_64__
SHCDI_DECLARE_SCAN(avx2)
SHCDI_DECLARE_SCAN(avx512)
#define SHCDI_SCAN_PATH(simd, name, ...)                                                           \
    switch (simd) {                                                                                \
    case SHCD_SIMD_AVX512:                                                                         \
        shcdi_scan_##name##_avx512(__VA_ARGS__);                                                   \
        break;                                                                                     \
    case SHCD_SIMD_AVX2:                                                                           \
        shcdi_scan_##name##_avx2(__VA_ARGS__);                                                     \
        break;                                                                                     \
    default:                                                                                       \
        shcdi_scan_##name##_portable(__VA_ARGS__);                                                 \
        break;                                                                                     \
    }
#else
#define SHCDI_SCAN_PATH(simd, name, ...) shcdi_scan_##name##_portable(__VA_ARGS__);
#endif

/** Lower bounds of the distance to each ball, lower[n]. p is relative to the origin, scaled. */
static inline void shcdi_scan_balls(int simd, const shcdi_ball_table *balls, const float p[3],
                                    float *lower) {
    SHCDI_SCAN_PATH(simd, balls, balls, p, lower)
}

/** Of the leaves of a block: lower bounds of the distance to the surface, their deviation and
 *  `growth` taken off, and upper bounds of the distance to its nearest point; the least of both. */
static inline void shcdi_scan_leaves(int simd, const shcdi_block *block,
                                     const shcdi_block_bounds *bounds, const float p[3],
                                     float growth, float lower[SHCDI_BLOCK_LEAVES],
                                     float upper[SHCDI_BLOCK_LEAVES], float least[2]) {
    SHCDI_SCAN_PATH(simd, leaves, block, bounds, p, growth, lower, upper, least)
}

/** Makes blocks and their balls. */
static inline void shcdi_scan_fill(int simd, const shcdi_block_fill *fill) {
    SHCDI_SCAN_PATH(simd, fill, fill)
}

#ifdef __x86_64__
#define SHCDI_SCAN_VALUE(simd, name, ...)                                                          \
    (simd) == SHCD_SIMD_AVX512 ? shcdi_scan_##name##_avx512(__VA_ARGS__)                           \
    : (simd) == SHCD_SIMD_AVX2 ? shcdi_scan_##name##_avx2(__VA_ARGS__)                             \
                               : shcdi_scan_##name##_portable(__VA_ARGS__)
#else
#define SHCDI_SCAN_VALUE(simd, name, ...) ((void)(simd), shcdi_scan_##name##_portable(__VA_ARGS__))
#endif

/** Index of the first smallest of n values, n a multiple of 16. */
static inline size_t shcdi_scan_least(int simd, const float *value, size_t n) {
    return SHCDI_SCAN_VALUE(simd, least, value, n);
}

/** Indices of the values below a limit, in order; their number. index has room for n. */
static inline size_t shcdi_scan_below(int simd, const float *value, size_t n, float limit,
                                      uint16_t *index) {
    return SHCDI_SCAN_VALUE(simd, below, value, n, limit, index);
}

static inline float shcdi_from_half(uint16_t h) {
    union {
        uint32_t u;
        float f;
    } c = {(uint32_t)h << 16};
    return c.f;
}

#endif
