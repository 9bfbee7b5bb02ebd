/* SPDX-License-Identifier: BSD-3-Clause */
/* stiffness: a linear spring along the normal, F = k depth.
 *
 * The default suits an impedance-type desktop device, whose stable range starts at a few hundred
 * N/m, and lies above the tangent stiffness of soft organs under a small tool (order 100 N/m). */
#include "response/effects.h"

static const shcd_parameter_info parameters[] = {
    {"k_n_per_m", "N/m", 300.0, 0.0, 1e5, "force per metre of penetration"},
};

static void prepare(const double *values, double *constants) {
    constants[0] = values[0];
}

static void apply(const double *constants, const shcdi_touch *touch, void *memory,
                  shcdi_response *response) {
    (void)memory;
    response->normal_force_n += constants[0] * touch->depth_m;
}

const shcdi_effect shcdi_effect_stiffness = {
    {"stiffness", "linear spring along the surface normal: F = k depth", "R. Hooke (1678)", 1,
     parameters},
    0,
    prepare,
    apply,
};
