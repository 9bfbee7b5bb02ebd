/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies that a tool can press at once: their springs act beside each other. */
#ifndef SHCDD_SCENE_PAIRS_H
#define SHCDD_SCENE_PAIRS_H

#include "scene_device.h"

#include "shcd/shcd.h"

/** The width of a tool, the largest distance of two of its points; HUGE_VAL for points of a file.
 */
double scene_tool_width(const shcd_tool_geometry_def *geometry);

/** One line on stderr for each pair of bodies that are no farther apart, at rest, than the widest
 *  tool, and stiffer together than the device renders. They are not refused: only where both push
 *  the same way do they add up, and the passivity controller keeps its reserve there.
 *  @param[in] stiffness_n_per_m  of each body at the device's force
 *  @return number of lines */
size_t scene_pairs_tell(const shcd_body_def bodies[], const double stiffness_n_per_m[], size_t n,
                        double width_m, const scene_device *device);

#endif
