/* SPDX-License-Identifier: BSD-3-Clause */
/* Closed-form distance to an ellipsoid against an independent solution: bisection of the secular
 * equation in extended precision (64-bit mantissa), with the residual of its own answer checked.
 * And as what queries of bodies of degree 1 do: against the search that they would do otherwise,
 * with counts; and that they do search where the surface is not an ellipsoid to calculate with. */
#include "query/ellipsoid.h"
#include "query/internal.h"
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
        shcdi_ellipsoid e = {.centre_m = {0.0, 0.0, 0.0}, .error_m = 0.0, .skew = 0.0};
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
        assert_true(foot.sign == 0 || expected == 0.0 || foot.sign == (expected < 0.0 ? -1 : 1));
        assert_true(foot.sign != 0 || foot.lower_m == 0.0);
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

/* ---- queries of bodies of degree 1 ---- */

/* The search that other bodies get. */
static void search(const shcd_model *model, const shcd_shape *shape, shcd_vec3 p,
                   shcd_proximity *out) {
    shcdi_view view;
    shcdi_search s;
    const shcd_query_options options = {.tier = SHCD_TIER_EXACT, .evaluations_max = 3000};
    memset(out, 0, sizeof *out);
    shcdi_view_of(model, shape, &view);
    shcdi_query_certified(&s, &view, p, &options, out);
}

/* What a result says is true of itself: the point is the surface's, as far away as it says, along
 * its normal; and nothing was searched. */
static void check_answer(const shcd_model *model, const shcd_shape *shape, shcd_vec3 p,
                         const shcd_proximity *got) {
    const double size = bodies_info(model).diagonal_m;
    const double slack = 1e-13 * fmax(size, fabs(got->distance_m));
    shcd_vec3 x, normal;
    assert_int_equal(got->n_patches, 0);
    assert_int_equal(got->n_evaluations, 1);
    assert_in_range(got->n_newton, 0, 40);
    assert_int_equal(got->flags & ~(uint32_t)SHCD_PROXIMITY_SIGN_UNSURE, 0);
    assert_true(got->lower_m <= got->distance_m && got->distance_m <= got->upper_m);
    if (got->flags == 0) {
        assert_at_most(got->upper_m - got->lower_m, slack);
    } else { /* within rounding of the surface */
        assert_at_most(got->upper_m - got->lower_m, 2.0 * slack);
    }
    const shcd_status status =
        shape != NULL ? shcd_shape_surface(model, shape, got->parameter, &x, &normal, NULL)
                      : shcd_model_surface(model, -1, got->parameter, &x, &normal, NULL);
    assert_int_equal(status, SHCD_OK);
    assert_true(shcd_dot(normal, got->normal) > 0.0);
    assert_near(shcd_norm(shcd_sub(x, got->point_m)), 0.0, slack);
    assert_near(shcd_norm(shcd_sub(p, got->point_m)), fabs(got->distance_m), slack);
    assert_near(shcd_norm(got->normal), 1.0, 1e-14);
    assert_near(shcd_norm(got->parameter), 1.0, 1e-14);
    /* outside and inside alike, p - x is along the normal: rounding of p - x counts */
    const shcd_vec3 off =
        shcd_sub(shcd_sub(p, got->point_m), shcd_scale(got->distance_m, got->normal));
    assert_at_most(shcd_norm(off), 1e-7 * size);
}

/* Both intervals hold the truth, so they meet; both are sure of the same side. @return difference
 */
static double compare(const shcd_proximity *got, const shcd_proximity *found) {
    assert_true(got->lower_m <= found->upper_m && found->lower_m <= got->upper_m);
    if (((got->flags | found->flags) & (SHCD_PROXIMITY_SIGN_UNSURE | SHCD_PROXIMITY_TRUNCATED)) !=
        0) {
        return 0.0;
    }
    assert_true((got->distance_m < 0.0) == (found->distance_m < 0.0));
    return fabs(got->distance_m - found->distance_m);
}

/* Points anywhere, at the centre, on an axis of the parameter sphere's image, on the surface. */
static shcd_vec3 some_point(const shcd_model *model, int k, check_random *r) {
    const shcd_vec3 centre = bodies_info(model).centre_m;
    shcd_vec3 x = shcd_scale(check_uniform(r, 0.0, 1.5), bodies_random_direction(r));
    if (k == 0) {
        return centre;
    }
    if (k < 4) {
        const shcd_vec3 w = shcd_vec3_make(k == 1, k == 2, k == 3);
        assert_int_equal(shcd_model_surface(model, -1, w, &x, NULL, NULL), SHCD_OK);
        return shcd_mul_add(centre, check_uniform(r, 0.0, 1.6), shcd_sub(x, centre));
    }
    if (k == 4) {
        assert_int_equal(shcd_model_surface(model, -1, bodies_random_direction(r), &x, NULL, NULL),
                         SHCD_OK);
        return x;
    }
    return shcd_add(centre, x);
}

/* Needles, discs (aspect 1e4), spheres, and what is between, turned, with a turned parameter sphere
 * and a centre away from 0. */
