/* SPDX-License-Identifier: BSD-3-Clause */
/* The definition of a scene: what is refused, with which words, and what a scene then knows. */
#include "support/scene_draft.h"

/* ---- what is refused ------------------------------------------------------------------------ */

static char name_of_64[65];
static shcd_tool_geometry *capsule; /* borrowed from the test that uses it */

/* A function that spoils a draft in one way. */
#define SPOIL(name, statement)                                                                     \
    static void name(draft *d) {                                                                   \
        statement;                                                                                 \
    }

SPOIL(null_bodies, d->scene.bodies = NULL)
SPOIL(null_tools, d->scene.tools = NULL)
SPOIL(no_tools, d->scene.n_tools = 0)
SPOIL(many_tools, d->scene.n_tools = SHCD_TOOLS_MAX + 1)
SPOIL(many_bodies, d->scene.n_bodies = SHCD_BODIES_MAX + 1)
SPOIL(scene_size_0, d->scene.struct_size = 0)
SPOIL(scene_size_7, d->scene.struct_size = sizeof(size_t) - 1)
SPOIL(body_size_0, d->bodies[0].struct_size = 0)
SPOIL(body_size_7, d->bodies[0].struct_size = sizeof(size_t) - 1)
SPOIL(tool_size_0, d->tools[0].struct_size = 0)
SPOIL(tool_size_7, d->tools[0].struct_size = sizeof(size_t) - 1)
SPOIL(body_sizes_differ, d->bodies[1].struct_size -= 8)
SPOIL(tool_sizes_differ, d->tools[1].struct_size -= 8)
SPOIL(body_without_name, d->bodies[1].name = NULL)
SPOIL(body_with_empty_name, d->bodies[1].name = "")
SPOIL(body_name_too_long, memset(name_of_64, 'a', 64); d->bodies[1].name = name_of_64)
SPOIL(body_name_with_newline, d->bodies[1].name = "two\nlines")
SPOIL(bodies_of_one_name, d->bodies[1].name = "left")
SPOIL(tools_of_one_name, d->tools[1].name = "tip")
SPOIL(body_without_model, d->bodies[1].model = NULL)
SPOIL(body_at_nan, d->bodies[1].body_in_world.position_m.y = (double)NAN)
SPOIL(body_turned_by_inf, d->bodies[1].body_in_world.orientation.w = HUGE_VAL)
SPOIL(body_far_away, d->bodies[1].body_in_world.position_m.z = -1e10)
SPOIL(body_turned_by_no_rotation, d->bodies[1].body_in_world.orientation.w = 1.0 + 1e-6)
SPOIL(body_turned_by_zero, d->bodies[1].body_in_world.orientation.w = 0.0)
SPOIL(unknown_effect, d->effects[1].name = "stickiness")
SPOIL(effect_without_name, d->effects[1].name = NULL)
SPOIL(effect_twice, d->effects[1].name = "stiffness")
SPOIL(null_effects, d->bodies[1].effects = NULL)
SPOIL(unknown_parameter, d->parameters[1].name = "ration")
SPOIL(parameter_without_name, d->parameters[1].name = NULL)
SPOIL(null_parameters, d->effects[1].parameters = NULL)
SPOIL(parameter_twice, d->parameters[1] = d->parameters[0]; d->effects[0].n_parameters = 2)
SPOIL(parameter_nan, d->parameters[0].value = (double)NAN)
SPOIL(parameter_above, d->parameters[0].value = 2e5)
SPOIL(parameter_below, d->parameters[1].value = -0.1)
SPOIL(point_with_radius, d->tools[0].radius_m = 0.001)
SPOIL(sphere_without_radius, d->tools[1].radius_m = 0.0)
SPOIL(sphere_of_negative_radius, d->tools[1].radius_m = -0.001)
SPOIL(sphere_too_large, d->tools[1].radius_m = 1e10)
SPOIL(sphere_of_nan, d->tools[1].radius_m = (double)NAN)
SPOIL(unknown_kind, d->tools[1].kind = 7)
SPOIL(capsule_without_geometry, d->tools[1].kind = SHCD_TOOL_CAPSULE)
SPOIL(kind_of_another_geometry, d->tools[1].geometry = capsule)
SPOIL(share_above_1, d->tools[1].contact_share = 1.5)
SPOIL(share_negative, d->tools[1].contact_share = -0.5)
SPOIL(share_nan, d->tools[1].contact_share = (double)NAN)

