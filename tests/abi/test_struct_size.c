/* SPDX-License-Identifier: BSD-3-Clause */
/* Callers built with older headers pass shorter structures, callers built with newer ones longer
 * structures: both work, and a structure without a size is refused. */
#include "shcd/shcd.h"
#include "support/scene_fixture.h"

#include "abi/sized.h"

#define NEWER 24 /* bytes that a newer header would have appended */

static const double coefficients[12] = {[3 * 3 + 0] = 0.06, [3 * 1 + 1] = 0.05, [3 * 2 + 2] = 0.04};

static shcd_model_def definition(void) {
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    def.degree = 1;
    def.coefficients = coefficients;
    return def;
}

/* ---- model ---- */

static void check_model_created(size_t size) {
    const shcd_model_def def = definition();
    shcd_model_def *given = sized_input(&def, sizeof def, size);
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcd_model_create(given, NULL, &model, &error) != SHCD_OK) {
        fail_msg("struct_size %zu: %s", size, error.message);
    }
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    assert_int_equal(shcd_model_describe(model, &info), SHCD_OK);
    assert_int_equal(info.degree, 1);
    assert_int_equal(info.fit.n_triangles, 0);
    shcd_model_free(model);
    free(given);
}

static void test_model_create_old_or_new_caller_works(void **unused) {
    (void)unused;
    check_model_created(offsetof(shcd_model_def, fit));
    check_model_created(sizeof(shcd_model_def));
    check_model_created(sizeof(shcd_model_def) + NEWER);
}

static void test_model_create_without_size_is_refused(void **unused) {
    (void)unused;
    const size_t sizes[] = {0, 1, sizeof(size_t) - 1};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        shcd_model_def def = definition();
        shcd_model *model = NULL;
        shcd_error error = {SHCD_OK, ""};
        def.struct_size = sizes[i];
        sized_check_refusal(shcd_model_create(&def, NULL, &model, &error), &error);
        assert_null(model);
    }
}

static void test_model_create_too_short_for_what_it_needs_is_refused(void **unused) {
    (void)unused;
    shcd_model_def def = definition();
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    def.struct_size = offsetof(shcd_model_def, coefficients);
    assert_int_equal(shcd_model_create(&def, NULL, &model, &error), SHCD_ERR_ARGUMENT);
    assert_string_equal(error.message, "model_create: coefficients is null");
}

static void test_model_describe_fills_what_the_caller_knows(void **unused) {
    (void)unused;
    shcd_model *model = fixture_ellipsoid(0.03, 0.02, 0.01);
    shcd_model_info whole = SHCD_MODEL_INFO_INIT;
    assert_int_equal(shcd_model_describe(model, &whole), SHCD_OK);
    for (size_t size = sizeof(size_t); size <= sizeof whole + NEWER; size += sizeof(size_t)) {
        shcd_model_info *info = sized_copy("", 0, size);
        assert_int_equal(shcd_model_describe(model, info), SHCD_OK);
        sized_check_output(info, size, &whole, sizeof whole);
    }
    shcd_model_info none = whole;
    none.struct_size = 0;
    none.degree = -1;
    assert_int_equal(shcd_model_describe(model, &none), SHCD_ERR_ARGUMENT);
    assert_int_equal(none.degree, -1);
    shcd_model_free(model);
}

/* ---- query ---- */

static void test_closest_options_of_any_caller_give_the_same_bits(void **unused) {
    (void)unused;
    shcd_model *model = fixture_ellipsoid(0.03, 0.02, 0.01);
    const shcd_vec3 point = {0.01, 0.02, 0.03};
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    options.tier = SHCD_TIER_FAST;
    shcd_proximity whole, out;
    assert_int_equal(shcd_closest(model, point, &options, &whole), SHCD_OK);
    const size_t sizes[] = {offsetof(shcd_query_options, tolerance),
                            offsetof(shcd_query_options, patches_max), sizeof options,
                            sizeof options + NEWER};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        shcd_query_options *given = sized_input(&options, sizeof options, sizes[i]);
        assert_int_equal(shcd_closest(model, point, given, &out), SHCD_OK);
        assert_memory_equal(&out, &whole, sizeof out);
        free(given);
    }
    options.struct_size = 0;
    memset(&out, 0x55, sizeof out);
    const shcd_proximity before = out;
    assert_int_equal(shcd_closest(model, point, &options, &out), SHCD_ERR_ARGUMENT);
    assert_memory_equal(&out, &before, sizeof out);
    shcd_model_free(model);
}

