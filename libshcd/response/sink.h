/* SPDX-License-Identifier: BSD-3-Clause */
/* The deepest point of a convex tool's core, near a given one. */
#ifndef SHCDI_SINK_H
#define SHCDI_SINK_H

#include "response/proxy.h"

/** A point of the core and its foot, whose distance_m is that of the core point, signed. */
typedef struct shcdi_answer {
    shcd_vec3 core_m; /**< body frame */
    shcd_proximity foot;
} shcdi_answer;

/** Moves the answer along the core to where its signed distance is least, as far as it falls all
 *  the way; the foot follows.
 *  @param[in] normal  the foot's may not turn farther than 26 degrees from it; NULL: no limit */
void shcdi_sink(const shcdi_body *body, const shcdi_tool *tool, shcd_pose tool_in_body,
                const shcd_vec3 *normal, shcdi_answer *a, shcdi_gap *count);

#endif
