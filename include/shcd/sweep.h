/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  First contact within a tick: a tool that moves, turns, and meets a body that deforms.
 *
 *  At 1 kHz a tool of 1 mm crosses a body 2 mm thick between two ticks; asking for the distance at
 *  the ends of the tick cannot see it. A sweep proves the gap positive from the start of the tick
 * up to a time, so that nothing is tunnelled.
 */
#ifndef SHCD_SWEEP_H
#define SHCD_SWEEP_H

#include "shcd/tool.h"

#ifdef __cplusplus
extern "C" {
#endif

/** How a sweep ended. */
typedef enum shcd_sweep_outcome {
    SHCD_SWEEP_SEPARATED = 0,        /**< no contact during the whole tick: proven */
    SHCD_SWEEP_CONTACT = 1,          /**< at `time`, 0 < gap <= tolerance_m is proven */
    SHCD_SWEEP_OVERLAP_AT_START = 2, /**< not proven separated at the start; time is 0 */
    SHCD_SWEEP_TRUNCATED = 3         /**< a cap was reached; separation is proven up to `time` */
} shcd_sweep_outcome;

/** Most steps of a sweep unless it says otherwise. */
#define SHCD_SWEEP_STEPS_DEFAULT 512u

/** A motion within one tick, time t from 0 to 1. Start from SHCD_SWEEP_DEF_INIT; fields left zero
 *  mean the defaults.
 *
 *  The path is part of the definition, in the body frame:
 *    position    p(t) = (1 - t) p_0 + t p_1
 *    orientation q(t) = u/|u|, u = (1 - t) q_0 + t q_1 (q_1 with the sign that makes q_0 . q_1 >=
 * 0): the shorter turn, about a fixed axis. Its speed is not constant: at most 4 |q_1 - q_0|/|q_1 +
 * q_0| per unit of t, which exceeds the mean by 0.3 % for a turn of 20 degrees and by 27 % for half
 * a turn body        c(t) = (1 - t) c_0 + t c_1, c_0 the coefficients of `shape` */
typedef struct shcd_sweep_def {
    size_t struct_size;
    const shcd_tool_geometry *tool; /**< NULL: a sphere of radius_m; no shell */
    double radius_m;                /**< without a tool: 0 is a point */
    /** What counts as contact; 0: 1e-5 of the body's diagonal. At least 1e-8 of it. */
    double tolerance_m;
    shcd_pose from;                /**< the tool's frame in the body frame at t = 0 */
    shcd_pose to;                  /**< and at t = 1; unit quaternions */
    const shcd_shape *shape;       /**< the body at t = 0; NULL: the rest shape */
    const double *coefficients_to; /**< its coefficients at t = 1; NULL: it does not deform */
    uint32_t steps_max;            /**< 0: SHCD_SWEEP_STEPS_DEFAULT */
    uint32_t evaluations_max;      /**< of the surface, in all; 0: SHCD_QUERY_EVALUATIONS_DEFAULT */
} shcd_sweep_def;
#define SHCD_SWEEP_DEF_INIT SHCD_SIZED_INIT(shcd_sweep_def)

/** Result of a sweep. Body frame. Frozen layout. */
typedef struct shcd_sweep_result {
    /** In [0, 1]: the gap is proven positive on [0, time], and at its end unless the outcome is
     *  OVERLAP_AT_START. */
    double time;
    double lower_m; /**< lower_m <= gap at `time` <= upper_m */
    double upper_m;
    shcd_pose tool_in_body; /**< at `time` */
    /** Where the gap was attained at the last query, which after CONTACT and OVERLAP_AT_START was
     *  at `time`: of the tool, of the surface, outward unit normal, parameter w. Of a convex tool
     *  that is too far away to touch, merely a pair of points on the near sides; upper_m is its
     *  distance. */
    shcd_vec3 tool_point_m;
    shcd_vec3 point_m;
    shcd_vec3 normal;
    shcd_vec3 parameter;
    int32_t outcome;        /**< a shcd_sweep_outcome */
    uint32_t n_steps;       /**< advances of the proven time */
    uint32_t n_queries;     /**< distance queries */
    uint32_t n_evaluations; /**< as in shcd_proximity, over all of them */
    uint32_t n_patches;
    uint32_t n_newton;
    uint64_t reserved[4]; /**< zero */
} shcd_sweep_result;

/** Bytes of scratch that a sweep over a deforming body needs; 0 for NULL. RT safe. */
SHCD_API SHCD_RT size_t shcd_sweep_scratch_size(const shcd_model *model);

/** First time at which 0 < gap <= tolerance_m is proven, or that there is none during the tick.
 *
 *  Conservative advancement: the gap changes by at most V = |p_1 - p_0| + Omega rho + B_0(c_1 -
 * c_0) per unit of t (Omega as above, rho the reach of the tool about its origin, B_0 of
 *  shcd_shape_set()), so a certified gap g at t proves [t - g/V, t + g/V] free. For points and
 *  spheres, where that is slow (grazing), the times at which the tool may meet each patch of the
 *  surface: libshcd/query/sweep_patches.c. The reported *time* is at most that of the true contact;
 *  how much earlier is bounded in the gap (tolerance_m), not in time: a tool that grazes may be
 *  within tolerance_m for long.
 *
 *  @param[in] scratch       shcd_sweep_scratch_size() bytes aligned to 16; NULL without
 *                           coefficients_to
 *  @param[out] out          untouched on failure
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE, SHCD_ERR_UNSUPPORTED (shell). A cap
 * that is reached is SHCD_OK with SHCD_SWEEP_TRUNCATED. RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_sweep(const shcd_model *model,
                                                       const shcd_sweep_def *motion, void *scratch,
                                                       size_t scratch_size, shcd_sweep_result *out);

#ifdef __cplusplus
}
#endif
#endif
