/* SPDX-License-Identifier: BSD-3-Clause */
/* A ball in a groove: the walls that it touches beside the deepest one, against brute force over a
 * dense sampling of the surface. */
#include "support/groove.h"
#include "support/scene_fixture.h"

#include <stdbool.h>

#define STIFFNESS_N_PER_M 300.0
#define DEGREE 8
#define PI GROOVE_PI

/* A ball with a pit of three flanks at the top, z > 0: 0.03 (1 - 0.6 e^(-(q/0.62)^2)),
 * q = s (1 + 0.25 cos 3 phi), s the distance from the axis on the unit sphere; by sums over a grid
 * that is uniform in z and phi. */
static shcd_model *pit(void) {
    static double c[GROOVE_COUNT];
    const int n = 400, m = 48;
    memset(c, 0, sizeof c);
    for (int i = 0; i < n * m; i++) {
        const double z = -1.0 + 2.0 * (i / m + 0.5) / n, s = sqrt(1.0 - z * z);
        const double phi = 2.0 * PI * (i % m) / m, weight = 2.0 / n * 2.0 * PI / m;
        const double q = s * (1.0 + 0.25 * cos(3.0 * phi)) / 0.62;
        const shcd_vec3 w = {s * cos(phi), s * sin(phi), z};
        const double r = 0.03 * (1.0 - (z > 0.0 ? 0.6 * exp(-q * q) : 0.0));
        double y[SHCD_COUNT(GROOVE_DEGREE_MAX)];
        assert_int_equal(shcd_harmonics(GROOVE_DEGREE_MAX, w, y, NULL, NULL), SHCD_OK);
        for (size_t k = 0; k < SHCD_COUNT(GROOVE_DEGREE_MAX); k++) {
            c[3 * k + 0] += weight * r * w.x * y[k];
            c[3 * k + 1] += weight * r * w.y * y[k];
            c[3 * k + 2] += weight * r * w.z * y[k];
        }
    }
    return groove_model(GROOVE_DEGREE_MAX, c, NULL);
}

static shcd_model *body;

static int make_body(void **state) {
    (void)state;
    body = groove_body(DEGREE, 0.75);
    return 0;
}

static int free_body(void **state) {
    (void)state;
    shcd_model_free(body);
    return 0;
}

/* Distance from p to the surface on one side of the plane z = 0, in the half plane y = 0, x > 0,
 * where the feet of a point of it lie: the body turns about z. */
static double distance_to_side(shcd_vec3 p, int is_upper) {
    double nearest = HUGE_VAL;
    for (int i = 0; i <= 200000; i++) {
        const double theta = 0.5 * 3.14159265358979324 * (i / 200000.0 + (is_upper ? 0.0 : 1.0));
        const shcd_vec3 w = {sin(theta), 0.0, cos(theta)};
        shcd_vec3 s;
        assert_int_equal(shcd_model_surface(body, -1, w, &s, NULL, NULL), SHCD_OK);
        nearest = fmin(nearest, shcd_norm(shcd_sub(s, p)));
    }
    return nearest;
}

/* A ball larger than the waist is hollow rests on both flanks. In the middle it feels both equally,
 * and no force along z; off the middle each by its own depth. */
static void test_a_ball_in_the_waist_touches_both_flanks(void **state) {
    const double radius_m = 0.012, heights[] = {0.0, 2e-4, -5e-4};
    (void)state;
    for (size_t h = 0; h < 3; h++) {
        fixture f;
        fixture_open_one(&f, body, fixture_pose(0.0, 0.0, 0.0), radius_m);
        for (int i = 0; i < 200; i++) {
            const shcd_vec3 p = {0.0300 - 1e-5 * i, 0.0, heights[h]};
            const shcd_tool_output *out = fixture_move(&f, p, shcd_vec3_make(-0.01, 0.0, 0.0));
            if (i % 40 == 39) {
                const double up = fmax(0.0, radius_m - distance_to_side(p, 1));
                const double down = fmax(0.0, radius_m - distance_to_side(p, 0));
                const double z = out->wrench.force_n.z / STIFFNESS_N_PER_M;
                print_message(
                    "x %.5f, z %.5f: %u contacts, depths %.6f and %.6f, F/k (%.6f, %.6f)\n", p.x,
                    p.z, out->n_contacts, up, down, out->wrench.force_n.x / STIFFNESS_N_PER_M, z);
                assert_int_equal(out->n_contacts, (up > 0.0) + (down > 0.0));
                assert_near(out->penetration_m, fmax(up, down), 1e-8);
                if (heights[h] == 0.0) {
                    assert_near(z, 0.0, 1e-9);
                } else if (up > 0.0 && down > 0.0) {
                    /* the deeper flank pushes away from itself */
                    assert_true((z > 0.0) == (down > up));
                }
            }
        }
        fixture_close(&f);
    }
}

