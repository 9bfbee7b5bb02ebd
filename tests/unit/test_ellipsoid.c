/* SPDX-License-Identifier: BSD-3-Clause */
/* Closed-form distance to an ellipsoid against an independent solution: bisection of the secular
 * equation in extended precision (64-bit mantissa), with the residual of its own answer checked. */
#include "query/ellipsoid.h"
#include "support/bodies.h"
#include "support/check.h"

#define ASPECT 4.0 /* decades between half axes */
#define TOLERANCE 1e-12

/* |h q(s) - y|^2 and |q(s)| for the multiplier s; q_2 fills up at s = 0. */
typedef struct reference {
    long double h[3], d[3], n[3];
} reference;

static long double length_at(const reference *r, long double s, long double q[3]) {
    long double n2 = 0.0L;
    for (int i = 0; i < 3; i++) {
        q[i] = r->n[i] > 0.0L ? r->n[i] / (s + r->d[i]) : 0.0L;
        n2 += q[i] * q[i];
    }
    return sqrtl(n2);
}

static long double reference_distance(const double half[3], const double point[3]) {
    reference r;
    long double q[3], sum = 0.0L, high = 0.0L, inside = 0.0L;
    int held = 0;
    for (int i = 0; i < 3; i++) {
        const long double y = fabsl((long double)point[i]);
        r.h[i] = (long double)half[i];
        r.d[i] = (r.h[i] - (long double)half[2]) * (r.h[i] + (long double)half[2]);
        r.n[i] = r.h[i] * y;
        high += r.n[i];
        inside += y / r.h[i] * (y / r.h[i]);
        q[i] = 0.0L;
        if (r.n[i] > 0.0L && r.d[i] > 0.0L) {
            q[i] = r.n[i] / r.d[i];
            sum += q[i] * q[i];
        }
        held = held || (r.n[i] > 0.0L && r.d[i] == 0.0L);
    }
    if (!held && sum <= 1.0L) {
        q[2] = sqrtl(1.0L - sum);
    } else {
        long double low = high; /* a geometric search for a bracket, then halving */
        while (low > 1e-4000L && length_at(&r, low, q) < 1.0L) {
            high = low;
            low *= 0.0625L;
        }
        for (int i = 0; i < 80; i++) {
            const long double middle = 0.5L * (low + high);
            if (length_at(&r, middle, q) > 1.0L) {
                low = middle;
            } else {
                high = middle;
            }
        }
        const long double length = length_at(&r, high, q);
        for (int i = 0; i < 3; i++) {
            q[i] /= length;
        }
    }
    long double r2 = 0.0L;
    for (int i = 0; i < 3; i++) {
        const long double off = r.h[i] * q[i] - fabsl((long double)point[i]);
        r2 += off * off;
    }
    return inside < 1.0L ? -sqrtl(r2) : sqrtl(r2);
}

static void sort_down(double h[3]) {
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < 2; i++) {
            if (h[i] < h[i + 1]) {
                const double t = h[i];
                h[i] = h[i + 1];
                h[i + 1] = t;
            }
        }
    }
}

/* Needles, discs, spheres, spheroids; points far, near, inside, on symmetry planes and axes, at
 * focal points. */
static void random_case(size_t i, check_random *r, double h[3], double y[3]) {
    for (int k = 0; k < 3; k++) {
        h[k] = pow(10.0, check_uniform(r, -ASPECT, 0.0));
    }
    if (i % 7 == 1) {
        h[0] = 1.0;
        h[1] = h[2] = 1e-4;
    } else if (i % 7 == 2) {
        h[0] = h[1] = 1.0;
        h[2] = 1e-4;
    } else if (i % 7 == 3) {
        h[1] = h[2];
    } else if (i % 7 == 4) {
        h[0] = h[1] = h[2];
    }
    sort_down(h);
    const double scale = pow(10.0, check_uniform(r, -6.0, 2.0));
    for (int k = 0; k < 3; k++) {
        y[k] = scale * check_normal(r) * (i % 3 == 0 ? 1.0 : h[k]);
    }
    for (int k = 0; k < 3; k++) {
        y[k] = (i / 7) % 11 == (size_t)k || (i / 7) % 13 == (size_t)k ? 0.0 : y[k];
    }
    if (i % 17 == 0) { /* the focus of curvature, where the foot splits, and just beside it */
        y[0] = (h[0] * h[0] - h[2] * h[2]) / h[0];
        y[1] = 0.0;
        y[2] = i % 2 == 0 ? 0.0 : 1e-14;
    }
    if (i % 1009 == 0) {
        y[0] = y[1] = y[2] = 0.0;
    }
}

