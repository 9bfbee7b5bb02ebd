/* SPDX-License-Identifier: BSD-3-Clause */
#include "scene_pairs.h"

#include "shcd/vec.h"

#include <math.h>
#include <stdio.h>

double scene_tool_width(const shcd_tool_geometry_def *geometry) {
    switch (geometry->kind) {
    case SHCD_TOOL_POINT:
    case SHCD_TOOL_SPHERE:
        return 2.0 * geometry->radius_m;
    case SHCD_TOOL_CAPSULE:
        return 2.0 * (geometry->radius_m + geometry->half_length_m);
    case SHCD_TOOL_BOX:
        return 2.0 * (geometry->radius_m + shcd_norm(geometry->half_extents_m));
    default:
        return HUGE_VAL;
    }
}

/* The pose of b in the frame of a. */
static shcd_pose pose_in(const shcd_pose *a, const shcd_pose *b) {
    const shcd_quat p = {a->orientation.w, -a->orientation.x, -a->orientation.y, -a->orientation.z};
    const shcd_quat q = b->orientation;
    const shcd_pose in_a = {shcd_transform_inverse(*a, b->position_m),
                            {p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z,
                             p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
                             p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x,
                             p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w}};
    return in_a;
}

/* No more than what the surfaces are apart; 0 where that is not known. */
static double apart(const shcd_body_def *a, const shcd_body_def *b) {
    shcd_pair_proximity found;
    const shcd_status status =
        shcd_pair_closest(a->model, NULL, b->model, NULL,
                          pose_in(&a->body_in_world, &b->body_in_world), NULL, &found);
    return status == SHCD_OK ? fmax(0.0, found.lower_m) : 0.0;
}

size_t scene_pairs_tell(const shcd_body_def bodies[], const double stiffness_n_per_m[], size_t n,
                        double width_m, const scene_device *device) {
    size_t n_told = 0;
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < i; j++) {
            const double k = stiffness_n_per_m[i] + stiffness_n_per_m[j];
            if (!(k > device->stiffness_limit_n_per_m)) {
                continue;
            }
            const double apart_m = apart(&bodies[j], &bodies[i]);
            if (apart_m <= width_m) {
                n_told++;
                fprintf(stderr,
                        "shcdd: bodies '%s' and '%s', %.3g mm apart, can be pressed at once: %.4g "
                        "+ %.4g N/m where device %s renders %.6g; there the passivity controller "
                        "decides (docs/stability.md)\n",
                        bodies[j].name, bodies[i].name, 1e3 * apart_m, stiffness_n_per_m[j],
                        stiffness_n_per_m[i], device->profile->name,
                        device->stiffness_limit_n_per_m);
            }
        }
    }
    return n_told;
}
