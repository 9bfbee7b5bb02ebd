/* SPDX-License-Identifier: BSD-3-Clause */
/* Body of the scans, compiled once for each instruction set: include after defining SCAN_PATH and
 * LANES (4, 8 or 16 floats in a vector), with the target set.
 *
 * A lane does the same IEEE operations in the same order whatever LANES is (no contraction; square
 * roots are correctly rounded everywhere), so every path gives the same bits.
 *
 * Rounding. Let u = 2^-24 and s = |p| + extent of the block, all relative to the origin.
 * Coordinates and their differences err by a few u s, so do the distances made from them by sums of
 * squares and square roots; NOISE s covers them with room. Two operations amplify: the unit normal
 * of a triangle errs by 4 u ee/|n| (ee the longest squared edge, |n| twice the area), which tilts
 * its plane and shifts the feet that decide which side of an edge counts. A foot on the wrong side
 * changes the distance by no more than it is shifted: twice the tilt, times the distance to the
 * corner, is taken off. A triangle without area is left to its edges. */
#include "model/scan.h"

#include <math.h>
#include <string.h>
#ifdef __x86_64__
#include <immintrin.h>
#endif

#define JOIN(a, b) a##b
#define NAMED(a, b) JOIN(a, b)

typedef float vf __attribute__((vector_size(4 * LANES)));
typedef int32_t vi __attribute__((vector_size(4 * LANES)));
typedef uint32_t vu __attribute__((vector_size(4 * LANES)));
typedef uint16_t vh __attribute__((vector_size(2 * LANES)));

#define INLINE static inline __attribute__((always_inline))
#define NOISE 0x1p-20f
#define TILT 0x1p-21f /* 8 u: twice the tilt */

INLINE vf select_where(vi mask, vf a, vf b) {
    return (vf)((mask & (vi)a) | (~mask & (vi)b));
}

INLINE vf smaller(vf a, vf b) {
    return select_where(a < b, a, b);
}

INLINE vf larger(vf a, vf b) {
    return select_where(a > b, a, b);
}

/* By instructions: a call of sqrtf would keep the compiler from using them, for the sake of errno.
 */
INLINE vf root(vf a) {
#if defined(__x86_64__) && LANES == 16
    return (vf)_mm512_sqrt_ps((__m512)a);
#elif defined(__x86_64__) && LANES == 8
    return (vf)_mm256_sqrt_ps((__m256)a);
#elif defined(__x86_64__)
    return (vf)_mm_sqrt_ps((__m128)a);
#else
    for (int i = 0; i < LANES; i++) {
        a[i] = sqrtf(a[i]);
    }
    return a;
#endif
}

typedef float four __attribute__((vector_size(16)));
typedef int32_t whole4 __attribute__((vector_size(16)));

/* The largest and the smallest of a vector's numbers. */
INLINE float most(vf a) {
    four part[LANES / 4];
    memcpy(part, &a, sizeof a);
    for (int i = 1; i < LANES / 4; i++) {
        const whole4 mask = part[i] > part[0];
        part[0] = (four)((mask & (whole4)part[i]) | (~mask & (whole4)part[0]));
    }
    const float x = part[0][0] > part[0][1] ? part[0][0] : part[0][1];
    const float y = part[0][2] > part[0][3] ? part[0][2] : part[0][3];
    return x > y ? x : y;
}

INLINE float fewest(vf a) {
    return -most(-a);
}

INLINE vf load(const float *from) {
    vf v;
    memcpy(&v, from, sizeof v);
    return v;
}

INLINE void store(float *to, vf v) {
    memcpy(to, &v, sizeof v);
}

typedef struct v3 {
    vf x, y, z;
} v3;

INLINE vf dot(v3 a, v3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

INLINE v3 sub(v3 a, v3 b) {
    const v3 c = {a.x - b.x, a.y - b.y, a.z - b.z};
    return c;
}

INLINE v3 cross(v3 a, v3 b) {
    const v3 c = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    return c;
}

void NAMED(shcdi_scan_balls_, SCAN_PATH)(const shcdi_ball_table *balls, const float p[3],
                                         float *lower) {
    const float size = fabsf(p[0]) + fabsf(p[1]) + fabsf(p[2]);
    const vf none = {0.0f};
    for (size_t i = 0; i < balls->n; i += LANES) {
        const vf growth = balls->growth != NULL ? load(balls->growth + i) : none;
        const v3 at = {load(balls->x + i) - p[0], load(balls->y + i) - p[1],
                       load(balls->z + i) - p[2]};
        const vf r = load(balls->radius + i), d = root(dot(at, at));
        /* |centre| + radius <= size + d + radius */
        store(lower + i, d - r - growth - NOISE * (size + (d + r)));
    }
}

/* ---- leaves ---- */

/* Coordinates of the nodes, then of the leaves' corners. */
typedef struct corners {
    float node[3][SHCDI_BLOCK_NODES];
    float at[3][3][SHCDI_BLOCK_LEAVES]; /* corner, coordinate */
} corners;

INLINE void fill_corners(const shcdi_block *block, corners *c) {
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < SHCDI_BLOCK_NODES; i++) {
            c->node[k][i] = (float)block->q[k][i] * block->unit;
        }
    }
    for (int e = 0; e < 3; e++) {
        for (int k = 0; k < 3; k++) {
#if LANES == 16
            /* constant permutations of one register */
            const vf v = load(c->node[k]);
            const vf a = __builtin_shufflevector(v, v, SHCDI_BLOCK_CORNER_0);
            const vf b = __builtin_shufflevector(v, v, SHCDI_BLOCK_CORNER_1);
            const vf d = __builtin_shufflevector(v, v, SHCDI_BLOCK_CORNER_2);
            store(c->at[e][k], e == 0 ? a : e == 1 ? b : d);
#else
            for (int i = 0; i < SHCDI_BLOCK_LEAVES; i++) {
                c->at[e][k][i] = c->node[k][shcdi_block_corner[e][i]];
            }
#endif
        }
    }
}

