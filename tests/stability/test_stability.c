/* SPDX-License-Identifier: BSD-3-Clause */
/* The closed loop of hand, daemon and body: no oscillation that goes on inside the stated region
 * b >= k (T/2 + delay), and one outside of it (docs/stability.md). Sessions press, tap and slide on
 * convex and hollow places; SHCD_TEST_SCALE=100 runs thousands of them. */
#include "paths.h"
#include "session.h"

#include "shcd/vec.h"
#include "support/scene_fixture.h"

#define BODIES 4
#define PERIOD_S 1e-3

static shcd_model *bodies[BODIES];
static rig loop_rig;

static int make_bodies(void **state) {
    (void)state;
    bodies[0] = fixture_ellipsoid(0.08, 0.06, 0.05);
    bodies[1] = paths_bent();
    bodies[2] = paths_random(3);
    bodies[3] = paths_random(8);
    return 0;
}

static int free_bodies(void **state) {
    (void)state;
    for (size_t i = 0; i < BODIES; i++) {
        shcd_model_free(bodies[i]);
    }
    return 0;
}

typedef struct draw {
    rig_setup setup;
    session session;
} draw;

/* A loop at `margin` times the damping that the theory asks for. Small forces on soft springs, so
 * that a tool stays outside of the medial axis. */
static draw draw_session(size_t i, double k_least, double margin, check_random *r) {
    draw d;
    const double k_most = 2e4;
    const double share = i % 7 == 0 ? 0.0 : i % 7 == 1 ? 1.0 : check_uniform(r, 0.0, 1.0);
    const double k = k_least * pow(k_most / k_least, share);
    const double delay_s = 5e-5 * floor(check_uniform(r, 0.0, 41.0));
    const size_t body = (i / SESSION_KINDS) % BODIES;
    const rig_setup setup = {.model = bodies[body],
                             .radius_m = check_random_bits(r) % 3 == 0 ? 0.0 : 0.003,
                             .stiffness_n_per_m = k,
                             .device = &rig_bare_device,
                             .reserve_j = HUGE_VAL,
                             .hand = {.mass_kg = check_uniform(r, 0.08, 0.3),
                                      .damping_n_s_per_m = margin * k * (0.5 * PERIOD_S + delay_s),
                                      .grip_n_per_m = check_uniform(r, 200.0, 500.0),
                                      .delay_s = delay_s,
                                      .rate_hz = 1.0 / PERIOD_S}};
    const shcd_vec3 hollow = {1.0, check_uniform(r, -0.2, 0.2), check_uniform(r, -0.3, 0.3)};
    const shcd_vec3 w = body == 1 ? hollow : bodies_random_direction(r);
    d.setup = setup;
    d.session = session_make((session_kind)(i % SESSION_KINDS), &d.setup, w,
                             bodies_random_direction(r), fmin(2.0, 0.006 * k));
    return d;
}

static void describe(const draw *d, const watch *w, const char *what) {
    const hand_parameters *h = &d->setup.hand;
    fail_msg("%s: k %.6g N/m, b %.6g N s/m, delay %.3g ms, mass %.3g kg, grip %.3g N/m, session "
             "%d: second %.3g m, third %.3g m, %d changes, excess %.3g J",
             what, d->setup.stiffness_n_per_m, h->damping_n_s_per_m, 1e3 * h->delay_s, h->mass_kg,
             h->grip_n_per_m, (int)d->session.kind, w->second_m, w->third_m, w->n_changes,
             loop_rig.excess_j);
}

/* A twentieth above the limit, and a grip that damps a little, so that what decays does so within
 * the hold. At no instant has the loop yielded more than the device's damping dissipated. */
static void test_loop_inside_the_region_comes_to_rest(void **state) {
    (void)state;
    check_random r = {11};
    const size_t n = check_scaled(84);
    for (size_t i = 0; i < n; i++) {
        draw d = draw_session(i, 10.0, 1.05, &r);
        d.setup.hand.grip_n_s_per_m = 2.0 * d.setup.hand.mass_kg;
        const watch w = session_run(&loop_rig, &d.setup, &d.session);
        if (watch_is_oscillating(&w, 0.0)) {
            describe(&d, &w, "goes on");
        }
        if (!(loop_rig.excess_j <= 0.0)) {
            describe(&d, &w, "yields energy");
        }
        assert_true(w.deepest_m > 0.0);
        rig_close(&loop_rig);
    }
}

/* From 1000 N/m on: below, growth by (k (T/2 + delay) - b)/(2 m) takes longer than the hold to show
 * beside the session's own oscillations along the surface. */