static void test_foot_against_extended_precision(void **state) {
    check_random random = {20240501};
    const size_t n = check_scaled(1000000);
    double worst = 0.0, widest = 0.0;
    long steps = 0, most = 0, inside = 0;
    (void)state;
    for (size_t i = 0; i < n; i++) {
        double h[3], y[3];
        shcdi_ellipsoid e = {.centre_m = {0.0, 0.0, 0.0}, .error_m = 0.0};
        shcdi_ellipsoid_foot foot;
        random_case(i, &random, h, y);
        for (int k = 0; k < 3; k++) {
            e.half_m[k] = h[k];
            e.axis[k] = e.turn[k] = shcd_vec3_make(k == 0, k == 1, k == 2);
        }
        shcdi_ellipsoid_foot_at(&e, shcd_vec3_make(y[0], y[1], y[2]), &foot);
        const double expected = (double)reference_distance(h, y);
        const double size =
            fmax(2.0 * sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]), fabs(expected));
        /* on the surface itself the sign is not a number's to tell */
        const double got = fabs(expected) < 1e-14 * size ? fabs(foot.distance_m) : foot.distance_m;
        assert_near(got, fabs(expected) < 1e-14 * size ? fabs(expected) : expected,
                    TOLERANCE * size);
        if (!(foot.lower_m <= fabs(expected) && fabs(expected) <= foot.upper_m)) {
            fail_msg("[%.17g, %.17g] misses %.17g: half axes %.17g %.17g %.17g, point %.17g %.17g "
                     "%.17g",
                     foot.lower_m, foot.upper_m, fabs(expected), h[0], h[1], h[2], y[0], y[1],
                     y[2]);
        }
        worst = fmax(worst, fabs(got - expected) / size);
        widest = fmax(widest, (foot.upper_m - foot.lower_m) / size);
        steps += foot.n_steps;
        most = foot.n_steps > most ? foot.n_steps : most;
        inside += expected < 0.0;
        assert_in_range(foot.n_steps, 0, 127);
    }
    assert_at_most(widest, TOLERANCE);
    assert_true(inside > (long)n / 10 && inside < (long)n * 9 / 10);
    print_message("%zu pairs (seed 20240501), %ld inside: error <= %.2g, interval <= %.2g of the "
                  "size, steps %.2f, at most %ld\n",
                  n, inside, worst, widest, (double)steps / (double)n, most);
}

/* The half axes of turned, sheared-in bodies, found again; the answer is a point of the body. */
static void test_closest_on_turned_bodies_agrees_with_the_search(void **state) {
    check_random random = {77};
    double worst = 0.0;
    (void)state;
    for (size_t i = 0; i < check_scaled(60); i++) {
        const double thin = i % 3 == 0 ? 1e-4 : check_uniform(&random, 0.05, 1.0);
        shcd_model *model = bodies_create_ellipsoid_turned(
            1.0, i % 2 == 0 ? thin : check_uniform(&random, 0.3, 1.0), thin, &random);
        const shcd_model_info info = bodies_info(model);
        shcdi_view view;
        shcdi_view_of(model, NULL, &view);
        for (int k = 0; k < 20; k++) {
            const double length = check_uniform(&random, 0.0, 1.5);
            const shcd_vec3 p = shcd_scale(length, bodies_random_direction(&random));
            shcd_proximity got = {.flags = 0}, found;
            shcd_vec3 x;
            assert_true(shcdi_ellipsoid_closest(&view, p, &got));
            assert_int_equal(shcd_closest(model, p, NULL, &found), SHCD_OK);
            assert_true(got.lower_m <= got.upper_m);
            /* both intervals hold the truth */
            assert_true(fabs(got.distance_m) <=
                        fmax(fabs(found.lower_m), fabs(found.upper_m)) + 1e-12 * info.diagonal_m);
            assert_int_equal(shcd_model_surface(model, -1, got.parameter, &x, NULL, NULL), SHCD_OK);
            assert_near(shcd_norm(shcd_sub(x, got.point_m)), 0.0, 1e-13 * info.diagonal_m);
            assert_near(shcd_norm(shcd_sub(p, got.point_m)), fabs(got.distance_m),
                        1e-13 * info.diagonal_m);
            assert_near(shcd_norm(got.normal), 1.0, 1e-14);
            if (!(found.flags & (SHCD_PROXIMITY_SIGN_UNSURE | SHCD_PROXIMITY_TRUNCATED))) {
                assert_near(got.distance_m, found.distance_m, 1e-9 * info.diagonal_m);
                worst = fmax(worst, fabs(got.distance_m - found.distance_m));
            }
        }
        shcd_model_free(model);
    }
    print_message("search and closed form differ by at most %.2g\n", worst);
}

static void test_closest_refuses_other_bodies(void **state) {
    check_random random = {5};
    shcd_proximity out = {.flags = 0};
    shcdi_view view;
    (void)state;
    shcd_model *model = bodies_create_random(&random, 2, 0.05);
    shcdi_view_of(model, NULL, &view);
    assert_false(shcdi_ellipsoid_closest(&view, shcd_vec3_make(1.0, 2.0, 3.0), &out));
    shcd_model_free(model);
    model = bodies_create_ellipsoid(1.0, 0.5, 0.2);
    shcdi_view_of(model, NULL, &view);
    assert_false(shcdi_ellipsoid_closest(&view, shcd_vec3_make(1e149, 0.0, 0.0), &out));
    assert_true(shcdi_ellipsoid_closest(&view, shcd_vec3_make(1e9, 0.0, 0.0), &out));
    assert_near(out.distance_m, 1e9 - 1.0, 1e-3);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_foot_against_extended_precision),
        cmocka_unit_test(test_closest_on_turned_bodies_agrees_with_the_search),
        cmocka_unit_test(test_closest_refuses_other_bodies),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
