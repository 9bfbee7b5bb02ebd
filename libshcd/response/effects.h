/* SPDX-License-Identifier: BSD-3-Clause */
/* Effects: how a contact turns into a force. Each effect is one file with one constant entry; the
 * table in effects.c lists the entries in the order in which a tick applies them. A scene resolves
 * the names once into a dense array, so an effect that a body does not name has no cost at all. */
#ifndef SHCDI_EFFECTS_H
#define SHCDI_EFFECTS_H

#include "shcd/scene.h"

/** Most effects the table may hold, and most constants one effect may derive. */
#define SHCDI_EFFECTS_MAX 16
#define SHCDI_EFFECT_CONSTANTS_MAX 8

/** What an effect sees of a contact between one tool and one body. */
typedef struct shcdi_touch {
    double depth_m;            /**< penetration, > 0 */
    double depth_rate_m_per_s; /**< its rate from the tool's velocity, > 0 while going in */
} shcdi_touch;

/** What the effects of one contact build up, each from what those before it left. */
typedef struct shcdi_response {
    double normal_force_n; /**< along the outward normal, on the tool */
} shcdi_response;

typedef struct shcdi_effect {
    shcd_effect_info info;
    /** Memory of one contact of one tool; all zero when the contact begins. */
    size_t state_bytes;
    /** Derives the constants of a tick from the parameters' values, in the order of the table. */
    void (*prepare)(const double *values, double *constants);
    void (*apply)(const double *constants, const shcdi_touch *touch, void *memory,
                  shcdi_response *response);
} shcdi_effect;

extern const shcdi_effect shcdi_effect_stiffness;
extern const shcdi_effect shcdi_effect_damping;

/** An effect that a body calls for, ready for the tick. */
typedef struct shcdi_active_effect {
    const shcdi_effect *effect;
    size_t state_offset; /**< in the memory of one (tool, body) pair */
    double constants[SHCDI_EFFECT_CONSTANTS_MAX];
} shcdi_active_effect;

/** Checks the effects of one body and resolves them in table order.
 *  @param[in]  body         name, for the messages
 *  @param[out] active       room for n_definitions or SHCDI_EFFECTS_MAX entries
 *  @param[out] n_active     how many of them are used
 *  @param[out] state_bytes  memory of one (tool, body) pair, a multiple of 8 */
shcd_status shcdi_effects_resolve(const char *body, const shcd_effect_def *definitions,
                                  size_t n_definitions, shcdi_active_effect *active,
                                  size_t *n_active, size_t *state_bytes, shcd_error *error);

#endif
