/* SPDX-License-Identifier: BSD-3-Clause */
/* Sweeps of capsules and boxes that turn while they move, past a body that is a ball: the gap has a
 * closed form at every time, which is sampled densely. */
#include "shcd/shcd.h"
#include "shcd/sweep.h"
#include "support/bodies.h"
#include "support/check.h"
#include "support/sweep_path.h"

#define BALL 0.3
#define TIMES 4000
#define TOLERANCE 1e-5

typedef struct convex {
    shcd_tool_geometry *geometry;
    shcd_vec3 half; /* of the core: a segment is a thin box */
    double radius;
} convex;

static convex tool_create(int kind, check_random *random) {
    shcd_tool_geometry_def def = SHCD_TOOL_GEOMETRY_DEF_INIT;
    shcd_error error = {SHCD_OK, ""};
    convex t = {NULL, {0.0, 0.0, 0.0}, 0.0};
    def.kind = kind;
    t.radius = kind == SHCD_TOOL_BOX ? 0.0 : check_uniform(random, 0.005, 0.05);
    def.radius_m = t.radius;
    if (kind == SHCD_TOOL_CAPSULE) {
        def.half_length_m = t.half.z = check_uniform(random, 0.02, 0.3);
    } else {
        t.half.x = check_uniform(random, 0.01, 0.2);
        t.half.y = check_uniform(random, 0.01, 0.2);
        t.half.z = check_uniform(random, 0.01, 0.2);
        def.half_extents_m = t.half;
    }
    assert_int_equal(shcd_tool_geometry_create(&def, NULL, &t.geometry, &error), SHCD_OK);
    return t;
}

static double clamp(double x, double half) {
    return x < -half ? -half : x > half ? half : x;
}

/* From the ball's centre to the core, less both radii. */
static double gap_at(const convex *tool, const shcd_sweep_def *def, double t) {
    const shcd_vec3 zero = {0.0, 0.0, 0.0};
    const shcd_vec3 c = shcd_transform_inverse(sweep_path_pose(def, t), zero);
    const shcd_vec3 on = {clamp(c.x, tool->half.x), clamp(c.y, tool->half.y),
                          clamp(c.z, tool->half.z)};
    return shcd_norm(shcd_sub(c, on)) - tool->radius - BALL;
}

static shcd_quat random_turn(check_random *r) {
    const double w = check_normal(r), x = check_normal(r), y = check_normal(r), z = check_normal(r);
    const double n = sqrt(w * w + x * x + y * y + z * z);
    const shcd_quat q = {w / n, x / n, y / n, z / n};
    return q;
}

/* A turn by up to `size` rad from a. */
static shcd_quat turned(shcd_quat a, double size, check_random *r) {
    shcd_quat b = {a.w + size * check_normal(r), a.x + size * check_normal(r),
                   a.y + size * check_normal(r), a.z + size * check_normal(r)};
    const double n = sqrt(b.w * b.w + b.x * b.x + b.y * b.y + b.z * b.z);
    b.w /= n;
    b.x /= n;
    b.y /= n;
    b.z /= n;
    return b;
}

static void check_sweep(const convex *tool, const shcd_sweep_def *def,
                        const shcd_sweep_result *out) {
    for (int i = 0; i <= TIMES; i++) {
        assert_true(gap_at(tool, def, out->time * i / TIMES) > 0.0);
    }
    const double gap = gap_at(tool, def, out->time);
    assert_true(out->lower_m > 0.0);
    assert_true(out->lower_m <= gap + 1e-14 && gap <= out->upper_m + 1e-14);
    if (out->outcome == SHCD_SWEEP_CONTACT) {
        assert_true(out->upper_m <= def->tolerance_m);
        assert_true(gap > 0.0 && gap <= def->tolerance_m);
        assert_near(shcd_norm(shcd_sub(out->tool_point_m, out->point_m)), gap, def->tolerance_m);
        assert_near(shcd_norm(out->point_m), BALL, 1e-8);
    } else {
        assert_true(out->time == 1.0);
    }
}

