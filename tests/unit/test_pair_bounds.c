/* SPDX-License-Identifier: BSD-3-Clause */
/* The bounds behind the gap of two bodies, one by one: what the separating sphere says of its caps
 * and of leaves, against samples; and that no bound drops the closest pair when only a little less
 * than it is asked for. */
#include "query/pair.h"
#include "support/bodies.h"
#include "support/check.h"

#include <string.h>

typedef struct setup {
    shcd_model *model[2];
    shcdi_pair_search s;
} setup;

static shcd_quat random_turn(check_random *r) {
    const double w = check_normal(r), x = check_normal(r), y = check_normal(r), z = check_normal(r);
    const double n = sqrt(w * w + x * x + y * y + z * z);
    const shcd_quat q = {w / n, x / n, y / n, z / n};
    return q;
}

static void begin(setup *u, shcd_pose b_in_a) {
    const shcd_pose rest = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
    memset(&u->s, 0, sizeof u->s);
    for (int which = 0; which < 2; which++) {
        shcdi_pair_body *body = &u->s.body[which];
        body->model = u->model[which];
        body->pose = which == 0 ? rest : b_in_a;
        shcdi_view_of(body->model, NULL, &body->view);
        body->centre = shcd_transform(body->pose, bodies_info(body->model).centre_m);
    }
    u->s.upper = HUGE_VAL;
    u->s.tolerance = 1e-7;
    u->s.slack = 1e-12;
    u->s.evaluations_max = 2000000;
    u->s.patches_max = 40000000;
}

/* The best pair that Newton finds from random starts. */
static void find_pair(setup *u, check_random *random) {
    for (int start = 0; start < 24; start++) {
        shcdi_pair_end end[2];
        shcdi_pair_end_at(&u->s, 0, bodies_random_direction(random), &end[0]);
        shcdi_pair_end_at(&u->s, 1, bodies_random_direction(random), &end[1]);
        shcdi_pair_polish(&u->s, end);
    }
}

static void random_setup(setup *u, check_random *random, size_t i) {
    for (size_t which = 0; which < 2; which++) {
        u->model[which] = i % 3 == which
                              ? bodies_create_bent(0.5, 0.6, 1.0, 0.9)
                              : bodies_create_random(random, 1 + (int)((i + which) % 6), 0.05);
    }
}

static shcd_pose random_pose(const setup *u, check_random *random) {
    const shcd_model_info a = bodies_info(u->model[0]), b = bodies_info(u->model[1]);
    shcd_pose pose;
    pose.orientation = random_turn(random);
    pose.position_m = shcd_sub(
        shcd_mul_add(a.centre_m, check_uniform(random, 0.8, 1.2) * (a.radius_m + b.radius_m),
                     bodies_random_direction(random)),
        shcd_rotate(pose.orientation, b.centre_m));
    return pose;
}

/* Moves the second body along the closest pair until the gap is small: there patches face each
 * other over less than their size. 0 if the bodies meet elsewhere then. */
static int bring_near(setup *u, check_random *random) {
    shcd_pose pose = u->s.body[1].pose;
    const shcd_vec3 n = shcd_unit(shcd_sub(u->s.best[1].jet.s, u->s.best[0].jet.s));
    const double gap = check_uniform(random, 0.01, 0.1);
    pose.position_m = shcd_mul_add(pose.position_m, gap - u->s.upper, n);
    begin(u, pose);
    find_pair(u, random);
    return u->s.upper > 0.9 * gap;
}

static void end_setup(setup *u) {
    shcd_model_free(u->model[0]);
    shcd_model_free(u->model[1]);
}

/* How far a point is beyond a bound of the separator; at most 0 if the bound holds. */
static double beyond(shcdi_pair_search *s, int which, shcd_vec3 w, double bound) {
    const double r =
        shcd_norm(shcd_sub(shcdi_pair_point(s, which, shcd_unit(w)), s->separator.centre));
    return which == s->separator.inner ? r - bound : bound - r;
}

static void check_cap(setup *u, int which, check_random *random, double rounding) {
    const shcd_vec3 w = u->s.separator.cap[which].w;
    const double chord2 = u->s.separator.cap[which].chord2;
    for (int i = 0; chord2 > 0.0 && i < 300; i++) {
        const shcd_vec3 side = shcd_unit(shcd_cross(w, bodies_random_direction(random)));
        const double chord = sqrt(chord2) * (i % 2 == 0 ? 1.0 : check_uniform(random, 0.0, 1.0));
        /* cosine and sine of the angle of that chord */
        const double c = 1.0 - 0.5 * chord * chord, sine = sqrt(1.0 - c * c);
        const shcd_vec3 at = shcd_mul_add(shcd_scale(c, w), sine, side);
        assert_at_most(beyond(&u->s, which, at, u->s.separator.cap[which].bound), rounding);
    }
}

