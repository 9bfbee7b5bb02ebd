/* SPDX-License-Identifier: BSD-3-Clause */
/* learned: the static answer that the model carries (shcd/learned.h), a potential U(x, D) of the
 * contact point x on the rest surface and of the depth D.
 *
 * The force on the tool is minus the gradient of s U over the position c of the tool's centre, so
 * that no closed path yields energy. With the foot x the nearest point of the surface, outward
 * normal n, and r the tool's radius, c = x - e n, e = D - r, so dD = -n . dc and, along the
 * surface, dc = (1 - e A) dx, A the derivative of the normal, dn = A dx. Hence F = s dU/dD n - s (1
 * - e A)^-1 (dU/dx along the surface). In tangents s1, s2 of the surface with metric g and second
 * form h_ij = n . s_ij, g A = -h, so that the tangential part is -(a s1 + b s2), (g + e h)(a, b) =
 * (dU/dx . s1, dU/dx . s2). g + e h is the Hessian of the distance that the foot minimises. Where a
 * foot gets lost, at a focal point, it is singular: e is lowered until no direction counts more
 * than LEVER_MAX times. In a groove D is the depth of all walls together, and e that at the foot.
 * The surface may give way under the law in series (a compliance W): then D with D + W F = depth.
 */
#include "model/learned_eval.h"
#include "model/model.h"
#include "response/effects.h"

#include <string.h>

#define LEVER_MAX 4.0
/* D + W F rises: bisection alone would take 53 steps to the last bit, Newton takes 3 to 6. */
#define STEPS_MAX 60

enum { SCALE, N_PARAMETERS };

static const shcd_parameter_info parameters[] = {
    [SCALE] = {"scale", "1", 1.0, 0.0, 100.0, "s, factor of energy and force"},
};

static void prepare(const double *values, double *constants) {
    constants[SCALE] = values[SCALE];
}

/* ---- along the normal ---- */

static double press(const double *constants, const shcdi_touch *touch, double depth_m,
                    double compliance_m_per_n, double *stored_j) {
    const shcd_learned *learned = shcd_model_learned(touch->model);
    const double s = constants[SCALE], w = s * compliance_m_per_n;
    shcdi_learned_site site;
    shcd_learned_output out;
    *stored_j = 0.0;
    if (learned == NULL || !(depth_m > 0.0)) {
        return 0.0;
    }
    const shcdi_series *series = &touch->model->series;
    const shcd_vec3 point = shcdi_surface_point(series, series->degree, touch->parameter);
    shcdi_learned_at(learned, point, 0, &site);
    shcdi_learned_press(learned, &site, depth_m, &out);
    double low = 0.0, high = depth_m, d = depth_m;
    for (int i = 0; w > 0.0 && i < STEPS_MAX && low < high; i++) {
        const double excess = d + w * out.force_n - depth_m,
                     slope = 1.0 + w * out.stiffness_n_per_m;
        if (excess > 0.0) {
            high = d;
        } else {
            low = d;
        }
        double next = slope > 0.0 ? d - excess / slope : low;
        next = next > low && next < high ? next : 0.5 * (low + high);
        const double change = next - d;
        d = next;
        shcdi_learned_press(learned, &site, d, &out);
        if (fabs(change) <= 0x1p-50 * d) {
            break;
        }
    }
    *stored_j = s * out.energy_j;
    return shcdi_max(0.0, s * out.force_n);
}

/* ---- along the surface ---- */

/* The part of e that leaves every eigenvalue of g^-1 (g + e h) at 1/LEVER_MAX or more. */
static double lever(const double g[3], const double h[3], double e) {
    const double det = g[0] * g[2] - g[1] * g[1];
    const double trace = (g[2] * h[0] - 2.0 * g[1] * h[1] + g[0] * h[2]) / det;
    const double product = (h[0] * h[2] - h[1] * h[1]) / det;
    const double root = sqrt(shcdi_max(0.0, 0.25 * trace * trace - product));
    const double lowest = shcdi_min(e * (0.5 * trace - root), e * (0.5 * trace + root));
    const double most = 1.0 - 1.0 / LEVER_MAX;
    return lowest < -most ? e * (most / -lowest) : e;
}

