/* SPDX-License-Identifier: BSD-3-Clause */
/* Point shells in the tick: force and torque against closed forms and against a sum over all
 * points, what a visit leaves out and when, continuity, replay. */
#include "support/scene_fixture.h"

#define STIFFNESS_N_PER_M 300.0
#define GRID 12
#define N_GRID (GRID * GRID)
#define N_CLOUD 1500
#define HALF_SIDE_M 0.005
#define EARTH_M 0.5

/* The fast tier's Newton run fixes a foot to rounding on these bodies; the contract that is asked
 * here is that of a query, 1e-9 of max(diagonal, distance). */
#define DISTANCE_TOLERANCE 1e-9

static const shcd_vec3 at_rest = {0.0, 0.0, 0.0};

static shcd_model *earth;     /* a large sphere: nearly flat under a small tool */
static shcd_model *ellipsoid; /* half axes 60, 40, 30 mm */
static shcd_model *plate;     /* 40 x 40 x 2 mm */
static shcd_vec3 grid[N_GRID], grid_normals[N_GRID];
static shcd_vec3 cloud[N_CLOUD], cloud_normals[N_CLOUD];
static shcd_tool_geometry *square, *ball;

/* A square z = 0, centres of GRID x GRID equal squares; and points on a sphere of 10 mm. */
static int make_all(void **state) {
    check_random random = {21};
    (void)state;
    earth = fixture_sphere(EARTH_M);
    ellipsoid = fixture_ellipsoid(0.06, 0.04, 0.03);
    plate = fixture_ellipsoid(0.02, 0.02, 0.001);
    for (size_t i = 0; i < N_GRID; i++) {
        const double x = ((double)(i % GRID) + 0.5) / GRID, y = ((double)(i / GRID) + 0.5) / GRID;
        grid[i] = shcd_vec3_make((2.0 * x - 1.0) * HALF_SIDE_M, (2.0 * y - 1.0) * HALF_SIDE_M, 0.0);
        grid_normals[i] = shcd_vec3_make(0.0, 0.0, 1.0);
    }
    for (size_t i = 0; i < N_CLOUD; i++) {
        const shcd_vec3 n = fixture_random_direction(&random);
        cloud[i] = shcd_scale(0.01, n);
        cloud_normals[i] = shcd_scale(-1.0, n);
    }
    square = fixture_shell(grid, grid_normals, N_GRID);
    ball = fixture_shell(cloud, cloud_normals, N_CLOUD);
    return 0;
}

static int free_all(void **state) {
    (void)state;
    shcd_tool_geometry_free(square);
    shcd_tool_geometry_free(ball);
    shcd_model_free(earth);
    shcd_model_free(ellipsoid);
    shcd_model_free(plate);
    return 0;
}

static shcd_tool_def shell_tool(const shcd_tool_geometry *geometry) {
    return fixture_tool_of("shell", SHCD_TOOL_SHELL, geometry);
}

/* ---- closed forms --------------------------------------------------------------------------- */

/* Winkler's foundation under the square at height z over the centre of a sphere R: each point at r
 * has depth R - |r| along r/|r|. Summed here by the formula, without the library. */
static shcd_wrench foundation(shcd_vec3 centre, double share, shcd_vec3 origin) {
    shcd_wrench sum = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    for (size_t i = 0; i < N_GRID; i++) {
        const shcd_vec3 p = shcd_add(centre, grid[i]);
        const double depth = EARTH_M - shcd_norm(p);
        if (depth > 0.0) {
            const double f = STIFFNESS_N_PER_M * depth / (share * N_GRID);
            const shcd_vec3 force = shcd_scale(f, shcd_unit(p));
            sum.force_n = shcd_add(sum.force_n, force);
            sum.torque_n_m = shcd_add(sum.torque_n_m, shcd_cross(shcd_sub(p, origin), force));
        }
    }
    return sum;
}