static void check_leaves(setup *u, int which, check_random *random, double rounding,
                         size_t *n_refined) {
    shcdi_pair_search *s = &u->s;
    const size_t n = SHCDI_BLOCK_LEAVES * shcdi_view_block_count(&s->body[which].view);
    const size_t near = shcdi_view_leaf_of(&s->body[which].view, s->best[which].w);
    for (int i = 0; i < 40; i++) {
        const size_t leaf = i < 16 ? (near / 16) * 16 + (size_t)i
                                   : (size_t)(check_random_bits(random) % (uint64_t)n);
        shcdi_view_leaf table;
        shcdi_pair_patch patch;
        shcdi_view_leaf_at(&s->body[which].view, leaf, &table);
        shcdi_pair_leaf(s, which, &table, &patch);
        const double whole =
            shcdi_separator_bound(&s->separator, which, &patch.patch, patch.deviation);
        const double refined = shcdi_separator_refine(s, which, leaf, whole);
        *n_refined += refined != whole;
        for (int k = 0; k < 100; k++) {
            const double a = check_uniform(random, 0.0, 1.0);
            const double b = check_uniform(random, 0.0, 1.0 - a);
            shcd_vec3 w = shcd_scale(a, table.w[0]);
            w = shcd_mul_add(shcd_mul_add(w, b, table.w[1]), 1.0 - a - b, table.w[2]);
            assert_at_most(beyond(s, which, w, whole), rounding);
            assert_at_most(beyond(s, which, w, refined), rounding);
        }
    }
}

static void test_separator_bounds_hold_for_samples(void **state) {
    (void)state;
    check_random random = {20261210};
    size_t n_separators = 0, n_caps = 0, n_refined = 0;
    const size_t n = check_scaled(30);
    for (size_t i = 0; i < n; i++) {
        setup u;
        random_setup(&u, &random, i);
        begin(&u, random_pose(&u, &random));
        find_pair(&u, &random);
        shcdi_separator_make(&u.s);
        /* |S - z| of a centre at most 100 diagonals away, of bodies of 4 m */
        const double rounding = 1e-12 * (1.0 + shcd_norm(u.s.separator.centre));
        for (int which = 0; which < 2 && u.s.separator.exists; which++) {
            n_separators += which == 0;
            n_caps += u.s.separator.cap[which].chord2 > 0.0;
            check_cap(&u, which, &random, rounding);
            check_leaves(&u, which, &random, rounding, &n_refined);
        }
        end_setup(&u);
    }
    print_message("seed 20261210: %zu separators of %zu pairs, %zu caps, %zu leaves refined\n",
                  n_separators, n, n_caps, n_refined);
    assert_true(n_separators >= n / 2 && n_caps >= n_separators && n_refined > n);
}

/* With `upper` a little above the true distance the search must come upon a better pair: a bound
 * that is too high would drop the patches that hold it. */
static void test_pair_bound_never_drops_the_closest_pair(void **state) {
    (void)state;
    check_random random = {20261211};
    const size_t n = check_scaled(30);
    size_t n_near = 0;
    for (size_t i = 0; i < n; i++) {
        setup u;
        random_setup(&u, &random, i);
        begin(&u, random_pose(&u, &random));
        find_pair(&u, &random);
        if (!bring_near(&u, &random)) {
            end_setup(&u);
            continue;
        }
        n_near++;
        const double best = u.s.upper;
        for (int k = 0; k < 2; k++) {
            const double above = k == 0 ? 1e-3 : 1e-4;
            u.s.upper = best;
            shcdi_separator_make(&u.s);
            u.s.upper = best + above;
            u.s.tolerance = 1e-3 * above;
            shcdi_pair_bound(&u.s);
            assert_int_equal(u.s.is_exhausted, 0);
            assert_int_equal(u.s.improved, 1);
            assert_true(u.s.upper <= best + 0.01 * above);
        }
        end_setup(&u);
    }
    print_message("seed 20261211: %zu pairs\n", n_near);
    assert_true(n_near >= n / 3);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_separator_bounds_hold_for_samples),
        cmocka_unit_test(test_pair_bound_never_drops_the_closest_pair),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
