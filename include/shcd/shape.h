/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  The current shape of a deforming body, queries on it, and certificates that last from tick to
 *  tick.
 *
 *  A model is constant; its *shape* is what the body looks like now: S(w) = sum_i c_i Y_i(w) with
 *  the current coefficients c = rest + displacement. A shape is one relocatable block in the
 *  caller's memory, without pointers: a snapshot is a memcpy. Nothing is rebuilt when it deforms:
 *  the model's bounds follow, either inflated by a bound of the displacement or refreshed in place.
 */
#ifndef SHCD_SHAPE_H
#define SHCD_SHAPE_H

#include "shcd/query.h"

#ifdef __cplusplus
extern "C" {
#endif

/** The current surface of one model; lies in the caller's memory. */
typedef struct shcd_shape shcd_shape;

/** How the query tree follows new coefficients. */
typedef enum shcd_follow {
    /** Inflate while the displacement since the last refresh is of the order of the leaves' own
     *  deviation, else refresh. */
    SHCD_FOLLOW_AUTO = 0,
    SHCD_FOLLOW_INFLATE = 1, /**< every bound grows by that of the displacement; O((L+1)^2) */
    SHCD_FOLLOW_REFRESH = 2, /**< the positions of all nodes are evaluated anew */
    /** Inflate, and evaluate anew the positions of a share of the tree's blocks in each call, those
     *  first that were evaluated longest ago: for a body that deforms in every tick. At most
     *  shcd_shape_info::blocks_per_call of them, none while nothing is worth it. Each block's
     * bounds grow by what the surface moved since its own evaluation. */
    SHCD_FOLLOW_PROGRESSIVE = 3
} shcd_follow;

/** What a shape is. Set struct_size (SHCD_SHAPE_INFO_INIT), then call shcd_shape_describe(). */
typedef struct shcd_shape_info {
    size_t struct_size;
    /** B_0..B_3: bounds over the sphere of |D|, |D'|, |D''|, |D'''| along great circles, D =
     * current
     *  - rest shape [m, m/rad, ...]. */
    double displacement_bound[4];
    double inflation_m;   /**< bound of the way from the positions in the tree to the current shape,
                               the largest over the blocks */
    double radius_m;      /**< certified radius of the enclosing ball about the model's centre_m */
    uint64_t n_sets;      /**< how often coefficients were set since the shape was initialised */
    uint64_t n_refreshes; /**< of all positions at once */
    uint64_t n_blocks;    /**< of the tree, 16 leaves each */
    uint64_t n_blocks_evaluated; /**< blocks whose positions were evaluated, all calls together */
    uint64_t blocks_per_call;    /**< most that a call with SHCD_FOLLOW_PROGRESSIVE evaluates: a
                                      quarter of the tree up to degree 15, else a sixteenth */
} shcd_shape_info;
#define SHCD_SHAPE_INFO_INIT SHCD_SIZED_INIT(shcd_shape_info)

/** Bytes that a shape of this model needs; 0 for NULL. RT safe. */
SHCD_API SHCD_RT size_t shcd_shape_size(const shcd_model *model);

/** Initialises the rest shape in the caller's memory (aligned to 16, shcd_shape_size() bytes).
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT. RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_shape_init(const shcd_model *model, void *memory,
                                                            size_t size, shcd_shape **shape);

/** Deforms the body: sets its current coefficients.
 *
 *  For D = new - rest the change of the k-th derivative along great circles is at most
 *  B_k(D) = sum_l |D_l|_2 sqrt((2l+1)/(4 pi) g_k(l)), g = 1, l(l+1)/2, l(l+1)(3 l(l+1) - 2)/8, ...
 *  (addition theorem and Cauchy-Schwarz; |D_l|_2 the spectral norm of degree l's 3 x (2l+1) block,
 *  bounded here by the Frobenius norm).
 *
 *  @param[in] coefficients  3 (degree+1)^2 values [m], the model's order and degree, finite
 *  @param[in] follow        a shcd_follow
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE; on failure the shape is unchanged.
 *  RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_shape_set(const shcd_model *model,
                                                           shcd_shape *shape,
                                                           const double *coefficients, int follow);

/** The current coefficients, 3 (degree+1)^2 values inside the shape's block. RT safe. */
SHCD_API SHCD_RT const double *shcd_shape_coefficients(const shcd_shape *shape);

/** Fills min(info->struct_size, library's size) bytes of info.
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT. RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_shape_describe(const shcd_model *model,
                                                                const shcd_shape *shape,
                                                                shcd_shape_info *info);

/** shcd_model_surface() of the current shape. RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_shape_surface(const shcd_model *model,
                                                               const shcd_shape *shape,
                                                               shcd_vec3 parameter,
                                                               shcd_vec3 *point, shcd_vec3 *normal,
                                                               double *jacobian);

/** shcd_closest() on the current shape. The map tier answers for the rest shape: depth along the
 *  ray from the map's centre, of the point moved back by the displacement at the looked-up
 *  parameter; first order in the displacement.
 *  @return as shcd_closest(). RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_shape_closest(const shcd_model *model,
                                                               const shcd_shape *shape,
                                                               shcd_vec3 point,
                                                               const shcd_query_options *options,
                                                               shcd_proximity *out);

/** shcd_track() on the current shape. RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_shape_track(const shcd_model *model,
                                                             const shcd_shape *shape,
                                                             shcd_vec3 point, shcd_vec3 parameter,
                                                             shcd_proximity *out);

/** What an exact query proved about the neighbourhood of its answer, so that the next one need not
 *  search again. Belongs to one (model, shape) pair and one point that moves; all zero bytes mean:
 *  nothing known. Frozen layout; contents private: only what shcd_closest_next() wrote may be given
 *  to it. */
typedef struct shcd_certificate {
    double value[32];
    uint64_t word[4];
} shcd_certificate;

/** The exact tier for a point that moves a little between calls.
 *
 *  While the last certificate holds (docs of the bound: libshcd/query/certificate.c) the answer
 *  costs one to three evaluations of the surface; otherwise the tree is searched and a new
 *  certificate made. The answer is as certified as shcd_closest()'s: a certificate can cost time,
 *  never correctness.
 *
 *  @param[in]     shape        NULL: the rest shape
 *  @param[in]     options      NULL: the defaults; the tier must be exact
 *  @param[in,out] certificate  all zero at first, and after the shape was initialised anew or put
 *                              back to an earlier copy
 *  @return as shcd_closest(). RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_closest_next(
    const shcd_model *model, const shcd_shape *shape, shcd_vec3 point,
    const shcd_query_options *options, shcd_certificate *certificate, shcd_proximity *out);

#ifdef __cplusplus
}
#endif
#endif
