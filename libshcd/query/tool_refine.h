/* SPDX-License-Identifier: BSD-3-Clause */
/* One search for the distance between the core of a tool and the surface: its state, and what two
 * files share: tool_search.c (blocks, leaves, the whole) and tool_refine.c (feet, and what is below
 * the leaves). */
#ifndef SHCDI_QUERY_TOOL_REFINE_H
#define SHCDI_QUERY_TOOL_REFINE_H

#include "query/tool_search.h"

#define SHCDI_TOOL_BALLS_MAX 8

/** Block or leaf that waits, with what is known of it from below. */
typedef struct shcdi_candidate {
    uint32_t index;
    double lower;
} shcdi_candidate;

typedef struct shcdi_candidates {
    shcdi_candidate *item;
    size_t n, n_max;
    int overflow; /**< some were lost */
} shcdi_candidates;

/** Cap of the parameter sphere that holds no more than one minimum, and d_K's lower bound there. */
typedef struct shcdi_tool_ball {
    shcd_vec3 w;
    double chord2; /**< squared chord of its angle, rounded down */
    double lower;
} shcdi_tool_ball;

typedef struct shcdi_tool_search {
    const shcdi_view *view;
    const shcdi_placed_tool *placed;
    shcdi_budget *budget;
    double tolerance;
    double upper; /**< of the best foot; before there is one, of the best leaf's far side */
    double lower; /**< of everything that was dropped */
    shcdi_tool_foot best;
    int has_best;
    shcd_vec3 nearest_w; /**< parameter near the closest point of the nearest flat leaf */
    double nearest_flat; /**< and its distance */
    int nearest_is_new;  /**< Newton was not tried from there */
    shcdi_candidates leaves;
    shcdi_tool_ball balls[SHCDI_TOOL_BALLS_MAX];
    size_t n_balls;
    int enters, not_stationary;
    int is_outside; /**< K is, for certain: a convex set that holds the body is clear of it */
} shcdi_tool_search;

static inline void shcdi_tool_drop(shcdi_tool_search *s, double lower) {
    s->lower = shcdi_min(s->lower, lower);
}

/** What is proven to be at least this far cannot beat the best foot by more than the tolerance. */
static inline double shcdi_tool_threshold(const shcdi_tool_search *s) {
    return s->upper - s->tolerance;
}

/** Newton from a parameter; a minimum becomes the best foot, or at least a ball. */
void shcdi_tool_polish_from(shcdi_tool_search *s, shcd_vec3 w);

/** Whether one of the balls holds a leaf; *lower is then raised to its bound. */
int shcdi_tool_in_ball(const shcdi_tool_search *s, size_t index, double *lower);

/** Settles a leaf whose bound is `lower`: by the balls, by Taylor bounds, by splitting. */
void shcdi_tool_refine_leaf(shcdi_tool_search *s, size_t index, double lower);

#endif
