/* SPDX-License-Identifier: BSD-3-Clause */
/* The energy ledger of soft bodies with `damping`, with `friction` beside it, and of two soft
 * bodies that a tool presses into at once: on closed paths the inequality of shcd/energy.h holds in
 * every tick; so it does for the walls of a groove, which share one law of any form. Parameters,
 * bodies and paths are random; SHCD_TEST_SCALE=100 walks thousands of paths. */
#include "account.h"

#include "response/scene_private.h"

#define SEED 0x50f7
#define LEAD 60

typedef struct draw {
    shcd_parameter_value k, ratio, rub, young, zeta;
    double stiffness_n_per_m; /* of all springs that a tool feels at once */
} draw;

typedef enum mix { MIX_FRICTION = 1, MIX_TWO = 2, MIX_NO_LAW = 4 } mix;

/* @return number of effects */
static size_t make(draw *d, int m, check_random *r, shcd_effect_def effects[4]) {
    size_t n = 0;
    d->k = (shcd_parameter_value){.name = "k_n_per_m", .value = check_uniform(r, 100.0, 700.0)};
    d->ratio = (shcd_parameter_value){.name = "ratio", .value = check_uniform(r, 0.05, 1.0)};
    d->rub =
        (shcd_parameter_value){.name = "stiffness_n_per_m", .value = check_uniform(r, 50.0, 500.0)};
    d->young = (shcd_parameter_value){.name = "youngs_modulus_pa",
                                      .value = 1e3 * pow(30.0, check_uniform(r, 0.0, 1.0))};
    d->zeta = (shcd_parameter_value){.name = "damping_ratio", .value = check_uniform(r, 0.0, 0.4)};
    d->stiffness_n_per_m = 0.0;
    if ((m & MIX_NO_LAW) == 0) {
        effects[n++] = (shcd_effect_def){"stiffness", &d->k, 1};
        d->stiffness_n_per_m = d->k.value;
    }
    effects[n++] = (shcd_effect_def){"wave", &d->young, 1};
    effects[n++] = (shcd_effect_def){"damping", &d->ratio, 1};
    if ((m & MIX_FRICTION) != 0) {
        effects[n++] = (shcd_effect_def){"friction", &d->rub, 1};
        d->stiffness_n_per_m += d->rub.value;
    }
    return n;
}

static double share_of(int k) {
    return fmax(0.0, fmin((double)k / TICKS, 1.0));
}

/* Where a path begins outside of one body it may be inside of the other: first comes a way in, and
 * last one out, across the valley between the two. */
static shcd_vec3 from_the_valley(const path *p, int k) {
    const shcd_vec3 out = {0.759, -0.651, 0.0}; /* at a right angle to the line of centres */
    const double away = fmax(0.0, fmax(-k, k - TICKS)) / LEAD;
    return shcd_mul_add(path_at(p, share_of(k)), 0.01 * fmin(away, 1.0), out);
}

