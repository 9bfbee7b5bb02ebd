/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  Accuracy as a setting with a price: which of the measured ways to answer meets a tolerance and a
 *  budget. And detection in stages, coarse before fine.
 */
#ifndef SHCD_ACCURACY_H
#define SHCD_ACCURACY_H

#include "shcd/shape.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- choosing from a cost table -------------------------------------------------------------- */

/** Bit of a tier in shcd_accuracy_request::tiers. */
#define SHCD_TIER_BIT(tier) (1u << (tier))

/** What is asked for. Start from SHCD_ACCURACY_REQUEST_INIT; zero fields mean the defaults. */
typedef struct shcd_accuracy_request {
    size_t struct_size;
    double tolerance_m; /**< a row's error_max_m + extra_error_m may be this; 0: not limited [m] */
    double budget_us;   /**< n_queries times a row's ns_p99 may be this; 0: not limited [us] */
    /** Added to the error of every row: shcd_fit_record::hausdorff_error_m where the tolerance is
     *  meant against the mesh that the model was fitted to; 0 where it is meant against the model's
     *  own surface [m]. */
    double extra_error_m;
    /** Rows whose normal_p99_rad exceeds it are not considered [rad]; 0:
     *  SHCD_ACCURACY_NORMAL_DEFAULT_RAD. A force with a wrong direction is wrong, however right the
     *  depth. */
    double normal_max_rad;
    uint32_t n_queries; /**< that share the budget: the tools of a scene; 0: 1 */
    uint32_t tiers;     /**< SHCD_TIER_BIT of those that are considered; 0: all */
} shcd_accuracy_request;
#define SHCD_ACCURACY_REQUEST_INIT SHCD_SIZED_INIT(shcd_accuracy_request)

/** 0.3 rad, 17 degrees: an error in the direction of a force that hands tell apart only when they
 *  compare two forces with care. */
#define SHCD_ACCURACY_NORMAL_DEFAULT_RAD 0.3

/** A row and what it comes to. Frozen layout. */
typedef struct shcd_accuracy_pair {
    size_t row;     /**< index in the table */
    double error_m; /**< its error_max_m + extra_error_m */
    double time_us; /**< n_queries times its ns_p99 */
} shcd_accuracy_pair;

/** Picks a row of a cost table.
 *
 *  With a tolerance: the fastest row (smallest ns_p99) among those that meet everything asked. With
 *  a budget alone: the most accurate (smallest error_max_m). Ties go to the other figure, then to
 *  the earlier row. With neither: the most accurate. The figures are measured, not proven; what is
 *  proven is the interval in each answer.
 *
 *  @param[out] choice   the row; untouched on failure
 *  @param[out] nearest  NULL, or two pairs, written in both cases as long as any row was
 * considered: [0] the fastest row that meets the tolerance, or the most accurate if none does; [1]
 * the most accurate row that fits the budget, or the fastest if none does
 *  @param[out] error    may be NULL
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (no rows, a negative value), SHCD_ERR_NOT_FINITE,
 *  SHCD_ERR_UNSUPPORTED: nothing meets the request; the message names both nearest pairs, rounded
 * up so that asking for either of them succeeds. Does not allocate; not RT safe, since it
 * words its refusals. */
SHCD_API SHCD_NODISCARD shcd_status shcd_accuracy_choose(const shcd_cost_row *rows, size_t n_rows,
                                                         const shcd_accuracy_request *request,
                                                         shcd_accuracy_pair *choice,
                                                         shcd_accuracy_pair nearest[2],
                                                         shcd_error *error);

/* ---- detection in stages --------------------------------------------------------------------- */

/** Where a detection ended, cheapest first. */
typedef enum shcd_stage {
    SHCD_STAGE_BALL = 0,       /**< the certified enclosing ball */
    SHCD_STAGE_LOW_DEGREE = 1, /**< the surface of degree 1, inflated by its certified offset */
    SHCD_STAGE_SEED = 2,       /**< one point of the surface, at the parameter that was given */
    SHCD_STAGE_SEARCH = 3,     /**< the certified search at the model's degree */
    SHCD_N_STAGES = 4
} shcd_stage;

/** Options of shcd_detect(). Start from SHCD_DETECT_OPTIONS_INIT; zero fields mean the defaults. */
typedef struct shcd_detect_options {
    size_t struct_size;
    shcd_vec3 seed; /**< parameter near the closest point, e.g. that of the last tick; 0: none */
    shcd_certificate *certificate; /**< for the search, see shcd_closest_next(); NULL: none */
    uint32_t
        skipped; /**< bits 1 << shcd_stage of those to leave out; the search is never left out */
    uint32_t reserved0;       /**< zero */
    double tolerance;         /**< of the search, as in shcd_query_options */
    uint32_t patches_max;     /**< of the search, likewise */
    uint32_t evaluations_max; /**< of the search, likewise */
} shcd_detect_options;
#define SHCD_DETECT_OPTIONS_INIT SHCD_SIZED_INIT(shcd_detect_options)

/** Result of shcd_detect(). Frozen layout. */
typedef struct shcd_detection {
    /** 1: the signed distance is at most the reach; 0: it is larger. Proven where the reach is not
     *  in [lower_m, upper_m); else what the distance found by the search says. */
    int32_t is_within;
    int32_t stage;  /**< a shcd_stage: the one that decided */
    double lower_m; /**< certified: lower_m <= signed distance <= upper_m, as far as that stage
                         knows [m]; -inf, +inf: nothing */
    double upper_m;
    shcd_vec3 parameter; /**< of the closest point where a search was made, else the seed */
    uint32_t flags;      /**< shcd_proximity_flag of the search */
    uint32_t n_evaluations;
    uint32_t n_patches;
    uint32_t n_newton;
    uint64_t reserved[2]; /**< zero */
} shcd_detection;

/** Whether a point is within reach of the body: signed distance <= reach_m. A sphere of that radius
 *  about the point touches the body then.
 *
 *  Coarse before fine, each stage certified: a distance to the enclosing ball; planes that separate
 *  the point from the surface of degree 1, an ellipsoid, inflated by shcd_model_enclosure_offset()
 *  and by the displacement; one evaluation of the surface, which bounds the distance from above;
 * the search. Which share of a tool's path ends where, and what that saves, prints
 *  tests/bench/bench_stages.
 *
 *  @param[in]  shape    NULL: the rest shape
 *  @param[in]  point    body frame, finite
 *  @param[in]  reach_m  finite, >= 0
 *  @param[in]  options  NULL: the defaults
 *  @param[out] out      untouched on failure
 *  @return as shcd_closest(). RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_detect(const shcd_model *model,
                                                        const shcd_shape *shape, shcd_vec3 point,
                                                        double reach_m,
                                                        const shcd_detect_options *options,
                                                        shcd_detection *out);

#ifdef __cplusplus
}
#endif
#endif