static void test_shell_flat_square_gives_stiffness_times_mean_depth(void **state) {
    const double depth = 0.001;
    const double tolerance = STIFFNESS_N_PER_M * DISTANCE_TOLERANCE * 2.0 * EARTH_M;
    const shcd_tool_def tool = shell_tool(square);
    const shcd_vec3 at = {0.0, 0.0, EARTH_M - depth};
    const shcd_wrench expected = foundation(at, 1.0, at);
    fixture f;
    (void)state;
    fixture_open_with(&f, earth, fixture_pose(0.0, 0.0, 0.0), &tool);
    const shcd_tool_output *out = fixture_move(&f, at, at_rest);
    assert_true(fixture_in_contact(out));
    assert_int_equal(out->n_contacts, N_GRID);
    assert_int_equal(out->n_points_left, 0);
    assert_vec3_near(out->wrench.force_n, expected.force_n, tolerance);
    /* symmetric: no torque, but for rounding and the feet's 1e-9, on a lever of half a diagonal */
    assert_vec3_near(out->wrench.torque_n_m, at_rest, tolerance * HALF_SIDE_M);
    /* the plane against the sphere: mean depth is depth less <r^2>/(2R), to (r/R)^2 of depth */
    const double sag = (2.0 / 3.0) * HALF_SIDE_M * HALF_SIDE_M / (2.0 * EARTH_M);
    assert_near(out->wrench.force_n.z, STIFFNESS_N_PER_M * (depth - sag),
                STIFFNESS_N_PER_M * sag * 0.02);
    assert_near(out->penetration_m, depth, sag);
    fixture_close(&f);
}

/* The same square a lever away from the tool's origin: the same force, and torque = lever x force.
 */
static void test_shell_off_centre_gives_the_torque_of_the_lever(void **state) {
    const shcd_vec3 lever = {0.03, -0.02, 0.01};
    const shcd_vec3 at = {0.0, 0.0, EARTH_M - 0.001};
    shcd_vec3 moved[N_GRID];
    const double tolerance = STIFFNESS_N_PER_M * DISTANCE_TOLERANCE * 2.0 * EARTH_M;
    fixture f;
    (void)state;
    for (size_t i = 0; i < N_GRID; i++) {
        moved[i] = shcd_add(grid[i], lever);
    }
    shcd_tool_geometry *geometry = fixture_shell(moved, grid_normals, N_GRID);
    const shcd_tool_def tool = shell_tool(geometry);
    const shcd_vec3 origin = shcd_sub(at, lever);
    const shcd_wrench expected = foundation(at, 1.0, origin);
    fixture_open_with(&f, earth, fixture_pose(0.0, 0.0, 0.0), &tool);
    const shcd_tool_output *out = fixture_move(&f, origin, at_rest);
    assert_vec3_near(out->wrench.force_n, expected.force_n, tolerance);
    assert_vec3_near(out->wrench.torque_n_m, expected.torque_n_m, tolerance * 0.05);
    assert_vec3_near(out->wrench.torque_n_m, shcd_cross(lever, out->wrench.force_n),
                     1e-3 * shcd_norm(out->wrench.torque_n_m));
    fixture_close(&f);
    shcd_tool_geometry_free(geometry);
}

static void test_shell_contact_share_scales_the_force(void **state) {
    const shcd_vec3 at = {0.0, 0.0, EARTH_M - 0.001};
    shcd_tool_def tool = shell_tool(square);
    fixture f;
    (void)state;
    tool.contact_share = 0.25;
    fixture_open_with(&f, earth, fixture_pose(0.0, 0.0, 0.0), &tool);
    assert_vec3_near(fixture_move(&f, at, at_rest)->wrench.force_n,
                     foundation(at, 0.25, at).force_n,
                     4.0 * STIFFNESS_N_PER_M * DISTANCE_TOLERANCE * 2.0 * EARTH_M);
    fixture_close(&f);
}

/* A damped body: going in by turning about the origin raises the force of each point by its own
 * speed, omega x r. */