static shcd_vec3 tangential(const shcdi_jet *jet, shcd_vec3 slope_n, double e) {
    const shcd_vec3 n = shcd_unit(shcd_cross(jet->s1, jet->s2));
    const double g[3] = {shcd_dot(jet->s1, jet->s1), shcd_dot(jet->s1, jet->s2),
                         shcd_dot(jet->s2, jet->s2)};
    const double h[3] = {shcd_dot(n, jet->s11), shcd_dot(n, jet->s12), shcd_dot(n, jet->s22)};
    if (!(g[0] * g[2] - g[1] * g[1] > 1e-12 * g[0] * g[2])) {
        return shcd_vec3_make(0.0, 0.0, 0.0); /* no tangent plane */
    }
    const double c = lever(g, h, e);
    const double m[3] = {g[0] + c * h[0], g[1] + c * h[1], g[2] + c * h[2]};
    const double p = shcd_dot(slope_n, jet->s1), q = shcd_dot(slope_n, jet->s2);
    const double det = m[0] * m[2] - m[1] * m[1];
    return shcd_mul_add(shcd_scale((m[1] * q - m[2] * p) / det, jet->s1),
                        (m[1] * p - m[0] * q) / det, jet->s2);
}

static void apply(const double *constants, const shcdi_touch *touch, void *memory,
                  shcdi_response *response) {
    const shcd_learned *learned = shcd_model_learned(touch->model);
    const double s = constants[SCALE];
    shcdi_learned_site site;
    shcdi_jet jet;
    shcd_learned_output out;
    (void)memory;
    if (learned == NULL || !(response->depth_m > 0.0)) {
        return;
    }
    const shcdi_series *series = &touch->model->series;
    shcdi_surface_jet(series, series->degree, touch->parameter, &jet);
    shcdi_learned_at(learned, jet.s, 1, &site);
    shcdi_learned_press(learned, &site, response->depth_m, &out);
    const shcd_vec3 force =
        tangential(&jet, out.slope_n, touch->foot_depth_m - touch->tool_radius_m);
    response->other_force_n = shcd_mul_add(response->other_force_n, s, force);
    /* of a table with speeds; a surface never pulls */
    const double damping = s * learned->damping_n_s_per_m2 * response->depth_m;
    response->normal_force_n =
        shcdi_max(0.0, response->normal_force_n + damping * touch->depth_rate_m_per_s);
    response->flags |= out.flags != 0 ? SHCD_TOOL_OUTPUT_EXTRAPOLATED : 0u;
}

double shcdi_learned_scale(const shcdi_active_effect *active) {
    return active->constants[SCALE];
}

shcd_status shcdi_learned_effect_check(const char *body, const shcd_model *model,
                                       const shcdi_active_effect *active, size_t n_active,
                                       shcd_error *error) {
    const shcdi_effect *other = NULL;
    size_t n_learned = 0;
    for (size_t e = 0; e < n_active; e++) {
        n_learned += active[e].effect == &shcdi_effect_learned;
        other = active[e].effect == &shcdi_effect_wave ? active[e].effect : other;
    }
    if (n_learned > 0 && other != NULL) {
        return shcdi_fail(
            error, SHCD_ERR_ARGUMENT,
            "scene_create: body '%s': effect 'learned': it is the static answer of the "
            "whole body, and so is 'wave'; give one of them",
            body);
    }
    if (n_learned > 0 && shcd_model_learned(model) == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect 'learned': its model has no learned "
                          "response; 'shcd train' adds one",
                          body);
    }
    return SHCD_OK;
}

const shcdi_effect shcdi_effect_learned = {
    {"learned",
     "the trained static answer: F = -grad(s U) over the tool's position, U(contact point, depth) "
     "a network that the model carries",
     "Fang, Wu, Yang (2013), ref. 12, made a potential; kernels: H. Wendland, Adv. Comput. Math. "
     "4, "
     "389-396 (1995)",
     N_PARAMETERS, parameters},
    0,
    prepare,
    NULL,
    press,
    apply,
};