static void check_mix(int m) {
    account *a = malloc(sizeof *a);
    shcd_model *model = soft_sphere(0.05, 8);
    const shcd_vec3 other_at_m = {0.045, 0.0525, 0.0};
    const size_t n_paths = 4 + check_scaled(36);
    size_t n_moved = 0;
    uint32_t n_contacts = 0;
    assert_non_null(a);
    print_message("seed %d\n", SEED + m);
    for (size_t i = 0; i < n_paths; i++) {
        check_random r = {SEED + (uint64_t)m + 16 * i};
        draw d;
        shcd_effect_def effects[4];
        const bool is_two = (m & MIX_TWO) != 0;
        const size_t n = make(&d, m, &r, effects);
        account_open(a, model, is_two ? &other_at_m : NULL, effects, n, 0.0);
        if ((m & MIX_NO_LAW) != 0) { /* the membrane's own, in a tick or held */
            double tick, held;
            assert_int_equal(shcd_scene_wave_stiffness(a->f.scene, 0, FIXTURE_TICK_S, &tick, &held),
                             SHCD_OK);
            d.stiffness_n_per_m += fmax(tick, held);
            a->elastic = "wave";
        }
        a->stiffness_n_per_m = (is_two ? 2.0 : 1.0) * d.stiffness_n_per_m;
        a->damping_s_per_m = 1.5 * d.ratio.value / 0.1;
        const shcd_vec3 valley = {1.0, check_uniform(&r, 0.0, 0.1), check_uniform(&r, -0.3, 0.3)};
        const path p = path_make(
            model, (path_kind)(i % PATH_KINDS), is_two ? valley : bodies_random_direction(&r),
            RADIUS_M, check_uniform(&r, 5e-4, DEPTH_M), check_uniform(&r, 0.01, 0.15), &r);
        account_reset(a);
        for (int k = -LEAD; k <= TICKS + LEAD + 50; k++) {
            account_tick(a, is_two ? from_the_valley(&p, k) : path_at(&p, share_of(k)));
        }
        if (!(a->least_j >= -TOLERANCE_J * check_tolerance_scale())) {
            fail_msg(
                "path %zu kind %d: margin %.3g J, slack %.3g, given %.3g, taken %.3g, stored at "
                "most %.3g; k %.3g, E %.3g, ratio %.2g",
                i, (int)p.kind, a->least_j, a->ledger.slack_j, a->ledger.given_j, a->ledger.taken_j,
                a->stored_most_j, d.k.value, d.young.value, d.ratio.value);
        }
        n_contacts = a->most_contacts > n_contacts ? a->most_contacts : n_contacts;
        n_moved += a->stored_most_j > 100.0 * TOLERANCE_J;
        fixture_close(&a->f);
    }
    shcd_model_free(model);
    free(a);
    assert_true(10 * n_moved > 9 * n_paths); /* a random one may miss the body */
    assert_true(n_contacts >= ((m & MIX_TWO) != 0 ? 2u : 1u));
}

static void test_closed_paths_with_damping_on_a_soft_body(void **state) {
    (void)state;
    check_mix(0);
    check_mix(MIX_NO_LAW);
}

static void test_closed_paths_with_damping_and_friction_on_a_soft_body(void **state) {
    (void)state;
    check_mix(MIX_FRICTION);
    check_mix(MIX_FRICTION | MIX_NO_LAW);
}

static void test_closed_paths_with_damping_between_two_soft_bodies(void **state) {
    (void)state;
    check_mix(MIX_TWO);
    check_mix(MIX_TWO | MIX_NO_LAW);
}

static void test_closed_paths_with_damping_and_friction_between_two_soft_bodies(void **state) {
    (void)state;
    check_mix(MIX_TWO | MIX_FRICTION);
    check_mix(MIX_TWO | MIX_FRICTION | MIX_NO_LAW);
}

/* ---- a groove ------------------------------------------------------------------------------- */

#define GROOVE_TICKS 2000
#define GROOVE_BALL_M 0.004
#define GROOVE_DEPTH_M 1.2e-3
#define GROOVE_SIDE_M 3e-4

/* Flat walls, which move along their normals as the membrane does at their places and do not turn:
 * then all that a lap yields is the sharing's own. */
typedef struct groove {
    fixture f;
    const shcdi_soft *soft;
    unsigned char *memory;
    const shcdi_active_effect *law;
    shcd_vec3 normal[SHCDI_WALLS_MAX], place[SHCDI_WALLS_MAX];
    size_t n_walls;
    double stored_j;
    uint32_t flags;
} groove;

