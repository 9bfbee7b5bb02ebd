/* SPDX-License-Identifier: BSD-3-Clause */
/* What a foot says of its surroundings: the curve below f, and how far a point may move before
 * another foot can be nearer; against dense sampling. */
#include "query/internal.h"
#include "query/margin.h"
#include "support/bodies.h"

#define DIRECTIONS 24
#define AWAY 400 /* random parameters all over the sphere */

static shcdi_view view_of(const shcd_model *m) {
    shcdi_view view;
    shcdi_view_of(m, NULL, &view);
    return view;
}

/* Near the surface, inside and outside, or anywhere in the body's ball. */
static shcd_vec3 random_point(const shcd_model *m, check_random *random, size_t i) {
    shcd_model_info info = bodies_info(m);
    shcd_vec3 s, n;
    assert_int_equal(shcd_model_surface(m, -1, bodies_random_direction(random), &s, &n, NULL),
                     SHCD_OK);
    if (i % 4 == 3) {
        return shcd_mul_add(info.centre_m, check_uniform(random, 0.0, 1.2 * info.radius_m),
                            bodies_random_direction(random));
    }
    return shcd_mul_add(s, 0.08 * check_uniform(random, -1.0, 1.0) * info.diagonal_m, n);
}

/* At an angle s from a foot, along the direction of its tangent frame. */
static shcd_vec3 along(const shcdi_foot *foot, double turn, double s) {
    const shcd_vec3 v = shcd_mul_add(shcd_scale(cos(turn), foot->jet.t1), sin(turn), foot->jet.t2);
    return shcd_unit(shcd_mul_add(shcd_scale(cos(s), foot->w), sin(s), v));
}

static int find_foot(shcdi_search *s, const shcdi_view *view, shcd_vec3 p) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcdi_search_exactly(s, view, p, &options);
    return !s->truncated && s->best_room > 0.0 && s->best.low > 0.0;
}

static void test_curve_stays_below_f(void **state) {
    check_random random = {411};
    double gained = 0.0;
    (void)state;
    for (int degree = 2; degree <= 12; degree += 5) {
        shcd_model *m = bodies_create_random(&random, degree, 0.1);
        const shcdi_view view = view_of(m);
        for (size_t i = 0; i < 10 + check_scaled(200); i++) {
            shcdi_search s;
            const shcd_vec3 p = random_point(m, &random, i);
            if (!find_foot(&s, &view, p)) {
                continue;
            }
            const shcdi_foot *foot = &s.best;
            const shcdi_curve curve = shcdi_curve_of(foot, &s.best_bounds);
            const double g = sqrt(foot->g1 * foot->g1 + foot->g2 * foot->g2);
            gained = fmax(gained, curve.until / s.best_room);
            for (int k = 0; k < 10 * DIRECTIONS; k++) {
                const double angle = s.best_room * check_uniform(&random, 1e-3, 1.0);
                const shcd_vec3 w =
                    along(foot, check_uniform(&random, 0.0, 2.0 * BODIES_PI), angle);
                const shcd_vec3 r = shcd_sub(shcdi_view_point(&view, w), p);
                const double f = 0.5 * shcd_dot(r, r);
                assert_true(f + 1e-14 * (f + foot->f) >=
                            foot->f - g * angle + shcdi_curve_mean(&curve, angle) * angle * angle);
            }
        }
        shcd_model_free(m);
    }
    assert_true(gained > 0.1); /* the term of S'.S'' was put to the test */
}

typedef struct tally {
    size_t n, n_none;
    double tightest; /* least of mu/rho */
} tally;

static void check_place(const shcdi_view *view, const shcdi_search *s, shcdi_margin margin,
                        shcd_vec3 w, const shcd_vec3 *moved, size_t n_moved, tally *t) {
    const shcd_vec3 x = shcdi_view_point(view, w), s0 = s->best.jet.s;
    const shcd_vec3 y = shcd_sub(x, s0);
    const double far = shcd_norm(shcd_sub(x, s->p)), near = shcd_norm(shcd_sub(s0, s->p));
    const double mu = (far - near) * (far + near) / (2.0 * shcd_norm(y));
    if (!(mu >= margin.rho_m)) {
        fail_msg("mu %.17g below rho %.17g at (%.17g, %.17g, %.17g)", mu, margin.rho_m, w.x, w.y,
                 w.z);
    }
    t->tightest = fmin(t->tightest, mu / margin.rho_m);
    for (size_t i = 0; i < n_moved; i++) {
        const double apart = shcd_norm(shcd_sub(s0, moved[i]));
        const double gap =
            shcdi_margin_gap(margin, apart, shcd_norm(shcd_sub(moved[i], s->p)) * (1.0 + 1e-15));
        assert_true(gap >= 0.0 && shcd_norm(shcd_sub(x, moved[i])) - apart >= gap - 4e-16 * far);
    }
}

