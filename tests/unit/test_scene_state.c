/* SPDX-License-Identifier: BSD-3-Clause */
/* The state of a scene: the memory it takes, and which scenes may step with it. */
#include "support/scene_draft.h"

static void *aligned_state(size_t size) {
    void *memory = aligned_alloc(16, (size + 15) / 16 * 16);
    assert_non_null(memory);
    return memory;
}

static void test_state_init_refuses_unfit_memory(void **state) {
    draft d;
    shcd_scene *scene;
    shcd_state *made = NULL;
    unsigned char *memory;
    size_t size;
    (void)state;
    draft_make(&d);
    scene = draft_create(&d);
    size = shcd_state_size(scene);
    memory = aligned_state(size + 16);
    assert_int_equal(shcd_state_init(scene, memory, size - 1, &made), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_state_init(scene, memory + 8, size + 8, &made), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_state_init(scene, NULL, size, &made), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_state_init(NULL, memory, size, &made), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_state_init(scene, memory, size, NULL), SHCD_ERR_ARGUMENT);
    assert_null(made);
    assert_int_equal(shcd_state_init(scene, memory, size, &made), SHCD_OK);
    assert_ptr_equal(made, memory);
    free(memory);
    shcd_scene_free(scene);
}

/* Steps `scene` with the state of a scene made from `other`. */
static shcd_status step_with_state_of(const shcd_scene *scene, const draft *other) {
    shcd_scene *owner = draft_create(other);
    void *memory = aligned_state(shcd_state_size(owner));
    shcd_state *made = NULL;
    shcd_tool_input in[2];
    shcd_tool_output out[2];
    const shcd_input input = {.dt_s = FIXTURE_TICK_S, .tools = in, .n_tools = 2};
    shcd_output output = {.tools = out, .n_tools = 2};
    shcd_status status;
    memset(in, 0, sizeof in);
    assert_int_equal(shcd_state_init(owner, memory, shcd_state_size(owner), &made), SHCD_OK);
    status = shcd_step(scene, made, &input, &output);
    free(memory);
    shcd_scene_free(owner);
    return status;
}

static void test_state_belongs_to_equal_scenes_only(void **state) {
    draft d;
    shcd_scene *scene;
    (void)state;
    draft_make(&d);
    scene = draft_create(&d);
    assert_int_equal(step_with_state_of(scene, &d), SHCD_OK);
    /* the order in which a body names its effects is not part of the scene */
    d.effects[0].name = "damping";
    d.effects[0].parameters = &d.parameters[1];
    d.effects[1].name = "stiffness";
    d.effects[1].parameters = &d.parameters[0];
    d.bodies[1].effects = &d.effects[1];
    assert_int_equal(step_with_state_of(scene, &d), SHCD_OK);
    draft_make(&d);
    d.parameters[0].value = 501.0;
    assert_int_equal(step_with_state_of(scene, &d), SHCD_ERR_ARGUMENT);
    draft_make(&d);
    d.bodies[0].body_in_world.position_m.x += 1e-9;
    assert_int_equal(step_with_state_of(scene, &d), SHCD_ERR_ARGUMENT);
    draft_make(&d);
    d.tools[1].radius_m = 0.005;
    assert_int_equal(step_with_state_of(scene, &d), SHCD_ERR_ARGUMENT);
    draft_make(&d);
    d.bodies[0].name = "other";
    assert_int_equal(step_with_state_of(scene, &d), SHCD_ERR_ARGUMENT);
    draft_make(&d);
    d.bodies[1].n_effects = 2;
    assert_int_equal(step_with_state_of(scene, &d), SHCD_ERR_ARGUMENT);
    shcd_scene_free(scene);
}

/* What a geometry holds counts, not where it lies. */
static void test_state_belongs_to_tools_of_equal_geometry(void **state) {
    const shcd_vec3 points[2] = {{0.0, 0.0, 0.0}, {0.01, 0.0, 0.0}};
    const shcd_vec3 others[2] = {{0.0, 0.0, 0.0}, {0.01, 0.0, 1e-9}};
    const shcd_vec3 normals[2] = {{0.0, 0.0, 1.0}, {0.0, 0.0, 1.0}};
    shcd_tool_geometry *geometries[6] = {
        fixture_shell(points, normals, 2), fixture_shell(points, normals, 2),
        fixture_shell(others, normals, 2), fixture_capsule(0.004, 0.02),
        fixture_capsule(0.004, 0.021),     fixture_capsule(0.004, 0.02)};
    draft d;
    (void)state;
    for (size_t g = 0; g < 6; g += 3) {
        draft_make(&d);
        d.tools[1] =
            fixture_tool_of("ball", g == 0 ? SHCD_TOOL_SHELL : SHCD_TOOL_CAPSULE, geometries[g]);
        shcd_scene *scene = draft_create(&d);
        d.tools[1].geometry = geometries[g == 0 ? 1 : 5];
        assert_int_equal(step_with_state_of(scene, &d), SHCD_OK);
        d.tools[1].geometry = geometries[g == 0 ? 2 : 4];
        assert_int_equal(step_with_state_of(scene, &d), SHCD_ERR_ARGUMENT);
        d.tools[1].geometry = geometries[g];
        d.tools[1].contact_share = 0.5;
        assert_int_equal(step_with_state_of(scene, &d), SHCD_ERR_ARGUMENT);
        d.tools[1].contact_share = 0.0;
        d.tools[1].evaluations_max = 17;
        assert_int_equal(step_with_state_of(scene, &d), SHCD_ERR_ARGUMENT);
        shcd_scene_free(scene);
    }
    for (size_t g = 0; g < 6; g++) {
        shcd_tool_geometry_free(geometries[g]);
    }
}

/* An effect without a memory of its own takes its gain: three numbers, once for the scene. */
static void test_state_grows_by_the_gains_of_stateless_effects(void **state) {
    draft d;
    shcd_scene *with;
    shcd_scene *without;
    (void)state;
    draft_make(&d);
    with = draft_create(&d);
    d.bodies[0].n_effects = 0;
    d.bodies[1].n_effects = 0;
    without = draft_create(&d);
    assert_int_equal(shcd_state_size(with),
                     shcd_state_size(without) + 24 * shcd_scene_effect_count(with));
    assert_int_equal(shcd_scene_effect_count(without), 0);
    shcd_scene_free(with);
    shcd_scene_free(without);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_state_init_refuses_unfit_memory),
        cmocka_unit_test(test_state_belongs_to_equal_scenes_only),
        cmocka_unit_test(test_state_belongs_to_tools_of_equal_geometry),
        cmocka_unit_test(test_state_grows_by_the_gains_of_stateless_effects),
    };
    return cmocka_run_group_tests(tests, draft_model_make, draft_model_free);
}
