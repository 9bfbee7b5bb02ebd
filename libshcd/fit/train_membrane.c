/* SPDX-License-Identifier: BSD-3-Clause */
/* A dent is as wide as the patch, and finer than the modes that a body usually carries: what they
 * leave out is a compliance in series, which is right for a linear membrane but does not stiffen.
 * So a stiffening one is solved in a space of harmonics of its own, of the same surface, large
 * enough that less than a few percent of the compliance are left out; a linear one in the model's
 * own modes, so that it is the wave's static answer and nothing else. An anchored body is solved in
 * its own modes in any case. */
#include "train_membrane.h"

#include "fail.h"

#include "shcd/vec.h"

#include <math.h>
#include <stdlib.h>

/* sigma^2 times the highest eigenvalue at which the space is large enough: 1/e of a mode's
 * share is left. */
#define CUT 1.0
/* The quadrature has agreed when doubling it changes the energy by less than this. */
#define QUADRATURE_ERROR 1e-4
#define QUADRATURE_MAX 12 /* parallels for each degree */

static const double pi = 3.14159265358979324;

void shcdi_train_source_release(shcdi_train_source *source) {
    shcdi_membrane_free(source->membrane);
    shcdi_membrane_grid_free(source->dents);
    shcd_modes_free(source->own_modes);
    shcd_modes_free(source->fine_modes);
    shcd_model_free(source->fine);
    free(source->node);
    free(source->q);
    *source = (shcdi_train_source){0};
}

/* The modes of a model, all that its space has up to the most. */
static shcd_status all_modes(const shcd_model *model, int n, const shcdi_progress *progress,
                             shcd_modes **modes, shcd_error *error) {
    shcd_modes_options options = SHCD_MODES_OPTIONS_INIT;
    options.n_modes = n;
    options.progress = progress->call;
    options.progress_user = progress->user;
    return shcd_fit_modes(model, &options, modes, error);
}

static int degree_for(const shcd_model *model, double area_m2, double patch_radius_m) {
    const double sigma2 = 0.25 * patch_radius_m * patch_radius_m;
    int degree = shcd_model_degree(model);
    while (SHCD_COUNT(degree + 1) <= SHCD_MODES_MAX &&
           sigma2 * 4.0 * pi * (double)SHCD_COUNT(degree) < CUT * area_m2) {
        degree++;
    }
    return degree;
}

/* The same surface with coefficients of zero up to a higher degree. */
static shcd_status widen(const shcd_model *model, int degree, shcd_model **fine,
                         shcd_error *error) {
    double *coefficients = calloc(3 * SHCD_COUNT(degree), sizeof *coefficients);
    if (coefficients == NULL) {
        return shcdi_fit_fail(error, SHCD_ERR_MEMORY, "train: out of memory");
    }
    const size_t n = 3 * SHCD_COUNT(shcd_model_degree(model));
    for (size_t i = 0; i < n; i++) {
        coefficients[i] = shcd_model_coefficients(model)[i];
    }
    shcd_model_def definition = SHCD_MODEL_DEF_INIT;
    definition.degree = degree;
    definition.coefficients = coefficients;
    const shcd_status status = shcd_model_create(&definition, NULL, fine, error);
    free(coefficients);
    return status;
}

static shcd_status choose_space(shcdi_train_source *source, const shcd_model *model,
                                const shcdi_membrane_material *material, int space_degree,
                                const shcdi_progress *progress, shcd_error *error) {
    const int degree = shcd_model_degree(model);
    shcd_status status = SHCD_OK;
    source->modes = shcd_model_modes(model);
    if (source->modes == NULL) {
        status = all_modes(model, 0, progress, &source->own_modes, error);
        source->modes = source->own_modes;
    }
    /* how a body is anchored is in its modes and nowhere else: no finer ones can be made */
    if (status != SHCD_OK || source->modes->is_anchored ||
        (space_degree == 0 && !(material->stiffening > 0.0))) {
        return status;
    }
    const int wanted = space_degree > 0
                           ? space_degree
                           : degree_for(model, source->modes->area_m2, material->patch_radius_m);
    if (wanted > degree) {
        status = widen(model, wanted, &source->fine, error);
    }
    const size_t most = SHCD_COUNT(wanted > degree ? wanted : degree);
    const int n = (int)(most < SHCD_MODES_MAX ? most : SHCD_MODES_MAX);
    return status != SHCD_OK ? status
                             : all_modes(source->fine != NULL ? source->fine : model, n, progress,
                                         &source->fine_modes, error);
}

