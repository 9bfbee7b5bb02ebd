/* SPDX-License-Identifier: BSD-3-Clause */
/* The compiled paths of the evaluation give the same bits, whatever the degree, direction,
 * truncation and alignment; and the functions that make many sums at once give those of one at a
 * time.
 *
 * Only paths that this processor has can run; the portable one always does, and is then compared
 * with itself at another alignment. Which ran is printed. */
#include "model/model.h"
#include "model/norms.h"
#include "support/bodies.h"
#include "support/check.h"

#define TOP SHCD_DEGREE_MAX
#define N_PATHS 3

/* The same series for every path; the last ones with coefficients at 16 bytes from a line. */
typedef struct every_path {
    shcdi_series series[N_PATHS + 1];
    int n;
    double *coefficients, *memory;
} every_path;

static double *line_of(double *memory) {
    return memory + (64 - (uintptr_t)memory % 64) % 64 / sizeof *memory;
}

static void open_paths(every_path *p, int degree, uint64_t seed) {
    const size_t n = 3 * SHCD_COUNT(degree), r = (shcdi_recurrence_size(degree) + 7) / 8 * 8;
    const size_t k = shcdi_packed_size(degree);
    check_random random = {seed};
    p->memory = calloc(n + r + 2 * k + 24, sizeof(double));
    assert_non_null(p->memory);
    double *recurrence = line_of(p->memory), *packed = recurrence + r, *shifted = packed + k + 2;
    p->coefficients = shifted + k;
    for (size_t i = 0; i < n; i++) {
        p->coefficients[i] =
            check_normal(&random) * (i % 7 == 0 ? 0.0 : 1.0); /* zeros of both signs */
    }
    shcdi_recurrence_fill(degree, recurrence);
    shcdi_pack(degree, p->coefficients, packed);
    p->n = 0;
    for (int simd = SHCD_SIMD_PORTABLE; simd <= SHCD_SIMD_AVX512; simd++) {
        if (shcdi_simd_choose(simd) == simd) {
            p->series[p->n++] = (shcdi_series){degree, recurrence, packed, simd};
        }
    }
    p->series[p->n] = p->series[p->n - 1];
    p->series[p->n++].packed = shifted;
    for (int i = 0; i < p->n; i++) {
        memset(shifted, 0x5a, k * sizeof(double));
        shcdi_pack_for(&p->series[i], p->coefficients, shifted);
        assert_memory_equal(packed, shifted, k * sizeof(double));
    }
}

/* Poles, the equator, axes and planes of mirror images, almost poles, and anything else. */
static shcd_vec3 direction(check_random *random, int n) {
    const shcd_vec3 w = bodies_random_direction(random);
    switch (n % 8) {
    case 0:
        return shcd_vec3_make(0.0, -0.0, n % 16 == 0 ? 1.0 : -1.0);
    case 1:
        return shcd_unit(shcd_vec3_make(w.x, w.y, n % 16 == 1 ? 0.0 : -0.0));
    case 2:
        return shcd_vec3_make(n % 16 == 2 ? -1.0 : 1.0, -0.0, 0.0);
    case 3:
        return shcd_unit(shcd_vec3_make(0.0, w.y, w.z));
    case 4: {
        const double r = pow(10.0, check_uniform(random, -170.0, 0.0));
        return shcd_unit(shcd_vec3_make(r * w.x, r * w.y, w.z < 0.0 ? -1.0 : 1.0));
    }
    default:
        return w;
    }
}

#define assert_same(a, b, size) assert_memory_equal(a, b, size)

/* Everything that one direction gives, by one path. */
typedef struct answers {
    shcd_vec3 point, partial[TOP + 1];
    shcdi_jet first, jet;
} answers;

static void ask(const shcdi_series *s, int degree, shcd_vec3 w, answers *a) {
    memset(a, 0, sizeof *a);
    a->point = shcdi_surface_point(s, degree, w);
    shcdi_surface_first(s, degree, w, &a->first);
    shcdi_surface_jet(s, degree, w, &a->jet);
    shcdi_surface_partial(s, w, a->partial);
}

