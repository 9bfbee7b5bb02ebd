/* SPDX-License-Identifier: BSD-3-Clause */
/* The public map object: options in, look-ups out. */
#include "model/map.h"

#include "base/harmonics.h"

#include <string.h>

#define RESOLUTION_OCTAHEDRAL 32
#define RESOLUTION_LATITUDE_LONGITUDE 45 /* 4140 samples against 4098 */
#define RESOLUTION_MIN 2

/* ---- creation ---- */

static shcd_status read_options(const shcd_map_options *given, shcd_map_options *options,
                                shcd_error *error) {
    memset(options, 0, sizeof *options);
    if (given != NULL) {
        if (given->struct_size < sizeof given->struct_size) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT, "map_create: struct_size missing");
        }
        memcpy(options, given,
               given->struct_size < sizeof *options ? given->struct_size : sizeof *options);
    }
    const int octahedral = options->grid == SHCD_MAP_OCTAHEDRAL;
    if (!octahedral && options->grid != SHCD_MAP_LATITUDE_LONGITUDE) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "map_create: unknown grid %d",
                          (int)options->grid);
    }
    if (options->resolution == 0) {
        options->resolution = octahedral ? RESOLUTION_OCTAHEDRAL : RESOLUTION_LATITUDE_LONGITUDE;
    }
    if (options->resolution < RESOLUTION_MIN || options->resolution > SHCD_MAP_RESOLUTION_MAX) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "map_create: resolution %d is not in %d .. %d",
                          (int)options->resolution, RESOLUTION_MIN, SHCD_MAP_RESOLUTION_MAX);
    }
    if (options->has_centre &&
        !(shcd_vec3_is_finite(options->centre_m) && shcd_norm(options->centre_m) < 1e12)) {
        return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                          "map_create: the centre is not finite, or beyond 1e12 m");
    }
    return SHCD_OK;
}

typedef struct reference_fill {
    shcd_map *map;
    int ok;
} reference_fill;

static int fill_reference(void *user, size_t slot, shcd_vec3 d) {
    reference_fill *fill = user;
    double radius;
    shcd_vec3 normal;
    fill->ok = shcdi_reference_at(&fill->map->reference, d, &radius, &normal);
    if (fill->ok) {
        fill->map->map.reference[slot] = shcdi_map_crossing(d, radius, normal, d);
    }
    return fill->ok;
}

static shcd_status build_reference(shcd_map *map, shcd_error *error) {
    shcdi_map *m = &map->map;
    m->reference = map->allocator.allocate(m->n_slots * sizeof *m->reference, map->allocator.user);
    if (m->reference == NULL) {
        return shcdi_fail(error, SHCD_ERR_MEMORY, "map_create: out of memory");
    }
    /* slots of the unfolded octahedron that are no node's stay zero */
    memset(m->reference, 0, m->n_slots * sizeof *m->reference);
    reference_fill fill = {map, 1};
    (void)shcdi_grid_visit_nodes(m->grid, m->resolution, fill_reference, &fill);
    return fill.ok ? SHCD_OK
                   : shcdi_fail(error, SHCD_ERR_CONVERGENCE,
                                "map_create: the crossing of a ray with the reference surface was "
                                "not found");
}

static shcd_status build(shcd_map *map, const shcd_map_options *options, shcd_error *error) {
    const shcd_model *model = map->model;
    const shcdi_map_settings settings = {options->grid, options->resolution,
                                         options->has_centre ? options->centre_m
                                                             : model->info.star_centre_m,
                                         options->without_bounds ? -1 : SHCDI_MAP_SPLITS_MAX};
    /* first what can be refused, since it is quick */
    shcd_status status = shcdi_reference_create(model, options, settings.centre, &map->allocator,
                                                &map->reference, error);
    if (status != SHCD_OK) {
        return status;
    }
    status = shcdi_map_build(model, &settings, &map->allocator, &map->map);
    if (status != SHCD_OK) {
        return shcdi_fail(error, status, "map_create: %s", shcd_status_string(status));
    }
    return map->reference.kind != SHCD_MAP_REFERENCE_NONE ? build_reference(map, error) : SHCD_OK;
}

/* A model gives its tree up once it is made; rays are cast through that of a second one. */
static shcd_status build_with_tree(shcd_map *map, const shcd_model *model,
                                   const shcd_map_options *options, shcd_error *error) {
    shcd_model *plain;
    shcd_status status = shcdi_model_create_plain(
        model->degree, model->coefficients, model->series.simd, &map->allocator, &plain, error);
    if (status == SHCD_OK) {
        plain->info = model->info;
        memcpy(plain->enclosure, model->enclosure,
               ((size_t)model->degree + 1) * sizeof *plain->enclosure);
        map->model = plain;
        status = build(map, options, error);
        map->model = model;
        shcd_model_free(plain);
    }
    return status;
}

shcd_status shcd_map_create(const shcd_model *model, const shcd_map_options *options,
                            const shcd_allocator *allocator, shcd_map **map, shcd_error *error) {
    if (model == NULL || map == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "map_create: no model, or no place for the map");
    }
    shcd_map_options read;
    shcd_status status = read_options(options, &read, error);
    if (status != SHCD_OK) {
        return status;
    }
    const shcd_allocator memory = shcdi_allocator(allocator);
    shcd_map *made = memory.allocate(sizeof *made, memory.user);
    if (made == NULL) {
        return shcdi_fail(error, SHCD_ERR_MEMORY, "map_create: out of memory");
    }
    memset(made, 0, sizeof *made);
    made->allocator = memory;
    status = build_with_tree(made, model, &read, error);
    if (status != SHCD_OK) {
        shcd_map_free(made);
        return status;
    }
    *map = made;
    return SHCD_OK;
}

