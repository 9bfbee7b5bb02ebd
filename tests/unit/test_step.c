/* SPDX-License-Identifier: BSD-3-Clause */
/* The tick: several bodies and tools, bad input, replay, and what a tick may cost. Linked
 * statically with the allocation functions wrapped, so that an allocation inside shcd_step is seen.
 */
#include "support/scene_fixture.h"

#define RADIUS_M 0.05
#define STIFFNESS_N_PER_M 300.0

/* The contract of shcd_closest: a distance to 1e-9 of max(diagonal, distance). */
#define DISTANCE_TOLERANCE 1e-9

static const shcd_effect_def spring = {"stiffness", NULL, 0};
static const shcd_effect_def spring_and_damping[2] = {{"stiffness", NULL, 0}, {"damping", NULL, 0}};
static const shcd_vec3 at_rest = {0.0, 0.0, 0.0};

static shcd_model *sphere;    /* of RADIUS_M */
static shcd_model *ellipsoid; /* half axes 60, 40, 30 mm */
static shcd_model *plate;     /* 40 x 40 x 2 mm */

static int make_models(void **state) {
    (void)state;
    sphere = fixture_sphere(RADIUS_M);
    ellipsoid = fixture_ellipsoid(0.06, 0.04, 0.03);
    plate = fixture_ellipsoid(0.02, 0.02, 0.001);
    return 0;
}

static int free_models(void **state) {
    (void)state;
    shcd_model_free(sphere);
    shcd_model_free(ellipsoid);
    shcd_model_free(plate);
    return 0;
}

/* ---- several bodies and tools --------------------------------------------------------------- */

static void test_step_sums_the_forces_of_several_bodies(void **state) {
    const shcd_body_def bodies[3] = {
        fixture_body("a", sphere, fixture_pose(0.0, 0.0, 0.0), &spring, 1),
        fixture_body("b", sphere, fixture_pose(0.09, 0.0, 0.0), &spring, 1),
        fixture_body("c", sphere, fixture_pose(0.045, 0.3, 0.0), &spring, 1)};
    const shcd_tool_def tool = fixture_tool("tool", 0.0);
    const shcd_vec3 p = {0.044, 0.003, 0.0};
    const double depth_a = RADIUS_M - shcd_norm(p);
    const shcd_vec3 from_b = shcd_sub(p, shcd_vec3_make(0.09, 0.0, 0.0));
    const double depth_b = RADIUS_M - shcd_norm(from_b);
    const shcd_vec3 expected = shcd_add(shcd_scale(STIFFNESS_N_PER_M * depth_a, shcd_unit(p)),
                                        shcd_scale(STIFFNESS_N_PER_M * depth_b, shcd_unit(from_b)));
    fixture f;
    (void)state;
    fixture_open(&f, bodies, 3, &tool, 1);
    fixture_move(&f, p, at_rest);
    assert_vec3_near(f.out[0].wrench.force_n, expected, 1e-7 * STIFFNESS_N_PER_M * depth_a);
    assert_int_equal(f.out[0].body, 0);
    assert_near(f.out[0].penetration_m, depth_a, DISTANCE_TOLERANCE * fixture_diagonal(sphere));
    assert_true(depth_a > depth_b && depth_b > 0.0);
    fixture_close(&f);
}

