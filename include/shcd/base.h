/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  Types, status codes and real spherical harmonics: what every other header builds on.
 *
 *  Conventions of the whole library: SI units, right-handed frames, unit quaternions (w, x, y, z);
 *  `b_in_a` is the pose of frame b expressed in frame a; signed distance is negative inside a body;
 *  normals are outward unit normals of the body; a reported force acts on the tool.
 *
 *  An options, definition or info structure starts with `struct_size`. Fill it with its `_INIT`
 *  macro, which records the size the *caller* was compiled with; fields are only ever appended, so
 *  an old caller keeps working with a new library. A field left zero means its documented default.
 *  The layout of all other structures is frozen.
 */
#ifndef SHCD_BASE_H
#define SHCD_BASE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SHCD_VERSION_MAJOR 0
#define SHCD_VERSION_MINOR 1
#define SHCD_VERSION_PATCH 0
/** 10000 major + 100 minor + patch of these headers; compare with shcd_version(). */
#define SHCD_VERSION (SHCD_VERSION_MAJOR * 10000 + SHCD_VERSION_MINOR * 100 + SHCD_VERSION_PATCH)

#if defined(__GNUC__) || defined(__clang__)
#define SHCD_API __attribute__((visibility("default")))
#define SHCD_NODISCARD __attribute__((warn_unused_result))
#else
#define SHCD_API
#define SHCD_NODISCARD
#endif
/** Marks a function that is safe in a real-time tick: it never allocates, locks, prints or loops
 *  without a cap. */
#define SHCD_RT

/** Highest degree l of a spherical-harmonics series that the library accepts. */
#define SHCD_DEGREE_MAX 150

/** Initialiser of a structure of which only struct_size is to be set; the rest is zero. */
#ifdef __cplusplus
/* C++11 has no designated initialisers, and a short list draws -Wmissing-field-initializers. */
#define SHCD_SIZED_INIT(type)                                                                      \
    []() {                                                                                         \
        type all_zero = type();                                                                    \
        all_zero.struct_size = sizeof(type);                                                       \
        return all_zero;                                                                           \
    }()
#else
#define SHCD_SIZED_INIT(type)                                                                      \
    { .struct_size = sizeof(type) }
#endif

/** A point, in metres unless a name says otherwise, or a direction. */
typedef struct shcd_vec3 {
    double x, y, z;
} shcd_vec3;

/** Rotation as a unit quaternion, w first. */
typedef struct shcd_quat {
    double w, x, y, z;
} shcd_quat;

/** Pose of a frame: p_outer = position_m + R(orientation) p_inner. */
typedef struct shcd_pose {
    shcd_vec3 position_m;
    shcd_quat orientation;
} shcd_pose;

/** Force [N] and torque [N m]; the frame and the reference point are stated where it is used. */
typedef struct shcd_wrench {
    shcd_vec3 force_n;
    shcd_vec3 torque_n_m;
} shcd_wrench;

/** What every function that can fail returns; 0 is success, errors are negative. */
typedef enum shcd_status {
    SHCD_OK = 0,
    SHCD_ERR_ARGUMENT = -1,   /**< a null pointer, a value out of range, a size that does not fit */
    SHCD_ERR_MEMORY = -2,     /**< the allocator returned null */
    SHCD_ERR_FORMAT = -3,     /**< bytes that are not what they should be */
    SHCD_ERR_IO = -4,         /**< a file could not be read or written */
    SHCD_ERR_NOT_FINITE = -5, /**< a NaN or an infinity in numeric input */
    SHCD_ERR_GEOMETRY = -6,   /**< a shape that cannot be a body; the message says why and where */
    SHCD_ERR_CONVERGENCE = -7, /**< an iteration reached its cap without an admissible result */
    SHCD_ERR_UNSUPPORTED = -8, /**< valid, but not in this build or version */
    SHCD_ERR_CANCELLED = -9    /**< the caller's progress callback asked to stop */
} shcd_status;