static void test_shell_turning_in_is_damped_at_the_points_speed(void **state) {
    const shcd_effect_def effects[2] = {{"stiffness", NULL, 0}, {"damping", NULL, 0}};
    const shcd_vec3 lever = {0.05, 0.0, 0.0};
    const shcd_vec3 normal = {0.0, 0.0, 1.0};
    const shcd_vec3 at = {0.0, 0.0, EARTH_M - 0.001};
    const shcd_body_def body = fixture_body("body", earth, fixture_pose(0.0, 0.0, 0.0), effects, 2);
    shcd_tool_geometry *geometry = fixture_shell(&lever, &normal, 1);
    const shcd_tool_def tool = shell_tool(geometry);
    fixture f;
    (void)state;
    fixture_open(&f, &body, 1, &tool, 1);
    f.in[0].angular_velocity_rad_per_s = shcd_vec3_make(0.0, 1.0, 0.0); /* 0.05 m/s downwards */
    const shcd_tool_output *out = fixture_move(&f, shcd_sub(at, lever), at_rest);
    /* ratio 0.3 and 0.1 m/s are the defaults of damping: a factor of 1 + 1.5 0.3 0.5 */
    assert_near(out->wrench.force_n.z, STIFFNESS_N_PER_M * 0.001 * 1.225, 1e-6);
    assert_vec3_near(out->wrench.torque_n_m, shcd_cross(lever, out->wrench.force_n), 1e-15);
    fixture_close(&f);
    shcd_tool_geometry_free(geometry);
}

/* ---- against all points --------------------------------------------------------------------- */

/* The sum over all points by exact queries; valid while no point is past the medial axis. */
static shcd_wrench sum_over_points(const shcd_pose body, shcd_pose tool, double *least_m,
                                   size_t *n_inside) {
    shcd_wrench sum = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    *least_m = HUGE_VAL;
    *n_inside = 0;
    for (size_t i = 0; i < N_CLOUD; i++) {
        const shcd_vec3 p = shcd_transform(tool, cloud[i]);
        shcd_proximity exact;
        assert_int_equal(shcd_closest(ellipsoid, shcd_transform_inverse(body, p), NULL, &exact),
                         SHCD_OK);
        *least_m = exact.distance_m < *least_m ? exact.distance_m : *least_m;
        if (exact.distance_m < 0.0) {
            const shcd_vec3 force = shcd_scale(-STIFFNESS_N_PER_M * exact.distance_m / N_CLOUD,
                                               shcd_rotate(body.orientation, exact.normal));
            sum.force_n = shcd_add(sum.force_n, force);
            sum.torque_n_m =
                shcd_add(sum.torque_n_m, shcd_cross(shcd_sub(p, tool.position_m), force));
            ++*n_inside;
        }
    }
    return sum;
}

/* From far to pressed in and turned, in steps: no point that matters is ever left out, and far
 * points are not paid for. */