static shcd_status make_membrane(const shcdi_train_source *source,
                                 const shcdi_membrane_material *material, size_t n_latitudes,
                                 shcdi_membrane **membrane, shcd_error *error) {
    const shcd_modes *modes = source->fine_modes != NULL ? source->fine_modes : source->modes;
    return shcdi_membrane_create(source->fine != NULL ? source->fine : source->model, modes,
                                 modes->n_modes, material, n_latitudes, membrane, error);
}

/* Energy at the largest depth, at one place. */
static shcd_status try_energy(shcdi_membrane *membrane, double depth_m, double *q,
                              double *energy_j) {
    shcdi_indentation result;
    shcd_status status = shcdi_membrane_touch(membrane, shcd_vec3_make(0.48, 0.6, 0.64));
    status = status == SHCD_OK ? shcdi_membrane_press(membrane, depth_m, 0.0, q, &result) : status;
    *energy_j = result.energy_j;
    return status;
}

/* A membrane with so many parallels for each degree, and its energy at the largest depth. */
static shcd_status try_quadrature(shcdi_train_source *source,
                                  const shcdi_membrane_material *material, size_t n_latitudes,
                                  double depth_m, double *energy_j, shcd_error *error) {
    shcdi_membrane_free(source->membrane);
    source->membrane = NULL;
    shcd_status status = make_membrane(source, material, n_latitudes, &source->membrane, error);
    if (status == SHCD_OK) {
        status = try_energy(source->membrane, depth_m, source->q, energy_j);
        if (status != SHCD_OK) {
            (void)shcdi_fit_fail(error, status,
                                 "train: no static solution at the depth of %.3g m: the stiffening "
                                 "of %.3g is too large for it",
                                 depth_m, material->stiffening);
        }
    }
    return status;
}

/* The coarsest quadrature that agrees with one of twice as many nodes both ways. A linear membrane
 * needs none. */
static shcd_status choose_quadrature(shcdi_train_source *source,
                                     const shcdi_membrane_material *material, double depth_m,
                                     size_t *n_latitudes, shcd_error *error) {
    const shcd_model *model = source->fine != NULL ? source->fine : source->model;
    const size_t unit = (size_t)shcd_model_degree(model) + 1;
    double energy = 0.0, before = 0.0;
    size_t n = 3 * unit / 2;
    shcd_status status = try_quadrature(source, material, n, depth_m, &before, error);
    while (status == SHCD_OK && material->stiffening > 0.0) {
        status = try_quadrature(source, material, 2 * n, depth_m, &energy, error);
        source->quadrature_error = fabs(energy - before) / energy;
        if (status == SHCD_OK && source->quadrature_error < QUADRATURE_ERROR) {
            status = try_quadrature(source, material, n, depth_m, &before, error);
            break;
        }
        if (status == SHCD_OK && 4 * n > QUADRATURE_MAX * unit) {
            status = shcdi_fit_fail(error, SHCD_ERR_CONVERGENCE,
                                    "train: the energy at the depth of %.3g m still changes by "
                                    "%.2g of itself when the quadrature is doubled",
                                    depth_m, source->quadrature_error);
        }
        before = energy;
        n *= 2;
    }
    *n_latitudes = n;
    return status;
}

shcd_status shcdi_train_source_init(shcdi_train_source *source, const shcd_model *model,
                                    const shcdi_membrane_material *material, int space_degree,
                                    double depth_max_m, const shcdi_progress *progress,
                                    shcd_error *error) {
    *source = (shcdi_train_source){.model = model};
    shcd_status status = choose_space(source, model, material, space_degree, progress, error);
    if (status != SHCD_OK) {
        return status;
    }
    const shcd_modes *used = source->fine_modes != NULL ? source->fine_modes : source->modes;
    size_t n_latitudes = 0;
    source->q = malloc(used->n_modes * sizeof *source->q);
    status = source->q != NULL
                 ? choose_quadrature(source, material, depth_max_m, &n_latitudes, error)
                 : shcdi_fit_fail(error, SHCD_ERR_MEMORY, "train: out of memory");
    if (status != SHCD_OK) {
        return status;
    }
    source->node = malloc(shcdi_membrane_nodes(source->membrane) * sizeof *source->node);
    status = source->node != NULL
                 ? shcdi_membrane_grid_create(model, source->modes, source->modes->n_modes,
                                              n_latitudes, &source->dents)
                 : SHCD_ERR_MEMORY;
    return status == SHCD_OK
               ? SHCD_OK
               : shcdi_fit_fail(error, status, "train: %s", shcd_status_string(status));
}

