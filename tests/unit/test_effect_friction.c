/* SPDX-License-Identifier: BSD-3-Clause */
/* friction: stick, slip and what they dissipate, against closed forms; the anchor under turning
 * normals, rolling tools and moving surfaces; the dead band; no jumps. */
#include "support/scene_fixture.h"
#include "support/touch.h"

#define K 400.0
#define MU_S 0.5
#define MU_K 0.3
#define SLIP 0.002
#define NORMAL 2.0
#define KINETIC (MU_K * NORMAL)
#define STATIC (MU_S * NORMAL)

/* Sums of a few hundred forces of about 1 N, each rounded. */
#define ROUNDING 1e-13

static touch_effect open_friction(double mu_s, double mu_k) {
    const shcd_parameter_value values[] = {{"stiffness_n_per_m", K},
                                           {"static_ratio", mu_s},
                                           {"kinetic_ratio", mu_k},
                                           {"slip_length_m", SLIP},
                                           {"rest_time_s", 0.1}};
    return touch_open("friction", values, 5);
}

/* Force along x after a tick at (x, 0). */
static double force_at(touch_effect *e, shcdi_touch *t, double x, double normal_n) {
    touch_place(t, x, 0.0);
    return touch_apply(e, t, normal_n).other_force_n.x;
}

/* ---- stick and slip ---------------------------------------------------------------------------
 */

static void test_first_touch_sets_the_anchor(void **state) {
    touch_effect e = open_friction(MU_S, MU_K);
    shcdi_touch t = touch_plane(0.002);
    (void)state;
    assert_true(force_at(&e, &t, 0.03, NORMAL) == 0.0);
    assert_near(force_at(&e, &t, 0.031, NORMAL), -K * 0.001, ROUNDING);
}

/* A block on an incline: pulled by less than mu_s N it is held for ever, by more it slides. */
static void test_stick_limit_is_the_static_ratio(void **state) {
    touch_effect e = open_friction(MU_S, MU_K);
    shcdi_touch t = touch_plane(0.002);
    const double limit = STATIC / K;
    (void)state;
    (void)force_at(&e, &t, 0.0, NORMAL);
    const double held = force_at(&e, &t, 0.999 * limit, NORMAL);
    for (int i = 0; i < 10000; i++) {
        assert_true(force_at(&e, &t, 0.999 * limit, NORMAL) == held);
    }
    assert_near(force_at(&e, &t, 0.0, NORMAL), 0.0, ROUNDING); /* and back where it was */
    assert_near(force_at(&e, &t, 1.001 * limit, NORMAL), -STATIC, ROUNDING);
    assert_near(force_at(&e, &t, 0.0, NORMAL), 0.001 * STATIC, 0.001 * ROUNDING + ROUNDING);
}

static void test_steady_sliding_gives_the_kinetic_ratio_against_the_motion(void **state) {
    const double angles[] = {0.0, 1.0, 2.5, 4.0};
    (void)state;
    for (int a = 0; a < 4; a++) {
        touch_effect e = open_friction(MU_S, MU_K);
        shcdi_touch t = touch_plane(0.002);
        const double c = cos(angles[a]), s = sin(angles[a]);
        shcdi_response r;
        for (int i = 0; i < 300; i++) {
            touch_place(&t, 1e-4 * i * c, 1e-4 * i * s);
            r = touch_apply(&e, &t, NORMAL);
        }
        assert_near(r.other_force_n.x, -KINETIC * c, ROUNDING);
        assert_near(r.other_force_n.y, -KINETIC * s, ROUNDING);
        assert_true(r.other_force_n.z == 0.0);
        assert_near(r.anchored_j, 0.5 * KINETIC * KINETIC / K, ROUNDING);
        assert_true(r.normal_force_n == NORMAL);
    }
}

