/* SPDX-License-Identifier: BSD-3-Clause */
/* Evaluation of a learned response in two steps: all that depends on the place, once for a contact;
 * then as many depths as a contact law wants to try, at a few operations each. */
#ifndef SHCDI_MODEL_LEARNED_EVAL_H
#define SHCDI_MODEL_LEARNED_EVAL_H

#include "base/internal.h"
#include "shcd/learned.h"

/** A network at one place. */
typedef struct shcdi_learned_site {
    double term[SHCD_LEARNED_TERMS_MAX];     /**< factor of each T_p [N/m] */
    shcd_vec3 slope[SHCD_LEARNED_TERMS_MAX]; /**< its gradient in space [N/m^2] */
    double share;                            /**< of the direct model, 0 .. 1 */
    shcd_vec3 share_slope;                   /**< its gradient [1/m] */
} shcdi_learned_site;

/** wants_slope 0: gradients with the place are not computed and left zero, in half the time. RT
 *  safe. */
void shcdi_learned_at(const shcd_learned *learned, shcd_vec3 point_m, int wants_slope,
                      shcdi_learned_site *site);
/** depth_m finite. RT safe. */
void shcdi_learned_press(const shcd_learned *learned, const shcdi_learned_site *site,
                         double depth_m, shcd_learned_output *out);

#endif
