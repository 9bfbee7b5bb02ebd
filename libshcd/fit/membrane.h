/* SPDX-License-Identifier: BSD-3-Clause */
/* The static indentation of a stiffening membrane on the body's true rest surface: what the learned
 * response is trained on. */
#ifndef SHCD_FIT_MEMBRANE_H
#define SHCD_FIT_MEMBRANE_H

#include "shcd/model.h"

/** What the membrane is made of, all values set: shcdi_membrane_defaults(). */
typedef struct shcdi_membrane_material {
    double young_pa, poisson;
    double patch_radius_m;      /**< a: the contact's patch is a heat kernel of time (a/2)^2/2 */
    double support_length_m;    /**< l = sqrt(G h/kappa) */
    double thickness_m;         /**< h */
    double foundation_n_per_m3; /**< kappa */
    double stiffening;          /**< beta >= 0 */
} shcdi_membrane_material;

/** The thickness at which a plane's static stiffness is the half-space's 2 E* a:
 *  h = a e^x E1(x)/(pi (1 - nu)), x = (a/2 l)^2. Overwrites thickness and foundation. */
void shcdi_membrane_match(shcdi_membrane_material *material);

/** One indentation. */
typedef struct shcdi_indentation {
    double energy_j;    /**< U */
    double force_n;     /**< dU/d depth */
    shcd_vec3 torque_n; /**< dU/dw, tangential on the unit sphere, depth held [N m for a radian] */
    double strain2_max; /**< largest |grad_S d|^2 at a node */
    int n_newton;
    int n_products; /**< of the Hessian with a vector */
} shcdi_indentation;

/** A body's membrane with everything that does not depend on the contact. */
typedef struct shcdi_membrane shcdi_membrane;

/** @param[in]  modes        of the model, as shcd_fit_modes() makes them; borrowed
 *  @param[in]  n_modes      the first so many of them; the rest is a compliance in series
 *  @param[in]  n_latitudes  of the quadrature; 0: three for each degree
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (no modes), SHCD_ERR_GEOMETRY, SHCD_ERR_MEMORY. */
shcd_status shcdi_membrane_create(const shcd_model *model, const shcd_modes *modes, size_t n_modes,
                                  const shcdi_membrane_material *material, size_t n_latitudes,
                                  shcdi_membrane **membrane, shcd_error *error);
/** Accepts NULL. */
void shcdi_membrane_free(shcdi_membrane *membrane);

/** Residual compliance of the modes that are left out [m/N]. */
double shcdi_membrane_residual(const shcdi_membrane *membrane);
/** D_k = G h lambda_k + kappa of one mode [N/m^3]. */
double shcdi_membrane_mode_stiffness(const shcdi_membrane *membrane, size_t k);
/** b_k = exp(-(a/2)^2 lambda_k/2). */
double shcdi_membrane_patch(const shcdi_membrane *membrane, size_t k);

/** Chooses the contact: phi_k(w), their slopes, and the linear compliance. @return SHCD_OK, or as
 *  shcd_harmonics(). */
shcd_status shcdi_membrane_touch(shcdi_membrane *membrane, shcd_vec3 parameter);
/** Of that contact, at beta = 0 [m/N]. */
double shcdi_membrane_compliance(const shcdi_membrane *membrane);
/** phi_k at that contact, n_modes values [1/m]. */
const double *shcdi_membrane_phi(const shcdi_membrane *membrane);

/** Presses the chosen contact in by a depth.
 *  @param[in]     depth_m   > 0
 *  @param[in]     start_depth_m  > 0: q holds the amplitudes at that depth of this contact; 0:
 * start from the linear solution
 *  @param[in,out] q         amplitudes of the dent, positive inward, along the normal at the
 * contact [m^2]; n_modes values
 *  @return SHCD_OK, SHCD_ERR_CONVERGENCE. */
shcd_status shcdi_membrane_press(shcdi_membrane *membrane, double depth_m, double start_depth_m,
                                 double *q, shcdi_indentation *out);

/** The dent at the quadrature's nodes, u = sum_k q_k phi_k [m]; `u` has shcdi_membrane_nodes()
 *  values. */
size_t shcdi_membrane_nodes(const shcdi_membrane *membrane);
void shcdi_membrane_dent(shcdi_membrane *membrane, const double *q, double *u);

#endif
