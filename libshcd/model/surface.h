/* SPDX-License-Identifier: BSD-3-Clause */
/* Evaluation of S(w) = sum_i c_i Y_i(w), c_i in R^3, and of its derivatives on the unit sphere. The
 * only place that knows how coefficients are laid out for evaluation.
 *
 * There are several compiled paths; all do the same IEEE operations in the same order and give the
 * same bits. */
#ifndef SHCDI_MODEL_SURFACE_H
#define SHCDI_MODEL_SURFACE_H

#include "base/internal.h"
#include "shcd/model.h"

/** A series ready for evaluation. Both tables are fastest when aligned to 64 bytes, and need not be
 *  aligned beyond what a double needs. */
typedef struct shcdi_series {
    int degree;
    const double *recurrence; /**< constants: shcdi_recurrence_fill() */
    const double *packed;     /**< coefficients: shcdi_pack() */
    int simd;                 /**< a shcd_simd that this processor has; 0: portable */
} shcdi_series;

/** Doubles that shcdi_recurrence_fill() and shcdi_pack() fill. */
size_t shcdi_recurrence_size(int degree);
size_t shcdi_packed_size(int degree);

void shcdi_recurrence_fill(int degree, double *recurrence);

/** From the public order, 3 (degree+1)^2 values, to the packed one. RT safe. */
void shcdi_pack(int degree, const double *coefficients, double *packed);

/** shcdi_pack() with the constants of a series of that degree at hand: the same bits, faster. RT
 *  safe. */
void shcdi_pack_for(const shcdi_series *series, const double *coefficients, double *packed);

/** The fastest path of this processor for SHCD_SIMD_AUTO; a path that it has, or that is not known
 *  at all, as it is; 0 for one that it does not have. Not RT safe. */
int shcdi_simd_choose(int wanted);

/** Value and derivatives along a tangent frame of w (t1 x t2 = w; t1 is horizontal, t2 points to
 * the north, at the poles t1 = (0, 1, 0)): first derivatives s1, s2 and covariant second
 * derivatives s11, s12, s22, so that along the great circle that leaves w with direction v = v1 t1
 * + v2 t2 the derivative is v1 s1 + v2 s2 and the second derivative is v1^2 s11 + 2 v1 v2 s12 +
 * v2^2 s22. */
typedef struct shcdi_jet {
    shcd_vec3 t1, t2;
    shcd_vec3 s, s1, s2, s11, s12, s22;
} shcdi_jet;

/** Factors for shcdi_norms(), from a series' constants. */
const double *shcdi_series_factors(const shcdi_series *series);

/** Weight of degree l in the bound of the rounding of an evaluation, [roundings] per bound of the
 *  degree. */
static inline double shcdi_evaluation_weight(int degree, int l) {
    return 2.2e-16 * (l * (l + 1.0) + 2.0 * (degree + 1) + 20.0);
}

/** Places as whole numbers: (S - origin) factor, truncated. */
typedef struct shcdi_lattice {
    shcd_vec3 origin;
    double factor; /**< so small that all of them lie within 2^31 */
    size_t stride; /**< of one coordinate of one image; a multiple of 8 */
} shcdi_lattice;

/* ---- the compiled paths (surface_kernel.h); w by coordinates, which stay in registers ---- */

#define SHCDI_DECLARE_PATH(suffix)                                                                 \
    void shcdi_point_##suffix(const shcdi_series *series, int degree, double x, double y,          \
                              double z, shcd_vec3 *s);                                             \
    void shcdi_first_##suffix(const shcdi_series *series, int degree, double x, double y,          \
                              double z, shcdi_jet *jet);                                           \
    void shcdi_jet_##suffix(const shcdi_series *series, int degree, double x, double y, double z,  \
                            shcdi_jet *jet);                                                       \
    void shcdi_partial_##suffix(const shcdi_series *series, double x, double y, double z,          \
                                shcd_vec3 *sum);                                                   \
    void shcdi_points_##suffix(const shcdi_series *series, int degree, const shcd_vec3 *w,         \
                               size_t n, shcd_vec3 *out);                                          \
    void shcdi_images_##suffix(const shcdi_series *series, const shcd_vec3 *w, size_t n,           \
                               shcd_vec3 *out);                                                    \
    void shcdi_lattice_##suffix(const shcdi_series *series, const shcdi_lattice *lattice,          \
                                const shcd_vec3 *w, size_t n, int32_t *out);                       \
    void shcdi_squares_##suffix(int degree, const double *a, const double *b, double *square);