/* ---- distance map ---- */

static shcd_map *make_map(const shcd_model *model, size_t size) {
    shcd_map_options options = SHCD_MAP_OPTIONS_INIT;
    shcd_map *map = NULL;
    shcd_error error = {SHCD_OK, ""};
    options.resolution = 8;
    shcd_map_options *given = sized_input(&options, sizeof options, size);
    if (shcd_map_create(model, given, NULL, &map, &error) != SHCD_OK) {
        fail_msg("struct_size %zu: %s", size, error.message);
    }
    free(given);
    return map;
}

static void test_map_create_old_or_new_caller_gets_the_same(void **unused) {
    (void)unused;
    shcd_model *model = fixture_ellipsoid(0.03, 0.02, 0.01);
    shcd_map_info whole = SHCD_MAP_INFO_INIT, info = SHCD_MAP_INFO_INIT;
    shcd_map *map = make_map(model, sizeof(shcd_map_options));
    assert_int_equal(shcd_map_describe(map, &whole), SHCD_OK);
    shcd_map_free(map);
    const size_t sizes[] = {
        offsetof(shcd_map_options, has_centre), offsetof(shcd_map_options, centre_m),
        offsetof(shcd_map_options, superquadric_e1), sizeof(shcd_map_options) + NEWER};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        map = make_map(model, sizes[i]);
        assert_int_equal(shcd_map_describe(map, &info), SHCD_OK);
        assert_memory_equal(&info, &whole, sizeof info);
        shcd_map_free(map);
    }
    shcd_model_free(model);
}

static void test_map_create_without_size_is_refused(void **unused) {
    (void)unused;
    shcd_model *model = fixture_ellipsoid(0.03, 0.02, 0.01);
    shcd_map_options options = SHCD_MAP_OPTIONS_INIT;
    shcd_map *map = NULL;
    shcd_error error = {SHCD_OK, ""};
    options.struct_size = 0;
    sized_check_refusal(shcd_map_create(model, &options, NULL, &map, &error), &error);
    assert_null(map);
    shcd_model_free(model);
}

static void test_map_describe_fills_what_the_caller_knows(void **unused) {
    (void)unused;
    shcd_model *model = fixture_ellipsoid(0.03, 0.02, 0.01);
    shcd_map *map = make_map(model, sizeof(shcd_map_options));
    shcd_map_info whole = SHCD_MAP_INFO_INIT;
    assert_int_equal(shcd_map_describe(map, &whole), SHCD_OK);
    for (size_t size = sizeof(size_t); size <= sizeof whole + NEWER; size += sizeof(size_t)) {
        shcd_map_info *info = sized_copy("", 0, size);
        assert_int_equal(shcd_map_describe(map, info), SHCD_OK);
        sized_check_output(info, size, &whole, sizeof whole);
    }
    shcd_map_info none = whole;
    none.struct_size = 0;
    none.resolution = -1;
    assert_int_equal(shcd_map_describe(map, &none), SHCD_ERR_ARGUMENT);
    assert_int_equal(none.resolution, -1);
    shcd_map_free(map);
    shcd_model_free(model);
}

/* ---- scene ---- */

typedef struct scene_parts {
    shcd_model *model;
    shcd_body_def body[2];
    shcd_tool_def tool[2];
    shcd_scene_def scene;
} scene_parts;

