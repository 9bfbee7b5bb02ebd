/* SPDX-License-Identifier: BSD-3-Clause */
/* The learned response at run time: polynomials and square roots only.
 *
 * The kernel is Wendland's C4 function of space (Wendland, Adv. Comput. Math. 4, 1995), so that U
 * and its gradient are smooth, and what is farther than its support costs a comparison.
 *
 * Outside of what was trained the energy goes over into the direct model, never the force: a
 * blended force would no longer be the gradient of anything.
 *  - Depth D beyond depth_max = M: U(M) + U'(M) (D - M) + k (D - M)^2/2, C1 in the depth with U'
 *    increasing. (Blending U towards k D^2/2 would have to give back the energy by which a
 * stiffened U(M) exceeds it: a force that pulls the tool in.)
 *  - Place: (1 - s) U + s k D^2/2 with s = 1 - B(C/C_fill), B(t) = t^2 (3 - 2 t) up to t = 1,
 *    C = sum_j chi(|x - x_j|/(2 fill)), chi Wendland's C2 function, C_fill = chi(1/2). Within
 *    `fill` of a centre C >= C_fill, so s = 0; farther than 2 fill from all of them s = 1; C1 in
 *    between, with the force from the product rule. (The distance to the nearest centre itself has
 *    kinks.) */
#include "model/learned_eval.h"

#define FILL_COVER 0.1875 /* chi(1/2) = (1/2)^4 3 */

/* ---- at a place ---- */

static void add_kernel(const double *weight, size_t n_terms, double r, shcd_vec3 offset,
                       double per_support2, int wants_slope, shcdi_learned_site *site) {
    const double q = 1.0 - r, q2 = q * q, q4 = q2 * q2;
    const double value = q4 * q2 * ((35.0 * r + 18.0) * r + 3.0) * (1.0 / 3.0);
    for (size_t p = 0; p < n_terms; p++) {
        site->term[p] += weight[p] * value;
    }
    if (!wants_slope) {
        return;
    }
    /* psi'(r)/r/support^2: no division by a distance that may be 0 */
    const double slope = -(56.0 / 3.0) * q4 * q * (5.0 * r + 1.0) * per_support2;
    for (size_t p = 0; p < n_terms; p++) {
        site->slope[p] = shcd_mul_add(site->slope[p], weight[p] * slope, offset);
    }
}

static void add_cover(double r, shcd_vec3 offset, double per_reach2, double *cover,
                      shcd_vec3 *slope) {
    const double q = 1.0 - r, q3 = q * q * q;
    *cover += q3 * q * (4.0 * r + 1.0);
    *slope = shcd_mul_add(*slope, -20.0 * q3 * per_reach2, offset);
}

static void set_share(double cover, shcd_vec3 slope, shcdi_learned_site *site) {
    const double t = cover * (1.0 / FILL_COVER);
    site->share = 0.0;
    site->share_slope = shcd_vec3_make(0.0, 0.0, 0.0);
    if (t < 1.0) {
        site->share = 1.0 - t * t * (3.0 - 2.0 * t);
        site->share_slope = shcd_scale(-6.0 * t * (1.0 - t) * (1.0 / FILL_COVER), slope);
    }
}

void shcdi_learned_at(const shcd_learned *learned, shcd_vec3 point_m, int wants_slope,
                      shcdi_learned_site *site) {
    const size_t n_terms = learned->n_terms;
    const double per_support = 1.0 / learned->support_m, per_reach = 0.5 / learned->fill_m;
    const double farthest = shcdi_max(learned->support_m, 2.0 * learned->fill_m);
    const double farthest2 = farthest * farthest;
    const double *weight = learned->weight_n_per_m;
    double cover = 0.0;
    shcd_vec3 cover_slope = {0.0, 0.0, 0.0};
    for (size_t p = 0; p < n_terms; p++) {
        site->term[p] = weight[p];
        site->slope[p] = cover_slope;
    }
    for (size_t j = 0; j < learned->n_centres; j++) {
        const double *c = learned->centre_m + 3 * j;
        weight += n_terms;
        const shcd_vec3 offset = {point_m.x - c[0], point_m.y - c[1], point_m.z - c[2]};
        const double d2 = shcd_dot(offset, offset);
        if (!(d2 < farthest2)) {
            continue;
        }
        const double d = sqrt(d2);
        if (d * per_support < 1.0) {
            add_kernel(weight, n_terms, d * per_support, offset, per_support * per_support,
                       wants_slope, site);
        }
        if (d * per_reach < 1.0) {
            add_cover(d * per_reach, offset, per_reach * per_reach, &cover, &cover_slope);
        }
    }
    set_share(cover, cover_slope, site);
}

/* ---- at a depth ---- */

/* Sums of T_p(t), T_p'(t) and T_p''(t) times the terms, by the recurrence and its derivatives. */
typedef struct expansion {
    double value, first, second;
    shcd_vec3 slope, first_slope;
} expansion;

