/* SPDX-License-Identifier: BSD-3-Clause */
/* What a body with `learned` looks like under its tools. */
#ifndef SHCDI_LEARNED_DENT_H
#define SHCDI_LEARNED_DENT_H

#include "response/scene_private.h"

/** Whether a body calls for `learned` and its network knows dents. */
bool shcdi_learned_has_dent(const shcdi_body *body);

/** The rest shape, and the dent of the deepest contact of the last tick if there is one.
 *  @param[in]  gains         of the body's effects
 *  @param[out] coefficients  3 n_harmonics */
void shcdi_learned_dent(const shcd_scene *scene, const shcd_state *state, size_t body,
                        const shcdi_gain *gains, double *coefficients);

#endif