/* The largest change of the force over a step. */
typedef struct jumps {
    shcd_vec3 last;
    double largest_n;
    uint32_t most_contacts;
    int n_changes; /* of the number of walls */
    uint32_t n_before;
    bool has_last;
} jumps;

static void look_for_jump(jumps *j, const shcd_tool_output *out) {
    const shcd_vec3 force = out->wrench.force_n;
    if (j->has_last) {
        j->largest_n = fmax(j->largest_n, shcd_norm(shcd_sub(force, j->last)));
        j->n_changes += out->n_contacts != j->n_before;
    }
    j->last = force;
    j->n_before = out->n_contacts;
    j->most_contacts = out->n_contacts > j->most_contacts ? out->n_contacts : j->most_contacts;
    j->has_last = true;
}

/* With flat walls the ball's way out is a projection on a convex set, and the force changes by no
 * more than k |dx|. Walls bend: their normals turn by at most 2 |dx|/R over a step, R a radius of
 * curvature down to half of which the ball is pressed in at most, so that the force turns by as
 * much again. */
#define STEEPEST 2.0

/* 0.05 m/s: how fast a wall that begins or ends in the depth fades. */
#define FADE_M_PER_TICK (0.05 * FIXTURE_TICK_S)

/* Presses and slides into waists of several depths by balls of several sizes. */
static void test_the_force_in_a_groove_has_no_jumps(void **state) {
    const double depths[] = {0.3, 0.525, 0.75}, step_m = 2e-5;
    (void)state;
    for (size_t d = 0; d < 3; d++) {
        shcd_model *model = groove_body(GROOVE_DEGREE_MAX, depths[d]);
        for (double radius_m = 0.010; radius_m < 0.0205; radius_m += 0.002) {
            jumps j = {.has_last = false};
            fixture f;
            double touched_m = 0.0;
            fixture_open_one(&f, model, fixture_pose(0.0, 0.0, 0.0), radius_m);
            for (int i = 0; i < 2500; i++) {
                const double x = 0.056 - step_m * i;
                const shcd_tool_output *out = fixture_move(
                    &f, shcd_vec3_make(x, 0.0, 2e-4 * sin(3e3 * x)), shcd_vec3_make(0.0, 0.0, 0.0));
                touched_m = touched_m == 0.0 && out->n_contacts > 0 ? x : touched_m;
                if (touched_m > 0.0 && x < touched_m - 4e-3) {
                    break;
                }
                look_for_jump(&j, out);
            }
            /* the step's length: 2e-5 along x, 0.6 of it along z at the most */
            const double way_m = step_m * sqrt(1.0 + 0.6 * 0.6);
            print_message("waist %.3f, ball of %2.0f mm: steps of %.2f k |dx|, up to %u walls, %d "
                          "changes\n",
                          depths[d], 1e3 * radius_m, j.largest_n / (STIFFNESS_N_PER_M * way_m),
                          j.most_contacts, j.n_changes);
            assert_int_equal(j.most_contacts, 2);
            assert_true(j.n_changes <= 4);
            assert_true(j.largest_n <= STEEPEST * STIFFNESS_N_PER_M * way_m);
            fixture_close(&f);
        }
        shcd_model_free(model);
    }
}

