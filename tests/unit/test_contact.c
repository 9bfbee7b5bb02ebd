/* SPDX-License-Identifier: BSD-3-Clause */
/* The contact of one tool with one body: force and depth against closed forms, the proxy of a tool
 * that has gone in, and what following it costs. */
#include "support/scene_fixture.h"

#define RADIUS_M 0.05
#define STIFFNESS_N_PER_M 300.0

/* The contract of shcd_closest: a distance to 1e-9 of max(diagonal, distance). */
#define DISTANCE_TOLERANCE 1e-9

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

/* ---- force against closed forms ------------------------------------------------------------- */

/* A posed sphere: everything the output says is known in closed form. */
static void press_sphere(double tool_radius_m, uint64_t seed) {
    check_random random = {seed};
    const double tolerance = DISTANCE_TOLERANCE * fixture_diagonal(sphere);
    for (size_t i = 0; i < check_scaled(300); i++) {
        const shcd_pose pose = fixture_random_pose(&random, 1.0);
        const shcd_vec3 n = fixture_random_direction(&random);
        const double depth = check_uniform(&random, -0.01, 0.02);
        const double gap = -depth;
        const shcd_vec3 p = shcd_mul_add(pose.position_m, RADIUS_M + tool_radius_m + gap, n);
        const double force = depth > 0.0 ? STIFFNESS_N_PER_M * depth : 0.0;
        fixture f;
        const shcd_tool_output *out;
        fixture_open_one(&f, sphere, pose, tool_radius_m);
        out = fixture_move(&f, p, at_rest);
        assert_int_equal(fixture_in_contact(out), depth > 0.0);
        assert_int_equal(out->body, 0);
        assert_near(out->distance_m, gap, tolerance);
        assert_near(out->penetration_m, depth > 0.0 ? depth : 0.0, tolerance);
        /* direction: the foot is known to about the distance over R */
        assert_vec3_near(out->normal, n, 1e-7);
        assert_vec3_near(out->proxy_m, shcd_mul_add(pose.position_m, RADIUS_M, n), 1e-7 * RADIUS_M);
        assert_near(shcd_norm(out->wrench.force_n), force, STIFFNESS_N_PER_M * tolerance);
        assert_vec3_near(out->wrench.force_n, shcd_scale(force, n), 1e-7 * force + 1e-12);
        /* the line of the force passes through the tool's centre */
        assert_vec3_near(out->wrench.torque_n_m, at_rest, 0.0);
        fixture_close(&f);
    }
}

static void test_contact_point_on_sphere_matches_closed_form(void **state) {
    (void)state;
    press_sphere(0.0, 11);
}

static void test_contact_sphere_on_sphere_matches_closed_form(void **state) {
    (void)state;
    press_sphere(0.004, 12);
    press_sphere(0.08, 13);
}

/* At rest the proxy and the certified closest point are the same foot, also after many ticks and
 * after having come there through the surface step by step. */
static void test_contact_at_rest_inside_agrees_with_closest_point(void **state) {
    check_random random = {14};
    const double tolerance = DISTANCE_TOLERANCE * fixture_diagonal(ellipsoid);
    (void)state;
    for (size_t i = 0; i < check_scaled(100); i++) {
        const double radius_m = i % 2 == 0 ? 0.0 : 0.003;
        const shcd_pose pose = fixture_random_pose(&random, 0.5);
        const shcd_vec3 w = fixture_random_direction(&random);
        const double depth = check_uniform(&random, 0.0, 0.006);
        shcd_vec3 surface;
        shcd_vec3 normal;
        shcd_proximity closest;
        fixture f;
        assert_int_equal(shcd_model_surface(ellipsoid, -1, w, &surface, &normal, NULL), SHCD_OK);
        fixture_open_one(&f, ellipsoid, pose, radius_m);
        for (int k = 0; k <= 30; k++) {
            const double s = k <= 20 ? 0.01 - (0.01 + depth) * k / 20.0 : -depth;
            const shcd_vec3 p = shcd_mul_add(surface, s, normal);
            const shcd_tool_output *out = fixture_move(&f, shcd_transform(pose, p), at_rest);
            assert_int_equal(shcd_closest(ellipsoid,
                                          shcd_transform_inverse(pose, shcd_transform(pose, p)),
                                          NULL, &closest),
                             SHCD_OK);
            assert_near(out->distance_m, closest.distance_m - radius_m, 2.0 * tolerance);
            assert_near(shcd_norm(out->wrench.force_n), STIFFNESS_N_PER_M * out->penetration_m,
                        1e-14 * STIFFNESS_N_PER_M);
        }
        fixture_close(&f);
    }
}

