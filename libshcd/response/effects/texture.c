/* SPDX-License-Identifier: BSD-3-Clause */
/* texture: a relief h on the surface, raised where h > 0, as a change of the contact's energy.
 *
 * An elastic law of energy Phi, Phi' = N, is pressed by depth + w(depth) h(S), S the foot. Its
 * gradient by the tool's point p is the force
 *
 *     F = N [(1 + w' h) n - w J grad h],  J = (dS/dp)^T,
 *
 * so no closed path gains or loses energy. p is the centre of the ball that the tool is there, at
 * p = S + s n with s = radius - depth (in a groove the depth at that foot, not that of all walls);
 * differentiating along the surface gives dp . S_j = sum_k (I_jk - s II_jk) dw_k with the
 * fundamental forms I, II of the surface, hence J grad h = sum_jk h_k [(I - s II)^-1]_kj S_j,  h_k
 * = grad h . S_k. Towards a focal point it has a pole; s is cut down to where no factor 1/(1 - s k)
 * exceeds 2. The forms are those of the rest shape: with `wave` the force is a gradient up to what
 * the dent changes of its curvature.
 *
 * w goes from 0 to 1 as t^2 (3 - 2 t), t = depth/(3 A), A the amplitude: the force does not jump
 * on touching, and 1 + w' h stays within 1/2 .. 3/2, so that the pressed depth rises with the
 * depth.
 *
 * h is a sum of sines of the foot's coordinates in the body's frame, A/3 (sin kx + sin ky + sin kz)
 * or grooves A sin kx; pressing in straight on leaves it where it is. The hand feels it up to a
 * speed of a quarter of a wavelength in a tick. */
#include "base/elementary.h"
#include "response/effects.h"
#include "response/foot_motion.h"

#define PI 3.14159265358979324
#define FADE 3.0 /* depth at which all of the relief is felt, in amplitudes */

enum { AMPLITUDE, WAVELENGTH, PATTERN, N_PARAMETERS };

static const shcd_parameter_info parameters[] = {
    [AMPLITUDE] = {"amplitude_m", "m", 1e-4, 0.0, 0.01, "A; at most a quarter of the wavelength"},
    [WAVELENGTH] = {"wavelength_m", "m", 0.004, 1e-4, 1.0, "2 pi/k"},
    [PATTERN] = {"pattern", "1", 0.0, 0.0, 1.0,
                 "0: bumps, A/3 (sin kx + sin ky + sin kz); 1: grooves across x, A sin kx"},
};

enum { C_AMPLITUDE, C_WAVE_NUMBER, C_PATTERN };

static void prepare(const double *values, double *constants) {
    constants[C_AMPLITUDE] = values[AMPLITUDE];
    constants[C_WAVE_NUMBER] = 2.0 * PI / values[WAVELENGTH];
    constants[C_PATTERN] = values[PATTERN];
}

shcd_status shcdi_settle_texture(const char *body, const shcdi_settings *s, double *constants,
                                 shcd_error *error) {
    (void)constants;
    if (s->value[PATTERN] != 0.0 && s->value[PATTERN] != 1.0) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect 'texture': 'pattern' is %g, must be 0 "
                          "(bumps) or 1 (grooves)",
                          body, s->value[PATTERN]);
    }
    if (s->value[AMPLITUDE] > 0.25 * s->value[WAVELENGTH]) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect 'texture': 'amplitude_m' is %g, must be "
                          "at most a quarter of 'wavelength_m', %g",
                          body, s->value[AMPLITUDE], s->value[WAVELENGTH]);
    }
    return SHCD_OK;
}

static double relief(const double *constants, shcd_vec3 at, shcd_vec3 *gradient) {
    const double k = constants[C_WAVE_NUMBER];
    shcd_vec3 sine = {0.0, 0.0, 0.0}, cosine = {0.0, 0.0, 0.0};
    double a = constants[C_AMPLITUDE];
    shcdi_sincos(k * at.x, &sine.x, &cosine.x);
    if (constants[C_PATTERN] == 0.0) {
        a /= 3.0;
        shcdi_sincos(k * at.y, &sine.y, &cosine.y);
        shcdi_sincos(k * at.z, &sine.z, &cosine.z);
    }
    *gradient = shcd_scale(a * k, cosine);
    return a * (sine.x + sine.y + sine.z);
}

/* J grad h */
static shcd_vec3 pulled_back(const shcdi_touch *touch, shcd_vec3 gradient) {
    return shcdi_foot_motion(&touch->model->series, touch->parameter, touch->normal,
                             touch->tool_radius_m - touch->foot_depth_m, gradient);
}

static void bend(const double *constants, const shcdi_touch *touch, void *memory,
                 shcdi_response *response) {
    const double fade_m = FADE * constants[C_AMPLITUDE];
    shcd_vec3 gradient;
    (void)memory;
    if (fade_m == 0.0) {
        return;
    }
    const double height = relief(constants, touch->foot_m, &gradient);
    const double t = shcdi_min(1.0, touch->depth_m / fade_m);
    const double w = t * t * (3.0 - 2.0 * t), rate = 6.0 * t * (1.0 - t) / fade_m;
    response->depth_m += w * height;
    response->slope =
        shcd_add(response->slope, shcd_mul_add(shcd_scale(rate * height, touch->normal), -w,
                                               pulled_back(touch, gradient)));
}

const shcdi_effect shcdi_effect_texture = {
    {"texture",
     "relief on the surface: the elastic law is pressed by depth + w h, and the force tilts by the "
     "slope of h; conservative; nothing without an elastic effect",
     "gradient of the elastic energy; rendering by depth as in M. Minsky et al., Computer Graphics "
     "24(2), 235-243 (1990)",
     N_PARAMETERS, parameters},
    0,
    prepare,
    bend,
    NULL,
    NULL,
};
