/* SPDX-License-Identifier: BSD-3-Clause */
/* Evaluation of one direction, body of a path: include after defining SHCDI_SUFFIX and LANES (8, 4
 * or 2 orders at a time; 8 takes the first rows of a block, whose upper lanes are empty, at 4).
 *
 * For each order the sums A = sum_l c q, B (sine) and their companions run along l; order m then
 * adds Re((A - i B) zeta^m), zeta = x + i y, to its lane, and lanes are added at the end in the
 * fixed order ((0+4)+(2+6)) + ((1+5)+(3+7)).
 *
 * Derivatives. S extended off the sphere by its polynomial in (x, y, z) has H_xx + H_yy = 0 and the
 * Laplacian on the sphere is known term by term: -l(l+1). In a frame whose t1 is horizontal, t1 and
 * t2 = w x t1, H_zz is therefore never needed:
 *   s11 = t1.H.t1 - w.G, s12 = t1.H.t2, s22 = Lap S - s11,
 * and no second z-derivative has to be run along l. Gradients in x and y come from m zeta^{m-1} and
 * m (m-1) zeta^{m-2}, so nothing is divided by the distance from the axis. */
#include "model/surface_layout.h"

#include <string.h>

/* Everything is inlined: how vectors would be passed does not matter. */
#pragma GCC diagnostic ignored "-Wpsabi"

#if LANES == 8
#include <immintrin.h>
#define widen(v) _mm512_zextpd256_pd512(v)
#endif

#define INLINE static inline __attribute__((always_inline))
#define UNROLL _Pragma("GCC unroll 32")
#if defined __x86_64__ && LANES == 8
/* Otherwise each use of a coefficient becomes a load of its own. */
#define IN_REGISTER(v) __asm__("" : "+v"(v))
#else
#define IN_REGISTER(v) ((void)0)
#endif

/* Tables of one block, moved to its first row. */
typedef struct surface_rows {
    const double *gamma, *c, *lambda;
} surface_rows;

static const double unit_row[8][8] __attribute__((aligned(64))) = {
    {1, 0, 0, 0, 0, 0, 0, 0}, {0, 1, 0, 0, 0, 0, 0, 0}, {0, 0, 1, 0, 0, 0, 0, 0},
    {0, 0, 0, 1, 0, 0, 0, 0}, {0, 0, 0, 0, 1, 0, 0, 0}, {0, 0, 0, 0, 0, 1, 0, 0},
    {0, 0, 0, 0, 0, 0, 1, 0}, {0, 0, 0, 0, 0, 0, 0, 1}};
/* Binary digits of the lane number, and their complements. */
static const double digit[3][8] __attribute__((aligned(64))) = {
    {0, 1, 0, 1, 0, 1, 0, 1}, {0, 0, 1, 1, 0, 0, 1, 1}, {0, 0, 0, 0, 1, 1, 1, 1}};
static const double no_digit[3][8] __attribute__((aligned(64))) = {
    {1, 0, 1, 0, 1, 0, 1, 0}, {1, 1, 0, 0, 1, 1, 0, 0}, {1, 1, 1, 1, 0, 0, 0, 0}};
static const double lane_number[8] __attribute__((aligned(64))) = {0, 1, 2, 3, 4, 5, 6, 7};

#if LANES == 8
#undef LANES
#define LANES 4
#include "model/surface_lanes.h"
#undef LANES
#define LANES 8
#endif
#include "model/surface_lanes.h"

#define NAME_(name, suffix) shcdi_##name##_##suffix
#define NAME_OF(name, suffix) NAME_(name, suffix)
#define NAME(name) NAME_OF(name, SHCDI_SUFFIX)
#define L_(name) PASTE(name, LANES)
#define STRIPS (8 / LANES)
typedef L_(vec) vec;
#define load L_(load)
#define all L_(all)

INLINE surface_rows rows_of(const shcdi_series *series, int block) {
    const size_t before = shcdi_rows_before(series->degree, block);
    const surface_rows rows = {shcdi_gamma_rows(series) + 8 * before, series->packed + 48 * before,
                               shcdi_lambda(series) + 8 * block};
    return rows;
}

#if LANES == 8
INLINE void widen_strip(strip8 *s, const strip4 *low, int families) {
    s->q = widen(low->q);
    s->q1 = widen(low->q1);
    s->p = widen(low->p);
    s->p1 = widen(low->p1);
    UNROLL for (int k = 0; k < 6 * families; k++) {
        s->a[k] = widen(low->a[k]);
    }
}
#endif