static void scene_parts_fill(scene_parts *parts) {
    memset(parts, 0, sizeof *parts);
    const shcd_pose aside = {{0.1, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
    const shcd_scene_def scene = SHCD_SCENE_DEF_INIT;
    parts->model = fixture_ellipsoid(0.03, 0.02, 0.01);
    parts->body[0] =
        fixture_body("left", parts->model, (shcd_pose){{0}, {1.0, 0.0, 0.0, 0.0}}, NULL, 0);
    parts->body[1] = fixture_body("right", parts->model, aside, NULL, 0);
    parts->tool[0] = fixture_tool("thumb", 0.0);
    parts->tool[1] = fixture_tool("finger", 0.0);
    parts->scene = scene;
    parts->scene.bodies = parts->body;
    parts->scene.n_bodies = 2;
    parts->scene.tools = parts->tool;
    parts->scene.n_tools = 2;
}

/* An array of two elements of a caller whose elements are `size` bytes long. */
static void *pair_of(const void *first, const void *second, size_t known, size_t size) {
    unsigned char *pair = malloc(2 * size);
    void *one = sized_input(first, known, size), *two = sized_input(second, known, size);
    assert_non_null(pair);
    memcpy(pair, one, size);
    memcpy(pair + size, two, size);
    free(one);
    free(two);
    return pair;
}

static void check_scene_created(size_t body_size, size_t tool_size, size_t scene_size) {
    scene_parts parts;
    shcd_scene *scene = NULL;
    shcd_error error = {SHCD_OK, ""};
    scene_parts_fill(&parts);
    shcd_body_def *bodies =
        pair_of(&parts.body[0], &parts.body[1], sizeof parts.body[0], body_size);
    shcd_tool_def *tools = pair_of(&parts.tool[0], &parts.tool[1], sizeof parts.tool[0], tool_size);
    parts.scene.bodies = bodies;
    parts.scene.tools = tools;
    shcd_scene_def *given = sized_input(&parts.scene, sizeof parts.scene, scene_size);
    if (shcd_scene_create(given, NULL, &scene, &error) != SHCD_OK) {
        fail_msg("bodies of %zu bytes, tools of %zu, scene of %zu: %s", body_size, tool_size,
                 scene_size, error.message);
    }
    assert_string_equal(shcd_scene_body_name(scene, 1), "right");
    assert_string_equal(shcd_scene_tool_name(scene, 1), "finger");
    shcd_scene_free(scene);
    free(given);
    free(bodies);
    free(tools);
    shcd_model_free(parts.model);
}

static void test_scene_create_old_or_new_caller_works(void **unused) {
    (void)unused;
    const size_t body = sizeof(shcd_body_def), tool = sizeof(shcd_tool_def),
                 scene = sizeof(shcd_scene_def);
    check_scene_created(body, tool, scene);
    check_scene_created(offsetof(shcd_body_def, effects), tool, scene);
    check_scene_created(body, offsetof(shcd_tool_def, radius_m), scene);
    check_scene_created(body, offsetof(shcd_tool_def, geometry), scene); /* before tools had one */
    check_scene_created(body + NEWER, tool + NEWER, scene + NEWER);
}

static void test_scene_create_without_size_is_refused(void **unused) {
    (void)unused;
    scene_parts parts;
    scene_parts_fill(&parts);
    size_t *const sizes[] = {&parts.scene.struct_size, &parts.body[0].struct_size,
                             &parts.tool[0].struct_size, &parts.body[1].struct_size,
                             &parts.tool[1].struct_size};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        const size_t right = *sizes[i];
        shcd_scene *scene = NULL;
        shcd_error error = {SHCD_OK, ""};
        *sizes[i] = 0;
        sized_check_refusal(shcd_scene_create(&parts.scene, NULL, &scene, &error), &error);
        assert_null(scene);
        *sizes[i] = right;
    }
    shcd_model_free(parts.model);
}

static void test_scene_create_too_short_for_what_it_needs_is_refused(void **unused) {
    (void)unused;
    scene_parts parts;
    shcd_scene *scene = NULL;
    shcd_error error = {SHCD_OK, ""};
    scene_parts_fill(&parts);
    parts.scene.struct_size = offsetof(shcd_scene_def, tools);
    assert_int_equal(shcd_scene_create(&parts.scene, NULL, &scene, &error), SHCD_ERR_ARGUMENT);
    assert_string_equal(error.message, "scene_create: 0 tools, must be 1 .. 16");
    assert_null(scene);
    shcd_model_free(parts.model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_model_create_old_or_new_caller_works),
        cmocka_unit_test(test_model_create_without_size_is_refused),
        cmocka_unit_test(test_model_create_too_short_for_what_it_needs_is_refused),
        cmocka_unit_test(test_model_describe_fills_what_the_caller_knows),
        cmocka_unit_test(test_closest_options_of_any_caller_give_the_same_bits),
        cmocka_unit_test(test_map_create_old_or_new_caller_gets_the_same),
        cmocka_unit_test(test_map_create_without_size_is_refused),
        cmocka_unit_test(test_map_describe_fills_what_the_caller_knows),
        cmocka_unit_test(test_scene_create_old_or_new_caller_works),
        cmocka_unit_test(test_scene_create_without_size_is_refused),
        cmocka_unit_test(test_scene_create_too_short_for_what_it_needs_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