static void test_shell_along_a_path_equals_the_sum_over_all_points(void **state) {
    check_random random = {22};
    const double tolerance = DISTANCE_TOLERANCE * fixture_diagonal(ellipsoid);
    size_t n_touching = 0, most_visited = 0;
    (void)state;
    for (size_t run = 0; run < check_scaled(6); run++) {
        const shcd_pose body = fixture_random_pose(&random, 0.2);
        const shcd_vec3 axis = fixture_random_direction(&random);
        const shcd_vec3 w = fixture_random_direction(&random);
        shcd_tool_def tool = shell_tool(ball);
        shcd_vec3 surface, normal;
        fixture f;
        tool.evaluations_max = 1000000;
        assert_int_equal(shcd_model_surface(ellipsoid, -1, w, &surface, &normal, NULL), SHCD_OK);
        fixture_open_with(&f, ellipsoid, body, &tool);
        for (int i = 0; i <= 40; i++) {
            const double height = 0.03 - 0.001 * i; /* of the shell's centre; it is in from 10 mm */
            const double half_angle = 0.02 * i;
            shcd_pose pose;
            double least_m;
            size_t n_inside;
            if (height < 0.006) {
                break;
            }
            pose.position_m = shcd_transform(body, shcd_mul_add(surface, height, normal));
            pose.orientation.w = cos(half_angle);
            pose.orientation.x = sin(half_angle) * axis.x;
            pose.orientation.y = sin(half_angle) * axis.y;
            pose.orientation.z = sin(half_angle) * axis.z;
            f.in[0].tool_in_world = pose;
            fixture_step(&f);
            const shcd_tool_output *out = &f.out[0];
            const shcd_wrench expected = sum_over_points(body, pose, &least_m, &n_inside);
            assert_int_equal(out->n_points_left, 0);
            assert_int_equal(out->n_contacts, n_inside);
            assert_near(out->distance_m, least_m, 4.0 * tolerance);
            assert_vec3_near(out->wrench.force_n, expected.force_n,
                             STIFFNESS_N_PER_M * 4.0 * tolerance + 1e-7 * STIFFNESS_N_PER_M * 0.01);
            assert_vec3_near(
                out->wrench.torque_n_m, expected.torque_n_m,
                (STIFFNESS_N_PER_M * 4.0 * tolerance + 1e-7 * STIFFNESS_N_PER_M * 0.01) * 0.01);
            n_touching += n_inside > 0;
            most_visited = i > 0 && out->n_points_visited > most_visited ? out->n_points_visited
                                                                         : most_visited;
        }
        fixture_close(&f);
    }
    assert_true(n_touching > 0);
    printf("of %d points at most %zu visited in a tick\n", N_CLOUD, most_visited);
    /* pressed in by 4 of 10 mm a fifth of the sphere is inside; a third leaves room for the rim */
    assert_true(most_visited < N_CLOUD / 3);
}

/* ---- the budget ----------------------------------------------------------------------------- */

/* All points inside and a cap that lets few be visited: coarser points stand for the others, and
 * the output says so. The force is off by no more than the depths of a point and of what stands for
 * it differ, here the sag over the diagonal of the square. */
static void test_shell_at_its_cap_lets_coarse_points_stand_for_the_others(void **state) {
    const uint32_t caps[] = {1, 10, 40, 100};
    const shcd_vec3 at = {0.0, 0.0, EARTH_M - 0.001};
    const double sag = HALF_SIDE_M * HALF_SIDE_M * 2.0 / (2.0 * (EARTH_M - 0.001));
    uint32_t before = 0;
    (void)state;
    for (size_t i = 0; i < sizeof caps / sizeof caps[0]; i++) {
        shcd_tool_def tool = shell_tool(square);
        fixture f;
        tool.evaluations_max = caps[i];
        fixture_open_with(&f, earth, fixture_pose(0.0, 0.0, 0.0), &tool);
        for (int tick = 0; tick < 5; tick++) {
            const shcd_tool_output *out = fixture_move(&f, at, at_rest);
            assert_true((out->flags & SHCD_TOOL_OUTPUT_DEGRADED) != 0);
            assert_true(out->n_points_left > 0);
            assert_int_equal(out->n_points_left + out->n_contacts, N_GRID);
            assert_near(out->wrench.force_n.z, foundation(at, 1.0, at).force_n.z,
                        STIFFNESS_N_PER_M * sag);
        }
        assert_true(f.out[0].n_points_visited > before);
        before = f.out[0].n_points_visited;
        fixture_close(&f);
    }
    shcd_tool_def tool = shell_tool(square);
    fixture f;
    fixture_open_with(&f, earth, fixture_pose(0.0, 0.0, 0.0), &tool);
    fixture_move(&f, at, at_rest);
    assert_int_equal(f.out[0].flags, SHCD_TOOL_OUTPUT_CONTACT);
    fixture_close(&f);
}

