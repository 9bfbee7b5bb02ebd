/* SPDX-License-Identifier: BSD-3-Clause */
/* The fused evaluation of a surface and of its derivatives, against sums over the basis, a long
 * double series and finite differences; and the stated bound of its rounding.
 *
 * Tolerances. shcdi_evaluation_error() bounds the rounding of S by 2.2e-16 sum_l (l(l+1) + 20) b_l,
 * b_l = |c_l| s_l the size of degree l's part: near a pole a rounding of z moves Y by the slope of
 * the polynomial in z. In the first and second derivatives the same rounding meets polynomials
 * steeper by l and l^2. The basis adds the 1e-13 that test_harmonics.c has established. */
#include "model/model.h"
#include "support/bodies.h"
#include "support/check.h"

#define TOP SHCD_DEGREE_MAX

typedef struct surface {
    shcdi_series series;
    double *coefficients, *memory;
} surface;

static void surface_open(surface *s, int degree, const double *coefficients) {
    const size_t n = 3 * SHCD_COUNT(degree), r = shcdi_recurrence_size(degree);
    s->memory = calloc(n + r + shcdi_packed_size(degree), sizeof(double));
    assert_non_null(s->memory);
    s->coefficients = s->memory;
    memcpy(s->coefficients, coefficients, n * sizeof(double));
    shcdi_recurrence_fill(degree, s->memory + n);
    shcdi_pack(degree, coefficients, s->memory + n + r);
    s->series =
        (shcdi_series){degree, s->memory + n, s->memory + n + r, shcdi_simd_choose(SHCD_SIMD_AUTO)};
}

static void surface_open_random(surface *s, int degree, uint64_t seed) {
    static double c[3 * SHCD_COUNT(TOP)];
    check_random random = {seed};
    for (size_t i = 0; i < 3 * SHCD_COUNT(degree); i++) {
        c[i] = check_normal(&random);
    }
    surface_open(s, degree, c);
}

/* 2.2e-16 sum_l l^power (l(l+1) + 20) b_l, and 1e-13 sum_l l^power b_l for the basis */
static double tolerance_of(const surface *s, int degree, int power) {
    double sum = 0.0;
    for (int l = 0; l <= degree; l++) {
        double c2 = 0.0;
        for (size_t i = 3 * SHCD_INDEX(l, -l); i < 3 * SHCD_INDEX(l, l) + 3; i++) {
            c2 += s->coefficients[i] * s->coefficients[i];
        }
        const double b = sqrt(c2 * (2.0 * l + 1.0) / (4.0 * BODIES_PI)) * pow(l, power);
        sum += (2.2e-16 * (l * (l + 1.0) + 20.0) + 1e-13) * b;
    }
    return sum;
}

static double off(shcd_vec3 a, shcd_vec3 b) {
    return shcd_norm(shcd_sub(a, b));
}

/* S and derivatives along two tangents by sums over the basis. */
static void jet_by_sums(const surface *s, int degree, shcd_vec3 w, shcdi_jet *jet) {
    static double y[SHCD_COUNT(TOP)], g[3 * SHCD_COUNT(TOP)], h[6 * SHCD_COUNT(TOP)];
    const shcd_vec3 t[2] = {jet->t1, jet->t2};
    double sum[6][3] = {{0.0}};
    assert_int_equal(shcd_harmonics(degree, w, y, g, h), SHCD_OK);
    for (size_t i = 0; i < SHCD_COUNT(degree); i++) {
        const double *hi = h + 6 * i;
        const shcd_vec3 gi = {g[3 * i], g[3 * i + 1], g[3 * i + 2]};
        double d[6] = {y[i], shcd_dot(gi, t[0]), shcd_dot(gi, t[1])};
        for (int a = 0, n = 3; a < 2; a++) {
            const shcd_vec3 ht = {hi[0] * t[a].x + hi[1] * t[a].y + hi[2] * t[a].z,
                                  hi[1] * t[a].x + hi[3] * t[a].y + hi[4] * t[a].z,
                                  hi[2] * t[a].x + hi[4] * t[a].y + hi[5] * t[a].z};
            for (int b = a; b < 2; b++) {
                d[n++] = shcd_dot(ht, t[b]);
            }
        }
        for (int n = 0; n < 6; n++) {
            for (size_t k = 0; k < 3; k++) {
                sum[n][k] += d[n] * s->coefficients[3 * i + k];
            }
        }
    }
    shcd_vec3 *out[6] = {&jet->s, &jet->s1, &jet->s2, &jet->s11, &jet->s12, &jet->s22};
    for (int n = 0; n < 6; n++) {
        *out[n] = shcd_vec3_make(sum[n][0], sum[n][1], sum[n][2]);
    }
}