static void groove_open(groove *g, const shcd_model *model, double law_pa, double wave_pa,
                        check_random *r) {
    const shcd_parameter_value law = {.name = "youngs_modulus_pa", .value = law_pa};
    const shcd_parameter_value wave = {.name = "youngs_modulus_pa", .value = wave_pa};
    const shcd_effect_def effects[2] = {{"stiffness", &law, 1}, {"wave", &wave, 1}};
    const shcd_body_def body = fixture_body("body", model, fixture_pose(0, 0, 0), effects, 2);
    const shcd_tool_def tool = fixture_tool("ball", GROOVE_BALL_M);
    memset(g, 0, sizeof *g);
    fixture_open(&g->f, &body, 1, &tool, 1);
    g->soft = g->f.scene->bodies[0].soft;
    g->memory = (unsigned char *)g->f.state + g->f.scene->bodies[0].soft_offset;
    g->law = &g->f.scene->bodies[0].effects[g->soft->law];
    g->n_walls = 2 + (size_t)(check_uniform(r, 0.0, 2.0) >= 1.0);
    const double half_rad = check_uniform(r, 0.15, 0.6); /* of the cone that the normals lie on */
    for (size_t i = 0; i < g->n_walls; i++) {
        const double turn = 2.0 * SOFT_PI * (double)i / (double)g->n_walls;
        g->normal[i] =
            shcd_vec3_make(sin(half_rad) * cos(turn), sin(half_rad) * sin(turn), cos(half_rad));
        g->place[i] = shcd_unit(shcd_vec3_make(-0.2 * cos(turn), -0.2 * sin(turn), 1.0));
    }
}

/* How far the membrane has moved at a contact. */
static shcd_vec3 groove_moved(const groove *g, const shcdi_soft_parts *p, size_t i) {
    shcd_vec3 sum = {0.0, 0.0, 0.0};
    for (size_t k = 0; k < g->soft->n_modes; k++) {
        sum = shcd_mul_add(sum, p->at[i * g->soft->n_modes + k] * g->soft->q_of_x[k], p->x[k]);
    }
    return sum;
}

/* The force on a ball at x, 0 being where it touches all walls at rest. */
static shcd_vec3 groove_tick(groove *g, shcd_vec3 x) {
    const shcdi_soft_gain whole = {1.0, 1.0, 1.0};
    const shcdi_soft_parts p = shcdi_soft_parts_of(g->soft, g->memory);
    shcd_vec3 force = {0.0, 0.0, 0.0};
    shcdi_soft_evolve(g->soft, g->memory, whole, FIXTURE_TICK_S);
    for (size_t i = 0; i < g->n_walls; i++) {
        shcdi_press *press = shcdi_soft_note(g->soft, g->memory, g->place[i]);
        const shcdi_press wall = {.touch = {.model = g->soft->model,
                                            .tool_radius_m = GROOVE_BALL_M,
                                            .wave_share = 1.0,
                                            .normal = g->normal[i]},
                                  .share = 1.0,
                                  .is_wall = 1};
        assert_non_null(press);
        *press = wall;
        press->response.depth_m = shcd_dot(shcd_sub(groove_moved(g, &p, i), x), g->normal[i]);
    }
    shcdi_soft_press(g->soft, g->memory, g->law, whole, HUGE_VAL);
    g->stored_j = p.head->stored_j;
    for (size_t i = 0; i < g->n_walls; i++) {
        const shcdi_response *r = &p.press[i].response;
        force = shcd_mul_add(force, r->normal_force_n, g->normal[i]);
        g->stored_j += r->stored_j;
        g->flags |= r->flags;
    }
    return force;
}

/* In, four laps of an ellipse off the middle, and out. */
static shcd_vec3 groove_at(const double at[4], double s) {
    const double gate = path_gate(s), turn = 8.0 * SOFT_PI * s;
    return shcd_vec3_make(gate * (at[0] + at[1] * cos(turn)), gate * at[2] * cos(turn),
                          (1.0 - gate) * 1e-3 - gate * (GROOVE_DEPTH_M + at[3] * sin(turn)));
}

static void walk_groove(groove *g, const double at[4], double stiffness_n_per_m,
                        shcd_ledger *ledger, double *least_j) {
    for (int k = 0; k <= GROOVE_TICKS; k++) {
        const shcd_pose pose = {groove_at(at, (double)k / GROOVE_TICKS), {1.0, 0.0, 0.0, 0.0}};
        (void)shcd_ledger_move(ledger, &pose, FIXTURE_TICK_S);
        const shcd_wrench wrench = {groove_tick(g, pose.position_m), {0.0, 0.0, 0.0}};
        const shcd_ledger_input held = {.published = wrench,
                                        .model = wrench,
                                        .stored_j = g->stored_j,
                                        .stiffness_n_per_m = stiffness_n_per_m};
        assert_int_equal(shcd_ledger_hold(ledger, &held), SHCD_OK);
        *least_j = fmin(*least_j, shcd_ledger_margin(ledger));
    }
}

