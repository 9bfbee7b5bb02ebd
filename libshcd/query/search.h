/* SPDX-License-Identifier: BSD-3-Clause */
/* One certified search for the closest point: its state, and the steps that share it.
 *
 *   search.c  blocks and leaves: what a scan of flat bounds leaves over
 *   ball.c    what a foot says of its surroundings: convexity balls
 *   refine.c  feet, and bounds below the leaves
 *   sign.c    inside or outside
 *   closest.c the fast and exact tiers made of these
 */
#ifndef SHCDI_QUERY_SEARCH_H
#define SHCDI_QUERY_SEARCH_H

#include "query/foot.h"
#include "shcd/query.h"

#define SHCDI_BALLS_MAX 12
#define SHCDI_SPLIT_LEVELS_MAX 28 /* a leaf's edge halves to 1e-10 of itself */
/** Visited blocks whose leaves' bounds are kept; others are scanned again. */
#define SHCDI_VISITS_KEPT 24

/** A cap of the parameter sphere over which f is known from below. */
typedef struct shcdi_ball_bound {
    shcd_vec3 w;
    double chord2; /**< squared chord of its angle, rounded down */
    double lower;  /**< of the distance to S over it [m] */
} shcdi_ball_bound;

/** The cap of an angle about w, without a bound. */
static inline void shcdi_ball_of(shcd_vec3 w, double angle, shcdi_ball_bound *ball) {
    /* chord of an angle a: 2 sin(a/2) >= a (1 - a^2/24) */
    const double chord = angle * (1.0 - angle * angle / 24.0) * (1.0 - 1e-14);
    ball->w = w;
    ball->chord2 = chord * chord;
    ball->lower = 0.0;
}

typedef struct shcdi_search {
    const shcdi_view *view;
    shcd_vec3 p;
    double tolerance; /**< gap allowed between best and lower [m] */
    double slack;     /**< rounding of a distance [m] */
    /* the scan: scaled floats relative to the index's origin */
    float at[3], extent; /* extent: |at| */
    double offset_m;     /**< added to scanned distances [m] */
    uint16_t visited[SHCDI_BLOCKS_MAX];
    size_t n_visited;
    float kept[SHCDI_VISITS_KEPT][SHCDI_BLOCK_LEAVES];
    float ball[SHCDI_BLOCKS_MAX]; /**< lower bounds of blocks; infinite of those visited */
    uint16_t queue[SHCDI_BLOCKS_MAX];
    float nearest, least; /**< of the leaves visited: nearest far side, least lower bound */
    size_t nearest_leaf;
    double leaves_lower; /**< of all leaves, by the scan alone [m] */
    double beyond_lower; /**< of the blocks that were not visited [m] */
    /* feet */
    double upper;    /**< distance of the best foot [m] */
    double expected; /**< of the best foot, once it is finished [m] */
    double lower;    /**< of everything that was settled so far [m] */
    shcdi_foot best;
    shcdi_foot evaluated;          /**< it, before it was finished (full searches) */
    shcdi_leaf_bounds best_bounds; /**< hold around the best foot */
    double best_room;              /**< within this angle of it; 0: none */
    size_t best_leaf;              /**< whose bounds they are */
    shcdi_ball_bound balls[SHCDI_BALLS_MAX];
    size_t n_balls;
    uint32_t n_evaluations, n_patches, n_newton;
    uint32_t patches_max, evaluations_max;
    int is_exact, truncated, not_stationary;
    int last_sign;   /**< of this point where it was before; 0: not known */
    int levels_max;  /**< how often a leaf may be split */
    int bounds_only; /**< 1: leaves are settled without looking for feet */
    double moved_m;  /**< what the point and the surface moved since then, at most */
} shcdi_search;

/** Tolerances, caps and counts for one point, without the scan. `allowed` gets the width of the
 *  interval asked for. RT safe. */
void shcdi_search_prepare(shcdi_search *s, const shcdi_view *view, shcd_vec3 p,
                          const shcd_query_options *options, double *allowed);
/** The same, and the distances of all blocks. RT safe. */
void shcdi_search_begin(shcdi_search *s, const shcdi_view *view, shcd_vec3 p,
                        const shcd_query_options *options, double *allowed);

