/* SPDX-License-Identifier: BSD-3-Clause */
/* The energy ledger on closed paths: in every tick what was given, less what was taken, plus what a
 * held force can yield, is at least what the spring holds (shcd/energy.h). The four tests of closed
 * paths walk 10^3 of them at least, however small the scale; SHCD_TEST_SCALE=100 walks 10^5. */
#include "paths.h"

#include "shcd/shcd.h"
#include "support/scene_fixture.h"

#include <float.h>
#include <stdbool.h>
#include <string.h>

#define TICKS 300
#define PATHS_LEAST 250
#define RADIUS_M 0.003
#define K_N_PER_M 700.0
#define DEPTH_M 0.006
#define RATIO 0.3
#define SPEED_M_PER_S 0.1

/* What may be missing for want of digits. A depth is the closest point's, whose interval is closed
 * to 1e-9 of the diagonal, about 0.2 m: it enters U with k depth and W with k |dx| (|dx| < depth).
 * The sums round each term once: below a joule each, DBL_EPSILON a tick. */
#define TOLERANCE_J (K_N_PER_M * DEPTH_M * 1e-9 * 0.2 * 2.0 + TICKS * DBL_EPSILON)

typedef struct walk {
    fixture f;
    bool damped;
    shcd_ledger ledger;
    double least_j;      /* smallest margin */
    double least_bare_j; /* the same without the slack */
    double plane_j;      /* sum of k (n . dx)^2/2 */
    double depth_m;      /* of the last tick; negative: the gap */
    shcd_vec3 normal;
    shcd_vec3 last;
    bool any, left; /* a pose; the tool went out in between */
} walk;

static void walk_open(walk *w, const shcd_model *model, double radius_m, bool damped) {
    static const shcd_parameter_value k = {"k_n_per_m", K_N_PER_M};
    static const shcd_parameter_value damping[] = {{"ratio", RATIO},
                                                   {"reference_speed_m_per_s", SPEED_M_PER_S}};
    const shcd_effect_def effects[] = {{"stiffness", &k, 1}, {"damping", damping, 2}};
    const shcd_body_def body =
        fixture_body("body", model, fixture_pose(0, 0, 0), effects, damped ? 2 : 1);
    const shcd_tool_def tool = fixture_tool("tool", radius_m);
    memset(w, 0, sizeof *w);
    fixture_open(&w->f, &body, 1, &tool, 1);
    w->damped = damped;
}

static void walk_reset(walk *w) {
    memset(&w->ledger, 0, sizeof w->ledger);
    assert_int_equal(
        shcd_state_init(w->f.scene, w->f.memory, shcd_state_size(w->f.scene), &w->f.state),
        SHCD_OK);
    w->least_j = w->least_bare_j = HUGE_VAL;
    w->plane_j = w->depth_m = 0.0;
    w->any = w->left = false;
}

/* One tick at p. The velocity is the backward difference, as a client without one gives it. */
static void walk_to(walk *w, shcd_vec3 p) {
    const shcd_vec3 v = shcd_scale(w->any ? 1.0 / FIXTURE_TICK_S : 0.0, shcd_sub(p, w->last));
    const shcd_pose pose = {p, {1.0, 0.0, 0.0, 0.0}};
    (void)shcd_ledger_move(&w->ledger, &pose, FIXTURE_TICK_S);
    const shcd_vec3 dx = w->ledger.moved_m;
    const shcd_tool_output *out = fixture_move(&w->f, p, v);
    const double elastic_n = K_N_PER_M * out->penetration_m;
    /* what the plane of the last foot leaves of the held force's error; on touching all of it */
    const double come = shcd_dot(w->normal, dx), reach = fmax(0.0, w->depth_m - come);
    const double along = w->depth_m > 0.0 ? come : reach;
    assert_int_equal(out->flags & ~(uint32_t)SHCD_TOOL_OUTPUT_CONTACT, 0);
    const shcd_ledger_input held = {
        .published = out->wrench,
        .model = out->wrench,
        .velocity_m_per_s = v,
        .stored_j = 0.5 * elastic_n * out->penetration_m,
        .requery_j =
            w->any ? shcd_ledger_requery(K_N_PER_M, w->depth_m, w->normal, dx, out->penetration_m)
                   : 0.0,
        .stiffness_n_per_m = K_N_PER_M,
        .damping_n_s_per_m = w->damped ? elastic_n * 1.5 * RATIO / SPEED_M_PER_S : 0.0};
    assert_int_equal(shcd_ledger_hold(&w->ledger, &held), SHCD_OK);
    w->plane_j += 0.5 * K_N_PER_M * along * along;
    w->left = w->left || (w->depth_m > 0.0 && !(out->penetration_m > 0.0));
    w->least_j = fmin(w->least_j, shcd_ledger_margin(&w->ledger));
    w->least_bare_j = fmin(w->least_bare_j, shcd_ledger_margin(&w->ledger) - w->ledger.slack_j);
    w->depth_m = -out->distance_m;
    w->normal = out->normal;
    w->last = p;
    w->any = true;
}