static void compare_at(const surface *s, int degree, shcd_vec3 w) {
    shcdi_jet jet, sums;
    shcdi_surface_jet(&s->series, degree, w, &jet);
    sums = jet;
    jet_by_sums(s, degree, w, &sums);
    assert_near(shcd_dot(shcd_cross(jet.t1, jet.t2), w), 1.0, 1e-15);
    const shcd_vec3 p = shcdi_surface_point(&s->series, degree, w);
    assert_at_most(off(p, sums.s), tolerance_of(s, degree, 0));
    assert_at_most(off(jet.s, sums.s), tolerance_of(s, degree, 0));
    assert_at_most(off(jet.s1, sums.s1), tolerance_of(s, degree, 1));
    assert_at_most(off(jet.s2, sums.s2), tolerance_of(s, degree, 1));
    assert_at_most(off(jet.s11, sums.s11), tolerance_of(s, degree, 2));
    assert_at_most(off(jet.s12, sums.s12), tolerance_of(s, degree, 2));
    assert_at_most(off(jet.s22, sums.s22), tolerance_of(s, degree, 2));
}

static shcd_vec3 direction_of_case(check_random *random, int n) {
    const shcd_vec3 w = bodies_random_direction(random);
    if (n < 2) {
        return shcd_vec3_make(0.0, 0.0, n == 0 ? 1.0 : -1.0);
    }
    if (n % 2 == 0) {
        const double r = pow(10.0, check_uniform(random, -17.0, 0.0));
        return shcd_unit(shcd_vec3_make(r * w.x, r * w.y, n % 4 == 0 ? 1.0 : -1.0));
    }
    return w;
}

/* ---- tests ---- */

static void test_surface_is_the_sum_over_the_basis(void **state) {
    static const int degree[] = {1, 2, 3, 4, 5, 7, 10, 15, 20, 31, 45, 60, 150};
    check_random random = {31};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        surface s;
        surface_open_random(&s, degree[d], 100 + d);
        for (int n = 0; n < (degree[d] > 60 ? 60 : 200); n++) {
            const shcd_vec3 w = direction_of_case(&random, n);
            compare_at(&s, degree[d], w);
            if (n % 10 == 0) { /* truncated somewhere below, at degree 0 too */
                compare_at(&s, (int)(check_random_bits(&random) % (uint64_t)degree[d]), w);
            }
        }
        free(s.memory);
    }
}

/* The same series in long double (64 bits of mantissa), at the exact direction of w: that w is a
 * unit vector to rounding only is part of the error. */
static void point_extended(const surface *s, shcd_vec3 direction, long double out[3]) {
    const int top = s->series.degree;
    struct {
        long double x, y, z;
    } w = {direction.x, direction.y, direction.z};
    const long double length = sqrtl(w.x * w.x + w.y * w.y + w.z * w.z);
    w.x /= length;
    w.y /= length;
    w.z /= length;
    long double c = 1.0L, sn = 0.0L, diagonal = 0.282094791773878143474L;
    out[0] = out[1] = out[2] = 0.0L;
    for (int m = 0; m <= top; m++) {
        if (m > 0) {
            const long double next = w.x * c - w.y * sn;
            sn = w.x * sn + w.y * c;
            c = next;
            diagonal *= m == 1 ? sqrtl(3.0L) : sqrtl((2.0L * m + 1.0L) / (2.0L * m));
        }
        long double q = diagonal, before = 0.0L;
        for (int l = m; l <= top; l++) {
            if (l > m) {
                const long double k = (long double)(l - 1) * (l - 1), mm = (long double)m * m;
                const long double a = sqrtl((4.0L * l * l - 1.0L) / ((long double)l * l - mm));
                const long double b = l == m + 1 ? 0.0L : sqrtl((k - mm) / (4.0L * k - 1.0L));
                const long double next = a * (w.z * q - b * before);
                before = q;
                q = next;
            }
            for (size_t i = 0; i < 3; i++) {
                const long double sine = m > 0 ? s->coefficients[3 * SHCD_INDEX(l, -m) + i] : 0.0;
                out[i] += q * (s->coefficients[3 * SHCD_INDEX(l, m) + i] * c + sine * sn);
            }
        }
    }
}