/** Visits blocks until the others are farther than the nearest leaf's far side. */
void shcdi_search_scan(shcdi_search *s);
/** Visits the blocks that are left and nearer than a limit. */
void shcdi_search_scan_to(shcdi_search *s, double limit_m);
/** Parameter near the closest point of the nearest leaf's flat triangle. */
shcd_vec3 shcdi_search_start(const shcdi_search *s);
/** Leaves of the visited blocks whose lower bound is below a limit. */
typedef struct shcdi_survivors {
    float limit;
    size_t visit, first, at, n;
    const float *lower;
    float again[SHCDI_BLOCK_LEAVES];
    uint16_t index[SHCDI_VISITS_KEPT * SHCDI_BLOCK_LEAVES];
} shcdi_survivors;
/** The others only lower s->lower to the limit. */
void shcdi_survivors_begin(shcdi_search *s, shcdi_survivors *it, double limit_m);
/** 1, the leaf and its lower bound [m]; 0: none is left. */
int shcdi_survivors_next(shcdi_search *s, shcdi_survivors *it, size_t *leaf, double *lower);

/** Bounds of |S - p| over a cap around a foot that is nearly a local minimum (ball.c).
 *  @param[in] bounds  hold within `room` of the foot
 *  @return its angle, at most room, and the ball; 0 if none can be proven. */
double shcdi_ball_about(const shcdi_foot *foot, const shcdi_leaf_bounds *bounds, double room,
                        shcdi_ball_bound *ball);
/** Bound of |3 S'.S'' + r.S'''|, the third derivative of f along great circles, within an angle of
 * a foot at that distance. */
static inline double shcdi_third_bound(const shcdi_leaf_bounds *b, double distance, double angle) {
    return 3.0 * b->product + (distance + b->m1 * angle) * b->m3;
}
/** Lower bound A of f'' along great circles from a foot (ball.c). */
typedef struct shcdi_curve {
    double k, first, growth; /**< k - first s - growth s^2/2, ... */
    double until; /**< ... and more, since S'.S'' is at its bound from this angle on only */
} shcdi_curve;
shcdi_curve shcdi_curve_of(const shcdi_foot *foot, const shcdi_leaf_bounds *bounds);
/** c(s), s > 0: f >= f0 - |g| s + c(s) s^2. */
double shcdi_curve_mean(const shcdi_curve *curve, double s);
/** How far around a foot the bounds of a leaf hold. */
double shcdi_room(const shcdi_view *view, size_t leaf, shcd_vec3 w, double reach);
/** Newton from a parameter; a minimum becomes the best foot or at least a ball. `leaf` holds or is
 *  near w. */
void shcdi_search_polish_from(shcdi_search *s, shcd_vec3 w, size_t leaf);
/** Settles a leaf whose flat bound is `lower`: by the balls, by Taylor bounds, by splitting. */
void shcdi_search_settle_leaf(shcdi_search *s, size_t leaf, double lower);
/** Whether a ball holds the leaf; *lower is then raised to its bound. */
int shcdi_search_in_ball(const shcdi_search *s, size_t leaf, double *lower);

/** The exact tier's search of a point, without its result (closest.c). RT safe. */
void shcdi_search_exactly(shcdi_search *s, const shcdi_view *view, shcd_vec3 p,
                          const shcd_query_options *options);

/** Distance, interval, sign and flags of the best foot, into a zeroed result. */
void shcdi_search_result(shcdi_search *s, double allowed, shcd_proximity *out);

/** Certified lower bound of the unsigned distance. */
double shcdi_search_lower(const shcdi_search *s);
/** -1 inside, +1 outside; *is_sure is 0 where that is not proven. */
double shcdi_search_sign(shcdi_search *s, shcd_vec3 normal, int *is_sure);
/** A distance that is good enough for a coarse tolerance may still leave the sign open. */
int shcdi_search_needs_finer(const shcdi_search *s);

static inline void shcdi_search_drop(shcdi_search *s, double lower) {
    s->lower = shcdi_min(s->lower, lower);
}

#define SHCDI_SIGN_GAP 2e-9 /* of the diagonal: thinner sheets are not told apart */

#endif