static void walk_path(walk *w, const path *p, int first, int last) {
    walk_reset(w);
    for (int i = first; i <= last; i++) {
        walk_to(w, path_at(p, (double)i / TICKS));
    }
}

static shcd_model *make_body(size_t i) {
    switch (i) {
    case 0:
        return fixture_ellipsoid(0.08, 0.06, 0.05);
    case 1:
        return paths_bent();
    default:
        return paths_random(i);
    }
}
#define BODIES 4

/* Where a body is hollow and where it is not. */
static shcd_vec3 place(size_t body, size_t i, check_random *r) {
    return body == 1 ? shcd_vec3_make(i % 2 == 0 ? 1.0 : -1.0, check_uniform(r, -0.3, 0.3),
                                      check_uniform(r, -0.3, 0.3))
                     : bodies_random_direction(r);
}

static void check_closed_paths(bool damped, double radius_m, uint64_t seed) {
    const size_t scaled = check_scaled(PATHS_LEAST),
                 n = scaled > PATHS_LEAST ? scaled : PATHS_LEAST;
    double least_bare_j = HUGE_VAL;
    size_t n_touching = 0;
    for (size_t b = 0; b < BODIES; b++) {
        check_random r = {seed + b};
        shcd_model *model = make_body(b);
        walk *w = malloc(sizeof *w);
        assert_non_null(w);
        walk_open(w, model, radius_m, damped);
        for (size_t i = 0; i < n / BODIES + 1; i++) {
            const path p =
                path_make(model, (path_kind)(i % PATH_KINDS), place(b, i, &r), radius_m,
                          check_uniform(&r, 1e-4, DEPTH_M), check_uniform(&r, 0.01, 0.2), &r);
            walk_path(w, &p, 0, TICKS);
            if (!(w->least_j >= -TOLERANCE_J * check_tolerance_scale())) {
                fail_msg("body %zu path %zu kind %d: margin %.3g J, slack %.3g, given %.3g, taken "
                         "%.3g",
                         b, i, (int)p.kind, w->least_j, w->ledger.slack_j, w->ledger.given_j,
                         w->ledger.taken_j);
            }
            n_touching += w->ledger.given_j > 0.0;
            assert_true(w->ledger.stored_j == 0.0);
            least_bare_j = fmin(least_bare_j, w->least_bare_j);
        }
        fixture_close(&w->f);
        free(w);
        shcd_model_free(model);
    }
    assert_true(10 * n_touching > 9 * n); /* a random one may miss the body */
    if (!damped) { /* the slack is not idle: a held spring does yield energy */
        assert_true(least_bare_j < -1000.0 * TOLERANCE_J);
    }
}

static void test_closed_paths_of_a_sphere_on_a_spring(void **state) {
    (void)state;
    check_closed_paths(false, RADIUS_M, 1);
}

static void test_closed_paths_of_a_point_on_a_spring(void **state) {
    (void)state;
    check_closed_paths(false, 0.0, 2);
}

static void test_closed_paths_of_a_sphere_with_damping(void **state) {
    (void)state;
    check_closed_paths(true, RADIUS_M, 3);
}

static void test_closed_paths_of_a_point_with_damping(void **state) {
    (void)state;
    check_closed_paths(true, 0.0, 4);
}

/* With the plane of the last foot the account of a spring is an identity while the tool stays in:
 * given - taken + sum k (n . dx)^2/2 + requery = stored. */
