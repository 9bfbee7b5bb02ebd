/* SPDX-License-Identifier: BSD-3-Clause */
/* What a network is trained on and what it is tested on. */
#ifndef SHCD_FIT_TRAIN_DATA_H
#define SHCD_FIT_TRAIN_DATA_H

#include "train_membrane.h"

typedef struct shcdi_train_data {
    shcdi_train_set train, test;
    size_t n_modes;   /**< of the dents; 0: none */
    double *moment;   /**< of the training's dents, see train_data.c; NULL: none */
    double *test_phi; /**< n_modes for each place of the test */
    double *test_q;   /**< n_modes for each row of the test */
} shcdi_train_data;

/** All zero may be released. */
void shcdi_train_data_release(shcdi_train_data *data);

/** Presses n_points places spread evenly over the surface, and a third as many for the test that
 *  are uniform over its area. Release in any case. */
shcd_status shcdi_train_data_press(shcdi_train_data *data, shcdi_train_source *source,
                                   double depth_max_m, size_t n_points, uint64_t seed,
                                   const shcdi_progress *progress, shcd_error *error);

/** Deals a table out: places in one group, one place in five into the test. */
shcd_status shcdi_train_data_table(shcdi_train_data *data, const shcd_model *model,
                                   const shcd_train_options *options, uint64_t seed,
                                   shcd_error *error);

/** The gains of the dents for a network's number of terms: n_modes rows.
 *  @return SHCD_OK, SHCD_ERR_CONVERGENCE. */
shcd_status shcdi_train_dents(const shcdi_train_data *data, size_t n_terms, double *gain);

/** Points all over the surface, for looking at a network: n of them. */
shcd_status shcdi_train_scatter(const shcd_model *model, size_t n, shcd_vec3 *parameter,
                                shcdi_train_place *place);

#endif
