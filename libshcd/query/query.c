/* SPDX-License-Identifier: BSD-3-Clause */
/* The public queries: arguments in, tier chosen, result out. */
#include "query/internal.h"

#include "base/harmonics.h"
#include "query/ellipsoid.h"

#include <string.h>

#define TRACK_STEPS_MAX 16

int shcdi_query_options(const shcd_query_options *given, shcd_query_options *options) {
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

int shcdi_is_point(shcd_vec3 p) {
    return shcd_vec3_is_finite(p) && shcd_norm(p) < 1e150;
}

shcd_status shcd_closest(const shcd_model *model, shcd_vec3 point,
                         const shcd_query_options *options, shcd_proximity *out) {
    shcd_query_options read;
    if (model == NULL || out == NULL || !shcdi_query_options(options, &read)) {
        return SHCD_ERR_ARGUMENT;
    }
    if (!shcdi_is_point(point)) {
        return SHCD_ERR_NOT_FINITE;
    }
    memset(out, 0, sizeof *out);
    if (read.tier == SHCD_TIER_MAP) {
        shcdi_query_map(model, &model->map, point, read.map_hermite != 0, out);
    } else if (!shcdi_ellipsoid_closest(model, NULL, point, read.tolerance, out)) {
        shcdi_view view;
        shcdi_search search;
        shcdi_view_of(model, NULL, &view);
        shcdi_query_certified(&search, &view, point, &read, out);
    }
    return SHCD_OK;
}

/* The map knows the rest shape: the point is moved back by the displacement at the parameter that
 * is looked up for it. S there is still a point of the surface, and bounds the distance from above.
 */
static void map_deformed(const shcd_model *model, const shcdi_view *view, shcd_vec3 p, int hermite,
                         shcd_proximity *out) {
    shcd_proximity rest;
    memset(&rest, 0, sizeof rest);
    shcdi_query_map(model, &model->map, p, hermite, &rest);
    const shcd_vec3 moved =
        shcd_sub(shcdi_view_point(view, rest.parameter),
                 shcdi_surface_point(&model->series, model->degree, rest.parameter));
    shcdi_query_map(model, &model->map, shcd_sub(p, moved), hermite, out);
    const shcd_vec3 at = shcdi_view_point(view, out->parameter);
    out->n_evaluations += rest.n_evaluations + 3;
    out->point_m = shcd_add(out->point_m, moved);
    out->upper_m = shcd_norm(shcd_sub(p, at)) * (1.0 + 1e-15) + 2.0 * view->evaluation_error_m;
    out->lower_m = -out->upper_m;
    out->flags |= SHCD_PROXIMITY_SIGN_UNSURE;
}

shcd_status shcd_shape_closest(const shcd_model *model, const shcd_shape *shape, shcd_vec3 point,
                               const shcd_query_options *options, shcd_proximity *out) {
    shcd_query_options read;
    if (shape == NULL) {
        return shcd_closest(model, point, options, out);
    }
    if (model == NULL || out == NULL || !shcdi_query_options(options, &read)) {
        return SHCD_ERR_ARGUMENT;
    }
    if (!shcdi_is_point(point)) {
        return SHCD_ERR_NOT_FINITE;
    }
    memset(out, 0, sizeof *out);
    if (read.tier != SHCD_TIER_MAP &&
        shcdi_ellipsoid_closest(model, shape, point, read.tolerance, out)) {
        return SHCD_OK;
    }
    shcdi_view view;
    shcdi_view_of(model, shape, &view);
    if (read.tier == SHCD_TIER_MAP) {
        map_deformed(model, &view, point, read.map_hermite != 0, out);
    } else {
        shcdi_search search;
        shcdi_query_certified(&search, &view, point, &read, out);
    }
    return SHCD_OK;
}

void shcdi_query_track(const shcdi_view *view, shcd_vec3 p, shcd_vec3 w, shcd_proximity *out) {
    shcdi_foot foot;
    uint32_t n_steps = 0, n_evaluations = 1;
    shcdi_foot_at(view, p, w, &foot);
    if (!shcdi_newton(view, p, TRACK_STEPS_MAX, NULL, 0.0, &foot, &n_steps, &n_evaluations)) {
        out->flags |= SHCD_PROXIMITY_NOT_STATIONARY;
    }
    out->normal = shcdi_foot_normal(&foot);
    out->point_m = shcdi_flushed3(foot.jet.s);
    out->parameter = shcdi_flushed3(foot.w);
    out->n_evaluations = n_evaluations;
    out->n_newton = n_steps;
    out->distance_m =
        shcd_dot(shcd_sub(p, foot.jet.s), out->normal) < 0.0 ? -foot.distance : foot.distance;
    out->lower_m = -HUGE_VAL;
    out->upper_m = HUGE_VAL;
}

static shcd_status track(const shcd_model *model, const shcd_shape *shape, shcd_vec3 point,
                         shcd_vec3 parameter, shcd_proximity *out) {
    shcd_vec3 w;
    shcdi_view view;
    const shcd_status status = shcdi_direction(parameter, &w);
    if (status != SHCD_OK) {
        return status;
    }
    if (!shcdi_is_point(point)) {
        return SHCD_ERR_NOT_FINITE;
    }
    memset(out, 0, sizeof *out);
    shcdi_view_of(model, shape, &view);
    shcdi_query_track(&view, point, w, out);
    return SHCD_OK;
}

shcd_status shcd_track(const shcd_model *model, shcd_vec3 point, shcd_vec3 parameter,
                       shcd_proximity *out) {
    if (model == NULL || out == NULL) {
        return SHCD_ERR_ARGUMENT;
    }
    return track(model, NULL, point, parameter, out);
}

shcd_status shcd_shape_track(const shcd_model *model, const shcd_shape *shape, shcd_vec3 point,
                             shcd_vec3 parameter, shcd_proximity *out) {
    if (model == NULL || out == NULL) {
        return SHCD_ERR_ARGUMENT;
    }
    return track(model, shape, point, parameter, out);
}