/* From mu_s to mu_k along the way slid, linear in it: (mu_s - mu_k) N s/l, s the way before. */
static void test_drop_to_kinetic_is_spread_over_the_slip_length(void **state) {
    touch_effect e = open_friction(MU_S, MU_K);
    shcdi_touch t = touch_plane(0.002);
    const double step = 1e-5;
    double x = 0.0, slid = 0.0, last = 0.0;
    (void)state;
    (void)force_at(&e, &t, 0.0, NORMAL);
    for (int i = 0; i < 600; i++) {
        x += step;
        const double stuck = last + K * step;
        const double limit = NORMAL * (MU_K + (MU_S - MU_K) * (1.0 - fmin(slid, SLIP) / SLIP));
        const double expected = fmin(stuck, limit);
        const double force = -force_at(&e, &t, x, NORMAL);
        assert_near(force, expected, 600.0 * ROUNDING);
        assert_at_most(last - force, NORMAL * (MU_S - MU_K) * step / SLIP + ROUNDING);
        slid += stuck > limit ? fmin(step, (stuck - limit) / K) : 0.0;
        last = force;
    }
    assert_near(last, KINETIC, ROUNDING);
}

static void test_static_ratio_comes_back_at_rest(void **state) {
    const int waits[] = {0, 50, 100, 1000};
    const double shares[] = {0.0, 0.5, 1.0, 1.0}; /* of mu_s - mu_k, after 0.1 s all of it */
    (void)state;
    for (int w = 0; w < 4; w++) {
        touch_effect e = open_friction(MU_S, MU_K);
        shcdi_touch t = touch_plane(0.002);
        double x = 0.0, peak = 0.0;
        for (int i = 0; i < 100; i++) {
            (void)force_at(&e, &t, x += 1e-4, NORMAL);
        }
        for (int i = 0; i < waits[w]; i++) {
            assert_near(force_at(&e, &t, x, NORMAL), -KINETIC, ROUNDING);
        }
        for (int i = 0; i < 100; i++) {
            peak = fmax(peak, -force_at(&e, &t, x += 1e-4, NORMAL));
        }
        /* each pull adds 0.04 N: after 12 it slides at the latest, and sticking recovers more */
        const double least = KINETIC + shares[w] * (STATIC - KINETIC);
        assert_true(peak >= least - ROUNDING);
        assert_at_most(peak,
                       fmin(STATIC, least + (waits[w] > 0 ? 0.12 : 0.0) * (STATIC - KINETIC)) +
                           ROUNDING);
    }
}

/* ---- energy -----------------------------------------------------------------------------------
 */

/* Work of the hand against the held force, x to x + dx: -F dx. */
static double stroke(touch_effect *e, shcdi_touch *t, double *x, double to, int n, double *force) {
    const double from = *x;
    double given = 0.0;
    for (int i = 1; i <= n; i++) {
        const double next = from + (to - from) * i / n;
        given += -*force * (next - *x);
        *x = next;
        *force = force_at(e, t, next, NORMAL);
    }
    return given;
}

/* To and fro by A on either side: a parallelogram of height 2 F_c and width 2 A - 2 F_c/k. The held
 * force is that of the tick before: of each of the two stuck parts, 2 F_c/k long, it misses
 * k dx/2 per metre. */
static void test_closed_stroke_dissipates_the_hysteresis_loop(void **state) {
    const double amplitude = 0.01, f_c = KINETIC, width = 2.0 * amplitude - 2.0 * f_c / K;
    const int n = 400;
    const double dx = 2.0 * amplitude / n;
    touch_effect e = open_friction(MU_K, MU_K);
    shcdi_touch t = touch_plane(0.002);
    double x = 0.0, force = 0.0;
    (void)state;
    (void)force_at(&e, &t, 0.0, NORMAL);
    (void)stroke(&e, &t, &x, amplitude, n / 2, &force);
    for (int i = 0; i < 3; i++) {
        double given = stroke(&e, &t, &x, -amplitude, n, &force);
        given += stroke(&e, &t, &x, amplitude, n, &force);
        assert_true(given > 0.0);
        const double missed = 2.0 * (2.0 * f_c / K) * (0.5 * K * dx);
        assert_near(given, 2.0 * f_c * width - missed, 2.0 * K * dx * dx);
    }
}

