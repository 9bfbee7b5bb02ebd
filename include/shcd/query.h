/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  Distance queries of a point against one model, in the body frame.
 *
 *  Pure functions of their arguments: RT safe, and thread safe for distinct outputs.
 */
#ifndef SHCD_QUERY_H
#define SHCD_QUERY_H

#include "shcd/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Which answer is asked for, cheapest first. */
typedef enum shcd_tier {
    SHCD_TIER_EXACT = 0, /**< certified global closest point, to a tolerance */
    SHCD_TIER_FAST = 1,  /**< closest leaf, then Newton: an upper bound with a proven lower bound */
    SHCD_TIER_MAP = 2,   /**< depth along the ray from the centre; NOT a distance (see below) */
    /** Newton from the last answer: local, continuous, and never "the distance". For bodies of a
     *  scene and in cost tables; a query without a last answer (shcd_closest()) refuses it, see
     *  shcd_track(). */
    SHCD_TIER_TRACK = 3
} shcd_tier;

/** Bits of shcd_proximity::flags. */
typedef enum shcd_proximity_flag {
    /** A cap was reached before the interval met the tolerance; [lower, upper] is still true. */
    SHCD_PROXIMITY_TRUNCATED = 1u << 0,
    /** Inside or outside is not proven: the distance carries the sign seen at the closest point
     * found, and the interval covers both signs. Always so within the tolerance of the surface. */
    SHCD_PROXIMITY_SIGN_UNSURE = 1u << 1,
    /** Newton did not reach its stationarity test (singular point, or a flat basin). */
    SHCD_PROXIMITY_NOT_STATIONARY = 1u << 2,
    /** Map tier: neighbouring texels disagree in their crossings; nearest texel used. */
    SHCD_PROXIMITY_MAP_EDGE = 1u << 3,
    /** Map tier, always: distance is depth along the ray. The interval is still one of the true
     *  distance: its size is at most that to the nearest stored crossing. */
    SHCD_PROXIMITY_RADIAL = 1u << 4
} shcd_proximity_flag;

/** Result of a query. Frozen layout. */
typedef struct shcd_proximity {
    double distance_m; /**< signed distance, negative inside [m] */
    double lower_m;    /**< certified: lower_m <= true signed distance <= upper_m [m] */
    double upper_m;
    shcd_vec3 point_m;      /**< closest point on the surface, body frame [m] */
    shcd_vec3 normal;       /**< outward unit normal there */
    shcd_vec3 parameter;    /**< its parameter w, a unit vector */
    uint32_t flags;         /**< shcd_proximity_flag */
    uint32_t n_evaluations; /**< evaluations of the surface, with or without derivatives; a closed
                                 form counts as one */
    uint32_t n_patches;     /**< lower bounds computed; 16 that are computed at once count as one */
    uint32_t n_newton;      /**< Newton steps */
} shcd_proximity;

/** Options of a query. Start from SHCD_QUERY_OPTIONS_INIT; zero fields mean the defaults. */
typedef struct shcd_query_options {
    size_t struct_size;
    int32_t tier;             /**< a shcd_tier; 0: exact */
    int32_t map_hermite;      /**< map tier: 1: cubic Hermite look-up, 0: bilinear */
    double tolerance;         /**< upper - lower allowed, relative to max(diagonal, |d|); 0: 1e-9 */
    uint32_t patches_max;     /**< cap of n_patches; 0: SHCD_QUERY_PATCHES_DEFAULT */
    uint32_t evaluations_max; /**< cap of n_evaluations; 0: SHCD_QUERY_EVALUATIONS_DEFAULT */
} shcd_query_options;
#define SHCD_QUERY_OPTIONS_INIT                                                                    \
    { sizeof(shcd_query_options), 0, 0, 0.0, 0, 0 }
#define SHCD_QUERY_PATCHES_DEFAULT 400000u
#define SHCD_QUERY_EVALUATIONS_DEFAULT 100000u

/** Signed distance from a point to the surface, with the closest point and a proven interval.
 *
 *  Minimises |S(w) - p| over the unit sphere. exact: branch and bound over the patches of the
 *  model's tree (lower bound: distance to the flat leaf triangle minus its certified deviation;
 *  below the leaves a second-order Taylor bound about the patch centre), full Newton with clamped
 *  eigenvalues for the upper bound. The bounds are derived in libshcd/query/refine.c.
 *
 *  A body of degree 1 is an ellipsoid: both tiers are one root of a secular equation then, and the
 *  interval is as wide as rounding, some 1e-14 of the size (libshcd/query/ellipsoid.c).
 *
 *  Newton's method stops where the interval meets the tolerance, and one more step is taken along
 *  the surface's Taylor expansion: the distance is right within the interval, the closest point and
 *  its normal to the second order of that last step only. A smaller tolerance makes them better.
 *
 *  @param[in]  point    p, body frame [m], finite
 *  @param[in]  options  NULL: the defaults
 *  @param[out] out      untouched on failure
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE. A cap that is reached is SHCD_OK with
 *  SHCD_PROXIMITY_TRUNCATED. RT safe: at most about patches_max bounds and
 *  evaluations_max evaluations (0.3 to 2 us each at degree 15); a tick sets them lower.
 *
 *  Tier map: the distance is the depth along the ray from the map's centre through p to the nearest
 *  crossing; its sign is certain unless SIGN_UNSURE is set, its size is *not* the distance (rms 1-6
 * % of the diagonal off, see docs). */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_closest(const shcd_model *model, shcd_vec3 point,
                                                         const shcd_query_options *options,
                                                         shcd_proximity *out);

/** Follows a foot point from a previous parameter: Newton only, a local and continuous answer (the
 *  proxy of a god-object), never "the distance".
 *
 *  @param[in]  parameter  start, for instance `out->parameter` of the last tick; normalised first
 *  @param[out] out        distance (p - S).n sign included; lower_m and upper_m are -inf and +inf
 *                         (nothing global is known); flags may hold NOT_STATIONARY
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE. RT safe: at most 16 Newton steps. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_track(const shcd_model *model, shcd_vec3 point,
                                                       shcd_vec3 parameter, shcd_proximity *out);

#ifdef __cplusplus
}
#endif
#endif
