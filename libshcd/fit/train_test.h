/* SPDX-License-Identifier: BSD-3-Clause */
/* What a trained network errs by, and whether it resists everywhere. */
#ifndef SHCD_FIT_TRAIN_TEST_H
#define SHCD_FIT_TRAIN_TEST_H

#include "train_data.h"

/** Fills the error fields of network->record from the test's samples and tells `watch` of each.
 *  @param[in] dents  for the largest error of a dent; NULL: dents are not tested
 *  @return SHCD_OK, SHCD_ERR_MEMORY. */
shcd_status shcdi_train_test(const shcdi_train_data *data, shcdi_membrane_grid *dents,
                             shcd_learned *network, shcd_train_watch watch, void *user);

/** Looks for a place and depth of the domain where the network does not resist (U <= 0 or
 *  dU/d depth <= 0), at the places of the training and, if model is not NULL, all over the surface.
 *  Fills record.stiffness_min_n_per_m and ..._max_.... @return also SHCD_ERR_CONVERGENCE. */
shcd_status shcdi_train_examine(const shcdi_train_data *data, const shcd_model *model,
                                shcd_learned *network, shcd_error *error);

#endif
