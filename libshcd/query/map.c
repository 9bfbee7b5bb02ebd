/* SPDX-License-Identifier: BSD-3-Clause */
/* The map tier: the paper's look-up over true directions. Depth along the ray, not distance. */
#include "query/internal.h"

void shcdi_query_map(const shcd_model *model, shcd_vec3 p, int hermite, shcd_proximity *out) {
    const shcdi_map *map = &model->map;
    const shcd_vec3 v = shcd_sub(p, map->centre);
    const double rho = shcd_norm(v);
    /* at the centre every direction is as good as another; any of them is a true depth along a ray
     */
    const shcd_vec3 d = rho > 0.0 ? v : shcd_vec3_make(0.0, 0.0, 1.0);
    shcdi_map_ray ray;
    shcdi_map_look_up(map, d, hermite, &ray);
    out->flags = SHCD_PROXIMITY_RADIAL;
    const size_t cell = ray.nearest_cell;
    const uint8_t stored = map->count[cell] == SHCDI_MAP_UNSURE ? 0 : map->count[cell];
    if (ray.count < 0) {
        out->flags |= SHCD_PROXIMITY_MAP_EDGE;
        ray.count = stored;
        for (int i = 0; i < stored; i++) {
            ray.radius[i] = (double)map->crossing[map->first[cell] + (uint32_t)i].radius;
        }
    }
    int nearest = -1, beyond = 0;
    for (int i = 0; i < ray.count; i++) {
        beyond += ray.radius[i] > rho;
        if (nearest < 0 || fabs(ray.radius[i] - rho) < fabs(ray.radius[nearest] - rho)) {
            nearest = i;
        }
    }
    out->normal = shcd_unit(d);
    if (nearest < 0) {
        /* no crossing known along this ray: only the enclosing ball is left */
        const double to_centre = shcd_norm(shcd_sub(p, model->info.centre_m));
        out->upper_m = to_centre + model->info.radius_m;
        out->lower_m =
            to_centre > model->info.radius_m ? to_centre - model->info.radius_m : -out->upper_m;
        out->distance_m = out->upper_m;
        out->point_m = model->info.centre_m;
        out->parameter = shcd_vec3_make(0.0, 0.0, 1.0);
        out->flags |= SHCD_PROXIMITY_SIGN_UNSURE;
        return;
    }
    const shcd_vec3 unit = shcd_unit(d);
    const double depth = fabs(rho - ray.radius[nearest]);
    out->distance_m = beyond % 2 == 1 ? -depth : depth;
    out->point_m = shcd_mul_add(map->centre, ray.radius[nearest], unit);
    /* the stored crossing of the nearest node is a point of the surface (float storage, 6e-8): its
     * distance bounds the true one from above */
    const shcdi_crossing *c =
        &map->crossing[map->first[cell] + (uint32_t)(nearest < stored ? nearest : stored - 1)];
    out->parameter = shcd_unit(
        shcd_vec3_make((double)c->parameter[0], (double)c->parameter[1], (double)c->parameter[2]));
    const shcd_vec3 at = shcdi_surface_point(&model->series, model->degree, out->parameter);
    out->n_evaluations = 1;
    out->upper_m = shcd_norm(shcd_sub(p, at)) * (1.0 + 1e-15) + 2.0 * model->evaluation_error_m;
    out->lower_m = -out->upper_m;
    const shcd_vec3 slope = {(double)c->slope[0], (double)c->slope[1], (double)c->slope[2]};
    const double r = (double)c->radius;
    /* n parallel to d - grad r/r, outward where the ray leaves the body */
    const shcd_vec3 n = shcd_unit(shcd_mul_add(unit, -1.0 / r, slope));
    const int leaves = (ray.count - nearest) % 2 == 1;
    out->normal = leaves ? n : shcd_scale(-1.0, n);
}
