/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  The learned static response of a body: the energy of an indentation as a small network.
 *
 *  U(x, depth) [J] is the energy that it takes to press the body in by a depth [m] at a point x of
 *  its rest surface. The force is its gradient, so that no closed path yields or takes energy:
 *  dU/d depth along the inward normal and dU/dx along the surface. The offline shcd_train() makes
 *  networks (shcd/fit.h); docs/learned.md has the formulas and the errors.
 */
#ifndef SHCD_LEARNED_H
#define SHCD_LEARNED_H

#include "shcd/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Most centres and most terms in the depth of a network. */
#define SHCD_LEARNED_CENTRES_MAX 400
#define SHCD_LEARNED_TERMS_MAX 8

/** Where the training data came from. */
typedef enum shcd_learned_source {
    SHCD_LEARNED_MEMBRANE = 0, /**< the built-in stiffening membrane */
    SHCD_LEARNED_SAMPLES = 1   /**< a table of the user's */
} shcd_learned_source;

/** How a network was trained and what it errs by. Errors are those of samples that the training did
 *  not see. Frozen layout. */
typedef struct shcd_learned_record {
    int32_t source; /**< a shcd_learned_source */
    int32_t reserved0;
    uint64_t n_samples;       /**< that it was trained on */
    uint64_t n_holdout;       /**< that it was tested on */
    double force_error_max_n; /**< of dU/d depth [N] */
    double force_error_p99_n;
    double force_error_rms_n;
    double force_rms_n;       /**< rms of the tested forces themselves [N] */
    double slope_error_max_n; /**< of dU/dx along the surface [N]; 0: not tested */
    double slope_error_rms_n;
    /** Of the dent: for each sample the largest error anywhere on the surface [m]. 0: not tested */
    double dent_error_max_m;
    double dent_error_p99_m;
    double dent_error_rms_m;
    /** Table with energies and forces: rms of force - d energy/d depth as a network that is a
     *  potential can have it, see shcd_train() [N]; else 0 */
    double consistency_rms_n;
    double ridge; /**< chosen by cross-validation, relative */
    double
        quadrature_error; /**< of the membrane's energy when the quadrature is doubled, relative */
    double stiffness_min_n_per_m; /**< smallest 2 U/depth^2 that was found in the domain */
    double stiffness_max_n_per_m; /**< largest */
    double reserved[2];           /**< zero */
} shcd_learned_record;

/** A network. Frozen layout.
 *
 *  U(x, depth) = depth^2/2 k(x, depth), k = sum_p T_p(t) (a_0p + sum_j a_jp psi(|x -
 * x_j|/support)), T_p Chebyshev's polynomials, t = 2 depth/depth_max - 1, and Wendland's psi(r) =
 * (1 - r)^6 (35 r^2 + 18 r + 3)/3 for r < 1, else 0. Beyond depth_max U goes on with the slope that
 * it has there and the stiffness direct_n_per_m; away from the centres it turns into direct_n_per_m
 * depth^2/2. */
typedef struct shcd_learned {
    size_t n_centres;             /**< 1 .. SHCD_LEARNED_CENTRES_MAX */
    size_t n_terms;               /**< 1 .. SHCD_LEARNED_TERMS_MAX */
    size_t n_modes;               /**< of the dents: 0, or the first so many of the model's modes */
    const double *centre_m;       /**< x_j, 3 each, on the rest surface [m] */
    const double *weight_n_per_m; /**< n_centres + 1 rows of n_terms: a_0p, then the a_jp [N/m] */
    const double *dent_m3_per_n;  /**< n_modes rows of n_terms, see shcd_learned_dent() */
    double support_m;             /**< radius of psi [m] */
    double fill_m;                /**< every point of the domain is this close to a centre [m] */
    double depth_max_m;           /**< [m] */
    double direct_n_per_m;        /**< of the direct model outside of the domain [N/m] */
    /** Force for each depth and speed of going in, [N s/m^2]: F = dU/d depth + this depth speed.
     *  From a table with speeds; else 0. Not part of U. */
    double damping_n_s_per_m2;
    /* what the training data were computed with; 0 where a table was given */
    double young_pa;            /**< E [Pa] */
    double poisson_ratio;       /**< nu */
    double patch_radius_m;      /**< a [m] */
    double support_length_m;    /**< l [m] */
    double thickness_m;         /**< h [m] */
    double foundation_n_per_m3; /**< kappa [N/m^3] */
    double stiffening;          /**< beta; 0: linear */
    shcd_learned_record record;
} shcd_learned;

/** Bits of shcd_learned_output::flags: the sample is outside of what the network was trained on. */
typedef enum shcd_learned_flag {
    SHCD_LEARNED_DEEP = 1u << 0, /**< depth > depth_max_m: continued with the direct stiffness */
    SHCD_LEARNED_FAR = 1u << 1   /**< away from the centres: direct_share > 0 */
} shcd_learned_flag;

/** What a network says. Frozen layout. */
typedef struct shcd_learned_output {
    double energy_j;          /**< U */
    double force_n;           /**< dU/d depth */
    double stiffness_n_per_m; /**< d^2 U/d depth^2 */
    /** dU/dx at constant depth as a function in space; its part along the surface is what counts
     *  [N], body frame */
    shcd_vec3 slope_n;
    double direct_share; /**< of the direct model: 0 in the domain, 1 far from it */
    uint32_t flags;      /**< shcd_learned_flag */
    uint32_t reserved0;  /**< zero */
} shcd_learned_output;

/** Evaluates a network.
 *
 *  U and its first derivatives are continuous everywhere; the second jumps at depth_max_m.
 *  @param[in]  learned  of a model, or from shcd_train()
 *  @param[in]  point_m  on the rest surface, body frame
 *  @param[in]  depth_m  0 or less: all zero
 *  @param[out] out      untouched on failure
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE. RT safe: at most
 *  SHCD_LEARNED_CENTRES_MAX kernels, a few microseconds. Thread safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_learned_evaluate(const shcd_learned *learned,
                                                                  shcd_vec3 point_m, double depth_m,
                                                                  shcd_learned_output *out);

/** The dent that goes with a force: amplitudes q_k [m^2] of u(w) = sum_k q_k phi_k(w) [m], the
 *  displacement against the normal at the contact, everywhere along that one direction.
 *
 *  q_k = force phi_k(w0) g_k(depth), g_k = sum_p dent_kp T_p(t): linear in the force, the shape
 * that the depth gives it. For beta = 0 that is the wave's static dent without an error.
 *  @param[in]  phi_per_m  n_modes values: the modes at the contact [1/m]
 *  @param[in]  depth_m    above depth_max_m: as at depth_max_m
 *  @param[out] q_m2       n_modes values
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (null), SHCD_ERR_UNSUPPORTED (a network without dents). RT
 *  safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_learned_dent(const shcd_learned *learned,
                                                              const double *phi_per_m,
                                                              double force_n, double depth_m,
                                                              double *q_m2);

#ifdef __cplusplus
}
#endif
#endif