/* The order of the bodies changes neither the force nor what is reported. */
static void test_step_does_not_depend_on_the_order_of_bodies(void **state) {
    check_random random = {15};
    const shcd_body_def a = fixture_body("a", sphere, fixture_pose(0.0, 0.0, 0.0), &spring, 1);
    const shcd_body_def b =
        fixture_body("b", ellipsoid, fixture_random_pose(&random, 0.03), spring_and_damping, 2);
    const shcd_body_def ab[2] = {a, b};
    const shcd_body_def ba[2] = {b, a};
    const shcd_tool_def tool = fixture_tool("tool", 0.005);
    fixture one;
    fixture other;
    (void)state;
    fixture_open(&one, ab, 2, &tool, 1);
    fixture_open(&other, ba, 2, &tool, 1);
    for (size_t i = 0; i < 400; i++) {
        const double t = (double)i / 400.0;
        const shcd_vec3 p = {0.09 * cos(6.0 * t), 0.07 * sin(9.0 * t), 0.05 * cos(11.0 * t)};
        const shcd_vec3 v = {0.1 * sin(5.0 * t), 0.1, -0.2 * t};
        fixture_move(&one, p, v);
        fixture_move(&other, p, v);
        /* the sum of two is commutative: equal, not only near */
        assert_memory_equal(&one.out[0].wrench, &other.out[0].wrench, sizeof(shcd_wrench));
        assert_true(one.out[0].distance_m == other.out[0].distance_m);
        assert_int_equal(one.out[0].body, 1 - other.out[0].body);
    }
    fixture_close(&one);
    fixture_close(&other);
}

static void test_step_tools_do_not_influence_each_other(void **state) {
    const shcd_body_def body =
        fixture_body("body", ellipsoid, fixture_pose(0.0, 0.0, 0.0), spring_and_damping, 2);
    const shcd_tool_def tools[2] = {fixture_tool("tip", 0.0), fixture_tool("ball", 0.006)};
    fixture both;
    fixture alone[2];
    (void)state;
    fixture_open(&both, &body, 1, tools, 2);
    fixture_open(&alone[0], &body, 1, &tools[0], 1);
    fixture_open(&alone[1], &body, 1, &tools[1], 1);
    for (size_t i = 0; i < 300; i++) {
        const double t = (double)i / 300.0;
        for (size_t k = 0; k < 2; k++) {
            const double s = k == 0 ? 1.0 : -1.0;
            both.in[k].tool_in_world.position_m =
                shcd_vec3_make(0.065 * cos(4.0 * t), s * 0.045 * sin(4.0 * t), s * 0.01);
            both.in[k].velocity_m_per_s = shcd_vec3_make(-0.1, 0.05 * s, 0.0);
            alone[k].in[0] = both.in[k];
            fixture_step(&alone[k]);
        }
        fixture_step(&both);
        assert_memory_equal(&both.out[0], &alone[0].out[0], sizeof both.out[0]);
        assert_memory_equal(&both.out[1], &alone[1].out[0], sizeof both.out[1]);
    }
    fixture_close(&both);
    fixture_close(&alone[0]);
    fixture_close(&alone[1]);
}

/* The bounds that spare queries must never hide the nearest body: along coherent paths with leaps,
 * the reported distance is the least over all bodies by brute force. */
static void test_step_reports_the_nearest_body(void **state) {
    enum { N = 12 };
    check_random random = {16};
    const shcd_tool_def tool = fixture_tool("ball", 0.002);
    const shcd_model *models[3];
    char names[N][8];
    shcd_body_def bodies[N];
    shcd_vec3 p = {0.0, 0.0, 0.0};
    fixture f;
    (void)state;
    models[0] = sphere;
    models[1] = ellipsoid;
    models[2] = plate;
    for (size_t b = 0; b < N; b++) {
        snprintf(names[b], sizeof names[b], "b%zu", b);
        bodies[b] =
            fixture_body(names[b], models[b % 3], fixture_random_pose(&random, 0.3), NULL, 0);
    }
    fixture_open(&f, bodies, N, &tool, 1);
    for (size_t i = 0; i < check_scaled(2000); i++) {
        double best = HUGE_VAL;
        const double leap = i % 50 == 0 ? 0.3 : 0.004;
        p = shcd_mul_add(p, leap, fixture_random_direction(&random));
        p = shcd_norm(p) > 0.5 ? shcd_scale(0.5, p) : p;
        fixture_move(&f, p, at_rest);
        for (size_t b = 0; b < N; b++) {
            shcd_proximity closest;
            assert_int_equal(shcd_closest(bodies[b].model,
                                          shcd_transform_inverse(bodies[b].body_in_world, p), NULL,
                                          &closest),
                             SHCD_OK);
            best = closest.distance_m < best ? closest.distance_m : best;
        }
        if (best > 0.0) { /* inside, the proxy decides, not the distance */
            assert_near(f.out[0].distance_m, best - 0.002,
                        2.0 * DISTANCE_TOLERANCE * (best + fixture_diagonal(ellipsoid)));
        } else {
            assert_true(f.out[0].distance_m < 0.0);
        }
    }
    fixture_close(&f);
}