/* All rows of the orders 8 block + lane .. + LANES - 1. */
INLINE void run_strip(L_(strip) * s, const surface_rows *rows, int lane, int n_rows, double z,
                      int families) {
#if LANES == 8
    (void)lane;
    strip4 low;
    const int n_low = n_rows < 4 ? n_rows : 4;
    strip_clear4(&low);
    strip_rows4(&low, rows, 0, 0, n_low, all4(z), families);
    widen_strip(s, &low, families);
    strip_rows8(s, rows, 0, n_low, n_rows, all8(z), families);
#else
    L_(strip_clear)(s);
    L_(strip_rows)(s, rows, lane, lane, n_rows, all(z), families);
#endif
}

#if LANES == 8
/* Two blocks, b and b + 1, the rows of the second beside those of the first: each alone waits for
 * its own recurrence (two operations, one after the other, a row). */
INLINE void run_two_blocks(strip8 *s, strip8 *t, const surface_rows *rows, const surface_rows *next,
                           int n_rows, double z, int families) {
    strip4 low;
    const vec8 zz = all8(z);
    int i = 8;
    run_strip(s, rows, 0, 8, z, families);
    strip_clear4(&low);
    for (; i < n_rows && i < 12; i++) {
        strip_row8(s, rows->gamma + 8 * i, rows->c + 48 * i, NULL, NULL, zz, families);
        strip_rows4(&low, next, 0, i - 8, i - 7, all4(z), families);
    }
    widen_strip(t, &low, families);
    for (; i < n_rows; i++) {
        strip_row8(s, rows->gamma + 8 * i, rows->c + 48 * i, NULL, NULL, zz, families);
        strip_rows8(t, next, 0, i - 8, i - 7, zz, families);
    }
}
#endif

/* ---- powers of zeta ---- */

typedef struct power {
    vec c, s; /* real and imaginary part */
} power;

INLINE power times(power a, power b) {
    const power product = {a.c * b.c - a.s * b.s, a.c * b.s + a.s * b.c};
    return product;
}

/* zeta^0 .. zeta^7 by the digits of the exponent; returns zeta^8. */
INLINE power first_powers(double x, double y, power base[STRIPS]) {
    const double x2 = x * x - y * y, y2 = x * y + y * x;
    const double x4 = x2 * x2 - y2 * y2, y4 = x2 * y2 + y2 * x2;
    const double x8 = x4 * x4 - y4 * y4, y8 = x4 * y4 + y4 * x4;
    UNROLL for (int h = 0; h < STRIPS; h++) {
        const double *d0 = digit[0] + h * LANES, *d1 = digit[1] + h * LANES;
        const double *d2 = digit[2] + h * LANES;
        const power p1 = {load(d0) * all(x) + load(no_digit[0] + h * LANES), load(d0) * all(y)};
        const power p2 = {load(d1) * all(x2) + load(no_digit[1] + h * LANES), load(d1) * all(y2)};
        const power p4 = {load(d2) * all(x4) + load(no_digit[2] + h * LANES), load(d2) * all(y4)};
        base[h] = times(times(p1, p2), p4);
    }
    const power eighth = {all(x8), all(y8)};
    return eighth;
}

/* ---- sums over lanes ---- */

typedef double vec4 __attribute__((vector_size(32)));
typedef double vec2 __attribute__((vector_size(16)));

/* Lanes 0 .. 7 of three sums to the three totals. */
#if LANES == 2
INLINE vec2 fold(const vec *a, const vec *b, const vec *c, const vec *d) {
    return (*a + *c) + (*b + *d);
}
#endif

INLINE vec4 totals(const vec *sum, int stride) {
    (void)stride;
#if LANES == 2
    vec2 e[3];
    UNROLL for (int k = 0; k < 3; k++) {
        e[k] = fold(sum + k, sum + stride + k, sum + 2 * stride + k, sum + 3 * stride + k);
    }
    const vec4 r = {e[0][0] + e[0][1], e[1][0] + e[1][1], e[2][0] + e[2][1], 0.0};
    return r;
#else
    vec4 h[3];
    UNROLL for (int k = 0; k < 3; k++) {
#if LANES == 8
        h[k] = __builtin_shufflevector(sum[k], sum[k], 0, 1, 2, 3) +
               __builtin_shufflevector(sum[k], sum[k], 4, 5, 6, 7);
#else
        h[k] = sum[k] + sum[stride + k];
#endif
    }
    const vec4 xz = __builtin_shufflevector(h[0], h[2], 0, 1, 4, 5) +
                    __builtin_shufflevector(h[0], h[2], 2, 3, 6, 7);
    const vec4 yy = __builtin_shufflevector(h[1], h[1], 0, 1, 0, 1) +
                    __builtin_shufflevector(h[1], h[1], 2, 3, 2, 3);
    return __builtin_shufflevector(xz, yy, 0, 4, 2, 6) +
           __builtin_shufflevector(xz, yy, 1, 5, 3, 7);
#endif
}