static shcd_model *some_body(size_t i, check_random *r) {
    double axes[3] = {1.0, check_uniform(r, 0.3, 1.0), check_uniform(r, 0.05, 1.0)};
    if (i % 4 == 0) {
        axes[1] = axes[2] = 1e-4;
    } else if (i % 4 == 1) {
        axes[1] = 1.0;
        axes[2] = 1e-4;
    } else if (i % 4 == 2) {
        axes[1] = axes[2] = 1.0;
    }
    shcd_model *straight = bodies_create_ellipsoid_turned(axes[0], axes[1], axes[2], r);
    const shcd_vec3 x = bodies_random_direction(r);
    const shcd_vec3 y = shcd_unit(shcd_cross(x, bodies_random_direction(r)));
    const shcd_vec3 z = shcd_cross(x, y);
    double c[12];
    for (size_t k = 0; k < 4; k++) {
        const double *a = shcd_model_coefficients(straight) + 3 * k;
        const shcd_vec3 turned = shcd_mul_add(shcd_mul_add(shcd_scale(a[0], x), a[1], y), a[2], z);
        c[3 * k] = turned.x + (k == 0 ? check_normal(r) : 0.0);
        c[3 * k + 1] = turned.y;
        c[3 * k + 2] = turned.z;
    }
    shcd_model_free(straight);
    return bodies_create(1, c);
}

static void test_closest_agrees_with_the_search(void **state) {
    check_random random = {77};
    double worst = 0.0;
    size_t sure = 0, cases = 0;
    (void)state;
    for (size_t i = 0; i < check_scaled(60); i++) {
        shcd_model *model = some_body(i, &random);
        for (int k = 0; k < 20; k++) {
            const shcd_vec3 p = some_point(model, k, &random);
            shcd_query_options fast = SHCD_QUERY_OPTIONS_INIT;
            shcd_proximity got, quick, found;
            assert_int_equal(shcd_closest(model, p, NULL, &got), SHCD_OK);
            check_answer(model, NULL, p, &got);
            fast.tier = SHCD_TIER_FAST;
            assert_int_equal(shcd_closest(model, p, &fast, &quick), SHCD_OK);
            assert_memory_equal(&quick, &got, sizeof got);
            search(model, NULL, p, &found);
            assert_true(found.n_patches > 0);
            worst = fmax(worst, compare(&got, &found));
            sure += (found.flags & (SHCD_PROXIMITY_SIGN_UNSURE | SHCD_PROXIMITY_TRUNCATED)) == 0;
            cases++;
        }
        shcd_model_free(model);
    }
    assert_at_most(worst, 1e-9 * 4.0); /* the search's tolerance, of the longest diagonal */
    assert_true(2 * sure > cases);
    print_message("search and closed form differ by at most %.2g in %zu of %zu cases (seed 77)\n",
                  worst, sure, cases);
}

static shcd_shape *make_shape(const shcd_model *model, void **memory) {
    const size_t size = (shcd_shape_size(model) + 15) / 16 * 16;
    shcd_shape *shape = NULL;
    *memory = aligned_alloc(16, size);
    assert_non_null(*memory);
    assert_int_equal(shcd_shape_init(model, *memory, size, &shape), SHCD_OK);
    return shape;
}

static void test_deformed_bodies_are_ellipsoids_again(void **state) {
    check_random random = {78};
    double worst = 0.0;
    (void)state;
    for (size_t i = 0; i < check_scaled(40); i++) {
        shcd_model *model = some_body(3, &random);
        void *memory;
        shcd_shape *shape = make_shape(model, &memory);
        shcd_certificate certificate;
        memset(&certificate, 0, sizeof certificate);
        for (int step = 0; step < 12; step++) {
            double c[12];
            for (size_t k = 0; k < 12; k++) {
                c[k] = shcd_model_coefficients(model)[k] + 0.02 * step * check_normal(&random);
            }
            if (step > 0) { /* a shape that was not set is the rest shape */
                assert_int_equal(shcd_shape_set(model, shape, c, SHCD_FOLLOW_AUTO), SHCD_OK);
            }
            const shcd_vec3 p = some_point(model, step, &random);
            shcd_proximity got, found, next;
            assert_int_equal(shcd_shape_closest(model, shape, p, NULL, &got), SHCD_OK);
            if (shcdi_ellipsoid_of(model, shape) != NULL) {
                check_answer(model, shape, p, &got);
            }
            search(model, shape, p, &found);
            worst = fmax(worst, compare(&got, &found));
            assert_int_equal(shcd_closest_next(model, shape, p, NULL, &certificate, &next),
                             SHCD_OK);
            worst = fmax(worst, compare(&got, &next));
            if (shcdi_ellipsoid_of(model, shape) != NULL) {
                assert_memory_equal(&next, &got, sizeof got);
            }
        }
        free(memory);
        shcd_model_free(model);
    }
    assert_at_most(worst, 1e-9 * 4.0);
    print_message("deformed: search and closed form differ by at most %.2g (seed 78)\n", worst);
}

/* Flat, inside out, a segment, a point: the closed form knows that it is none of its business, and
 * the query answers by searching. */