/* Clear of the body by far, the bounds of earlier ticks are worth something. */
static void test_shell_far_away_costs_nothing_near_a_few_points(void **state) {
    const shcd_tool_def tool = shell_tool(ball);
    size_t n_visited = 0;
    fixture f;
    (void)state;
    fixture_open_with(&f, ellipsoid, fixture_pose(0.0, 0.0, 0.0), &tool);
    fixture_move(&f, shcd_vec3_make(0.0, 0.0, 0.06), at_rest);
    for (int i = 0; i < 100; i++) {
        fixture_move(&f, shcd_vec3_make(1e-4 * i, 0.0, 0.06), at_rest);
        assert_near(f.out[0].distance_m, 0.02, 0.004);
        assert_false(fixture_in_contact(&f.out[0]));
        n_visited += f.out[0].n_points_visited;
    }
    printf("20 mm off, 0.1 mm a tick: %.1f points a tick\n", (double)n_visited / 100.0);
    assert_true(n_visited < 100 * N_CLOUD / 20);
    fixture_close(&f);
}

/* ---- continuity, memory --------------------------------------------------------------------- */

/* On a sphere F_i = k w (R - |p|) p/|p|, so |dF_i| <= k w |dp| (1 + depth/|p|): summed, the force
 * follows the tool's motion with k at most, plus that small part. */
static void test_shell_force_is_continuous_along_a_path(void **state) {
    const shcd_tool_def tool = shell_tool(square);
    shcd_vec3 last = {0.0, 0.0, 0.0};
    fixture f;
    (void)state;
    fixture_open_with(&f, earth, fixture_pose(0.0, 0.0, 0.0), &tool);
    double largest = 0.0;
    for (int i = 0; i < 2000; i++) {
        const double t = (double)i * FIXTURE_TICK_S;
        const double tilt = 0.3 * sin(11.0 * t); /* half the angle */
        f.in[0].tool_in_world.position_m = shcd_vec3_make(0.01 * sin(3.0 * t), 0.01 * sin(4.0 * t),
                                                          EARTH_M - 0.002 * sin(5.0 * t));
        f.in[0].tool_in_world.orientation.w = cos(tilt);
        f.in[0].tool_in_world.orientation.x = sin(tilt);
        fixture_step(&f);
        const shcd_vec3 force = f.out[0].wrench.force_n;
        /* speeds: 0.03, 0.04, 0.01 m/s, and 6.6 rad/s on a lever of 7.1 mm */
        const double moved = FIXTURE_TICK_S * (0.06 + 6.6 * 0.00708);
        if (i > 0) {
            const double change = shcd_norm(shcd_sub(force, last));
            largest = change > largest ? change : largest;
            assert_at_most(change, STIFFNESS_N_PER_M * moved * (1.0 + 0.01 / 0.48));
        }
        last = force;
    }
    assert_true(largest > 0.0);
    fixture_close(&f);
}

/* Pushed through a thin body from above and moved along, the points keep the side on which they
 * went in, as a point tool does. */
static void test_shell_pushed_through_a_plate_comes_back_the_way_it_went(void **state) {
    static const shcd_vec3 points[4] = {
        {1e-3, 0.0, 0.0}, {-1e-3, 0.0, 0.0}, {0.0, 1e-3, 0.0}, {0.0, -1e-3, 0.0}};
    static const shcd_vec3 normals[4] = {
        {0.0, 0.0, 1.0}, {0.0, 0.0, 1.0}, {0.0, 0.0, 1.0}, {0.0, 0.0, 1.0}};
    shcd_tool_geometry *geometry = fixture_shell(points, normals, 4);
    const shcd_tool_def tool = shell_tool(geometry);
    fixture f;
    (void)state;
    fixture_open_with(&f, plate, fixture_pose(0.0, 0.0, 0.0), &tool);
    for (int i = 0; i <= 60; i++) {
        const double z = 0.0015 - 0.0001 * i;
        fixture_move(&f, shcd_vec3_make(0.0, 0.0, z), at_rest);
        assert_int_equal(fixture_in_contact(&f.out[0]), f.out[0].distance_m < 0.0);
        if (z < 0.0009) {
            /* four points, each felt with a quarter; the face is at 0.997 mm where they are */
            assert_int_equal(f.out[0].n_contacts, 4);
            assert_near(f.out[0].wrench.force_n.z, STIFFNESS_N_PER_M * (0.000998 - z),
                        STIFFNESS_N_PER_M * 1e-5);
        }
    }
    f.in[0].flags = 0;
    fixture_step(&f);
    f.in[0].flags = SHCD_TOOL_INPUT_ACTIVE;
    fixture_step(&f);
    assert_false(fixture_in_contact(&f.out[0]));
    assert_true(f.out[0].distance_m > 0.0);
    fixture_close(&f);
    shcd_tool_geometry_free(geometry);
}