/* given + sum k |dx|^2/2 >= stored, in each tick of random walks with a random normal force, on a
 * surface whose normal turns at random. */
static void test_no_energy_comes_out_of_a_random_walk(void **state) {
    check_random random = {6};
    (void)state;
    for (size_t walk = 0; walk < check_scaled(50); walk++) {
        touch_effect e = open_friction(MU_S, MU_K);
        shcdi_touch t = touch_plane(0.002);
        shcd_vec3 at = {0.0, 0.0, 0.0}, force = {0.0, 0.0, 0.0};
        double given = 0.0, slack = 0.0;
        for (int i = 0; i < 400; i++) {
            const double step = check_uniform(&random, 0.0, 1e-3);
            const shcd_vec3 dx = {step * check_normal(&random), step * check_normal(&random),
                                  step * check_normal(&random)};
            given -= shcd_dot(force, dx);
            slack += 0.5 * K * shcd_dot(dx, dx);
            at = shcd_add(at, dx);
            t.normal = shcd_unit(shcd_add(t.normal, shcd_vec3_make(0.2 * check_normal(&random),
                                                                   0.2 * check_normal(&random),
                                                                   0.2 * check_normal(&random))));
            t.tool_in_body.position_m = at;
            t.tool_point_m = at;
            const shcdi_response r = touch_apply(&e, &t, check_uniform(&random, 0.0, 5.0));
            force = r.other_force_n;
            assert_near(shcd_dot(force, t.normal), 0.0, ROUNDING * 10.0);
            assert_true(r.anchored_j >= 0.0);
            assert_true(given + slack >= r.anchored_j - 400.0 * ROUNDING);
        }
    }
}

/* ---- the anchor -------------------------------------------------------------------------------
 */

static void test_turning_normal_shortens_the_spring_by_the_projection(void **state) {
    touch_effect e = open_friction(MU_S, MU_K);
    shcdi_touch t = touch_plane(0.002);
    (void)state;
    (void)force_at(&e, &t, 0.0, NORMAL);
    const double before = -force_at(&e, &t, 0.001, NORMAL);
    t.normal = shcd_vec3_make(sin(0.3), 0.0, cos(0.3));
    const shcd_vec3 after = touch_apply(&e, &t, NORMAL).other_force_n;
    assert_near(shcd_norm(after), before * cos(0.3), ROUNDING);
    assert_near(after.x, -before * cos(0.3) * cos(0.3), ROUNDING);
    assert_near(after.z, before * cos(0.3) * sin(0.3), ROUNDING);
}

static void test_anchor_rides_on_the_surface(void **state) {
    touch_effect e = open_friction(MU_S, MU_K);
    shcdi_touch t = touch_plane(0.002);
    (void)state;
    (void)force_at(&e, &t, 0.0, NORMAL);
    t.surface_velocity_m_per_s = shcd_vec3_make(0.2, 0.0, 0.0);
    assert_near(force_at(&e, &t, 0.0, NORMAL), K * 0.2 * t.dt_s, ROUNDING); /* taken along */
    (void)force_at(&e, &t, 0.0, NORMAL);
    t.surface_velocity_m_per_s = shcd_vec3_make(0.0, 0.0, 0.0);
    assert_near(force_at(&e, &t, 0.0004, NORMAL), 0.0, ROUNDING); /* went with it */
}

/* A ball of radius r that rolls by an angle moves by r times it: its contact point does not slide.
 */