static void test_loop_outside_the_region_oscillates(void **state) {
    (void)state;
    check_random r = {12};
    const size_t n = check_scaled(42);
    size_t n_yielding = 0;
    for (size_t i = 0; i < n; i++) {
        const draw d = draw_session(i, 1000.0, 0.4, &r);
        const watch w = session_run(&loop_rig, &d.setup, &d.session);
        if (!watch_is_oscillating(&w, 0.0)) {
            describe(&d, &w, "comes to rest");
        }
        n_yielding += loop_rig.excess_j > 1e-6;
        rig_close(&loop_rig);
    }
    /* a small oscillation may have yielded less than the body has been given to hold */
    assert_true(2 * n_yielding > n);
}

/* Encoder steps D act like a stiffness of up to 4/pi k: with that much more damping what cycles is
 * of the size of a step; friction of k D/2 in each axis stops it altogether (Diolaiti et al., IEEE
 * Trans. Robot. 22(2), 2006), but for the creep of the simulated friction. */
static void test_loop_with_an_encoder_cycles_within_its_steps(void **state) {
    (void)state;
    check_random r = {13};
    const size_t n = check_scaled(24);
    for (size_t i = 0; i < n; i++) {
        draw d = draw_session(i, 10.0, 4.0 / 3.14159265 * 1.05, &r);
        const double step = 1e-5;
        d.setup.hand.encoder_m = step;
        d.setup.hand.grip_n_s_per_m = 2.0 * d.setup.hand.mass_kg;
        const watch w = session_run(&loop_rig, &d.setup, &d.session);
        if (watch_is_oscillating(&w, step)) {
            describe(&d, &w, "goes on");
        }
        rig_close(&loop_rig);
    }
}

static void test_loop_with_an_encoder_and_friction_comes_to_rest(void **state) {
    (void)state;
    for (int i = 0; i < 12; i++) {
        check_random r = {(uint64_t)i};
        const double k = (double[]){2000.0, 6000.0, 20000.0}[i % 3];
        draw d = draw_session(0, 10.0, 1.0, &r); /* presses */
        d.setup.model = bodies[i % BODIES];
        d.setup.stiffness_n_per_m = k;
        d.setup.hand.encoder_m = 1e-5;
        d.setup.hand.coulomb_n = 0.5 * sqrt(3.0) * k * 1e-5;
        d.setup.hand.delay_s = 5e-4 * (i % 4);
        d.setup.hand.damping_n_s_per_m =
            4.0 / 3.14159265 * k * (0.5 * PERIOD_S + d.setup.hand.delay_s);
        d.setup.hand.grip_n_s_per_m = 2.0;
        d.session = session_make(SESSION_PRESS, &d.setup, shcd_vec3_make(1.0, 0.1, 0.2),
                                 shcd_vec3_make(0.0, 0.0, 1.0), 1.0);
        const watch w = session_run(&loop_rig, &d.setup, &d.session);
        if (!(w.third_m < 0.5 * d.setup.hand.encoder_m)) { /* it creeps at most */
            describe(&d, &w, "cycles");
        }
        rig_close(&loop_rig);
    }
}

/* As a scene is served: the profile's caps, its limit of stiffness, damping and delay, the default
 * reserve. At all these limits at once the loop is at the border, where nothing decays; the grip's
 * own 1 N s/m is beside the profile's. Ordinary sessions come to rest, and the controller is not
 * felt in any. */
static void test_loop_as_served_is_stable_and_unguarded(void **state) {
    (void)state;
    check_random r = {14};
    const size_t n = check_scaled(48);
    const device_profile *device = &device_profiles[0];
    for (size_t i = 0; i < n; i++) {
        draw d = draw_session(i, 10.0, 1.0, &r);
        const double limit = device_stiffness_max(device, 1.0 / PERIOD_S);
        d.setup.device = device;
        d.setup.reserve_j = device_reserve_j(device, 1.0 / PERIOD_S);
        d.setup.stiffness_n_per_m = i % 3 == 0 ? limit : check_uniform(&r, 50.0, limit);
        d.setup.damping_ratio = i % 2 == 0 ? 0.3 : 0.0;
        d.setup.hand.damping_n_s_per_m = device->damping_n_s_per_m;
        d.setup.hand.grip_n_s_per_m = 1.0;
        d.setup.hand.delay_s = 5e-5 * floor(check_uniform(&r, 0.0, 20.999));
        d.setup.hand.encoder_m = 1e-5;
        d.session = session_make((session_kind)(i % SESSION_KINDS), &d.setup, d.session.w,
                                 d.session.along, fmin(3.0, 0.006 * d.setup.stiffness_n_per_m));
        const watch w = session_run(&loop_rig, &d.setup, &d.session);
        if (watch_is_oscillating(&w, d.setup.hand.encoder_m)) {
            describe(&d, &w, "goes on");
        }
        if (loop_rig.n_guarded != 0) {
            describe(&d, &w, "was guarded");
        }
        rig_close(&loop_rig);
    }
}

