/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  Body against body: the gap between two surfaces, both possibly deformed.
 *
 *  Pure functions of their arguments: RT safe, and thread safe for distinct outputs.
 */
#ifndef SHCD_PAIR_H
#define SHCD_PAIR_H

#include "shcd/shape.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Bits of shcd_pair_proximity::flags; those of shcd_proximity_flag mean what they mean there. */
typedef enum shcd_pair_flag {
    /** A point of one body is proven inside the other; gap_m is minus a depth (see below). */
    SHCD_PAIR_OVERLAP = 1u << 8
} shcd_pair_flag;

/** Options of shcd_pair_closest(). Start from SHCD_PAIR_OPTIONS_INIT; zero means the default. */
typedef struct shcd_pair_options {
    size_t struct_size;
    /** upper - lower allowed where separated, relative to the larger diagonal; 0: 1e-6. At least
     *  1e-8. */
    double tolerance;
    uint32_t patches_max;     /**< cap of n_patches; 0: SHCD_PAIR_PATCHES_DEFAULT */
    uint32_t evaluations_max; /**< cap of n_evaluations; 0: SHCD_PAIR_EVALUATIONS_DEFAULT */
} shcd_pair_options;
#define SHCD_PAIR_OPTIONS_INIT SHCD_SIZED_INIT(shcd_pair_options)
#define SHCD_PAIR_PATCHES_DEFAULT 4000000u
#define SHCD_PAIR_EVALUATIONS_DEFAULT 200000u

/** Result of a query of one body against another. Frame of body a. Frozen layout. */
typedef struct shcd_pair_proximity {
    double gap_m;   /**< distance between the surfaces, or minus the depth of the overlap */
    double lower_m; /**< lower_m <= true gap <= upper_m */
    double upper_m;
    shcd_vec3 point_a_m; /**< the pair of points where gap_m is attained */
    shcd_vec3 point_b_m;
    shcd_vec3 normal_a; /**< outward unit normals of the two surfaces there */
    shcd_vec3 normal_b;
    shcd_vec3 parameter_a; /**< their parameters, each in its own body */
    shcd_vec3 parameter_b;
    uint32_t flags;         /**< shcd_proximity_flag and shcd_pair_flag */
    uint32_t n_evaluations; /**< of either surface */
    uint32_t n_patches;     /**< bounds of blocks, leaves and patches, and of pairs of them */
    uint32_t n_newton;
    uint64_t reserved[4]; /**< zero */
} shcd_pair_proximity;

/** Gap between two bodies.
 *
 *  Separated: min over (w_a, w_b) of |S_a(w_a) - T S_b(w_b)|, T = b_in_a, with a proven interval of
 *  at most the tolerance. Branch and bound over pairs of patches; near the closest pair a sphere
 *  that separates the two surfaces takes the place of pairs. The bounds are derived in
 *  libshcd/query/pair_lower.c and pair_separator.c.
 *
 *  Overlapping (SHCD_PAIR_OVERLAP: a point of one surface is proven inside the other body): the gap
 *  is minus the larger of two depths, that of the points of a's surface inside b and that of the
 *  points of b's surface inside a, the depth of a point being its distance to the other surface. It
 *  is sought by sampling and ascent, so gap_m and upper_m are proven upper bounds of the gap, while
 *  lower_m is only what the enclosing balls say: no point is deeper in a body than its radius. The
 *  pair is the deepest point found and its closest point on the other surface.
 *
 *  Neither (the surfaces are closer than rounding and signs can tell): SIGN_UNSURE, and an interval
 *  that covers both.
 *
 *  Swapping the bodies (and inverting the pose) gives the same gap within the tolerance.
 *
 *  @param[in]  shape_a, shape_b  NULL: the rest shapes
 *  @param[in]  b_in_a            pose of b's frame in a's, unit quaternion
 *  @param[in]  options           NULL: the defaults
 *  @param[out] out               untouched on failure
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE. A cap that is reached is SHCD_OK with
 *  SHCD_PROXIMITY_TRUNCATED. RT safe: about 150 KB of stack. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status
shcd_pair_closest(const shcd_model *model_a, const shcd_shape *shape_a, const shcd_model *model_b,
                  const shcd_shape *shape_b, shcd_pose b_in_a, const shcd_pair_options *options,
                  shcd_pair_proximity *out);

#ifdef __cplusplus
}
#endif
#endif