static void test_rolling_ball_does_not_slide(void **state) {
    const double r = 0.01, turn = 0.02;
    touch_effect e = open_friction(MU_S, MU_K);
    shcdi_touch t = touch_plane(0.0);
    shcdi_response last;
    (void)state;
    for (int i = 0; i <= 100; i++) {
        const double a = 0.5 * turn * i; /* half of the angle about y */
        t.tool_in_body.position_m = shcd_vec3_make(r * turn * i, 0.0, r);
        t.tool_in_body.orientation.w = cos(a);
        t.tool_in_body.orientation.y = sin(a);
        t.tool_point_m = shcd_vec3_make(r * turn * i, 0.0, 0.0);
        last = touch_apply(&e, &t, NORMAL);
    }
    /* in a tick the point goes r (turn - sin turn) along the surface: r turn^3/6 */
    assert_at_most(fabs(last.other_force_n.x), 100.0 * 1.01 * K * r * turn * turn * turn / 6.0);
    /* one that turns on the spot does */
    t.tool_in_body.orientation.w = cos(1.0 + 0.001);
    t.tool_in_body.orientation.y = sin(1.0 + 0.001);
    const double spun = touch_apply(&e, &t, NORMAL).other_force_n.x - last.other_force_n.x;
    assert_near(spun, K * r * 0.002, 1e-5 * K * r * 0.002); /* sin 0.002 = 0.002 (1 - 7e-7) */
}

static void test_contact_point_that_jumps_along_the_tool_gives_no_jump(void **state) {
    touch_effect e = open_friction(MU_S, MU_K);
    shcdi_touch t = touch_plane(0.002);
    (void)state;
    (void)force_at(&e, &t, 0.0, NORMAL);
    touch_place(&t, 0.0005, 0.0);
    t.tool_point_m.x += 0.04; /* another corner of the same tool */
    assert_near(touch_apply(&e, &t, NORMAL).other_force_n.x, -K * 0.0005, ROUNDING);
    touch_place(&t, 0.0006, 0.0);
    t.tool_point_m.x += 0.04;
    assert_near(touch_apply(&e, &t, NORMAL).other_force_n.x, -K * 0.0006, ROUNDING);
}

static void test_without_normal_force_there_is_no_friction(void **state) {
    touch_effect e = open_friction(MU_S, MU_K);
    shcdi_touch t = touch_plane(0.002);
    (void)state;
    (void)force_at(&e, &t, 0.0, NORMAL);
    (void)force_at(&e, &t, 0.001, NORMAL);
    assert_true(force_at(&e, &t, 0.001, 0.0) == 0.0);
    assert_true(force_at(&e, &t, 0.001, NORMAL) == 0.0); /* anchored anew where it was free */
    assert_true(force_at(&e, &t, 0.003, 0.0) == 0.0);
}

/* ---- rest and smoothness ------------------------------------------------------------------------
 */

/* A hand at rest under an encoder's noise of +-delta along the surface and into it: as long as the
 * spring's k |2 delta| stays below mu_s times the smallest normal force, the anchor does not move.
 */
static void test_trembling_hand_neither_creeps_nor_chatters(void **state) {
    const double delta = 2e-5, k_normal = 1000.0, depth = 0.002;
    touch_effect e = open_friction(0.3, 0.2);
    shcdi_touch t = touch_plane(depth);
    check_random random = {7};
    (void)state;
    assert_true(K * 2.0 * sqrt(2.0) * delta < 0.3 * k_normal * (depth - delta));
    touch_place(&t, 0.0, 0.0);
    (void)touch_apply(&e, &t, k_normal * depth);
    for (int i = 0; i < 20000; i++) {
        const double x = check_uniform(&random, -delta, delta);
        const double y = check_uniform(&random, -delta, delta);
        touch_place(&t, x, y);
        const shcdi_response r =
            touch_apply(&e, &t, k_normal * (depth + check_uniform(&random, -delta, delta)));
        /* the spring of an anchor that stands; 20000 ways are summed, each rounded */
        assert_near(r.other_force_n.x, -K * x, K * 20000.0 * 0x1p-53 * delta);
        assert_near(r.other_force_n.y, -K * y, K * 20000.0 * 0x1p-53 * delta);
    }
}