void shcd_map_free(shcd_map *map) {
    if (map != NULL) {
        const shcd_allocator memory = map->allocator;
        shcdi_map_free(&map->map, &memory);
        shcdi_reference_free(&map->reference);
        memory.release(map, memory.user);
    }
}

/* ---- inspection ---- */

shcd_status shcd_map_describe(const shcd_map *map, shcd_map_info *info) {
    if (map == NULL || info == NULL || info->struct_size < sizeof info->struct_size) {
        return SHCD_ERR_ARGUMENT;
    }
    const shcdi_map *m = &map->map;
    const int octahedral = m->grid == SHCD_MAP_OCTAHEDRAL;
    const uint64_t low_bytes =
        map->reference.low != NULL ? map->reference.low->info.run_time_bytes : 0;
    shcd_map_info all = SHCD_MAP_INFO_INIT;
    all.grid = m->grid;
    all.resolution = m->resolution;
    all.n_nodes = shcdi_grid_nodes(m->grid, m->resolution);
    all.n_cells = m->n_cells;
    all.bytes = sizeof *map + shcdi_map_bytes(m) + low_bytes;
    all.centre_m = m->centre;
    all.centre_inside = m->centre_inside;
    all.crossings_max = m->crossings_max;
    all.one_crossing_share = m->one_crossing_share;
    all.equal_count_share = m->equal_count_share;
    all.bounded_share = m->bounded_share;
    all.linear_bound_m = m->bound_m;
    all.hermite_bound_m = octahedral ? SHCDI_MAP_HERMITE_RATIO * m->bound_m : 0.0;
    all.n_measured = m->n_measured;
    all.n_miscounted = m->n_miscounted;
    all.linear_error_max_m = m->linear_error_m;
    all.linear_error_rms_m = m->linear_rms_m;
    all.hermite_error_max_m = m->hermite_error_m;
    all.hermite_error_rms_m = m->hermite_rms_m;
    all.reference = map->reference.kind;
    all.reference_degree = map->reference.degree;
    all.reference_scale = map->reference.scale;
    all.reference_margin_m = map->reference.margin;
    all.star_margin_m = m->star_margin_m;
    const size_t size = info->struct_size < sizeof all ? info->struct_size : sizeof all;
    memcpy((char *)info + sizeof(size_t), (const char *)&all + sizeof(size_t),
           size - sizeof(size_t));
    return SHCD_OK;
}

/* ---- look-up ---- */

shcd_status shcd_map_look_up(const shcd_map *map, shcd_vec3 direction, int interpolation,
                             shcd_map_ray *ray) {
    const int hermite = interpolation == SHCD_MAP_HERMITE;
    if (map == NULL || ray == NULL || (!hermite && interpolation != SHCD_MAP_LINEAR) ||
        (hermite && map->map.grid != SHCD_MAP_OCTAHEDRAL)) {
        return SHCD_ERR_ARGUMENT;
    }
    shcd_vec3 unit;
    const shcd_status status = shcdi_direction(direction, &unit);
    if (status != SHCD_OK) {
        return status;
    }
    shcdi_map_ray r;
    shcdi_map_look_up(&map->map, unit, hermite, &r);
    memset(ray, 0, sizeof *ray);
    ray->bound_m = HUGE_VAL;
    if (map->map.reference != NULL) {
        ray->reference_m = shcdi_map_reference(&map->map, &r.at, hermite);
    }
    if (r.count < 0) {
        shcdi_map_take_nearest(&map->map, &r);
        const int unsure = map->map.count[r.nearest_cell] == SHCDI_MAP_UNSURE;
        ray->flags |= unsure ? SHCD_MAP_EDGE | SHCD_MAP_UNSURE : SHCD_MAP_EDGE;
    } else {
        ray->bound_m = shcdi_map_bound_at(&map->map, &r.at, hermite);
        ray->flags |= ray->bound_m < HUGE_VAL ? SHCD_MAP_BOUNDED : 0u;
    }
    ray->count = r.count;
    for (int k = 0; k < r.count; k++) {
        shcd_map_crossing *c = &ray->crossing[k];
        c->radius_m = r.radius[k];
        c->reference_distance_m = map->map.reference != NULL ? ray->reference_m - r.radius[k] : 0.0;
        shcdi_map_detail(&map->map, &r, k, unit, &c->slope_m, &c->parameter);
    }
    return SHCD_OK;
}

shcd_status shcd_map_reference_radius(const shcd_map *map, shcd_vec3 direction, double *radius_m) {
    if (map == NULL || radius_m == NULL || map->reference.kind == SHCD_MAP_REFERENCE_NONE) {
        return SHCD_ERR_ARGUMENT;
    }
    shcd_vec3 unit, normal;
    const shcd_status status = shcdi_direction(direction, &unit);
    if (status != SHCD_OK) {
        return status;
    }
    double radius;
    if (!shcdi_reference_at(&map->reference, unit, &radius, &normal)) {
        return SHCD_ERR_CONVERGENCE;
    }
    *radius_m = radius;
    return SHCD_OK;
}