INLINE shcd_vec3 to_vec3(const vec4 *v) {
    return shcd_vec3_make((*v)[0], (*v)[1], (*v)[2]);
}

/* ---- the point ---- */

INLINE void add_values(vec sum[3], const L_(strip) * s, power *now, power eighth) {
    UNROLL for (int k = 0; k < 3; k++) {
        sum[k] += s->a[k] * now->c + s->a[k + 3] * now->s;
    }
    *now = times(*now, eighth);
}

void NAME(point)(const shcdi_series *series, int degree, double x, double y, double z,
                 shcd_vec3 *out) {
    power now[STRIPS];
    vec sum[STRIPS][3];
    const power eighth = first_powers(x, y, now);
    int b = 0;
    UNROLL for (int k = 0; k < 3 * STRIPS; k++) {
        sum[k / 3][k % 3] = all(0.0);
    }
#if LANES == 8
    for (; 8 * b + 8 <= degree; b += 2) {
        const surface_rows rows = rows_of(series, b), next = rows_of(series, b + 1);
        strip8 s, t;
        run_two_blocks(&s, &t, &rows, &next, degree - 8 * b + 1, z, 1);
        add_values(sum[0], &s, now, eighth);
        add_values(sum[0], &t, now, eighth);
    }
#endif
    for (; 8 * b <= degree; b++) {
        const surface_rows rows = rows_of(series, b);
        UNROLL for (int h = 0; h < STRIPS; h++) {
            if (8 * b + h * LANES <= degree) {
                L_(strip) s;
                run_strip(&s, &rows, h * LANES, degree - 8 * b + 1, z, 1);
                add_values(sum[h], &s, &now[h], eighth);
            }
        }
    }
    const vec4 total = totals(sum[0], 3);
    *out = to_vec3(&total);
}

/* ---- derivatives ---- */

/* Lanes moved up by one and by two, filled from the strip before. */
INLINE vec shift_one(vec before, vec now) {
#if LANES == 8
    return __builtin_shufflevector(before, now, 7, 8, 9, 10, 11, 12, 13, 14);
#elif LANES == 4
    return __builtin_shufflevector(before, now, 3, 4, 5, 6);
#else
    return __builtin_shufflevector(before, now, 1, 2);
#endif
}
INLINE vec shift_two(vec before, vec now) {
#if LANES == 8
    return __builtin_shufflevector(before, now, 6, 7, 8, 9, 10, 11, 12, 13);
#elif LANES == 4
    return __builtin_shufflevector(before, now, 2, 3, 4, 5);
#else
    (void)now;
    return before;
#endif
}

/* Sums of value and gradient, then of the Hessian and the Laplacian; three coordinates each. */
enum { VALUE, G_X, G_Y, G_Z, H_XX, H_XY, H_XZ, H_YZ, LAPLACE, N_SUMS };

/* Also the first time something is added to zero: it decides the sign of a sum of zeros. */
#define ADD(n, term) sum[3 * (n) + k] = (is_first ? all(0.0) : sum[3 * (n) + k]) + (term)

INLINE void add_orders(vec sum[3 * N_SUMS], const L_(strip) * s, power now, power before, vec m,
                       int families, int is_first) {
    const vec c1 = m * shift_one(before.c, now.c), s1 = m * shift_one(before.s, now.s);
    const vec mm = m * (m - all(1.0));
    const vec c2 = mm * shift_two(before.c, now.c), s2 = mm * shift_two(before.s, now.s);
    UNROLL for (int k = 0; k < 3; k++) {
        const vec a = s->a[k], b = s->a[k + 3], da = s->a[k + 6], db = s->a[k + 9];
        ADD(VALUE, a * now.c + b * now.s);
        ADD(G_X, a * c1 + b * s1);
        ADD(G_Y, b * c1 - a * s1);
        ADD(G_Z, da * now.c + db * now.s);
        if (families > 2) {
            ADD(H_XX, a * c2 + b * s2);
            ADD(H_XY, b * c2 - a * s2);
            ADD(H_XZ, da * c1 + db * s1);
            ADD(H_YZ, db * c1 - da * s1);
            ADD(LAPLACE, s->a[k + 12] * now.c + s->a[k + 15] * now.s);
        }
    }
}

