/* SPDX-License-Identifier: BSD-3-Clause */
/* Which tier answers a query of a tick, within which caps. The order in which a tick degrades:
 * docs of shcd_step(). */
#ifndef SHCDI_RESPONSE_ACCURACY_H
#define SHCDI_RESPONSE_ACCURACY_H

#include "response/scene_private.h"

/** Checks what a body of a scene asks for. */
shcd_status shcdi_accuracy_check(const char *body, const shcd_body_accuracy *accuracy,
                                 shcd_error *error);

/** Adds all but addresses to a scene's fingerprint. */
uint64_t shcdi_accuracy_hash(uint64_t h, const shcd_body_accuracy *accuracy,
                             uint64_t (*hash)(uint64_t h, const void *bytes, size_t n));

/** What this tool may spend on the body: its share of what is left for it and those after it. */
static inline double shcdi_allowance(double left_ns, size_t n_tools_left) {
    return left_ns / (double)n_tools_left;
}

/** What a query cost. */
static inline double shcdi_spent(const shcd_body_accuracy *accuracy, uint32_t n_evaluations,
                                 uint32_t n_patches) {
    return accuracy->evaluation_ns * n_evaluations + accuracy->patch_ns * n_patches;
}

/** The tier that the rest of the allowance pays for. `has_foot`: there is one to follow. */
int shcdi_tier_within(const shcd_body_accuracy *accuracy, double rest_ns, bool has_foot);

/** Lowers the caps to what the rest of the allowance pays for. */
void shcdi_limit(const shcd_body_accuracy *accuracy, double rest_ns, shcd_query_options *options);

/** Options and tier of a query for which `out` says what it may cost and what was spent on it. */
int shcdi_plan(const shcdi_body *body, const shcdi_tool *tool, bool has_foot, const shcdi_gap *out,
               shcd_query_options *options);

/** The closest point for a point or sphere at p, by the tier that `out->allowance_ns` pays for;
 *  counts, flags and tier go to `out`. */
shcd_status shcdi_ask(const shcdi_body *body, const shcdi_tool *tool, shcd_vec3 p,
                      shcdi_contact *contact, shcd_proximity *found, shcdi_gap *out);

/** Records which tier answered. */
void shcdi_answered_by(const shcd_body_accuracy *accuracy, int tier, shcdi_gap *out);

/** The less certain of two tiers. */
int shcdi_lower_tier(int a, int b);

#endif
