/* SPDX-License-Identifier: BSD-3-Clause */
/* Body against body: what the parts of the search share. All positions are in the frame of the
 * first body. */
#ifndef SHCDI_QUERY_PAIR_H
#define SHCDI_QUERY_PAIR_H

#include "query/image.h"
#include "query/view.h"
#include "shcd/pair.h"

/** One of the two bodies. */
typedef struct shcdi_pair_body {
    const shcd_model *model;
    const shcd_shape *shape;
    shcdi_view view;
    shcd_pose pose;   /**< of its frame in the first body's */
    shcd_vec3 centre; /**< of the enclosing ball of view.radius_m */
} shcdi_pair_body;

/** A point of one surface with its derivatives. */
typedef struct shcdi_pair_end {
    shcd_vec3 w;
    shcdi_jet jet; /**< t1, t2 in the body's parameter sphere, the rest turned into the frame */
} shcdi_pair_end;

/** A patch of one surface with its bounds. */
typedef struct shcdi_pair_patch {
    shcdi_image patch;
    double deviation;
    double m1, m2; /**< suprema of its leaf */
} shcdi_pair_patch;

/** A sphere between the surfaces (pair_separator.c). */
typedef struct shcdi_separator {
    int exists;
    int inner; /**< index of the body inside */
    shcd_vec3 centre;
    double radius[2]; /**< distance of each body's closest point from the centre */
    double goal[2];   /**< what a patch should reach to count as separated */
    struct {
        shcd_vec3 w;
        double chord2; /**< of a cap about the closest point in which `bound` holds */
        double bound;  /**< inner: largest, outer: least distance from the centre */
    } cap[2];
} shcdi_separator;

typedef struct shcdi_pair_search {
    shcdi_pair_body body[2];
    double tolerance; /**< what may be dropped below `upper` */
    double slack;     /**< rounding of positions */
    double upper;     /**< distance of the best pair */
    double lower;     /**< of everything that was dropped */
    shcdi_pair_end best[2];
    shcdi_separator separator;
    uint32_t n_evaluations, n_patches, n_newton;
    uint32_t evaluations_max, patches_max;
    int is_exhausted, improved;
} shcdi_pair_search;

static inline shcd_vec3 shcdi_pair_point(shcdi_pair_search *s, int which, shcd_vec3 w) {
    const shcdi_pair_body *body = &s->body[which];
    s->n_evaluations++;
    return shcd_transform(body->pose, shcdi_view_point(&body->view, w));
}

void shcdi_pair_end_at(shcdi_pair_search *s, int which, shcd_vec3 w, shcdi_pair_end *end);

/** Newton's method on |S_a - S_b|^2/2 in all four variables from a pair of ends; what it finds
 *  becomes the best pair if it is better. RT safe. */
void shcdi_pair_polish(shcdi_pair_search *s, shcdi_pair_end end[2]);

/** Where a body is a ball, to a share of the tolerance, and clear of the other: the best pair, and
 * a certified lower bound of the gap; else 0. @return the status of the query. RT safe. */
shcd_status shcdi_pair_ball(shcdi_pair_search *s, double allowed, double *lower);

/** Certified lower bound, by branch and bound, into s->lower. Stops with s->improved where a better
 *  pair was found. RT safe. */
void shcdi_pair_bound(shcdi_pair_search *s);

/** Makes the separator of the best pair, if there is one. RT safe. */
void shcdi_separator_make(shcdi_pair_search *s);
/** Distance from the separator's centre: of the inner body the largest, of the outer the least,
 * over one patch. RT safe. */
double shcdi_separator_bound(const shcdi_separator *separator, int which, const shcdi_image *patch,
                             double deviation);
/** The same over a leaf, split as far as it pays. RT safe. */
double shcdi_separator_refine(shcdi_pair_search *s, int which, size_t leaf, double unrefined);

/** The leaf as a patch in the frame, its corners evaluated anew. RT safe. */
void shcdi_pair_leaf(shcdi_pair_search *s, int which, const shcdi_view_leaf *leaf,
                     shcdi_pair_patch *out);
/** Four patches of one. RT safe. */
void shcdi_pair_split(shcdi_pair_search *s, int which, const shcdi_pair_patch *a,
                      shcdi_pair_patch child[4]);

/** Whether the caps are reached; remembers it. */
static inline int shcdi_pair_exhausted(shcdi_pair_search *s) {
    if (s->n_evaluations >= s->evaluations_max || s->n_patches >= s->patches_max) {
        s->is_exhausted = 1;
    }
    return s->is_exhausted;
}

static inline void shcdi_pair_drop(shcdi_pair_search *s, double lower) {
    s->lower = shcdi_min(s->lower, lower);
}

/** Signed distance of a point to a body. @return the status of the query. RT safe. */
shcd_status shcdi_pair_query(shcdi_pair_search *s, int which, shcd_vec3 p, int tier,
                             shcd_proximity *got);

/** Deepest points found of either surface inside the other body, starting from the best pair and
 *  from samples. *deepest is the upper bound of the signed distance of body[*which]'s point; +inf
 * if no point is proven inside. RT safe. */
shcd_status shcdi_pair_depth(shcdi_pair_search *s, double *deepest, int *which,
                             shcd_proximity *where, shcd_vec3 *w);

#endif
