/* SPDX-License-Identifier: BSD-3-Clause */
/* Capsules, boxes and hulls in the tick: gap, force and torque against closed forms, the side on
 * which a tool went in, continuity, replay. */
#include "support/scene_fixture.h"

#include <float.h>

#define RADIUS_M 0.05
#define STIFFNESS_N_PER_M 300.0

/* Of shcd_tool_closest() by default: 1e-6 of max(diagonal, gap). */
#define GAP_TOLERANCE 1e-6

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

static shcd_quat turn_about(shcd_vec3 axis, double angle) {
    const double s = sin(0.5 * angle);
    const shcd_quat q = {cos(0.5 * angle), s * axis.x, s * axis.y, s * axis.z};
    return q;
}

/* First b, then a. */
static shcd_quat turn_after(shcd_quat a, shcd_quat b) {
    const shcd_vec3 u = {a.x, a.y, a.z}, v = {b.x, b.y, b.z};
    const shcd_vec3 w =
        shcd_add(shcd_add(shcd_scale(a.w, v), shcd_scale(b.w, u)), shcd_cross(u, v));
    const shcd_quat q = {a.w * b.w - shcd_dot(u, v), w.x, w.y, w.z};
    return q;
}

/* The tool's frame so that its point `core` comes to `at`. */
static shcd_pose pose_with(shcd_vec3 core, shcd_vec3 at, shcd_quat orientation) {
    const shcd_pose pose = {shcd_sub(at, shcd_rotate(orientation, core)), orientation};
    return pose;
}

/* ---- closed forms on a sphere --------------------------------------------------------------- */

/* A convex tool whose core point `core` is the one nearest to the sphere's centre, which lies in
 * direction `outward` from there (tool frame): gap = |core to centre| - R - r, force k depth away
 * from the centre, torque by the lever to the tool's surface below that core point. */
static void press(const shcd_tool_def *tool, double radius_m, shcd_vec3 core, shcd_vec3 outward,
                  uint64_t seed) {
    check_random random = {seed};
    const double tolerance = GAP_TOLERANCE * fixture_diagonal(sphere);
    for (size_t i = 0; i < check_scaled(60); i++) {
        const shcd_pose body = fixture_random_pose(&random, 0.5);
        const shcd_quat turn = fixture_random_pose(&random, 1.0).orientation;
        const double depth = check_uniform(&random, -0.01, 0.004);
        const shcd_vec3 n = shcd_scale(-1.0, shcd_rotate(turn, shcd_unit(outward)));
        const shcd_vec3 at = shcd_mul_add(body.position_m, RADIUS_M + radius_m - depth, n);
        const double force = depth > 0.0 ? STIFFNESS_N_PER_M * depth : 0.0;
        fixture f;
        fixture_open_with(&f, sphere, body, tool);
        f.in[0].tool_in_world = pose_with(core, at, turn);
        fixture_step(&f);
        const shcd_tool_output *out = &f.out[0];
        const shcd_vec3 lever =
            shcd_sub(shcd_mul_add(at, -radius_m, n), f.in[0].tool_in_world.position_m);
        if (fabs(depth) > tolerance) {
            assert_int_equal(fixture_in_contact(out), depth > 0.0);
            assert_int_equal(out->n_contacts, depth > 0.0);
        }
        assert_int_equal(out->body, 0);
        assert_near(out->distance_m, -depth, tolerance);
        assert_near(shcd_norm(out->wrench.force_n), force, STIFFNESS_N_PER_M * tolerance);
        /* a gap to e fixes the direction to sqrt(2 e/R) */
        const double angle = sqrt(2.0 * tolerance / RADIUS_M);
        assert_vec3_near(out->normal, n, angle);
        assert_vec3_near(out->wrench.torque_n_m, shcd_cross(lever, shcd_scale(force, n)),
                         (force * angle + STIFFNESS_N_PER_M * tolerance) *
                             (shcd_norm(lever) + RADIUS_M));
        fixture_close(&f);
    }
}

