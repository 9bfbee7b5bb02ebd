/* SPDX-License-Identifier: BSD-3-Clause */
/* The path of a sweep as shcd/sweep.h defines it, computed anew. */
#ifndef SHCD_TESTS_SWEEP_PATH_H
#define SHCD_TESTS_SWEEP_PATH_H

#include "shcd/sweep.h"
#include "shcd/vec.h"

#include <math.h>

static inline shcd_quat sweep_path_unit(double w, double x, double y, double z) {
    const double n = sqrt(w * w + x * x + y * y + z * z);
    const shcd_quat q = {w / n, x / n, y / n, z / n};
    return q;
}

static inline shcd_pose sweep_path_pose(const shcd_sweep_def *def, double t) {
    const shcd_quat a = def->from.orientation, b = def->to.orientation;
    const double sign = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0.0 ? -t : t;
    const double rest = 1.0 - t;
    shcd_pose pose;
    pose.orientation = sweep_path_unit(rest * a.w + sign * b.w, rest * a.x + sign * b.x,
                                       rest * a.y + sign * b.y, rest * a.z + sign * b.z);
    pose.position_m =
        shcd_add(shcd_scale(rest, def->from.position_m), shcd_scale(t, def->to.position_m));
    return pose;
}

#endif
