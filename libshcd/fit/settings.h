/* SPDX-License-Identifier: BSD-3-Clause */
/* Options as given -> options with every default filled in; report -> the caller's report. */
#ifndef SHCD_FIT_SETTINGS_H
#define SHCD_FIT_SETTINGS_H

#include "shcd/fit.h"

#define SHCDI_DEGREE_DEFAULT 15
#define SHCDI_DEGREE_MAX_DEFAULT 50
#define SHCDI_SAMPLES_PER_COEFFICIENT 40
#define SHCDI_SAMPLES_MIN 20000

/** Checks options (NULL: the defaults). On success degree is 0 only if a tolerance is asked for;
 *  n_samples stays 0 if it follows from the degree. */
shcd_status shcdi_settings_resolve(const shcd_fit_options *options, shcd_fit_options *settings,
                                   shcd_error *error);

/** Checks that a report that is not NULL states its size. */
shcd_status shcdi_report_check(const shcd_fit_report *report, shcd_error *error);

/** Copies what the caller's version of the structure holds; NULL is allowed. */
void shcdi_report_write(const shcd_fit_report *from, shcd_fit_report *to);

#endif