/* Lying across: the middle touches, no torque. With an end down: that end, on its lever. */
static void test_convex_capsule_on_sphere_matches_closed_form(void **state) {
    shcd_tool_geometry *geometry = fixture_capsule(0.004, 0.03);
    const shcd_tool_def tool = fixture_tool_of("capsule", SHCD_TOOL_CAPSULE, geometry);
    (void)state;
    press(&tool, 0.004, at_rest, shcd_vec3_make(0.6, -0.8, 0.0), 31);
    press(&tool, 0.004, shcd_vec3_make(0.0, 0.0, 0.012), shcd_vec3_make(0.0, 1.0, 0.0), 32);
    press(&tool, 0.004, shcd_vec3_make(0.0, 0.0, 0.03), shcd_vec3_make(0.3, 0.2, 1.0), 33);
    shcd_tool_geometry_free(geometry);
}

static void test_convex_box_on_sphere_matches_closed_form(void **state) {
    const double radii_m[2] = {0.0, 0.002};
    (void)state;
    for (size_t i = 0; i < 2; i++) {
        shcd_tool_geometry *geometry = fixture_box(0.02, 0.015, 0.01, radii_m[i]);
        const shcd_tool_def tool = fixture_tool_of("box", SHCD_TOOL_BOX, geometry);
        const double r = radii_m[i];
        /* face, edge, corner */
        press(&tool, r, shcd_vec3_make(0.005, -0.003, -0.01), shcd_vec3_make(0, 0, -1.0), 34 + i);
        press(&tool, r, shcd_vec3_make(0.02, 0.004, 0.01), shcd_vec3_make(0.7, 0, 0.5), 36 + i);
        press(&tool, r, shcd_vec3_make(-0.02, 0.015, 0.01), shcd_vec3_make(-1, 0.8, 0.6), 38 + i);
        shcd_tool_geometry_free(geometry);
    }
}

static void test_convex_hull_on_sphere_matches_closed_form(void **state) {
    static const shcd_vec3 points[5] = {{0.02, 0.0, 0.0},
                                        {-0.01, 0.017, 0.0},
                                        {-0.01, -0.017, 0.0},
                                        {0.0, 0.0, 0.03},
                                        {0.0, 0.0, 0.005}}; /* the last is inside */
    shcd_tool_geometry_def def = SHCD_TOOL_GEOMETRY_DEF_INIT;
    def.kind = SHCD_TOOL_HULL;
    def.points = points;
    def.n_points = 5;
    shcd_tool_geometry *geometry = fixture_geometry(&def);
    const shcd_tool_def tool = fixture_tool_of("hull", SHCD_TOOL_HULL, geometry);
    (void)state;
    press(&tool, 0.0, points[3], shcd_vec3_make(0.1, 0.0, 1.0), 40);
    press(&tool, 0.0, shcd_vec3_make(0.001, 0.002, 0.0), shcd_vec3_make(0.0, 0.0, -1.0), 41);
    shcd_tool_geometry_free(geometry);
}

/* ---- closed forms on a plane ---------------------------------------------------------------- */

/* A ball of 2 m is a plane to this: a point at the height h over its top's tangent plane and rho
 * from the axis is sqrt(rho^2 + (R + h)^2) - R = h + [0, rho^2/(2 (R + h))] away from it, and the
 * normal below it is tilted by at most rho/(R + h). */
#define PLANE_RADIUS_M 2.0
static double plane_error(double rho_m, double h_m) {
    return 0.5 * rho_m * rho_m / (PLANE_RADIUS_M + h_m);
}

static const shcd_vec3 box_half = {0.004, 0.003, 0.002};

/* The box's corner that lies lowest along z when turned so, and the least rise per length along the
 * three edges that leave it: every point of the box is at least that times its distance higher. */
static shcd_vec3 lowest_corner(shcd_quat turn, double *rise) {
    const shcd_vec3 up = shcd_rotate(shcd_conjugate(turn), shcd_vec3_make(0.0, 0.0, 1.0));
    *rise = fmin(fabs(up.x), fmin(fabs(up.y), fabs(up.z)));
    return shcd_vec3_make(up.x > 0.0 ? -box_half.x : box_half.x,
                          up.y > 0.0 ? -box_half.y : box_half.y,
                          up.z > 0.0 ? -box_half.z : box_half.z);
}

