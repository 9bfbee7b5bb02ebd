/* SPDX-License-Identifier: BSD-3-Clause */
/* The public queries: arguments in, tier chosen, result out. */
#include "query/foot.h"
#include "query/internal.h"

#include "base/harmonics.h"

#include <string.h>

#define TRACK_STEPS_MAX 16

static int options_read(const shcd_query_options *given, shcd_query_options *options) {
    const shcd_query_options defaults = SHCD_QUERY_OPTIONS_INIT;
    *options = defaults;
    if (given != NULL) {
        if (given->struct_size < sizeof given->struct_size) {
            return 0;
        }
        const size_t size =
            given->struct_size < sizeof *options ? given->struct_size : sizeof *options;
        memcpy(options, given, size);
    }
    return options->tier >= SHCD_TIER_EXACT && options->tier <= SHCD_TIER_MAP &&
           options->tolerance >= 0.0 && shcdi_is_finite(options->tolerance);
}

shcd_status shcd_closest(const shcd_model *model, shcd_vec3 point,
                         const shcd_query_options *options, shcd_proximity *out) {
    shcd_query_options read;
    if (model == NULL || out == NULL || !options_read(options, &read)) {
        return SHCD_ERR_ARGUMENT;
    }
    if (!shcd_vec3_is_finite(point) || !(shcd_norm(point) < 1e150)) {
        return SHCD_ERR_NOT_FINITE;
    }
    memset(out, 0, sizeof *out);
    if (read.tier == SHCD_TIER_MAP) {
        shcdi_query_map(model, &model->map, point, read.map_hermite != 0, out);
    } else {
        shcdi_query_certified(model, point, &read, out);
    }
    return SHCD_OK;
}

shcd_status shcd_track(const shcd_model *model, shcd_vec3 point, shcd_vec3 parameter,
                       shcd_proximity *out) {
    shcd_vec3 w;
    if (model == NULL || out == NULL) {
        return SHCD_ERR_ARGUMENT;
    }
    const shcd_status status = shcdi_direction(parameter, &w);
    if (status != SHCD_OK) {
        return status;
    }
    if (!shcd_vec3_is_finite(point) || !(shcd_norm(point) < 1e150)) {
        return SHCD_ERR_NOT_FINITE;
    }
    memset(out, 0, sizeof *out);
    shcdi_foot foot;
    uint32_t n_steps = 0, n_evaluations = 1;
    shcdi_foot_at(model, point, w, &foot);
    if (!shcdi_newton(model, point, TRACK_STEPS_MAX, &foot, &n_steps, &n_evaluations)) {
        out->flags |= SHCD_PROXIMITY_NOT_STATIONARY;
    }
    out->normal = shcdi_foot_normal(&foot);
    out->point_m = foot.jet.s;
    out->parameter = foot.w;
    out->n_evaluations = n_evaluations;
    out->n_newton = n_steps;
    out->distance_m =
        shcd_dot(shcd_sub(point, foot.jet.s), out->normal) < 0.0 ? -foot.distance : foot.distance;
    out->lower_m = -HUGE_VAL;
    out->upper_m = HUGE_VAL;
    return SHCD_OK;
}