static const struct refusal {
    void (*spoil)(draft *);
    shcd_status status;
    const char *message;
} refusals[] = {
    {null_bodies, SHCD_ERR_ARGUMENT, "bodies is null"},
    {null_tools, SHCD_ERR_ARGUMENT, "tools is null"},
    {no_tools, SHCD_ERR_ARGUMENT, "0 tools, must be 1 .. 16"},
    {many_tools, SHCD_ERR_ARGUMENT, "17 tools, must be 1 .. 16"},
    {many_bodies, SHCD_ERR_ARGUMENT, "65 bodies, at most 64 are allowed"},
    {scene_size_0, SHCD_ERR_ARGUMENT, "struct_size is 0; use SHCD_SCENE_DEF_INIT"},
    {scene_size_7, SHCD_ERR_ARGUMENT, "struct_size is 7; use SHCD_SCENE_DEF_INIT"},
    {body_size_0, SHCD_ERR_ARGUMENT, "body 0: struct_size is 0; use SHCD_BODY_DEF_INIT"},
    {body_size_7, SHCD_ERR_ARGUMENT, "body 0: struct_size is 7; use SHCD_BODY_DEF_INIT"},
    {tool_size_0, SHCD_ERR_ARGUMENT, "tool 0: struct_size is 0; use SHCD_TOOL_DEF_INIT"},
    {tool_size_7, SHCD_ERR_ARGUMENT, "tool 0: struct_size is 7; use SHCD_TOOL_DEF_INIT"},
    {body_sizes_differ, SHCD_ERR_ARGUMENT, "body 1: struct_size differs from that of body 0"},
    {tool_sizes_differ, SHCD_ERR_ARGUMENT, "tool 1: struct_size differs from that of tool 0"},
    {body_without_name, SHCD_ERR_ARGUMENT, "body 1 has no name"},
    {body_with_empty_name, SHCD_ERR_ARGUMENT, "body 1 has no name"},
    {body_name_too_long, SHCD_ERR_ARGUMENT, "the name of body 1 is longer than 63 bytes"},
    {body_name_with_newline, SHCD_ERR_ARGUMENT, "the name of body 1 holds a control character"},
    {bodies_of_one_name, SHCD_ERR_ARGUMENT, "two bodies are named 'left'"},
    {tools_of_one_name, SHCD_ERR_ARGUMENT, "two tools are named 'tip'"},
    {body_without_model, SHCD_ERR_ARGUMENT, "body 'right' has no model"},
    {body_at_nan, SHCD_ERR_NOT_FINITE, "body 'right': its pose is not finite"},
    {body_turned_by_inf, SHCD_ERR_NOT_FINITE, "body 'right': its pose is not finite"},
    {body_far_away, SHCD_ERR_ARGUMENT,
     "body 'right': a coordinate of its position exceeds 1e+09 m"},
    {body_turned_by_no_rotation, SHCD_ERR_ARGUMENT,
     "body 'right': its orientation is not a unit quaternion (|q|^2 = 1.000002)"},
    {body_turned_by_zero, SHCD_ERR_ARGUMENT,
     "body 'right': its orientation is not a unit quaternion (|q|^2 = 0)"},
    {unknown_effect, SHCD_ERR_ARGUMENT, "body 'left': unknown effect 'stickiness'"},
    {effect_without_name, SHCD_ERR_ARGUMENT, "body 'left': unknown effect '(null)'"},
    {effect_twice, SHCD_ERR_ARGUMENT, "body 'left': effect 'stiffness' is given twice"},
    {null_effects, SHCD_ERR_ARGUMENT, "body 'right': effects is null"},
    {unknown_parameter, SHCD_ERR_ARGUMENT,
     "body 'left': effect 'damping': unknown parameter 'ration'"},
    {parameter_without_name, SHCD_ERR_ARGUMENT,
     "body 'left': effect 'damping': unknown parameter '(null)'"},
    {null_parameters, SHCD_ERR_ARGUMENT, "body 'left': effect 'damping': parameters is null"},
    {parameter_twice, SHCD_ERR_ARGUMENT,
     "body 'left': effect 'stiffness': parameter 'k_n_per_m' is given twice"},
    {parameter_nan, SHCD_ERR_NOT_FINITE,
     "body 'left': effect 'stiffness': parameter 'k_n_per_m' is not finite"},
    {parameter_above, SHCD_ERR_ARGUMENT,
     "body 'left': effect 'stiffness': parameter 'k_n_per_m' is 200000, must lie in 0 .. 100000 "
     "N/m"},
    {parameter_below, SHCD_ERR_ARGUMENT,
     "body 'left': effect 'damping': parameter 'ratio' is -0.1, must lie in 0 .. 1"},
    {point_with_radius, SHCD_ERR_ARGUMENT, "tool 'tip': a point has radius_m 0, not 0.001 m"},
    {sphere_without_radius, SHCD_ERR_ARGUMENT,
     "tool 'ball': radius_m is 0, must lie above 0, up to 1e+09 m"},
    {sphere_of_negative_radius, SHCD_ERR_ARGUMENT,
     "tool 'ball': radius_m is -0.001, must lie above 0, up to 1e+09 m"},
    {sphere_too_large, SHCD_ERR_ARGUMENT,
     "tool 'ball': radius_m is 1e+10, must lie above 0, up to 1e+09 m"},
    {sphere_of_nan, SHCD_ERR_NOT_FINITE, "tool 'ball': radius_m is not finite"},
    {unknown_kind, SHCD_ERR_ARGUMENT, "tool 'ball': unknown kind 7"},
    {capsule_without_geometry, SHCD_ERR_ARGUMENT, "tool 'ball': kind 2 needs a geometry"},
    {kind_of_another_geometry, SHCD_ERR_ARGUMENT, "tool 'ball': kind is 1, that of its geometry 2"},
    {share_above_1, SHCD_ERR_ARGUMENT,
     "tool 'ball': contact_share is 1.5, must lie above 0, up to 1"},
    {share_negative, SHCD_ERR_ARGUMENT,
     "tool 'ball': contact_share is -0.5, must lie above 0, up to 1"},
    {share_nan, SHCD_ERR_NOT_FINITE, "tool 'ball': contact_share is not finite"},
};