/* One press with that corner, rounded by r, `depth` below the plane and off the ball's axis. */
static void press_corner(fixture *f, shcd_pose body, double r, shcd_quat turn, shcd_vec3 off,
                         double depth) {
    double rise;
    const shcd_vec3 corner = lowest_corner(turn, &rise), z = {0.0, 0.0, 1.0};
    const shcd_pose box_in_body =
        pose_with(corner, shcd_mul_add(off, PLANE_RADIUS_M + r - depth, z), turn);
    const shcd_vec3 n = shcd_rotate(body.orientation, z);
    const shcd_vec3 lever = shcd_rotate(
        body.orientation, shcd_mul_add(shcd_rotate(turn, corner), -r, z)); /* from its middle */
    f->in[0].tool_in_world.position_m = shcd_transform(body, box_in_body.position_m);
    f->in[0].tool_in_world.orientation = turn_after(body.orientation, turn);
    fixture_step(f);
    const shcd_tool_output *out = &f->out[0];
    /* what the query promises, and the plane */
    const double rho = shcd_norm(off), h = r - depth;
    const double promise = GAP_TOLERANCE * 2.0 * sqrt(3.0) * PLANE_RADIUS_M;
    const double tilt = rho / (PLANE_RADIUS_M + h);
    const double error = promise + plane_error(rho, h);
    const double force = depth > 0.0 ? STIFFNESS_N_PER_M * depth : 0.0;
    /* a point of the box that is as near to the ball as the corner to the promise lies no farther
     * from the corner than this; the ball's own slope there is below a tenth of the box's rise */
    const double astray = promise / (0.9 * rise);
    assert_true(error < 1e-2 * 0.002);
    assert_near(out->distance_m, -depth, error);
    if (fabs(depth) > error) {
        assert_int_equal(out->n_contacts, depth > 0.0);
    }
    const double force_error = STIFFNESS_N_PER_M * error + force * (tilt + astray / PLANE_RADIUS_M);
    assert_vec3_near(out->wrench.force_n, shcd_scale(force, n), force_error);
    assert_vec3_near(out->wrench.torque_n_m, shcd_cross(lever, shcd_scale(force, n)),
                     force_error * shcd_norm(lever) + force * astray);
}

static void test_convex_box_corner_on_a_plane_matches_closed_form(void **state) {
    shcd_model *plane = fixture_sphere(PLANE_RADIUS_M);
    (void)state;
    for (size_t k = 0; k < 2; k++) {
        const double r = k == 0 ? 0.0 : 0.0005;
        shcd_tool_geometry *geometry = fixture_box(box_half.x, box_half.y, box_half.z, r);
        const shcd_tool_def tool = fixture_tool_of("box", SHCD_TOOL_BOX, geometry);
        check_random random = {50 + k};
        for (size_t i = 0; i < check_scaled(60); i++) {
            const shcd_pose body = fixture_random_pose(&random, 0.5);
            const double x = check_uniform(&random, -0.002, 0.002);
            const double y = check_uniform(&random, -0.002, 0.002);
            const double depth = check_uniform(&random, -0.001, 0.002);
            shcd_quat turn;
            double rise;
            do {
                turn = fixture_random_pose(&random, 0.0).orientation;
                lowest_corner(turn, &rise);
            } while (rise < 0.2);
            fixture f;
            fixture_open_with(&f, plane, body, &tool);
            press_corner(&f, body, r, turn, shcd_vec3_make(i % 3 == 0 ? 0.0 : x, y, 0.0), depth);
            fixture_close(&f);
        }
        shcd_tool_geometry_free(geometry);
    }
    shcd_model_free(plane);
}

/* Flat on its face, its middle up to a whole half side off the axis. On a plane any point of the
 * face may carry the force, so the torque is that of a lever within the face; and it is the one of
 * the contact that the output names. */