static void test_degenerate_shapes_are_searched(void **state) {
    static const double axes[6][3] = {{1.0, 1.0, 0.0}, {1.0, 1.0, -0.5},   {1.0, 0.0, 0.0},
                                      {0.0, 0.0, 0.0}, {-1.0, -1.0, -1.0}, {1.0, 1.0, 1e-17}};
    const shcd_vec3 p = {0.3, 0.2, 2.0};
    shcd_model *model = bodies_create_ellipsoid(1.0, 1.0, 1.0);
    void *memory;
    shcd_shape *shape = make_shape(model, &memory);
    (void)state;
    for (int i = 0; i < 6; i++) {
        double c[12];
        shcd_proximity got;
        bodies_ellipsoid_coefficients(axes[i][0], axes[i][1], axes[i][2], c);
        assert_int_equal(shcd_shape_set(model, shape, c, SHCD_FOLLOW_REFRESH), SHCD_OK);
        assert_null(shcdi_ellipsoid_of(model, shape));
        shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
        options.evaluations_max = 2000;
        assert_int_equal(shcd_shape_closest(model, shape, p, &options, &got), SHCD_OK);
        assert_true(got.n_patches > 0);
        /* the ellipsoid's solid lies in |x| <= its half axes */
        const shcd_vec3 beyond =
            shcd_vec3_make(fmax(0.0, p.x - fabs(axes[i][0])), fmax(0.0, p.y - fabs(axes[i][1])),
                           fmax(0.0, p.z - fabs(axes[i][2])));
        assert_true(fmax(fabs(got.lower_m), fabs(got.upper_m)) >= shcd_norm(beyond) * (1.0 - 1e-9));
    }
    double c[12];
    bodies_ellipsoid_coefficients(1.0, 1.0, 1.0, c); /* and back */
    assert_int_equal(shcd_shape_set(model, shape, c, SHCD_FOLLOW_REFRESH), SHCD_OK);
    shcd_proximity got;
    assert_int_equal(shcd_shape_closest(model, shape, p, NULL, &got), SHCD_OK);
    check_answer(model, shape, p, &got);
    assert_near(got.distance_m, shcd_norm(p) - 1.0, 1e-14);
    free(memory);
    shcd_model_free(model);
}

/* How far from each other two points may be that are closest to the same p: on a sphere queried at
 * its centre any; so a search would not end, and the closed form does. */
static void test_centre_of_a_sphere(void **state) {
    shcd_model *model = bodies_create_ellipsoid(0.7, 0.7, 0.7);
    shcd_proximity got;
    (void)state;
    assert_int_equal(shcd_closest(model, shcd_vec3_make(0.0, 0.0, 0.0), NULL, &got), SHCD_OK);
    assert_near(got.distance_m, -0.7, 1e-15);
    assert_int_equal(got.flags, 0);
    check_answer(model, NULL, shcd_vec3_make(0.0, 0.0, 0.0), &got);
    shcd_model_free(model);
}

static void test_tighter_than_rounding_is_flagged(void **state) {
    shcd_model *model = bodies_create_ellipsoid(1.0, 0.5, 0.2);
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity got;
    (void)state;
    options.tolerance = 1e-17;
    assert_int_equal(shcd_closest(model, shcd_vec3_make(1.0, 1.0, 1.0), &options, &got), SHCD_OK);
    assert_int_equal(got.flags, SHCD_PROXIMITY_TRUNCATED);
    assert_at_most(got.upper_m - got.lower_m, 1e-13);
    options.tolerance = 1e-13;
    assert_int_equal(shcd_closest(model, shcd_vec3_make(1.0, 1.0, 1.0), &options, &got), SHCD_OK);
    assert_int_equal(got.flags, 0);
    shcd_model_free(model);
}

static void test_closest_refuses_other_bodies(void **state) {
    check_random random = {5};
    shcd_proximity out = {.flags = 0};
    (void)state;
    shcd_model *model = bodies_create_random(&random, 2, 0.05);
    assert_null(shcdi_ellipsoid_of(model, NULL));
    assert_false(shcdi_ellipsoid_closest(model, NULL, shcd_vec3_make(1.0, 2.0, 3.0), 0.0, &out));
    shcd_model_free(model);
    model = bodies_create_ellipsoid(1.0, 0.5, 0.2);
    assert_false(shcdi_ellipsoid_closest(model, NULL, shcd_vec3_make(1e149, 0.0, 0.0), 0.0, &out));
    assert_true(shcdi_ellipsoid_closest(model, NULL, shcd_vec3_make(1e9, 0.0, 0.0), 0.0, &out));
    assert_near(out.distance_m, 1e9 - 1.0, 1e-3);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_foot_against_extended_precision),
        cmocka_unit_test(test_closest_agrees_with_the_search),
        cmocka_unit_test(test_deformed_bodies_are_ellipsoids_again),
        cmocka_unit_test(test_degenerate_shapes_are_searched),
        cmocka_unit_test(test_centre_of_a_sphere),
        cmocka_unit_test(test_tighter_than_rounding_is_flagged),
        cmocka_unit_test(test_closest_refuses_other_bodies),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