/* Across the waist the force goes over from one flank to the other without a jump, at any depth. */
static void test_the_force_is_continuous_across_the_waist(void **state) {
    const double radius_m = 0.012, step_m = 1e-5;
    (void)state;
    for (double x = 0.0265; x < 0.0301; x += 0.001) {
        fixture f;
        jumps j = {.has_last = false};
        fixture_open_one(&f, body, fixture_pose(0.0, 0.0, 0.0), radius_m);
        for (int i = 0; i < 600; i++) {
            const shcd_vec3 p = {x, 0.0, -0.003 + step_m * i};
            look_for_jump(&j, fixture_move(&f, p, shcd_vec3_make(0.0, 0.0, 0.01)));
        }
        /* where a foot begins in the depth, as it does in a slide that starts inside, its wall
         * fades in by as much more */
        print_message("at %.4f: steps of %.2f k |dx|, up to %u contacts\n", x,
                      j.largest_n / (STIFFNESS_N_PER_M * step_m), j.most_contacts);
        assert_int_equal(j.most_contacts, 2);
        assert_true(j.largest_n <= STIFFNESS_N_PER_M * (STEEPEST * step_m + FADE_M_PER_TICK));
        fixture_close(&f);
    }
}

/* A ball that is put on the axis of the pit, nothing having happened before. */
static shcd_tool_output put_into_corner(const shcd_model *model, double z) {
    fixture f;
    fixture_open_one(&f, model, fixture_pose(0.0, 0.0, 0.0), 0.012);
    const shcd_tool_output out =
        *fixture_move(&f, shcd_vec3_make(0.0, 0.0, z), shcd_vec3_make(0.0, 0.0, 0.0));
    fixture_close(&f);
    return out;
}

/* Length of the way out of three walls of depth d at the angle a to the axis. */
static double way_out(const shcd_model *model, double z) {
    const shcd_tool_output out = put_into_corner(model, z);
    return out.penetration_m / out.normal.z;
}

/* On the axis of a pit with three flanks each is touched; the force acts along z, by symmetry, and
 * is the derivative of k (d/cos a)^2/2. */
static void test_a_ball_in_a_corner_touches_three_walls(void **state) {
    const double step_m = 1e-5;
    shcd_model *model = pit();
    fixture f;
    jumps j = {.has_last = false};
    int n_in_three = 0;
    (void)state;
    fixture_open_one(&f, model, fixture_pose(0.0, 0.0, 0.0), 0.012);
    for (int i = 0; i < 600; i++) {
        const double z = 0.0300 - step_m * i;
        const shcd_tool_output *out =
            fixture_move(&f, shcd_vec3_make(0.0, 0.0, z), shcd_vec3_make(0.0, 0.0, -0.01));
        n_in_three += out->n_contacts == 3;
        look_for_jump(&j, out);
        if (out->penetration_m > 2e-4 && i % 50 == 0) {
            const shcd_tool_output fresh = put_into_corner(model, z);
            const double up = way_out(model, z + 1e-4), down = way_out(model, z - 1e-4);
            const double slope_m = (down * down - up * up) / 4e-4;
            print_message("at %.4f: %u walls, F/k %.6g, by the energy %.6g\n", z, fresh.n_contacts,
                          fresh.wrench.force_n.z / STIFFNESS_N_PER_M, slope_m);
            assert_int_equal(fresh.n_contacts, 3);
            assert_near(fresh.wrench.force_n.x, 0.0, 1e-6);
            assert_near(fresh.wrench.force_n.y, 0.0, 1e-6);
            /* in a tick of 1 ms a contact yields by 1/400 at most; the difference's error is
             * (0.1 mm/10 mm)^2/6 of the slope, 10 mm the size of the flanks */
            assert_near(fresh.wrench.force_n.z / STIFFNESS_N_PER_M, slope_m, 0.003 * slope_m);
        }
    }
    print_message("%d ticks with three walls, steps of %.2f k |dx|\n", n_in_three,
                  j.largest_n / (STIFFNESS_N_PER_M * step_m));
    assert_true(n_in_three >= 100);
    assert_true(j.largest_n <= STEEPEST * STIFFNESS_N_PER_M * step_m);
    fixture_close(&f);
    shcd_model_free(model);
}

