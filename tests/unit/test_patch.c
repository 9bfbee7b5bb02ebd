/* SPDX-License-Identifier: BSD-3-Clause */
/* The pieces of the certified search, each against an independent formula: distance to a triangle,
 * patches, the squared distance and its derivatives, Taylor bounds, Newton steps, winding numbers.
 */
#include "query/foot.h"
#include "query/patch.h"
#include "query/search.h"
#include "query/winding.h"
#include "support/bodies.h"
#include "support/check.h"
#include "support/maps.h"

static shcdi_view view_of(const shcd_model *model) {
    shcdi_view view;
    shcdi_view_of(model, NULL, &view);
    return view;
}

/* ---- triangles ---- */

typedef long double real;

static real distance_to_point(shcd_vec3 p, const shcd_vec3 x[3], const real b[3]) {
    const real d[3] = {b[0] * x[0].x + b[1] * x[1].x + b[2] * x[2].x - p.x,
                       b[0] * x[0].y + b[1] * x[1].y + b[2] * x[2].y - p.y,
                       b[0] * x[0].z + b[1] * x[1].z + b[2] * x[2].z - p.z};
    return sqrtl(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

/* Smallest distance over the edges and a grid of the triangle: never less than the true one, and no
 * more than it by the width of a sliver. */
static real distance_seen(shcd_vec3 p, const shcd_vec3 x[3]) {
    enum { N = 24 };
    real least = HUGE_VALL;
    for (int i = 0; i <= N; i++) {
        for (int k = 0; k <= N - i; k++) {
            const real b[3] = {(real)i / N, (real)k / N, (real)(N - i - k) / N};
            least = fminl(least, distance_to_point(p, x, b));
        }
    }
    for (int i = 0; i < 3; i++) {
        const int k = (i + 1) % 3;
        const real e[3] = {(real)x[k].x - x[i].x, (real)x[k].y - x[i].y, (real)x[k].z - x[i].z};
        const real q[3] = {(real)p.x - x[i].x, (real)p.y - x[i].y, (real)p.z - x[i].z};
        const real ee = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
        const real t = ee > 0.0L ? (q[0] * e[0] + q[1] * e[1] + q[2] * e[2]) / ee : 0.0L;
        real b[3] = {0.0L, 0.0L, 0.0L};
        b[k] = fminl(1.0L, fmaxl(0.0L, t));
        b[i] = 1.0L - b[k];
        least = fminl(least, distance_to_point(p, x, b));
    }
    return least;
}

static shcd_vec3 random_vector(check_random *random, double size) {
    const double x = check_normal(random), y = check_normal(random);
    return shcd_scale(size, shcd_vec3_make(x, y, check_normal(random)));
}

static void test_triangle_distance_is_optimal_for_well_shaped_triangles(void **state) {
    check_random random = {121};
    (void)state;
    for (size_t n = 0; n < check_scaled(3000); n++) {
        const double size = pow(10.0, check_uniform(&random, -6.0, 3.0));
        shcd_vec3 x[3];
        for (int i = 0; i < 3; i++) {
            x[i] = random_vector(&random, size);
        }
        const double width =
            shcd_norm(shcd_cross(shcd_sub(x[1], x[0]), shcd_sub(x[2], x[0]))) / (size * size);
        if (width < 0.1) {
            continue;
        }
        const shcd_vec3 p = random_vector(&random, size * (n % 2 ? 1.0 : 10.0));
        double b[3];
        const double d = shcdi_triangle_distance(p, x, b);
        const real at[3] = {b[0], b[1], b[2]};
        const double rounding = 1e-14 * fmax(1.0, 1.0 / width) * (size + shcd_norm(p));
        assert_true(b[0] >= 0.0 && b[1] >= 0.0 && b[2] >= 0.0);
        assert_near(b[0] + b[1] + b[2], 1.0, 1e-15);
        assert_near(d, (double)distance_to_point(p, x, at), rounding);
        /* no corner lies further in the direction of p: the plane through the foot, orthogonal to
         * p - foot, keeps the whole triangle on its other side, so the foot is the closest point */
        shcd_vec3 foot = {0.0, 0.0, 0.0};
        for (int i = 0; i < 3; i++) {
            foot = shcd_mul_add(foot, b[i], x[i]);
        }
        const shcd_vec3 r = shcd_unit(shcd_sub(p, foot));
        for (int i = 0; i < 3; i++) {
            assert_at_most(shcd_dot(shcd_sub(x[i], foot), r),
                           d > rounding ? 8.0 * size * rounding / fmin(d, size) : HUGE_VAL);
        }
    }
}

static void test_triangle_distance_never_exceeds_the_distance_of_slivers(void **state) {
    check_random random = {122};
    double worst = 0.0;
    (void)state;
    for (size_t n = 0; n < check_scaled(3000); n++) {
        /* collinear up to a width from 1e-3 down to nothing, or with coinciding corners */
        const double width = n % 7 == 0 ? 0.0 : pow(10.0, check_uniform(&random, -19.0, -3.0));
        const shcd_vec3 a = random_vector(&random, 1.0), e = random_vector(&random, 1.0);
        const shcd_vec3 x[3] = {
            a, shcd_add(a, e),
            shcd_add(shcd_mul_add(a, n % 11 == 0 ? 1.0 : check_uniform(&random, -1.0, 2.0), e),
                     random_vector(&random, width))};
        shcd_vec3 p = random_vector(&random, 1.0);
        if (n % 2) { /* beside it */
            p = shcd_mul_add(a, check_uniform(&random, -0.5, 1.5), e);
            p = shcd_add(p, random_vector(&random, pow(10.0, check_uniform(&random, -9.0, 0.0))));
        }
        double b[3];
        const double d = shcdi_triangle_distance(p, x, b);
        worst = fmax(worst, d - (double)distance_seen(p, x));
    }
    /* the slack of a query allows for 16 roundings of 2.2e-16 of numbers of size |p| + |a| + |e|,
     * up to 12 here */
    assert_at_most(worst, 16.0 * 2.2e-16 * 12.0);
}

/* ---- patches ---- */

static double area_of(const shcd_vec3 w[3]) {
    return 2.0 * atan2(shcd_dot(w[0], shcd_cross(w[1], w[2])),
                       1.0 + shcd_dot(w[0], w[1]) + shcd_dot(w[1], w[2]) + shcd_dot(w[2], w[0]));
}

static void test_patches_split_into_a_tiling_and_lie_in_their_caps(void **state) {
    check_random random = {123};
    shcd_model *m = bodies_create_random(&random, 7, 0.1);
    const shcdi_view view = view_of(m);
    (void)state;
    for (size_t i = 0; i < SHCDI_BLOCK_LEAVES * shcdi_view_block_count(&view); i += 7) {
        shcd_vec3 w[3], child[4][3];
        double area = 0.0, angle;
        for (int k = 0; k < 3; k++) {
            w[k] = shcdi_view_corner(&view, i, k);
        }
        const shcd_vec3 centre = shcdi_cap_of(w, &angle);
        for (int k = 0; k < 3; k++) {
            const double cosine = shcd_dot(centre, w[k]);
            assert_true(atan2(shcd_norm(shcd_cross(centre, w[k])), cosine) <= angle);
        }
        shcdi_split(w, child);
        for (int k = 0; k < 4; k++) {
            double inner;
            const shcd_vec3 middle = shcdi_cap_of(child[k], &inner);
            assert_true(inner < 0.6 * angle);
            area += area_of(child[k]);
            assert_true(area_of(child[k]) > 0.0);
            assert_int_equal(shcdi_view_leaf_of(&view, middle), i);
            for (int c = 0; c < 3; c++) {
                assert_near(shcd_norm(child[k][c]), 1.0, 4e-16);
            }
        }
        assert_near(area, area_of(w), 1e-15);
    }
    shcd_model_free(m);
}

static void test_angle_upper_is_one(void **state) {
    (void)state;
    for (double chord = 1e-12; chord <= 1.42; chord *= 1.07) {
        const double angle = 2.0 * asin(fmin(1.0, 0.5 * chord));
        assert_true(shcdi_angle_upper(chord) >= angle);
        assert_at_most(shcdi_angle_upper(chord), angle * (1.0 + 0.2 * chord * chord) + 1e-15);
    }
}

/* ---- squared distance ---- */

static shcd_vec3 moved(shcd_vec3 w, shcd_vec3 v, double t) {
    return shcd_unit(shcd_mul_add(shcd_scale(cos(t), w), sin(t), v));
}

static double f_at(const shcd_model *m, shcd_vec3 p, shcd_vec3 w) {
    const shcd_vec3 r = shcd_sub(shcdi_surface_point(&m->series, m->degree, w), p);
    return 0.5 * shcd_dot(r, r);
}

static void test_foot_has_the_derivatives_of_the_squared_distance(void **state) {
    check_random random = {124};
    shcd_model *m = bodies_create_random(&random, 8, 0.1);
    const shcdi_view view = view_of(m);
    const double h = 1e-3;
    (void)state;
    for (int n = 0; n < 200; n++) {
        const shcd_vec3 p = random_vector(&random, 1.5);
        const shcd_vec3 w =
            n < 2 ? shcd_vec3_make(0.0, 0.0, 2.0 * n - 1.0) : bodies_random_direction(&random);
        const shcd_vec3 v = shcd_unit(shcd_cross(w, bodies_random_direction(&random)));
        shcdi_foot foot;
        shcdi_foot_at(&view, p, w, &foot);
        const double c = shcd_dot(v, foot.jet.t1), s = shcd_dot(v, foot.jet.t2);
        const double slope = c * foot.g1 + s * foot.g2;
        const double bend = c * c * foot.h11 + 2.0 * c * s * foot.h12 + s * s * foot.h22;
        const double ahead = f_at(m, p, moved(w, v, h)), behind = f_at(m, p, moved(w, v, -h));
        /* f is a polynomial of degree 2 L along the circle, below (sup |r|)^2/2: by Bernstein its
         * third and fourth derivatives stay below (2 L)^3 and (2 L)^4 of that */
        const double reach = shcd_norm(shcd_sub(p, m->info.centre_m)) + m->info.radius_m;
        const double size = 0.5 * reach * reach;
        assert_near(slope, (ahead - behind) / (2.0 * h),
                    size * (pow(16.0, 3.0) * h * h / 6.0 + 1e-14 / h));
        assert_near(bend, (ahead - 2.0 * f_at(m, p, w) + behind) / (h * h),
                    size * (pow(16.0, 4.0) * h * h / 12.0 + 1e-14 / (h * h)));
        /* eigenvalues and eigenvectors */
        const double scale = fabs(foot.high) + fabs(foot.low);
        assert_near(foot.e1 * foot.e1 + foot.e2 * foot.e2, 1.0, 1e-15);
        assert_near(foot.h11 * foot.e1 + foot.h12 * foot.e2, foot.high * foot.e1, 4e-15 * scale);
        assert_near(foot.h12 * foot.e1 + foot.h22 * foot.e2, foot.high * foot.e2, 4e-15 * scale);
        assert_near(foot.low + foot.high, foot.h11 + foot.h22, 4e-15 * scale);
        assert_true(foot.low <= foot.high);
        assert_near(foot.distance, sqrt(2.0 * foot.f), 4e-16 * foot.distance);
    }
    shcd_model_free(m);
}

static void test_foot_lower_bounds_the_squared_distance_over_a_cap(void **state) {
    check_random random = {125};
    shcd_model *m = bodies_create_random(&random, 8, 0.15);
    const shcdi_view view = view_of(m);
    (void)state;
    for (size_t n = 0; n < check_scaled(400); n++) {
        const shcd_vec3 p = random_vector(&random, n % 2 ? 1.5 : 0.3);
        const double radius = pow(10.0, check_uniform(&random, -5.0, -0.3));
        shcdi_foot foot;
        shcdi_foot_at(&view, p, bodies_random_direction(&random), &foot);
        const double third = 3.0 * m->m[0] * m->m[1] + (foot.distance + m->m[0] * radius) * m->m[2];
        const double loss = third * radius * radius * radius / 6.0;
        const double lower = shcdi_foot_lower(&foot, radius, loss);
        double least = foot.f;
        for (int i = 0; i < 100; i++) {
            const double turn = check_uniform(&random, 0.0, 2.0 * BODIES_PI);
            const double t = i % 2 ? radius : check_uniform(&random, 0.0, radius);
            const shcd_vec3 v =
                shcd_mul_add(shcd_scale(cos(turn), foot.jet.t1), sin(turn), foot.jet.t2);
            least = fmin(least, f_at(m, p, moved(foot.w, v, t)));
        }
        assert_true(lower <= least + 1e-14 * foot.f);
    }
    shcd_model_free(m);
}

static void test_newton_descends_and_ends_where_the_gradient_does(void **state) {
    check_random random = {126};
    shcd_model *m = bodies_create_random(&random, 10, 0.2);
    const shcdi_view view = view_of(m);
    size_t done = 0;
    const size_t n = check_scaled(600);
    (void)state;
    for (size_t i = 0; i < n; i++) {
        const shcd_vec3 p = random_vector(&random, 1.5);
        shcdi_foot foot;
        uint32_t steps = 0, evaluations = 0;
        shcdi_foot_at(&view, p, bodies_random_direction(&random), &foot);
        const double f = foot.f;
        const int stationary = shcdi_newton(&view, p, 24, NULL, 0.0, &foot, &steps, &evaluations);
        assert_true(steps <= 24 && evaluations <= 240 && evaluations >= steps);
        /* the noise that Newton knows of, for every step */
        assert_true(foot.f <= f * (1.0 + 1e-13) + 1e-14);
        assert_near(shcd_norm(foot.w), 1.0, 4e-16);
        if (stationary) {
            /* a step s = |g|/k that would lower f by less than noise ends it: |g|^2/k < 2 noise,
             * k below sup |S'|^2 + |r| sup |S''| */
            const double k = m->m[0] * m->m[0] + foot.distance * m->m[1];
            const double noise = foot.distance * (8.0 * m->evaluation_error_m +
                                                  1e-15 * (foot.distance + shcd_norm(p)));
            assert_at_most(sqrt(foot.g1 * foot.g1 + foot.g2 * foot.g2),
                           sqrt(2.0 * k * noise) + 2.0 * k * 1e-15);
            done++;
        }
        uint32_t none = 0, before = evaluations;
        shcdi_newton(&view, p, 0, NULL, 0.0, &foot, &none, &evaluations);
        assert_true(none == 0 && evaluations == before);
    }
    assert_true(done > n * 9 / 10);
    shcd_model_free(m);
}

/* ---- what is proven around a foot ---- */

/* A foot at a local minimum, moved away by an angle. */
static void foot_beside(const shcdi_view *view, shcd_vec3 p, double angle, check_random *random,
                        shcdi_foot *foot) {
    uint32_t steps = 0, evaluations = 0;
    shcdi_foot_at(view, p, bodies_random_direction(random), foot);
    shcdi_newton(view, p, 24, NULL, 0.0, foot, &steps, &evaluations);
    const shcd_vec3 v = shcd_unit(shcd_cross(foot->w, bodies_random_direction(random)));
    shcdi_foot_at(view, p, moved(foot->w, v, angle), foot);
}

/* S_v and S_e along v and an axis e that is carried along the great circle with it: the third
 * covariant derivative at (v, v, e) differs from its symmetric part, which m3 bounds, by at most a
 * third of |S'| on the unit sphere (curvature 1), so S_e errs by (m3 + m1/3) d^2/2. */
static void test_finished_foot_errs_by_no_more_than_it_says(void **state) {
    check_random random = {130};
    double worst = 0.0;
    size_t n_done = 0;
    (void)state;
    for (int degree = 1; degree <= 9; degree += 8) {
        shcd_model *m = bodies_create_random(&random, degree, 0.1);
        const shcdi_view view = view_of(m);
        for (size_t i = 0; i < 100 + check_scaled(1000); i++) {
            const shcd_vec3 p = random_vector(&random, 1.5);
            shcdi_foot before, foot;
            foot_beside(&view, p, pow(10.0, check_uniform(&random, -8.0, -0.5)), &random, &foot);
            const double s1 = foot.step1, s2 = foot.step2, d = foot.step;
            if (!foot.is_definite || !(d > 0.0 && d < 1.0)) {
                continue;
            }
            before = foot;
            const double bound = shcdi_foot_finish(&foot, p, m->m[2]);
            const double rounding = 4.0 * m->evaluation_error_m;
            const shcd_vec3 v =
                shcd_mul_add(shcd_scale(s1 / d, before.jet.t1), s2 / d, before.jet.t2);
            const shcd_vec3 w = moved(before.w, v, d);
            const shcd_vec3 there = shcdi_surface_point(&m->series, degree, w);
            const double off = shcd_norm(shcd_sub(foot.jet.s, there));
            assert_true(off <= bound + rounding);
            worst = d > 1e-3 ? fmax(worst, off / bound) : worst;
            /* its parameter is a step in the tangent plane, which turns by atan d, not by d */
            assert_true(shcd_norm(shcd_sub(foot.w, w)) <= d * d * d / 3.0 + 4e-16);
            const shcd_vec3 at = shcdi_surface_point(&m->series, degree, foot.w);
            assert_true(shcd_norm(shcd_sub(foot.jet.s, at)) <=
                        bound + m->m[0] * d * d * d / 3.0 + rounding);
            /* the tangent axes, carried along */
            shcdi_jet jet;
            shcdi_surface_jet(&m->series, degree, w, &jet);
            const shcd_vec3 change = shcd_mul_add(shcd_scale(cos(d) - 1.0, v), -sin(d), before.w);
            const shcd_vec3 t1 = shcd_mul_add(before.jet.t1, s1 / d, change);
            const shcd_vec3 t2 = shcd_mul_add(before.jet.t2, s2 / d, change);
            const shcd_vec3 d1 = shcd_mul_add(shcd_scale(shcd_dot(t1, jet.t1), jet.s1),
                                              shcd_dot(t1, jet.t2), jet.s2);
            const shcd_vec3 d2 = shcd_mul_add(shcd_scale(shcd_dot(t2, jet.t1), jet.s1),
                                              shcd_dot(t2, jet.t2), jet.s2);
            const double first = (m->m[2] + m->m[0] / 3.0) * d * d / 2.0 + 1e-13 * m->m[1];
            assert_true(shcd_norm(shcd_sub(foot.jet.s1, d1)) <= first);
            assert_true(shcd_norm(shcd_sub(foot.jet.s2, d2)) <= first);
            n_done++;
        }
        shcd_model_free(m);
    }
    assert_true(n_done > 100 && worst > 0.5); /* nor is the bound far too large */
}

/* Samples f over a cap: up to its border, and around where f is least. */
static double least_within(const shcdi_view *view, shcd_vec3 p, const shcdi_foot *foot,
                           double angle, size_t n, check_random *random) {
    shcdi_foot minimum = *foot;
    uint32_t steps = 0, evaluations = 0;
    shcdi_newton(view, p, 24, NULL, 0.0, &minimum, &steps, &evaluations);
    const double way = 2.0 * asin(0.5 * shcd_norm(shcd_sub(minimum.w, foot->w)));
    double least = way <= angle ? minimum.distance : HUGE_VAL;
    for (size_t i = 0; i < n; i++) {
        const shcd_vec3 v = shcd_unit(shcd_cross(foot->w, bodies_random_direction(random)));
        const double t = i % 3 == 0 ? angle : angle * pow(check_uniform(random, 0.0, 1.0), 2.0);
        const shcd_vec3 at = shcdi_view_point(view, moved(foot->w, v, t));
        least = fmin(least, shcd_norm(shcd_sub(at, p)));
    }
    return least;
}

static void test_nothing_within_a_ball_is_nearer_than_its_bound(void **state) {
    check_random random = {131};
    size_t n_balls = 0, n_tight = 0;
    double widest = 0.0;
    (void)state;
    for (int degree = 1; degree <= 15; degree += 7) {
        shcd_model *m = bodies_create_random(&random, degree, 0.15);
        const shcdi_view view = view_of(m);
        for (size_t i = 0; i < 40 + check_scaled(400); i++) {
            /* at, near and far from a minimum; the bounds hold within their reach, or less */
            const double beside = i % 3 == 0 ? 0.0 : pow(10.0, check_uniform(&random, -7.0, -1.0));
            const shcd_vec3 p = shcd_add(m->info.centre_m, random_vector(&random, 0.8));
            shcdi_leaf_bounds bounds;
            shcdi_ball_bound ball;
            shcdi_foot foot;
            foot_beside(&view, p, beside, &random, &foot);
            const size_t leaf = shcdi_view_leaf_of(&view, foot.w);
            shcdi_view_leaf_bounds(&view, leaf, &bounds);
            const double whole = shcdi_room(&view, leaf, foot.w, bounds.reach);
            assert_true(whole > 0.5 * bounds.reach && whole <= bounds.reach);
            const double room = whole * (i % 2 ? 1.0 : check_uniform(&random, 0.01, 1.0));
            const double radius = shcdi_ball_about(&foot, &bounds, room, &ball);
            assert_true(radius >= 0.0 && radius <= room);
            if (!(radius > 0.0)) {
                continue;
            }
            widest = fmax(widest, radius / bounds.reach);
            n_balls++;
            assert_true(sqrt(ball.chord2) <= 2.0 * sin(0.5 * radius));
            assert_memory_equal(&ball.w, &foot.w, sizeof foot.w);
            const double least = least_within(&view, p, &foot, radius, 300, &random);
            /* the sample rounds like an evaluation and its distance */
            assert_true(ball.lower <= least + 2.0 * m->evaluation_error_m + 1e-15 * least);
            /* at a minimum the bound is the distance, but for the gradient that rounding leaves
             * (above: g^2 <= 2 k noise), and f loses 5 g^2 over the lowest eigenvalue */
            const double k = m->m[0] * m->m[0] + foot.distance * m->m[1];
            if (beside == 0.0 && foot.low > 1e-3 * k) {
                n_tight++;
                assert_true(ball.lower >= foot.distance - 1e-9 * (1.0 + foot.distance));
            }
        }
        shcd_model_free(m);
    }
    assert_true(n_balls > 60 && n_tight > 20 && widest > 0.3);
}

/* ---- winding number ---- */
/* Around the triangles of the tree, which a finished model has no more: the stored ones do not meet
 * exactly. */
static double winding_by_angles(const shcdi_tree *tree, shcd_vec3 p) {
    double sum = 0.0;
    for (size_t i = 0; i < tree->n_leaves; i++) {
        shcd_vec3 x[3];
        double l[3];
        for (int k = 0; k < 3; k++) {
            x[k] = shcd_sub(tree->position[tree->leaf[i].vertex[k]], p);
            l[k] = shcd_norm(x[k]);
        }
        sum += 2.0 * atan2(shcd_dot(x[0], shcd_cross(x[1], x[2])),
                           l[0] * l[1] * l[2] + shcd_dot(x[0], x[1]) * l[2] +
                               shcd_dot(x[1], x[2]) * l[0] + shcd_dot(x[2], x[0]) * l[1]);
    }
    return sum / (4.0 * BODIES_PI);
}

static double nearest_triangle(const shcdi_tree *tree, shcd_vec3 p) {
    double least = HUGE_VAL, b[3];
    for (size_t i = 0; i < tree->n_leaves; i++) {
        shcd_vec3 x[3];
        for (int k = 0; k < 3; k++) {
            x[k] = tree->position[tree->leaf[i].vertex[k]];
        }
        least = fmin(least, shcdi_triangle_distance(p, x, b));
    }
    return least;
}

static void test_winding_agrees_with_the_sum_of_solid_angles(void **state) {
    (void)state;
    int seen[8] = {0}, n_open = 0;
    uint32_t looked = 0;
    for (uint64_t seed = 1; seed <= 6; seed++) {
        check_random random = {126 + seed};
        shcd_model *m = bodies_create_random(&random, 8, seed <= 2 ? 0.1 : 1.2);
        shcd_model *plain = maps_with_tree(m);
        const shcdi_tree *tree = &plain->tree;
        const shcdi_view view = view_of(m);
        /* what storing a node may move it by */
        const double moved = shcdi_tessellation_error(&view) - m->info.max_deviation_m;
        for (size_t n = 0; n < check_scaled(300); n++) {
            shcd_vec3 p =
                shcd_mul_add(m->info.centre_m, check_uniform(&random, 0.0, 1.5) * m->info.radius_m,
                             bodies_random_direction(&random));
            if (n % 10 == 0) { /* far away, and close beside a vertex */
                p = shcd_scale(1e6, p);
            } else if (n % 10 == 1) {
                /* triangles part by 2 `moved` at most: three such gaps at a vertex, 3 `moved` away,
                 * are seen at half of 3 times 4 atan(1/3) < 2 pi, which rounds to the right number
                 */
                p = shcd_mul_add(tree->position[n % tree->n_vertices], 4.0 * moved,
                                 bodies_random_direction(&random));
                if (nearest_triangle(tree, p) < 3.0 * moved) {
                    continue;
                }
            }
            const double angles = winding_by_angles(tree, p);
            const double whole = floor(angles + 0.5);
            assert_near(angles, whole, 1e-4); /* beside a vertex solid angles keep 1e-6 */
            int winding = (int)whole;
            n_open += !shcdi_winding(&view, p, &winding, &looked);
            assert_int_equal(winding, (int)whole);
            seen[(int)whole + 3]++;
        }
        shcd_model_free(plain);
        shcd_model_free(m);
    }
    print_message("winding numbers -1, 0, 1, 2 seen %d, %d, %d, %d times\n", seen[2], seen[3],
                  seen[4], seen[5]);
    assert_true(seen[3] > 0 && seen[4] > 0 && 100 * n_open <= seen[3]);
    assert_true(looked < 40u * (uint32_t)(seen[3] + seen[4]));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_triangle_distance_is_optimal_for_well_shaped_triangles),
        cmocka_unit_test(test_triangle_distance_never_exceeds_the_distance_of_slivers),
        cmocka_unit_test(test_patches_split_into_a_tiling_and_lie_in_their_caps),
        cmocka_unit_test(test_angle_upper_is_one),
        cmocka_unit_test(test_foot_has_the_derivatives_of_the_squared_distance),
        cmocka_unit_test(test_foot_lower_bounds_the_squared_distance_over_a_cap),
        cmocka_unit_test(test_newton_descends_and_ends_where_the_gradient_does),
        cmocka_unit_test(test_finished_foot_errs_by_no_more_than_it_says),
        cmocka_unit_test(test_nothing_within_a_ball_is_nearer_than_its_bound),
        cmocka_unit_test(test_winding_agrees_with_the_sum_of_solid_angles)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
