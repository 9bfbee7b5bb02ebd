/* SPDX-License-Identifier: BSD-3-Clause */
/* Training data from the built-in membrane: the body, its modes, and indentations of it. */
#ifndef SHCD_FIT_TRAIN_MEMBRANE_H
#define SHCD_FIT_TRAIN_MEMBRANE_H

#include "membrane.h"
#include "membrane_grid.h"
#include "train_network.h"

/** Most depths of one place. */
#define SHCDI_TRAIN_DEPTHS_MAX 8

/** The membrane that is pressed, which may have finer modes than the model carries, and the model's
 *  modes, in which dents are told. */
typedef struct shcdi_train_source {
    const shcd_model *model;
    const shcd_modes *modes; /**< of the model: those that its dents are made of */
    shcd_modes *own_modes;   /**< owned: those modes, if the model had none */
    shcd_model *fine;        /**< owned: the model in a space of higher degree; NULL: the model's */
    shcd_modes *fine_modes;  /**< owned; NULL: the model's */
    shcdi_membrane *membrane;
    shcdi_membrane_grid *dents; /**< of the model's modes, at the membrane's nodes */
    double *node;               /**< values at the nodes */
    double *q;                  /**< amplitudes of the membrane's modes */
    double quadrature_error;
} shcdi_train_source;

/** All zero may be released. */
void shcdi_train_source_release(shcdi_train_source *source);

/** @param[in] material      all set
 *  @param[in] space_degree  of the harmonics that the membrane is solved in; 0: the model's own and
 *                           its own modes for a linear material, else enough for the patch
 *  @param[in] depth_max_m   the quadrature is refined until it agrees at this depth
 *  @return SHCD_OK, or as shcd_fit_modes(), SHCD_ERR_CONVERGENCE. Release in any case. */
shcd_status shcdi_train_source_init(shcdi_train_source *source, const shcd_model *model,
                                    const shcdi_membrane_material *material, int space_degree,
                                    double depth_max_m, const shcdi_progress *progress,
                                    shcd_error *error);

/** Where a parameter is: point and orthonormal tangents, and the linear map from dU/dw to slopes
 *  along those tangents. @return SHCD_OK, SHCD_ERR_GEOMETRY. */
typedef struct shcdi_train_frame {
    shcd_vec3 point_m, tangent[2];
    shcd_vec3 pull[2]; /**< slope along tangent[e] = pull[e] . dU/dw [1/m] */
    double area_m2;    /**< for each unit of the sphere's */
} shcdi_train_frame;
shcd_status shcdi_train_frame_at(const shcd_model *model, shcd_vec3 w, shcdi_train_frame *frame);

/** Presses at a parameter to ascending depths.
 *  @param[out] row  n rows
 *  @param[out] q    n rows of as many amplitudes as the model has modes [m^2], or NULL
 *  @param[out] phi  the model's modes there [1/m], or NULL
 *  @return SHCD_OK, SHCD_ERR_CONVERGENCE, SHCD_ERR_GEOMETRY. */
shcd_status shcdi_train_press(shcdi_train_source *source, shcd_vec3 w, const double *depth_m,
                              size_t n, shcdi_train_row *row, double *q, double *phi);

#endif