static void compare_direction(const every_path *p, int degree, shcd_vec3 w) {
    static answers first, other;
    ask(&p->series[0], degree, w, &first);
    for (int i = 1; i < p->n; i++) {
        ask(&p->series[i], degree, w, &other);
        assert_same(&first, &other, sizeof first);
    }
    assert_same(&first.first, &first.jet, offsetof(shcdi_jet, s11));
    assert_same(&first.partial[degree], &first.point, sizeof first.point);
}

/* ---- tests ---- */

static void test_paths_give_the_same_bits_at_every_degree(void **state) {
    check_random random = {41};
    (void)state;
    for (int degree = 0; degree <= TOP; degree++) {
        every_path p;
        open_paths(&p, degree, 400 + (uint64_t)degree);
        const int n = degree < 40 ? (int)check_scaled(48) : 16;
        for (int i = 0; i < n; i++) {
            const shcd_vec3 w = direction(&random, i);
            compare_direction(&p, degree, w);
            compare_direction(&p, (int)(check_random_bits(&random) % ((uint64_t)degree + 1)), w);
        }
        if (degree == TOP) {
            print_message("paths:");
            for (int i = 0; i < p.n; i++) {
                print_message(" %d", p.series[i].simd);
            }
            print_message("\n");
        }
        free(p.memory);
    }
}

static void test_every_partial_sum_is_the_truncated_point(void **state) {
    static const int degree[] = {0, 1, 7, 8, 15, 16, 41, 150};
    check_random random = {42};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        every_path p;
        open_paths(&p, degree[d], 600 + d);
        for (int i = 0; i < 16; i++) {
            const shcd_vec3 w = direction(&random, i);
            const shcdi_series *s = &p.series[i % p.n];
            shcd_vec3 sum[TOP + 1];
            shcdi_surface_partial(s, w, sum);
            for (int l = 0; l <= degree[d]; l++) {
                const shcd_vec3 point = shcdi_surface_point(s, l, w);
                assert_same(&sum[l], &point, sizeof point);
            }
        }
        free(p.memory);
    }
}

static void test_points_together_are_points_alone(void **state) {
    enum { N = 61 }; /* no multiple of any number of lanes */
    static const int degree[] = {0, 1, 5, 7, 8, 9, 15, 23, 30, 77};
    check_random random = {43};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        every_path p;
        open_paths(&p, degree[d], 700 + d);
        shcd_vec3 w[N], out[N + 1];
        for (int i = 0; i < N; i++) {
            w[i] = direction(&random, i);
        }
        for (int path = 0; path < p.n; path++) {
            for (int top = degree[d]; top >= 0; top = top > 0 ? top / 2 : -1) {
                for (size_t n = 0; n <= N; n += n < 9 ? 1 : 26) {
                    memset(out, 0x5a, sizeof out);
                    shcdi_surface_points(&p.series[path], top, w, n, out);
                    for (size_t i = 0; i < n; i++) {
                        const shcd_vec3 alone = shcdi_surface_point(&p.series[path], top, w[i]);
                        assert_same(&out[i], &alone, sizeof alone);
                    }
                    assert_int_equal(((unsigned char *)&out[n])[0], 0x5a);
                }
            }
        }
        free(p.memory);
    }
}

