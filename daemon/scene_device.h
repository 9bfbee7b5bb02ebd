/* SPDX-License-Identifier: BSD-3-Clause */
/* What a scene says about its device: rate, profile, delay, passivity controller; and what of the
 * scene the device can render without trembling. */
#ifndef SHCDD_SCENE_DEVICE_H
#define SHCDD_SCENE_DEVICE_H

#include "config.h"
#include "yaml_value.h"

typedef struct scene_device {
    double rate_hz;
    const device_profile *profile; /**< as it is known */
    device_profile stated;         /**< with the delay that the scene states */
    double reserve_j;
    double stiffness_limit_n_per_m; /* device_stiffness_max(), and a hair for its decimals */
    double drag_limit_n_s_per_m;    /* device_drag_max(), likewise */
} scene_device;

/** Reads the four keys; a null node stands for the default. */
bool scene_device_read(yaml_tree *tree, const yaml_node *rate, const yaml_node *device,
                       const yaml_node *delay, const yaml_node *passivity, scene_device *out);

/** Refuses a stiffness above the limit, with the reason. @param[in] at  where to point */
bool scene_device_check(const yaml_tree *tree, const yaml_node *at, const scene_device *device,
                        double k_n_per_m);

/** The same for a drag. @param[in] tool  whose radius makes it, or NULL */
bool scene_device_check_drag(const yaml_tree *tree, const yaml_node *at, const scene_device *device,
                             const char *tool, double c_n_s_per_m);

#endif