static void test_convex_box_face_on_a_plane_keeps_force_and_torque_in_balance(void **state) {
    shcd_model *plane = fixture_sphere(PLANE_RADIUS_M);
    shcd_tool_geometry *geometry = fixture_box(box_half.x, box_half.y, box_half.z, 0.0);
    const shcd_tool_def tool = fixture_tool_of("box", SHCD_TOOL_BOX, geometry);
    const double side = sqrt(box_half.x * box_half.x + box_half.y * box_half.y);
    const double promise = GAP_TOLERANCE * 2.0 * sqrt(3.0) * PLANE_RADIUS_M;
    check_random random = {52};
    (void)state;
    for (size_t i = 0; i < check_scaled(60); i++) {
        const double x = check_uniform(&random, -1.0, 1.0) * box_half.x;
        const double y = check_uniform(&random, -1.0, 1.0) * box_half.y;
        const double depth = check_uniform(&random, 0.0005, 0.002);
        const shcd_vec3 at = {x, y, PLANE_RADIUS_M - depth + box_half.z};
        fixture f;
        fixture_open_with(&f, plane, fixture_pose(0.0, 0.0, 0.0), &tool);
        const shcd_tool_output *out = fixture_move(&f, at, at_rest);
        const shcd_vec3 force = out->wrench.force_n, torque = out->wrench.torque_n_m;
        const double force_n = STIFFNESS_N_PER_M * depth;
        /* no point of the face is farther than 2 sides from the axis */
        const double error = promise + plane_error(2.0 * side, -depth);
        const double tilt = 2.0 * side / (PLANE_RADIUS_M - depth);
        assert_near(force.z, force_n, STIFFNESS_N_PER_M * error + force_n * tilt * tilt);
        assert_at_most(hypot(force.x, force.y), force_n * tilt);
        /* lever (x, y, -half z) x F: the rest comes from the force's slant */
        const double slant = force_n * tilt * (box_half.z + depth);
        assert_at_most(fabs(torque.x), force.z * box_half.y + slant);
        assert_at_most(fabs(torque.y), force.z * box_half.x + slant);
        assert_at_most(fabs(torque.z), force_n * tilt * side);
        /* proxy and tool's point lie on one line along the force: rounding of R = 2 m */
        assert_vec3_near(torque, shcd_cross(shcd_sub(out->proxy_m, at), force),
                         64.0 * DBL_EPSILON * PLANE_RADIUS_M * force_n);
        fixture_close(&f);
    }
    shcd_tool_geometry_free(geometry);
    shcd_model_free(plane);
}

/* A sphere made as a geometry is the sphere made without one, bit for bit. */
static void test_convex_sphere_geometry_is_a_sphere(void **state) {
    shcd_tool_geometry_def def = SHCD_TOOL_GEOMETRY_DEF_INIT;
    def.kind = SHCD_TOOL_SPHERE;
    def.radius_m = 0.004;
    shcd_tool_geometry *geometry = fixture_geometry(&def);
    const shcd_tool_def one = fixture_tool_of("tool", SHCD_TOOL_SPHERE, geometry);
    const shcd_tool_def other = fixture_tool("tool", 0.004);
    fixture f, g;
    (void)state;
    fixture_open_with(&f, ellipsoid, fixture_pose(0.0, 0.0, 0.0), &one);
    fixture_open_with(&g, ellipsoid, fixture_pose(0.0, 0.0, 0.0), &other);
    for (int i = 0; i < 200; i++) {
        const shcd_vec3 p = {0.002 * (i % 20), 0.03, 0.0002 * i};
        fixture_move(&f, p, at_rest);
        fixture_move(&g, p, at_rest);
        assert_memory_equal(&f.out[0], &g.out[0], sizeof f.out[0]);
    }
    fixture_close(&f);
    fixture_close(&g);
    shcd_tool_geometry_free(geometry);
}

