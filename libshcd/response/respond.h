/* SPDX-License-Identifier: BSD-3-Clause */
/* From contacts to wrenches. */
#ifndef SHCDI_RESPOND_H
#define SHCDI_RESPOND_H

#include "response/visit.h"

/** Solves the contacts that were noted for a soft body, and adds what they give to the tools. */
void shcdi_respond_soft(const shcd_scene *scene, shcd_state *state, size_t body,
                        const shcd_input *input, shcd_output *output);

#endif