shcd_status shcdi_train_frame_at(const shcd_model *model, shcd_vec3 w, shcdi_train_frame *frame) {
    double jacobian[9];
    shcd_vec3 normal;
    const shcd_status status = shcd_model_surface(model, -1, w, &frame->point_m, &normal, jacobian);
    if (status != SHCD_OK) {
        return status;
    }
    /* an orthonormal frame u, v of the sphere's tangents at w */
    const shcd_vec3 along =
        fabs(w.z) < 0.7 ? shcd_vec3_make(0.0, 0.0, 1.0) : shcd_vec3_make(1.0, 0.0, 0.0);
    const shcd_vec3 u = shcd_unit(shcd_cross(along, w)), v = shcd_cross(shcd_unit(w), u);
    const double *j = jacobian;
    const shcd_vec3 r0 = {j[0], j[1], j[2]}, r1 = {j[3], j[4], j[5]}, r2 = {j[6], j[7], j[8]};
    const shcd_vec3 su = {shcd_dot(r0, u), shcd_dot(r1, u), shcd_dot(r2, u)};
    const shcd_vec3 sv = {shcd_dot(r0, v), shcd_dot(r1, v), shcd_dot(r2, v)};
    /* su = c11 e1, sv = c21 e1 + c22 e2: dU/de1 = U_u/c11, dU/de2 = (U_v - c21 U_u/c11)/c22 */
    const double c11 = shcd_norm(su);
    frame->tangent[0] = shcd_unit(su);
    frame->tangent[1] = shcd_cross(normal, frame->tangent[0]);
    const double c21 = shcd_dot(sv, frame->tangent[0]), c22 = shcd_dot(sv, frame->tangent[1]);
    if (!(c11 > 0.0) || !(fabs(c22) > 0.0)) {
        return SHCD_ERR_GEOMETRY;
    }
    frame->pull[0] = shcd_scale(1.0 / c11, u);
    frame->pull[1] = shcd_scale(1.0 / c22, shcd_mul_add(v, -c21 / c11, u));
    frame->area_m2 = c11 * fabs(c22);
    return SHCD_OK;
}

/* The model's modes of the dent that was pressed. */
static void project(shcdi_train_source *source, double *q) {
    const size_t n = source->modes->n_modes, n_nodes = shcdi_membrane_nodes(source->membrane);
    if (source->fine_modes == NULL) {
        for (size_t k = 0; k < n; k++) {
            q[k] = source->q[k];
        }
        return;
    }
    const double *area = shcdi_membrane_grid_area(source->dents);
    shcdi_membrane_dent(source->membrane, source->q, source->node);
    for (size_t i = 0; i < n_nodes; i++) {
        source->node[i] *= area[i];
    }
    for (size_t k = 0; k < n; k++) {
        q[k] = 0.0;
    }
    shcdi_membrane_grid_gather_values(source->dents, source->node, q);
}

/* phi_k(w) of the model's modes. */
static shcd_status fill_phi(const shcdi_train_source *source, shcd_vec3 w, double *phi) {
    const int degree = shcd_model_degree(source->model);
    const size_t n = SHCD_COUNT(degree);
    double *y = malloc(n * sizeof *y);
    shcd_status status = y != NULL ? shcd_harmonics(degree, w, y, NULL, NULL) : SHCD_ERR_MEMORY;
    for (size_t k = 0; k < source->modes->n_modes && status == SHCD_OK; k++) {
        const double *v = source->modes->coefficient_per_m + k * n;
        phi[k] = 0.0;
        for (size_t i = 0; i < n; i++) {
            phi[k] += v[i] * y[i];
        }
    }
    free(y);
    return status;
}

shcd_status shcdi_train_press(shcdi_train_source *source, shcd_vec3 w, const double *depth_m,
                              size_t n, shcdi_train_row *row, double *q, double *phi) {
    shcdi_train_frame frame;
    shcd_status status = shcdi_train_frame_at(source->model, w, &frame);
    status = status == SHCD_OK ? shcdi_membrane_touch(source->membrane, w) : status;
    status = status == SHCD_OK && phi != NULL ? fill_phi(source, w, phi) : status;
    for (size_t i = 0; i < n && status == SHCD_OK; i++) {
        shcdi_indentation result;
        status = shcdi_membrane_press(source->membrane, depth_m[i], i > 0 ? depth_m[i - 1] : 0.0,
                                      source->q, &result);
        row[i] = (shcdi_train_row){depth_m[i], result.force_n, result.energy_j, 0.0, {0.0, 0.0}};
        for (size_t e = 0; e < 2; e++) {
            row[i].slope_n[e] = shcd_dot(frame.pull[e], result.torque_n);
        }
        if (q != NULL) {
            project(source, q + i * source->modes->n_modes);
        }
    }
    return status;
}