static double worst_rounding(const surface *s, size_t n, check_random *random) {
    double worst = 0.0;
    for (size_t i = 0; i < n; i++) {
        const shcd_vec3 w = direction_of_case(random, (int)i);
        const shcd_vec3 p = shcdi_surface_point(&s->series, s->series.degree, w);
        long double x[3];
        point_extended(s, w, x);
        const double d[3] = {(double)(p.x - x[0]), (double)(p.y - x[1]), (double)(p.z - x[2])};
        worst = fmax(worst, sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
    }
    return worst;
}

static void test_stated_rounding_bound_contains_the_rounding(void **state) {
    static const int degree[] = {1, 5, 15, 40, 150};
    check_random random = {32};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        surface s;
        surface_open_random(&s, degree[d], 200 + d);
        const double bound = shcdi_evaluation_error(s.coefficients, degree[d]);
        const double worst = worst_rounding(&s, check_scaled(400), &random);
        print_message("degree %d: rounding %.2g of the bound\n", degree[d], worst / bound);
        assert_at_most(worst, bound);
        free(s.memory);
    }
}

static void test_stated_rounding_bound_holds_for_one_degree_alone(void **state) {
    /* zonal: all of it at the poles; sectoral: all of it at the equator; and one in between */
    static const int order[3] = {0, 150, 31};
    static double c[3 * SHCD_COUNT(TOP)];
    check_random random = {33};
    (void)state;
    for (int n = 0; n < 3; n++) {
        surface s;
        memset(c, 0, sizeof c);
        c[3 * SHCD_INDEX(TOP, order[n])] = 1.0;
        surface_open(&s, TOP, c);
        assert_at_most(worst_rounding(&s, check_scaled(600), &random),
                       shcdi_evaluation_error(c, TOP));
        free(s.memory);
    }
}

static void test_second_derivatives_agree_with_differences_of_first_ones(void **state) {
    enum { DEGREE = 12 };
    const double step = 0.01;
    static const double weight[3] = {45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0};
    check_random random = {34};
    surface s;
    (void)state;
    surface_open_random(&s, DEGREE, 300);
    /* h^6/140 times the seventh derivative of S' along a great circle, and rounding over h */
    const double tolerance = pow(step, 6.0) / 140.0 * 7.0 * tolerance_of(&s, DEGREE, 8) / 1e-13 +
                             4.0 * tolerance_of(&s, DEGREE, 1) / step;
    for (int n = 0; n < 100; n++) {
        const shcd_vec3 w = direction_of_case(&random, n);
        shcdi_jet at;
        shcdi_surface_jet(&s.series, DEGREE, w, &at);
        const shcd_vec3 v = shcd_unit(shcd_cross(w, bodies_random_direction(&random)));
        const double v1 = shcd_dot(v, at.t1), v2 = shcd_dot(v, at.t2);
        shcd_vec3 second = {0.0, 0.0, 0.0};
        for (int k = -3; k <= 3; k++) {
            const double t = k * step;
            const shcd_vec3 u = shcd_mul_add(shcd_scale(cos(t), w), sin(t), v);
            const shcd_vec3 along = shcd_mul_add(shcd_scale(-sin(t), w), cos(t), v);
            shcdi_jet j;
            if (k == 0) {
                continue;
            }
            shcdi_surface_jet(&s.series, DEGREE, shcd_unit(u), &j);
            const shcd_vec3 first =
                shcd_mul_add(shcd_scale(shcd_dot(along, j.t1), j.s1), shcd_dot(along, j.t2), j.s2);
            second = shcd_mul_add(second, (k < 0 ? -1.0 : 1.0) * weight[abs(k) - 1] / step, first);
        }
        shcd_vec3 expected = shcd_scale(v1 * v1, at.s11);
        expected = shcd_mul_add(expected, 2.0 * v1 * v2, at.s12);
        expected = shcd_mul_add(expected, v2 * v2, at.s22);
        assert_at_most(off(second, expected), tolerance);
    }
    free(s.memory);
}

