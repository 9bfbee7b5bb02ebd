/* SPDX-License-Identifier: BSD-3-Clause */
/* The contacts of a soft body, solved together and implicitly.
 *
 * With the tools held, a force f_j along the normal n_j, kept over the tick, lowers the surface
 * under contact i by W_ij f_j at its end,
 *
 *   W_ij = (n_i . n_j) sum_k (b_k phi_k(w_i)) (b_k phi_k(w_j)) c_k/(rho h) + delta_ij W_res,
 *
 * a symmetric, positive semidefinite matrix (a Gram matrix of vectors n_i (x) phi(w_i)). Each
 * contact has a law indentation(f_i), increasing, and the depth d_i against the freely moved
 * surface:
 *
 *   f_i >= 0,  indentation(f_i) + sum_j W_ij f_j = d_i, or f_i = 0 where the left side is larger:
 *
 * the stationary point of a convex energy, which relaxing one contact at a time approaches
 * monotonously (Gauss-Seidel). One contact takes one pass, and there is no stiffness and no tick
 * for which it diverges. */
#include "response/scene_private.h"

#define SWEEPS_MAX 64
/* Forces that change by less than this share of the largest are settled. */
#define SETTLED 1e-12

/* (b phi)_i . C (b phi)_j/(rho h): what a unit force at j moves the surface at i, along the force
 */
static double compliance(const shcdi_soft *soft, const shcdi_soft_parts *p, size_t i, size_t j) {
    const double *a = p->at + i * soft->n_modes, *b = p->at + j * soft->n_modes;
    double sum = 0.0;
    for (size_t k = 0; k < soft->n_modes; k++) {
        sum += a[k] * b[k] * p->propagator[k].forced_q_s2;
    }
    return sum / soft->mass_kg_per_m2;
}

static void fill(const shcdi_soft *soft, const shcdi_soft_parts *p, double gain,
                 double w[SHCDI_PRESSES_MAX][SHCDI_PRESSES_MAX]) {
    for (size_t i = 0; i < p->head->n_presses; i++) {
        for (size_t j = 0; j <= i; j++) {
            w[i][j] = w[j][i] = gain * gain * compliance(soft, p, i, j) *
                                shcd_dot(p->press[i].touch.normal, p->press[j].touch.normal);
        }
        w[i][i] += gain * gain * soft->residual_m_per_n;
    }
}

/* The whole force of a contact, its share included, at a depth under the compliance w. */
static double force_at(const shcdi_press *press, const shcdi_active_effect *law, double gain,
                       double depth_m, double w, double *stored_j) {
    *stored_j = 0.0;
    if (!(depth_m > 0.0)) {
        return 0.0;
    }
    if (law == NULL) {
        return w > 0.0 ? gain * depth_m / w : 0.0;
    }
    /* g f(indentation): the law under g w, times g */
    const double g = gain * press->share;
    const double f = law->effect->press(law->constants, &press->touch, depth_m, g * w, stored_j);
    *stored_j *= gain;
    return g * f;
}

/* Walls of one ball share a spring (walls.c): what one of them is pressed in by moves the ball out
 * of the other, too, as far as their normals agree. */
static double coupling(const shcdi_press *a, const shcdi_press *b) {
    return a->is_wall && b->is_wall && a->tool == b->tool
               ? shcdi_max(0.0, shcd_dot(a->touch.normal, b->touch.normal))
               : 0.0;
}

static bool sweep(const shcdi_soft_parts *p, const shcdi_active_effect *law, double gain,
                  double w[SHCDI_PRESSES_MAX][SHCDI_PRESSES_MAX], double force[],
                  double indentation_m[], double stored_j[]) {
    double change = 0.0, largest = 0.0;
    for (size_t i = 0; i < p->head->n_presses; i++) {
        double depth_m = p->press[i].response.depth_m;
        for (size_t j = 0; j < p->head->n_presses; j++) {
            depth_m -= j != i ? w[i][j] * force[j] +
                                    coupling(&p->press[i], &p->press[j]) * indentation_m[j]
                              : 0.0;
        }
        const double f = force_at(&p->press[i], law, gain, depth_m, w[i][i], &stored_j[i]);
        change = shcdi_max(change, fabs(f - force[i]));
        largest = shcdi_max(largest, f);
        force[i] = f;
        indentation_m[i] = shcdi_max(0.0, depth_m - w[i][i] * f);
    }
    return change <= SETTLED * largest;
}

static void move(const shcdi_soft *soft, shcdi_soft_parts *p, const double force[], double gain) {
    for (size_t i = 0; i < p->head->n_presses; i++) {
        const double *at = p->at + i * soft->n_modes;
        const shcd_vec3 push =
            shcd_scale(-gain * force[i] / soft->mass_kg_per_m2, p->press[i].touch.normal);
        for (size_t k = 0; k < soft->n_modes; k++) {
            shcdi_soft_push(p, k, shcd_scale(at[k], push));
        }
        p->head->is_moving |= force[i] > 0.0;
    }
}

void shcdi_soft_press(const shcdi_soft *soft, unsigned char *memory, const shcdi_active_effect *law,
                      shcdi_soft_gain gain) {
    shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    double w[SHCDI_PRESSES_MAX][SHCDI_PRESSES_MAX];
    double force[SHCDI_PRESSES_MAX] = {0.0}, stored_j[SHCDI_PRESSES_MAX];
    double indentation_m[SHCDI_PRESSES_MAX] = {0.0};
    double residual_j = 0.0;
    bool is_settled = false;
    fill(soft, &p, gain.shown, w);
    for (int n = 0; n < SWEEPS_MAX && !is_settled; n++) {
        is_settled =
            sweep(&p, law, gain.force, w, force, indentation_m, stored_j) || p.head->n_presses == 1;
    }
    for (size_t i = 0; i < p.head->n_presses; i++) {
        shcdi_response *r = &p.press[i].response;
        r->normal_force_n = force[i] / p.press[i].share;
        r->stored_j += stored_j[i];
        r->flags |= is_settled ? 0u : (uint32_t)SHCD_TOOL_OUTPUT_TRUNCATED;
        residual_j += 0.5 * gain.shown * gain.shown * soft->residual_m_per_n * force[i] * force[i];
    }
    move(soft, &p, force, gain.shown);
    shcdi_soft_account(soft, memory);
    p.head->stored_j += residual_j;
}

shcd_vec3 shcdi_soft_motion(const shcdi_soft *soft, unsigned char *memory, size_t press,
                            double shown) {
    const shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    shcd_vec3 sum = {0.0, 0.0, 0.0};
    for (size_t j = 0; j < p.head->n_presses; j++) {
        const double force_n = p.press[j].share * p.press[j].response.normal_force_n;
        sum = shcd_mul_add(sum, -shown * shown * compliance(soft, &p, press, j) * force_n,
                           p.press[j].touch.normal);
    }
    return sum;
}