/* t1 = (-sin, cos, 0) and t2 = (-z cos, -z sin, r) of the longitude; at a pole any will do. */
typedef struct frame {
    double c, s, r;
} frame;

INLINE frame frame_of(shcd_vec3 w, shcdi_jet *jet) {
    const double r2 = w.x * w.x + w.y * w.y, r = sqrt(r2);
    const int is_pole = !(r2 > 1e-280); /* below, squares lose digits to underflow */
    const frame f = {is_pole ? 1.0 : w.x / r, is_pole ? 0.0 : w.y / r, r};
    jet->t1 = shcd_vec3_make(-f.s, f.c, 0.0);
    jet->t2 = shcd_vec3_make(-w.z * f.c, -w.z * f.s, r);
    return f;
}

/* What runs along the blocks: powers of zeta for each strip and for the strip before. */
typedef struct ladder {
    power now[STRIPS], before, eighth;
} ladder;

INLINE void add_block(const shcdi_series *series, int degree, int b, double z, int families,
                      ladder *powers, vec sum[STRIPS][3 * N_SUMS], int is_first) {
    const surface_rows rows = rows_of(series, b);
    for (int h = 0; h < STRIPS && (is_first || 8 * b + h * LANES <= degree); h++) {
        const vec m = load(lane_number + h * LANES) + all(8.0 * b);
        const power now = powers->now[h];
        L_(strip) s;
        run_strip(&s, &rows, h * LANES, degree - 8 * b + 1, z, families);
        add_orders(sum[h], &s, now, powers->before, m, families, is_first);
        powers->before = now;
        powers->now[h] = times(now, powers->eighth);
    }
}

/* The frame is made on the way, where its root and divisions overlap with the sums. */
INLINE frame cartesian_sums(const shcdi_series *series, int degree, shcd_vec3 w, int families,
                            shcdi_jet *jet, vec4 total[N_SUMS]) {
    const int n_sums = families > 2 ? N_SUMS : G_Z + 1;
    ladder powers;
    vec sum[STRIPS][3 * N_SUMS];
    powers.eighth = first_powers(w.x, w.y, powers.now);
    powers.before.c = powers.before.s = all(0.0);
    add_block(series, degree, 0, w.z, families, &powers, sum, 1);
    for (int b = 1; 8 * b <= degree; b++) {
        add_block(series, degree, b, w.z, families, &powers, sum, 0);
    }
    const frame f = frame_of(w, jet);
    UNROLL for (int n = 0; n < n_sums; n++) {
        total[n] = totals(sum[0] + 3 * n, 3 * N_SUMS);
    }
    return f;
}

INLINE void first_of(const vec4 t[N_SUMS], shcd_vec3 w, const frame *f, shcdi_jet *jet) {
    const vec4 s1 = t[G_Y] * f->c - t[G_X] * f->s;
    const vec4 s2 = t[G_Z] * f->r - (t[G_X] * f->c + t[G_Y] * f->s) * w.z;
    jet->s = to_vec3(&t[VALUE]);
    jet->s1 = to_vec3(&s1);
    jet->s2 = to_vec3(&s2);
}

void NAME(first)(const shcdi_series *series, int degree, double x, double y, double z,
                 shcdi_jet *jet) {
    const shcd_vec3 w = {x, y, z};
    vec4 t[N_SUMS];
    const frame f = cartesian_sums(series, degree, w, 2, jet, t);
    first_of(t, w, &f, jet);
}

void NAME(jet)(const shcdi_series *series, int degree, double x, double y, double z,
               shcdi_jet *jet) {
    const shcd_vec3 w = {x, y, z};
    vec4 t[N_SUMS];
    const frame f = cartesian_sums(series, degree, w, 3, jet, t);
    const double cc = f.c * f.c - f.s * f.s, ss = f.c * f.s + f.s * f.c;
    const vec4 radial = (t[G_X] * w.x + t[G_Y] * w.y) + t[G_Z] * w.z;
    const vec4 minus_s11 = (t[H_XX] * cc + t[H_XY] * ss) + radial, s11 = -minus_s11;
    const vec4 across = t[H_XY] * cc - t[H_XX] * ss;
    const vec4 s12 = (t[H_YZ] * f.c - t[H_XZ] * f.s) * f.r - across * w.z;
    const vec4 s22 = t[LAPLACE] + minus_s11;
    first_of(t, w, &f, jet);
    jet->s11 = to_vec3(&s11);
    jet->s12 = to_vec3(&s12);
    jet->s22 = to_vec3(&s22);
}

#include "model/norm_kernel.h"
#include "model/surface_batch.h"