static void test_nothing_outside_the_cap_comes_nearer(void **state) {
    check_random random = {412};
    tally t = {0, 0, HUGE_VAL};
    (void)state;
    for (int degree = 1; degree <= 15; degree += 7) {
        shcd_model *m = bodies_create_random(&random, degree, degree == 15 ? 0.05 : 0.15);
        const shcdi_view view = view_of(m);
        for (size_t i = 0; i < 20 + check_scaled(300); i++) {
            shcdi_search s;
            double cap;
            shcd_vec3 moved[4];
            if (!find_foot(&s, &view, random_point(m, &random, i))) {
                continue;
            }
            const shcdi_margin margin = shcdi_margin_outside(
                &s, &s.best, &s.best_bounds, s.best_room,
                view.diagonal_m * pow(10.0, check_uniform(&random, -4.0, -1.3)), 0.0, &cap);
            t.n++;
            if (!(margin.rho_m > 0.0)) {
                t.n_none++;
                continue;
            }
            assert_true(cap > 0.0 && cap < s.best_room && margin.near_m > 0.0);
            for (size_t k = 0; k < 4; k++) {
                moved[k] = shcd_mul_add(s.p, margin.rho_m * (k == 0 ? 0.999 : 0.3 * (double)k),
                                        bodies_random_direction(&random));
            }
            for (int k = 0; k < DIRECTIONS; k++) { /* just outside, and a few caps away */
                const double turn = 2.0 * BODIES_PI * k / DIRECTIONS;
                for (double angle = cap * (1.0 + 1e-9); angle < 6.0 * cap; angle *= 1.3) {
                    check_place(&view, &s, margin, along(&s.best, turn, angle), moved, 4, &t);
                }
            }
            for (int k = 0; k < AWAY; k++) {
                const shcd_vec3 w = bodies_random_direction(&random);
                if (shcd_dot(w, s.best.w) < cos(cap) - 1e-12) {
                    check_place(&view, &s, margin, w, moved, 4, &t);
                }
            }
        }
        shcd_model_free(m);
    }
    print_message("%zu feet, %zu of them without a margin; least mu is %.2f times rho\n", t.n,
                  t.n_none, t.tightest);
    assert_true(t.n_none < t.n / 2);
    assert_true(t.tightest < 1.5); /* else the test would not have come near the bound */
}

/* From far away the rounding of S is not small beside a leaf about the foot itself, which bounds
 * nothing: no margin may come of that. */
static void test_far_points_get_no_false_margin(void **state) {
    check_random random = {413};
    tally t = {0, 0, HUGE_VAL};
    (void)state;
    for (int b = 0; b < 3; b++) {
        shcd_model *m = bodies_create_random(&random, 6, b == 0 ? 0.05 : 0.4);
        const shcdi_view view = view_of(m);
        for (size_t i = 0; i < 40 + check_scaled(400); i++) {
            shcdi_search s;
            double cap;
            const double away = view.diagonal_m * pow(10.0, check_uniform(&random, 0.5, 4.0));
            const shcd_vec3 p =
                shcd_mul_add(bodies_info(m).centre_m, away, bodies_random_direction(&random));
            if (!find_foot(&s, &view, p)) {
                continue;
            }
            const shcdi_margin margin = shcdi_margin_outside(
                &s, &s.best, &s.best_bounds, s.best_room, 0.1 * view.diagonal_m, 0.0, &cap);
            t.n++;
            t.n_none += !(margin.rho_m > 0.0);
            assert_true(margin.rho_m == 0.0 || margin.near_m > 0.0);
            for (int k = 0; k < AWAY / 4 && margin.rho_m > 0.0; k++) {
                const shcd_vec3 w = bodies_random_direction(&random);
                if (shcd_dot(w, s.best.w) < cos(cap) - 1e-12) {
                    check_place(&view, &s, margin, w, NULL, 0, &t);
                }
            }
        }
        shcd_model_free(m);
    }
    print_message("far: %zu feet, %zu of them without a margin\n", t.n, t.n_none);
    assert_true(t.n > t.n_none && t.n_none > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_curve_stays_below_f),
        cmocka_unit_test(test_nothing_outside_the_cap_comes_nearer),
        cmocka_unit_test(test_far_points_get_no_false_margin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