/* Squared distance from a point, seen from the edge's start as q, to the edge e. */
INLINE vf edge(v3 q, v3 e, vf ee) {
    const vf zero = {0.0f}, one = zero + 1.0f;
    const vf t = smaller(larger(dot(q, e) / (ee + 1e-37f), zero), one);
    const v3 d = {q.x - t * e.x, q.y - t * e.y, q.z - t * e.z};
    return dot(d, d);
}

void NAMED(shcdi_scan_leaves_, SCAN_PATH)(const shcdi_block *block,
                                          const shcdi_block_bounds *bounds, const float p[3],
                                          float growth, float lower[SHCDI_BLOCK_LEAVES],
                                          float upper[SHCDI_BLOCK_LEAVES], float least[2]) {
    const float size = fabsf(p[0]) + fabsf(p[1]) + fabsf(p[2]);
    const float at[3] = {p[0] - block->centre[0], p[1] - block->centre[1], p[2] - block->centre[2]};
    const float extra = growth + SHCDI_GRID_ERROR * block->unit;
    /* no corner is farther: 32768 sqrt(3) units from the centre at most */
    const float reach = fabsf(at[0]) + fabsf(at[1]) + fabsf(at[2]) + 56756.0f * block->unit;
    const float noise = NOISE * (size + reach);
    corners c;
    fill_corners(block, &c);
    for (int i = 0; i < SHCDI_BLOCK_LEAVES; i += LANES) {
        const v3 a = {load(c.at[0][0] + i), load(c.at[0][1] + i), load(c.at[0][2] + i)};
        const v3 b = {load(c.at[1][0] + i), load(c.at[1][1] + i), load(c.at[1][2] + i)};
        const v3 d = {load(c.at[2][0] + i), load(c.at[2][1] + i), load(c.at[2][2] + i)};
        const v3 e0 = sub(b, a), e1 = sub(d, b), e2 = sub(a, d);
        const v3 q0 = {at[0] - a.x, at[1] - a.y, at[2] - a.z};
        const v3 q1 = {at[0] - b.x, at[1] - b.y, at[2] - b.z};
        const v3 q2 = {at[0] - d.x, at[1] - d.y, at[2] - d.z};
        const vf ee0 = dot(e0, e0), ee1 = dot(e1, e1), ee2 = dot(e2, e2);
        const vf edges = smaller(edge(q2, e2, ee2), smaller(edge(q1, e1, ee1), edge(q0, e0, ee0)));
        const vf ee = larger(larger(ee0, ee1), ee2);
        /* n = e0 x (d - a) */
        const v3 n = cross(e2, e0);
        const vf nn = dot(n, n), zero = {0.0f};
        const vf s1 = dot(cross(e2, q0), n), s2 = dot(cross(e0, q0), n);
        const vi inside = (s1 > zero) & (s2 > zero) & (s1 + s2 < nn);
        const vf h = dot(q0, n);
        const vf per = 1.0f / (nn + 1e-37f);
        const vf distance = root(select_where(inside, h * h * per, edges));
        const vf slip = (TILT * reach) * root(ee * ee * per);
        vh half;
        memcpy(&half, bounds->deviation + i, sizeof half);
        const vf thick = (vf)(__builtin_convertvector(half, vu) << 16) + extra;
        const vf low = distance - thick - noise;
        /* without area there is no plane, and its slip says nothing */
        store(lower + i, select_where(nn <= zero + 1e-36f, low, low - slip));
        store(upper + i, distance + thick + noise);
    }
    vf low = load(lower), high = load(upper);
    for (int i = LANES; i < SHCDI_BLOCK_LEAVES; i += LANES) {
        low = smaller(low, load(lower + i));
        high = smaller(high, load(upper + i));
    }
    least[0] = fewest(low);
    least[1] = fewest(high);
}

/* ---- lists of values ---- */

INLINE int any(vi mask) {
#if defined(__x86_64__) && LANES == 16
    return _mm512_test_epi32_mask((__m512i)mask, (__m512i)mask) != 0;
#elif defined(__x86_64__) && LANES == 8
    return _mm256_movemask_ps((__m256)mask) != 0;
#elif defined(__x86_64__)
    return _mm_movemask_ps((__m128)mask) != 0;
#else
    int found = 0;
    for (int k = 0; k < LANES; k++) {
        found |= mask[k];
    }
    return found != 0;
#endif
}

size_t NAMED(shcdi_scan_least_, SCAN_PATH)(const float *value, size_t n) {
    vf least = load(value);
    for (size_t i = LANES; i < n; i += LANES) {
        least = smaller(load(value + i), least);
    }
    const float smallest = fewest(least);
    const vf zero = {0.0f};
    for (size_t i = 0; i < n; i += LANES) {
        if (any(load(value + i) <= zero + smallest)) {
            while (!(value[i] <= smallest)) {
                i++;
            }
            return i;
        }
    }
    return 0;
}

size_t NAMED(shcdi_scan_below_, SCAN_PATH)(const float *value, size_t n, float limit,
                                           uint16_t *index) {
    const vf zero = {0.0f};
    size_t found = 0;
    for (size_t i = 0; i < n; i += LANES) {
        if (any(load(value + i) < zero + limit)) {
            for (size_t k = i; k < i + LANES; k++) {
                index[found] = (uint16_t)k;
                found += value[k] < limit;
            }
        }
    }
    return found;
}

#include "model/block_kernel.h"

#undef INLINE