static void test_model_surface_gives_point_normal_and_jacobian(void **state) {
    check_random random = {35};
    shcd_model *model = bodies_create_random(&random, 9, 0.05);
    surface s;
    (void)state;
    surface_open(&s, 9, shcd_model_coefficients(model));
    for (int n = 0; n < 100; n++) {
        const int degree = n % 3 == 0 ? -1 : (int)(check_random_bits(&random) % 10);
        const int top = degree == -1 ? 9 : degree;
        const shcd_vec3 w = direction_of_case(&random, n);
        const shcd_vec3 d = shcd_scale(pow(10.0, check_uniform(&random, -200.0, 200.0)), w);
        shcd_vec3 point, alone, normal;
        double jacobian[9];
        shcdi_jet jet;
        assert_int_equal(shcd_model_surface(model, degree, d, &point, &normal, jacobian), SHCD_OK);
        assert_int_equal(shcd_model_surface(model, degree, d, &alone, NULL, NULL), SHCD_OK);
        shcdi_surface_jet(&s.series, top, w, &jet);
        /* w after scaling there and back is off by 3e-16, which moves S by the first derivatives */
        const double t0 = 2.0 * tolerance_of(&s, top, 0) + 1e-15 * 3.0, t1 = t0 * 10.0;
        assert_at_most(off(point, jet.s), t0);
        assert_at_most(off(alone, jet.s), t0);
        for (int k = 0; k < 3; k++) {
            const shcd_vec3 row = {jacobian[3 * k], jacobian[3 * k + 1], jacobian[3 * k + 2]};
            const double s1[3] = {jet.s1.x, jet.s1.y, jet.s1.z};
            const double s2[3] = {jet.s2.x, jet.s2.y, jet.s2.z};
            assert_near(shcd_dot(row, jet.t1), s1[k], t1);
            assert_near(shcd_dot(row, jet.t2), s2[k], t1);
            assert_near(shcd_dot(row, w), 0.0, t1);
        }
        if (top > 0) {
            assert_near(shcd_norm(normal), 1.0, 4e-16);
            assert_near(shcd_dot(normal, jet.s1), 0.0, t1);
            assert_near(shcd_dot(normal, jet.s2), 0.0, t1);
            assert_true(shcd_dot(normal, shcd_cross(jet.s1, jet.s2)) > 0.0);
        } else { /* a single point has no normal */
            assert_true(shcd_norm(normal) == 0.0);
        }
    }
    free(s.memory);
    shcd_model_free(model);
}

static void test_model_surface_refuses_bad_arguments(void **state) {
    shcd_model *model = bodies_create_ellipsoid(1.0, 2.0, 3.0);
    const shcd_vec3 w = {0.0, 0.0, 1.0};
    shcd_vec3 p = {9.0, 9.0, 9.0};
    (void)state;
    assert_int_equal(shcd_model_surface(NULL, -1, w, &p, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_surface(model, -2, w, &p, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_surface(model, 2, w, &p, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_surface(model, -1, shcd_vec3_make(0.0, 0.0, 0.0), &p, NULL, NULL),
                     SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_surface(model, -1, shcd_vec3_make(NAN, 0.0, 1.0), &p, NULL, NULL),
                     SHCD_ERR_NOT_FINITE);
    assert_true(p.x == 9.0 && p.y == 9.0 && p.z == 9.0);
    assert_int_equal(shcd_model_surface(model, -1, w, NULL, NULL, NULL), SHCD_OK);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_surface_is_the_sum_over_the_basis),
        cmocka_unit_test(test_stated_rounding_bound_contains_the_rounding),
        cmocka_unit_test(test_stated_rounding_bound_holds_for_one_degree_alone),
        cmocka_unit_test(test_second_derivatives_agree_with_differences_of_first_ones),
        cmocka_unit_test(test_model_surface_gives_point_normal_and_jacobian),
        cmocka_unit_test(test_model_surface_refuses_bad_arguments)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