static void test_step_without_bodies_is_at_infinite_distance(void **state) {
    const shcd_tool_def tool = fixture_tool("tool", 0.0);
    fixture f;
    (void)state;
    fixture_open(&f, NULL, 0, &tool, 1);
    fixture_move(&f, shcd_vec3_make(0.1, 0.2, 0.3), at_rest);
    assert_true(f.out[0].distance_m == HUGE_VAL);
    assert_int_equal(f.out[0].body, -1);
    assert_int_equal(f.out[0].flags, 0);
    assert_no_force(&f.out[0]);
    fixture_close(&f);
}

/* ---- bad input ------------------------------------------------------------------------------ */

static void test_step_flags_bad_tools_and_gives_no_force(void **state) {
    const double bad[] = {(double)NAN, HUGE_VAL, -HUGE_VAL, 1e300};
    const shcd_body_def body =
        fixture_body("body", sphere, fixture_pose(0.0, 0.0, 0.0), spring_and_damping, 2);
    const shcd_tool_def tools[2] = {fixture_tool("bad", 0.0), fixture_tool("good", 0.0)};
    const shcd_pose pressed = fixture_pose(0.045, 0.0, 0.0);
    fixture f;
    (void)state;
    fixture_open(&f, &body, 1, tools, 2);
    for (size_t field = 0; field < 13; field++) {
        for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
            shcd_tool_input *in = &f.in[0];
            double *const fields[13] = {
                &in->tool_in_world.position_m.x,   &in->tool_in_world.position_m.y,
                &in->tool_in_world.position_m.z,   &in->tool_in_world.orientation.w,
                &in->tool_in_world.orientation.x,  &in->tool_in_world.orientation.y,
                &in->tool_in_world.orientation.z,  &in->velocity_m_per_s.x,
                &in->velocity_m_per_s.y,           &in->velocity_m_per_s.z,
                &in->angular_velocity_rad_per_s.x, &in->angular_velocity_rad_per_s.y,
                &in->angular_velocity_rad_per_s.z};
            in->tool_in_world = pressed;
            in->velocity_m_per_s = at_rest;
            in->angular_velocity_rad_per_s = at_rest;
            f.in[1] = f.in[0];
            *fields[field] = bad[i];
            fixture_step(&f);
            assert_int_equal(f.out[0].flags, SHCD_TOOL_OUTPUT_BAD_INPUT);
            assert_no_force(&f.out[0]);
            assert_int_equal(f.out[1].flags, SHCD_TOOL_OUTPUT_CONTACT);
            assert_near(f.out[1].wrench.force_n.x, 1.5, 1e-6);
        }
    }
    f.in[0] = f.in[1];
    f.in[0].tool_in_world.orientation.w = 1.0 + 1e-6;
    fixture_step(&f);
    assert_int_equal(f.out[0].flags, SHCD_TOOL_OUTPUT_BAD_INPUT);
    f.in[0].tool_in_world.orientation.w = 1.0 + 4e-7;
    fixture_step(&f);
    assert_int_equal(f.out[0].flags, SHCD_TOOL_OUTPUT_CONTACT);
    fixture_close(&f);
}

