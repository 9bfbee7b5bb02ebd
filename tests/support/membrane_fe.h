/* SPDX-License-Identifier: BSD-3-Clause */
/* A membrane on a body's surface by linear finite elements on a mesh: an oracle for the modes and
 * the static response of libshcd, with which it shares the surface's points and nothing else.
 *
 * Link with CHOLMOD; membrane_fe_eigenvalues() also with GSL. Failures end the test. */
#ifndef SHCD_TESTS_MEMBRANE_FE_H
#define SHCD_TESTS_MEMBRANE_FE_H

#include "shcd/model.h"

typedef struct membrane_fe membrane_fe;

/** Subdivides an icosahedron of directions `level` times: 10 4^level + 2 vertices, each at S(w).
 *  Errors fall like 4^-level. */
membrane_fe *membrane_fe_create(const shcd_model *model, int level);
void membrane_fe_free(membrane_fe *fe);

size_t membrane_fe_count(const membrane_fe *fe);
/** The parameter w and the point S(w) of each vertex. */
const shcd_vec3 *membrane_fe_directions(const membrane_fe *fe);
const shcd_vec3 *membrane_fe_points(const membrane_fe *fe);

/** int a b dA for functions given at the vertices; NULL stands for 1. */
double membrane_fe_integral(const membrane_fe *fe, const double *a, const double *b);

/** Solves -tension Lap_S d + kappa d = g for the deflection d under a unit force with the patch g
 *  [1/m^2], and returns int g d dA [m/N], the deflection that the patch itself sees.
 *
 *  @param[in]  tension_n_per_m   G h
 *  @param[in]  kappa_n_per_m3    > 0: the foundation
 *  @param[in]  patch_per_m2      g at the vertices
 *  @param[out] deflection_m_per_n  d at the vertices, or NULL */
double membrane_fe_compliance(const membrane_fe *fe, double tension_n_per_m, double kappa_n_per_m3,
                              const double *patch_per_m2, double *deflection_m_per_n);

/** The lowest eigenvalues of -Lap_S [1/m^2], ascending, to 1e-9 of (lambda + 1/area) for this mesh.
 */
void membrane_fe_eigenvalues(const membrane_fe *fe, size_t n, double *lambda_per_m2);

/* ---- shared with membrane_fe_eigenvalues() ---- */

/** y = M x or K x: consistent mass, cotangent stiffness. */
void membrane_fe_times_mass(const membrane_fe *fe, const double *x, double *y);
void membrane_fe_times_stiffness(const membrane_fe *fe, const double *x, double *y);

/** Factorises tension K + kappa M; then solves in place for right-hand sides one after the other.
 */
typedef struct membrane_fe_factor membrane_fe_factor;
membrane_fe_factor *membrane_fe_factorise(const membrane_fe *fe, double tension, double kappa);
void membrane_fe_solve(membrane_fe_factor *factor, double *x);
void membrane_fe_factor_free(membrane_fe_factor *factor);

#endif
