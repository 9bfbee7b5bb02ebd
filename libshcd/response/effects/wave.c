/* SPDX-License-Identifier: BSD-3-Clause */
/* wave: the body is a membrane on a foundation and gives way. It belongs to the whole body, not to
 * one contact: response/soft.h has the equations.
 *
 * The thickness is by default that which makes the static stiffness under the patch the
 * half-space's 2 E* a, E* = E/(1 - nu^2), the force per depth of a flat rigid punch of radius a. */
#include "response/soft.h"

#include <string.h>

static const shcd_parameter_info parameters[] = {
    {"modes", "1", 64.0, 1.0, SHCD_MODES_MAX, "how many of the model's modes move"},
    {"youngs_modulus_pa", "Pa", 5000.0, 1.0, 1e12, "E of the tissue; default: liver"},
    {"poisson_ratio", "1", 0.45, 0.0, 0.499, "nu"},
    {"density_kg_per_m3", "kg/m^3", 1060.0, 1.0, 1e5, "rho; default: liver"},
    {"patch_radius_m", "m", 0.005, 1e-5, 1.0, "a, over which a contact spreads"},
    {"support_length_m", "m", 0.02, 0.0, 100.0,
     "l, how far a dent reaches: kappa = G h/l^2; 0: no foundation (anchored models only)"},
    {"thickness_m", "m", 0.0, 0.0, 1.0, "h; 0: that of the half-space match, by a, l and nu"},
    {"damping_ratio", "1", 0.2, 0.0, 10.0, "zeta of every mode"},
};
#define N_PARAMETERS (sizeof parameters / sizeof parameters[0])

_Static_assert(N_PARAMETERS == SHCDI_WAVE_DAMPING + 1, "the constants are the parameters");

static void prepare(const double *values, double *constants) {
    memcpy(constants, values, N_PARAMETERS * sizeof *values);
}

const shcdi_effect shcdi_effect_wave = {
    {"wave",
     "the surface gives way and rings: rho h d_tt + damping - G h Lap d + kappa d = F g_a, by its "
     "modes, contact implicit",
     "Fang, Wu, Yang (2013), eq. 11, made precise; patch and match: docs/effects.md", N_PARAMETERS,
     parameters},
    0,
    prepare,
    NULL,
    NULL,
    NULL,
};
