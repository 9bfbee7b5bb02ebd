/* SPDX-License-Identifier: BSD-3-Clause */
/* The modes of a surface that is given by its coefficients alone. */
#ifndef SHCD_FIT_MODES_H
#define SHCD_FIT_MODES_H

#include "progress.h"

/** Options of any caller, checked, with the defaults of this degree filled in. `anchors` has room
 *  for SHCD_ANCHORS_MAX and is what settings->anchors then points to. */
shcd_status shcdi_modes_settings(const shcd_modes_options *options, int degree,
                                 shcd_modes_options *settings, shcd_anchor *anchors,
                                 shcd_error *error);

/** shcd_fit_modes() for settings from shcdi_modes_settings().
 *  @param[in] coefficients  3 (degree+1)^2 values in the public order [m] */
shcd_status shcdi_modes_compute(int degree, const double *coefficients,
                                const shcd_modes_options *settings, shcd_modes **modes,
                                shcd_error *error);

#endif
