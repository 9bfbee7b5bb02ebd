/* SPDX-License-Identifier: BSD-3-Clause */
/* One sheet of the surface over a small set of directions: proof that it is there, and how fast its
 * radius can change. Scratch of map building. */
#ifndef SHCDI_MODEL_MAP_SHEET_H
#define SHCDI_MODEL_MAP_SHEET_H

#include "model/map_cast.h"

/** A node of the tree as a cap of the parameter sphere. */
typedef struct shcdi_cap {
    shcd_vec3 centre;
    double angle;        /**< the node's triangle lies within it */
    double cosine, sine; /**< of the angle */
    double m[3];         /**< suprema of |S'|, |S''|, |S'''| over the triangle */
} shcdi_cap;

/** Caps of all nodes, in the order of tree->ball; NULL: out of memory. */
shcdi_cap *shcdi_caps_create(const shcd_model *model, const shcd_allocator *allocator);

/** Directions within `angle` of d, seen from the map's centre. */
typedef struct shcdi_cone {
    shcd_vec3 origin, d;
    double angle;
} shcdi_cone;

/** S - origin = r(d) d for one smooth function r over the cone, through w at the cone's axis. */
typedef struct shcdi_sheet {
    shcd_vec3 w;
    double unique; /**< within this angle of w no direction of the cone is met twice */
    double m1, m2; /**< bounds of |r'|, |r''| along great circles of directions */
    double node;   /**< error of a radius found by Newton's method to its tolerance */
    double r_max;
} shcdi_sheet;

/** `start` is near the crossing on the axis. With `wide`, sheet->unique is made large at the price
 * of time. Newton's method takes its steps from *steps_left. @return 1 if proven. */
int shcdi_sheet_prove(const shcd_model *model, const shcdi_cap *caps, const shcdi_cone *cone,
                      shcd_vec3 start, int wide, size_t *steps_left, shcdi_sheet *sheet);

#endif
