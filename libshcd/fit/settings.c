/* SPDX-License-Identifier: BSD-3-Clause */
/* A caller may have been compiled against an older or newer fit.h: only the common part of a
 * structure is read or written, and struct_size of a report is left as the caller set it. */
#include "settings.h"

#include "fail.h"

#include <math.h>
#include <string.h>

static shcd_status check(const shcd_fit_options *s, shcd_error *error) {
    if (s->degree < 0 || s->degree > SHCD_DEGREE_MAX) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "fit: degree %d is not in 1 .. %d",
                              (int)s->degree, SHCD_DEGREE_MAX);
    }
    if (s->degree_max < 0 || s->degree_max > SHCD_DEGREE_MAX) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "fit: degree_max %d is not in 1 .. %d",
                              (int)s->degree_max, SHCD_DEGREE_MAX);
    }
    if (!isfinite(s->tolerance_m) || s->tolerance_m < 0.0) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "fit: tolerance %g m is not positive",
                              s->tolerance_m);
    }
    if (s->degree > 0 && s->tolerance_m > 0.0) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                              "fit: a degree and a tolerance exclude each other: the tolerance "
                              "chooses the degree");
    }
    if (!isfinite(s->area_weight) || s->area_weight < 0.0 || s->area_weight > 1e3) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "fit: area weight %g is not in 0 .. 1000",
                              s->area_weight);
    }
    if (s->n_samples > UINT64_C(1) << 32) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "fit: more than 2^32 samples");
    }
    if (!isfinite(s->unit_m) || s->unit_m < 0.0) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "fit: unit %g m is not positive",
                              s->unit_m);
    }
    const size_t n = SHCD_COUNT(s->degree);
    const int most = s->degree > 0 && n < SHCD_MODES_MAX ? (int)n : SHCD_MODES_MAX;
    if (s->n_modes < -1 || s->n_modes > most) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "fit: %d modes, not 0 .. %d",
                              (int)s->n_modes, most);
    }
    return SHCD_OK;
}

shcd_status shcdi_settings_resolve(const shcd_fit_options *options, shcd_fit_options *settings,
                                   shcd_error *error) {
    shcd_fit_options s = SHCD_FIT_OPTIONS_INIT;
    if (options != NULL) {
        if (options->struct_size < sizeof options->struct_size) {
            return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                                  "fit: options without struct_size (use SHCD_FIT_OPTIONS_INIT)");
        }
        memcpy(&s, options, options->struct_size < sizeof s ? options->struct_size : sizeof s);
        s.struct_size = sizeof s;
    }
    const shcd_status status = check(&s, error);
    if (status != SHCD_OK) {
        return status;
    }
    if (s.degree == 0 && s.tolerance_m == 0.0) {
        s.degree = SHCDI_DEGREE_DEFAULT;
    }
    s.degree_max = s.degree_max > 0 ? s.degree_max : SHCDI_DEGREE_MAX_DEFAULT;
    s.area_weight = s.area_weight > 0.0 ? s.area_weight : 5.0;
    s.unit_m = s.unit_m > 0.0 ? s.unit_m : 1.0;
    *settings = s;
    return SHCD_OK;
}

shcd_status shcdi_report_check(const shcd_fit_report *report, shcd_error *error) {
    if (report != NULL && report->struct_size < sizeof report->struct_size) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                              "fit: report without struct_size (use SHCD_FIT_REPORT_INIT)");
    }
    return SHCD_OK;
}

void shcdi_report_write(const shcd_fit_report *from, shcd_fit_report *to) {
    if (to == NULL) {
        return;
    }
    const size_t size = to->struct_size < sizeof *to ? to->struct_size : sizeof *to;
    memcpy((unsigned char *)to + sizeof to->struct_size,
           (const unsigned char *)from + sizeof to->struct_size, size - sizeof to->struct_size);
}