/* A switch, not pointers in the series: what a tick can call stays visible, and a series holds no
 * addresses of code. */
SHCDI_DECLARE_PATH(portable)
#ifdef __x86_64__
SHCDI_DECLARE_PATH(avx2)
SHCDI_DECLARE_PATH(avx512)
void shcdi_pack_rows_avx512(int degree, const double *coefficients, const double *scale,
                            double *packed);
#define SHCDI_ON_PATH(simd, name, ...)                                                             \
    switch (simd) {                                                                                \
    case SHCD_SIMD_AVX512:                                                                         \
        shcdi_##name##_avx512(__VA_ARGS__);                                                        \
        break;                                                                                     \
    case SHCD_SIMD_AVX2:                                                                           \
        shcdi_##name##_avx2(__VA_ARGS__);                                                          \
        break;                                                                                     \
    default:                                                                                       \
        shcdi_##name##_portable(__VA_ARGS__);                                                      \
        break;                                                                                     \
    }
#else
#define SHCDI_ON_PATH(simd, name, ...) shcdi_##name##_portable(__VA_ARGS__);
#endif

/** square[l], l = 0 .. degree: sum of squared differences of degree l's 3 (2l+1) coefficients. RT
 *  safe. */
static inline void shcdi_surface_squares(int simd, int degree, const double *a, const double *b,
                                         double *square) {
    SHCDI_ON_PATH(simd, squares, degree, a, b, square)
}

/** S(w) truncated at `degree` <= series degree; w a unit vector. RT safe. */
static inline shcd_vec3 shcdi_surface_point(const shcdi_series *series, int degree, shcd_vec3 w) {
    shcd_vec3 s;
    SHCDI_ON_PATH(series->simd, point, series, degree, w.x, w.y, w.z, &s)
    return s;
}

/** S, first and second derivatives. RT safe. */
static inline void shcdi_surface_jet(const shcdi_series *series, int degree, shcd_vec3 w,
                                     shcdi_jet *jet) {
    SHCDI_ON_PATH(series->simd, jet, series, degree, w.x, w.y, w.z, jet)
}

/** Fills t1, t2, s, s1, s2 of `jet` and leaves the rest, with the bits of shcdi_surface_jet(). RT
 *  safe. */
static inline void shcdi_surface_first(const shcdi_series *series, int degree, shcd_vec3 w,
                                       shcdi_jet *jet) {
    SHCDI_ON_PATH(series->simd, first, series, degree, w.x, w.y, w.z, jet)
}

/** All partial sums: sum[d] is S truncated at d, d = 0 .. series degree, with the bits of
 *  shcdi_surface_point(). RT safe. */
static inline void shcdi_surface_partial(const shcdi_series *series, shcd_vec3 w, shcd_vec3 *sum) {
    SHCDI_ON_PATH(series->simd, partial, series, w.x, w.y, w.z, sum)
}

/** out[i] = shcdi_surface_point(series, degree, w[i]), the same bits, in less time. RT safe. */
static inline void shcdi_surface_points(const shcdi_series *series, int degree, const shcd_vec3 *w,
                                        size_t n, shcd_vec3 *out) {
    SHCDI_ON_PATH(series->simd, points, series, degree, w, n, out)
}

/** S at the 16 mirror images of each direction: out[image * n + i], image = 8 (x and y exchanged,
 * at first) + 1 (x negated) + 2 (y negated) + 4 (z negated), image 0 is w[i] itself. Rounded
 * otherwise than single points (parities are summed apart), within the same bound. RT safe. */
static inline void shcdi_surface_images(const shcdi_series *series, const shcd_vec3 *w, size_t n,
                                        shcd_vec3 *out) {
    SHCDI_ON_PATH(series->simd, images, series, w, n, out)
}

/** The same on a lattice: coordinate k of image s of w[i] is out[(16 k + s) stride + i]; n is
 *  filled up to a multiple of 8 at most. RT safe. */
static inline void shcdi_surface_lattice(const shcdi_series *series, const shcdi_lattice *lattice,
                                         const shcd_vec3 *w, size_t n, int32_t *out) {
    SHCDI_ON_PATH(series->simd, lattice, series, lattice, w, n, out)
}

#endif