/* At the limit of sticking the noise lets the anchor slip once, by no more than its own size. */
static void test_trembling_at_the_limit_settles(void **state) {
    const double delta = 2e-5;
    touch_effect e = open_friction(0.3, 0.2);
    shcdi_touch t = touch_plane(0.002);
    check_random random = {8};
    double x = 0.0;
    (void)state;
    while (x < 0.02) {
        (void)force_at(&e, &t, x += 1e-4, NORMAL); /* slides: at the kinetic limit */
    }
    for (int i = 0; i < 1000; i++) {
        (void)force_at(&e, &t, x + check_uniform(&random, -delta, delta), NORMAL);
    }
    const double settled = force_at(&e, &t, x, NORMAL);
    assert_true(settled >= -0.2 * NORMAL - ROUNDING && settled <= -0.2 * NORMAL + K * delta);
    for (int i = 0; i < 10000; i++) {
        (void)force_at(&e, &t, x + check_uniform(&random, -delta, delta), NORMAL);
    }
    assert_near(force_at(&e, &t, x, NORMAL), settled, K * 10000.0 * 0x1p-53 * x);
}

/* The bound that the source derives, over random motions. */
static void test_force_changes_by_no_more_than_its_bound(void **state) {
    check_random random = {9};
    touch_effect e = open_friction(MU_S, MU_K);
    shcdi_touch t = touch_plane(0.002);
    shcd_vec3 at = {0.0, 0.0, 0.0}, last = {0.0, 0.0, 0.0};
    double n_last = 0.0, way_last = 0.0;
    (void)state;
    for (size_t i = 0; i < check_scaled(20000); i++) {
        const double size = check_uniform(&random, 0.0, 1.0) < 0.1 ? 1e-2 : 1e-4;
        const shcd_vec3 dx = {size * check_normal(&random), size * check_normal(&random),
                              size * check_normal(&random)};
        const double n = check_uniform(&random, 0.0, 1.0) < 0.05
                             ? 0.0
                             : fabs(n_last + 0.1 * check_normal(&random));
        const shcd_vec3 before = t.normal;
        at = shcd_add(at, dx);
        t.normal = shcd_unit(shcd_add(t.normal, shcd_vec3_make(0.02 * check_normal(&random),
                                                               0.02 * check_normal(&random),
                                                               0.02 * check_normal(&random))));
        t.tool_in_body.position_m = at;
        t.tool_point_m = at;
        const shcd_vec3 force = touch_apply(&e, &t, n).other_force_n;
        const double turn = 2.0 * asin(0.5 * shcd_norm(shcd_sub(t.normal, before)));
        const double bound = K * shcd_norm(dx) + shcd_norm(last) * turn +
                             MU_S * fmax(0.0, n_last - n) + n * (MU_S - MU_K) * way_last / SLIP;
        assert_at_most(shcd_norm(shcd_sub(force, last)), bound + ROUNDING * (1.0 + K));
        assert_at_most(shcd_norm(force), MU_S * n + ROUNDING);
        last = force;
        n_last = n;
        way_last = shcd_norm(dx);
    }
}

/* ---- in a scene ---------------------------------------------------------------------------------
 */

#define BODY 0.05
#define BALL 0.005
#define DEPTH 0.002

/* A ball goes along the equator of a sphere by `step` a tick, and turns by `turn` about z. */
static const shcd_tool_output *go_round(fixture *f, int n, double step, double turn) {
    for (int i = 0; i <= n; i++) {
        const double a = step * i / (BODY + BALL - DEPTH), half = 0.5 * turn * i;
        f->in[0].tool_in_world.orientation.w = cos(half);
        f->in[0].tool_in_world.orientation.z = sin(half);
        (void)fixture_move(
            f, shcd_vec3_make((BODY + BALL - DEPTH) * cos(a), (BODY + BALL - DEPTH) * sin(a), 0.0),
            shcd_vec3_make(0.0, 0.0, 0.0));
    }
    return &f->out[0];
}

static void open_sphere(fixture *f, shcd_model **sphere) {
    static const shcd_effect_def effects[] = {{"stiffness", NULL, 0}, {"friction", NULL, 0}};
    const shcd_tool_def tool = fixture_tool("ball", BALL);
    *sphere = fixture_sphere(BODY);
    const shcd_body_def body =
        fixture_body("body", *sphere, fixture_pose(0.0, 0.0, 0.0), effects, 2);
    fixture_open(f, &body, 1, &tool, 1);
}