static void wander(fixture *f, size_t tick) {
    const double t = (double)tick * FIXTURE_TICK_S;
    f->in[0].tool_in_world.position_m =
        shcd_vec3_make(0.055 * cos(3.0 * t), 0.04 * sin(2.0 * t), 0.03 * cos(5.0 * t));
    f->in[0].tool_in_world.orientation.w = cos(2.0 * t);
    f->in[0].tool_in_world.orientation.y = sin(2.0 * t);
    f->in[0].flags = tick % 200 < 3 ? 0u : (uint32_t)SHCD_TOOL_INPUT_ACTIVE;
}

static void test_shell_snapshot_by_memcpy_replays_bit_for_bit(void **state) {
    enum { BEFORE = 300, AFTER = 300 };
    static shcd_tool_output recorded[AFTER];
    shcd_tool_def tool = shell_tool(ball);
    size_t n_contacts = 0;
    fixture f, other;
    (void)state;
    tool.evaluations_max = 300;
    fixture_open_with(&f, ellipsoid, fixture_pose(0.0, 0.0, 0.0), &tool);
    fixture_open_with(&other, ellipsoid, fixture_pose(0.0, 0.0, 0.0), &tool);
    for (size_t i = 0; i < BEFORE; i++) {
        wander(&f, i);
        fixture_step(&f);
    }
    memcpy(other.memory, f.memory, shcd_state_size(f.scene));
    for (size_t i = 0; i < AFTER; i++) {
        wander(&f, BEFORE + i);
        fixture_step(&f);
        recorded[i] = f.out[0];
        n_contacts += f.out[0].n_contacts;
    }
    for (size_t i = 0; i < AFTER; i++) {
        wander(&other, BEFORE + i);
        fixture_step(&other);
        assert_memory_equal(&recorded[i], &other.out[0], sizeof recorded[i]);
    }
    assert_memory_equal(f.memory, other.memory, shcd_state_size(f.scene));
    assert_true(n_contacts > 1000);
    fixture_close(&f);
    fixture_close(&other);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shell_flat_square_gives_stiffness_times_mean_depth),
        cmocka_unit_test(test_shell_off_centre_gives_the_torque_of_the_lever),
        cmocka_unit_test(test_shell_contact_share_scales_the_force),
        cmocka_unit_test(test_shell_turning_in_is_damped_at_the_points_speed),
        cmocka_unit_test(test_shell_along_a_path_equals_the_sum_over_all_points),
        cmocka_unit_test(test_shell_at_its_cap_lets_coarse_points_stand_for_the_others),
        cmocka_unit_test(test_shell_far_away_costs_nothing_near_a_few_points),
        cmocka_unit_test(test_shell_force_is_continuous_along_a_path),
        cmocka_unit_test(test_shell_pushed_through_a_plate_comes_back_the_way_it_went),
        cmocka_unit_test(test_shell_snapshot_by_memcpy_replays_bit_for_bit),
    };
    return cmocka_run_group_tests(tests, make_all, free_all);
}