/* A minute of taps and slides on the default scene's effects: the reserve is still not touched, as
 * damping gives more than sampling takes (F 4.5/(m/s) u^2 against k T u^2/2). */
static void test_loop_for_a_minute_leaves_the_reserve_alone(void **state) {
    (void)state;
    check_random r = {16};
    const device_profile *device = &device_profiles[0];
    for (size_t i = 1; i < SESSION_KINDS; i++) {
        draw d = draw_session(i, 10.0, 1.0, &r);
        d.setup.device = device;
        d.setup.reserve_j = device_reserve_j(device, 1.0 / PERIOD_S);
        d.setup.stiffness_n_per_m = 300.0;
        d.setup.damping_ratio = 0.3;
        d.setup.hand.damping_n_s_per_m = device->damping_n_s_per_m;
        d.setup.hand.grip_n_s_per_m = 1.0;
        d.setup.hand.delay_s = 1e-3;
        d.setup.hand.encoder_m = 1e-5;
        d.session = session_make((session_kind)i, &d.setup, d.session.w, d.session.along, 1.8);
        d.session.duration_s = 60.0;
        const watch w = session_run(&loop_rig, &d.setup, &d.session);
        if (loop_rig.n_guarded != 0 || watch_is_oscillating(&w, d.setup.hand.encoder_m)) {
            describe(&d, &w, "was guarded");
        }
        assert_true(tick_energy_of(&loop_rig.core).reserve_left_j >= d.setup.reserve_j);
        rig_close(&loop_rig);
    }
}

/* What the daemon reports is what the hand felt: without a delay and an encoder the same work, and
 * of the model's part every joule has its effect. */
static void test_loop_reports_the_work_of_the_hand(void **state) {
    (void)state;
    check_random r = {17};
    for (size_t i = 0; i < SESSION_KINDS; i++) {
        draw d = draw_session(i, 10.0, 1.0, &r);
        d.setup.device = &device_profiles[0];
        d.setup.stiffness_n_per_m = 1500.0;
        d.setup.damping_ratio = 0.3;
        d.setup.hand.damping_n_s_per_m = 3.0;
        d.setup.hand.delay_s = 0.0;
        /* 9 N are asked for: the cap of 5 N is met, so the output chain has its part */
        d.session = session_make((session_kind)i, &d.setup, d.session.w, d.session.along, 9.0);
        (void)session_run(&loop_rig, &d.setup, &d.session);
        rig_tick(&loop_rig, loop_rig.hand.target_m); /* books the last but one force */
        const shcd_vec3 x = hand_measured(&loop_rig.hand);
        const tool_result *last = &loop_rig.record.tools[0];
        const double open_j =
            shcd_dot(last->wrench.force_n,
                     shcd_sub(x, loop_rig.core.tools[0].ledger.tool_in_world.position_m));
        const tick_energy e = tick_energy_of(&loop_rig.core);
        const double sum_j = loop_rig.core.effect_energy_j[0] + loop_rig.core.effect_energy_j[1];
        /* sums of thousands of terms below 10 mJ */
        assert_near(e.given_j - e.taken_j, -(loop_rig.taken_j - open_j), 1e-12);
        assert_near(e.given_j - e.taken_j - e.output_chain_j, sum_j, 1e-12);
        assert_true(fabs(e.output_chain_j) > 1e-4);
        assert_near(e.stored_j, 0.5 * 1500.0 * rig_depth(&loop_rig) * rig_depth(&loop_rig), 1e-12);
        rig_close(&loop_rig);
    }
}

/* A tool torn out at 8 m/s takes more than the reserve pays for, since no hand was thought to be
 * that fast: no force at once, and a soft start with a new account. One that is put elsewhere does
 * not. */