/* Damping sees the speed of the touching end: omega x lever. */
static void test_convex_turning_in_is_damped_at_the_contacts_speed(void **state) {
    const shcd_effect_def effects[2] = {{"stiffness", NULL, 0}, {"damping", NULL, 0}};
    const shcd_body_def body =
        fixture_body("body", sphere, fixture_pose(0.0, 0.0, 0.0), effects, 2);
    shcd_tool_geometry *geometry = fixture_capsule(0.004, 0.03);
    const shcd_tool_def tool = fixture_tool_of("capsule", SHCD_TOOL_CAPSULE, geometry);
    const shcd_vec3 y = {0.0, 1.0, 0.0};
    fixture f;
    (void)state;
    fixture_open(&f, &body, 1, &tool, 1);
    /* the tool's z along the world's x; its end at z = 30 mm over the sphere's top, 2 mm deep */
    f.in[0].tool_in_world =
        pose_with(shcd_vec3_make(0.0, 0.0, 0.03), shcd_vec3_make(0.0, 0.0, RADIUS_M + 0.002),
                  turn_about(y, 0.5 * 3.14159265358979324));
    f.in[0].angular_velocity_rad_per_s = shcd_vec3_make(0.0, 2.0, 0.0); /* 60 mm/s downwards */
    fixture_step(&f);
    const double tolerance = STIFFNESS_N_PER_M * GAP_TOLERANCE * fixture_diagonal(sphere);
    /* 1 + 1.5 ratio u/v_ref, with the defaults 0.3 and 0.1 m/s */
    assert_near(f.out[0].wrench.force_n.z, STIFFNESS_N_PER_M * 0.002 * (1.0 + 0.45 * 0.6),
                2.0 * tolerance + 0.6 * 0.01);
    fixture_close(&f);
    shcd_tool_geometry_free(geometry);
}

/* ---- the side, continuity ------------------------------------------------------------------- */

static void test_convex_tool_pushed_through_a_plate_comes_back_the_way_it_went(void **state) {
    shcd_tool_geometry *geometries[2] = {fixture_capsule(0.0005, 0.003),
                                         fixture_box(0.002, 0.001, 0.0005, 0.0)};
    const int32_t kinds[2] = {SHCD_TOOL_CAPSULE, SHCD_TOOL_BOX};
    const shcd_vec3 y = {0.0, 1.0, 0.0};
    (void)state;
    for (size_t g = 0; g < 2; g++) {
        const shcd_tool_def tool = fixture_tool_of("tool", kinds[g], geometries[g]);
        fixture f;
        fixture_open_with(&f, plate, fixture_pose(0.0, 0.0, 0.0), &tool);
        /* the capsule lies: its z is the world's x; the box stands on its large face */
        f.in[0].tool_in_world.orientation = turn_about(y, g == 0 ? 1.5707963267948966 : 0.0);
        for (int i = 0; i <= 60; i++) {
            const double z = 0.0018 - 0.0001 * i; /* of the lowest point, less 0.5 mm */
            fixture_move(&f, shcd_vec3_make(0.001, 0.0005, z), at_rest);
            const double depth = 0.001 - (z - 0.0005);
            if (depth > 0.00002) {
                assert_true(fixture_in_contact(&f.out[0]));
                assert_true(f.out[0].normal.z > 0.9);
                /* the upper face lies between 0.99 and 1 mm below these tools */
                assert_near(f.out[0].penetration_m, depth, 3e-5);
            } else if (depth < -0.00002) {
                assert_no_force(&f.out[0]);
            }
        }
        /* and back */
        for (int i = 60; i >= 0; i--) {
            const double z = 0.0018 - 0.0001 * i;
            fixture_move(&f, shcd_vec3_make(0.001, 0.0005, z), at_rest);
            assert_true(f.out[0].wrench.force_n.z >= 0.0);
        }
        assert_false(fixture_in_contact(&f.out[0]));
        fixture_close(&f);
        shcd_tool_geometry_free(geometries[g]);
    }
}

/* A capsule that rolls and slides over the ellipsoid, shallow. Depth is 1-Lipschitz in the motion
 * of the tool's points: the size of the force changes by k |motion| at most, plus twice the
 * tolerance of a gap. */