/* Degree by degree, nothing before and nothing behind. */
static void test_norms_are_sums_of_squares_on_every_path(void **state) {
    check_random random = {47};
    (void)state;
    for (int degree = 0; degree <= SHCD_DEGREE_MAX; degree += degree < 20 ? 1 : 26) {
        const size_t n = 3 * SHCD_COUNT(degree);
        /* allocated to the last byte, for a sanitizer to see */
        double *a = malloc(n * sizeof *a), *b = malloc(n * sizeof *b);
        double *factors = malloc(SHCDI_NORMS * ((size_t)degree + 1) * sizeof *factors);
        double first[SHCD_DEGREE_MAX + 1], other[SHCD_DEGREE_MAX + 1], expected[SHCDI_NORMS] = {0};
        assert_true(a != NULL && b != NULL && factors != NULL);
        for (size_t i = 0; i < n; i++) {
            a[i] = check_normal(&random);
            b[i] = i % 5 == 0 ? a[i] : check_normal(&random);
        }
        shcdi_surface_squares(SHCD_SIMD_PORTABLE, degree, a, b, first);
        for (int l = 0; l <= degree; l++) {
            double sum = 0.0;
            for (size_t i = 3 * SHCD_INDEX(l, -l); i < 3 * SHCD_INDEX(l, l) + 3; i++) {
                sum += (a[i] - b[i]) * (a[i] - b[i]);
            }
            /* n roundings of a sum of positive terms, in either order */
            assert_near(first[l], sum, 2.0 * 3.0 * (2.0 * l + 1.0) * 2.3e-16 * sum);
            shcdi_norm_factors(degree, l, factors + SHCDI_NORMS * l);
            for (int k = 0; k < SHCDI_NORMS; k++) {
                expected[k] += sqrt(sum) * factors[SHCDI_NORMS * l + k];
            }
        }
        for (int simd = SHCD_SIMD_PORTABLE; simd <= SHCD_SIMD_AVX512; simd++) {
            double sum[SHCDI_NORMS];
            if (shcdi_simd_choose(simd) != simd) {
                continue;
            }
            shcdi_surface_squares(simd, degree, a, b, other);
            assert_same(first, other, ((size_t)degree + 1) * sizeof *first);
            shcdi_norms(simd, factors, degree, a, b, sum);
            for (int k = 0; k < SHCDI_NORMS; k++) {
                /* rounded up, by no more than 1e-11 and the roundings */
                assert_true(sum[k] >= expected[k] && sum[k] <= expected[k] * (1.0 + 2e-11));
            }
        }
        /* the last factor is that of the rounding of an evaluation */
        shcdi_norms(SHCD_SIMD_PORTABLE, factors, degree, a, memset(b, 0, n * sizeof *b), expected);
        const double error = shcdi_evaluation_error(a, degree);
        assert_near(expected[4], error, 2e-11 * error);
        free(a);
        free(b);
        free(factors);
    }
}

static void test_images_are_the_points_of_the_mirror_images(void **state) {
    enum { N = 45 };
    static const int degree[] = {0, 1, 2, 7, 8, 15, 16, 30, 77, 150};
    check_random random = {44};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        every_path p;
        open_paths(&p, degree[d], 800 + d);
        /* both are within the stated error of the truth */
        const double bound = 2.0 * shcdi_evaluation_error(p.coefficients, degree[d]);
        shcd_vec3 w[N], first[16 * N], other[16 * N + 1];
        for (int i = 0; i < N; i++) {
            const shcd_vec3 v = direction(&random, i);
            w[i] = shcd_vec3_make(fabs(v.x), fabs(v.y), fabs(v.z));
        }
        shcdi_surface_images(&p.series[0], w, N, first);
        for (int path = 1; path < p.n; path++) {
            shcdi_surface_images(&p.series[path], w, N, other);
            assert_same(first, other, sizeof first);
        }
        double worst = 0.0;
        for (size_t i = 0; i < 16 * N; i++) {
            const size_t image = i / N;
            const shcd_vec3 of = w[i % N];
            const shcd_vec3 u = image & 8 ? shcd_vec3_make(of.y, of.x, of.z) : of;
            const shcd_vec3 v = {image & 1 ? -u.x : u.x, image & 2 ? -u.y : u.y,
                                 image & 4 ? -u.z : u.z};
            const shcd_vec3 alone = shcdi_surface_point(&p.series[0], degree[d], v);
            worst = fmax(worst, shcd_norm(shcd_sub(first[i], alone)));
        }
        assert_at_most(worst, bound);
        /* fewer directions: the same bits, and nothing beyond */
        memset(other, 0x5a, sizeof other);
        shcdi_surface_images(&p.series[p.n - 1], w, 3, other);
        for (size_t i = 0; i < 48; i++) {
            assert_same(&other[i], &first[i / 3 * N + i % 3], sizeof other[i]);
        }
        assert_int_equal(((unsigned char *)&other[48])[0], 0x5a);
        /* and on a lattice */
        enum { STRIDE = (N + 7) / 8 * 8 };
        const shcdi_lattice lattice = {{0.125, -0.5, 1.0}, 0x1p6, STRIDE};
        static int32_t place[48 * STRIDE], again[48 * STRIDE];
        shcdi_surface_lattice(&p.series[0], &lattice, w, N, place);
        for (int path = 1; path < p.n; path++) {
            shcdi_surface_lattice(&p.series[path], &lattice, w, N, again);
            for (size_t at = 0; at < 48 * STRIDE; at++) {
                assert_true(place[at] == again[at] || at % STRIDE >= N); /* filled up or not */
            }
        }
        for (size_t i = 0; i < 16 * N; i++) {
            const size_t at = i / N * STRIDE + i % N;
            const shcd_vec3 from = shcd_sub(first[i], lattice.origin);
            assert_true(place[at] == (int32_t)(from.x * lattice.factor));
            assert_true(place[16 * STRIDE + at] == (int32_t)(from.y * lattice.factor));
            assert_true(place[32 * STRIDE + at] == (int32_t)(from.z * lattice.factor));
        }
        free(p.memory);
    }
}

