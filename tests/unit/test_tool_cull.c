/* SPDX-License-Identifier: BSD-3-Clause */
/* Culling of convex tools: what it proves is true on deformed bodies, it proves what it should, it
 * saves sweeps the search, calls no allocator (libccd included), and ends on degenerate input. And
 * libccd as an independent oracle: on ellipsoids, GJK finds an intersection exactly where the gap
 * is negative. */
#include "daemon/count_allocations.h"
#include "query/tool_cull.h"
#include "query/tool_search.h"
#include "shcd/sweep.h"
#include "support/tools.h"

#include <ccd/ccd.h>

static const int kinds[5] = {SHCD_TOOL_POINT, SHCD_TOOL_SPHERE, SHCD_TOOL_CAPSULE, SHCD_TOOL_BOX,
                             SHCD_TOOL_HULL};

static shcd_shape *make_shape(const shcd_model *model, double amount, check_random *r) {
    const size_t n = 3 * SHCD_COUNT(shcd_model_degree(model));
    const size_t size = (shcd_shape_size(model) + 15) / 16 * 16;
    void *memory = aligned_alloc(16, size);
    double *now = calloc(n, sizeof *now);
    shcd_shape *shape = NULL;
    assert_non_null(memory);
    assert_non_null(now);
    assert_int_equal(shcd_shape_init(model, memory, size, &shape), SHCD_OK);
    for (size_t i = 0; i < n; i++) {
        now[i] =
            shcd_model_coefficients(model)[i] + amount * check_normal(r) / (1.0 + (double)(i / 3));
    }
    assert_int_equal(shcd_shape_set(model, shape, now, SHCD_FOLLOW_AUTO), SHCD_OK);
    free(now);
    return shape;
}

static shcd_pose random_pose(double reach, check_random *r) {
    return tools_random_pose(0.0, reach, r);
}

static void test_cull_is_true_on_deformed_bodies(void **state) {
    check_random random = {31};
    size_t culled = 0, separated = 0;
    (void)state;
    for (int b = 0; b < 6; b++) {
        shcd_model *model = bodies_create_random(&random, b % 2 == 0 ? 4 : 10, 0.05);
        const shcd_model_info info = bodies_info(model);
        shcd_shape *shape = make_shape(model, 0.02 * b, &random);
        shcdi_view view;
        shcdi_cull_body body;
        shcdi_view_of(model, shape, &view);
        shcdi_cull_body_of(&view, &body);
        for (size_t i = 0; i < check_scaled(100); i++) {
            test_tool t;
            tools_make_random(&t, kinds[i % 5], 0.5, &random);
            shcd_pose pose = random_pose(3.0 * info.radius_m, &random);
            pose.position_m = shcd_add(pose.position_m, info.centre_m);
            shcdi_placed_tool placed;
            shcd_tool_proximity got;
            shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
            options.evaluations_max = 500;
            double lower;
            assert_true(shcdi_place_tool(&view, t.geometry, pose, &placed));
            const int is_culled = shcdi_tool_cull(&body, &placed, 0.01, &lower);
            assert_int_equal(shcd_tool_closest(model, shape, t.geometry, pose, &options, &got),
                             SHCD_OK);
            assert_true(lower <= got.upper_m);
            assert_int_equal(is_culled, lower > 0.01);
            culled += (size_t)is_culled;
            separated += got.lower_m > 0.01;
            shcd_tool_geometry_free(t.geometry);
        }
        free(shape);
        shcd_model_free(model);
    }
    print_message("culled %zu of %zu that are 1 cm apart (seed 31)\n", culled, separated);
    assert_true(2 * culled > separated);
}

/* On an ellipsoid itself nothing is lost but libccd's patience. */
static void test_cull_is_sharp_on_ellipsoids(void **state) {
    check_random random = {32};
    size_t culled = 0, separated = 0;
    (void)state;
    for (int b = 0; b < 5; b++) {
        const double b_axis = check_uniform(&random, 0.05, 1.0);
        shcd_model *model =
            bodies_create_ellipsoid_turned(1.0, b_axis, check_uniform(&random, 0.05, 1.0), &random);
        shcdi_view view;
        shcdi_cull_body body;
        shcdi_view_of(model, NULL, &view);
        shcdi_cull_body_of(&view, &body);
        assert_at_most(body.offset_m, 1e-9);
        for (size_t i = 0; i < check_scaled(200); i++) {
            test_tool t;
            tools_make_random(&t, kinds[i % 5], 0.5, &random);
            const shcd_pose pose = random_pose(2.0, &random);
            shcdi_placed_tool placed;
            shcd_tool_proximity got;
            double lower;
            assert_true(shcdi_place_tool(&view, t.geometry, pose, &placed));
            shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
            options.evaluations_max = 500;
            assert_int_equal(shcd_tool_closest(model, NULL, t.geometry, pose, &options, &got),
                             SHCD_OK);
            if (got.lower_m > 0.02) {
                separated++;
                culled += (size_t)shcdi_tool_cull(&body, &placed, 0.0, &lower);
            }
            shcd_tool_geometry_free(t.geometry);
        }
        shcd_model_free(model);
    }
    print_message("ellipsoids: culled %zu of %zu that are 2 cm apart (seed 32)\n", culled,
                  separated);
    assert_true(separated > 0);
    assert_true((double)culled >= 0.99 * (double)separated);
}