/** Caller-owned error text; every function that takes one accepts NULL. Written on failure only. */
typedef struct shcd_error {
    shcd_status status;
    char message[252];
} shcd_error;

/** Memory source of one object. NULL where a `const shcd_allocator *` is expected means malloc and
 *  free. `allocate` returns memory aligned like malloc's, or NULL. */
typedef struct shcd_allocator {
    void *(*allocate)(size_t size, void *user);
    void (*release)(void *memory, void *user);
    void *user;
} shcd_allocator;

/** SHCD_VERSION of the library that is loaded. RT safe. */
SHCD_API SHCD_RT uint32_t shcd_version(void);

/** Short English text of a status; never NULL. RT safe. */
SHCD_API SHCD_RT const char *shcd_status_string(shcd_status status);

/** Index i = l^2 + l + m of Y_lm in every coefficient array, |m| <= l. */
#define SHCD_INDEX(l, m) ((size_t)(l) * (size_t)(l) + (size_t)((l) + (m)))
/** Number of harmonics up to a degree: (degree + 1)^2. */
#define SHCD_COUNT(degree) (((size_t)(degree) + 1) * ((size_t)(degree) + 1))

/** Evaluates all real spherical harmonics up to a degree at one direction.
 *
 *  Orthonormal on the unit sphere, without the Condon-Shortley phase:
 *  Y_l0 = K_l0 P_l(z); for m > 0, Y_lm = sqrt(2) K_lm P_lm cos(m phi) and
 *  Y_l,-m = sqrt(2) K_lm P_lm sin(m phi), K_lm^2 = (2l+1)/(4 pi) (l-m)!/(l+m)!.
 *  Evaluated from (x, y, z) as polynomials: no pole, no division by sin(theta), no trigonometry.
 *
 *  @param[in]  degree     highest l, 0 .. SHCD_DEGREE_MAX
 *  @param[in]  direction  finite and not zero; it is normalised first
 *  @param[out] y          (degree+1)^2 values, or NULL
 *  @param[out] gradient   3 per harmonic, the tangential gradient (orthogonal to the direction), or
 *                         NULL
 *  @param[out] hessian    6 per harmonic (xx, xy, xz, yy, yz, zz), the covariant Hessian on the
 * unit sphere: H direction = 0, and v.H.v is the second derivative along the great circle that
 * leaves the direction with unit tangent v; or NULL
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE; nothing is written on failure.
 *
 *  Accuracy: absolute error over sqrt((2l+1)/(4 pi)) <= 1e-13 for values, times l for gradients,
 *  times l^2 for Hessians, up to degree 150 (tests/unit/test_harmonics.c). RT safe; thread safe.
 */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_harmonics(int degree, shcd_vec3 direction,
                                                           double *y, double *gradient,
                                                           double *hessian);

/** Converts real coefficients to the complex a_lm of the orthonormal basis *with* the
 *  Condon-Shortley phase (the convention of SPHARM papers).
 *
 *  For f = sum c_lm Y_lm (this library) = sum a_lm Y_l^m (complex):
 *  a_l0 = c_l0, a_lm = (-1)^m (c_lm - i c_l,-m)/sqrt(2) for m > 0, a_l,-m = (-1)^m conj(a_lm).
 *
 *  @param[in]  degree   0 .. SHCD_DEGREE_MAX
 *  @param[in]  real     (degree+1)^2 values, stride apart
 *  @param[in]  stride   distance between values, >= 1 (3 for one coordinate of a model)
 *  @param[out] complex_re_im  2 (degree+1)^2 values, (re, im) pairs, index l^2+l+m
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT. Exact up to one rounding. RT safe; thread safe.
 */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_coefficients_to_complex(int degree,
                                                                         const double *real,
                                                                         size_t stride,
                                                                         double *complex_re_im);

/** Inverse of shcd_coefficients_to_complex() for a real function: reads m >= 0 only.
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT. RT safe; thread safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_coefficients_from_complex(
    int degree, const double *complex_re_im, double *real, size_t stride);

#ifdef __cplusplus
}
#endif
#endif