static expansion expand(const shcdi_learned_site *site, size_t n_terms, double t) {
    double t0 = 1.0, t1 = t, d0 = 0.0, d1 = 1.0, s0 = 0.0, s1 = 0.0;
    expansion e = {site->term[0], 0.0, 0.0, site->slope[0], {0.0, 0.0, 0.0}};
    for (size_t p = 1; p < n_terms; p++) {
        e.value += t1 * site->term[p];
        e.first += d1 * site->term[p];
        e.second += s1 * site->term[p];
        e.slope = shcd_mul_add(e.slope, t1, site->slope[p]);
        e.first_slope = shcd_mul_add(e.first_slope, d1, site->slope[p]);
        const double t2 = 2.0 * t * t1 - t0, d2 = 2.0 * t1 + 2.0 * t * d1 - d0;
        const double s2 = 4.0 * d1 + 2.0 * t * s1 - s0;
        t0 = t1;
        t1 = t2;
        d0 = d1;
        d1 = d2;
        s0 = s1;
        s1 = s2;
    }
    return e;
}

void shcdi_learned_press(const shcd_learned *learned, const shcdi_learned_site *site,
                         double depth_m, shcd_learned_output *out) {
    *out = (shcd_learned_output){.direct_share = site->share};
    out->flags = site->share > 0.0 ? SHCD_LEARNED_FAR : 0u;
    if (!(depth_m > 0.0)) {
        return;
    }
    const double most = learned->depth_max_m, k = learned->direct_n_per_m;
    const double d = shcdi_min(depth_m, most), beyond = depth_m - d;
    const double scale = 2.0 / most; /* dt/d depth */
    const expansion e = expand(site, learned->n_terms, scale * d - 1.0);
    const double half = 0.5 * d * d;
    double energy = half * e.value;
    double force = d * e.value + half * scale * e.first;
    double stiffness = e.value + 2.0 * d * scale * e.first + half * scale * scale * e.second;
    shcd_vec3 slope = shcd_scale(half, e.slope);
    if (beyond > 0.0) {
        const shcd_vec3 force_slope =
            shcd_mul_add(shcd_scale(d, e.slope), half * scale, e.first_slope);
        energy += beyond * (force + 0.5 * k * beyond);
        force += k * beyond;
        stiffness = k;
        slope = shcd_mul_add(slope, beyond, force_slope);
        out->flags |= SHCD_LEARNED_DEEP;
    }
    const double s = site->share, direct = 0.5 * k * depth_m * depth_m;
    slope = shcd_mul_add(shcd_scale(1.0 - s, slope), direct - energy, site->share_slope);
    out->energy_j = (1.0 - s) * energy + s * direct;
    out->force_n = (1.0 - s) * force + s * k * depth_m;
    out->stiffness_n_per_m = (1.0 - s) * stiffness + s * k;
    out->slope_n = slope;
}

/* ---- public ---- */

shcd_status shcd_learned_evaluate(const shcd_learned *learned, shcd_vec3 point_m, double depth_m,
                                  shcd_learned_output *out) {
    if (learned == NULL || out == NULL) {
        return SHCD_ERR_ARGUMENT;
    }
    if (!shcd_vec3_is_finite(point_m) || !shcdi_is_finite(depth_m)) {
        return SHCD_ERR_NOT_FINITE;
    }
    shcdi_learned_site site;
    shcdi_learned_at(learned, point_m, 1, &site);
    shcdi_learned_press(learned, &site, depth_m, out);
    return SHCD_OK;
}

shcd_status shcd_learned_dent(const shcd_learned *learned, const double *phi_per_m, double force_n,
                              double depth_m, double *q_m2) {
    if (learned == NULL || phi_per_m == NULL || q_m2 == NULL) {
        return SHCD_ERR_ARGUMENT;
    }
    if (learned->n_modes == 0) {
        return SHCD_ERR_UNSUPPORTED;
    }
    const size_t n_terms = learned->n_terms;
    const double d = shcdi_max(0.0, shcdi_min(depth_m, learned->depth_max_m));
    const double t = 2.0 * d / learned->depth_max_m - 1.0;
    double cheb[SHCD_LEARNED_TERMS_MAX] = {1.0, t};
    for (size_t p = 2; p < n_terms; p++) {
        cheb[p] = 2.0 * t * cheb[p - 1] - cheb[p - 2];
    }
    for (size_t i = 0; i < learned->n_modes; i++) {
        const double *row = learned->dent_m3_per_n + i * n_terms;
        double gain = 0.0;
        for (size_t p = 0; p < n_terms; p++) {
            gain += row[p] * cheb[p];
        }
        q_m2[i] = force_n * phi_per_m[i] * gain;
    }
    return SHCD_OK;
}