/* Force after half a second, pressed in by some millimetres; on the way no jump, and no force
 * across the middle. */
static double press_soft(const shcd_model *model, double young_pa) {
    const shcd_parameter_value young = {.name = "youngs_modulus_pa", .value = young_pa};
    const shcd_effect_def effects[2] = {{"wave", &young, 1}, {"stiffness", NULL, 0}};
    const shcd_body_def organ =
        fixture_body("organ", model, fixture_pose(0.0, 0.0, 0.0), effects, young_pa > 0.0 ? 2 : 1);
    const shcd_body_def rigid =
        fixture_body("organ", model, fixture_pose(0.0, 0.0, 0.0), effects + 1, 1);
    const shcd_tool_def tool = fixture_tool("ball", 0.012);
    const double step_m = 1e-5;
    fixture f;
    jumps j = {.has_last = false};
    fixture_open(&f, young_pa > 0.0 ? &organ : &rigid, 1, &tool, 1);
    for (int i = 0; i < 800; i++) {
        const double x = 0.0310 - step_m * (i < 300 ? i : 300);
        const shcd_tool_output *out =
            fixture_move(&f, shcd_vec3_make(x, 0.0, 0.0), shcd_vec3_make(0.0, 0.0, 0.0));
        look_for_jump(&j, out);
        assert_near(out->wrench.force_n.z, 0.0, 1e-6);
    }
    const double force_n = f.out[0].wrench.force_n.x;
    print_message("E %.3g Pa: %.4f N by %u walls, displaced by %.3f mm, steps of %.2f k |dx|\n",
                  young_pa, force_n, f.out[0].n_contacts, 1e3 * f.out[0].displacement_m,
                  j.largest_n / (STIFFNESS_N_PER_M * step_m));
    assert_int_equal(f.out[0].n_contacts, 2);
    assert_true(j.largest_n <= STEEPEST * STIFFNESS_N_PER_M * step_m);
    fixture_close(&f);
    return force_n;
}

/* Both flanks of a soft groove give way, and their springs are shared as those of a rigid one: the
 * stiffer the membrane the nearer its force is to that. */
static void test_a_soft_groove_has_two_walls(void **state) {
    shcd_model *model = groove_soft_body(DEGREE, 0.75);
    (void)state;
    const double rigid_n = press_soft(model, 0.0), stiff_n = press_soft(model, 1e10);
    const double soft_n = press_soft(model, 5e3), softer_n = press_soft(model, 1e3);
    /* a membrane of 2 E* a = 1.3e8 N/m gives 300 N/m a share of 2e-6 of the way, and the solver's
     * own end is at 1e-12 */
    assert_near(stiff_n, rigid_n, 1e-5 * rigid_n);
    assert_true(0.0 < softer_n && softer_n < soft_n && soft_n < 0.5 * stiff_n);
    shcd_model_free(model);
}

/* On a convex part there is one wall, however large the ball. */
static void test_a_convex_body_has_one_wall(void **state) {
    shcd_model *egg = fixture_ellipsoid(0.03, 0.02, 0.025);
    check_random random = {5};
    (void)state;
    for (size_t i = 0; i < check_scaled(50); i++) {
        fixture f;
        const shcd_vec3 d = fixture_random_direction(&random);
        fixture_open_one(&f, egg, fixture_pose(0.0, 0.0, 0.0), 0.05);
        fixture_move(&f, shcd_scale(0.068, d), shcd_vec3_make(0.0, 0.0, 0.0));
        assert_true(f.out[0].n_contacts <= 1);
        fixture_close(&f);
    }
    shcd_model_free(egg);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_ball_in_the_waist_touches_both_flanks),
        cmocka_unit_test(test_the_force_is_continuous_across_the_waist),
        cmocka_unit_test(test_the_force_in_a_groove_has_no_jumps),
        cmocka_unit_test(test_a_ball_in_a_corner_touches_three_walls),
        cmocka_unit_test(test_a_soft_groove_has_two_walls),
        cmocka_unit_test(test_a_convex_body_has_one_wall),
    };
    return cmocka_run_group_tests(tests, make_body, free_body);
}
