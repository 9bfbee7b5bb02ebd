/* SPDX-License-Identifier: BSD-3-Clause */
/* Short forms for the tests of distance maps. */
#ifndef SHCD_TESTS_MAPS_H
#define SHCD_TESTS_MAPS_H

#include "model/map.h"
#include "support/bodies.h"
#include "support/check.h"

/** Float storage rounds by half a unit in the last place, 2^-25 relative, and interpolation adds no
 *  more than that again. */
#define MAPS_STORED 6e-8

static inline shcd_map *maps_create(const shcd_model *model, const shcd_map_options *options) {
    shcd_map *map = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcd_map_create(model, options, NULL, &map, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return map;
}

/** The same body with its tree, which shcdi_cast() needs and a finished model has given up. */
static inline shcd_model *maps_with_tree(const shcd_model *model) {
    shcd_model *plain = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcdi_model_create_plain(model->degree, model->coefficients, model->series.simd,
                                 &model->allocator, &plain, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return plain;
}

static inline shcd_map_options maps_on_grid(int grid, int resolution) {
    shcd_map_options options = SHCD_MAP_OPTIONS_INIT;
    options.grid = grid;
    options.resolution = resolution;
    return options;
}

static inline shcd_map_info maps_describe(const shcd_map *map) {
    shcd_map_info info = SHCD_MAP_INFO_INIT;
    assert_int_equal(shcd_map_describe(map, &info), SHCD_OK);
    return info;
}

static inline shcd_map_ray maps_look(const shcd_map *map, shcd_vec3 d, int interpolation) {
    shcd_map_ray ray;
    assert_int_equal(shcd_map_look_up(map, d, interpolation, &ray), SHCD_OK);
    return ray;
}

#endif
