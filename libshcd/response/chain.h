/* SPDX-License-Identifier: BSD-3-Clause */
/* The effects of a body acting one after the other on a contact, in table order and in three
 * stages: what bends its depth, the elastic laws, and what acts on their result. */
#ifndef SHCDI_CHAIN_H
#define SHCDI_CHAIN_H

#include "response/scene_private.h"
#include "response/visit.h"

typedef enum shcdi_stage { SHCDI_STAGE_BEND, SHCDI_STAGE_PRESS, SHCDI_STAGE_APPLY } shcdi_stage;

/** A contact while effects act on it. */
typedef struct shcdi_chain {
    const shcd_scene *scene;
    const shcdi_body *body;
    const shcdi_gain *gains; /**< of the body's effects */
    const shcd_input *input;
    shcd_output *output;
    size_t tool;
    double share, energy_share;
    const shcdi_touch *touch;
    unsigned char *memory;
} shcdi_chain;

/** Nanoseconds on the input's clock. */
double shcdi_since(const shcd_input *input, uint64_t before);

/** All effects of a stage, booked and timed if the output asks for that. */
void shcdi_chain_act(const shcdi_chain *chain, shcdi_stage at, shcdi_response *r);

/** What an elastic law pushes along the surface, since it is not the same everywhere: `learned`. */
shcd_vec3 shcdi_chain_along(const shcdi_chain *chain, const shcdi_response *pressed);

/** Books what an effect has changed. */
void shcdi_chain_book(const shcdi_chain *chain, size_t effect, const shcdi_response *before,
                      const shcdi_response *after);

/** Adds the result to the tool's wrench.
 *  @param[in] arm_m, other_arm_m  from the tool's origin to where the normal and the other forces
 *                                 act, world frame */
void shcdi_chain_push(const shcdi_chain *chain, const shcdi_response *r, shcd_vec3 arm_m,
                      shcd_vec3 other_arm_m);

#endif