static void run(int kind, uint64_t seed) {
    check_random random = {seed};
    shcd_model *model = bodies_create_ellipsoid(BALL, BALL, BALL);
    size_t n_contacts = 0, n_overlaps = 0;
    uint32_t steps = 0, queries = 0;
    const size_t n_tools = check_scaled(8), n_sweeps = 40;
    for (size_t i = 0; i < n_tools; i++) {
        convex t = tool_create(kind, &random);
        for (size_t k = 0; k < n_sweeps; k++) {
            shcd_sweep_def def = SHCD_SWEEP_DEF_INIT;
            shcd_sweep_result out;
            def.tool = t.geometry;
            def.tolerance_m = TOLERANCE;
            def.from.orientation = random_turn(&random);
            def.to.orientation =
                k % 4 == 0 ? random_turn(&random)
                           : turned(def.from.orientation, k % 4 == 1 ? 0.0 : 0.3, &random);
            def.from.position_m =
                shcd_scale(check_uniform(&random, 0.4, 0.9), bodies_random_direction(&random));
            def.to.position_m =
                shcd_scale(check_uniform(&random, 0.1, 0.7), bodies_random_direction(&random));
            assert_int_equal(shcd_sweep(model, &def, NULL, 0, &out), SHCD_OK);
            if (out.outcome == SHCD_SWEEP_OVERLAP_AT_START) {
                n_overlaps++;
                assert_true(gap_at(&t, &def, 0.0) <= 1e-9);
                continue;
            }
            if (out.outcome == SHCD_SWEEP_TRUNCATED) {
                fail_msg(
                    "sweep %zu of tool %zu ended at a cap: time %g, gap in [%g, %g], %u steps, "
                    "%u queries, %u evaluations",
                    k, i, out.time, out.lower_m, out.upper_m, out.n_steps, out.n_queries,
                    out.n_evaluations);
            }
            check_sweep(&t, &def, &out);
            n_contacts += out.outcome == SHCD_SWEEP_CONTACT;
            steps = out.n_steps > steps ? out.n_steps : steps;
            queries = out.n_queries > queries ? out.n_queries : queries;
        }
        shcd_tool_geometry_free(t.geometry);
    }
    print_message(
        "seed %llu: %zu sweeps, %zu contacts, %zu overlaps at the start, at most %u steps, "
        "%u queries\n",
        (unsigned long long)seed, n_tools * n_sweeps, n_contacts, n_overlaps, steps, queries);
    assert_true(n_contacts > n_tools * n_sweeps / 8);
    assert_true(n_overlaps < n_tools * n_sweeps / 2);
    shcd_model_free(model);
}

static void test_sweep_turning_capsule_past_a_ball(void **state) {
    (void)state;
    run(SHCD_TOOL_CAPSULE, 20261206);
}

static void test_sweep_turning_box_past_a_ball(void **state) {
    (void)state;
    run(SHCD_TOOL_BOX, 20261207);
}

/* A rod that only turns, half a turn within the tick, meets the ball with its tip. */
static void test_sweep_rod_in_half_a_turn_hits_with_its_tip(void **state) {
    (void)state;
    shcd_model *model = bodies_create_ellipsoid(BALL, BALL, BALL);
    shcd_tool_geometry_def rod = SHCD_TOOL_GEOMETRY_DEF_INIT;
    shcd_error error = {SHCD_OK, ""};
    convex t = {NULL, {0.0, 0.0, 0.25}, 0.01};
    rod.kind = SHCD_TOOL_CAPSULE;
    rod.radius_m = t.radius;
    rod.half_length_m = t.half.z;
    assert_int_equal(shcd_tool_geometry_create(&rod, NULL, &t.geometry, &error), SHCD_OK);
    shcd_sweep_def def = SHCD_SWEEP_DEF_INIT;
    shcd_sweep_result out;
    def.tool = t.geometry;
    def.tolerance_m = TOLERANCE;
    def.from.position_m = def.to.position_m = shcd_vec3_make(0.5, 0.0, 0.0);
    def.from.orientation.w = 1.0;
    def.to.orientation.y = 1.0;
    assert_int_equal(shcd_sweep(model, &def, NULL, 0, &out), SHCD_OK);
    assert_int_equal(out.outcome, SHCD_SWEEP_CONTACT);
    check_sweep(&t, &def, &out);
    assert_true(out.time > 0.1 && out.time < 0.5);
    shcd_tool_geometry_free(t.geometry);
    shcd_model_free(model);
}

static void test_sweep_shell_is_unsupported(void **state) {
    (void)state;
    shcd_model *model = bodies_create_ellipsoid(BALL, BALL, BALL);
    const shcd_vec3 points[2] = {{0.0, 0.0, 0.0}, {0.1, 0.0, 0.0}};
    const shcd_vec3 normals[2] = {{1.0, 0.0, 0.0}, {-1.0, 0.0, 0.0}};
    shcd_tool_geometry_def shell = SHCD_TOOL_GEOMETRY_DEF_INIT;
    shcd_error error = {SHCD_OK, ""};
    shcd_tool_geometry *geometry = NULL;
    shell.kind = SHCD_TOOL_SHELL;
    shell.points = points;
    shell.normals = normals;
    shell.n_points = 2;
    assert_int_equal(shcd_tool_geometry_create(&shell, NULL, &geometry, &error), SHCD_OK);
    shcd_sweep_def def = SHCD_SWEEP_DEF_INIT;
    shcd_sweep_result out;
    def.tool = geometry;
    def.from.orientation.w = def.to.orientation.w = 1.0;
    assert_int_equal(shcd_sweep(model, &def, NULL, 0, &out), SHCD_ERR_UNSUPPORTED);
    shcd_tool_geometry_free(geometry);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sweep_turning_capsule_past_a_ball),
        cmocka_unit_test(test_sweep_turning_box_past_a_ball),
        cmocka_unit_test(test_sweep_rod_in_half_a_turn_hits_with_its_tip),
        cmocka_unit_test(test_sweep_shell_is_unsupported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