static void test_requery_closes_the_account_of_a_spring(void **state) {
    (void)state;
    check_random r = {5};
    for (size_t b = 0; b < BODIES; b++) {
        shcd_model *model = make_body(b);
        walk *w = malloc(sizeof *w);
        assert_non_null(w);
        walk_open(w, model, RADIUS_M, false);
        for (size_t i = 0; i < 20; i++) {
            const path p =
                path_make(model, PATH_CIRCLE, place(b, i, &r), RADIUS_M, DEPTH_M, 0.2, &r);
            walk_path(w, &p, 0, TICKS - TICKS / 5); /* the last fifth goes out */
            assert_false(w->left);
            const shcd_ledger *l = &w->ledger;
            assert_near(l->given_j - l->taken_j + w->plane_j + l->requery_j, l->stored_j,
                        TOLERANCE_J);
            assert_true(fabs(l->requery_j) > 1000.0 * TOLERANCE_J);
        }
        fixture_close(&w->f);
        free(w);
        shcd_model_free(model);
    }
}

/* The books notice: a force that is a tenth too weak on the way in, or too strong on the way out,
 * and an energy counted with the trapezoid. */
static void test_margin_of_a_spring_that_cheats_is_negative(void **state) {
    (void)state;
    shcd_ledger l;
    double stored_j = 0.0, least_j = 0.0;
    memset(&l, 0, sizeof l);
    for (int i = 0; i <= 400; i++) { /* 1e-5 m a tick: the slack is 1 % of what is exchanged */
        const double depth = 1e-5 * (i <= 200 ? i : 400 - i);
        const shcd_pose pose = {{-depth, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
        const shcd_wrench f = {{(i < 200 ? 0.9 : 1.1) * 1000.0 * depth, 0.0, 0.0}, {0.0, 0.0, 0.0}};
        (void)shcd_ledger_move(&l, &pose, 1e-3);
        stored_j = 0.5 * 1000.0 * depth * depth;
        const shcd_ledger_input held = {
            .published = f, .model = f, .stored_j = stored_j, .stiffness_n_per_m = 1100.0};
        assert_int_equal(shcd_ledger_hold(&l, &held), SHCD_OK);
        least_j = fmin(least_j, shcd_ledger_margin(&l));
    }
    assert_at_most(least_j, -0.1 * 0.5 * 1000.0 * 0.002 * 0.002 * 0.9);
}

static void test_output_chain_is_what_the_published_force_lacks(void **state) {
    (void)state;
    shcd_ledger l;
    memset(&l, 0, sizeof l);
    shcd_pose pose = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
    const shcd_vec3 parts[2] = {{1.5, 0.0, 0.0}, {0.5, 3.0, 0.0}};
    double entry_j[2] = {0.0, 0.0};
    assert_near(shcd_ledger_move(&l, &pose, 1e-3), 0.0, 0.0);
    const shcd_ledger_input held = {.published = {{1.0, 0.0, 0.0}, {0.0, 0.0, 0.5}},
                                    .model = {{2.0, 3.0, 0.0}, {0.0, 0.0, 0.5}}};
    assert_int_equal(shcd_ledger_hold(&l, &held), SHCD_OK);
    pose.position_m = shcd_vec3_make(-0.25, 0.5, 0.0);
    pose.orientation = (shcd_quat){cos(0.1), 0.0, 0.0, -sin(0.1)}; /* -0.2 rad */
    assert_near(shcd_ledger_move(&l, &pose, 1e-3), 0.25 + 0.1, 1e-12);
    shcd_ledger_share(&l, parts, 2, entry_j);
    assert_near(l.given_j, 0.35, 1e-12);
    assert_near(entry_j[0] + entry_j[1], 2.0 * 0.25 - 3.0 * 0.5, 1e-15);
    assert_near(l.output_chain_j, 0.25 - (entry_j[0] + entry_j[1]), 1e-12);
    assert_near(l.turned_rad.z, -0.2, 1e-12);
    shcd_ledger_lift(&l);
    pose.position_m.x = 7.0;
    assert_near(shcd_ledger_move(&l, &pose, 1e-3), 0.0, 0.0);
    assert_int_equal(shcd_ledger_hold(NULL, &held), SHCD_ERR_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_paths_of_a_sphere_on_a_spring),
        cmocka_unit_test(test_closed_paths_of_a_point_on_a_spring),
        cmocka_unit_test(test_closed_paths_of_a_sphere_with_damping),
        cmocka_unit_test(test_closed_paths_of_a_point_with_damping),
        cmocka_unit_test(test_requery_closes_the_account_of_a_spring),
        cmocka_unit_test(test_margin_of_a_spring_that_cheats_is_negative),
        cmocka_unit_test(test_output_chain_is_what_the_published_force_lacks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
