/* SPDX-License-Identifier: BSD-3-Clause */
/* The dent that viewers are shown of a body with `learned`.
 *
 * The response is static and the surface that tools meet stays the rest shape, so the dent is no
 * state: it follows from the contacts of the last tick. d(w) = -n sum_k q_k phi_k(w) with q =
 * shcd_learned_dent() of the force that the network gives there, n the normal at the contact. A
 * network answers one press; of several, the deepest counts. */
#include "response/learned_dent.h"

#include "model/learned_eval.h"
#include "model/model.h"

#include <string.h>

/* Harmonics of a block, whose sums over the modes stay in registers or the nearest cache. */
#define BLOCK 32

/* Index of the body's effect `learned` if its network knows dents; else the number of effects. */
static size_t find_learned(const shcdi_body *body) {
    const shcd_learned *learned = shcd_model_learned(body->model);
    const shcd_modes *modes = shcd_model_modes(body->model);
    size_t e = 0;
    while (e < body->n_effects && body->effects[e].effect != &shcdi_effect_learned) {
        e++;
    }
    return learned != NULL && modes != NULL && learned->n_modes > 0 &&
                   learned->n_modes <= modes->n_modes
               ? e
               : body->n_effects;
}

bool shcdi_learned_has_dent(const shcdi_body *body) {
    return find_learned(body) < body->n_effects;
}

/* The contacts of a shell are many and shallow, each with a share: it shows none. */
static const shcdi_proxy *deepest(const shcd_scene *scene, const shcd_state *state, size_t b,
                                  double *depth_m) {
    const shcdi_proxy *found = NULL;
    *depth_m = 0.0;
    for (size_t t = 0; t < scene->n_tools; t++) {
        const shcdi_contact *contact = &state->contacts[t * scene->n_bodies + b];
        const shcdi_proxy *proxy = &contact->proxy;
        const double depth = scene->tools[t].radius_m -
                             shcd_dot(shcd_sub(proxy->tool_m, proxy->foot_m), proxy->normal);
        if (contact->is_touching && scene->tools[t].kind != SHCD_TOOL_SHELL && depth > *depth_m) {
            found = proxy;
            *depth_m = depth;
        }
    }
    return found;
}

/* Amplitudes of the modes. The coefficients' room serves for the harmonics at the contact first. */
static bool amplitudes(const shcd_model *model, const shcdi_proxy *proxy, double scale,
                       double depth_m, double *room, double *q_m2) {
    const shcd_learned *learned = shcd_model_learned(model);
    const shcd_modes *modes = shcd_model_modes(model);
    const shcdi_series *series = &model->series;
    const size_t count = SHCD_COUNT(model->degree);
    double phi_per_m[SHCD_MODES_MAX];
    shcdi_learned_site site;
    shcd_learned_output out;
    if (shcd_harmonics(model->degree, proxy->parameter, room, NULL, NULL) != SHCD_OK) {
        return false;
    }
    for (size_t k = 0; k < learned->n_modes; k++) {
        const double *row = modes->coefficient_per_m + k * count;
        double sum = 0.0;
        for (size_t i = 0; i < count; i++) {
            sum += row[i] * room[i];
        }
        phi_per_m[k] = sum;
    }
    shcdi_learned_at(learned, shcdi_surface_point(series, model->degree, proxy->parameter), 0,
                     &site);
    shcdi_learned_press(learned, &site, depth_m, &out);
    return shcd_learned_dent(learned, phi_per_m, scale * out.force_n, depth_m, q_m2) == SHCD_OK;
}

void shcdi_learned_dent(const shcd_scene *scene, const shcd_state *state, size_t b,
                        const shcdi_gain *gains, double *coefficients) {
    const shcdi_body *body = &scene->bodies[b];
    const size_t count = body->n_harmonics, e = find_learned(body);
    const double *rest = shcd_model_coefficients(body->model);
    double depth_m, q_m2[SHCD_MODES_MAX];
    const shcdi_proxy *proxy = e < body->n_effects ? deepest(scene, state, b, &depth_m) : NULL;
    if (proxy == NULL ||
        !amplitudes(body->model, proxy, gains[e].now * shcdi_learned_scale(&body->effects[e]),
                    depth_m, coefficients, q_m2)) {
        memcpy(coefficients, rest, 3 * count * sizeof *coefficients);
        return;
    }
    const shcd_modes *modes = shcd_model_modes(body->model);
    const size_t n_modes = shcd_model_learned(body->model)->n_modes;
    const double n[3] = {proxy->normal.x, proxy->normal.y, proxy->normal.z};
    for (size_t i = 0; i < count; i += BLOCK) {
        const size_t width = count - i < BLOCK ? count - i : BLOCK;
        double sum[BLOCK] = {0.0};
        for (size_t k = 0; k < n_modes; k++) {
            const double *row = modes->coefficient_per_m + k * count + i;
            for (size_t c = 0; c < width; c++) {
                sum[c] += q_m2[k] * row[c];
            }
        }
        for (size_t c = 0; c < 3 * width; c++) {
            coefficients[3 * i + c] = rest[3 * i + c] - n[c % 3] * sum[c / 3];
        }
    }
}