/* ---- the proxy ------------------------------------------------------------------------------ */

/* Pushes a tool from above through the plate's middle, at a stated distance per tick. */
static void push_through_plate(fixture *f, double tool_radius_m, double per_tick_m, double end_m) {
    /* the first tick in contact must find the centre above the lower face */
    const double start = tool_radius_m + 0.001 + 0.25 * per_tick_m;
    fixture_open_one(f, plate, fixture_pose(0.0, 0.0, 0.0), tool_radius_m);
    for (int i = 0;; i++) {
        const double z = start - per_tick_m * i;
        const shcd_tool_output *out =
            fixture_move(f, shcd_vec3_make(0.001, 0.0005, z), shcd_vec3_make(0.0, 0.0, -1.0));
        if (i > 0) {
            assert_true(fixture_in_contact(out));
            assert_true(out->wrench.force_n.z > 0.0);
            assert_true(out->normal.z > 0.9);
            /* the upper face lies between 0.99 and 1 mm here */
            assert_near(out->penetration_m, 0.001 + tool_radius_m - z, 2e-5);
            assert_near(shcd_norm(out->wrench.force_n), STIFFNESS_N_PER_M * out->penetration_m,
                        1e-12);
        }
        if (z < end_m) {
            return;
        }
    }
}

static void test_contact_tool_pushed_through_a_thin_body_comes_back_the_way_it_went(void **state) {
    const double per_tick_m[] = {0.0001, 0.0009, 0.0016};
    const double radii_m[] = {0.0, 0.0005, 0.004};
    (void)state;
    for (size_t s = 0; s < 3; s++) {
        for (size_t r = 0; r < 3; r++) {
            fixture f;
            double z;
            push_through_plate(&f, radii_m[r], per_tick_m[s], -0.008);
            /* back up: contact until it is out at the top, then none */
            for (z = -0.008; z < 0.008; z += per_tick_m[s]) {
                const double clearance = z - radii_m[r] - 0.001;
                fixture_move(&f, shcd_vec3_make(0.001, 0.0005, z), shcd_vec3_make(0.0, 0.0, 1.0));
                assert_int_equal(fixture_in_contact(&f.out[0]), f.out[0].distance_m < 0.0);
                if (clearance < -2e-5) {
                    assert_true(f.out[0].wrench.force_n.z > 0.0);
                } else if (clearance > 0.0) {
                    assert_no_force(&f.out[0]);
                }
            }
            fixture_close(&f);
        }
    }
}

/* Below the plate and moved out sideways, the tool is released at the rim, without a pull across.
 */
static void test_contact_tool_moved_past_the_rim_is_released(void **state) {
    fixture f;
    double x;
    (void)state;
    push_through_plate(&f, 0.0, 0.0005, -0.003);
    for (x = 0.001; x < 0.03; x += 0.0005) {
        fixture_move(&f, shcd_vec3_make(x, 0.0005, -0.0035), at_rest);
        assert_true(f.out[0].wrench.force_n.z >= 0.0);
        /* a proxy, never farther than the face it was on */
        assert_true(f.out[0].penetration_m < 0.005);
    }
    assert_false(fixture_in_contact(&f.out[0]));
    assert_no_force(&f.out[0]);
    fixture_close(&f);
}

static void test_contact_inactive_tool_loses_its_contacts(void **state) {
    fixture f;
    (void)state;
    push_through_plate(&f, 0.0, 0.0005, -0.003);
    f.in[0].flags = 0;
    fixture_step(&f);
    assert_no_force(&f.out[0]);
    assert_int_equal(f.out[0].flags, 0);
    assert_int_equal(f.out[0].body, -1);
    assert_true(f.out[0].distance_m == HUGE_VAL);
    f.in[0].flags = SHCD_TOOL_INPUT_ACTIVE;
    fixture_step(&f);
    assert_false(fixture_in_contact(&f.out[0]));
    assert_true(f.out[0].distance_m > 0.0);
    fixture_close(&f);
}