/* ---- the choice, through the public interface ---- */

static void test_model_uses_the_wanted_path(void **state) {
    check_random random = {45};
    double c[3 * SHCD_COUNT(5)], enclosure[N_PATHS + 1] = {0.0};
    shcd_vec3 point[N_PATHS + 1];
    const shcd_vec3 w = {0.3, -0.4, 0.5};
    (void)state;
    bodies_random_coefficients(&random, 5, 0.05, c);
    for (int simd = SHCD_SIMD_AUTO; simd <= SHCD_SIMD_AVX512; simd++) {
        shcd_model_def def = SHCD_MODEL_DEF_INIT;
        shcd_model *model = NULL;
        shcd_error error = {SHCD_OK, ""};
        shcd_model_info info = SHCD_MODEL_INFO_INIT;
        def.degree = 5;
        def.coefficients = c;
        def.simd = simd;
        const shcd_status status = shcd_model_create(&def, NULL, &model, &error);
        if (shcdi_simd_choose(simd) == 0) {
            assert_int_equal(status, SHCD_ERR_UNSUPPORTED);
            assert_null(model);
            assert_non_null(strstr(error.message, "AVX"));
            point[simd] = point[SHCD_SIMD_AUTO];
            enclosure[simd] = enclosure[SHCD_SIMD_AUTO];
            continue;
        }
        assert_int_equal(status, SHCD_OK);
        assert_int_equal(shcd_model_describe(model, &info), SHCD_OK);
        assert_int_equal(info.simd, shcdi_simd_choose(simd));
        assert_true(simd == SHCD_SIMD_AUTO || info.simd == simd);
        assert_int_equal(shcd_model_surface(model, -1, w, &point[simd], NULL, NULL), SHCD_OK);
        assert_int_equal(shcd_model_enclosure_offset(model, 2, &enclosure[simd]), SHCD_OK);
        shcd_model_free(model);
        assert_same(&point[simd], &point[SHCD_SIMD_AUTO], sizeof point[simd]);
        assert_same(&enclosure[simd], &enclosure[SHCD_SIMD_AUTO], sizeof enclosure[simd]);
    }
}

static void test_model_refuses_an_unknown_path(void **state) {
    const double c[12] = {0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    (void)state;
    def.degree = 1;
    def.coefficients = c;
    for (int simd = -1; simd <= 4; simd += 5) {
        def.simd = simd;
        assert_int_equal(shcd_model_create(&def, NULL, &model, &error), SHCD_ERR_ARGUMENT);
        assert_null(model);
        assert_non_null(strstr(error.message, "simd"));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_paths_give_the_same_bits_at_every_degree),
        cmocka_unit_test(test_every_partial_sum_is_the_truncated_point),
        cmocka_unit_test(test_points_together_are_points_alone),
        cmocka_unit_test(test_norms_are_sums_of_squares_on_every_path),
        cmocka_unit_test(test_images_are_the_points_of_the_mirror_images),
        cmocka_unit_test(test_model_uses_the_wanted_path),
        cmocka_unit_test(test_model_refuses_an_unknown_path)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
