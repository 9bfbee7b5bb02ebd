/* SPDX-License-Identifier: BSD-3-Clause */
/* The map tier: the paper's look-up over true directions. Depth along the ray, not distance.
 *
 * Inside or outside is the parity of the crossings beyond the point. In a bounded cell their number
 * is proven and each lies within the bound of its looked-up radius, so a point farther than that
 * from all of them is on a proven side, if the surface does not cut itself.
 */
#include "model/map.h"

#include "base/harmonics.h"
#include "query/internal.h"

#include <string.h>

static double upper_from(const shcd_model *model, shcd_vec3 p, shcd_vec3 at) {
    return shcd_norm(shcd_sub(p, at)) * (1.0 + 1e-15) + 2.0 * model->evaluation_error_m;
}

/* No crossing is known along this ray. The enclosing ball and any point of the surface are left; if
 * it is proven that there is none, the point is outside. */
static void answer_without_crossing(const shcd_model *model, shcd_vec3 p, int is_proven,
                                    shcd_proximity *out) {
    const double to_centre = shcd_norm(shcd_sub(p, model->info.centre_m));
    const double away = to_centre * (1.0 - 1e-15) - model->info.radius_m * (1.0 + 1e-15);
    out->parameter = shcd_vec3_make(0.0, 0.0, 1.0);
    out->point_m = shcdi_surface_point(&model->series, model->degree, out->parameter);
    out->n_evaluations = 1;
    out->upper_m = upper_from(model, p, out->point_m);
    out->distance_m = out->upper_m;
    if (is_proven || away > 0.0) {
        out->lower_m = shcdi_max(0.0, away);
    } else {
        out->lower_m = -out->upper_m;
        out->flags |= SHCD_PROXIMITY_SIGN_UNSURE;
    }
}

void shcdi_query_map(const shcd_model *model, const shcdi_map *map, shcd_vec3 p, int hermite,
                     shcd_proximity *out) {
    const shcd_vec3 v = shcd_sub(p, map->centre);
    const double rho = shcd_norm(v);
    /* at the centre every direction is as good as another; any of them is a true depth along a ray
     */
    shcd_vec3 unit = {0.0, 0.0, 1.0};
    (void)shcdi_direction(v, &unit);
    shcdi_map_ray ray;
    shcdi_map_look_up(map, unit, hermite, &ray);
    out->flags = SHCD_PROXIMITY_RADIAL;
    double bound = HUGE_VAL;
    if (ray.count < 0) {
        out->flags |= SHCD_PROXIMITY_MAP_EDGE;
        shcdi_map_take_nearest(map, &ray);
    } else {
        bound = shcdi_map_bound_at(map, &ray.at, hermite);
    }
    int nearest = -1, beyond = 0;
    for (int i = 0; i < ray.count; i++) {
        beyond += ray.radius[i] > rho;
        if (nearest < 0 || fabs(ray.radius[i] - rho) < fabs(ray.radius[nearest] - rho)) {
            nearest = i;
        }
    }
    out->normal = unit;
    if (nearest < 0) {
        answer_without_crossing(model, p, bound < HUGE_VAL, out);
        return;
    }
    const double r = ray.radius[nearest];
    const double depth = fabs(rho - r);
    const int inside = beyond % 2 == 1;
    out->distance_m = inside ? -depth : depth;
    out->point_m = shcd_mul_add(map->centre, r, unit);
    shcd_vec3 slope;
    shcdi_map_detail(map, &ray, nearest, unit, &slope, &out->parameter);
    /* whatever its parameter is, S there is a point of the surface: its distance bounds the true
     * one from above */
    const shcd_vec3 at = shcdi_surface_point(&model->series, model->degree, out->parameter);
    out->n_evaluations = 1;
    out->upper_m = upper_from(model, p, at);
    out->lower_m = -out->upper_m;
    if (model->info.is_embedded && depth > bound + 1e-14 * rho) {
        out->lower_m = inside ? out->lower_m : 0.0;
        out->upper_m = inside ? 0.0 : out->upper_m;
    } else {
        out->flags |= SHCD_PROXIMITY_SIGN_UNSURE;
    }
    /* n parallel to d - grad r/r, outward where the ray leaves the body */
    const shcd_vec3 n = shcd_unit(shcd_mul_add(unit, -1.0 / r, slope));
    const int leaves = (ray.count - nearest) % 2 == 1;
    out->normal = leaves ? n : shcd_scale(-1.0, n);
}

shcd_status shcd_map_query(const shcd_map *map, shcd_vec3 point, int interpolation,
                           shcd_proximity *out) {
    const int hermite = interpolation == SHCD_MAP_HERMITE;
    if (map == NULL || out == NULL || (!hermite && interpolation != SHCD_MAP_LINEAR) ||
        (hermite && map->map.grid != SHCD_MAP_OCTAHEDRAL)) {
        return SHCD_ERR_ARGUMENT;
    }
    if (!shcd_vec3_is_finite(point) || !(shcd_norm(point) < 1e150)) {
        return SHCD_ERR_NOT_FINITE;
    }
    memset(out, 0, sizeof *out);
    shcdi_query_map(map->model, &map->map, point, hermite, out);
    return SHCD_OK;
}