/* Moves tool 0 from the last point by at most `step_m` a tick to the target and then waits, while
 * the force changes by at most change_n from tick to tick. */
static void move_smoothly(fixture *f, shcd_vec3 target, double step_m, size_t n_ticks,
                          double change_n) {
    for (size_t i = 0; i < n_ticks; i++) {
        const shcd_vec3 p = f->in[0].tool_in_world.position_m;
        const shcd_vec3 way = shcd_sub(target, p);
        const double share = step_m / shcd_norm(way);
        const shcd_vec3 before = f->out[0].wrench.force_n;
        const shcd_tool_output *out =
            fixture_move(f, share < 1.0 ? shcd_mul_add(p, share, way) : target, at_rest);
        assert_at_most(shcd_norm(shcd_sub(out->wrench.force_n, before)), change_n);
    }
}

/* Largest change of the force in a tick while a proxy slides. With F = k depth n and depth =
 * -(p - S).n, |dF| <= k (|dp| + |dS| + 2 |p - S| |dn|), |dn| <= |dS| / (least curvature radius);
 * dS is bounded by twice the tool's motion and 0.5 m/s (response/contact.c). */
static double change_while_sliding(double step_m, double depth_m, double curvature_radius_m) {
    const double slip_m = 2.0 * step_m + 0.5 * FIXTURE_TICK_S + 1e-6;
    return STIFFNESS_N_PER_M * (step_m + slip_m + 2.0 * depth_m * slip_m / curvature_radius_m);
}

/* Past the focal point of an ellipsoid's tip, c^2 / a = 15 mm deep, the foot at the tip is no
 * minimum any more: the proxy slides down to one that is, here the closest point. */
static void test_contact_proxy_slides_when_its_minimum_ends(void **state) {
    const shcd_vec3 deep = {0.03, 0.0, 0.0005};
    fixture f;
    shcd_proximity closest;
    (void)state;
    fixture_open_one(&f, ellipsoid, fixture_pose(0.0, 0.0, 0.0), 0.0);
    f.in[0].tool_in_world.position_m = shcd_vec3_make(0.062, 0.0, 0.0005);
    move_smoothly(&f, deep, 1e-4, 1500, change_while_sliding(1e-4, 0.032, 0.015));
    assert_int_equal(shcd_closest(ellipsoid, deep, NULL, &closest), SHCD_OK);
    assert_near(f.out[0].distance_m, closest.distance_m,
                2.0 * DISTANCE_TOLERANCE * fixture_diagonal(ellipsoid));
    assert_true(f.out[0].normal.z > 0.9);
    fixture_close(&f);
}

/* Past the centre of a sphere, which is focal for every foot, the proxy slides round to the other
 * side: no leap of the force from one side to the other, and out in the end. */
static void test_contact_tool_through_the_centre_of_a_sphere_is_let_out_smoothly(void **state) {
    fixture f;
    (void)state;
    fixture_open_one(&f, sphere, fixture_pose(0.0, 0.0, 0.0), 0.0);
    f.in[0].tool_in_world.position_m = shcd_vec3_make(0.0003, 0.0, 0.06);
    move_smoothly(&f, shcd_vec3_make(0.0003, 0.0, -0.055), 2e-4, 1000,
                  change_while_sliding(2e-4, 2.1 * RADIUS_M, RADIUS_M));
    assert_false(fixture_in_contact(&f.out[0]));
    fixture_close(&f);
}

/* Exactly on the axis the foot stays stationary, in an unstable balance: finite all the way. */
static void test_contact_tool_on_the_axis_of_a_sphere_stays_finite(void **state) {
    fixture f;
    (void)state;
    fixture_open_one(&f, sphere, fixture_pose(0.0, 0.0, 0.0), 0.0);
    for (int i = 0; i <= 120; i++) {
        const shcd_tool_output *out =
            fixture_move(&f, shcd_vec3_make(0.0, 0.0, 0.06 - 0.001 * i), at_rest);
        assert_true(shcd_vec3_is_finite(out->proxy_m));
        assert_at_most(shcd_norm(out->wrench.force_n),
                       STIFFNESS_N_PER_M * 2.2 * RADIUS_M * (1.0 + 1e-9));
    }
    fixture_close(&f);
}

/* Activated where the query cannot prune, at and about a sphere's centre: whatever it can prove
 * within its cap, an unsure side gives no force, and a sure one the spring's. */