/* Concentric, touching, of no extent, far away: where GJK's simplex degenerates. */
static void test_cull_ends_on_degenerate_input(void **state) {
    check_random random = {33};
    shcd_model *bodies[3] = {bodies_create_ellipsoid(1.0, 1.0, 1.0),
                             bodies_create_ellipsoid(1.0, 1.0, 1e-5),
                             bodies_create_ellipsoid(1.0, 3e-3, 3e-3)};
    static const double places[6] = {0.0, 1e-300, 1.0, 1.5, 1.0 + 1e-12, 1e12};
    (void)state;
    for (int b = 0; b < 3; b++) {
        shcdi_view view;
        shcdi_cull_body body;
        shcdi_view_of(bodies[b], NULL, &view);
        shcdi_cull_body_of(&view, &body);
        for (int k = 0; k < 5; k++) {
            test_tool t;
            tools_make_random(&t, kinds[k], 0.5, &random);
            for (int p = 0; p < 6; p++) {
                const shcd_pose pose = {{places[p], 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
                shcdi_placed_tool placed;
                double lower = NAN;
                assert_true(shcdi_place_tool(&view, t.geometry, pose, &placed));
                const int is_culled = shcdi_tool_cull(&body, &placed, 0.0, &lower);
                assert_true(lower <= places[p]);
                assert_int_equal(is_culled, lower > 0.0);
                if (p < 2) {
                    assert_false(is_culled);
                } else if (p == 5) {
                    assert_true(is_culled);
                }
            }
            shcd_tool_geometry_free(t.geometry);
        }
        shcd_model_free(bodies[b]);
    }
}

/* ---- where it saves the search ---- */

static shcd_pose moved(shcd_pose pose, double step, check_random *r) {
    pose.position_m = shcd_mul_add(pose.position_m, step, bodies_random_direction(r));
    shcd_quat *q = &pose.orientation;
    q->w += step * check_normal(r);
    q->x += step * check_normal(r);
    const double n = sqrt(q->w * q->w + q->x * q->x + q->y * q->y + q->z * q->z);
    *q = (shcd_quat){q->w / n, q->x / n, q->y / n, q->z / n};
    return pose;
}

/* A convex tool that cannot get there within its motion costs one evaluation and no patch, where
 * the query of its distance costs hundreds; and what the sweep says is true. */
static void test_sweeps_beyond_reach_look_at_no_patch(void **state) {
    check_random random = {37};
    size_t beyond = 0, far = 0, patches = 0;
    (void)state;
    for (int b = 0; b < 4; b++) {
        shcd_model *model = bodies_create_random(&random, b % 2 == 0 ? 4 : 10, 0.05);
        const shcd_model_info info = bodies_info(model);
        shcd_shape *shape = make_shape(model, 0.01 * b, &random);
        for (size_t i = 0; i < 20 + check_scaled(40); i++) {
            test_tool t;
            tools_make_random(&t, kinds[2 + i % 3], 0.3, &random);
            shcd_sweep_def def = SHCD_SWEEP_DEF_INIT;
            shcd_sweep_result swept;
            shcd_tool_proximity from, to;
            def.tool = t.geometry;
            def.shape = shape;
            def.from = random_pose(2.0 * info.radius_m, &random);
            def.from.position_m = shcd_add(def.from.position_m, info.centre_m);
            def.to = moved(def.from, 0.01, &random);
            shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
            options.evaluations_max = 500;
            assert_int_equal(shcd_tool_closest(model, shape, t.geometry, def.from, &options, &from),
                             SHCD_OK);
            assert_int_equal(shcd_tool_closest(model, shape, t.geometry, def.to, &options, &to),
                             SHCD_OK);
            if (from.lower_m > 0.1) { /* of a body of 1 m; the motion is a tenth of that */
                assert_int_equal(shcd_sweep(model, &def, NULL, 0, &swept), SHCD_OK);
                assert_int_equal(swept.outcome, SHCD_SWEEP_SEPARATED);
                assert_true(swept.time == 1.0);
                assert_true(swept.lower_m > 0.0);
                assert_true(swept.lower_m <= to.upper_m && to.lower_m <= swept.upper_m);
                far++;
                if (swept.n_patches == 0) {
                    const double at_start = shcd_norm(shcd_sub(swept.tool_point_m, swept.point_m));
                    beyond++;
                    patches += from.n_patches;
                    assert_int_equal(swept.n_evaluations, 1);
                    assert_int_equal(swept.n_queries, 1);
                    assert_true(from.n_patches > 100);
                    /* its points are the tool's and the surface's at the start */
                    assert_true(at_start >= from.lower_m - 1e-12);
                    assert_true(at_start <= swept.upper_m + 1e-12);
                }
            }
            shcd_tool_geometry_free(t.geometry);
        }
        free(shape);
        shcd_model_free(model);
    }
    print_message("%zu of %zu sweeps 10 cm away look at no patch; the query looks at %zu (seed "
                  "37)\n",
                  beyond, far, patches / (beyond > 0 ? beyond : 1));
    assert_true(far > 20 && 10 * beyond > 8 * far);
}

/* A budget that does not cover one look at all blocks: the proof is the cull's then, of tools
 * within the enclosing ball too. */
static void test_small_budgets_leave_the_cull(void **state) {
    check_random random = {38};
    shcd_model *model = bodies_create_ellipsoid_turned(1.0, 0.3, 0.2, &random);
    size_t proven = 0, separated = 0;
    (void)state;
    for (size_t i = 0; i < 60 + check_scaled(240); i++) {
        test_tool t;
        tools_make_random(&t, kinds[2 + i % 3], 0.1, &random);
        const shcd_pose pose = random_pose(0.9, &random); /* of a ball of 1 m */
        shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
        shcd_tool_proximity got, small;
        options.evaluations_max = 500;
        assert_int_equal(shcd_tool_closest(model, NULL, t.geometry, pose, &options, &got), SHCD_OK);
        options.evaluations_max = 0;
        options.patches_max = 20;
        assert_int_equal(shcd_tool_closest(model, NULL, t.geometry, pose, &options, &small),
                         SHCD_OK);
        assert_true(small.lower_m <= got.upper_m && got.lower_m <= small.upper_m);
        assert_true(small.n_patches <= 20 + 12 || got.lower_m <= 0.02);
        if (got.lower_m > 0.02) {
            separated++;
            proven += small.lower_m > 0.0;
            assert_int_equal(small.flags & SHCD_PROXIMITY_SIGN_UNSURE, 0);
        }
        shcd_tool_geometry_free(t.geometry);
    }
    print_message("20 patches: %zu of %zu that are 2 cm apart proven so (seed 38)\n", proven,
                  separated);
    assert_true(separated > 20 && 100 * proven >= 99 * separated);
    shcd_model_free(model);
}

static void test_place_tool_refuses_what_is_not_finite(void **state) {
    shcd_model *ball = bodies_create_ellipsoid(1.0, 1.0, 1.0);
    test_tool t = {.n_facets = 0};
    check_random random = {34};
    shcdi_view view;
    shcdi_placed_tool placed;
    (void)state;
    tools_make_random(&t, SHCD_TOOL_BOX, 0.5, &random);
    shcdi_view_of(ball, NULL, &view);
    for (int i = 0; i < 7; i++) {
        double v[7] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0};
        v[i] = NAN;
        const shcd_pose pose = {{v[0], v[1], v[2]}, {v[3], v[4], v[5], v[6]}};
        assert_false(shcdi_place_tool(&view, t.geometry, pose, &placed));
    }
    shcd_tool_geometry_free(t.geometry);
    shcd_model_free(ball);
}

static void test_queries_of_tools_do_not_allocate(void **state) {
    (void)state;
#ifndef COUNTS_ALLOCATIONS
    print_message("skipped: the allocator of this build is not ours to watch\n");
    skip();
#else
    check_random random = {35};
    shcd_model *model = bodies_create_random(&random, 8, 0.05);
    shcd_shape *shape = make_shape(model, 0.02, &random);
    long calls = 0;
    size_t gjk = 0;
    for (int i = 0; i < 100; i++) {
        test_tool t;
        shcdi_view view;
        shcdi_cull_body body;
        shcdi_placed_tool placed;
        shcd_tool_proximity got;
        double lower;
        tools_make_random(&t, kinds[i % 5], 0.5, &random);
        const shcd_pose pose = random_pose(2.5, &random);
        shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
        options.evaluations_max = 300;
        const long before = n_allocations;
        shcdi_view_of(model, shape, &view);
        shcdi_cull_body_of(&view, &body);
        assert_true(shcdi_place_tool(&view, t.geometry, pose, &placed));
        shcdi_tool_cull(&body, &placed, 0.0, &lower);
        gjk +=
            !(shcd_norm(shcd_sub(pose.position_m, body.centre_m)) > body.radius_m + t.def.radius_m);
        assert_int_equal(shcd_tool_closest(model, shape, t.geometry, pose, &options, &got),
                         SHCD_OK);
        const shcd_sweep_def sweep = {.struct_size = sizeof sweep,
                                      .tool = t.geometry,
                                      .from = pose,
                                      .to = pose,
                                      .shape = shape};
        shcd_sweep_result swept;
        assert_int_equal(shcd_sweep(model, &sweep, NULL, 0, &swept), SHCD_OK);
        calls += n_allocations - before;
        shcd_tool_geometry_free(t.geometry);
    }
    assert_int_equal(calls, 0);
    assert_true(gjk > 20 && n_allocations > 100); /* the watch is awake, libccd was asked */
    free(shape);
    shcd_model_free(model);
#endif
}

/* ---- libccd as an oracle --------------------------------------------------------------------- */

typedef struct oracle_tool {
    const test_tool *tool;
    shcd_pose pose;
} oracle_tool;

static void support_ellipsoid(const void *object, const ccd_vec3_t *d, ccd_vec3_t *out) {
    const double *a = object;
    double s[3], n = 0.0;
    for (int k = 0; k < 3; k++) {
        s[k] = a[k] * a[k] * (double)d->v[k];
        n += s[k] * (double)d->v[k];
    }
    n = sqrt(n);
    ccdVec3Set(out, s[0] / n, s[1] / n, s[2] / n);
}

static void support_oracle(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *out) {
    const oracle_tool *o = object;
    const shcd_tool_geometry_def *def = &o->tool->def;
    const shcd_vec3 d =
        shcd_rotate(shcd_conjugate(o->pose.orientation),
                    shcd_unit(shcd_vec3_make(direction->v[0], direction->v[1], direction->v[2])));
    shcd_vec3 x = {0.0, 0.0, 0.0};
    if (def->kind == SHCD_TOOL_CAPSULE) {
        x.z = copysign(def->half_length_m, d.z);
    } else if (def->kind == SHCD_TOOL_BOX) {
        const shcd_vec3 h = def->half_extents_m;
        x = shcd_vec3_make(copysign(h.x, d.x), copysign(h.y, d.y), copysign(h.z, d.z));
    } else if (def->kind == SHCD_TOOL_HULL) {
        double most = -HUGE_VAL;
        for (size_t i = 0; i < def->n_points; i++) {
            if (shcd_dot(d, o->tool->points[i]) > most) {
                most = shcd_dot(d, o->tool->points[i]);
                x = o->tool->points[i];
            }
        }
    }
    x = shcd_transform(o->pose, shcd_mul_add(x, def->radius_m, d));
    ccdVec3Set(out, x.x, x.y, x.z);
}

static void test_gjk_agrees_with_the_sign_of_the_gap(void **state) {
    check_random random = {36};
    size_t touching = 0, apart = 0;
    ccd_t ccd;
    CCD_INIT(&ccd);
    ccd.support1 = support_ellipsoid;
    ccd.support2 = support_oracle;
    ccd.max_iterations = 1000;
    (void)state;
    for (int b = 0; b < 10; b++) {
        double a[3];
        for (int k = 0; k < 3; k++) {
            a[k] = check_uniform(&random, 0.1, 1.0);
        }
        shcd_model *model = bodies_create_ellipsoid(a[0], a[1], a[2]);
        for (size_t i = 0; i < check_scaled(120); i++) {
            test_tool t;
            tools_make_random(&t, kinds[1 + i % 4], 0.8, &random);
            const oracle_tool o = {&t, random_pose(1.6, &random)};
            shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
            shcd_tool_proximity got;
            options.evaluations_max = 300; /* the sign, not the depth */
            assert_int_equal(shcd_tool_closest(model, NULL, t.geometry, o.pose, &options, &got),
                             SHCD_OK);
            if (got.upper_m < -1e-5 || got.lower_m > 1e-5) {
                assert_int_equal(ccdGJKIntersect(a, &o, &ccd), got.upper_m < 0.0);
                touching += got.upper_m < 0.0;
                apart += got.lower_m > 0.0;
            }
            shcd_tool_geometry_free(t.geometry);
        }
        shcd_model_free(model);
    }
    print_message("libccd agrees on %zu touching and %zu separate pairs (seed 36)\n", touching,
                  apart);
    assert_true(6 * touching > touching + apart && 6 * apart > touching + apart);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cull_is_true_on_deformed_bodies),
        cmocka_unit_test(test_cull_is_sharp_on_ellipsoids),
        cmocka_unit_test(test_cull_ends_on_degenerate_input),
        cmocka_unit_test(test_sweeps_beyond_reach_look_at_no_patch),
        cmocka_unit_test(test_small_budgets_leave_the_cull),
        cmocka_unit_test(test_place_tool_refuses_what_is_not_finite),
        cmocka_unit_test(test_queries_of_tools_do_not_allocate),
        cmocka_unit_test(test_gjk_agrees_with_the_sign_of_the_gap),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
