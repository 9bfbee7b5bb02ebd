/* SPDX-License-Identifier: BSD-3-Clause */
/* How stiff a body is by what its model carries, held against the device once the model is loaded:
 * a trained response, and the membrane with its modes in a tick. */
#ifndef SHCDD_SCENE_STIFFNESS_H
#define SHCDD_SCENE_STIFFNESS_H

#include "scene_device.h"
#include "scene_effects.h"
#include "yaml_tree.h"

#include "shcd/shcd.h"

/** Refuses a body whose effect `learned` is stiffer than the device renders.
 *
 *  Counted is the larger of the record's stiffness_max, 2 U/depth^2 wherever the training looked,
 *  and d^2U/d depth^2 at the centres in 16 depths, as far as the device's force; where the trained
 *  depth does not reach that force, the stiffness beyond it too. All times `scale`.
 *  @param[in] effects  the body's map; NULL: none
 *  @param[in] body     its model is loaded */
bool scene_stiffness_check_learned(const yaml_tree *tree, const yaml_node *effects,
                                   const shcd_body_def *body, const scene_device *device);

/** Refuses a body whose `wave` is stiffer than the device renders: in a tick of the scene's rate or
 *  held, whichever is more (shcd_scene_wave_stiffness()). A linear or tabulated law beside it is in
 *  series and has been held by itself; a Hertz law goes rigid where its contact outgrows the wave's
 *  patch, and the two are held together, at the device's force.
 *  @param[in] body           its index in the scene
 *  @param[in] def            its definition
 *  @param[in] law            its elastic law
 *  @param[in] tool_radius_m  the largest of the scene's tools; 0: all are sharp */
bool scene_stiffness_check_wave(const yaml_tree *tree, const yaml_node *effects,
                                const shcd_scene *scene, size_t body, const shcd_body_def *def,
                                const scene_law *law, double tool_radius_m,
                                const scene_device *device);

/** Stiffness of a body to one tool, at the device's force [N/m]: of its elastic laws, or of its
 *  membrane within a tick where it has none. */
double scene_stiffness_of(const yaml_node *effects, const shcd_scene *scene, size_t body,
                          const shcd_body_def *def, const scene_law *law, double tool_radius_m,
                          const scene_device *device);

#endif
