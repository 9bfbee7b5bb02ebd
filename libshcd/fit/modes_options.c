/* SPDX-License-Identifier: BSD-3-Clause */
/* What a caller may ask of shcd_fit_modes(). */
#include "modes.h"

#include "fail.h"

#include "shcd/vec.h"

#include <math.h>
#include <string.h>

#define MODES_DEFAULT 64

static shcd_status check_anchor(const shcd_anchor *anchor, size_t j, shcd_error *error) {
    if (!shcd_vec3_is_finite(anchor->point_m) || !isfinite(anchor->radius_m) ||
        !isfinite(anchor->alpha_per_m2)) {
        return shcdi_fit_fail(error, SHCD_ERR_NOT_FINITE, "fit_modes: anchor %zu is not finite", j);
    }
    /* bodies measure 1e-9 .. 1e9 m; the default alpha must stay below the limit, too */
    if (!(anchor->radius_m >= 1e-12 && anchor->radius_m <= 1e12) ||
        !(anchor->alpha_per_m2 >= 0.0 && anchor->alpha_per_m2 <= 1e26)) {
        return shcdi_fit_fail(
            error, SHCD_ERR_ARGUMENT,
            "fit_modes: anchor %zu: radius %g m, alpha %g /m^2: a positive radius "
            "and alpha >= 0 are needed",
            j, anchor->radius_m, anchor->alpha_per_m2);
    }
    return SHCD_OK;
}

static shcd_status check(const shcd_modes_options *s, int most, shcd_error *error) {
    if (s->n_modes < 0 || s->n_modes > most) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "fit_modes: %d modes, not 1 .. %d",
                              (int)s->n_modes, most);
    }
    if (s->n_anchors > SHCD_ANCHORS_MAX || (s->n_anchors > 0 && s->anchors == NULL)) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                              "fit_modes: %zu anchors, not 0 .. %d, or none given", s->n_anchors,
                              SHCD_ANCHORS_MAX);
    }
    shcd_status status = SHCD_OK;
    for (size_t j = 0; j < s->n_anchors && status == SHCD_OK; ++j) {
        status = check_anchor(&s->anchors[j], j, error);
    }
    return status;
}

shcd_status shcdi_modes_settings(const shcd_modes_options *options, int degree,
                                 shcd_modes_options *settings, shcd_anchor *anchors,
                                 shcd_error *error) {
    shcd_modes_options s = SHCD_MODES_OPTIONS_INIT;
    if (options != NULL) {
        if (options->struct_size < sizeof options->struct_size) {
            return shcdi_fit_fail(
                error, SHCD_ERR_ARGUMENT,
                "fit_modes: options without struct_size (use SHCD_MODES_OPTIONS_INIT)");
        }
        memcpy(&s, options, options->struct_size < sizeof s ? options->struct_size : sizeof s);
        s.struct_size = sizeof s;
    }
    const size_t n = SHCD_COUNT(degree);
    const int most = n < SHCD_MODES_MAX ? (int)n : SHCD_MODES_MAX;
    const shcd_status status = check(&s, most, error);
    if (status != SHCD_OK) {
        return status;
    }
    if (s.n_modes == 0) {
        s.n_modes = most < MODES_DEFAULT ? most : MODES_DEFAULT;
    }
    for (size_t j = 0; j < s.n_anchors; ++j) {
        anchors[j] = s.anchors[j];
        if (anchors[j].alpha_per_m2 == 0.0) {
            anchors[j].alpha_per_m2 = 16.0 / (anchors[j].radius_m * anchors[j].radius_m);
        }
    }
    s.anchors = anchors;
    *settings = s;
    return SHCD_OK;
}