static void test_step_refuses_a_wrong_call_and_writes_nothing(void **state) {
    fixture f;
    shcd_tool_output untouched[SHCD_TOOLS_MAX];
    unsigned char *snapshot;
    (void)state;
    fixture_open_one(&f, sphere, fixture_pose(0.0, 0.0, 0.0), 0.0);
    memset(f.out, 0x5a, sizeof f.out);
    memset(untouched, 0x5a, sizeof untouched);
    snapshot = malloc(shcd_state_size(f.scene));
    assert_non_null(snapshot);
    memcpy(snapshot, f.state, shcd_state_size(f.scene));
    const shcd_input good = {0.001, f.in, 1};
    shcd_output output = {f.out, 1};
    const shcd_input bad[] = {{0.0, f.in, 1},         {-0.001, f.in, 1},   {0.11, f.in, 1},
                              {(double)NAN, f.in, 1}, {HUGE_VAL, f.in, 1}, {0.001, NULL, 1},
                              {0.001, f.in, 0},       {0.001, f.in, 2}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_int_equal(shcd_step(f.scene, f.state, &bad[i], &output), SHCD_ERR_ARGUMENT);
    }
    shcd_output no_tools = {NULL, 1};
    shcd_output wrong_count = {f.out, 2};
    assert_int_equal(shcd_step(f.scene, f.state, &good, &no_tools), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_step(f.scene, f.state, &good, &wrong_count), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_step(f.scene, f.state, &good, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_step(f.scene, f.state, NULL, &output), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_step(f.scene, NULL, &good, &output), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_step(NULL, f.state, &good, &output), SHCD_ERR_ARGUMENT);
    assert_memory_equal(f.out, untouched, sizeof untouched);
    assert_memory_equal(f.state, snapshot, shcd_state_size(f.scene));
    free(snapshot);
    fixture_close(&f);
}

/* ---- replay --------------------------------------------------------------------------------- */

/* A path of two tools over and into two bodies. */
static void place_tools(fixture *f, size_t tick) {
    const double t = (double)tick * FIXTURE_TICK_S;
    f->in[0].tool_in_world.position_m =
        shcd_vec3_make(0.07 * cos(9.0 * t), 0.05 * sin(7.0 * t), 0.035 * cos(13.0 * t));
    f->in[0].velocity_m_per_s = shcd_vec3_make(-0.6 * sin(9.0 * t), 0.3 * cos(7.0 * t), 0.1);
    f->in[1].tool_in_world.position_m =
        shcd_vec3_make(0.1 + 0.06 * cos(5.0 * t), 0.01 * sin(t), 0.02 * sin(8.0 * t));
    f->in[1].flags = tick % 97 == 0 ? 0 : SHCD_TOOL_INPUT_ACTIVE;
}

static void open_pair(fixture *f) {
    const shcd_body_def bodies[2] = {
        fixture_body("ellipsoid", ellipsoid, fixture_pose(0.0, 0.0, 0.0), spring_and_damping, 2),
        fixture_body("plate", plate, fixture_pose(0.1, 0.0, 0.0), &spring, 1)};
    const shcd_tool_def tools[2] = {fixture_tool("tip", 0.0), fixture_tool("ball", 0.003)};
    fixture_open(f, bodies, 2, tools, 2);
}

static void test_step_snapshot_by_memcpy_replays_bit_for_bit(void **state) {
    enum { BEFORE = 300, AFTER = 500 };
    static shcd_tool_output recorded[AFTER][2];
    fixture f;
    fixture other;
    (void)state;
    open_pair(&f);
    open_pair(&other);
    for (size_t i = 0; i < BEFORE; i++) {
        place_tools(&f, i);
        fixture_step(&f);
    }
    /* into other memory, of another scene built from the same definition */
    memcpy(other.memory, f.memory, shcd_state_size(f.scene));
    for (size_t i = 0; i < AFTER; i++) {
        place_tools(&f, BEFORE + i);
        fixture_step(&f);
        memcpy(recorded[i], f.out, sizeof recorded[i]);
    }
    for (size_t i = 0; i < AFTER; i++) {
        place_tools(&other, BEFORE + i);
        fixture_step(&other);
        assert_memory_equal(recorded[i], other.out, sizeof recorded[i]);
    }
    assert_memory_equal(f.memory, other.memory, shcd_state_size(f.scene));
    fixture_close(&f);
    fixture_close(&other);
}

/* ---- what a tick costs ---------------------------------------------------------------------- */

static size_t n_allocations;

void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__real_realloc(void *memory, size_t size);
void __real_free(void *memory);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t n, size_t size);
void *__wrap_realloc(void *memory, size_t size);
void __wrap_free(void *memory);

