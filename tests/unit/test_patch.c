/* SPDX-License-Identifier: BSD-3-Clause */
/* The pieces of the certified search, each against an independent formula: distance to a triangle,
 * patches, the squared distance and its derivatives, Taylor bounds, Newton steps, winding numbers.
 */
#include "query/foot.h"
#include "query/patch.h"
#include "query/winding.h"
#include "support/bodies.h"
#include "support/check.h"

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

static void test_patches_split_into_a_tiling_with_true_positions(void **state) {
    check_random random = {123};
    shcd_model *m = bodies_create_random(&random, 7, 0.1);
    (void)state;
    for (size_t i = 0; i < m->tree.n_leaves; i += 7) {
        shcdi_patch parent, child[4];
        double area = 0.0, angle;
        shcdi_patch_of_leaf(&m->tree, i, &parent);
        const shcd_vec3 centre = shcdi_patch_centre(&parent, &angle);
        for (int k = 0; k < 3; k++) {
            const double cosine = shcd_dot(centre, parent.w[k]);
            assert_true(atan2(shcd_norm(shcd_cross(centre, parent.w[k])), cosine) <= angle);
        }
        shcdi_patch_split(m, &parent, child);
        for (int k = 0; k < 4; k++) {
            const shcd_vec3 *w = child[k].w;
            area += 2.0 *
                    atan2(shcd_dot(w[0], shcd_cross(w[1], w[2])),
                          1.0 + shcd_dot(w[0], w[1]) + shcd_dot(w[1], w[2]) + shcd_dot(w[2], w[0]));
            for (int c = 0; c < 3; c++) {
                const shcd_vec3 s = shcdi_surface_point(&m->series, m->degree, w[c]);
                assert_true(shcd_norm(shcd_sub(s, child[k].x[c])) <= 2.0 * m->evaluation_error_m);
            }
        }
        const shcd_vec3 *w = parent.w;
        assert_near(
            area,
            2.0 * atan2(shcd_dot(w[0], shcd_cross(w[1], w[2])),
                        1.0 + shcd_dot(w[0], w[1]) + shcd_dot(w[1], w[2]) + shcd_dot(w[2], w[0])),
            1e-15);
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
    const double h = 1e-3;
    (void)state;
    for (int n = 0; n < 200; n++) {
        const shcd_vec3 p = random_vector(&random, 1.5);
        const shcd_vec3 w =
            n < 2 ? shcd_vec3_make(0.0, 0.0, 2.0 * n - 1.0) : bodies_random_direction(&random);
        const shcd_vec3 v = shcd_unit(shcd_cross(w, bodies_random_direction(&random)));
        shcdi_foot foot;
        shcdi_foot_at(m, p, w, &foot);
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
    double tightest = HUGE_VAL;
    (void)state;
    for (size_t n = 0; n < check_scaled(400); n++) {
        const shcd_vec3 p = random_vector(&random, n % 2 ? 1.5 : 0.3);
        const double radius = pow(10.0, check_uniform(&random, -5.0, -0.3));
        shcdi_foot foot;
        shcdi_foot_at(m, p, bodies_random_direction(&random), &foot);
        const double third = 3.0 * m->m[0] * m->m[1] + (foot.distance + m->m[0] * radius) * m->m[2];
        const double lower = shcdi_foot_lower(&foot, radius, third);
        double least = foot.f;
        for (int i = 0; i < 100; i++) {
            const double turn = check_uniform(&random, 0.0, 2.0 * BODIES_PI);
            const double t = i % 2 ? radius : check_uniform(&random, 0.0, radius);
            const shcd_vec3 v =
                shcd_mul_add(shcd_scale(cos(turn), foot.jet.t1), sin(turn), foot.jet.t2);
            least = fmin(least, f_at(m, p, moved(foot.w, v, t)));
        }
        assert_true(lower <= least + 1e-14 * foot.f);
        tightest = fmin(tightest, (least - lower) / foot.f);
    }
    print_message("closest sample above its bound: %.2g of f\n", tightest);
    shcd_model_free(m);
}

static void test_newton_descends_and_ends_where_the_gradient_does(void **state) {
    check_random random = {126};
    shcd_model *m = bodies_create_random(&random, 10, 0.2);
    size_t done = 0;
    const size_t n = check_scaled(600);
    (void)state;
    for (size_t i = 0; i < n; i++) {
        const shcd_vec3 p = random_vector(&random, 1.5);
        shcdi_foot foot;
        uint32_t steps = 0, evaluations = 0;
        shcdi_foot_at(m, p, bodies_random_direction(&random), &foot);
        const double f = foot.f;
        const int stationary = shcdi_newton(m, p, 24, &foot, &steps, &evaluations);
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
        shcdi_newton(m, p, 0, &foot, &none, &evaluations);
        assert_true(none == 0 && evaluations == before);
    }
    print_message("stationary within 24 steps from anywhere: %zu of %zu\n", done, n);
    assert_true(done > n * 9 / 10);
    shcd_model_free(m);
}

/* ---- winding number ---- */

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

static void test_winding_agrees_with_the_sum_of_solid_angles(void **state) {
    int seen[8] = {0};
    (void)state;
    for (uint64_t seed = 1; seed <= 6; seed++) {
        check_random random = {126 + seed};
        shcd_model *m = bodies_create_random(&random, 8, seed <= 2 ? 0.1 : 1.2);
        for (size_t n = 0; n < check_scaled(300); n++) {
            shcd_vec3 p =
                shcd_mul_add(m->info.centre_m, check_uniform(&random, 0.0, 1.5) * m->info.radius_m,
                             bodies_random_direction(&random));
            if (n % 10 == 0) { /* far away, and a rounding beside a vertex */
                p = shcd_scale(1e6, p);
            } else if (n % 10 == 1) {
                p = shcd_mul_add(m->tree.position[n % m->tree.n_vertices], 1e-9,
                                 bodies_random_direction(&random));
            }
            const double angles = winding_by_angles(&m->tree, p);
            const double whole = floor(angles + 0.5);
            /* solid angles each round to 1e-15 of 4 pi, and 1e-9 beside a vertex they keep 1e-6 */
            assert_near(angles, whole, 1e-4);
            assert_int_equal(shcdi_winding(&m->tree, p), (int)whole);
            seen[(int)whole + 3]++;
        }
        shcd_model_free(m);
    }
    print_message("winding numbers -1, 0, 1, 2 seen %d, %d, %d, %d times\n", seen[2], seen[3],
                  seen[4], seen[5]);
    assert_true(seen[3] > 0 && seen[4] > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_triangle_distance_is_optimal_for_well_shaped_triangles),
        cmocka_unit_test(test_triangle_distance_never_exceeds_the_distance_of_slivers),
        cmocka_unit_test(test_patches_split_into_a_tiling_with_true_positions),
        cmocka_unit_test(test_angle_upper_is_one),
        cmocka_unit_test(test_foot_has_the_derivatives_of_the_squared_distance),
        cmocka_unit_test(test_foot_lower_bounds_the_squared_distance_over_a_cap),
        cmocka_unit_test(test_newton_descends_and_ends_where_the_gradient_does),
        cmocka_unit_test(test_winding_agrees_with_the_sum_of_solid_angles)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
