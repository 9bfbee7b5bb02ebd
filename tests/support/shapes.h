/* SPDX-License-Identifier: BSD-3-Clause */
/* Deforming bodies of tests. */
#ifndef SHCD_TESTS_SHAPES_H
#define SHCD_TESTS_SHAPES_H

#include "shcd/shape.h"
#include "support/bodies.h"

#include <string.h>

static inline void *shapes_block(const shcd_model *model) {
    void *memory = aligned_alloc(16, (shcd_shape_size(model) + 15) / 16 * 16);
    assert_non_null(memory);
    return memory;
}

static inline shcd_shape *shapes_create(const shcd_model *model) {
    shcd_shape *shape = NULL;
    assert_int_equal(shcd_shape_init(model, shapes_block(model), shcd_shape_size(model), &shape),
                     SHCD_OK);
    return shape;
}

static inline shcd_shape_info shapes_info(const shcd_model *model, const shcd_shape *shape) {
    shcd_shape_info info = SHCD_SHAPE_INFO_INIT;
    assert_int_equal(shcd_shape_describe(model, shape, &info), SHCD_OK);
    return info;
}

static inline shcd_vec3 shapes_point_near(check_random *random, const shcd_model_info *info) {
    const shcd_vec3 d = bodies_random_direction(random);
    return shcd_mul_add(info->centre_m, check_uniform(random, 0.0, 1.5) * info->radius_m, d);
}

static inline void shapes_assert_same_answers(const shcd_model *a, const shcd_shape *x,
                                              const shcd_shape *y, check_random *random) {
    const shcd_model_info info = bodies_info(a);
    for (int i = 0; i < 200; i++) {
        const shcd_vec3 p = shapes_point_near(random, &info);
        for (int32_t tier = SHCD_TIER_EXACT; tier <= SHCD_TIER_MAP; tier++) {
            shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
            shcd_proximity one, other;
            options.tier = tier;
            memset(&one, 0, sizeof one);
            memset(&other, 1, sizeof other);
            assert_int_equal(shcd_shape_closest(a, x, p, &options, &one), SHCD_OK);
            assert_int_equal(shcd_shape_closest(a, y, p, &options, &other), SHCD_OK);
            assert_memory_equal(&one, &other, sizeof one);
        }
    }
}

#endif