void *__wrap_malloc(size_t size) {
    n_allocations++;
    return __real_malloc(size);
}
void *__wrap_calloc(size_t n, size_t size) {
    n_allocations++;
    return __real_calloc(n, size);
}
void *__wrap_realloc(void *memory, size_t size) {
    n_allocations++;
    return __real_realloc(memory, size);
}
void __wrap_free(void *memory) {
    n_allocations++;
    __real_free(memory);
}

static void test_step_neither_allocates_nor_frees(void **state) {
    fixture f;
    size_t before = n_allocations;
    (void)state;
    open_pair(&f);
    assert_true(n_allocations > before); /* the trap is set */
    for (size_t i = 0; i < 1000; i++) {
        const shcd_input input = {FIXTURE_TICK_S, f.in, 2};
        shcd_output output = {f.out, 2};
        shcd_status status;
        place_tools(&f, i);
        before = n_allocations;
        status = shcd_step(f.scene, f.state, &input, &output);
        assert_int_equal(n_allocations, before);
        assert_int_equal(status, SHCD_OK);
    }
    fixture_close(&f);
}

static void test_step_far_bodies_cost_no_evaluation(void **state) {
    char names[SHCD_BODIES_MAX][8];
    shcd_body_def bodies[SHCD_BODIES_MAX];
    const shcd_tool_def tool = fixture_tool("tool", 0.002);
    fixture one;
    fixture all;
    (void)state;
    for (size_t b = 0; b < SHCD_BODIES_MAX; b++) {
        snprintf(names[b], sizeof names[b], "b%zu", b);
        bodies[b] = fixture_body(names[b], sphere,
                                 fixture_pose(0.2 * (double)(b % 8), 0.2 * (double)(b / 8), 0.0),
                                 &spring, 1);
    }
    fixture_open(&one, bodies, 1, &tool, 1);
    fixture_open(&all, bodies, SHCD_BODIES_MAX, &tool, 1);
    for (size_t i = 0; i < 200; i++) {
        const shcd_vec3 p = {0.056 - 0.0001 * (double)i, 0.001, 0.002};
        fixture_move(&one, p, at_rest);
        fixture_move(&all, p, at_rest);
        assert_memory_equal(&one.out[0], &all.out[0], sizeof one.out[0]);
    }
    fixture_close(&one);
    fixture_close(&all);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_step_sums_the_forces_of_several_bodies),
        cmocka_unit_test(test_step_does_not_depend_on_the_order_of_bodies),
        cmocka_unit_test(test_step_tools_do_not_influence_each_other),
        cmocka_unit_test(test_step_reports_the_nearest_body),
        cmocka_unit_test(test_step_without_bodies_is_at_infinite_distance),
        cmocka_unit_test(test_step_flags_bad_tools_and_gives_no_force),
        cmocka_unit_test(test_step_refuses_a_wrong_call_and_writes_nothing),
        cmocka_unit_test(test_step_snapshot_by_memcpy_replays_bit_for_bit),
        cmocka_unit_test(test_step_neither_allocates_nor_frees),
        cmocka_unit_test(test_step_far_bodies_cost_no_evaluation),
    };
    return cmocka_run_group_tests(tests, make_models, free_models);
}
