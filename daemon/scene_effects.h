/* SPDX-License-Identifier: BSD-3-Clause */
/* The `effects` of a body in a scene file. Their keys come from the library's table of effects, so
 * an effect that the library gains is known here at once. */
#ifndef SHCDD_SCENE_EFFECTS_H
#define SHCDD_SCENE_EFFECTS_H

#include "materials.h"
#include "scene_device.h"
#include "yaml_tree.h"

#include "shcd/shcd.h"

/** Writes the library's complaint about a scene, at the effect that it is about.
 *  @param[in] effects  for each body the map that was read, or NULL
 *  @return false */
bool scene_effects_fail(const yaml_tree *tree, const yaml_node *const *effects,
                        const shcd_body_def *bodies, size_t n_bodies, const char *message);

/** How stiff a body is by its elastic law, and how viscous. All zero: it has neither. */
typedef struct scene_law {
    const yaml_node *node;          /**< where complaints about it go */
    double stiffness_n_per_m;       /**< linear law */
    double modulus_pa;              /**< Hertz law: E/(1 - nu^2); else 0 */
    double pressure_slope_pa_per_m; /**< tabulated law: the steepest; else 0 */
    double radius_m;                /**< of the contact; 0: that of the tool */
    const yaml_node *drag_node;     /**< where complaints about the drag go */
    double viscosity_pa_s;          /**< drag by Stokes' law; 0: it does not depend on the tool */
} scene_law;

/** Reads the map. A linear law, a spring of friction, a relief that is stiffer than the device
 *  renders, and a drag beyond it are refused here; what depends on the tool needs one.
 *
 *  A material gives what the file does not: to `wave` all that it knows, to `stiffness` the rest of
 *  the Hertz law if that is called for; `youngs_modulus_pa: material` calls for it. One that gives
 *  nothing to any effect is refused.
 *  @param[in] tissue  the body's material, or NULL; `made_of` is where it stands
 *   What is read
 * lives in the tree's memory. */
bool scene_effects_read(yaml_tree *tree, const yaml_node *node, const yaml_node *made_of,
                        const material *tissue, const scene_device *device, shcd_body_def *body,
                        scene_law *law);

/** Stiffness that a tool of this radius (0: sharp) meets up to this force [N/m]. */
double scene_law_stiffness(const scene_law *law, double tool_radius_m, double force_n);

/** Refuses a body that is stiffer or more viscous for a tool than the device renders, up to the
 *  device's force. */
bool scene_law_check(const yaml_tree *tree, const scene_law *law, const scene_device *device,
                     const char *tool, double tool_radius_m);

#endif
