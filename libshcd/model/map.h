/* SPDX-License-Identifier: BSD-3-Clause */
/* The public map object, and its reference surface. */
#ifndef SHCDI_MODEL_MAP_H
#define SHCDI_MODEL_MAP_H

#include "model/model.h"

typedef struct shcdi_reference {
    int kind; /**< a shcd_map_reference */
    int degree;
    shcd_vec3 origin; /**< where rays start */
    shcd_vec3 centre; /**< of the ball or the superquadric */
    double radius;    /**< of the ball */
    double half[3], e1, e2;
    shcd_model *low; /**< the truncated series, without a map */
    double scale, margin;
} shcdi_reference;

struct shcd_map {
    shcd_allocator allocator;
    const shcd_model *model;
    shcdi_map map;
    shcdi_reference reference;
};

/** Fills a zeroed reference, or says why it is none: every ray from `origin` must provably meet it
 *  once. */
shcd_status shcdi_reference_create(const shcd_model *model, const shcd_map_options *options,
                                   shcd_vec3 origin, const shcd_allocator *allocator,
                                   shcdi_reference *reference, shcd_error *error);
void shcdi_reference_free(shcdi_reference *reference);

/** Its radius along a unit direction and its unit normal there; 0 if Newton's method does not find
 *  the crossing. */
int shcdi_reference_at(const shcdi_reference *reference, shcd_vec3 d, double *radius,
                       shcd_vec3 *normal);

#endif