static void test_convex_size_of_the_force_is_continuous_along_a_path(void **state) {
    shcd_tool_geometry *geometries[2] = {fixture_capsule(0.003, 0.02),
                                         fixture_box(0.02, 0.01, 0.003, 0.001)};
    const int32_t kinds[2] = {SHCD_TOOL_CAPSULE, SHCD_TOOL_BOX};
    const double height_m[2] = {0.052, 0.035}; /* the capsule stands */
    const double tolerance = STIFFNESS_N_PER_M * GAP_TOLERANCE * fixture_diagonal(ellipsoid);
    const shcd_vec3 axis = {0.6, 0.0, 0.8};
    (void)state;
    for (size_t g = 0; g < 2; g++) {
        const shcd_tool_def tool = fixture_tool_of("tool", kinds[g], geometries[g]);
        double last = 0.0, largest = 0.0;
        size_t n_contacts = 0;
        fixture f;
        fixture_open_with(&f, ellipsoid, fixture_pose(0.0, 0.0, 0.0), &tool);
        for (int i = 0; i < 1500; i++) {
            const double t = (double)i * FIXTURE_TICK_S;
            f.in[0].tool_in_world.orientation = turn_about(axis, 0.8 * sin(4.0 * t));
            fixture_move(&f,
                         shcd_vec3_make(0.02 * sin(3.0 * t), 0.01 * sin(2.0 * t),
                                        height_m[g] + 0.006 * sin(7.0 * t)),
                         at_rest);
            const double force = shcd_norm(f.out[0].wrench.force_n);
            /* 0.06, 0.02, 0.042 m/s; 3.2 rad/s at 24 mm at most */
            const double moved = FIXTURE_TICK_S * (0.076 + 3.2 * 0.0245);
            if (i > 0) {
                assert_at_most(fabs(force - last), STIFFNESS_N_PER_M * moved + 2.0 * tolerance);
            }
            n_contacts += fixture_in_contact(&f.out[0]) ? 1 : 0;
            largest = force > largest ? force : largest;
            last = force;
        }
        assert_true(n_contacts > 100 && n_contacts < 1500);
        assert_true(largest > 0.1);
        fixture_close(&f);
        shcd_tool_geometry_free(geometries[g]);
    }
}

static void test_convex_snapshot_by_memcpy_replays_bit_for_bit(void **state) {
    enum { BEFORE = 150, AFTER = 250 };
    static shcd_tool_output recorded[AFTER];
    shcd_tool_geometry *geometry = fixture_box(0.02, 0.01, 0.003, 0.001);
    const shcd_tool_def tool = fixture_tool_of("box", SHCD_TOOL_BOX, geometry);
    const shcd_vec3 axis = {0.6, 0.0, 0.8};
    fixture f, other;
    (void)state;
    fixture_open_with(&f, ellipsoid, fixture_pose(0.0, 0.0, 0.0), &tool);
    fixture_open_with(&other, ellipsoid, fixture_pose(0.0, 0.0, 0.0), &tool);
    for (int pass = 0; pass < 2; pass++) {
        fixture *now = pass == 0 ? &f : &other;
        for (int i = pass == 0 ? 0 : BEFORE; i < BEFORE + AFTER; i++) {
            const double t = 0.004 * i;
            if (i == BEFORE && pass == 0) {
                memcpy(other.memory, f.memory, shcd_state_size(f.scene));
            }
            now->in[0].tool_in_world.orientation = turn_about(axis, 2.0 * t);
            fixture_move(now, shcd_vec3_make(0.05 * sin(t), 0.03 * cos(2.0 * t), 0.03 * cos(t)),
                         at_rest);
            if (i >= BEFORE && pass == 0) {
                recorded[i - BEFORE] = now->out[0];
            } else if (pass == 1) {
                assert_memory_equal(&recorded[i - BEFORE], &now->out[0], sizeof recorded[0]);
            }
        }
    }
    assert_memory_equal(f.memory, other.memory, shcd_state_size(f.scene));
    fixture_close(&f);
    fixture_close(&other);
    shcd_tool_geometry_free(geometry);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_convex_capsule_on_sphere_matches_closed_form),
        cmocka_unit_test(test_convex_box_on_sphere_matches_closed_form),
        cmocka_unit_test(test_convex_hull_on_sphere_matches_closed_form),
        cmocka_unit_test(test_convex_box_corner_on_a_plane_matches_closed_form),
        cmocka_unit_test(test_convex_box_face_on_a_plane_keeps_force_and_torque_in_balance),
        cmocka_unit_test(test_convex_sphere_geometry_is_a_sphere),
        cmocka_unit_test(test_convex_turning_in_is_damped_at_the_contacts_speed),
        cmocka_unit_test(test_convex_tool_pushed_through_a_plate_comes_back_the_way_it_went),
        cmocka_unit_test(test_convex_size_of_the_force_is_continuous_along_a_path),
        cmocka_unit_test(test_convex_snapshot_by_memcpy_replays_bit_for_bit),
    };
    return cmocka_run_group_tests(tests, make_models, free_models);
}