static void test_create_refuses_each_fault_with_its_own_words(void **state) {
    (void)state;
    capsule = fixture_capsule(0.004, 0.02);
    for (size_t i = 0; i < sizeof refusals / sizeof refusals[0]; i++) {
        draft d;
        shcd_error error = {SHCD_OK, ""};
        char expected[sizeof error.message];
        shcd_scene *const untouched = (shcd_scene *)(void *)&d;
        shcd_scene *scene = untouched;
        draft_make(&d);
        refusals[i].spoil(&d);
        snprintf(expected, sizeof expected, "scene_create: %s", refusals[i].message);
        assert_int_equal(shcd_scene_create(&d.scene, NULL, &scene, &error), refusals[i].status);
        assert_string_equal(error.message, expected);
        assert_int_equal(error.status, refusals[i].status);
        assert_ptr_equal(scene, untouched);
        assert_int_equal(shcd_scene_create(&d.scene, NULL, &scene, NULL), refusals[i].status);
    }
    shcd_tool_geometry_free(capsule);
}

static void test_create_refuses_null_arguments(void **state) {
    draft d;
    shcd_scene *scene = NULL;
    const shcd_allocator nothing = {NULL, NULL, NULL};
    (void)state;
    draft_make(&d);
    assert_int_equal(shcd_scene_create(NULL, NULL, &scene, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_scene_create(&d.scene, NULL, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_scene_create(&d.scene, &nothing, &scene, NULL), SHCD_ERR_ARGUMENT);
    assert_null(scene);
}

/* ---- what is accepted ----------------------------------------------------------------------- */

static void test_create_copies_names(void **state) {
    draft d;
    char name[] = "left";
    shcd_scene *scene;
    (void)state;
    draft_make(&d);
    d.bodies[0].name = name;
    scene = draft_create(&d);
    memset(&d, 0, sizeof d);
    memset(name, 'x', sizeof name - 1);
    assert_int_equal(shcd_scene_body_count(scene), 2);
    assert_int_equal(shcd_scene_tool_count(scene), 2);
    assert_string_equal(shcd_scene_body_name(scene, 0), "left");
    assert_string_equal(shcd_scene_body_name(scene, 1), "right");
    assert_null(shcd_scene_body_name(scene, 2));
    assert_string_equal(shcd_scene_tool_name(scene, 0), "tip");
    assert_string_equal(shcd_scene_tool_name(scene, 1), "ball");
    assert_null(shcd_scene_tool_name(scene, 2));
    shcd_scene_free(scene);
    shcd_scene_free(NULL);
}

static void test_accessors_accept_null(void **state) {
    (void)state;
    assert_int_equal(shcd_scene_body_count(NULL), 0);
    assert_int_equal(shcd_scene_tool_count(NULL), 0);
    assert_null(shcd_scene_body_name(NULL, 0));
    assert_null(shcd_scene_tool_name(NULL, 0));
    assert_int_equal(shcd_state_size(NULL), 0);
}

static void test_create_accepts_a_name_of_63_bytes(void **state) {
    draft d;
    char name[64] = "";
    shcd_scene *scene;
    (void)state;
    draft_make(&d);
    memset(name, 'b', 63);
    d.bodies[1].name = name;
    scene = draft_create(&d);
    assert_string_equal(shcd_scene_body_name(scene, 1), name);
    shcd_scene_free(scene);
}

static void test_create_accepts_no_body(void **state) {
    draft d;
    shcd_scene *scene;
    (void)state;
    draft_make(&d);
    d.scene.bodies = NULL;
    d.scene.n_bodies = 0;
    scene = draft_create(&d);
    assert_int_equal(shcd_scene_body_count(scene), 0);
    shcd_scene_free(scene);
}

/* A caller compiled with a later header: longer elements, so a longer stride. */
static void test_create_strides_over_longer_elements(void **state) {
    struct later_body {
        shcd_body_def body;
        double more[3];
    } bodies[2];
    struct later_tool {
        shcd_tool_def tool;
        double more;
    } tools[2];
    draft d;
    shcd_scene *scene;
    (void)state;
    draft_make(&d);
    memset(bodies, 0x5a, sizeof bodies);
    memset(tools, 0x5a, sizeof tools);
    for (size_t i = 0; i < 2; i++) {
        bodies[i].body = d.bodies[i];
        bodies[i].body.struct_size = sizeof bodies[0];
        tools[i].tool = d.tools[i];
        tools[i].tool.struct_size = sizeof tools[0];
    }
    d.scene.bodies = &bodies[0].body;
    d.scene.tools = &tools[0].tool;
    scene = draft_create(&d);
    assert_string_equal(shcd_scene_body_name(scene, 1), "right");
    assert_string_equal(shcd_scene_tool_name(scene, 1), "ball");
    shcd_scene_free(scene);
}

/* A caller compiled with an earlier header, whose body ended before the effects. */
static void test_create_reads_shorter_elements_as_defaults(void **state) {
    draft d;
    shcd_scene *scene;
    (void)state;
    draft_make(&d);
    d.scene.n_bodies = 1;
    d.bodies[0].struct_size = offsetof(shcd_body_def, effects);
    d.effects[0].name = "would be refused if it were read";
    scene = draft_create(&d);
    assert_string_equal(shcd_scene_body_name(scene, 0), "left");
    shcd_scene_free(scene);
}

/* ---- memory --------------------------------------------------------------------------------- */

typedef struct counting {
    size_t n_allocations;
    size_t n_live;
    size_t fail_from; /* allocations with this index and later ones fail */
} counting;

static void *counting_allocate(size_t size, void *user) {
    counting *c = user;
    if (c->n_allocations++ >= c->fail_from) {
        return NULL;
    }
    c->n_live++;
    return malloc(size);
}

static void counting_release(void *memory, void *user) {
    counting *c = user;
    c->n_live -= memory != NULL;
    free(memory);
}

static void test_create_with_failing_allocator_leaves_nothing_behind(void **state) {
    draft d;
    counting c = {0, 0, SIZE_MAX};
    const shcd_allocator allocator = {counting_allocate, counting_release, &c};
    shcd_scene *scene = NULL;
    size_t n;
    (void)state;
    draft_make(&d);
    assert_int_equal(shcd_scene_create(&d.scene, &allocator, &scene, NULL), SHCD_OK);
    n = c.n_allocations;
    assert_true(n > 0);
    shcd_scene_free(scene);
    assert_int_equal(c.n_live, 0);
    for (size_t k = 0; k < n; k++) {
        shcd_error error = {SHCD_OK, ""};
        memset(&c, 0, sizeof c);
        c.fail_from = k;
        scene = NULL;
        assert_int_equal(shcd_scene_create(&d.scene, &allocator, &scene, &error), SHCD_ERR_MEMORY);
        assert_non_null(strstr(error.message, "scene_create: no memory"));
        assert_null(scene);
        assert_int_equal(c.n_live, 0);
    }
}

static void test_create_refused_allocates_nothing(void **state) {
    draft d;
    counting c = {0, 0, SIZE_MAX};
    const shcd_allocator allocator = {counting_allocate, counting_release, &c};
    shcd_scene *scene = NULL;
    (void)state;
    draft_make(&d);
    d.tools[1].kind = 7;
    assert_int_equal(shcd_scene_create(&d.scene, &allocator, &scene, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(c.n_allocations, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_create_refuses_each_fault_with_its_own_words),
        cmocka_unit_test(test_create_refuses_null_arguments),
        cmocka_unit_test(test_create_copies_names),
        cmocka_unit_test(test_accessors_accept_null),
        cmocka_unit_test(test_create_accepts_a_name_of_63_bytes),
        cmocka_unit_test(test_create_accepts_no_body),
        cmocka_unit_test(test_create_strides_over_longer_elements),
        cmocka_unit_test(test_create_reads_shorter_elements_as_defaults),
        cmocka_unit_test(test_create_with_failing_allocator_leaves_nothing_behind),
        cmocka_unit_test(test_create_refused_allocates_nothing),
    };
    return cmocka_run_group_tests(tests, draft_model_make, draft_model_free);
}