static void test_loop_after_a_debt_starts_softly(void **state) {
    (void)state;
    for (int torn = 0; torn < 2; torn++) {
        check_random r = {18};
        draw d = draw_session(0, 10.0, 1.0, &r);
        d.setup.model = bodies[0];
        d.setup.device = &device_profiles[0];
        d.setup.reserve_j = device_reserve_j(d.setup.device, 1.0 / PERIOD_S);
        d.setup.stiffness_n_per_m = 300.0;
        d.setup.hand.damping_n_s_per_m = 3.0;
        d.setup.hand.delay_s = 0.0;
        d.session = session_make(SESSION_PRESS, &d.setup, shcd_vec3_make(1.0, 0.0, 0.0),
                                 shcd_vec3_make(0.0, 1.0, 0.0), 4.9);
        (void)session_run(&loop_rig, &d.setup, &d.session);
        const tool_result *result = &loop_rig.record.tools[0];
        const shcd_vec3 there = loop_rig.hand.position_m;
        const double full_n = result->wrench.force_n.x;
        assert_true(full_n > 4.0);
        /* as if it had taken back already what it gave to press in */
        double *balance_j = loop_rig.core.tools[0].passivity.balance_j;
        memset(balance_j, 0, sizeof loop_rig.core.tools[0].passivity.balance_j);
        for (int i = 0; i < 2; i++) { /* 2 ticks of 8 mm, or 2 of 100 mm */
            loop_rig.hand.position_m.x += torn ? 0.008 : 0.1;
            loop_rig.hand.history_m[loop_rig.hand.n_steps % HAND_HISTORY] =
                loop_rig.hand.position_m;
            loop_rig.hand.velocity_m_per_s = shcd_vec3_make(0.0, 0.0, 0.0);
            rig_tick(&loop_rig, loop_rig.hand.target_m);
        }
        loop_rig.hand.position_m = there;
        loop_rig.hand.velocity_m_per_s = shcd_vec3_make(0.0, 0.0, 0.0);
        loop_rig.hand.history_m[loop_rig.hand.n_steps % HAND_HISTORY] = there;
        rig_tick(&loop_rig, loop_rig.hand.target_m);
        assert_int_equal((result->flags & PASSIVITY_ACTED) != 0, torn);
        if (torn) {
            assert_true(result->wrench.force_n.x == 0.0);
        }
        for (int i = 0; i < 1000; i++) {
            rig_tick(&loop_rig, loop_rig.hand.target_m);
        }
        assert_near(result->wrench.force_n.x, full_n, 0.01 * full_n);
        assert_int_equal(result->flags, TICK_CONTACT);
        assert_true(tick_energy_of(&loop_rig.core).reserve_left_j >= 0.5 * d.setup.reserve_j);
        rig_close(&loop_rig);
    }
}

/* Ten times the stiffness that the profile allows. Without the controller the hand is shaken; with
 * it, what it gets out stays within the reserve at every instant, and the shaking ends: b |v|^2 has
 * nothing left to feed on. The delays are whole ticks within the profile's. */
static void test_loop_that_would_shake_is_held_by_the_reserve(void **state) {
    (void)state;
    check_random r = {15};
    const device_profile *device = &device_profiles[0];
    const double reserve_j = device_reserve_j(device, 1.0 / PERIOD_S);
    const size_t n = check_scaled(12);
    for (size_t i = 0; i < n; i++) {
        draw d = draw_session(i, 10.0, 1.0, &r);
        d.setup.device = device;
        d.setup.stiffness_n_per_m = 20000.0;
        d.setup.hand.mass_kg = 0.1;
        d.setup.hand.damping_n_s_per_m = 0.5;
        d.setup.hand.delay_s = i % 2 == 0 ? 0.0 : PERIOD_S;
        d.session = session_make((session_kind)(i % SESSION_KINDS), &d.setup, d.session.w,
                                 d.session.along, 2.0);
        d.setup.reserve_j = reserve_j;
        const watch held = session_run(&loop_rig, &d.setup, &d.session);
        if (!(loop_rig.taken_most_j <= reserve_j)) {
            describe(&d, &held, "takes more than the reserve");
        }
        assert_true(loop_rig.n_guarded > 0);
        if (watch_is_oscillating(&held, 0.0)) {
            describe(&d, &held, "goes on");
        }
        rig_close(&loop_rig);
        d.setup.reserve_j = HUGE_VAL;
        const watch free = session_run(&loop_rig, &d.setup, &d.session);
        if (!watch_is_oscillating(&free, 0.0) || !(loop_rig.taken_most_j > 10.0 * reserve_j)) {
            describe(&d, &free, "is not shaken");
        }
        rig_close(&loop_rig);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_loop_inside_the_region_comes_to_rest),
        cmocka_unit_test(test_loop_outside_the_region_oscillates),
        cmocka_unit_test(test_loop_with_an_encoder_cycles_within_its_steps),
        cmocka_unit_test(test_loop_with_an_encoder_and_friction_comes_to_rest),
        cmocka_unit_test(test_loop_as_served_is_stable_and_unguarded),
        cmocka_unit_test(test_loop_for_a_minute_leaves_the_reserve_alone),
        cmocka_unit_test(test_loop_reports_the_work_of_the_hand),
        cmocka_unit_test(test_loop_after_a_debt_starts_softly),
        cmocka_unit_test(test_loop_that_would_shake_is_held_by_the_reserve),
    };
    return cmocka_run_group_tests(tests, make_bodies, free_bodies);
}