/* Forces to what 1e-9 of the diagonal, the query's tolerance, makes of depth and normal. */
static void test_sliding_ball_feels_the_kinetic_ratio_at_its_lowest_point(void **state) {
    const int n = 100;
    const double step = 2e-4, normal_n = 300.0 * DEPTH, angle = step * n / (BODY + BALL - DEPTH);
    const double tolerance = 1e-9 * 3.5 * BODY * 300.0 * 2.0;
    shcd_model *sphere;
    fixture f;
    (void)state;
    open_sphere(&f, &sphere);
    const shcd_tool_output *out = go_round(&f, n, step, 0.0);
    const shcd_vec3 normal = {cos(angle), sin(angle), 0.0}, along = {-sin(angle), cos(angle), 0.0};
    assert_near(shcd_dot(out->wrench.force_n, normal), normal_n, tolerance);
    assert_near(shcd_dot(out->wrench.force_n, along), -0.2 * normal_n, tolerance);
    /* (-r n) x (-mu N t) = r mu N z */
    assert_near(out->wrench.torque_n_m.z, BALL * 0.2 * normal_n, tolerance);
    fixture_close(&f);
    shcd_model_free(sphere);
}

/* Rolling: the lowest point stands, r turn = step. In a tick it is off by r turn^3 at most. */
static void test_ball_that_rolls_round_a_sphere_feels_no_friction(void **state) {
    const int n = 100;
    const double step = 2e-5, turn = step / BALL;
    shcd_model *sphere;
    fixture f;
    (void)state;
    open_sphere(&f, &sphere);
    const shcd_tool_output *out = go_round(&f, n, step, turn);
    const double angle = step * n / (BODY + BALL - DEPTH);
    const shcd_vec3 along = {-sin(angle), cos(angle), 0.0};
    assert_near(shcd_dot(out->wrench.force_n, along), 0.0,
                n * 300.0 * BALL * turn * turn * turn + 1e-9 * 3.5 * BODY * 300.0 * 2.0);
    fixture_close(&f);
    shcd_model_free(sphere);
}

static void test_kinetic_above_static_is_refused(void **state) {
    const shcd_parameter_value values[] = {{"static_ratio", 0.2}, {"kinetic_ratio", 0.3}};
    const char *const words[] = {"'friction'", "kinetic_ratio", "static_ratio", "0.3", NULL};
    (void)state;
    touch_expect_refusal("friction", values, 2, words);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_first_touch_sets_the_anchor),
        cmocka_unit_test(test_stick_limit_is_the_static_ratio),
        cmocka_unit_test(test_steady_sliding_gives_the_kinetic_ratio_against_the_motion),
        cmocka_unit_test(test_drop_to_kinetic_is_spread_over_the_slip_length),
        cmocka_unit_test(test_static_ratio_comes_back_at_rest),
        cmocka_unit_test(test_closed_stroke_dissipates_the_hysteresis_loop),
        cmocka_unit_test(test_no_energy_comes_out_of_a_random_walk),
        cmocka_unit_test(test_turning_normal_shortens_the_spring_by_the_projection),
        cmocka_unit_test(test_anchor_rides_on_the_surface),
        cmocka_unit_test(test_rolling_ball_does_not_slide),
        cmocka_unit_test(test_contact_point_that_jumps_along_the_tool_gives_no_jump),
        cmocka_unit_test(test_without_normal_force_there_is_no_friction),
        cmocka_unit_test(test_trembling_hand_neither_creeps_nor_chatters),
        cmocka_unit_test(test_trembling_at_the_limit_settles),
        cmocka_unit_test(test_force_changes_by_no_more_than_its_bound),
        cmocka_unit_test(test_sliding_ball_feels_the_kinetic_ratio_at_its_lowest_point),
        cmocka_unit_test(test_ball_that_rolls_round_a_sphere_feels_no_friction),
        cmocka_unit_test(test_kinetic_above_static_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