static void test_contact_unsure_side_gives_no_force(void **state) {
    const double offsets_m[] = {0.0, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2};
    fixture f;
    (void)state;
    fixture_open_one(&f, sphere, fixture_pose(0.0, 0.0, 0.0), 0.0);
    for (size_t i = 0; i < sizeof offsets_m / sizeof offsets_m[0]; i++) {
        f.in[0].flags = 0;
        fixture_step(&f);
        f.in[0].flags = SHCD_TOOL_INPUT_ACTIVE;
        fixture_move(&f, shcd_vec3_make(0.0, 0.0, offsets_m[i]), at_rest);
        if ((f.out[0].flags & SHCD_TOOL_OUTPUT_SIGN_UNSURE) != 0) {
            assert_no_force(&f.out[0]);
            assert_true(f.out[0].distance_m >= 0.0);
        } else {
            /* any point of the sphere is a foot at its centre: depth R less at most the offset,
             * found by Newton to the contract of an untruncated query or better */
            assert_near(shcd_norm(f.out[0].wrench.force_n),
                        STIFFNESS_N_PER_M * (RADIUS_M - offsets_m[i]),
                        STIFFNESS_N_PER_M * (2.0 * offsets_m[i] + 1e-9));
        }
    }
    fixture_close(&f);
}

static void test_contact_one_bad_sample_keeps_the_contact(void **state) {
    fixture f;
    shcd_tool_output before;
    (void)state;
    push_through_plate(&f, 0.0, 0.0005, -0.003);
    before = f.out[0];
    f.in[0].velocity_m_per_s.x = (double)NAN;
    fixture_step(&f);
    assert_no_force(&f.out[0]);
    f.in[0].velocity_m_per_s.x = 0.0;
    fixture_step(&f);
    assert_near(f.out[0].penetration_m, before.penetration_m, 1e-9 * fixture_diagonal(plate));
    fixture_close(&f);
}

/* ---- cost -------------------------------------------------------------------------------- */

/* In contact a point costs one Newton track a tick: at most 16 steps, each of a few evaluations by
 * the cap of shcd_track; on a coherent path two or three. No patch is looked at. */
static void test_contact_in_contact_costs_a_few_evaluations(void **state) {
    fixture f;
    size_t n_evaluations = 0;
    size_t n_contacts = 0;
    (void)state;
    fixture_open_one(&f, ellipsoid, fixture_pose(0.0, 0.0, 0.0), 0.0);
    for (size_t i = 0; i < 1000; i++) {
        const double t = (double)i * FIXTURE_TICK_S;
        const shcd_vec3 p = {0.02 * sin(3.0 * t), 0.01 * cos(3.0 * t), 0.024};
        const shcd_tool_output *out = fixture_move(&f, p, at_rest);
        if (i > 0) {
            assert_true(fixture_in_contact(out));
            assert_int_equal(out->n_patches, 0);
            assert_true(out->n_evaluations <= 64);
            n_evaluations += out->n_evaluations;
            n_contacts++;
        }
    }
    assert_at_most((double)n_evaluations / (double)n_contacts, 8.0);
    fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_contact_point_on_sphere_matches_closed_form),
        cmocka_unit_test(test_contact_sphere_on_sphere_matches_closed_form),
        cmocka_unit_test(test_contact_at_rest_inside_agrees_with_closest_point),
        cmocka_unit_test(test_contact_tool_pushed_through_a_thin_body_comes_back_the_way_it_went),
        cmocka_unit_test(test_contact_tool_moved_past_the_rim_is_released),
        cmocka_unit_test(test_contact_inactive_tool_loses_its_contacts),
        cmocka_unit_test(test_contact_proxy_slides_when_its_minimum_ends),
        cmocka_unit_test(test_contact_tool_through_the_centre_of_a_sphere_is_let_out_smoothly),
        cmocka_unit_test(test_contact_tool_on_the_axis_of_a_sphere_stays_finite),
        cmocka_unit_test(test_contact_unsure_side_gives_no_force),
        cmocka_unit_test(test_contact_one_bad_sample_keeps_the_contact),
        cmocka_unit_test(test_contact_in_contact_costs_a_few_evaluations),
    };
    return cmocka_run_group_tests(tests, make_models, free_models);
}
