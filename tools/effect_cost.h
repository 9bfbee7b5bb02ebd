/* SPDX-License-Identifier: BSD-3-Clause */
/* What an effect costs: the time of a tick's contact and the bytes of a state. */
#ifndef SHCD_TOOLS_EFFECT_COST_H
#define SHCD_TOOLS_EFFECT_COST_H

#include "cost_clock.h"

#include "shcd/shcd.h"

typedef struct effect_cost {
    bool is_known;      /**< false: the body does not carry what the effect needs */
    double mean_ns;     /**< of what the effect took in a tick with one contact */
    double p99_ns;      /**< the slowest in a hundred; they are not in the mean */
    size_t state_bytes; /**< that it adds to the state of a scene with one body and one tool */
} effect_cost;

/** An ellipsoid of degree 15 with all its other coefficients 0; NULL: reported. */
shcd_model *effect_cost_body(void);

/** Slides a ball over the body. Beside the effect the body has what it needs: a spring, and for
 *  `pulse` the `wave`. False: reported. */
bool effect_cost_measure(const shcd_model *model, const char *effect, const cost_clock *clock,
                         effect_cost *cost);

#endif
