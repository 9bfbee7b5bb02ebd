/* SPDX-License-Identifier: BSD-3-Clause */
/* viscosity: drag of the medium that the body is filled with,
 *
 *     F = -c share(depth) (v - u),  share = t^2 (3 - 2 t),  t = min(1, depth/length),
 *
 * v the velocity of the tool there, u that of the surface. The share is smooth, so that the drag
 * begins without a jump; a ball that is in by its diameter feels all of it. Stokes' law gives
 * c = 6 pi mu R for a ball of radius R in a medium of viscosity mu.
 *
 * A held damper acts on the velocity of a tick ago: hand and device of mass m stay stable with
 * c < 2 m/T, T the tick, and come to rest without overshoot with c < m/T. Velocities count up to
 * 10 m/s, faster than a hand, so that a wild estimate cannot make a force of any size. */
#include "base/internal.h"
#include "response/effects.h"

#define PI 3.14159265358979324
#define SPEED_MAX 10.0 /* [m/s] */

enum { DAMPING, VISCOSITY, LENGTH, N_PARAMETERS };

static const shcd_parameter_info parameters[] = {
    [DAMPING] = {"damping_n_s_per_m", "N s/m", 1.0, 0.0, 100.0,
                 "c, of a tool that is in all the way"},
    [VISCOSITY] = {"viscosity_pa_s", "Pa s", 0.0, 0.0, 1e4,
                   "mu, instead of c; 0: c counts. Blood 0.004, glycerine 1.4, honey 10"},
    [LENGTH] = {"length_m", "m", 0.0, 0.0, 1.0,
                "depth at which all of it acts; 0: the tool's diameter, 2 mm where it is sharp"},
};

static void prepare(const double *values, double *constants) {
    for (int i = 0; i < N_PARAMETERS; i++) {
        constants[i] = values[i];
    }
}

shcd_status shcdi_settle_viscosity(const char *body, const shcdi_settings *s, double *constants,
                                   shcd_error *error) {
    (void)constants;
    if (!s->is_given[DAMPING] || s->value[VISCOSITY] == 0.0) {
        return SHCD_OK;
    }
    return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                      "scene_create: body '%s': effect 'viscosity': '%s' and '%s' are two ways to "
                      "say the same; give one of them",
                      body, parameters[DAMPING].name, parameters[VISCOSITY].name);
}

static void apply(const double *constants, const shcdi_touch *touch, void *memory,
                  shcdi_response *response) {
    const double radius_m =
        touch->tool_radius_m > 0.0 ? touch->tool_radius_m : SHCDI_SHARP_RADIUS_M;
    const double length_m = constants[LENGTH] > 0.0 ? constants[LENGTH] : 2.0 * radius_m;
    const double c =
        touch->along_part * (constants[VISCOSITY] > 0.0 ? 6.0 * PI * constants[VISCOSITY] * radius_m
                                                        : constants[DAMPING]);
    const double t = shcdi_min(1.0, touch->depth_m / length_m);
    shcd_vec3 velocity = shcd_sub(touch->velocity_m_per_s, touch->surface_velocity_m_per_s);
    const double speed = shcd_norm(velocity);
    (void)memory;
    if (speed > SPEED_MAX) {
        velocity = shcd_scale(SPEED_MAX / speed, velocity);
    }
    response->other_force_n =
        shcd_mul_add(response->other_force_n, -c * t * t * (3.0 - 2.0 * t), velocity);
}

const shcdi_effect shcdi_effect_viscosity = {
    {"viscosity",
     "drag of a medium inside of the body: F = -c share(depth) (v - u); c given, or 6 pi mu R",
     "G. G. Stokes, Trans. Camb. Phil. Soc. 9(2), 8-106 (1851)", N_PARAMETERS, parameters},
    0,
    prepare,
    NULL,
    NULL,
    apply,
};