/* The steepest slope of the law, 2 E* a/(1 - a/p) at a depth a^2/R - 2 a^3/(3 R p), beside a
 * membrane of the patch radius p (stiffness.c); that gives way in series. Flat walls within 90
 * degrees of each other add nothing (walls.c), and the depth in all of them is no more than the way
 * to 0, which is out of them. */
static double groove_stiffness(double law_pa, double depth_m) {
    const double patch_m = 0.005, modulus_pa = law_pa / (1.0 - 0.45 * 0.45);
    double a = 0.0;
    while ((a - 2.0 * a * a / (3.0 * patch_m)) * a / GROOVE_BALL_M < depth_m) {
        a += 1e-6;
        assert_true(a < 0.8 * patch_m);
    }
    return 2.0 * modulus_pa * a / (1.0 - a / patch_m);
}

static void test_closed_paths_in_a_groove_whose_law_stiffens(void **state) {
    shcd_model *model = soft_sphere(0.05, 8);
    check_random r = {SEED + 8};
    const size_t n_paths = 10 + check_scaled(50);
    const double across_m = 2.0 * GROOVE_SIDE_M, in_m = GROOVE_DEPTH_M + GROOVE_SIDE_M;
    const double deepest_m =
        sqrt(across_m * across_m + GROOVE_SIDE_M * GROOVE_SIDE_M + in_m * in_m);
    double given_j = 0.0, over_j = 0.0;
    (void)state;
    for (size_t i = 0; i < n_paths; i++) {
        const double law_pa = check_uniform(&r, 1e4, 1e5);
        const double wave_pa = law_pa * pow(1e4, check_uniform(&r, 0.0, 1.0));
        const double at[4] = {check_uniform(&r, -GROOVE_SIDE_M, GROOVE_SIDE_M),
                              check_uniform(&r, 1e-4, GROOVE_SIDE_M),
                              check_uniform(&r, -GROOVE_SIDE_M, GROOVE_SIDE_M),
                              check_uniform(&r, -GROOVE_SIDE_M, GROOVE_SIDE_M)};
        const double k_n_per_m = groove_stiffness(law_pa, deepest_m);
        shcd_ledger ledger;
        double least_j = HUGE_VAL;
        groove g;
        groove_open(&g, model, law_pa, wave_pa, &r);
        memset(&ledger, 0, sizeof ledger);
        walk_groove(&g, at, k_n_per_m, &ledger, &least_j);
        if (!(least_j >= -TOLERANCE_J * check_tolerance_scale())) {
            fail_msg("path %zu in %zu walls: margin %.3g J, slack %.3g, given %.3g, taken %.3g; "
                     "E %.3g Pa, of the membrane %.3g Pa",
                     i, g.n_walls, least_j, ledger.slack_j, ledger.given_j, ledger.taken_j, law_pa,
                     wave_pa);
        }
        assert_int_equal(g.flags, 0);
        assert_true(ledger.given_j > ledger.slack_j); /* which does not decide alone */
        given_j = fmax(given_j, ledger.given_j);
        over_j = fmax(over_j, ledger.taken_j - ledger.given_j);
        fixture_close(&g.f);
    }
    print_message("up to %.3g J given on a path, and %.3g J more taken than given\n", given_j,
                  over_j);
    assert_true(over_j > 100.0 * TOLERANCE_J); /* a held spring does: the slack is not idle */
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_paths_with_damping_on_a_soft_body),
        cmocka_unit_test(test_closed_paths_with_damping_and_friction_on_a_soft_body),
        cmocka_unit_test(test_closed_paths_with_damping_between_two_soft_bodies),
        cmocka_unit_test(test_closed_paths_with_damping_and_friction_between_two_soft_bodies),
        cmocka_unit_test(test_closed_paths_in_a_groove_whose_law_stiffens),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
